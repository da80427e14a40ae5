//! Corrections of the localisation, as rigid motions of the map frame.

use std::f64::consts::{PI, TAU};

use bicycle::Odometry;

/// A correction of the localisation: the map frame moved under the vehicle, the vehicle did not.
///
/// A rigid motion about the vertical: a place p of before lies at R(`yaw_rad`) p + `step_m` now. The step is therefore
/// the vehicle's own only where it does not turn. Roll and pitch come from gravity and are not corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jump {
    /// Step after the turn about the map's origin, east, north, up [m].
    pub step_m: [f64; 3],
    /// Turn, counter-clockwise [rad].
    pub yaw_rad: f64,
}

impl Jump {
    /// The frame stayed where it was.
    pub const NONE: Self = Self { step_m: [0.0; 3], yaw_rad: 0.0 };

    /// The motion that takes a vehicle believed to be at `before` (position [m], yaw [rad]) to where it is known to
    /// be `now`.
    pub fn between(before: ([f64; 3], f64), now: ([f64; 3], f64)) -> Self {
        let turn = Self { step_m: [0.0; 3], yaw_rad: turned_rad(before.1, now.1) };
        let turned_m = turn.place_m(before.0);
        Self { step_m: [0, 1, 2].map(|axis| now.0[axis] - turned_m[axis]), ..turn }
    }

    /// Where a place of before lies now: east, north, up [m].
    pub fn place_m(&self, [x_m, y_m, z_m]: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = libm::sincos(self.yaw_rad);
        let [east_m, north_m, up_m] = self.step_m;
        [cos * x_m - sin * y_m + east_m, sin * x_m + cos * y_m + north_m, z_m + up_m]
    }

    /// The same of a pose over the ground: east, north [m], yaw [rad].
    pub fn pose(&self, [x_m, y_m, yaw_rad]: [f64; 3]) -> [f64; 3] {
        let [x_m, y_m, _] = self.place_m([x_m, y_m, 0.0]);
        [x_m, y_m, yaw_rad + self.yaw_rad]
    }

    /// Odometry of before as it would be told now.
    pub fn odometry(&self, before: &Odometry) -> Odometry {
        let [roll_rad, pitch_rad, yaw_rad] = before.attitude_rad;
        Odometry {
            position_m: self.place_m(before.position_m),
            attitude_rad: [roll_rad, pitch_rad, yaw_rad + self.yaw_rad],
            ..*before
        }
    }

    /// This one and then the next.
    pub fn then(&self, next: &Self) -> Self {
        Self { step_m: next.place_m(self.step_m), yaw_rad: self.yaw_rad + next.yaw_rad }
    }

    /// The way back.
    pub fn inverse(&self) -> Self {
        let turn = Self { step_m: [0.0; 3], yaw_rad: -self.yaw_rad };
        Self { step_m: turn.place_m(self.step_m).map(|value| -value), ..turn }
    }
}

/// From one yaw to another the short way round, in (-pi, pi] [rad].
pub(crate) fn turned_rad(from_rad: f64, to_rad: f64) -> f64 {
    let turn_rad = (to_rad - from_rad).rem_euclid(TAU);
    if turn_rad > PI { turn_rad - TAU } else { turn_rad }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    use super::*;

    /// The oracle: the same motion by quaternions.
    fn isometry(position_m: [f64; 3], yaw_rad: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
        Isometry3::from_parts(Translation3::from(position_m), turn)
    }

    fn is_near(found_m: [f64; 3], expected: &Isometry3<f64>) -> bool {
        (Vector3::from(found_m) - expected.translation.vector).norm() < 1e-6
    }

    proptest! {
        #[test]
        fn jumps_move_places_as_rigid_motions_do(
            before in prop::array::uniform3(-1e3..1e3_f64), now in prop::array::uniform3(-1e3..1e3_f64),
            place in prop::array::uniform3(-1e3..1e3_f64), yaws in prop::array::uniform3(-10.0..10.0_f64),
        ) {
            let [yaw_before, yaw_now, yaw_place] = yaws;
            let jump = Jump::between((before, yaw_before), (now, yaw_now));
            let oracle = isometry(now, yaw_now) * isometry(before, yaw_before).inverse();
            let there = isometry(place, yaw_place);
            prop_assert!(is_near(jump.place_m(before), &isometry(now, yaw_now)), "the vehicle itself");
            prop_assert!(is_near(jump.place_m(place), &(oracle * there)));
            let [_, _, yaw_rad] = jump.pose([place[0], place[1], yaw_place]);
            prop_assert!((oracle * there).rotation.angle_to(&isometry(place, yaw_rad).rotation) < 1e-6);
            let next = Jump::between((place, yaw_place), (before, yaw_now));
            prop_assert!(is_near(jump.then(&next).place_m(place), &isometry(next.place_m(jump.place_m(place)), 0.0)));
            prop_assert!(is_near(jump.then(&jump.inverse()).place_m(place), &there));
            prop_assert!(is_near(jump.inverse().then(&jump).place_m(place), &there));
        }
    }

    #[test]
    fn turns_take_the_short_way_round() {
        for (from_rad, to_rad, turn_rad) in
            [(3.1, -3.1, TAU - 6.2), (-3.1, 3.1, 6.2 - TAU), (0.2, 6.3, 6.1 - TAU)]
        {
            assert!((turned_rad(from_rad, to_rad) - turn_rad).abs() < 1e-12, "{from_rad} {to_rad}");
        }
        assert_eq!(turned_rad(0.0, PI), PI);
    }
}
