//! Point clouds of any layout as the points of a scan.

mod classes;
mod geometry;
mod layout;
mod twist;

use nalgebra::{Isometry3, Point3};

use bus::message::PointRecord;
use formats::{RosPointEpoch, RosPointTime};
use terrain::TerrainClass;

use crate::message::PointCloud2;
pub use classes::{ClassLabels, LabelsError};
pub use geometry::GeometryClasses;
pub use layout::LayoutError;
use layout::{Layout, OFFSET_MAX_S, Read};
pub use twist::Twist;

/// How it is made out what a point is of.
#[derive(Clone, Debug, PartialEq)]
pub enum Classes {
    /// By a field of the cloud.
    Labels(ClassLabels),
    /// By the geometry of the scan alone: what rises from its surroundings must not be touched.
    Geometry(GeometryClasses),
}

/// What became of a cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Its points in the frame that they were asked for in.
    pub points: Vec<PointRecord>,
    /// Points that are no numbers, or at the sensor itself, as drivers mark rays without a return.
    pub n_without_place: usize,
    /// Points of a label that nobody has said the class of; they count as obstacles.
    pub n_unknown_labels: usize,
    /// Points beyond those that a scan may have: every so many-th was kept.
    pub n_left_out: usize,
}

/// What the fields of clouds mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Meaning {
    /// What points are of.
    pub classes: Classes,
    /// When they were measured; `None` = all at the stamp.
    pub times: Option<RosPointTime>,
}

/// Nearest that a return can be [m].
const RANGE_MIN_M: f32 = 1e-3;
/// Farthest that a return is believed [m].
const RANGE_MAX_M: f32 = 1e4;

/// The points of a cloud, at most `n_max` of them, each moved by what `motion` says for the time that it was measured after
/// the stamp [s]. `to_upright` takes points as they are told then to a frame whose third axis points up.
///
/// # Errors
/// Its fields are not there, lie beyond their points, tell times of another sweep, or it is shorter than it says.
pub fn sweep(
    cloud: &PointCloud2,
    meaning: &Meaning,
    n_max: usize,
    to_upright: &Isometry3<f64>,
    motion: impl Fn(f64) -> Isometry3<f64>,
) -> Result<Sweep, LayoutError> {
    let Meaning { classes, times } = meaning;
    let label = match classes {
        Classes::Labels(labels) => Some(labels.field.as_str()),
        Classes::Geometry(_) => None,
    };
    let layout = Layout::new(cloud, label, times.as_ref().map(|times| times.field.as_str()))?;
    let stride = layout.n_points().div_ceil(n_max.max(1)).max(1);
    let mut sweep = Sweep { points: Vec::with_capacity(layout.n_points() / stride), ..Sweep::default() };
    // Points of one firing have one time. A matrix turns a point by less work than a quaternion.
    let at = |after_s: f64| {
        let motion = motion(after_s);
        (after_s, motion.rotation.to_rotation_matrix(), motion.translation)
    };
    let mut moment = at(0.0);
    for place in (0..layout.n_points()).step_by(stride) {
        let Read { position_m, label, time } = layout.point(&cloud.data, place);
        let range_m = position_m.iter().fold(0.0_f32, |range_m, axis_m| range_m.max(axis_m.abs()));
        let is_place = position_m.iter().all(|axis_m| axis_m.is_finite());
        if !(is_place && (RANGE_MIN_M..=RANGE_MAX_M).contains(&range_m)) {
            sweep.n_without_place += 1;
            continue;
        }
        let class = match (classes, label) {
            (Classes::Labels(labels), Some(label)) => labels.class(label),
            _ => Some(TerrainClass::Open),
        };
        sweep.n_unknown_labels += usize::from(class.is_none());
        let class_number = class.unwrap_or(TerrainClass::Obstacle) as u32;
        if let Some((times, time)) = times.as_ref().zip(time) {
            let after_s = offset_s(times, time, cloud.header.stamp.nanoseconds())?;
            if after_s != moment.0 {
                moment = at(after_s);
            }
        }
        let (_, rotation, translation) = &moment;
        let moved = translation * (rotation * Point3::from(position_m.map(f64::from)));
        let position_m = [moved.x, moved.y, moved.z].map(|axis_m| axis_m as f32);
        sweep.points.push(PointRecord { position_m, class_number });
    }
    sweep.n_left_out = layout.n_points() - layout.n_points().div_ceil(stride);
    if let Classes::Geometry(geometry) = classes {
        geometry.classify(&mut sweep.points, to_upright);
    }
    Ok(sweep)
}

/// How long after the stamp a point was measured [s].
fn offset_s(times: &RosPointTime, time: f64, stamp_ns: i64) -> Result<f64, LayoutError> {
    let since_s = time * times.unit_s;
    let offset_s = match times.counts_from {
        RosPointEpoch::Stamp => since_s,
        RosPointEpoch::Epoch => since_s - stamp_ns as f64 * 1e-9,
    };
    // What is no number is not within.
    if offset_s.abs() <= OFFSET_MAX_S {
        Ok(offset_s)
    } else {
        Err(LayoutError::Time { name: times.field.clone(), offset_s })
    }
}

#[cfg(test)]
mod tests;
