//! The topics that are spoken on.

use bicycle::{Command, Decision, Limits, Vehicle};
use bus::ages::Periods;
use bus::channel::{Bus, FUTURES, Inlet, PLAN, RISK, RISK_PHYSICS, TRACKS};
use bus::clock::{self, SECOND_NS};
use bus::message::{FutureRecord, MissionRecord, PlanRecord, RiskHeader, Stamp, TrackRecord, TracksHeader};
use bus::payload::risk_views;
use formats::{RobotRos, RosCommand};

use super::BridgeError;
use super::heights::Heights;
use crate::complaints::Complaints;
use crate::message::{
    AckermannDriveStamped, DiagnosticArray, GridMap, Header, MarkerArray, OccupancyGrid, Path, Time,
    TwistStamped,
};
use crate::node::{Node, NodeError, Saying, Voice};
use crate::telling;

/// Time between two diagnoses [ns].
const DIAGNOSIS_NS: u64 = SECOND_NS;
/// Levels of a diagnosis.
const WELL: u8 = 0;
const WARNING: u8 = 1;
const ERROR: u8 = 2;

/// What the vehicle is commanded with.
enum Commanding {
    Ackermann(Option<Voice<AckermannDriveStamped>>),
    Twist(Option<Voice<TwistStamped>>),
}

/// What is said.
pub(super) struct Voices {
    command: Commanding,
    plan: Option<Voice<Path>>,
    risk: Option<Voice<OccupancyGrid>>,
    grid_map: Option<Voice<GridMap>>,
    markers: Option<Voice<MarkerArray>>,
    diagnostics: Option<Voice<DiagnosticArray>>,
    plans: Inlet<Stamp, PlanRecord>,
    futures: Inlet<Stamp, FutureRecord>,
    maps: [Inlet<RiskHeader, [f32; 4]>; 2],
    heights: Heights,
    tracks: Inlet<TracksHeader, TrackRecord>,
    map_at_ns: u64,
    diagnosed_at_ns: u64,
    /// What the node's part of the diagnoses is called.
    node: String,
    map_frame: String,
    vehicle_frame: String,
    wheelbase_m: f64,
    limits: Limits,
    age_max_s: f64,
}

/// What is told of the bridge.
pub(super) struct Diagnosis<'a> {
    pub(super) decision: Option<Decision>,
    pub(super) mission: Option<MissionRecord>,
    pub(super) odometry_at_ns: Option<u64>,
    pub(super) scan_at_ns: Option<u64>,
    pub(super) complaints: &'a Complaints,
}

/// Time of the robot's stamps at a time of the bus [ns].
type StampNs<'a> = dyn Fn(u64) -> Option<i64> + 'a;

impl Voices {
    pub(super) fn new(
        bus: &Bus,
        node: &mut Node,
        ros: &RobotRos,
        vehicle: &Vehicle,
        periods: &Periods,
    ) -> Result<Self, BridgeError> {
        let topics = &ros.topics;
        Ok(Self {
            command: match ros.command {
                RosCommand::Ackermann => Commanding::Ackermann(node.speak(&topics.command, Saying::Passing)?),
                RosCommand::Twist => Commanding::Twist(node.speak(&topics.command, Saying::Passing)?),
            },
            plan: node.speak(&topics.plan, Saying::Passing)?,
            risk: node.speak(&topics.risk, Saying::Latched)?,
            grid_map: node.speak(&topics.grid_map, Saying::Latched)?,
            markers: node.speak(&topics.markers, Saying::Passing)?,
            diagnostics: node.speak(&topics.diagnostics, Saying::Passing)?,
            plans: bus.inlet(&PLAN)?,
            futures: bus.inlet(&FUTURES)?,
            maps: [bus.inlet(&RISK)?, bus.inlet(&RISK_PHYSICS)?],
            heights: Heights::new(bus)?,
            tracks: bus.inlet(&TRACKS)?,
            map_at_ns: 0,
            diagnosed_at_ns: 0,
            node: node.full_name().to_owned(),
            map_frame: ros.frame(&ros.map_frame),
            vehicle_frame: ros.frame(&ros.vehicle_frame),
            wheelbase_m: vehicle.geometry.wheelbase_m,
            limits: vehicle.limits,
            age_max_s: 5.0 * periods.scan_s.max(periods.odometry_s),
        })
    }

    pub(super) fn command(&self, command: Command, stamp_ns: i64) -> Result<(), NodeError> {
        let header = header(&self.vehicle_frame, stamp_ns);
        match &self.command {
            Commanding::Ackermann(Some(voice)) => voice.say(telling::ackermann(header, command)),
            Commanding::Twist(Some(voice)) => voice.say(telling::twist(header, command, self.wheelbase_m)),
            Commanding::Ackermann(None) | Commanding::Twist(None) => Ok(()),
        }
    }

    /// The way that is meant to be driven.
    pub(super) fn plan(&mut self, stamp_ns: &StampNs<'_>) -> Result<(), NodeError> {
        let mut newest = None;
        self.plans.poll(|stamp, places| newest = Some((stamp.valid_at_ns, places.to_vec())));
        let Some((valid_at_ns, places)) = newest else { return Ok(()) };
        let Some(stamp_ns) = stamp_ns(valid_at_ns) else { return Ok(()) };
        let header = header(&self.map_frame, stamp_ns);
        if let Some(voice) = &self.plan {
            let pose = |place: &PlanRecord| [place.position_m[0], place.position_m[1], place.yaw_rad];
            voice.say(telling::path(header.clone(), places.iter().map(pose)))?;
        }
        let Some(voice) = &self.markers else { return Ok(()) };
        voice.say(telling::plan_markers(header, &places, self.limits.speed_max_mps))
    }

