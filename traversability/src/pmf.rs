//! Distributions over bins.

use crate::{Bins, CvarLevel, N_BINS, lower_tail_cvar, upper_tail_cvar};

/// A distribution over [`N_BINS`] bins: finite, not negative, summing to one up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pmf([f32; N_BINS]);

/// Numbers that are no distribution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PmfError {
    /// A probability is negative or not finite.
    #[error("probability of bin {bin}: expected a finite number >= 0, found {found}")]
    Probability {
        /// Which bin.
        bin: usize,
        /// What stood there.
        found: f32,
    },
    /// The probabilities do not sum to one.
    #[error("sum of {N_BINS} probabilities: expected 1 within {tolerance}, found {found}", tolerance = Pmf::SUM_TOLERANCE)]
    Sum {
        /// The sum.
        found: f32,
    },
}

impl Pmf {
    /// How far from one the sum of given probabilities may lie; it is normalised away.
    pub const SUM_TOLERANCE: f32 = 1e-3;

    /// The same probability for every bin.
    pub const UNIFORM: Self = Self([1.0 / N_BINS as f32; N_BINS]);

    /// Checks and normalises given probabilities.
    pub fn new(probabilities: [f32; N_BINS]) -> Result<Self, PmfError> {
        let wrong = |p: &f32| !(p.is_finite() && *p >= 0.0);
        if let Some(bin) = probabilities.iter().position(wrong) {
            return Err(PmfError::Probability { bin, found: probabilities[bin] });
        }
        let sum: f32 = probabilities.iter().sum();
        if (sum - 1.0).abs() > Self::SUM_TOLERANCE {
            return Err(PmfError::Sum { found: sum });
        }
        Ok(Self::normalised(probabilities))
    }

    /// Weights that are known to be finite, not negative and not all zero, over their sum; others make no
    /// distribution, and [`Pmf::new`] checks.
    pub fn normalised(weights: [f32; N_BINS]) -> Self {
        let sum: f32 = weights.iter().sum();
        Self(weights.map(|weight| weight / sum))
    }

    /// All mass in the bin that holds a value, the target of a measured value; `None` for NaN.
    pub fn one_hot(bins: &Bins, value: f32) -> Option<Self> {
        let mut probabilities = [0.0; N_BINS];
        probabilities[bins.bin_of(value)?] = 1.0;
        Some(Self(probabilities))
    }

    /// A value split between the two bins whose values enclose it, so that the mean is the value itself and
    /// moves continuously with it; beyond the outermost values all mass lies there. `None` for NaN.
    pub fn interpolated(bins: &Bins, value: f32) -> Option<Self> {
        if value.is_nan() {
            return None;
        }
        let values = bins.values();
        let below = values[1..N_BINS - 1].iter().take_while(|&&v| value >= v).count();
        let share = ((value - values[below]) / (values[below + 1] - values[below])).clamp(0.0, 1.0);
        let mut probabilities = [0.0; N_BINS];
        probabilities[below] = 1.0 - share;
        probabilities[below + 1] = share;
        Some(Self(probabilities))
    }

    /// `(1 - other_share) self + other_share other`.
    ///
    /// # Panics
    /// When `other_share` is outside [0, 1].
    pub fn mixed_with(&self, other: &Self, other_share: f32) -> Self {
        assert!((0.0..=1.0).contains(&other_share), "other_share: expected [0, 1], found {other_share}");
        Self(std::array::from_fn(|b| (1.0 - other_share) * self.0[b] + other_share * other.0[b]))
    }

    /// Probability of each bin.
    pub fn probabilities(&self) -> &[f32; N_BINS] {
        &self.0
    }

    /// Expected value.
    pub fn mean(&self, bins: &Bins) -> f32 {
        bins.values().iter().zip(&self.0).map(|(v, p)| v * p).sum()
    }

    /// Mean of the lowest share `level`, see [`lower_tail_cvar`].
    pub fn lower_tail_cvar(&self, bins: &Bins, level: CvarLevel) -> f32 {
        lower_tail_cvar(bins.values(), &self.0, level)
    }

