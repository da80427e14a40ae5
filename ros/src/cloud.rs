//! Point clouds of any layout as the points of a scan.

mod classes;
mod geometry;
mod layout;
mod twist;

use nalgebra::Isometry3;

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
    // Points of one firing have one time, and those beside one another mostly one label.
    let mut moment = Moment::new(0.0, &motion);
    let mut labelled = (0, classes.of(0));
    for Read { position_m, label, time } in layout.points(&cloud.data, stride) {
        // What is no number is not within.
        let is_within = position_m.iter().all(|axis_m| axis_m.abs() <= RANGE_MAX_M);
        if !(is_within && position_m.iter().any(|axis_m| axis_m.abs() >= RANGE_MIN_M)) {
            sweep.n_without_place += 1;
            continue;
        }
        let label = label.unwrap_or_default();
        if label != labelled.0 {
            labelled = (label, classes.of(label));
        }
        let class = labelled.1;
        sweep.n_unknown_labels += usize::from(class.is_none());
        let class_number = class.unwrap_or(TerrainClass::Obstacle) as u32;
        if let Some((times, time)) = times.as_ref().zip(time) {
            let after_s = offset_s(times, time, cloud.header.stamp.nanoseconds())?;
            if after_s != moment.after_s {
                moment = Moment::new(after_s, &motion);
            }
        }
        sweep.points.push(PointRecord { position_m: moment.moved(position_m), class_number });
    }
    sweep.n_left_out = layout.n_points() - layout.n_points().div_ceil(stride);
    if let Classes::Geometry(geometry) = classes {
        geometry.classify(&mut sweep.points, to_upright);
    }
    Ok(sweep)
}

impl Classes {
    /// What a label means, if anybody has said so; without labels everything is open ground at first.
    fn of(&self, label: i64) -> Option<TerrainClass> {
        match self {
            Self::Labels(labels) => labels.class(label),
            Self::Geometry(_) => Some(TerrainClass::Open),
        }
    }
}

/// What is taken out of points of one time. In plain numbers: matrices are not inlined everywhere.
struct Moment {
    after_s: f64,
    /// Each axis' turn, and what is added to it.
    axes: [([f64; 3], f64); 3],
}

impl Moment {
    fn new(after_s: f64, motion: impl Fn(f64) -> Isometry3<f64>) -> Self {
        let motion = motion(after_s);
        let rotation = motion.rotation.to_rotation_matrix();
        let axis = |row: usize| ([0, 1, 2].map(|col| rotation[(row, col)]), motion.translation.vector[row]);
        Self { after_s, axes: [0, 1, 2].map(axis) }
    }

    #[inline]
    fn moved(&self, position_m: [f32; 3]) -> [f32; 3] {
        let [x_m, y_m, z_m] = position_m;
        let along = |([x, y, z], shift_m): ([f64; 3], f64)| {
            (x * f64::from(x_m) + y * f64::from(y_m) + z * f64::from(z_m) + shift_m) as f32
        };
        [along(self.axes[0]), along(self.axes[1]), along(self.axes[2])]
    }
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
