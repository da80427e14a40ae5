//! The node beside the bus: what comes from the robot goes in, what is decided goes out.

mod errands;
mod hearing;
mod heights;
mod saying;
mod services;

use std::sync::Arc;
use std::time::Duration;

use bicycle::{Decision, Vehicle};
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, COMMAND, ChannelError, Inlet, MISSION};
use bus::clock::{self, SECOND_NS};
use bus::message::{CommandRecord, MissionRecord, Stamp};
use bus::status::{Health, Meter, Role};
use formats::{RobotRos, RobotSensor, RosClock};

use crate::actuation::{Actuation, Halt};
use crate::cloud::{ClassLabels, Classes, GeometryClasses, LabelsError, Meaning};
use crate::complaints::Complaints;
use crate::environment::Discovery;
use crate::intake::{Clouds, Intake};
use crate::node::{Node, NodeError};
use crate::odometry::Frames;
use crate::orders::{Answer, Director, Order, Orders};
use crate::parameters::{Change, Parameters};
use crate::stamps::{Arrival, StampClock, StampSource};
use crate::transforms::Transforms;
use errands::Navigation;
use hearing::Ears;
use saying::Voices;
use services::Services;

/// Longest time between two looks at the bus [ns].
const POLL_NS: u64 = 5_000_000;
/// Edge of the columns by which classes are told from geometry, in widths of the vehicle.
const COLUMN_WIDTHS: f64 = 0.5;
/// Height of plants that may be pressed down, in diameters of a wheel.
const PLANTS_DIAMETERS: f64 = 2.0;

/// Why a bridge cannot begin or go on. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// The channels.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The node.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// What labels mean.
    #[error(transparent)]
    Labels(#[from] LabelsError),
}

/// What is bridged.
pub struct BridgeSetup<'a> {
    /// Topics, frames and clocks.
    pub ros: &'a RobotRos,
    /// The machine.
    pub vehicle: &'a Vehicle,
    /// The sensors that the robot file mounts, in its order.
    pub sensors: &'a [RobotSensor],
    /// How often the robot speaks.
    pub periods: Periods,
    /// How old what is followed may be.
    pub ages: AgeLimits,
    /// Share of the worst outcomes that the run was started to plan for, in (0, 1].
    pub alpha: f64,
    /// Who judges the ground, as `--method` names it.
    pub method: String,
    /// Who may hear the node.
    pub discovery: Discovery,
    /// Who says orders to the mission.
    pub director: Arc<Director>,
}

/// Bridges until `is_over` says to end; `tell` is given what is wrong, line by line. The last that it says is to stand.
///
/// # Errors
/// A channel or topic that cannot be used.
pub fn run(
    bus: &Bus,
    setup: BridgeSetup<'_>,
    is_over: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(&str),
) -> Result<(), BridgeError> {
    let mut bridge = Bridge::new(bus, setup)?;
    while !is_over() {
        bridge.look(tell)?;
    }
    bridge.stand()
}

struct Bridge {
    node: Node,
    ears: Ears,
    voices: Voices,
    intake: Intake,
    actuation: Actuation,
    orders: Orders,
    complaints: Complaints,
    commands: Inlet<Stamp, CommandRecord>,
    missions: Inlet<Stamp, MissionRecord>,
    mission: Option<MissionRecord>,
    decision: Option<Decision>,
    meter: Meter,
    command_period_ns: u64,
    commanded_at_ns: u64,
    /// When others of its name were looked for.
    heeded_at_ns: u64,
    services: Services,
    navigation: Option<Navigation>,
}

