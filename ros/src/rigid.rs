//! Between ROS's poses and rigid motions, with everything checked that must be a number.

use nalgebra::{Isometry3, Quaternion as Numbers, Translation3, UnitQuaternion, Vector3 as Axes};

use crate::message::{Pose, Quaternion, Transform, Vector3};

/// How far from 1 a quaternion's norm may be.
const NORM_TOLERANCE: f64 = 0.05;
/// How far away a place may be that anybody drives at [m].
const PLACE_MAX_M: f64 = 1e7;

/// Why a pose is none. Every message is one line.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// A number is none.
    #[error("{what}: expected finite numbers, found {found:?}")]
    NotFinite {
        /// Which numbers.
        what: &'static str,
        /// What they are.
        found: [f64; 3],
    },
    /// It is no rotation.
    #[error("orientation: expected a quaternion of norm 1, found (x y z w) {found:?} of norm {norm:.3}")]
    NoRotation {
        /// What it is.
        found: [f64; 4],
        /// Its norm.
        norm: f64,
    },
    /// It is nowhere.
    #[error("position: expected a place within {PLACE_MAX_M:e} m of the frame's origin, found {found_m:?} m")]
    TooFar {
        /// Where it is [m].
        found_m: [f64; 3],
    },
}

/// The rigid motion of a pose: takes points of the body to the frame that the pose is told in.
pub fn motion_of_pose(pose: &Pose) -> Result<Isometry3<f64>, PoseError> {
    let Pose { position, orientation } = *pose;
    motion([position.x, position.y, position.z], orientation)
}

/// The rigid motion of a transform: takes points of the child frame to its parent.
pub fn motion_of_transform(transform: &Transform) -> Result<Isometry3<f64>, PoseError> {
    motion(transform.translation.numbers(), transform.rotation)
}

/// A vector, if it is one.
pub fn axes(what: &'static str, vector: Vector3) -> Result<Axes<f64>, PoseError> {
    let found = vector.numbers();
    if found.iter().all(|number| number.is_finite()) {
        Ok(Axes::from(found))
    } else {
        Err(PoseError::NotFinite { what, found })
    }
}

/// A rotation as a message.
pub fn quaternion_of(rotation: &UnitQuaternion<f64>) -> Quaternion {
    let [x, y, z, w] = rotation.coords.into();
    Quaternion { x, y, z, w }
}

fn motion(position_m: [f64; 3], rotation: Quaternion) -> Result<Isometry3<f64>, PoseError> {
    let [x, y, z] = position_m;
    let translation = axes("position", Vector3 { x, y, z })?;
    if translation.amax() > PLACE_MAX_M {
        return Err(PoseError::TooFar { found_m: position_m });
    }
    let Quaternion { x, y, z, w } = rotation;
    let numbers = Numbers::new(w, x, y, z);
    let norm = numbers.norm();
    // What is no number is not near 1 either.
    if (norm - 1.0).abs() <= NORM_TOLERANCE {
        let rotation = UnitQuaternion::from_quaternion(numbers);
        Ok(Isometry3::from_parts(Translation3::from(translation), rotation))
    } else {
        Err(PoseError::NoRotation { found: [x, y, z, w], norm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Point;
    use nalgebra::Point3;
    use std::f64::consts::FRAC_1_SQRT_2;

    #[test]
    fn a_quarter_turn_to_the_left_takes_forward_to_left() {
        let orientation = Quaternion { x: 0.0, y: 0.0, z: FRAC_1_SQRT_2, w: FRAC_1_SQRT_2 };
        let pose = Pose { position: Point { x: 3.0, y: -2.0, z: 0.5 }, orientation };
        let motion = motion_of_pose(&pose).unwrap();
        let there = motion * Point3::new(1.0, 0.0, 0.0);
        assert!((there - Point3::new(3.0, -1.0, 0.5)).norm() < 1e-12, "{there}");
        let (roll, pitch, yaw) = motion.rotation.euler_angles();
        assert!((yaw - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && roll.abs() + pitch.abs() < 1e-12);
        assert!((quaternion_of(&motion.rotation).z - FRAC_1_SQRT_2).abs() < 1e-12);
    }

    #[test]
    fn nose_down_is_a_positive_pitch() {
        let (sine, cosine) = 0.1_f64.sin_cos();
        let down = Quaternion { x: 0.0, y: sine, z: 0.0, w: cosine };
        let motion = motion_of_pose(&Pose { orientation: down, ..Pose::default() }).unwrap();
        assert!((motion.rotation.euler_angles().1 - 0.2).abs() < 1e-12);
        assert!((motion * Point3::new(1.0, 0.0, 0.0)).z < 0.0, "the nose lies lower");
    }

    #[test]
    fn what_is_no_pose_is_refused_by_what_it_is() {
        let told = |pose: Pose| motion_of_pose(&pose).unwrap_err().to_string();
        let nan = Point { y: f64::NAN, ..Point::default() };
        assert!(
            told(Pose { position: nan, ..Pose::default() }).starts_with("position: expected finite numbers")
        );
        let far = Point { x: 1e8, ..Point::default() };
        assert!(told(Pose { position: far, ..Pose::default() }).contains("within 1e7 m"));
        for w in [0.0, 2.0, f64::NAN, f64::INFINITY] {
            let orientation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w };
            let text = told(Pose { orientation, ..Pose::default() });
            assert!(text.starts_with("orientation: expected a quaternion of norm 1"), "{text}");
        }
    }
}
