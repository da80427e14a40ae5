//! The prior of a skid-steered machine: traction of four wheels that cannot steer, on ground that is known as a slope
//! and as what stands on it.
//!
//! PIETRA's equation 15 describes wheels that roll where they point. Skid-steered wheels scrub sideways in every turn,
//! so that the machine turns less than its wheel speeds say even on level ground, by a factor near the ratio of its
//! track to its effective track; and it slips forward in proportion to the pull it needs. The prior is built from
//! figures that were published or measured elsewhere:
//!
//! - **Level, open ground.** Achieved over commanded motion of a Clearpath Warthog on uneven ground (recorded by the
//!   DRIVE protocol, norlab-ulaval/DRIVE, 2 s windows in steady state): quantiles in [`LINEAR`] and [`ANGULAR`].
//!   Commanded yaw rate is there the difference of the wheels' speeds over the geometric track.
//! - **What was commanded.** A controller may have scaled the command by an effective track already; that of the
//!   Husky does, by [`COMPENSATION`]. Whether it did is not known: both weigh one half.
//! - **Slope.** Wheel slip at the pull that the slope demands, by Wismer and Luth (1974, off-road traction prediction
//!   for wheeled vehicles): gross traction 0.75 (1 - exp(-0.3 C S)), motion resistance 1.2 / C + 0.04, both over the
//!   load, with the wheel numeric C of hard, firm, tilled and soft soil, each as likely. Headings are equally likely.
//! - **Turning on a slope.** What gravity takes of the friction circle is missing for scrubbing.
//! - **What is in the way.** One half of it is firm, trunks, logs and rocks, and stops the machine in translation and
//!   in turning alike; the other half gives way, and nothing is known of how much. Some of it is too low for a map:
//!   of a forest's floor after felling typically 4 % are stumps and 3 % boulders ([`HIDDEN`]; terrain model of Ersson
//!   et al. 2013, as printed with Silva Fennica 1386).

use traversability::{Bins, N_BINS, Pmf};

/// Achieved over commanded speed on level ground: a distribution function through these points, linear in between.
/// The outer quantiles are those of 5, 25, 50, 75 and 95 %, the ends what no window exceeded by more than noise.
pub const LINEAR: Quantiles = Quantiles { values: [0.0, 0.42, 0.59, 0.78, 0.90, 0.99, 1.1] };

/// Achieved yaw rate over the wheels' speed difference divided by the geometric track, on level ground.
pub const ANGULAR: Quantiles = Quantiles { values: [0.0, 0.22, 0.33, 0.41, 0.48, 0.54, 0.6] };

/// Factor between the Husky's geometric and effective track that its controller ships with
/// (`wheel_separation_multiplier` of husky_control).
pub const COMPENSATION: f64 = 1.875;

/// Wheel numerics of hard, firm, tilled and soft soil (Wismer and Luth).
const WHEEL_NUMERICS: [f64; 4] = [50.0, 30.0, 20.0, 15.0];
/// Largest gross traction over load (Wismer and Luth).
const GRIP: f64 = 0.75;
/// Headings over which a slope is averaged.
const N_HEADINGS: usize = 16;
/// Probability that a forest's floor holds something in the way that no map shows.
pub const HIDDEN: f64 = 0.07;
/// Share of what is in the way that is firm.
const FIRM: f64 = 0.5;

/// A distribution given by the values at the probabilities 0, 5, 25, 50, 75, 95 and 100 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantiles {
    /// Ascending.
    pub values: [f64; 7],
}

impl Quantiles {
    /// The probabilities of the values.
    pub const PROBABILITIES: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

    /// Probability that a draw is at most `value`.
    fn at_most(&self, value: f64) -> f64 {
        let above = self.values.iter().position(|&knot| value < knot);
        match above {
            Some(0) => 0.0,
            None => 1.0,
            Some(k) => {
                let share = (value - self.values[k - 1]) / (self.values[k] - self.values[k - 1]);
                Self::PROBABILITIES[k - 1] + share * (Self::PROBABILITIES[k] - Self::PROBABILITIES[k - 1])
            }
        }
    }

    /// Adds `weight` times the distribution of `factor` times a draw, over [`Bins::TRACTION`].
    fn add_scaled(&self, factor: f64, weight: f64, pmf: &mut [f64; N_BINS]) {
        if factor <= 0.0 {
            pmf[0] += weight;
            return;
        }
        let mut below = 0.0;
        for (bin, probability) in pmf.iter_mut().enumerate() {
            // The last bin is an atom that holds everything from 1 on.
            let last = bin == N_BINS - 1;
            let upper = f64::from(Bins::TRACTION.edges()[bin + 1]);
            let up_to = if last { 1.0 } else { self.at_most(upper / factor) };
            *probability += weight * (up_to - below);
            below = up_to;
        }
    }
}