    /// What else was tried.
    pub(super) fn futures(&mut self, stamp_ns: &StampNs<'_>) -> Result<(), NodeError> {
        let Self { markers: Some(voice), futures, map_frame, .. } = self else { return Ok(()) };
        let mut newest = None;
        futures.poll(|stamp, places| {
            let stamp_ns = stamp_ns(stamp.valid_at_ns);
            newest = stamp_ns.map(|stamp_ns| telling::futures(&header(map_frame, stamp_ns), places));
        });
        newest.map_or(Ok(()), |told| voice.say(told))
    }

    /// What moves.
    pub(super) fn moving(&mut self, stamp_ns: &StampNs<'_>) -> Result<(), NodeError> {
        let Self { markers: Some(voice), tracks, map_frame, .. } = self else { return Ok(()) };
        let mut newest = None;
        tracks.poll(|told, tracks| {
            let stamp_ns = stamp_ns(told.stamp.valid_at_ns);
            newest = stamp_ns.map(|stamp_ns| telling::moving(&header(map_frame, stamp_ns), tracks));
        });
        newest.filter(|told| !told.markers.is_empty()).map_or(Ok(()), |told| voice.say(told))
    }

    /// The newest risk map, whoever made it.
    pub(super) fn maps(&mut self, stamp_ns: &StampNs<'_>) -> Result<(), NodeError> {
        let Self { risk, grid_map, maps, heights, map_at_ns, map_frame, limits, .. } = self;
        if grid_map.is_some() {
            heights.hear();
        }
        for inlet in maps {
            let Some(message) = inlet.newest() else { continue };
            let valid_at_ns = message.header().stamp.valid_at_ns;
            if valid_at_ns <= *map_at_ns {
                continue;
            }
            *map_at_ns = valid_at_ns;
            let views = risk_views(message.header(), message.payload());
            let (Some((map, _)), Some(stamp_ns)) = (views, stamp_ns(valid_at_ns)) else { continue };
            let header = header(map_frame, stamp_ns);
            if let Some(voice) = grid_map {
                let surface = heights.of(&message.header().surface, map.geometry.resolution_m);
                let height_m = |lattice| *surface?.at_lattice(lattice)?;
                voice.say(telling::grid_map(header.clone(), &map, height_m))?;
            }
            if let Some(voice) = risk {
                voice.say(telling::occupancy(header, &map, limits))?;
            }
        }
        Ok(())
    }

    /// How the bridge is doing, once a second.
    pub(super) fn diagnostics(
        &mut self,
        now_ns: u64,
        stamp_ns: &StampNs<'_>,
        diagnosis: &Diagnosis<'_>,
    ) -> Result<(), NodeError> {
        let Some(voice) = &self.diagnostics else { return Ok(()) };
        if now_ns.saturating_sub(self.diagnosed_at_ns) < DIAGNOSIS_NS {
            return Ok(());
        }
        self.diagnosed_at_ns = now_ns;
        let header = header("", stamp_ns(now_ns).unwrap_or_default());
        let status = vec![self.input_status(now_ns, diagnosis), self.decision_status(diagnosis)];
        voice.say(DiagnosticArray { header, status })
    }

    /// What is wrong with what comes, the gravest first.
    fn input_status(&self, now_ns: u64, diagnosis: &Diagnosis<'_>) -> crate::message::DiagnosticStatus {
        let age_s = |at_ns: Option<u64>| at_ns.map_or(f64::INFINITY, |at_ns| clock::age_s(now_ns, at_ns));
        let (odometry_s, scan_s) = (age_s(diagnosis.odometry_at_ns), age_s(diagnosis.scan_at_ns));
        let complaint = diagnosis.complaints.recent(now_ns).next();
        let (level, message) = match complaint {
            _ if odometry_s > self.age_max_s => (ERROR, "no odometry".to_owned()),
            _ if scan_s > self.age_max_s => (ERROR, "no scan".to_owned()),
            Some(complaint) => (WARNING, complaint),
            None => (WELL, "odometry and scans come".to_owned()),
        };
        let values = [
            ("odometry age [s]", format!("{odometry_s:.3}")),
            ("scan age [s]", format!("{scan_s:.3}")),
            ("messages refused", diagnosis.complaints.n().to_string()),
        ];
        telling::status(level, &format!("{}: input", self.node), message, &values)
    }

    fn decision_status(&self, diagnosis: &Diagnosis<'_>) -> crate::message::DiagnosticStatus {
        let (level, message) = match &diagnosis.decision {
            Some(decision @ Decision::Stop(_)) => (WARNING, decision.to_string()),
            Some(decision) => (WELL, decision.to_string()),
            None => (WARNING, "nothing is commanded".to_owned()),
        };
        let mission = diagnosis.mission.map_or_else(|| "unknown".to_owned(), |mission| mission.to_string());
        telling::status(level, &format!("{}: decision", self.node), message, &[("mission", mission)])
    }
}

fn header(frame: &str, stamp_ns: i64) -> Header {
    Header { stamp: Time::from_nanoseconds(stamp_ns), frame_id: frame.to_owned() }
}
