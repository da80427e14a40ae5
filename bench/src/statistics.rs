//! What may be said of shares, means and pairs.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

/// Standard normal quantile of 97.5 %: intervals cover 95 %.
pub const WILSON_Z: f64 = 1.959_963_984_540_054;

/// How often values are drawn again for an interval.
const N_DRAWS: usize = 2000;
const SEED: u64 = 17;

/// A mean with the ends of its 95 % interval (percentile bootstrap over the values).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Mean {
    /// Of at least one value.
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let n = values.len();
        let mut draw = || (0..n).map(|_| values[rng.random_range(0..n)]).sum::<f64>() / n as f64;
        let mut means: Vec<f64> = (0..N_DRAWS).map(|_| draw()).collect();
        means.sort_by(f64::total_cmp);
        let at = |share: f64| means[(share * (N_DRAWS - 1) as f64).round() as usize];
        Some(Self { value: values.iter().sum::<f64>() / n as f64, low: at(0.025), high: at(0.975) })
    }
}

impl Mean {
    /// Of sums over numbers of cases, the groups drawn anew for the interval; no case is no mean.
    pub(crate) fn of_ratios(groups: &[(f64, f64)]) -> Option<Self> {
        let ratio = |groups: &mut dyn Iterator<Item = (f64, f64)>| {
            let (sum, n) = groups.fold((0.0, 0.0), |all, group| (all.0 + group.0, all.1 + group.1));
            sum / n
        };
        if groups.is_empty() {
            return None;
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut means: Vec<f64> = (0..N_DRAWS)
            .map(|_| ratio(&mut (0..groups.len()).map(|_| groups[rng.random_range(0..groups.len())])))
            .collect();
        means.sort_by(f64::total_cmp);
        let at = |share: f64| means[(share * (N_DRAWS - 1) as f64).round() as usize];
        Some(Self { value: ratio(&mut groups.iter().copied()), low: at(0.025), high: at(0.975) })
    }
}

/// Where 95 % of such intervals hold the true probability of what came `n_hit` times in `n` > 0 trials
/// (Wilson 1927): all probabilities that a score test at 5 % would not reject.
pub fn wilson_interval(n_hit: usize, n: usize) -> [f64; 2] {
    let (n, share) = (n as f64, n_hit as f64 / n as f64);
    let z_squared_over_n = WILSON_Z * WILSON_Z / n;
    let centre = share + 0.5 * z_squared_over_n;
    let half_width = (z_squared_over_n * (share * (1.0 - share) + 0.25 * z_squared_over_n)).sqrt();
    // At no hit or no miss one end is the bound itself, up to rounding.
    [centre - half_width, centre + half_width].map(|end| (end / (1.0 + z_squared_over_n)).clamp(0.0, 1.0))
}

/// Probability, were either side as likely, of pairs that differ to fall as unevenly as these or more so (McNemar 1947, in
/// the exact form, which is the sign test, two-sided). 1 where no pair differs.
pub fn mcnemar_p_value(n_more: usize, n_less: usize) -> f64 {
    let n = n_more + n_less;
    let ln_all = n as f64 * std::f64::consts::LN_2;
    let tail: f64 = (0..=n_more.min(n_less)).map(|k| libm::exp(ln_choose(n, k) - ln_all)).sum();
    (2.0 * tail).min(1.0)
}

/// The same cases driven twice, by one and by another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Paired {
    /// Cases.
    pub n: usize,
    /// Cases in which only the one reached the goal.
    pub n_only_one: usize,
    /// Cases in which only the other did.
    pub n_only_other: usize,
    /// Probability of a split at least as uneven by chance, two-sided and exact (McNemar).
    pub p_value: f64,
    /// Time to the goal of the one less that of the other, over the cases in which both reached it [s]; bootstrap over
    /// those cases.
    pub time_difference_s: Option<Mean>,
}

