//! Point clouds of any layout as the points of a scan.

mod classes;
mod geometry;
mod layout;

use nalgebra::{Isometry3, Point3};

use bus::message::PointRecord;
use terrain::TerrainClass;

use crate::message::PointCloud2;
pub use classes::{ClassLabels, LabelsError};
pub use geometry::GeometryClasses;
use layout::Layout;
pub use layout::LayoutError;

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

/// Nearest that a return can be [m].
const RANGE_MIN_M: f32 = 1e-3;
/// Farthest that a return is believed [m].
const RANGE_MAX_M: f32 = 1e4;

/// The points of a cloud, moved by `motion`, at most `n_max` of them.
///
/// # Errors
/// Its fields are not there, lie beyond their points, or it is shorter than it says.
pub fn sweep(
    cloud: &PointCloud2,
    classes: &Classes,
    motion: &Isometry3<f64>,
    n_max: usize,
) -> Result<Sweep, LayoutError> {
    let label = match classes {
        Classes::Labels(labels) => Some(labels.field.as_str()),
        Classes::Geometry(_) => None,
    };
    let layout = Layout::new(cloud, label)?;
    let stride = layout.n_points().div_ceil(n_max.max(1)).max(1);
    let mut sweep = Sweep::default();
    for place in (0..layout.n_points()).step_by(stride) {
        let (position_m, label) = layout.point(&cloud.data, place);
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
        let moved = motion * Point3::from(position_m.map(f64::from));
        let position_m = [moved.x, moved.y, moved.z].map(|axis_m| axis_m as f32);
        sweep.points.push(PointRecord { position_m, class_number });
    }
    sweep.n_left_out = layout.n_points() - layout.n_points().div_ceil(stride);
    if let Classes::Geometry(geometry) = classes {
        geometry.classify(&mut sweep.points);
    }
    Ok(sweep)
}

#[cfg(test)]
mod tests;
