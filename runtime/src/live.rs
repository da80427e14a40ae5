//! A live view of a run: what a recording shows, served to whoever looks on with Foxglove.
//!
//! It is a process of its own that only reads. What it shows is thinned to what an eye follows, and what a slow client
//! does not take in time is dropped by the server: nobody waits for it.

mod way;

use bicycle::Decision;
use formats::DriveTopics;
use foxglove::{Context, WebSocketServer, WebSocketServerHandle};
use serde::Serialize;
use terrain::Pose;

use crate::RuntimeError;
use crate::convert::risk_message;
use bus::channel::{Bus, COMMAND, Inlet, MISSION, ODOMETRY, RISK, RISK_PHYSICS, SURFACE};
use bus::clock::{self, SECOND_NS};
use bus::message::{
    CommandRecord, MissionRecord, OdometryRecord, RiskHeader, Stamp, StatusRecord, SurfaceHeader,
};
use bus::payload;
use bus::status::Role;

/// Port that Foxglove looks for.
pub const PORT: u16 = 8765;
/// Time between two looks at the channels [ns].
const POLL_NS: u64 = SECOND_NS / 100;
/// Time between two poses that are shown [ns].
const POSE_NS: u64 = SECOND_NS / 10;
/// Time between two maps that are shown [ns].
const MAP_NS: u64 = SECOND_NS / 2;
/// Messages that wait for a client; of more, the oldest is dropped.
const BACKLOG: usize = 64;
/// Topics of the statuses, by [`Role::ALL`].
const STATUS_TOPICS: [&str; 7] = [
    "/status/plant",
    "/status/mapping",
    "/status/learning",
    "/status/control",
    "/status/recorder",
    "/status/mission",
    "/status/ros",
];