    /// Mean of the highest share `level`, see [`upper_tail_cvar`].
    pub fn upper_tail_cvar(&self, bins: &Bins, level: CvarLevel) -> f32 {
        upper_tail_cvar(bins.values(), &self.0, level)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn one_hot_puts_everything_into_the_bin_of_the_value() {
        let pmf = Pmf::one_hot(&Bins::TRACTION, 0.5).unwrap();
        assert_eq!(pmf.probabilities()[6], 1.0);
        assert_eq!(pmf.probabilities().iter().sum::<f32>(), 1.0);
        assert!(Pmf::one_hot(&Bins::TRACTION, f32::NAN).is_none());
        assert!(Pmf::interpolated(&Bins::TRACTION, f32::NAN).is_none());
    }

    #[test]
    fn interpolation_splits_by_distance() {
        // 0.5 lies half-way between the values 0.45 and 0.55.
        let half = Pmf::interpolated(&Bins::TRACTION, 0.5).unwrap();
        assert!((half.probabilities()[5] - 0.5).abs() < 1e-6 && (half.probabilities()[6] - 0.5).abs() < 1e-6);
        // 0.99 lies 0.8 of the way from 0.95 to the atom at 1.
        let high = Pmf::interpolated(&Bins::TRACTION, 0.99).unwrap();
        assert!((high.probabilities()[11] - 0.8).abs() < 1e-5);
        for (value, bin) in [(-1.0, 0), (0.0, 0), (1.0, 11), (7.0, 11)] {
            assert_eq!(Pmf::interpolated(&Bins::TRACTION, value).unwrap().probabilities()[bin], 1.0);
        }
    }

    #[test]
    fn uniform_means_are_the_middles_of_the_ranges() {
        assert!((Pmf::UNIFORM.mean(&Bins::TRACTION) - 0.5).abs() < 1e-6);
        assert!((Pmf::UNIFORM.mean(&Bins::ATTITUDE) - 30f32.to_radians()).abs() < 1e-6);
    }

    #[test]
    fn raw_numbers_are_checked() {
        let mut raw = [0.0; N_BINS];
        assert_eq!(Pmf::new(raw), Err(PmfError::Sum { found: 0.0 }));
        raw[3] = 1.0005;
        assert_eq!(Pmf::new(raw).unwrap().probabilities()[3], 1.0);
        raw[5] = -0.1;
        assert_eq!(Pmf::new(raw), Err(PmfError::Probability { bin: 5, found: -0.1 }));
        raw[5] = f32::NAN;
        let message = Pmf::new(raw).unwrap_err().to_string();
        assert_eq!(message, "probability of bin 5: expected a finite number >= 0, found NaN");
    }

    proptest! {
        #[test]
        fn interpolation_keeps_the_mean(share in 0.0..=1.0f32) {
            for bins in [Bins::TRACTION, Bins::ATTITUDE] {
                let (low, high) = (bins.values()[0], bins.values()[N_BINS - 1]);
                let value = low + share * (high - low);
                let pmf = Pmf::interpolated(&bins, value).unwrap();
                prop_assert!((pmf.mean(&bins) - value).abs() < 1e-6);
                prop_assert!(Pmf::new(*pmf.probabilities()).is_ok());
            }
        }

        #[test]
        fn means_mix_linearly(a in 0.0..1.0f32, b in 0.0..1.0f32, share in 0.0..=1.0f32) {
            let [a, b] = [a, b].map(|v| Pmf::interpolated(&Bins::TRACTION, v).unwrap());
            let mixed = a.mixed_with(&b, share);
            let expected = (1.0 - share) * a.mean(&Bins::TRACTION) + share * b.mean(&Bins::TRACTION);
            prop_assert!((mixed.mean(&Bins::TRACTION) - expected).abs() < 1e-6);
            prop_assert!(Pmf::new(*mixed.probabilities()).is_ok());
        }
    }
}