impl Bridge {
    fn new(bus: &Bus, setup: BridgeSetup<'_>) -> Result<Self, BridgeError> {
        let BridgeSetup { ros, vehicle, sensors, periods, ages, discovery, alpha, method, director } = setup;
        let mut node = Node::join(discovery, &ros.namespace, &ros.node)?;
        let transforms = Transforms::new(clock::nanoseconds(ros.transform_age_max_s));
        let frames = Frames { map: ros.frame(&ros.map_frame), vehicle: ros.frame(&ros.vehicle_frame) };
        let speed_max_mps = vehicle.limits.speed_max_mps;
        let parameters = Parameters {
            alpha,
            method,
            path_speed_mps: ros.path_speed_mps,
            speed_limit_mps: speed_max_mps,
            speed_max_mps,
            use_sim_time: ros.clock == RosClock::Simulated,
        };
        let stamps = StampClock::new(source_of(ros.clock));
        let services = Services::new(&mut node, parameters)?;
        Ok(Self {
            ears: Ears::new(bus, &mut node, &ros.topics)?,
            voices: Voices::new(bus, &mut node, ros, vehicle, &periods)?,
            navigation: Navigation::offer(&mut node, ros)?,
            node,
            intake: Intake::new(frames, clouds(ros, vehicle, sensors)?, stamps, transforms).kept_to(&periods),
            actuation: Actuation::new(vehicle.limits, ages),
            orders: Orders::new(director),
            complaints: Complaints::default(),
            commands: bus.inlet(&COMMAND)?,
            missions: bus.inlet(&MISSION)?,
            mission: None,
            decision: None,
            meter: Meter::new(bus, Role::Ros)?,
            command_period_ns: clock::nanoseconds(ros.command_hz.recip()),
            commanded_at_ns: 0,
            heeded_at_ns: 0,
            services,
        })
    }

    /// Waits for what comes, and deals with it.
    fn look(&mut self, tell: &mut dyn FnMut(&str)) -> Result<(), BridgeError> {
        self.node.wait(Duration::from_nanos(POLL_NS));
        self.hear(tell)?;
        self.follow_answers(tell);
        let (actuation, mission, navigation) = (&mut self.actuation, &mut self.mission, &mut self.navigation);
        let mut is_new = false;
        self.commands.poll(|stamp, commands| {
            commands.iter().for_each(|command| actuation.admit(command, stamp.published_at_ns));
            is_new = true;
        });
        let now_ns = clock::now_ns();
        self.missions.poll(|_, records| {
            let navigation = navigation.as_mut().into_iter();
            navigation.for_each(|one| records.iter().for_each(|record| one.errands.follow(record, now_ns)));
            *mission = records.last().copied().or(*mission);
        });
        self.mission.iter().for_each(|mission| self.services.follow(mission));
        self.run_errands(now_ns, tell)?;
        self.set_parameters(now_ns, tell)?;
        if is_new || now_ns.saturating_sub(self.commanded_at_ns) >= self.command_period_ns {
            self.meter.count(now_ns.saturating_sub(self.commanded_at_ns + self.command_period_ns));
            self.command(now_ns)?;
        }
        self.show(now_ns)?;
        self.report(now_ns)
    }

    /// Does what was asked for by parameters.
    fn set_parameters(&mut self, now_ns: u64, tell: &mut dyn FnMut(&str)) -> Result<(), BridgeError> {
        let stamp_ns = self.intake.clock().stamp_ns(now_ns, arrival()).unwrap_or_default();
        for change in self.services.answer(stamp_ns)? {
            match change {
                Change::Alpha(alpha) if self.orders.say(Order::Tolerate(alpha)).is_some() => {
                    self.services.note_asked();
                }
                Change::Alpha(_) => tell("alpha: expected no more orders than the mission can answer"),
                Change::SpeedLimit(speed_mps) => self.actuation.limit_speed(speed_mps),
                Change::PathSpeed(_) => {}
            }
        }
        Ok(())
    }

    /// Says what the vehicle is to do now.
    fn command(&mut self, now_ns: u64) -> Result<(), BridgeError> {
        self.commanded_at_ns = now_ns;
        let told = self.actuation.carry_out(now_ns);
        self.decision = Some(told.decision);
        // As long as nobody has said what time it is, a command would be of none.
        let Some(stamp_ns) = self.intake.clock().stamp_ns(told.of_ns, arrival()) else { return Ok(()) };
        Ok(self.voices.command(told.command, stamp_ns)?)
    }

    /// The last word of a bridge that ends.
    fn stand(&mut self) -> Result<(), BridgeError> {
        self.actuation.stop(Halt::Emergency);
        self.command(clock::now_ns())
    }

    fn show(&mut self, now_ns: u64) -> Result<(), BridgeError> {
        let stamps = self.intake.clock();
        let stamp_ns = |at_ns: u64| stamps.stamp_ns(at_ns, arrival());
        self.voices.plan(&stamp_ns)?;
        self.voices.futures(&stamp_ns)?;
        self.voices.maps(&stamp_ns)?;
        self.voices.moving(&stamp_ns)?;
        let diagnosis = saying::Diagnosis {
            decision: self.decision,
            mission: self.mission,
            odometry_at_ns: self.ears.odometry.map(|(at_ns, _)| at_ns),
            scan_at_ns: self.ears.scan_at_ns,
            complaints: &self.complaints,
        };
        Ok(self.voices.diagnostics(now_ns, &stamp_ns, &diagnosis)?)
    }

