//! The room that a vehicle takes up.

use serde::{Deserialize, Serialize};

/// A box in the body frame that holds the vehicle: what a range sensor sees inside it is the vehicle itself. One whose
/// highest corner lies below its lowest along any axis holds nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyBox {
    /// Rearmost, rightmost, lowest corner: forward, left, up of the rear axle's centre [m].
    pub min_m: [f64; 3],
    /// Foremost, leftmost, highest corner [m].
    pub max_m: [f64; 3],
}

impl BodyBox {
    /// Holds nothing.
    pub const EMPTY: Self = Self { min_m: [0.0; 3], max_m: [-1.0; 3] };

    /// Whether a point of the body frame lies inside, the faces included.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        (0..3).all(|axis| (self.min_m[axis]..=self.max_m[axis]).contains(&point_m[axis]))
    }

    /// Larger by `margin_m` on every side.
    pub fn grown(&self, margin_m: f64) -> Self {
        Self {
            min_m: self.min_m.map(|value| value - margin_m),
            max_m: self.max_m.map(|value| value + margin_m),
        }
    }

    /// Along a ray from `origin_m` in the direction of the unit vector `direction`, the distance to the first point of
    /// the box [m]; zero from inside, `None` past it.
    pub fn distance_along(&self, origin_m: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let (mut enters_m, mut leaves_m) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            if self.max_m[axis] < self.min_m[axis] {
                return None;
            }
            if direction[axis] == 0.0 {
                if !(self.min_m[axis]..=self.max_m[axis]).contains(&origin_m[axis]) {
                    return None;
                }
                continue;
            }
            let [a_m, b_m] =
                [self.min_m[axis], self.max_m[axis]].map(|face| (face - origin_m[axis]) / direction[axis]);
            enters_m = enters_m.max(a_m.min(b_m));
            leaves_m = leaves_m.min(a_m.max(b_m));
        }
        (enters_m <= leaves_m).then_some(enters_m)
    }
}

impl Default for BodyBox {
    fn default() -> Self {
        Self::EMPTY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BOX: BodyBox = BodyBox { min_m: [-0.8, -0.9, -0.2], max_m: [2.6, 0.9, 1.3] };

    proptest! {
        #[test]
        fn rays_meet_the_box_where_small_steps_do(
            origin in prop::array::uniform3(-4.0..4.0_f64), aim in prop::array::uniform3(-3.0..3.0_f64),
        ) {
            let along: [f64; 3] = std::array::from_fn(|axis| aim[axis] - origin[axis]);
            let length_m = along.iter().map(|v| v * v).sum::<f64>().sqrt();
            prop_assume!(length_m > 0.1);
            let direction = along.map(|v| v / length_m);
            let at = |t_m: f64| std::array::from_fn(|axis| origin[axis] + t_m * direction[axis]);
            let stepped_m = (0..12_000).map(|k| 1e-3 * f64::from(k)).find(|t_m| BOX.contains(at(*t_m)));
            let found_m = BOX.distance_along(origin, direction);
            // Whatever is found lies on the box.
            prop_assert!(found_m.is_none_or(|found_m| BOX.grown(1e-9).contains(at(found_m))), "{:?}", found_m);
            match (stepped_m, found_m) {
                (Some(stepped_m), Some(found_m)) => prop_assert!((-1e-9..2e-3).contains(&(stepped_m - found_m))),
                // A ray may cut a corner by less than a step.
                (None, Some(found_m)) => prop_assert!(!BOX.grown(-2e-3).contains(at(found_m + 1e-3))),
                (Some(_), None) => prop_assert!(false, "passed {:?}", stepped_m),
                (None, None) => {}
            }
        }
    }

    #[test]
    fn rays_along_an_axis_pass_beside_and_strike_inside() {
        let distance_m = BOX.distance_along([-2.8, 0.0, 0.0], [1.0, 0.0, 0.0]);
        assert!(distance_m.is_some_and(|found_m| (found_m - 2.0).abs() < 1e-12), "{distance_m:?}");
        assert_eq!(BOX.distance_along([-2.8, 1.0, 0.0], [1.0, 0.0, 0.0]), None);
        assert_eq!(BOX.distance_along([0.0, 0.0, 2.3], [0.0, 0.0, 1.0]), None, "behind it");
        assert_eq!(BOX.distance_along([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), Some(0.0), "from inside");
        assert_eq!(BodyBox::EMPTY.distance_along([-2.8, -0.5, -0.5], [1.0, 0.0, 0.0]), None);
        assert!(!BodyBox::EMPTY.contains([-0.5; 3]));
    }
}
