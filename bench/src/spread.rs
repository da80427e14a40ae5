//! How repeated times spread.

use serde::Serialize;

/// Least, middle and nearly largest of repeated times [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// The least: what the work costs when nothing disturbs it.
    pub min: f64,
    /// Half of the times are below.
    pub median: f64,
    /// 99 of 100 times are at most this.
    pub p99: f64,
}

impl Spread {
    /// Of at least one time, in any order; NaN of none.
    pub(crate) fn of(mut times_ms: Vec<f64>) -> Self {
        times_ms.sort_by(f64::total_cmp);
        // Nearest rank: the smallest time that is not exceeded by the given share of all.
        let quantile = |share: f64| {
            let rank = (share * times_ms.len() as f64).ceil() as usize;
            times_ms.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
        };
        Self { min: quantile(0.0), median: quantile(0.5), p99: quantile(0.99) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_nearest_ranks() {
        // Of 1, 2, ..., 200 in a scrambled order: 100 times are at most 100, and 198 at most 198.
        let scrambled = (0..200).map(|i| f64::from(i * 77 % 200 + 1)).collect();
        assert_eq!(Spread::of(scrambled), Spread { min: 1.0, median: 100.0, p99: 198.0 });
        assert_eq!(Spread::of(vec![3.0]), Spread { min: 3.0, median: 3.0, p99: 3.0 });
    }
}
