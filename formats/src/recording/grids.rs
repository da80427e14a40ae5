//! Elevation and risk as Foxglove grids: rows run along y from the corner at the pose, as ours do.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{Grid, PackedElementField, Pose, Quaternion, Vector2, Vector3};
use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::RiskMapView;

use super::scene::fields;
use super::{MAP_FRAME, timestamp};

/// Cells of 14 bytes: height [m], its variance [m2], height of vegetation [m], class, knowledge.
pub(super) fn elevation(at_ns: u64, map: &GridMap<SurfaceCell>) -> Grid {
    let mut data = Vec::with_capacity(14 * map.values().len());
    for cell in map.values() {
        data.extend(cell.height_m.to_le_bytes());
        data.extend(cell.height_variance_m2.to_le_bytes());
        data.extend(cell.vegetation_height_m.to_le_bytes());
        data.extend([cell.class() as u8, cell.knowledge as u8]);
    }
    grid(at_ns, map.geometry(), elevation_fields(), data)
}

/// The fields of such a cell.
pub(super) fn elevation_fields() -> Vec<PackedElementField> {
    fields(&[
        ("height_m", NumericType::Float32),
        ("height_variance_m2", NumericType::Float32),
        ("vegetation_height_m", NumericType::Float32),
        ("class", NumericType::Uint8),
        ("knowledge", NumericType::Uint8),
    ])
}

/// Cells of 18 bytes: the four worst expected values at one yaw, class, flags.
pub(super) fn risk(at_ns: u64, map: &RiskMapView<'_>, yaw_rad: f64) -> Grid {
    let bin = map.yaw_bin(yaw_rad);
    let mut data = Vec::with_capacity(18 * map.ground.len());
    for (risks, ground) in map.risks.chunks_exact(map.n_yaws).zip(map.ground) {
        let risk = risks[bin];
        for value in [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad] {
            data.extend(value.to_le_bytes());
        }
        data.extend([ground.class, ground.flags.0]);
    }
    grid(at_ns, &map.geometry, risk_fields(), data)
}

/// The fields of such a cell.
pub(super) fn risk_fields() -> Vec<PackedElementField> {
    fields(&[
        ("linear_traction", NumericType::Float32),
        ("angular_traction", NumericType::Float32),
        ("roll_rad", NumericType::Float32),
        ("pitch_rad", NumericType::Float32),
        ("class", NumericType::Uint8),
        ("flags", NumericType::Uint8),
    ])
}

fn grid(at_ns: u64, geometry: &GridGeometry, fields: Vec<PackedElementField>, data: Vec<u8>) -> Grid {
    let cell_stride = (data.len() / geometry.n_cells().max(1)) as u32;
    let [x, y] = geometry.south_west_m();
    let corner = Pose {
        position: Some(Vector3 { x, y, z: 0.0 }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    };
    Grid {
        timestamp: Some(timestamp(at_ns)),
        frame_id: MAP_FRAME.into(),
        pose: Some(corner),
        column_count: geometry.n_cols as u32,
        cell_size: Some(Vector2 { x: geometry.resolution_m, y: geometry.resolution_m }),
        row_stride: cell_stride * geometry.n_cols as u32,
        cell_stride,
        fields,
        data: data.into(),
    }
}
