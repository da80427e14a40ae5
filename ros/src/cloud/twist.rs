//! How a vehicle moves while a sweep is taken.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Velocity and angular rate of a rigid body, in its own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Of the frame's origin [m/s].
    pub velocity_mps: Vector3<f64>,
    /// About its axes [rad/s].
    pub rate_radps: Vector3<f64>,
}

impl Twist {
    /// Takes points of the body's frame of `after_s` from now to its frame of now, if it goes on as it does.
    ///
    /// The way lies along half of the turn: the chord of the arc, which is shorter than that by (rate x time)^2 / 24 of it.
    pub fn over(&self, after_s: f64) -> Isometry3<f64> {
        let half = UnitQuaternion::from_scaled_axis(self.rate_radps * (0.5 * after_s));
        Isometry3::from_parts(Translation3::from(half * self.velocity_mps * after_s), half * half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    /// A circle to the left of radius v / w: after t it is at (r sin wt, r (1 - cos wt)) and has turned by wt.
    #[test]
    fn it_is_the_arc_of_a_circle() {
        let twist = Twist { velocity_mps: Vector3::x() * 3.0, rate_radps: Vector3::z() * 0.8 };
        for after_s in [-0.1_f64, 0.05, 0.1, 0.2] {
            let (radius_m, turned_rad) = (3.0 / 0.8, 0.8 * after_s);
            let there = twist.over(after_s) * Point3::origin();
            let expected_m = [radius_m * turned_rad.sin(), radius_m * (1.0 - turned_rad.cos())];
            // 3 m/s x 0.2 s x 0.16^2 / 24 = 0.6 mm at the most.
            assert!((there.x - expected_m[0]).hypot(there.y - expected_m[1]) < 7e-4, "{after_s} s: {there}");
            assert!((twist.over(after_s).rotation.euler_angles().2 - turned_rad).abs() < 1e-12);
        }
        assert_eq!(twist.over(0.0), Isometry3::identity());
    }
}
