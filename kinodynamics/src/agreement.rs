//! Whether the unit turns and leans as the localisation says that the vehicle does: what tells one axis from another where
//! gravity cannot.
//!
//! The rate about the upward axis follows the localisation's yaw rate, and the force to the left follows speed times yaw
//! rate, which is what it takes to turn. Another order or sign of axes, or other units, show in these sums.

/// Correlation of the upward rate with the yaw rate below which they are not the same [-].
const RATE_CORRELATION_MIN: f64 = 0.6;
/// How far the upward rate may be off as a factor.
const RATE_FACTOR: [f64; 2] = [0.6, 1.6];
/// The force ahead that follows turning as closely as this, and by so much more than the force to the left, is that to the
/// left [-].
const SWAPPED: [f64; 2] = [0.6, 0.3];
/// The force to the left that follows turning as closely as this in the other direction is that to the right [-].
const OPPOSED: f64 = -0.6;
/// Yaw rates below this, as a root mean square, tell no axis [rad/s].
const TURNING_RADPS: f64 = 0.05;
/// The same of speed times yaw rate [m/s2].
const TURNING_MPS2: f64 = 0.5;
/// Moments below this tell nothing.
const MOMENTS_MIN: f64 = 20.0;

/// What the unit and the localisation say of one moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Mean of the unit's rates about the moment [rad/s].
    pub rate_radps: [f64; 3],
    /// Mean of the unit's specific force [m/s2].
    pub force_mps2: [f64; 3],
    /// By the localisation [rad/s].
    pub yaw_rate_radps: f64,
    /// Forward [m/s].
    pub speed_mps: f64,
}

/// Sums over moments; older ones may count less and less.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agreement {
    /// What is left of a moment's weight when the next one comes [-].
    kept: f64,
    n: f64,
    yaw: Sums<3>,
    turn: Sums<2>,
}

/// Sums of the products of several measured numbers with the one that they are held against, about zero: vehicles turn left
/// and right alike.
#[derive(Clone, Copy, Debug)]
struct Sums<const N: usize> {
    square: f64,
    measured_square: [f64; N],
    product: [f64; N],
}

impl<const N: usize> Sums<N> {
    const NONE: Self = Self { square: 0.0, measured_square: [0.0; N], product: [0.0; N] };

    fn add(&mut self, kept: f64, expected: f64, measured: [f64; N]) {
        self.square = kept * self.square + expected * expected;
        for (k, measured) in measured.into_iter().enumerate() {
            self.measured_square[k] = kept * self.measured_square[k] + measured * measured;
            self.product[k] = kept * self.product[k] + measured * expected;
        }
    }

    fn correlation(&self) -> [f64; N] {
        std::array::from_fn(|k| {
            self.product[k] / (self.measured_square[k] * self.square).sqrt().max(f64::MIN_POSITIVE)
        })
    }
}

/// How they disagree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Disagreement {
    /// In the rate about the upward axis.
    Rate {
        /// Of the rates about forward, left, up with the yaw rate [-].
        correlation: [f64; 3],
        /// Upward rate over yaw rate [-].
        factor: f64,
    },
    /// In the force to the left.
    Force {
        /// Of the forces ahead and to the left with speed times yaw rate [-].
        correlation: [f64; 2],
    },
}

impl Agreement {
    /// Of moments of which each next leaves this share of the weight of those before; 1 weighs all alike.
    pub(crate) fn new(kept: f64) -> Self {
        Self { kept, n: 0.0, yaw: Sums::NONE, turn: Sums::NONE }
    }

    pub(crate) fn note(&mut self, moment: &Moment) {
        let Moment { rate_radps, force_mps2: [ahead, left, _], yaw_rate_radps, speed_mps } = *moment;
        self.n = self.kept * self.n + 1.0;
        self.yaw.add(self.kept, yaw_rate_radps, rate_radps);
        self.turn.add(self.kept, speed_mps * yaw_rate_radps, [ahead, left]);
    }

