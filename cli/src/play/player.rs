//! Message by message through the parts of the pipeline. Nothing is decided here.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path;

use bicycle::{Applied, AppliedBy, Command, Decision, ImuSample};
use bus::clock;
use formats::{RecordedMessage, RobotRos};
use navigator::{
    Assessor, Belief, MessageId, Navigator, OdometryMessage, Order, PilotAges, Route, ScanMessage, Setup,
    Surface,
};
use ros::bag::{self, arrival, read};
use ros::intake::Intake;
use ros::message::{
    AckermannDriveStamped, Bool, Clock, Imu, Named, Odometry, Path, PointCloud2, PoseArray, PoseStamped,
    TfMessage, Twist, TwistStamped,
};
use scenarios::Bounds;
use serde::de::DeserializeOwned;
use terrain::Scan;
use traversability::CvarLevel;

use super::kept::{Cycle, Kept};
use crate::UsageError;
use crate::arguments::UpArguments;
use crate::drive::scene::Machine;
use crate::up::{robot, roles};

/// Returns of a scan at the most, as on the bus.
const POINTS_MAX: usize = 1 << 16;
/// Silence of the bag after which nothing is decided until it says something [ns]: the vehicle has long been stopped.
const SILENCE_MAX_NS: u64 = 10_000_000_000;
/// Speed below which a yaw rate tells no steering angle [m/s].
const SPEED_MIN_MPS: f64 = 0.05;

/// What plays, and what is kept of it.
pub(super) struct PlayerSetup<'a> {
    pub up: &'a UpArguments,
    pub ros: &'a RobotRos,
    pub machine: &'a Machine,
    /// Where to go until the bag says otherwise.
    pub route: Route,
    /// The recording that is left, and the part of the map that is drawn.
    pub recording: &'a path::Path,
    pub ground: Bounds,
}

/// The pipeline, fed by a bag.
pub(super) struct Player<'a> {
    ros: &'a RobotRos,
    machine: &'a Machine,
    /// What the robot file calls the topics.
    topics: BTreeMap<String, Topic>,
    intake: Intake,
    navigator: Navigator,
    kept: Kept,
    /// Ends of the goals that count [m], and how near is there [m].
    goal_m: [f64; 2],
    tolerance_m: f64,
    period_ns: u64,
    now_ns: u64,
    decides_at_ns: Option<u64>,
    /// What the bag says that the vehicle was told.
    applied: Option<Applied>,
    /// Where the front wheels are by that [rad], and since when [ns].
    steering: (f64, u64),
    /// What was said last of an emergency and of a pause: who repeats it orders nothing.
    switched: BTreeMap<Topic, bool>,
    n_messages: u64,
}

/// What a topic tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Topic {
    Odometry,
    Points,
    Imu,
    Moving,
    Fixed,
    Clock,
    Goal,
    Goals,
    Path,
    Emergency,
    Pause,
    Command,
}

fn topics(ros: &RobotRos) -> BTreeMap<String, Topic> {
    let names = &ros.topics;
    let single = [
        (&names.odometry, Topic::Odometry),
        (&names.imu, Topic::Imu),
        (&names.tf, Topic::Moving),
        (&names.tf_static, Topic::Fixed),
        (&names.clock, Topic::Clock),
        (&names.goal, Topic::Goal),
        (&names.goals, Topic::Goals),
        (&names.path, Topic::Path),
        (&names.emergency_stop, Topic::Emergency),
        (&names.pause, Topic::Pause),
        (&names.command, Topic::Command),
    ];
    robot::topics(ros, &single, Topic::Points)
}

