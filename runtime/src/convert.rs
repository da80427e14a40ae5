//! Between the messages of the channels and those of the pipeline, which are the same in other words.

use bus::message::{
    DecisionRecord, Grid, MissionRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Source, Stamp,
    StuckRecord, SurfaceHeader, TRACKS_MAX, TrackRecord, TracksHeader,
    mission::{DRIVE, EMERGENCY_STOP, MANUAL, NONE, PAUSED, UNDER_WAY},
};
use bus::payload::{TimesView, risk_views};
use kinodynamics::{Effect, Reason};
use mppi::CostToGoView;
use navigator::{
    Activity, CORNERS_MAX, Correction, DecisionMessage, Destination, Jump, MessageId, MissionMessage,
    OdometryMessage, PathWindow, RiskMapSource, RiskMessage, ScanMessage, StuckMessage, StuckPose,
    TracksMessage,
};
use terrain::GridGeometry;
use tracking::{Track, Variance};

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

// A message holds the headings that the search over poses knows.
const _: () = assert!(bus::payload::HEADINGS == mppi::N_HEADINGS);

// A message holds what a tracker tells of.
const _: () = assert!(TRACKS_MAX == tracking::TRACKS_MAX);

/// What says of what moves when and of what; its stamp, which its outlet gives it, is left out.
pub fn tracks_header(message: &TracksMessage) -> TracksHeader {
    let TracksMessage { scan, frame_at_ns, .. } = *message;
    TracksHeader { scan: source_of(scan), frame_at_ns, ..TracksHeader::default() }
}

/// One thing that moves.
pub fn track_record(track: &Track) -> TrackRecord {
    let Track { number, position_m, velocity_mps, variance, radius_m } = *track;
    let Variance { position_m2, cross_m2ps, velocity_m2ps2 } = variance;
    TrackRecord { number, position_m, velocity_mps, position_m2, cross_m2ps, velocity_m2ps2, radius_m }
}

/// What moves.
pub fn tracks_message(header: &TracksHeader, records: &[TrackRecord]) -> TracksMessage {
    let mut tracks = [Track::default(); TRACKS_MAX];
    let n = records.len().min(TRACKS_MAX);
    for (track, record) in tracks.iter_mut().zip(records) {
        let TrackRecord { number, position_m, velocity_mps, radius_m, .. } = *record;
        let TrackRecord { position_m2, cross_m2ps, velocity_m2ps2, .. } = *record;
        let variance = Variance { position_m2, cross_m2ps, velocity_m2ps2 };
        *track = Track { number, position_m, velocity_mps, variance, radius_m };
    }
    let TracksHeader { stamp, scan, frame_at_ns } = *header;
    TracksMessage::new(id_of(stamp.source()), (id_of(scan), stamp.valid_at_ns), frame_at_ns, &tracks[..n])
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
    let content = risk_views(record, payload).map(|(map, times)| {
        let TimesView { seconds, turning_s } = times;
        (map, CostToGoView { geometry: map.geometry, seconds, turning_s })
    });
    RiskMessage {
        header: navigator::RiskHeader {
            id: id_of(record.stamp.source()),
            valid_at_ns: record.stamp.valid_at_ns,
            surface: id_of(record.surface),
            frame_at_ns: record.odometry_at_ns,
            stuck: id_of(record.stuck),
            destination: Destination { goal_m: record.goal_m, tolerance_m: record.tolerance_m },
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

/// Numbers of [`DecisionRecord::correction`]; the reasons of [`Reason::ALL`] follow from [`AS_PLANNED`] on.
const CORRECTED: u32 = 1;
const BOUNDED: u32 = 2;
/// The first of them.
pub const AS_PLANNED: u32 = 3;

/// What became of a command, as a decision's record tells it; `None` where nobody corrects.
pub fn correction_effect(record: &DecisionRecord) -> Option<Effect> {
    match record.correction {
        CORRECTED => Some(Effect::Corrected),
        BOUNDED => Some(Effect::Bounded),
        number => {
            let place = number.checked_sub(AS_PLANNED)? as usize;
            Reason::ALL.get(place).copied().map(Effect::AsPlanned)
        }
    }
}

/// With what whoever corrects commands made of the planned one.
fn with_correction(record: DecisionRecord, correction: &Correction) -> DecisionRecord {
    let Correction { planned, corrected } = correction;
    DecisionRecord {
        correction: match corrected.effect() {
            Effect::Corrected => CORRECTED,
            Effect::Bounded => BOUNDED,
            Effect::AsPlanned(reason) => AS_PLANNED + reason as u32,
        },
        correction_share: corrected.share,
        curvature_change_per_m: corrected.curvature_change_per_m,
        planned_steering_rad: planned.steering_rad,
        ..record
    }
}

/// A decision; how long it took is left out.
pub fn decision_record(message: &DecisionMessage) -> DecisionRecord {
    let destination = message.destination.unwrap_or(Destination { goal_m: [0.0; 2], tolerance_m: 0.0 });
    let [learned, physics] = message.held.map(source_of);
    let (odometry, n_odometry) = message.odometry;
    let state = message.state;
    let (imu, n_imu) = message.imu;
    let record = DecisionRecord {
        command: bus::message::CommandRecord::from(&message.decision)
            .decided_on(message.odometry_at_ns, message.scan_at_ns()),
        cycle: message.cycle,
        decided_at_ns: message.decided_at_ns,
        odometry: source_of(odometry),
        n_odometry,
        risk: message.risk.map_or(Source::default(), |(_, header)| source_of(header.id)),
        map_source: message.risk.map_or(0, |(source, _)| number_of(source)),
        mission: source_of(message.mission),
        learned,
        physics,
        tracks: source_of(message.tracks),
        goal_m: destination.goal_m,
        tolerance_m: destination.tolerance_m,
        n_rollouts: message.n_rollouts as u64,
        elapsed_s: message.elapsed_s,
        state: [state.x_m, state.y_m, state.yaw_rad, state.speed_mps, state.steering_rad],
        imu: source_of(imu),
        n_imu,
        ..DecisionRecord::default()
    };
    message.correction.as_ref().map_or(record, |correction| with_correction(record, correction))
}

fn number_of(source: RiskMapSource) -> u64 {
    match source {
        RiskMapSource::Learned => LEARNED,
        RiskMapSource::Physics => PHYSICS,
    }
}
