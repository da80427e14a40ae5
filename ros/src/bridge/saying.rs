//! The topics that are spoken on.

use bicycle::{Command, Decision, Limits, Vehicle};
use bus::ages::Periods;
use bus::channel::{Bus, Inlet, PLAN, RISK, RISK_PHYSICS};
use bus::clock::{self, SECOND_NS};
use bus::message::{MissionRecord, PlanRecord, RiskHeader, Stamp};
use bus::payload::risk_views;
use formats::{RobotRos, RosCommand};

use super::BridgeError;
use crate::complaints::Complaints;
use crate::message::{
    AckermannDriveStamped, DiagnosticArray, Header, OccupancyGrid, Path, Time, TwistStamped,
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
    diagnostics: Option<Voice<DiagnosticArray>>,
    plans: Inlet<Stamp, PlanRecord>,
    maps: [Inlet<RiskHeader, [f32; 4]>; 2],
    map_at_ns: u64,
    diagnosed_at_ns: u64,
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
            diagnostics: node.speak(&topics.diagnostics, Saying::Passing)?,
            plans: bus.inlet(&PLAN)?,
            maps: [bus.inlet(&RISK)?, bus.inlet(&RISK_PHYSICS)?],
            map_at_ns: 0,
            diagnosed_at_ns: 0,
            map_frame: ros.map_frame.clone(),
            vehicle_frame: ros.vehicle_frame.clone(),
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
        let Self { plan: Some(voice), plans, map_frame, .. } = self else { return Ok(()) };
        let mut newest = None;
        plans.poll(|stamp, places| {
            let pose = |place: &PlanRecord| [place.position_m[0], place.position_m[1], place.yaw_rad];
            let told = |stamp_ns| telling::path(header(map_frame, stamp_ns), places.iter().map(pose));
            newest = stamp_ns(stamp.valid_at_ns).map(told);
        });
        newest.map_or(Ok(()), |plan| voice.say(plan))
    }

    /// The newest risk map, whoever made it.
    pub(super) fn maps(&mut self, stamp_ns: &StampNs<'_>) -> Result<(), NodeError> {
        let Self { risk: Some(voice), maps, map_at_ns, map_frame, limits, .. } = self else { return Ok(()) };
        for inlet in maps {
            let Some(message) = inlet.newest() else { continue };
            let valid_at_ns = message.header().stamp.valid_at_ns;
            if valid_at_ns <= *map_at_ns {
                continue;
            }
            *map_at_ns = valid_at_ns;
            let views = risk_views(message.header(), message.payload());
            let (Some((map, _)), Some(stamp_ns)) = (views, stamp_ns(valid_at_ns)) else { continue };
            voice.say(telling::occupancy(header(map_frame, stamp_ns), &map, limits))?;
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
        let status = [self.input_status(now_ns, diagnosis), decision_status(diagnosis)].to_vec();
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
        telling::status(level, "surefoot: input", message, &values)
    }
}

fn decision_status(diagnosis: &Diagnosis<'_>) -> crate::message::DiagnosticStatus {
    let (level, message) = match &diagnosis.decision {
        Some(decision @ Decision::Stop(_)) => (WARNING, telling::decision_text(decision)),
        Some(decision) => (WELL, telling::decision_text(decision)),
        None => (WARNING, "nothing is commanded".to_owned()),
    };
    let mission = diagnosis.mission.map_or_else(|| "unknown".to_owned(), |mission| mission.to_string());
    telling::status(level, "surefoot: decision", message, &[("mission", mission)])
}

fn header(frame: &str, stamp_ns: i64) -> Header {
    Header { stamp: Time::from_nanoseconds(stamp_ns), frame_id: frame.to_owned() }
}