    /// Root mean square of the localisation's yaw rate [rad/s]; none where there are too few moments, or no turns among them.
    pub(crate) fn turning_radps(&self) -> Option<f64> {
        Some(self.mean_yaw_rate_radps()).filter(|rate| self.n >= MOMENTS_MIN && *rate >= TURNING_RADPS)
    }

    /// The same whatever it is.
    pub(crate) fn mean_yaw_rate_radps(&self) -> f64 {
        (self.yaw.square / self.n.max(1.0)).sqrt()
    }

    /// Says how they disagree, as far as the vehicle has turned enough to tell.
    pub(crate) fn check(&self) -> Result<(), Disagreement> {
        if self.turning_radps().is_none() {
            return Ok(());
        }
        let correlation = self.yaw.correlation();
        let factor = self.yaw.product[2] / self.yaw.square;
        let is_rate =
            correlation[2] >= RATE_CORRELATION_MIN && (RATE_FACTOR[0]..=RATE_FACTOR[1]).contains(&factor);
        if !is_rate {
            return Err(Disagreement::Rate { correlation, factor });
        }
        let turns = (self.turn.square / self.n).sqrt() >= TURNING_MPS2;
        let [ahead, left] = self.turn.correlation();
        let is_swapped = ahead.abs() > SWAPPED[0] && ahead.abs() > left + SWAPPED[1];
        if turns && (is_swapped || left < OPPOSED) {
            return Err(Disagreement::Force { correlation: [ahead, left] });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A car that turns left and right on level ground at 2 m/s: what a sound unit measures.
    fn moments() -> impl Iterator<Item = Moment> + Clone {
        (0..200).map(|k| {
            let yaw_rate_radps = (0.1 * f64::from(k)).sin();
            Moment {
                rate_radps: [0.02, -0.01, yaw_rate_radps],
                force_mps2: [0.1, 2.0 * yaw_rate_radps, 9.81],
                yaw_rate_radps,
                speed_mps: 2.0,
            }
        })
    }

    fn judged(change: impl Fn(&mut Moment)) -> Result<(), Disagreement> {
        let mut agreement = Agreement::new(0.99);
        for mut moment in moments() {
            change(&mut moment);
            agreement.note(&moment);
        }
        agreement.check()
    }

    #[test]
    fn a_sound_unit_agrees_and_turned_ones_do_not() {
        assert_eq!(judged(|_| {}), Ok(()));
        let swapped = judged(|moment| moment.force_mps2.swap(0, 1));
        assert!(matches!(swapped, Err(Disagreement::Force { correlation: [ahead, _] }) if ahead > 0.99));
        let right = judged(|moment| moment.force_mps2[1] *= -1.0);
        assert!(matches!(right, Err(Disagreement::Force { correlation: [_, left] }) if left < -0.99));
        let down = judged(|moment| moment.rate_radps[2] *= -1.0);
        assert!(matches!(down, Err(Disagreement::Rate { factor, .. }) if (factor + 1.0).abs() < 1e-9));
        let degrees = judged(|moment| moment.rate_radps[2] *= 57.3);
        assert!(matches!(degrees, Err(Disagreement::Rate { factor, .. }) if (factor - 57.3).abs() < 1e-9));
    }

    #[test]
    fn nothing_is_told_without_turns_and_what_is_over_is_forgotten() {
        assert_eq!(judged(|moment| (moment.yaw_rate_radps, moment.rate_radps[2]) = (0.0, 0.3)), Ok(()));
        let mut agreement = Agreement::new(0.99);
        for mut moment in moments() {
            moment.rate_radps[2] *= -1.0;
            agreement.note(&moment);
        }
        assert!(agreement.check().is_err());
        // After a thousand moments 0.99 leaves less than a ten thousandth of what was before.
        for moment in moments().cycle().take(1000) {
            agreement.note(&moment);
        }
        assert_eq!(agreement.check(), Ok(()));
    }
}
