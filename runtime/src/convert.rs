//! Between the messages of the channels and those of the pipeline, which are the same in other words.

use bus::message::{
    DecisionRecord, Grid, MissionRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Source, Stamp,
    StuckRecord, SurfaceHeader,
    mission::{DRIVE, EMERGENCY_STOP, MANUAL, NONE, PAUSED, UNDER_WAY},
};
use bus::payload::risk_views;
use mppi::CostToGoView;
use navigator::{
    Activity, CORNERS_MAX, DecisionMessage, Destination, Jump, MessageId, MissionMessage, OdometryMessage,
    PathWindow, RiskAuthor, RiskMessage, ScanMessage, StuckMessage, StuckPose,
};
use terrain::GridGeometry;

use crate::mapping::{FUSED, JUMPED, LEARNED, PHYSICS};

/// The name of a message.
pub fn id_of(source: Source) -> MessageId {
    let Source { epoch_ns, sequence } = source;
    MessageId { epoch_ns, sequence }
}

/// A message by its name.
pub fn source_of(id: MessageId) -> Source {
    let MessageId { epoch_ns, sequence } = id;
    Source { epoch_ns, sequence }
}

/// What a vehicle says of itself.
pub fn odometry_message(stamp: &Stamp, record: &OdometryRecord) -> OdometryMessage {
    OdometryMessage {
        id: id_of(stamp.source()),
        odometry: record.odometry(stamp.valid_at_ns),
        applied: record.applied(),
    }
}

/// A scan in the frame of its sensor, of the returns that are of a known class.
pub fn scan_message(header: &ScanHeader, points: &[PointRecord]) -> ScanMessage {
    let ScanHeader { stamp, sensor, .. } = *header;
    ScanMessage { id: id_of(stamp.source()), sensor, scan: header.sensor_scan(points) }
}

/// What a vehicle is told to do.
pub fn mission_message(stamp: &Stamp, record: &MissionRecord) -> MissionMessage {
    let MissionRecord { path_speed_mps: speed_mps, tolerance_m, .. } = *record;
    let n_corners = (record.n_corners as usize).min(CORNERS_MAX);
    let mut corners_m = [[0.0; 2]; CORNERS_MAX];
    let said = record.corner_x_m.into_iter().zip(record.corner_y_m).take(n_corners);
    corners_m.iter_mut().zip(said).for_each(|(corner_m, (x_m, y_m))| *corner_m = [x_m, y_m]);
    MissionMessage {
        id: id_of(stamp.source()),
        valid_at_ns: stamp.valid_at_ns,
        activity: match record.state {
            DRIVE => Activity::Drive,
            PAUSED => Activity::Paused,
            MANUAL => Activity::Manual,
            EMERGENCY_STOP => Activity::EmergencyStop,
            _ => Activity::Nothing,
        },
        is_over: record.outcome != UNDER_WAY,
        destination: record.destination_m().map(|goal_m| Destination { goal_m, tolerance_m }),
        path: (speed_mps > 0.0).then_some(PathWindow { speed_mps, n_corners, corners_m }),
        level: record.level(),
    }
}

/// The part of a mission's record that a message tells.
pub fn mission_record(message: &MissionMessage) -> MissionRecord {
    let destination = message.destination.unwrap_or(Destination { goal_m: [0.0; 2], tolerance_m: 0.0 });
    let mut record = MissionRecord {
        state: match message.activity {
            Activity::Drive => DRIVE,
            Activity::Nothing => NONE,
            Activity::Paused => PAUSED,
            Activity::Manual => MANUAL,
            Activity::EmergencyStop => EMERGENCY_STOP,
        },
        goal_m: destination.goal_m,
        tolerance_m: destination.tolerance_m,
        alpha: message.level.map_or(0.0, traversability::CvarLevel::get),
        ..MissionRecord::default()
    };
    if let Some(PathWindow { speed_mps, n_corners, corners_m }) = message.path {
        (record.path_speed_mps, record.n_corners) = (speed_mps, n_corners as u64);
        for (place, [x_m, y_m]) in corners_m.into_iter().take(n_corners).enumerate() {
            (record.corner_x_m[place], record.corner_y_m[place]) = (x_m, y_m);
        }
    }
    record
}