/// Serves a live view on this address until `is_over` says to end; `tell` hears where.
///
/// # Errors
/// A channel that cannot be used, an address that is taken.
pub fn run(
    bus: &Bus,
    (host, port): (&str, u16),
    is_over: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(u16),
) -> Result<(), RuntimeError> {
    let mut live = Live::new(bus, host, port)?;
    tell(live.server.port());
    while !is_over() {
        live.look();
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    drop(live.server.stop());
    Ok(())
}

struct Live {
    server: WebSocketServerHandle,
    topics: DriveTopics,
    inlets: Inlets,
    seen: Seen,
}

struct Inlets {
    odometry: Inlet<Stamp, OdometryRecord>,
    surfaces: Inlet<SurfaceHeader, [f32; 8]>,
    risks: [Inlet<RiskHeader, [f32; 4]>; 2],
    commands: Inlet<Stamp, CommandRecord>,
    missions: Inlet<Stamp, MissionRecord>,
    statuses: Vec<Inlet<Stamp, StatusRecord>>,
}

/// What was seen last, and when what was shown.
#[derive(Default)]
struct Seen {
    odometry: Option<OdometryRecord>,
    pose_at_ns: u64,
    surface_at_ns: u64,
    risk_at_ns: u64,
}

/// A status as it is shown.
#[derive(Serialize)]
struct ShownStatus {
    process: u64,
    rate_hz: f64,
    lateness_median_s: f64,
    lateness_most_s: f64,
    age_s: [f64; 4],
    n_missed: u64,
    n_lost: u64,
    n_refused: u64,
    n_failed: u64,
    figure: f64,
}

impl Live {
    fn new(bus: &Bus, host: &str, port: u16) -> Result<Self, RuntimeError> {
        let inlets = Inlets {
            odometry: bus.inlet(&ODOMETRY)?,
            surfaces: bus.inlet(&SURFACE)?,
            risks: [bus.inlet(&RISK)?, bus.inlet(&RISK_PHYSICS)?],
            commands: bus.inlet(&COMMAND)?,
            missions: bus.inlet(&MISSION)?,
            statuses: Role::ALL.iter().map(|role| bus.inlet(&role.status())).collect::<Result<_, _>>()?,
        };
        let context = Context::new();
        let topics = DriveTopics::new(&context);
        let server = WebSocketServer::new()
            .name("surefoot")
            .bind(host, port)
            .message_backlog_size(BACKLOG)
            .context(&context)
            .start_blocking()
            .map_err(|error| RuntimeError::Live {
                address: format!("{host}:{port}"),
                problem: error.to_string(),
            })?;
        Ok(Self { server, topics, inlets, seen: Seen::default() })
    }

    fn look(&mut self) {
        let Self { topics, inlets, seen, .. } = self;
        inlets.odometry.poll(|stamp, records| seen.odometry(topics, stamp, records));
        inlets.missions.poll(|stamp, records| {
            if let Some([x_m, y_m]) = records.first().and_then(MissionRecord::destination_m) {
                topics.goal(stamp.valid_at_ns, &Pose { x_m, y_m, ..Pose::default() });
            }
        });
        inlets.surfaces.poll(|header, cells| {
            if is_due(&mut seen.surface_at_ns, header.stamp.published_at_ns, MAP_NS)
                && let Some(map) = payload::surface_map(header, cells)
            {
                topics.elevation(header.stamp.valid_at_ns, &map);
            }
        });
        for inlet in &mut inlets.risks {
            inlet.poll(|header, elements| seen.risk(topics, header, elements));
        }
        inlets.commands.poll(|stamp, records| {
            if let Some(decision) = records.first().and_then(CommandRecord::decision) {
                // A number that JSON cannot hold is not shown.
                drop(topics.json("/command", stamp.valid_at_ns, &shown_command(&decision)));
            }
        });
        for (inlet, topic) in inlets.statuses.iter_mut().zip(STATUS_TOPICS) {
            inlet.poll(|stamp, records| {
                if let Some(status) = records.first() {
                    drop(topics.json(topic, stamp.valid_at_ns, &ShownStatus::from(status)));
                }
            });
        }
    }
}

impl Seen {
    fn odometry(&mut self, topics: &DriveTopics, stamp: &Stamp, records: &[OdometryRecord]) {
        let finite = |record: &&OdometryRecord| record.odometry(stamp.valid_at_ns).is_finite();
        let Some(record) = records.first().filter(finite) else { return };
        self.odometry = Some(*record);
        if is_due(&mut self.pose_at_ns, stamp.published_at_ns, POSE_NS) {
            let [x_m, y_m, z_m] = record.position_m;
            let [roll_rad, pitch_rad, yaw_rad] = record.attitude_rad;
            topics.pose(stamp.valid_at_ns, &Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad });
        }
    }

    /// The risk of the present heading, and the way of least time over that map.
    fn risk(&mut self, topics: &DriveTopics, header: &RiskHeader, elements: &[[f32; 4]]) {
        let Some((map, time_to_goal)) = risk_message(header, elements).content else { return };
        let Some(odometry) = self.odometry else { return };
        if is_due(&mut self.risk_at_ns, header.stamp.published_at_ns, MAP_NS) {
            topics.risk(header.stamp.valid_at_ns, &map, odometry.attitude_rad[2]);
            let way = way::to_goal(&time_to_goal, odometry.position_m);
            topics.path(header.stamp.valid_at_ns, &way);
        }
    }
}

impl From<&StatusRecord> for ShownStatus {
    fn from(status: &StatusRecord) -> Self {
        let StatusRecord { process, rate_hz, lateness_s, age_s, n_missed, .. } = *status;
        let StatusRecord { n_lost, n_refused, n_failed, figure, .. } = *status;
        let [lateness_median_s, lateness_most_s] = lateness_s;
        Self {
            process,
            rate_hz,
            lateness_median_s,
            lateness_most_s,
            age_s,
            n_missed,
            n_lost,
            n_refused,
            n_failed,
            figure,
        }
    }
}

/// A command as it is shown.
#[derive(Serialize)]
struct ShownCommand {
    decision: &'static str,
    reason: String,
    speed_mps: f32,
    steering_rad: f32,
}

fn shown_command(decision: &Decision) -> ShownCommand {
    let none = |decision, reason| ShownCommand { decision, reason, speed_mps: 0.0, steering_rad: 0.0 };
    match decision {
        Decision::Drive(command) => ShownCommand {
            decision: "drive",
            reason: String::new(),
            speed_mps: command.speed_mps,
            steering_rad: command.steering_rad,
        },
        Decision::Hold(reason) => none("hold", format!("{reason:?}")),
        Decision::Stop(reason) => none("stop", format!("{reason:?}")),
    }
}

fn is_due(last_ns: &mut u64, now_ns: u64, period_ns: u64) -> bool {
    let is_due = now_ns.saturating_sub(*last_ns) >= period_ns;
    if is_due {
        *last_ns = now_ns;
    }
    is_due
}
