//! How numbers of many cases spread.

use serde::Serialize;

/// Number, mean and quantiles; the latter `None` of nothing. Between ranks, linear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantiles {
    /// How many numbers.
    pub n: usize,
    /// Mean.
    pub mean: Option<f64>,
    /// A tenth lies below.
    pub p10: Option<f64>,
    /// Half lies below.
    pub median: Option<f64>,
    /// Nine tenths lie below.
    pub p90: Option<f64>,
}

impl Quantiles {
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let mean = (n > 0).then(|| values.iter().sum::<f64>() / n as f64);
        let quantile = |share: f64| {
            let place = share * n.checked_sub(1)? as f64;
            let below = place.floor() as usize;
            let above = (below + 1).min(n - 1);
            Some(values[below] + (place - below as f64) * (values[above] - values[below]))
        };
        Self { n, mean, p10: quantile(0.1), median: quantile(0.5), p90: quantile(0.9) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_ranks() {
        let found = Quantiles::of((0..=20).map(f64::from));
        assert_eq!(
            (found.n, found.mean, found.p10, found.median, found.p90),
            (21, Some(10.0), Some(2.0), Some(10.0), Some(18.0))
        );
        let found = Quantiles::of([4.0, 1.0]);
        assert_eq!((found.median, found.p10), (Some(2.5), Some(1.3)));
        assert_eq!(Quantiles::of([f64::NAN]).median, None);
    }
}
