//! Conditional value at risk of a discrete distribution, exact: the bin that the level cuts counts by the part
//! inside (NOTES 1.4).
//!
//! CVaR from the left at level a is the mean of the worst, that is lowest, share a of the outcomes,
//! (1/a) sum_b v_b min(p_b, max(0, a - C_{b-1})) with C the cumulative probability and v ascending;
//! from the right it is the mean of the largest share a. Taking the whole bin that the level cuts, as published
//! implementations do, is optimistic by 0.04 on average.
//!
//! Whole maps take the same number from partial moments ([`crate::PartialMoments`]), in lanes in `physics_prior` and
//! `evidential`. This walk shares no line with them on purpose: it is what they are held against.

/// Share of the worst outcomes that CVaR averages over, in (0, 1]: 1 is the mean, towards 0 the worst case.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct CvarLevel(f64);

/// A level outside (0, 1].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("alpha (CVaR level): expected a number in (0, 1], found {found}")]
pub struct CvarLevelError {
    /// What was given.
    pub found: f64,
}

impl CvarLevel {
    /// All outcomes: CVaR is the mean.
    pub const MEAN: Self = Self(1.0);

    /// A level in (0, 1]; refuses everything else, NaN included.
    pub fn new(level: f64) -> Result<Self, CvarLevelError> {
        if level > 0.0 && level <= 1.0 { Ok(Self(level)) } else { Err(CvarLevelError { found: level }) }
    }

    /// The level as a number.
    pub fn get(self) -> f64 {
        self.0
    }

    /// One over the level, bounded so that f32 does not overflow: below 1e-20 the tail is one outcome whatever the
    /// level.
    pub fn reciprocal(self) -> f32 {
        1.0 / (self.0 as f32).max(1e-20)
    }
}

impl TryFrom<f64> for CvarLevel {
    type Error = CvarLevelError;
    fn try_from(level: f64) -> Result<Self, CvarLevelError> {
        Self::new(level)
    }
}

impl From<CvarLevel> for f64 {
    fn from(level: CvarLevel) -> Self {
        level.0
    }
}

/// Mean of the lowest share `level` of a distribution: the worst expected traction (PIETRA, equation 6).
///
/// `values` ascend and have one probability each; the probabilities sum to one up to rounding.
pub fn lower_tail_cvar(values: &[f32], probabilities: &[f32], level: CvarLevel) -> f32 {
    tail_mean(values.iter().copied().zip(probabilities.iter().copied()), level)
}

/// Mean of the highest share `level` of a distribution: the worst expected |roll| or |pitch|
/// (PIETRA, equation 6).
///
/// `values` ascend and have one probability each; the probabilities sum to one up to rounding.
pub fn upper_tail_cvar(values: &[f32], probabilities: &[f32], level: CvarLevel) -> f32 {
    tail_mean(values.iter().copied().zip(probabilities.iter().copied()).rev(), level)
}