impl<'a> Player<'a> {
    pub(super) fn new(setup: PlayerSetup<'a>) -> anyhow::Result<Self> {
        let PlayerSetup { up, ros, machine, route, recording, ground } = setup;
        let sensors = up.described.as_ref().map_or(&[][..], |robot| &robot.sensors);
        let tolerance_m = robot::tolerance_m(up, machine).unwrap_or_default();
        let (goal_m, kept_to_m) = (end_of(&route), route.tolerance_m());
        let mut navigator = navigator(up, machine, goal_m, tolerance_m)?;
        navigator.order(Order::Drive(route), 0).map_err(UsageError::from_input)?;
        let intake = bag::intake(ros, &machine.vehicle, sensors).map_err(UsageError::from_input)?;
        Ok(Self {
            ros,
            machine,
            topics: topics(ros),
            intake: intake.kept_to(&robot::periods(up)),
            navigator,
            // Nothing is written as long as anything can be refused.
            kept: Kept::create(recording, machine, kept_to_m, ground)?,
            goal_m,
            tolerance_m,
            period_ns: clock::nanoseconds(robot::periods(up).control_s),
            now_ns: 0,
            decides_at_ns: None,
            applied: None,
            steering: (0.0, 0),
            switched: BTreeMap::from([(Topic::Emergency, false), (Topic::Pause, false)]),
            n_messages: 0,
        })
    }

    /// What was kept, and the goal that counted last [m].
    pub(super) fn finish(self) -> (Kept, [f64; 2]) {
        (self.kept, self.goal_m)
    }

    /// Decides what is due before the message, and takes that over. After a long silence nothing is decided until it comes.
    pub(super) fn take(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let silent_ns = self.now_ns.saturating_add(SILENCE_MAX_NS);
        self.now_ns = self.now_ns.max(message.log_time_ns);
        while let Some(at_ns) = self.decides_at_ns.filter(|at_ns| *at_ns <= self.now_ns) {
            let is_silent = at_ns > silent_ns;
            let at_ns = if is_silent { self.now_ns } else { at_ns };
            self.decide(at_ns)?;
            self.decides_at_ns = Some(at_ns + self.period_ns);
        }
        let Some(topic) = self.topics.get(&message.channel.topic).copied() else { return Ok(()) };
        self.n_messages += 1;
        self.hear(topic, message)?;
        Ok(())
    }

    fn hear(&mut self, topic: Topic, message: &RecordedMessage) -> anyhow::Result<()> {
        match topic {
            Topic::Odometry => self.odometry(message)?,
            Topic::Points => self.points(message)?,
            Topic::Imu => self.imu(message),
            Topic::Moving => self.with::<TfMessage, _>(message, |intake, told| intake.moving_frames(&told)),
            Topic::Fixed => self.with::<TfMessage, _>(message, |intake, told| intake.fixed_frames(&told)),
            Topic::Clock => self.with::<Clock, _>(message, |intake, Clock { clock }| {
                intake.simulated_time(clock.nanoseconds(), arrival(message))
            }),
            Topic::Goal => {
                if let Some(goal) = self.read::<PoseStamped>(message) {
                    let places_m = self.intake.goal(&goal);
                    self.drive_to(message, places_m, Route::goals);
                }
            }
            Topic::Goals => {
                if let Some(goals) = self.read::<PoseArray>(message) {
                    let places_m = self.intake.goals(&goals);
                    self.drive_to(message, places_m, Route::goals);
                }
            }
            Topic::Path => {
                if let Some(path) = self.read::<Path>(message) {
                    let (corners_m, speed_mps) = (self.intake.path(&path), self.ros.path_speed_mps);
                    self.drive_to(message, corners_m, |corners_m, tolerance_m| {
                        Route::path(corners_m, speed_mps, tolerance_m)
                    });
                }
            }
            Topic::Emergency => self.switch(topic, message, [Order::Reset, Order::EmergencyStop]),
            Topic::Pause => self.switch(topic, message, [Order::Resume, Order::Pause]),
            Topic::Command => self.command(message),
        }
        Ok(())
    }

    fn odometry(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let Some(odometry) = self.read::<Odometry>(message) else { return Ok(()) };
        let taken = self.intake.odometry(&odometry, arrival(message));
        let Some((at_ns, record)) = self.used(message, taken) else { return Ok(()) };
        let mut odometry = record.odometry(at_ns);
        let applied = self.applied.unwrap_or_else(|| self.done(&odometry));
        odometry.steering_rad = self.steered(&applied);
        self.kept.odometry(&odometry, &applied);
        self.navigator.hear_odometry(&OdometryMessage { id: self.id(), odometry, applied });
        self.decides_at_ns.get_or_insert(self.now_ns);
        self.advance()
    }