/// The ground under a skid-steered machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkidSteerGround {
    /// Steepness: length of the gradient [-], finite and >= 0.
    pub steepness: f64,
    /// Probability that something is in the way, in [0, 1], apart from what is hidden.
    pub obstruction: f64,
}

/// What the prior says of one place, over [`Bins::TRACTION`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkidSteerBelief {
    /// Achieved over commanded speed.
    pub linear: Pmf,
    /// Achieved over commanded yaw rate.
    pub angular: Pmf,
}

/// The prior of a skid-steered machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkidSteerPrior {
    /// Share of the uniform distribution in equation 18, in [0, 1].
    pub uniform_weight: f64,
    /// Pseudo-count of the prior in a Dirichlet posterior, > 0.
    pub evidence: f64,
}

impl Default for SkidSteerPrior {
    /// PIETRA's share of the uniform distribution, and as much evidence as there are bins.
    fn default() -> Self {
        Self { uniform_weight: 0.2, evidence: N_BINS as f64 }
    }
}

impl SkidSteerPrior {
    /// The distributions at a place, all headings taken together.
    ///
    /// # Panics
    /// When the ground or the uniform weight is outside its documented range.
    pub fn belief(&self, ground: SkidSteerGround) -> SkidSteerBelief {
        let SkidSteerGround { steepness, obstruction } = ground;
        assert!(steepness.is_finite() && steepness >= 0.0, "steepness: expected >= 0, found {steepness}");
        assert!((0.0..=1.0).contains(&obstruction), "obstruction: expected [0, 1], found {obstruction}");
        let blocked = 1.0 - (1.0 - HIDDEN) * (1.0 - obstruction);
        let mut stopped = [0.0; N_BINS];
        stopped[0] = 1.0;
        let in_the_way = normalised(&stopped).mixed_with(&Pmf::UNIFORM, (1.0 - FIRM) as f32);
        let over_all = |open: Pmf| {
            open.mixed_with(&in_the_way, blocked as f32).mixed_with(&Pmf::UNIFORM, self.uniform_weight as f32)
        };
        SkidSteerBelief { linear: over_all(linear(steepness)), angular: over_all(angular(steepness)) }
    }
}

/// Linear traction on open ground of a steepness.
fn linear(steepness: f64) -> Pmf {
    let mut pmf = [0.0; N_BINS];
    let weight = 1.0 / (N_HEADINGS * WHEEL_NUMERICS.len()) as f64;
    for heading in 0..N_HEADINGS {
        let grade = steepness * libm::cos(std::f64::consts::TAU * heading as f64 / N_HEADINGS as f64);
        for wheel_numeric in WHEEL_NUMERICS {
            let factor = (1.0 - slip(grade, wheel_numeric)) / (1.0 - slip(0.0, wheel_numeric));
            LINEAR.add_scaled(factor, weight, &mut pmf);
        }
    }
    normalised(&pmf)
}

/// Angular traction on open ground of a steepness.
fn angular(steepness: f64) -> Pmf {
    let left_for_scrubbing = (1.0 - (steepness / GRIP) * (steepness / GRIP)).max(0.0).sqrt();
    let mut pmf = [0.0; N_BINS];
    ANGULAR.add_scaled(left_for_scrubbing, 0.5, &mut pmf);
    ANGULAR.add_scaled(COMPENSATION * left_for_scrubbing, 0.5, &mut pmf);
    normalised(&pmf)
}

/// Wheel slip at which the wheels pull a machine up a grade; negative where they hold it back, 1 where they spin.
fn slip(grade: f64, wheel_numeric: f64) -> f64 {
    let pull = grade + 1.2 / wheel_numeric + 0.04;
    let share = pull.abs() / GRIP;
    if share >= 1.0 {
        return pull.signum();
    }
    (-libm::log(1.0 - share) / (0.3 * wheel_numeric)).min(1.0).copysign(pull)
}

