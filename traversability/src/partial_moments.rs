//! Expected shortfalls at every bin value: what distributions mix in, and what their CVaR needs.

use crate::{Bins, CvarLevel, N_BINS, PmfQuad, Risk};

/// First partial moments of the four parameters of one pose, from the bad end of each, at every bin value v:
/// E[(v - Z)^+] for linear and angular traction, E[(Z - v)^+] for |roll| and |pitch| [rad].
///
/// They are linear in the distribution, so those of a mixture are the mixture of those of its parts. CVaR follows
/// from them without a distribution in between: the largest v - E[(v - Z)^+] / level for traction, the smallest
/// v + E[(Z - v)^+] / level for angles (Rockafellar and Uryasev), since a distribution over the bins' values has its
/// extremum at one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialMoments {
    /// Shape [parameter, bin], bins ascending.
    pub moments: [[f32; N_BINS]; 4],
}

impl PartialMoments {
    /// Those of the uniform distribution over the bins.
    pub fn uniform() -> Self {
        Self::of(&PmfQuad { rows: [[1.0 / N_BINS as f32; 4]; N_BINS] })
    }

    /// Those of four distributions.
    pub fn of(quad: &PmfQuad) -> Self {
        let mut moments = [[0.0; N_BINS]; 4];
        for (parameter, moments) in moments.iter_mut().enumerate() {
            let values = values_from_worst(parameter);
            let (mut mass, mut moment) = (0.0, 0.0);
            for rank in 1..N_BINS {
                mass += quad.rows[rank - 1][parameter];
                moment += mass * (values[rank] - values[rank - 1]).abs();
                moments[bin(parameter, rank)] = moment;
            }
        }
        Self { moments }
    }

    /// `(1 - other_share) self + other_share other`, a share per parameter.
    pub fn mixed_with(&self, other: &Self, other_share: [f32; 4]) -> Self {
        let mixed = |parameter: usize, bin: usize| {
            let share = other_share[parameter];
            (1.0 - share) * self.moments[parameter][bin] + share * other.moments[parameter][bin]
        };
        Self { moments: std::array::from_fn(|parameter| std::array::from_fn(|bin| mixed(parameter, bin))) }
    }

    /// The CVaR of every parameter from its bad end (PIETRA, equation 6).
    pub fn risk(&self, level: CvarLevel) -> Risk {
        let per_level = level.reciprocal();
        let traction = |parameter: usize| {
            let values = Bins::TRACTION.values().iter().zip(&self.moments[parameter]);
            values.map(|(value, moment)| value - per_level * moment).fold(f32::NEG_INFINITY, f32::max)
        };
        let angle_rad = |parameter: usize| {
            let values = Bins::ATTITUDE.values().iter().zip(&self.moments[parameter]);
            values.map(|(value, moment)| value + per_level * moment).fold(f32::INFINITY, f32::min)
        };
        Risk {
            linear_traction: traction(0),
            angular_traction: traction(1),
            roll_rad: angle_rad(2),
            pitch_rad: angle_rad(3),
        }
    }
}

/// The bin at a rank from the bad end.
fn bin(parameter: usize, rank: usize) -> usize {
    if parameter < 2 { rank } else { N_BINS - 1 - rank }
}

fn values_from_worst(parameter: usize) -> [f32; N_BINS] {
    let bins = if parameter < 2 { Bins::TRACTION } else { Bins::ATTITUDE };
    std::array::from_fn(|rank| bins.values()[bin(parameter, rank)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Pmf;

    fn pmf() -> impl Strategy<Value = Pmf> {
        let weight = prop_oneof![Just(0.0f32), 0.0..1.0f32];
        prop::array::uniform12(weight).prop_filter_map("some mass", |weights| {
            let sum: f32 = weights.iter().sum();
            (sum > 1e-3).then(|| Pmf::new(weights.map(|w| w / sum)).unwrap())
        })
    }

    fn quad(p: &[Pmf; 4]) -> PmfQuad {
        PmfQuad::new(&p[0], &p[1], &p[2], &p[3])
    }

    #[test]
    fn moments_of_one_bin_are_its_distances() {
        let traction = Pmf::one_hot(&Bins::TRACTION, 0.3).unwrap();
        let angle = Pmf::one_hot(&Bins::ATTITUDE, 12f32.to_radians()).unwrap();
        let moments = PartialMoments::of(&PmfQuad::new(&traction, &traction, &angle, &angle)).moments;
        // Bin value 0.35: nothing falls short of 0.25, 0.65 short of 1.
        assert!(moments[1][3].abs() < 1e-7 && (moments[1][11] - 0.65).abs() < 1e-6);
        // Bin value 12.5 degrees: 10 beyond 2.5, none beyond 17.5.
        assert!((moments[2][0] - 10f32.to_radians()).abs() < 1e-6 && moments[3][3].abs() < 1e-7);
    }

    #[test]
    fn the_uniform_distribution_is_the_mean_of_all_bins() {
        let uniform = PartialMoments::uniform().moments;
        // The mean of 1 - v over the traction bins is 1 - 0.5, that of the angles above 2.5 degrees 30 - 2.5.
        assert!((uniform[0][11] - 0.5).abs() < 1e-6);
        assert!((uniform[3][0] - 27.5f32.to_radians()).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn risk_of_a_mixture_is_that_of_the_mixed_distributions(
            p in [pmf(), pmf(), pmf(), pmf()],
            q in [pmf(), pmf(), pmf(), pmf()],
            share in prop::array::uniform4(0.0..=1.0f32),
            a in 1e-2..=1.0f64,
        ) {
            let level = CvarLevel::new(a).unwrap();
            let mixed: [Pmf; 4] = std::array::from_fn(|k| p[k].mixed_with(&q[k], share[k]));
            let expected = quad(&mixed).risk(level);
            let moments = PartialMoments::of(&quad(&p)).mixed_with(&PartialMoments::of(&quad(&q)), share);
            let found = moments.risk(level);
            let pairs = [
                (found.linear_traction, expected.linear_traction),
                (found.angular_traction, expected.angular_traction),
                (found.roll_rad, expected.roll_rad),
                (found.pitch_rad, expected.pitch_rad),
            ];
            for (found, expected) in pairs {
                // Twelve roundings of 6e-8 each in probabilities and sums, over the level.
                prop_assert!(f64::from((found - expected).abs()) < 2e-6 + 2e-6 / a, "{found} {expected}");
            }
        }
    }
}