/// What a map of the ground says of itself; its stamp, which its outlet gives it, and the hashes are left out.
pub fn surface_record(header: &navigator::SurfaceHeader, geometry: &GridGeometry) -> SurfaceHeader {
    let jump = header.jump.unwrap_or(Jump::NONE);
    SurfaceHeader {
        grid: Grid::from(geometry),
        scan: source_of(header.scan),
        odometry: OdometryRecord::from(&header.odometry),
        odometry_at_ns: header.odometry.valid_at_ns,
        frame_at_ns: header.frame_at_ns,
        last_odometry: source_of(header.last_odometry),
        n_odometry: header.n_odometry,
        event: if header.jump.is_some() { JUMPED } else { FUSED },
        jump_m: jump.step_m,
        jump_yaw_rad: jump.yaw_rad,
        shift_m: header.shift.step_m,
        shift_yaw_rad: header.shift.yaw_rad,
        ..SurfaceHeader::default()
    }
}

/// The same the other way round.
pub fn surface_header(record: &SurfaceHeader) -> navigator::SurfaceHeader {
    navigator::SurfaceHeader {
        id: id_of(record.stamp.source()),
        valid_at_ns: record.stamp.valid_at_ns,
        scan: id_of(record.scan),
        odometry: record.odometry.odometry(record.odometry_at_ns),
        frame_at_ns: record.frame_at_ns,
        last_odometry: id_of(record.last_odometry),
        n_odometry: record.n_odometry,
        jump: (record.event == JUMPED).then(|| jump_of(record)),
        shift: shift_of(record),
    }
}

/// The jump of the localisation that a map tells of.
pub fn jump_of(record: &SurfaceHeader) -> Jump {
    Jump { step_m: record.jump_m, yaw_rad: record.jump_yaw_rad }
}

/// All jumps so far together, as a map tells of them.
pub fn shift_of(record: &SurfaceHeader) -> Jump {
    Jump { step_m: record.shift_m, yaw_rad: record.shift_yaw_rad }
}

/// A risk map, read where its message lies.
pub fn risk_message<'a>(record: &RiskHeader, payload: &'a [[f32; 4]]) -> RiskMessage<'a> {
    let content = risk_views(record, payload)
        .map(|(map, seconds)| (map, CostToGoView { geometry: map.geometry, seconds }));
    RiskMessage {
        header: navigator::RiskHeader {
            id: id_of(record.stamp.source()),
            valid_at_ns: record.stamp.valid_at_ns,
            surface: id_of(record.surface),
            frame_at_ns: record.odometry_at_ns,
            stuck: id_of(record.stuck),
            goal_m: record.goal_m,
        },
        content,
    }
}

/// A pose where the vehicle got stuck.
pub fn stuck_message(stamp: &Stamp, record: &StuckRecord) -> StuckMessage {
    let StuckRecord { position_m, yaw_rad } = *record;
    StuckMessage {
        id: id_of(stamp.source()),
        valid_at_ns: stamp.valid_at_ns,
        pose: StuckPose { position_m, yaw_rad },
    }
}

/// A decision; how long it took is left out.
pub fn decision_record(message: &DecisionMessage) -> DecisionRecord {
    let destination = message.destination.unwrap_or(Destination { goal_m: [0.0; 2], tolerance_m: 0.0 });
    let [learned, physics] = message.held.map(source_of);
    let (odometry, n_odometry) = message.odometry;
    let state = message.state;
    DecisionRecord {
        command: bus::message::CommandRecord::from(&message.decision)
            .decided_on(message.odometry_at_ns, message.scan_at_ns()),
        cycle: message.cycle,
        decided_at_ns: message.decided_at_ns,
        odometry: source_of(odometry),
        n_odometry,
        risk: message.risk.map_or(Source::default(), |(_, header)| source_of(header.id)),
        author: message.risk.map_or(0, |(author, _)| number_of(author)),
        mission: source_of(message.mission),
        learned,
        physics,
        goal_m: destination.goal_m,
        tolerance_m: destination.tolerance_m,
        n_rollouts: message.n_rollouts as u64,
        elapsed_s: message.elapsed_s,
        state: [state.x_m, state.y_m, state.yaw_rad, state.speed_mps, state.steering_rad],
        ..DecisionRecord::default()
    }
}

fn number_of(author: RiskAuthor) -> u64 {
    match author {
        RiskAuthor::Learned => LEARNED,
        RiskAuthor::Physics => PHYSICS,
    }
}
