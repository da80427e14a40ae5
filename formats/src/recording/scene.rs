//! Poses, rollouts and scans as Foxglove messages.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    Color, FrameTransform, LinePrimitive, PackedElementField, Point3, PointCloud, PoseInFrame, PosesInFrame,
    Quaternion, SceneEntity, SceneUpdate, Vector3, line_primitive,
};
use terrain::{Pose, Scan};

use super::{BODY_FRAME, MAP_FRAME, timestamp};

/// Width of a drawn rollout [m].
const ROLLOUT_WIDTH_M: f64 = 0.03;

fn position(pose: &Pose) -> Vector3 {
    Vector3 { x: pose.x_m, y: pose.y_m, z: pose.z_m }
}

fn orientation(pose: &Pose) -> Quaternion {
    let rotation = pose.isometry().rotation;
    Quaternion { x: rotation.i, y: rotation.j, z: rotation.k, w: rotation.w }
}

fn pose_message(pose: &Pose) -> foxglove::messages::Pose {
    foxglove::messages::Pose { position: Some(position(pose)), orientation: Some(orientation(pose)) }
}

pub(super) fn transform(at_ns: u64, pose: &Pose) -> FrameTransform {
    FrameTransform {
        timestamp: Some(timestamp(at_ns)),
        parent_frame_id: MAP_FRAME.into(),
        child_frame_id: BODY_FRAME.into(),
        translation: Some(position(pose)),
        rotation: Some(orientation(pose)),
    }
}

pub(super) fn pose_in_frame(at_ns: u64, pose: &Pose) -> PoseInFrame {
    PoseInFrame {
        timestamp: Some(timestamp(at_ns)),
        frame_id: MAP_FRAME.into(),
        pose: Some(pose_message(pose)),
    }
}

pub(super) fn poses_in_frame(at_ns: u64, poses: &[Pose]) -> PosesInFrame {
    PosesInFrame {
        timestamp: Some(timestamp(at_ns)),
        frame_id: MAP_FRAME.into(),
        poses: poses.iter().map(pose_message).collect(),
    }
}

/// One line per rollout: the best in solid green, the others fading to red.
pub(super) fn rollouts(at_ns: u64, best_first: &[Vec<[f64; 3]>]) -> SceneUpdate {
    let n_others = best_first.len().saturating_sub(1).max(1) as f64;
    let color = |rank: usize| match rank {
        0 => Color { r: 0.1, g: 0.9, b: 0.2, a: 1.0 },
        _ => Color { r: 0.3 + 0.7 * rank as f64 / n_others, g: 0.5, b: 0.1, a: 0.35 },
    };
    let line = |(rank, points): (usize, &Vec<[f64; 3]>)| LinePrimitive {
        r#type: line_primitive::Type::LineStrip as i32,
        thickness: if rank == 0 { 2.0 * ROLLOUT_WIDTH_M } else { ROLLOUT_WIDTH_M },
        points: points.iter().map(|&[x, y, z]| Point3 { x, y, z }).collect(),
        color: Some(color(rank)),
        ..LinePrimitive::default()
    };
    let entity = SceneEntity {
        timestamp: Some(timestamp(at_ns)),
        frame_id: MAP_FRAME.into(),
        id: "rollouts".into(),
        lines: best_first.iter().enumerate().map(line).collect(),
        ..SceneEntity::default()
    };
    SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
}

/// Bytes of a point.
pub(super) const POINT_BYTES: usize = 13;

/// Points of 13 bytes: x, y, z [m] as f32 and the class as a byte.
pub(super) fn point_cloud(at_ns: u64, scan: &Scan) -> PointCloud {
    let mut data = Vec::with_capacity(POINT_BYTES * scan.points.len());
    for point in &scan.points {
        point.position_m.iter().for_each(|value| data.extend(value.to_le_bytes()));
        data.push(point.class as u8);
    }
    PointCloud {
        timestamp: Some(timestamp(at_ns)),
        frame_id: BODY_FRAME.into(),
        pose: Some(pose_message(&Pose::default())),
        point_stride: POINT_BYTES as u32,
        fields: point_fields(),
        data: data.into(),
    }
}

/// The fields of such a point.
pub(super) fn point_fields() -> Vec<PackedElementField> {
    fields(&[
        ("x", NumericType::Float32),
        ("y", NumericType::Float32),
        ("z", NumericType::Float32),
        ("class", NumericType::Uint8),
    ])
}

/// Fields that follow one another without a gap.
pub(super) fn fields(list: &[(&str, NumericType)]) -> Vec<PackedElementField> {
    let mut offset = 0;
    let mut field = |&(name, kind): &(&str, NumericType)| {
        let field = PackedElementField { name: name.to_owned(), offset, r#type: kind as i32 };
        offset += if kind == NumericType::Uint8 { 1 } else { 4 };
        field
    };
    list.iter().map(&mut field).collect()
}