    fn follow_answers(&mut self, tell: &mut dyn FnMut(&str)) {
        let now_ns = clock::now_ns();
        for Answer { ticket, order, said } in self.orders.answers() {
            if matches!(order, Order::Tolerate(_)) {
                self.services.note_answered();
            }
            if let Some(navigation) = &mut self.navigation {
                navigation.errands.note_answer(ticket, &said, now_ns);
            }
            match said {
                Ok(mission) => tell(&format!("{}: {mission}", name_of(&order))),
                Err(problem) => tell(&format!("{}: {problem}", name_of(&order))),
            }
        }
    }

    fn report(&mut self, now_ns: u64) -> Result<(), BridgeError> {
        let since_s = |at_ns: Option<u64>| at_ns.map_or(-1.0, |at_ns| clock::age_s(now_ns, at_ns));
        let command_s = self.actuation.age_ns(now_ns).map_or(-1.0, |age_ns| age_ns as f64 / SECOND_NS as f64);
        let (odometry_s, scan_s) =
            (since_s(self.ears.odometry.map(|(at_ns, _)| at_ns)), since_s(self.ears.scan_at_ns));
        let health = Health {
            age_s: [command_s, odometry_s, scan_s, -1.0],
            messages: [0, self.actuation.n_refused() + self.complaints.n(), 0],
            figure: self.ears.n_heard as f64,
            ..Health::default()
        };
        let counts = [self.commands.counts(), self.missions.counts()];
        Ok(self.meter.report(now_ns, || counts.into_iter().fold(health, Health::with))?)
    }
}

/// Longest time between two looks at clocks that count as one [ns].
const AT_ONCE_NS: u64 = 100_000;
/// Looks after which they count as one anyway.
const LOOKS_MAX: usize = 8;

/// What both clocks say now. A process that is held up between the two looks again.
fn arrival() -> Arrival {
    let look = || {
        let (before_ns, utc_ns) = (clock::now_ns(), clock::utc_ns());
        (clock::now_ns() - before_ns, Arrival { monotonic_ns: before_ns, utc_ns })
    };
    let mut best = look();
    for _ in 1..LOOKS_MAX {
        if best.0 <= AT_ONCE_NS {
            break;
        }
        let next = look();
        best = if next.0 < best.0 { next } else { best };
    }
    best.1
}

fn name_of(order: &Order) -> &'static str {
    match order {
        Order::Goals(_) => "goal",
        Order::Path { .. } => "path",
        Order::Tolerate(_) => "alpha",
        Order::Pause => "pause",
        Order::Resume => "resume",
        Order::Cancel => "cancel",
        Order::EmergencyStop => "emergency stop",
        Order::Reset => "reset",
    }
}

pub(crate) fn source_of(clock: RosClock) -> StampSource {
    match clock {
        RosClock::TimeOfDay => StampSource::TimeOfDay,
        RosClock::Simulated => StampSource::Simulated,
        RosClock::OfItsOwn => StampSource::OfItsOwn,
    }
}

/// What clouds of the robot are.
pub(crate) fn clouds(
    ros: &RobotRos,
    vehicle: &Vehicle,
    sensors: &[RobotSensor],
) -> Result<Clouds, LabelsError> {
    let meaning = Meaning { classes: classes(ros, vehicle)?, times: ros.point_time.clone() };
    let mounted = |sensor: &RobotSensor| (ros.frame(&sensor.name), sensor.mount.isometry());
    Ok(Clouds { meaning, sensors: sensors.iter().map(mounted).collect() })
}

/// By labels where the robot file says which; else what rises by more than half of the clearance is no ground.
fn classes(ros: &RobotRos, vehicle: &Vehicle) -> Result<Classes, LabelsError> {
    if let Some(labels) = &ros.labels {
        return Ok(Classes::Labels(ClassLabels::new(labels)?));
    }
    let geometry = vehicle.geometry;
    Ok(Classes::Geometry(GeometryClasses {
        column_m: COLUMN_WIDTHS * geometry.width_m,
        step_m: geometry.ground_clearance_m,
        plants_max_m: PLANTS_DIAMETERS * 2.0 * geometry.wheel_radius_m,
    }))
}