    /// What a vehicle that was told nothing does: the command that would have made it.
    fn done(&self, odometry: &bicycle::Odometry) -> Applied {
        let (speed_mps, rate_radps) = (odometry.velocity_mps[0], odometry.yaw_rate_radps);
        Applied {
            command: command(speed_mps, self.angle(speed_mps, rate_radps)),
            since_ns: odometry.valid_at_ns,
            by: AppliedBy::Vehicle,
        }
    }

    /// The steering angle that makes a yaw rate [rad]; what stands keeps its wheels.
    fn angle(&self, speed_mps: f64, rate_radps: f64) -> f64 {
        if speed_mps.abs() < SPEED_MIN_MPS {
            return self.steering.0;
        }
        let limit_rad = self.machine.vehicle.limits.steering_max_rad;
        let angle_rad = (self.machine.vehicle.geometry.wheelbase_m * rate_radps / speed_mps).atan();
        angle_rad.clamp(-limit_rad, limit_rad)
    }

    /// Where what they were told has brought the front wheels, at the vehicle's steering rate [rad].
    fn steered(&mut self, applied: &Applied) -> f64 {
        let (angle_rad, since_ns) = self.steering;
        let rate_radps = self.machine.vehicle.limits.steering_rate_max_radps;
        let reach_rad = rate_radps * self.now_ns.saturating_sub(since_ns) as f64 * 1e-9;
        let aim_rad = f64::from(applied.command.steering_rad);
        self.steering = (angle_rad + (aim_rad - angle_rad).clamp(-reach_rad, reach_rad), self.now_ns);
        self.steering.0
    }

    fn points(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let Some(cloud) = self.read::<PointCloud2>(message) else { return Ok(()) };
        let taken = self.intake.cloud(&cloud, arrival(message), POINTS_MAX);
        let Some(taken) = self.used(message, taken) else { return Ok(()) };
        let points = taken.sweep.points.iter().filter_map(|point| point.point()).collect();
        let scan = Scan { valid_at_ns: taken.at_ns, origin_m: taken.origin_m, points };
        self.kept.scan();
        self.navigator.hear_scan(ScanMessage { id: self.id(), sensor: taken.sensor, scan });
        self.advance()
    }

    fn imu(&mut self, message: &RecordedMessage) {
        let Some(imu) = self.read::<Imu>(message) else { return };
        let taken = self.intake.imu(&imu, arrival(message));
        if let Some(record) = self.used(message, taken) {
            self.navigator.hear_imu(&[ImuSample::from(&record)]);
        }
    }

    /// The parts that work when something has come.
    fn advance(&mut self) -> anyhow::Result<()> {
        self.navigator.lead(self.now_ns);
        if self.navigator.survey(self.now_ns)? {
            self.navigator.assess()?;
        }
        Ok(())
    }

    fn decide(&mut self, at_ns: u64) -> anyhow::Result<()> {
        self.navigator.lead(at_ns);
        let decision: Decision = self.navigator.decide(at_ns)?;
        self.kept.cycle(&Cycle { at_ns, decision, navigator: &self.navigator, goal_m: self.goal_m })
    }

    fn command(&mut self, message: &RecordedMessage) {
        let said = if bag::is_of::<AckermannDriveStamped>(message) {
            self.read::<AckermannDriveStamped>(message)
                .map(|said| command(f64::from(said.drive.speed), f64::from(said.drive.steering_angle)))
        } else if bag::is_of::<Twist>(message) {
            self.read::<Twist>(message).map(|said| self.of_twist(&said))
        } else {
            self.read::<TwistStamped>(message).map(|said| self.of_twist(&said.twist))
        };
        let Some(command) = said else { return };
        let is_finite = command.speed_mps.is_finite() && command.steering_rad.is_finite();
        let checked =
            if is_finite { Ok(()) } else { Err(format!("expected finite numbers, found {command:?}")) };
        if self.used(message, checked).is_some()
            && self.applied.is_none_or(|before| before.command != command)
        {
            // The vehicle was told by somebody else.
            self.applied = Some(Applied { command, since_ns: message.log_time_ns, by: AppliedBy::Vehicle });
        }
    }

