//! Correlations and ratios of paired values.

/// Sums over pairs, enough for means, deviations and correlation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pairs {
    n: f64,
    sums: [f64; 2],
    squares: [f64; 2],
    product: f64,
}

impl Pairs {
    pub(super) fn of(pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut sums = Self::default();
        for (x, y) in pairs.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
            sums.n += 1.0;
            sums.sums = [sums.sums[0] + x, sums.sums[1] + y];
            sums.squares = [sums.squares[0] + x * x, sums.squares[1] + y * y];
            sums.product += x * y;
        }
        sums
    }

    /// Whether there are enough pairs to say anything.
    pub(super) fn are_enough(&self) -> bool {
        self.n >= 20.0
    }

    fn variance(&self, which: usize) -> f64 {
        (self.squares[which] / self.n - (self.sums[which] / self.n).powi(2)).max(0.0)
    }

    /// Standard deviation of the first or second values.
    pub(super) fn deviation(&self, which: usize) -> f64 {
        self.variance(which).sqrt()
    }

    /// Root mean square of the second values.
    pub(super) fn size_of_second(&self) -> f64 {
        (self.squares[1] / self.n).sqrt()
    }

    /// Size of the second values over that of the first; NaN when those are all 0.
    pub(super) fn ratio(&self) -> f64 {
        if self.squares[0] > 0.0 { (self.squares[1] / self.squares[0]).sqrt() } else { f64::NAN }
    }

    /// Pearson's correlation; 0 when either does not vary.
    pub(super) fn correlation(&self) -> f64 {
        let scale = (self.variance(0) * self.variance(1)).sqrt();
        let covariance = self.product / self.n - self.sums[0] * self.sums[1] / (self.n * self.n);
        if scale > 0.0 { covariance / scale } else { 0.0 }
    }
}

/// Mean and standard deviation.
pub(super) fn mean_and_deviation(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let pairs = Pairs::of(values.into_iter().map(|value| (value, 0.0)));
    if pairs.n > 0.0 { (pairs.sums[0] / pairs.n, pairs.deviation(0)) } else { (0.0, 0.0) }
}

/// The value below which `share` of the others lie; 0 for none.
pub(crate) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}