/// Walks from the bad end until the mass is used up. Empty bins on the way, as the end atoms often are, take
/// nothing and must not end the walk. Dividing by what was taken instead of the level keeps rounding of the
/// probabilities' sum out of the mean.
pub(crate) fn tail_mean(from_worst: impl Iterator<Item = (f32, f32)>, level: CvarLevel) -> f32 {
    let mut left = level.0;
    let (mut taken, mut sum) = (0.0, 0.0);
    for (value, probability) in from_worst {
        let part = f64::from(probability).min(left);
        sum += part * f64::from(value);
        taken += part;
        left -= part;
        if left <= 0.0 {
            break;
        }
    }
    (sum / taken) as f32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{Bins, N_BINS};

    const LEVELS: [f64; 12] = [1e-9, 1e-4, 0.01, 0.05, 0.1, 0.25, 0.4, 0.5, 0.6, 0.8, 0.999, 1.0];

    fn level(level: f64) -> CvarLevel {
        CvarLevel::new(level).unwrap()
    }

    /// Random weights of which about half are zero, ends included.
    fn probabilities() -> impl Strategy<Value = [f32; N_BINS]> {
        let weight = prop_oneof![Just(0.0f64), 0.0..1.0f64];
        prop::array::uniform12(weight).prop_filter_map("some mass", |weights| {
            let sum: f64 = weights.iter().sum();
            (sum > 1e-3).then(|| weights.map(|w| (w / sum) as f32))
        })
    }

    /// (1/a) int_0^a VaR_u du by the midpoint rule over quantiles.
    fn quantile_integral(values: &[f32], probabilities: &[f32], a: f64, n: usize) -> f64 {
        let quantile = |u: f64| {
            let mut cumulative = 0.0;
            for (value, p) in values.iter().zip(probabilities) {
                cumulative += f64::from(*p);
                if cumulative >= u {
                    return f64::from(*value);
                }
            }
            f64::from(values[values.len() - 1])
        };
        (0..n).map(|k| quantile(a * (k as f64 + 0.5) / n as f64)).sum::<f64>() / n as f64
    }

    /// max over t of t - E[(t - Z)^+] / a; the maximum lies at one of the values.
    fn rockafellar_uryasev_lower(values: &[f32], probabilities: &[f32], a: f64) -> f64 {
        let objective = |t: f64| {
            let shortfall = |(v, p): (&f32, &f32)| f64::from(*p) * (t - f64::from(*v)).max(0.0);
            t - values.iter().zip(probabilities).map(shortfall).sum::<f64>() / a
        };
        values.iter().map(|&v| objective(f64::from(v))).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn the_bin_that_the_level_cuts_counts_by_its_part() {
        // Values 0.2, 0.6, 1.0 with 0.3, 0.4, 0.3.
        let (values, p) = ([0.2, 0.6, 1.0], [0.3, 0.4, 0.3]);
        // Left, a = 0.5: (0.3 * 0.2 + 0.2 * 0.6) / 0.5 = 0.36.
        assert!((lower_tail_cvar(&values, &p, level(0.5)) - 0.36).abs() < 1e-6);
        // Right, a = 0.5: (0.3 * 1.0 + 0.2 * 0.6) / 0.5 = 0.84.
        assert!((upper_tail_cvar(&values, &p, level(0.5)) - 0.84).abs() < 1e-6);
        // The mean: 0.06 + 0.24 + 0.3 = 0.6.
        assert!((lower_tail_cvar(&values, &p, CvarLevel::MEAN) - 0.6).abs() < 1e-6);
    }

    #[test]
    fn empty_end_bins_do_not_end_the_walk() {
        let mut p = [0.0; N_BINS];
        p[4] = 0.25;
        p[7] = 0.75;
        let values = Bins::TRACTION.values();
        // Worst half: (0.25 * 0.35 + 0.25 * 0.65) / 0.5 = 0.5; best half lies in one bin.
        assert!((lower_tail_cvar(values, &p, level(0.5)) - 0.5).abs() < 1e-6);
        assert_eq!(upper_tail_cvar(values, &p, level(0.5)), 0.65);
    }

    #[test]
    fn near_zero_it_is_the_worst_value_that_has_mass() {
        let mut p = [0.0; N_BINS];
        p[2] = 1e-3;
        p[9] = 1.0 - 1e-3;
        for tiny in [1e-4, 1e-12, 1e-300, f64::MIN_POSITIVE] {
            assert!((lower_tail_cvar(Bins::TRACTION.values(), &p, level(tiny)) - 0.15).abs() < 1e-6);
            assert!((upper_tail_cvar(Bins::TRACTION.values(), &p, level(tiny)) - 0.85).abs() < 1e-6);
        }
    }

    #[test]
    fn an_atom_is_its_value_at_every_level() {
        for bin in 0..N_BINS {
            let mut p = [0.0; N_BINS];
            p[bin] = 1.0;
            for a in LEVELS {
                let value = Bins::ATTITUDE.values()[bin];
                assert_eq!(lower_tail_cvar(Bins::ATTITUDE.values(), &p, level(a)), value);
                assert_eq!(upper_tail_cvar(Bins::ATTITUDE.values(), &p, level(a)), value);
            }
        }
    }

    #[test]
    fn levels_outside_the_range_are_refused_with_the_number() {
        for found in [0.0, -0.1, 1.000_001, 2.0, f64::INFINITY] {
            let error = CvarLevel::new(found).unwrap_err();
            assert_eq!(error, CvarLevelError { found });
            assert!(error.to_string().contains(&format!("found {found}")));
        }
        assert!(CvarLevel::new(f64::NAN).is_err());
        assert_eq!(CvarLevel::new(0.4).unwrap().get(), 0.4);
    }

    proptest! {
        #[test]
        fn equals_the_quantile_integral(p in probabilities(), a in 0.01..=1.0f64) {
            let values = Bins::TRACTION.values();
            let exact = f64::from(lower_tail_cvar(values, &p, level(a)));
            // The midpoint rule errs by at most one step at each of the 11 jumps: 11 * 1 / 20 000.
            prop_assert!((exact - quantile_integral(values, &p, a, 20_000)).abs() < 6e-4);
        }

        #[test]
        fn equals_rockafellar_and_uryasev(p in probabilities(), a in 1e-3..=1.0f64) {
            let values = Bins::ATTITUDE.values();
            let lower = f64::from(lower_tail_cvar(values, &p, level(a)));
            // The sum of f32 probabilities misses one by up to 12 * 6e-8, which the level amplifies.
            let tolerance = 1e-6 + 1e-6 / a;
            prop_assert!((lower - rockafellar_uryasev_lower(values, &p, a)).abs() < tolerance);
            // Right tail of Z = minus the left tail of -Z.
            let mut mirrored_values = values.map(|v| -v);
            mirrored_values.reverse();
            let mut mirrored = p;
            mirrored.reverse();
            let upper = f64::from(upper_tail_cvar(values, &p, level(a)));
            prop_assert!((upper + rockafellar_uryasev_lower(&mirrored_values, &mirrored, a)).abs() < tolerance);
        }

        #[test]
        fn monotone_in_the_level_and_ordered(p in probabilities()) {
            let values = Bins::TRACTION.values();
            let mean: f32 = values.iter().zip(&p).map(|(v, p)| v * p).sum();
            for pair in LEVELS.windows(2) {
                let [tight, loose] = [level(pair[0]), level(pair[1])];
                prop_assert!(lower_tail_cvar(values, &p, tight) <= lower_tail_cvar(values, &p, loose) + 1e-6);
                prop_assert!(upper_tail_cvar(values, &p, tight) >= upper_tail_cvar(values, &p, loose) - 1e-6);
                prop_assert!(lower_tail_cvar(values, &p, tight) <= mean + 1e-6);
                prop_assert!(upper_tail_cvar(values, &p, tight) >= mean - 1e-6);
            }
            prop_assert!((lower_tail_cvar(values, &p, CvarLevel::MEAN) - mean).abs() < 1e-6);
            prop_assert!((upper_tail_cvar(values, &p, CvarLevel::MEAN) - mean).abs() < 1e-6);
        }

        #[test]
        fn the_two_tails_make_the_mean(p in probabilities(), a in 0.01..0.99f64) {
            // E[Z] = a CVaR_left(a) + (1 - a) CVaR_right(1 - a).
            let values = Bins::ATTITUDE.values();
            let mean: f64 = values.iter().zip(&p).map(|(v, p)| f64::from(v * p)).sum();
            let lower = f64::from(lower_tail_cvar(values, &p, level(a)));
            let upper = f64::from(upper_tail_cvar(values, &p, level(1.0 - a)));
            prop_assert!((a * lower + (1.0 - a) * upper - mean).abs() < 3e-6);
        }
    }
}
