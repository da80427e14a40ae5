//! Poses in any frame as places of the map to go to.

use nalgebra::Point3;

use crate::message::{Header, Path, Pose, PoseArray, PoseStamped};
use crate::rigid::{self, PoseError};
use crate::transforms::{TransformError, Transforms};

/// Places of one order at the most.
const PLACES_MAX: usize = 4096;

/// Why poses are nowhere to go to. Every message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GoalError {
    /// There is none.
    #[error("poses: expected at least {least}, found {found}")]
    TooFew {
        /// How many there have to be.
        least: usize,
        /// How many there are.
        found: usize,
    },
    /// There are too many.
    #[error("poses: expected at most {PLACES_MAX}, found {found}")]
    TooMany {
        /// How many there are.
        found: usize,
    },
    /// One is no pose.
    #[error("pose {place}: {source}")]
    Pose {
        /// Which, from 0.
        place: usize,
        /// Why.
        source: PoseError,
    },
    /// Its frame is not joined to the map's.
    #[error(transparent)]
    Transform(#[from] TransformError),
}

/// The place that a pose is at, east and north in the map [m].
///
/// # Errors
/// See [`GoalError`].
pub fn of_pose(goal: &PoseStamped, transforms: &Transforms, map: &str) -> Result<Vec<[f64; 2]>, GoalError> {
    places_m(&goal.header, [&goal.pose], transforms, map)
}

/// The places that poses are at, in their order.
///
/// # Errors
/// See [`GoalError`].
pub fn of_array(goals: &PoseArray, transforms: &Transforms, map: &str) -> Result<Vec<[f64; 2]>, GoalError> {
    at_least(1, goals.poses.len())?;
    places_m(&goals.header, &goals.poses, transforms, map)
}

/// The corners of a path. Its own frame counts; those of its poses are not looked at, as they are not by other planners.
///
/// # Errors
/// See [`GoalError`].
pub fn of_path(path: &Path, transforms: &Transforms, map: &str) -> Result<Vec<[f64; 2]>, GoalError> {
    at_least(2, path.poses.len())?;
    places_m(&path.header, path.poses.iter().map(|stamped| &stamped.pose), transforms, map)
}

fn at_least(least: usize, found: usize) -> Result<(), GoalError> {
    match found {
        _ if found < least => Err(GoalError::TooFew { least, found }),
        _ if found > PLACES_MAX => Err(GoalError::TooMany { found }),
        _ => Ok(()),
    }
}

fn places_m<'a>(
    header: &Header,
    poses: impl IntoIterator<Item = &'a Pose>,
    transforms: &Transforms,
    map: &str,
) -> Result<Vec<[f64; 2]>, GoalError> {
    // Where frames lie now: a goal stays where it is, whenever it was said.
    let to_map = transforms.latest(&header.frame_id, map)?;
    let place_m = |(place, pose): (usize, &Pose)| {
        let motion = rigid::motion_of_pose(pose).map_err(|source| GoalError::Pose { place, source })?;
        let there = to_map * Point3::from(motion.translation.vector);
        Ok([there.x, there.y])
    };
    poses.into_iter().enumerate().map(place_m).collect()
}