impl Paired {
    /// Of the times in which the one and the other reached the goal [s]; `None` for one that did not.
    pub(crate) fn of(cases_s: &[[Option<f64>; 2]]) -> Self {
        let count = |has_arrived: [bool; 2]| {
            cases_s.iter().filter(|case_s| case_s.map(|time_s| time_s.is_some()) == has_arrived).count()
        };
        let (n_only_one, n_only_other) = (count([true, false]), count([false, true]));
        let differences_s: Vec<f64> =
            cases_s.iter().filter_map(|[one_s, other_s]| Some((*one_s)? - (*other_s)?)).collect();
        Self {
            n: cases_s.len(),
            n_only_one,
            n_only_other,
            p_value: mcnemar_p_value(n_only_one, n_only_other),
            time_difference_s: Mean::of(&differences_s),
        }
    }
}

/// Tables whose probability is the observed one up to rounding count as equally rare.
const ROUNDING: f64 = 1.0 + 1e-9;

/// So many hits in so many trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Count {
    /// Hits.
    pub n_hit: usize,
    /// Trials; at least one.
    pub n: usize,
}

impl Count {
    /// Hits over trials.
    pub fn share(self) -> f64 {
        self.n_hit as f64 / self.n as f64
    }
}

/// Where 95 % of such intervals hold the true difference of two independent shares, the first less the second
/// (Newcombe, Statistics in Medicine 17 (1998) 873, method 10): Wilson's intervals, squared and added.
pub fn newcombe_interval(first: Count, second: Count) -> [f64; 2] {
    let difference = first.share() - second.share();
    let [[low, high], [other_low, other_high]] =
        [first, second].map(|count| wilson_interval(count.n_hit, count.n));
    let below = (first.share() - low).hypot(other_high - second.share());
    let above = (high - first.share()).hypot(second.share() - other_low);
    [difference - below, difference + above]
}

/// Probability, were two independent shares the same, of hits as unevenly shared out as these or more so (Fisher's exact
/// test, two-sided: all that is no more probable than what was seen).
pub fn fisher_exact(first: Count, second: Count) -> f64 {
    let n_hit = first.n_hit + second.n_hit;
    let least = n_hit.saturating_sub(second.n);
    let ln_weight = |k: usize| ln_choose(first.n, k) + ln_choose(second.n, n_hit - k);
    let total = ln_choose(first.n + second.n, n_hit);
    let probability = |k: usize| libm::exp(ln_weight(k) - total);
    let seen = probability(first.n_hit) * ROUNDING;
    let rare = (least..=n_hit.min(first.n)).map(probability).filter(|&probability| probability <= seen);
    rare.sum::<f64>().min(1.0)
}

/// Probabilities made larger so that one of them all falls below a bound by luck no more often than the bound says
/// (Holm, Scandinavian Journal of Statistics 6 (1979) 65), however they depend on each other.
pub fn holm(probabilities: &[f64]) -> Vec<f64> {
    let n = probabilities.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
    let (mut adjusted, mut largest) = (vec![0.0; n], 0.0_f64);
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((n - rank) as f64 * probabilities[index]).min(1.0);
        adjusted[index] = largest;
    }
    adjusted
}

