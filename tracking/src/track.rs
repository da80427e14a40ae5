//! What is told of a thing that moves.

use crate::Variance;

/// No place, speed or uncertainty is beyond this.
const NUMBER_MAX: f64 = 1e8;

/// A thing that moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Track {
    /// Counts the things that a tracker has seen, from 1.
    pub number: u64,
    /// Centre, east, north [m].
    pub position_m: [f64; 2],
    /// East, north [m/s].
    pub velocity_mps: [f64; 2],
    /// How uncertain both are.
    pub variance: Variance,
    /// Of the circle around all that was seen of it [m].
    pub radius_m: f64,
}

/// Where a thing will be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Predicted {
    /// Centre, east, north [m].
    pub position_m: [f64; 2],
    /// Standard deviation of the centre along each axis [m].
    pub std_m: f64,
    /// Radius of the thing itself [m].
    pub radius_m: f64,
}

impl Track {
    /// Where it will be if it goes on as it does; `density_m2ps3` is the spectral density of the acceleration that nobody
    /// foresees.
    pub fn predicted(&self, after_s: f64, density_m2ps3: f64) -> Predicted {
        Predicted {
            position_m: [0, 1].map(|axis| self.position_m[axis] + after_s * self.velocity_mps[axis]),
            std_m: self.variance.after(after_s, density_m2ps3).position_m2.max(0.0).sqrt(),
            radius_m: self.radius_m,
        }
    }

    /// Whether every number is one that can be, and none of those is negative that cannot be.
    pub fn is_sound(&self) -> bool {
        let Variance { position_m2, cross_m2ps, velocity_m2ps2 } = self.variance;
        let mut numbers = [cross_m2ps].into_iter().chain(self.position_m).chain(self.velocity_mps);
        let amounts = [position_m2, velocity_m2ps2, self.radius_m];
        numbers.all(|number| number.abs() <= NUMBER_MAX)
            && amounts.iter().all(|amount| (0.0..=NUMBER_MAX).contains(amount))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_on_as_it_does_and_gets_less_sure() {
        let variance = Variance { position_m2: 0.01, cross_m2ps: 0.0, velocity_m2ps2: 0.04 };
        let track =
            Track { number: 1, position_m: [1.0, 2.0], velocity_mps: [0.5, -1.0], variance, radius_m: 0.3 };
        let now = track.predicted(0.0, 0.6);
        assert_eq!((now.position_m, now.std_m, now.radius_m), ([1.0, 2.0], 0.1, 0.3));
        let then = track.predicted(2.0, 0.6);
        assert_eq!(then.position_m, [2.0, 0.0]);
        // 0.01 + 4 x 0.04 + 0.6 x 8 / 3
        assert!((then.std_m * then.std_m - 1.77).abs() < 1e-12);
    }

    #[test]
    fn numbers_that_are_none_are_told() {
        let track = Track::default();
        assert!(track.is_sound());
        let variance = Variance { velocity_m2ps2: -1e-9, ..Variance::default() };
        for broken in [
            Track { position_m: [0.0, f64::NAN], ..track },
            Track { velocity_mps: [f64::INFINITY, 0.0], ..track },
            Track { position_m: [1e9, 0.0], ..track },
            Track { radius_m: -0.1, ..track },
            Track { variance, ..track },
        ] {
            assert!(!broken.is_sound(), "{broken:?}");
        }
    }
}