/// Probabilities that sum to one up to rounding.
fn normalised(pmf: &[f64; N_BINS]) -> Pmf {
    let narrow = pmf.map(|probability| probability.max(0.0) as f32);
    match Pmf::new(narrow) {
        Ok(pmf) => pmf,
        Err(error) => unreachable!("weights sum to one: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRIOR: SkidSteerPrior = SkidSteerPrior { uniform_weight: 0.2, evidence: 12.0 };

    fn belief(steepness: f64, obstruction: f64) -> SkidSteerBelief {
        PRIOR.belief(SkidSteerGround { steepness, obstruction })
    }

    #[test]
    fn quantiles_are_met_and_joined_by_straight_lines() {
        for (value, probability) in LINEAR.values.iter().zip(Quantiles::PROBABILITIES) {
            assert!((LINEAR.at_most(*value) - probability).abs() < 1e-12);
        }
        assert!((LINEAR.at_most(0.5 * (0.59 + 0.78)) - 0.375).abs() < 1e-12);
        assert_eq!((LINEAR.at_most(-1.0), LINEAR.at_most(2.0)), (0.0, 1.0));
    }

    #[test]
    fn bins_hold_what_lies_between_their_edges() {
        let mut pmf = [0.0; N_BINS];
        LINEAR.add_scaled(1.0, 1.0, &mut pmf);
        // 0.9 is the quantile of 75 %; from 0.9 to 0.99 it is linear to 95 %, then to 1.1; 1 is an atom of the rest.
        let at_one = 0.95 + 0.05 * 0.01 / 0.11;
        assert!((pmf[11] - (1.0 - at_one)).abs() < 1e-6, "{}", pmf[11]);
        assert!((pmf[10] - (at_one - 0.75)).abs() < 1e-6);
        assert!((pmf.iter().sum::<f64>() - 1.0).abs() < 1e-12 && pmf[0] == 0.0);
        // Half as much traction: 0.39 is the median.
        let mut half = [0.0; N_BINS];
        LINEAR.add_scaled(0.5, 1.0, &mut half);
        assert!((half[..4].iter().sum::<f64>() - LINEAR.at_most(0.6)).abs() < 1e-6);
        let mut none = [0.0; N_BINS];
        LINEAR.add_scaled(0.0, 1.0, &mut none);
        assert_eq!(none[0], 1.0);
    }

    #[test]
    fn slip_is_that_of_wismer_and_luth() {
        // Gross traction at the slip found is the pull: 15 degrees on firm soil.
        let (grade, numeric) = (0.268, 30.0);
        let s = slip(grade, numeric);
        assert!((0.75 * (1.0 - (-0.3 * numeric * s).exp()) - (grade + 1.2 / numeric + 0.04)).abs() < 1e-12);
        assert_eq!((slip(0.8, 30.0), slip(-0.9, 30.0)), (1.0, -1.0));
        assert!(slip(-0.3, 30.0) < 0.0, "held back downhill");
    }

    #[test]
    fn level_ground_keeps_the_measured_traction() {
        let level = belief(0.0, 0.0);
        let open = linear(0.0).mean(&Bins::TRACTION);
        // 7 % are blocked, of which half is stopped and half is anything; a fifth of all is anything.
        let expected = 0.8 * (0.93 * open + 0.07 * 0.25) + 0.2 * 0.5;
        assert!((level.linear.mean(&Bins::TRACTION) - expected).abs() < 1e-5);
        // Trapezoids between the quantiles: mean 0.735.
        assert!((open - 0.735).abs() < 0.02, "{open}");
        // Half is cut at a steering efficiency near 0.4, half near 0.75.
        let turning = angular(0.0).mean(&Bins::TRACTION);
        assert!((turning - 0.5 * (0.398 + 0.746)).abs() < 0.02, "{turning}");
    }

    #[test]
    fn traction_falls_with_the_slope_and_is_gone_where_the_grip_is() {
        let means = [0.0, 0.2, 0.4, 0.6, 0.74].map(|steepness| {
            let belief = belief(steepness, 0.0);
            [belief.linear.mean(&Bins::TRACTION), belief.angular.mean(&Bins::TRACTION)]
        });
        for pair in means.windows(2) {
            assert!(pair[1][0] < pair[0][0] + 1e-3 && pair[1][1] < pair[0][1], "{pair:?}");
        }
        assert!(means[4][0] < means[0][0] - 0.05);
        assert!((angular(0.76).probabilities()[0] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn half_of_what_is_in_the_way_stops_the_machine() {
        for pmf in [belief(0.1, 1.0).linear, belief(0.1, 1.0).angular] {
            // 0.8 (1/2 stopped + 1/2 uniform) + 0.2 uniform.
            for (bin, probability) in pmf.probabilities().iter().enumerate() {
                let expected = 0.6 / 12.0 + if bin == 0 { 0.4 } else { 0.0 };
                assert!((probability - expected).abs() < 1e-6, "{bin}: {probability}");
            }
        }
    }

    #[test]
    #[should_panic(expected = "obstruction: expected [0, 1]")]
    fn ground_without_sense_is_refused() {
        belief(0.0, 1.5);
    }
}