    fn of_twist(&self, said: &Twist) -> Command {
        command(said.linear.x, self.angle(said.linear.x, said.angular.z))
    }

    fn drive_to<E: Display, R: Display>(
        &mut self,
        message: &RecordedMessage,
        places_m: Result<Vec<[f64; 2]>, E>,
        route: impl FnOnce(Vec<[f64; 2]>, f64) -> Result<Route, R>,
    ) {
        let tolerance_m = self.tolerance_m;
        let Some(places_m) = self.used(message, places_m) else { return };
        let Some(route) = self.used(message, route(places_m, tolerance_m)) else { return };
        let end_m = end_of(&route);
        let ordered = self.navigator.order(Order::Drive(route), self.now_ns);
        if self.used(message, ordered).is_some() {
            self.goal_m = end_m;
        }
    }

    /// One order where the message says false after true, another where it says true after false.
    fn switch(&mut self, topic: Topic, message: &RecordedMessage, [no, yes]: [Order; 2]) {
        let Some(Bool { data }) = self.read::<Bool>(message) else { return };
        if self.switched.insert(topic, data) == Some(data) {
            return;
        }
        let ordered = self.navigator.order(if data { yes } else { no }, self.now_ns);
        self.used(message, ordered);
    }

    fn id(&self) -> MessageId {
        MessageId { epoch_ns: 1, sequence: self.n_messages }
    }

    fn with<M: Named + DeserializeOwned, E: Display>(
        &mut self,
        message: &RecordedMessage,
        take: impl FnOnce(&mut Intake, M) -> Result<(), E>,
    ) {
        if let Some(told) = self.read::<M>(message) {
            let taken = take(&mut self.intake, told);
            self.used(message, taken);
        }
    }

    fn read<M: Named + DeserializeOwned>(&mut self, message: &RecordedMessage) -> Option<M> {
        self.used(message, read::<M>(message))
    }

    /// What was made of a message, or a note of why nothing was.
    fn used<T, E: Display>(&mut self, message: &RecordedMessage, made: Result<T, E>) -> Option<T> {
        made.map_err(|problem| self.kept.left_out(&message.channel.topic, &problem)).ok()
    }
}

fn command(speed_mps: f64, steering_rad: f64) -> Command {
    Command { speed_mps: speed_mps as f32, steering_rad: steering_rad as f32 }
}

/// The pipeline as the processes of the robot have it.
fn navigator(
    up: &UpArguments,
    machine: &Machine,
    goal_m: [f64; 2],
    tolerance_m: f64,
) -> anyhow::Result<Navigator> {
    let Machine { vehicle, model, config, knowledge } = machine;
    let level = CvarLevel::new(up.drive.alpha).map_err(UsageError::from_input)?;
    let ages = runtime::ages::limits(&robot::periods(up), &config.guard, &robot::ages(up));
    let ages = ages.map_err(UsageError::from_input)?;
    let (belief, _) = roles::belief(machine)?;
    let physics = Assessor::new(&vehicle.geometry, &model.limits, config, &Belief::Physics, level)
        .map_err(UsageError::from_input)?;
    let setup = Setup {
        geometry: &vehicle.geometry,
        model: model.clone(),
        config: config.clone(),
        belief,
        surface: Surface::Sensed,
        level,
        seed: up.drive.seed,
        goal_m,
        tolerance_m,
    };
    let navigator = Navigator::new(setup).map_err(UsageError::from_input)?;
    let pilot_ages = PilotAges { learned_ns: ages.learned_ns, mission_ns: ages.mission_ns };
    let navigator = navigator.with_ages(pilot_ages).with_stand_in(physics, ages.learning_silence_ns, 0);
    Ok(match &knowledge.corrector {
        Some(checkpoint) => navigator.with_corrector(checkpoint).map_err(UsageError::from_input)?,
        None => navigator,
    })
}

/// Where a route ends [m]: none is without a place.
fn end_of(route: &Route) -> [f64; 2] {
    route.points_m().last().copied().unwrap_or_default()
}
