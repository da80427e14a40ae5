//! Where a range sensor sits on the vehicle, and what it sees of the vehicle itself.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::{BodyBox, Pose, RangePoint, Scan};

/// A sensor on the vehicle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mount {
    /// Its place in the body frame: forward, left, up of the rear axle's centre [m].
    pub position_m: [f64; 3],
    /// Its roll, pitch and yaw against the body frame [rad], as of a [`Pose`].
    pub attitude_rad: [f64; 3],
    /// Boxes of the body frame in which what it sees is the vehicle, or what it carries.
    #[serde(default)]
    pub own_body: Vec<BodyBox>,
}

impl Mount {
    /// Takes places of the sensor's frame to the body frame.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [x_m, y_m, z_m] = self.position_m;
        let [roll_rad, pitch_rad, yaw_rad] = self.attitude_rad;
        Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }.isometry()
    }

    /// A scan of the sensor's frame as one of the body frame, without the points on the vehicle. Points that are no
    /// numbers stay what they are.
    pub fn in_body_frame(&self, scan: &Scan) -> Scan {
        let motion = self.isometry();
        let moved = |place_m: [f32; 3]| motion * Point3::from(place_m.map(f64::from));
        let is_own = |place_m: &Point3<f64>| self.own_body.iter().any(|own| own.contains((*place_m).into()));
        let single = |place_m: Point3<f64>| [place_m.x, place_m.y, place_m.z].map(|v| v as f32);
        let points = scan.points.iter().filter_map(|point| {
            let place_m = moved(point.position_m);
            (!is_own(&place_m)).then_some(RangePoint { position_m: single(place_m), ..*point })
        });
        Scan {
            valid_at_ns: scan.valid_at_ns,
            origin_m: single(moved(scan.origin_m)),
            points: points.collect(),
        }
    }

    /// The first number that is none: its field and what was found.
    pub fn first_invalid(&self) -> Option<(&'static str, f64)> {
        let bounds = self.own_body.iter().flat_map(|own| own.min_m.into_iter().chain(own.max_m));
        let numbers = [("position_m", self.position_m), ("attitude_rad", self.attitude_rad)];
        let named = numbers.into_iter().flat_map(|(field, values)| values.map(|value| (field, value)));
        named.chain(bounds.map(|value| ("own_body", value))).find(|(_, value)| !value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TerrainClass;
    use std::f64::consts::FRAC_PI_2;

    fn seen(mount: &Mount, position_m: [f32; 3]) -> Vec<[f32; 3]> {
        let points = vec![RangePoint { position_m, class: TerrainClass::Loose }];
        let scan = Scan { valid_at_ns: 7, origin_m: [0.0; 3], points };
        let moved = mount.in_body_frame(&scan);
        assert_eq!(moved.valid_at_ns, 7);
        moved.points.iter().map(|point| point.position_m).collect()
    }

    fn is_near(found_m: [f32; 3], expected_m: [f32; 3]) -> bool {
        found_m.iter().zip(expected_m).all(|(found, expected)| (found - expected).abs() < 1e-6)
    }

    /// A sensor that looks to the left from 1 m ahead and 2 m up: 3 m before it are 3 m left of the axle's line.
    #[test]
    fn what_a_sensor_sees_lies_where_it_looks() {
        let left =
            Mount { position_m: [1.0, 0.0, 2.0], attitude_rad: [0.0, 0.0, FRAC_PI_2], ..Mount::default() };
        assert!(is_near(seen(&left, [3.0, 0.0, 0.0])[0], [1.0, 3.0, 2.0]));
        // Pitched by a right angle it looks down.
        let down = Mount { attitude_rad: [0.0, FRAC_PI_2, 0.0], ..left.clone() };
        assert!(is_near(seen(&down, [1.5, 0.0, 0.0])[0], [1.0, 0.0, 0.5]));
        // Rolled by one, its left is up.
        let rolled = Mount { attitude_rad: [FRAC_PI_2, 0.0, 0.0], ..left };
        assert!(is_near(seen(&rolled, [0.0, 0.5, 0.0])[0], [1.0, 0.0, 2.5]));
        let origin_m = rolled.in_body_frame(&Scan::default()).origin_m;
        assert!(is_near(origin_m, [1.0, 0.0, 2.0]), "the rays start at the sensor");
    }

    #[test]
    fn what_lies_on_the_vehicle_is_left_out_and_what_is_no_number_stays() {
        let bonnet = BodyBox { min_m: [0.0, -1.0, 0.0], max_m: [2.0, 1.0, 1.0] };
        let mount = Mount { position_m: [0.0, 0.0, 2.0], own_body: vec![bonnet], ..Mount::default() };
        assert_eq!(seen(&mount, [1.0, 0.0, -1.5]).len(), 0);
        assert_eq!(seen(&mount, [3.0, 0.0, -1.5]).len(), 1);
        assert!(seen(&mount, [f32::NAN, 0.0, 0.0])[0][0].is_nan());
    }

    #[test]
    fn numbers_that_are_none_are_found() {
        let mount = Mount { attitude_rad: [0.0, f64::INFINITY, 0.0], ..Mount::default() };
        assert_eq!(mount.first_invalid(), Some(("attitude_rad", f64::INFINITY)));
        assert_eq!(Mount::default().first_invalid(), None);
    }
}
