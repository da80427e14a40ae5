//! The four distributions of one pose side by side, each from its bad end.

use crate::cvar::tail_mean;
use crate::{Bins, CvarLevel, N_BINS, Pmf, Risk};

/// Distributions of linear traction, angular traction, |roll| and |pitch| of one pose, interleaved and each
/// ordered from its bad end: row k holds traction bin k and attitude bin `N_BINS - 1 - k`.
///
/// Every lane is to sum to one up to rounding; rows are not checked, since maps fill millions of them a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PmfQuad {
    /// Shape [rank from the bad end, parameter].
    pub rows: [[f32; 4]; N_BINS],
}

/// Value of every entry of [`PmfQuad::rows`].
const VALUES: [[f32; 4]; N_BINS] = {
    let mut values = [[0.0; 4]; N_BINS];
    let mut k = 0;
    while k < N_BINS {
        let (traction, angle_rad) = (Bins::TRACTION.values()[k], Bins::ATTITUDE.values()[N_BINS - 1 - k]);
        values[k] = [traction, traction, angle_rad, angle_rad];
        k += 1;
    }
    values
};

impl PmfQuad {
    /// From one distribution per parameter.
    pub fn new(linear: &Pmf, angular: &Pmf, roll: &Pmf, pitch: &Pmf) -> Self {
        let [linear, angular, roll, pitch] = [linear, angular, roll, pitch].map(Pmf::probabilities);
        let row = |k: usize| [linear[k], angular[k], roll[N_BINS - 1 - k], pitch[N_BINS - 1 - k]];
        Self { rows: std::array::from_fn(row) }
    }

    /// Distributions of linear traction, angular traction, |roll| and |pitch|, normalised.
    pub fn pmfs(&self) -> [Pmf; 4] {
        let lane = |lane: usize| {
            let rank = |bin: usize| if lane < 2 { bin } else { N_BINS - 1 - bin };
            Pmf::normalised(std::array::from_fn(|bin| self.rows[rank(bin)][lane]))
        };
        std::array::from_fn(lane)
    }

    /// The CVaR of every parameter from its bad end (PIETRA, equation 6).
    pub fn risk(&self, level: CvarLevel) -> Risk {
        let cvar =
            |lane: usize| tail_mean(VALUES.iter().zip(&self.rows).map(|(v, p)| (v[lane], p[lane])), level);
        Risk { linear_traction: cvar(0), angular_traction: cvar(1), roll_rad: cvar(2), pitch_rad: cvar(3) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pmf() -> impl Strategy<Value = Pmf> {
        let weight = prop_oneof![Just(0.0f32), 0.0..1.0f32];
        prop::array::uniform12(weight).prop_filter_map("some mass", |weights| {
            let sum: f32 = weights.iter().sum();
            (sum > 1e-3).then(|| Pmf::new(weights.map(|w| w / sum)).unwrap())
        })
    }

    proptest! {
        #[test]
        fn four_lanes_equal_the_scalar_form(p in [pmf(), pmf(), pmf(), pmf()], a in 1e-3..=1.0f64) {
            let level = CvarLevel::new(a).unwrap();
            let quad = PmfQuad::new(&p[0], &p[1], &p[2], &p[3]);
            let risk = quad.risk(level);
            let pairs = [
                (risk.linear_traction, p[0].lower_tail_cvar(&Bins::TRACTION, level)),
                (risk.angular_traction, p[1].lower_tail_cvar(&Bins::TRACTION, level)),
                (risk.roll_rad, p[2].upper_tail_cvar(&Bins::ATTITUDE, level)),
                (risk.pitch_rad, p[3].upper_tail_cvar(&Bins::ATTITUDE, level)),
            ];
            for (lanes, scalar) in pairs {
                // `left` loses up to 12 roundings of 6e-8, relative to the level.
                prop_assert!(((lanes - scalar) as f64).abs() < 1e-6 + 1e-6 / a, "{lanes} {scalar}");
            }
            for (round_trip, original) in quad.pmfs().iter().zip(&p) {
                for (x, y) in round_trip.probabilities().iter().zip(original.probabilities()) {
                    prop_assert!((x - y).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn the_tiniest_level_is_the_worst_bin_with_mass() {
        let traction = Pmf::interpolated(&Bins::TRACTION, 0.5).unwrap();
        let angle = Pmf::interpolated(&Bins::ATTITUDE, 10f32.to_radians()).unwrap();
        let quad = PmfQuad::new(&traction, &traction, &angle, &angle);
        let risk = quad.risk(CvarLevel::new(f64::MIN_POSITIVE).unwrap());
        assert!((risk.linear_traction - 0.45).abs() < 1e-6);
        assert!((risk.pitch_rad - 12.5f32.to_radians()).abs() < 1e-6);
    }
}
