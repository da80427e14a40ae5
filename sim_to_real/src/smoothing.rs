//! Local quadratic smoothing (Savitzky and Golay 1964).

/// Rows on either side.
const REACH: usize = 5;

/// Each value replaced by that of the parabola fitted to the rows within reach of it; at the ends, by the value itself.
///
/// With m rows on either side the weight of row k is (3 m^2 + 3 m - 1 - 5 k^2) 3 / ((2 m - 1)(2 m + 1)(2 m + 3)).
pub(crate) fn smoothed(values: &[f64]) -> Vec<f64> {
    let m = REACH as f64;
    let weight = |k: f64| {
        3.0 * (3.0 * m * m + 3.0 * m - 1.0 - 5.0 * k * k)
            / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0))
    };
    let mut smooth = values.to_vec();
    for (row, window) in values.windows(2 * REACH + 1).enumerate() {
        let weighed = window.iter().enumerate().map(|(k, value)| weight(k as f64 - m) * value);
        smooth[row + REACH] = weighed.sum();
    }
    smooth
}

#[cfg(test)]
mod tests {
    use super::smoothed;

    /// A parabola is its own fit.
    #[test]
    fn a_parabola_stays() {
        let parabola: Vec<f64> =
            (0..30).map(|k| 2.0 - 0.3 * f64::from(k) + 0.07 * f64::from(k * k)).collect();
        for (smooth, value) in smoothed(&parabola).iter().zip(&parabola) {
            assert!((smooth - value).abs() < 1e-9);
        }
    }

    /// The centre weight 89 / 429 is what a single outlier leaves.
    #[test]
    fn an_outlier_shrinks_to_its_weight() {
        let mut values = vec![0.0; 21];
        values[10] = 1.0;
        assert!((smoothed(&values)[10] - 89.0 / 429.0).abs() < 1e-12);
    }
}