fn ln_choose(n: usize, k: usize) -> f64 {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_is_the_published_one() {
        // Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3; and 8 of 10.
        let published = [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
            (8, 10, [0.4902, 0.9433]),
        ];
        for (n_hit, n, expected) in published {
            let found = wilson_interval(n_hit, n);
            for end in 0..2 {
                assert!((found[end] - expected[end]).abs() < 5.1e-5, "{n_hit} of {n}: {found:?}");
            }
        }
    }

    #[test]
    fn ends_are_where_the_score_test_just_rejects() {
        for (n_hit, n) in [(1, 20), (8, 10), (13, 20), (19, 20)] {
            for end in wilson_interval(n_hit, n) {
                let off = n_hit as f64 - n as f64 * end;
                let score = off / (n as f64 * end * (1.0 - end)).sqrt();
                assert!((score.abs() - WILSON_Z).abs() < 1e-9, "{n_hit} of {n}: {score}");
            }
        }
    }

    #[test]
    fn hits_and_misses_mirror_each_other() {
        for n_hit in 0..=20 {
            let [low, high] = wilson_interval(n_hit, 20);
            let [mirrored_high, mirrored_low] = wilson_interval(20 - n_hit, 20).map(|end| 1.0 - end);
            assert!((low - mirrored_low).abs() < 1e-12 && (high - mirrored_high).abs() < 1e-12);
            assert!(0.0 <= low && low <= n_hit as f64 / 20.0 && n_hit as f64 / 20.0 <= high && high <= 1.0);
        }
    }

    #[test]
    fn pairs_that_differ_are_tested_exactly() {
        // Of 5 pairs all one way: 2 / 2^5. Of 9 and 1: 2 (1 + 10) / 2^10. Even splits say nothing.
        assert!((mcnemar_p_value(5, 0) - 0.0625).abs() < 1e-12);
        assert!((mcnemar_p_value(1, 9) - 22.0 / 1024.0).abs() < 1e-12);
        for even in [0, 4, 550] {
            assert_eq!(mcnemar_p_value(even, even), 1.0, "{even}");
        }
        // Many pairs are nearly normal: the two tails beyond (1060 - 1000 - 0.5) / sqrt(500), hence of 2.661.
        assert!((mcnemar_p_value(940, 1060) - 0.007_79).abs() < 1e-4, "{}", mcnemar_p_value(940, 1060));
    }

    #[test]
    fn a_mean_of_equal_values_is_certain_and_of_none_is_none() {
        assert_eq!(Mean::of(&[2.0; 7]), Some(Mean { value: 2.0, low: 2.0, high: 2.0 }));
        assert_eq!(Mean::of(&[]), None);
        // Values of variance 1/12 spread over (0, 1): the interval of 300 is 2 x 1.96 sqrt(1 / 12 / 300) wide.
        let even: Vec<f64> = (0..300).map(|k| (f64::from(k) + 0.5) / 300.0).collect();
        let mean = Mean::of(&even).unwrap();
        assert!((mean.value - 0.5).abs() < 1e-12 && mean.low < 0.5 && 0.5 < mean.high);
        assert!((mean.high - mean.low - 0.0653).abs() < 0.006, "{mean:?}");
    }

    fn count(n_hit: usize, n: usize) -> Count {
        Count { n_hit, n }
    }

    #[test]
    fn difference_interval_is_the_published_one() {
        // Newcombe, Statistics in Medicine 17 (1998) 873, table II, method 10.
        let published = [
            (count(56, 70), count(48, 80), [0.0524, 0.3339]),
            (count(9, 10), count(3, 10), [0.1705, 0.8090]),
            (count(6, 7), count(2, 7), [0.0582, 0.8062]),
            (count(5, 56), count(0, 29), [-0.0381, 0.1926]),
            (count(0, 10), count(0, 20), [-0.1611, 0.2775]),
        ];
        for (first, second, expected) in published {
            let found = newcombe_interval(first, second);
            for end in 0..2 {
                assert!((found[end] - expected[end]).abs() < 5.1e-5, "{first:?}, {second:?}: {found:?}");
            }
        }
    }

    #[test]
    fn fishers_test_is_his_own() {
        // The lady who tasted tea, three of four right: (1 + 16 + 16 + 1) / 70.
        assert!((fisher_exact(count(3, 4), count(1, 4)) - 34.0 / 70.0).abs() < 1e-12);
        // Convicted twins of criminals, ten of thirteen and two of seventeen.
        assert!((fisher_exact(count(10, 13), count(2, 17)) - 5.367e-4).abs() < 5e-8);
        assert!((fisher_exact(count(5, 5), count(5, 5)) - 1.0).abs() < 1e-12);
        // All against none of 200: two of C(400, 200) tables, of 4^200 / sqrt(200 pi) to one part in 1600.
        let rarest = 2.0 * (200.0 * std::f64::consts::PI).sqrt() * 4.0_f64.powi(-200);
        assert!((fisher_exact(count(200, 200), count(0, 200)) / rarest - 1.0).abs() < 1e-3);
    }

    #[test]
    fn holm_multiplies_by_what_is_left_and_keeps_the_order() {
        // 4 x 0.005, 3 x 0.01, 2 x 0.03, and no less for 0.04.
        for (found, expected) in holm(&[0.01, 0.04, 0.03, 0.005]).into_iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        assert_eq!((holm(&[0.7, 0.9]), holm(&[])), (vec![1.0, 1.0], vec![]));
    }
}
