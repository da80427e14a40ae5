//! The parts of the pipeline in one process: their messages lie in queues, and one part is at work at a time.

mod mail;
mod risk_publisher;

use std::collections::BTreeMap;
use std::sync::Arc;

use bicycle::{Applied, AppliedBy, Decision, Geometry, ImuSample, Model, Odometry, StopReason};
use kinodynamics::Corrector;
use mppi::{Controller, Driven, MovingDiscs};
use terrain::{GridMap, Scan, SurfaceCell};
use traversability::{CvarLevel, RiskMapView};

use crate::{
    Assessor, Belief, Config, DecisionMessage, Leader, MessageId, Mission, OdometryMessage, Order,
    OrderRefusal, Pilot, PilotAges, RiskMessage, RiskMessages, Route, RouteError, Said, ScanMessage,
    ScanTally, StandIn, StuckMessage, SurfaceHeader, Surveyor,
};
use mail::{Mail, ToAssessor};
use risk_publisher::RiskPublisher;

/// Where the map of the ground comes from.
#[derive(Clone)]
pub enum Surface {
    /// Fused from scans.
    Sensed,
    /// Given whole, at the resolution of the elevation map; scans are ignored.
    Given(GridMap<SurfaceCell>),
}

/// Everything that stays the same during a drive.
pub struct Setup<'a, M = Model> {
    /// The machine's lengths.
    pub geometry: &'a Geometry,
    /// What the controller believes of how it moves, which decides what a command is.
    pub model: M,
    /// Settings.
    pub config: Config,
    /// What is believed of the ground.
    pub belief: Belief,
    /// Where the map of the ground comes from.
    pub surface: Surface,
    /// Share of the worst outcomes to plan for.
    pub level: CvarLevel,
    /// Decides the controller's samples.
    pub seed: u64,
    /// Where to go [m].
    pub goal_m: [f64; 2],
    /// Distance that counts as there [m].
    pub tolerance_m: f64,
}

/// Why no pipeline can be built.
#[derive(Debug, thiserror::Error)]
pub enum NavigatorError {
    /// A setting of the pipeline itself is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Config {
        /// Name of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The elevation map refused its settings.
    #[error("elevation map: {0}")]
    Elevation(#[from] terrain::SettingError),
    /// The window of the risk map cannot be placed there.
    #[error(transparent)]
    Distant(#[from] terrain::DistantPosition),
    /// What moves cannot be tracked so.
    #[error(transparent)]
    Tracking(#[from] tracking::TrackingConfigError),
    /// The elevation map refused a pose.
    #[error(transparent)]
    Fuse(#[from] terrain::FuseError),
    /// The risk map cannot be made.
    #[error(transparent)]
    Risk(#[from] evidential::BeliefMapError),
    /// The cost-to-go field cannot be made.
    #[error(transparent)]
    CostToGo(#[from] mppi::CostToGoError),
    /// What corrects commands for the ground refused its settings.
    #[error("correction.{0}")]
    Correction(terrain::SettingError),
    /// What corrects commands for the ground cannot be made of these networks.
    #[error(transparent)]
    Corrector(#[from] kinodynamics::CheckpointError),
    /// The controller refused its settings.
    #[error(transparent)]
    Controller(#[from] mppi::ConfigError),
    /// Where to go is nowhere.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// The first goal may not be driven to.
    #[error("goal: {0}")]
    Order(#[from] OrderRefusal),
}

/// Time between two messages of the mission [ns].
const MISSION_PERIOD_NS: u64 = 1_000_000_000;
/// Orders are given in the same process: they are of now.
const ORDER_AGE_MAX_NS: u64 = 0;
/// The life of whoever speaks in this process: there is one.
const EPOCH_NS: u64 = 1;

/// The planner: its parts, and the messages between them.
///
/// [`Navigator::observe`] and [`Navigator::decide`] have the parts work in a fixed order. Whoever has another order, as
/// that of processes, hands over messages and steps each part by itself; when a part works is its business, what the part
/// does then is the same.
pub struct Navigator<M: Driven = Model> {
    leader: Leader,
    surveyor: Surveyor,
    learned: RiskPublisher,
    physics: Option<(RiskPublisher, StandIn)>,
    pilot: Pilot<M>,
    mail: Mail<M::Command>,
    /// What went to the vehicle last.
    sent: Applied<M::Command>,
    /// Odometry so far.
    n_observed: u64,
    n_surfaces: u64,
    n_missions: u64,
    n_orders: u64,
    n_stuck: u64,
    n_imu: u64,
}

impl Navigator<Model> {
    /// The same with somebody who corrects commands for the ground; see [`Pilot::with_corrector`].
    ///
    /// # Errors
    /// Networks or settings that make no corrector.
    pub fn with_corrector(self, checkpoint: &kinodynamics::Checkpoint) -> Result<Self, NavigatorError> {
        Ok(Self { pilot: self.pilot.with_corrector(checkpoint)?, ..self })
    }
}

impl<M: Driven> Navigator<M> {
    /// A pipeline that has seen nothing.
    pub fn new(setup: Setup<'_, M>) -> Result<Self, NavigatorError> {
        let Setup { geometry, model, config, belief, surface, level, seed, goal_m, tolerance_m } = setup;
        let mut mission = Mission::new(ORDER_AGE_MAX_NS).within(config.areas.clone());
        let route = Route::goals(vec![goal_m], tolerance_m)?;
        mission.order(Order::Drive(route), Said { sequence: 1, ..Said::default() }, 0)?;
        let sensors = model.sensors();
        Ok(Self {
            leader: Leader::new(mission, &config.guard, sensors, MISSION_PERIOD_NS),
            surveyor: Surveyor::new(geometry, config.elevation, config.guard, surface)?
                .with_sensors(sensors)
                .with_mounts(config.sensors.clone())
                .with_moving(config.moving.as_ref())?,
            learned: RiskPublisher::new(Assessor::new(
                geometry,
                model.motion_limits(),
                &config,
                &belief,
                level,
            )?),
            physics: None,
            pilot: Pilot::new(model, &config, seed)?,
            mail: Mail::default(),
            sent: Applied { command: M::Command::default(), since_ns: 0, by: AppliedBy::Command },
            n_observed: 0,
            n_surfaces: 0,
            n_missions: 0,
            n_orders: 1,
            n_stuck: 0,
            n_imu: 0,
        })
    }

    /// The same with somebody who judges by physics while nobody else does, as processes have; from `began_ns` on.
    pub fn with_stand_in(self, physics: Assessor, silence_max_ns: u64, began_ns: u64) -> Self {
        let stand_in = StandIn::new(began_ns, silence_max_ns);
        let mail = Mail { physics: Some(ToAssessor::default()), ..self.mail };
        Self { physics: Some((RiskPublisher::new(physics), stand_in)), mail, ..self }
    }

    /// What is known of the ground's friction by place; see [`Assessor::know_friction`]. Whoever stands in is told, too.
    pub fn know_friction(&mut self, map: &Arc<GridMap<f32>>) {
        self.learned.know_friction(Arc::clone(map));
        if let Some((physics, _)) = &mut self.physics {
            physics.know_friction(Arc::clone(map));
        }
    }

    /// The same for inputs that may be so old.
    pub fn with_ages(self, ages: PilotAges) -> Self {
        Self { pilot: self.pilot.with_ages(ages), ..self }
    }

    /// Takes in what was measured; returns whether the risk map was renewed. A scan is placed by its own time, which
    /// may be a little before or after that of the odometry.
    ///
    /// Input that cannot be used is remembered as the reason for the next decision and changes no map.
    pub fn observe(
        &mut self,
        now_ns: u64,
        odometry: &Odometry,
        scan: Option<&Scan>,
    ) -> Result<bool, NavigatorError> {
        self.n_observed += 1;
        let id = MessageId { epoch_ns: EPOCH_NS, sequence: self.n_observed };
        self.hear_odometry(&OdometryMessage { id, odometry: *odometry, applied: self.sent });
        if let Some(scan) = scan {
            self.hear_scan(ScanMessage { id, sensor: 0, scan: scan.clone() });
        }
        self.lead(now_ns);
        // After a jump the map of before will do until the next scan.
        let has_seen = self.survey(now_ns)?;
        if has_seen { self.assess() } else { Ok(false) }
    }

    /// The command for now, or the reason for none. `now_ns` is on the clock of the measurements. Whoever asks hands it to
    /// the vehicle.
    pub fn decide(&mut self, now_ns: u64) -> Result<Decision<M::Command>, NavigatorError> {
        let decision = self.answer(now_ns).decision;
        let command = decision.command(self.sent.command);
        if command != self.sent.command {
            self.sent = Applied { command, since_ns: now_ns, by: AppliedBy::Command };
        }
        if self.mail.has_stuck() {
            self.assess()?;
        }
        Ok(decision)
    }

    /// Hands what the inertial measurement unit measured to whoever corrects commands, in the order of time.
    pub fn hear_imu(&mut self, samples: &[ImuSample]) {
        self.n_imu += 1;
        let id = MessageId { epoch_ns: EPOCH_NS, sequence: self.n_imu };
        if self.pilot.corrector().is_some() {
            self.mail.imu(id, samples.to_vec());
        }
    }

    /// Hands odometry to all parts.
    pub fn hear_odometry(&mut self, message: &OdometryMessage<M::Command>) {
        self.mail.odometry(message);
    }

    /// Hands a scan to whoever maps.
    pub fn hear_scan(&mut self, message: ScanMessage) {
        self.mail.scan(message);
    }

    /// Directs the vehicle otherwise from now on; the first mission is that of [`Setup`].
    pub fn order(&mut self, order: Order, now_ns: u64) -> Result<(), OrderRefusal> {
        self.n_orders += 1;
        let said = Said { at_ns: now_ns, sender_ns: 0, sequence: self.n_orders };
        let taken = self.leader.hear_order(Ok(order), said, now_ns);
        self.tell_mission(now_ns);
        taken
    }

    /// Follows the mission by the odometry that has come, and says what is to be done when that is due.
    pub fn lead(&mut self, now_ns: u64) {
        for message in self.mail.to_leader.drain(..) {
            self.leader.hear_odometry(&message);
        }
        if self.leader.is_due(now_ns) {
            self.tell_mission(now_ns);
        }
    }

    fn tell_mission(&mut self, now_ns: u64) {
        self.n_missions += 1;
        let id = MessageId { epoch_ns: EPOCH_NS, sequence: self.n_missions };
        self.mail.mission(&self.leader.tell(id, now_ns));
    }

    /// Maps what has come; returns whether anything new was seen. While nobody else judges, physics does.
    pub fn survey(&mut self, now_ns: u64) -> Result<bool, NavigatorError> {
        let mut has_seen = false;
        while let Some(message) = self.mail.to_surveyor.pop_front() {
            if let Some(header) = self.surveyor.hear_odometry(&message)? {
                has_seen |= header.jump.is_none();
                self.tell_surface(header, now_ns)?;
            }
        }
        while let Some(scan) = self.mail.scans.pop_front() {
            self.surveyor.hear_scan(scan, now_ns);
        }
        while let Some(header) = self.surveyor.next_surface(now_ns)? {
            has_seen = true;
            self.tell_surface(header, now_ns)?;
        }
        let Some((physics, stand_in)) = &mut self.physics else { return Ok(has_seen) };
        if std::mem::take(&mut self.mail.has_learned) {
            stand_in.note_heard(now_ns);
        }
        if let Some(mail) = &mut self.mail.physics {
            physics.hear(mail)?;
        }
        Ok(has_seen)
    }

    fn tell_surface(&mut self, header: SurfaceHeader, now_ns: u64) -> Result<(), NavigatorError> {
        self.n_surfaces += 1;
        let id = MessageId { epoch_ns: EPOCH_NS, sequence: self.n_surfaces };
        let header = SurfaceHeader { id, ..header };
        self.mail.surface(header);
        self.mail.tracks_to_pilot = self.surveyor.tracks(&header).or(self.mail.tracks_to_pilot);
        let Some((physics, stand_in)) = &mut self.physics else { return Ok(()) };
        physics.hear_surface(&header);
        if stand_in.is_needed(now_ns) {
            physics.judge(&header, self.surveyor.surface())?;
        }
        Ok(())
    }

    /// Judges the newest map of the ground that has come, and at once a place where the vehicle got stuck; returns whether
    /// there is another risk map now.
    pub fn assess(&mut self) -> Result<bool, NavigatorError> {
        for header in &self.mail.surfaces {
            self.learned.hear_surface(header);
        }
        let newest = self.mail.surfaces.drain(..).next_back();
        let is_stuck = self.learned.hear(&mut self.mail.learned)?;
        let is_told = match newest {
            Some(header) => self.learned.judge(&header, self.surveyor.surface())?,
            None => is_stuck && self.learned.publish()?,
        };
        self.mail.has_learned |= is_told;
        Ok(is_told)
    }

    /// Decides on what has come.
    pub fn answer(&mut self, now_ns: u64) -> DecisionMessage<M::Command> {
        for message in self.mail.to_pilot.drain(..) {
            self.pilot.hear_odometry(&message);
        }
        for (id, samples) in self.mail.to_corrector.drain(..) {
            self.pilot.hear_imu(id, samples);
        }
        if let Some(mission) = self.mail.mission_to_pilot.take() {
            self.pilot.hear_mission(&mission);
        }
        if let Some(tracks) = self.mail.tracks_to_pilot.take() {
            self.pilot.hear_tracks(&tracks);
        }
        let maps = RiskMessages {
            learned: self.learned.message(),
            physics: self.physics.as_ref().and_then(|(physics, _)| physics.message()),
        };
        let answer = self.pilot.answer(now_ns, &maps);
        if let Some((valid_at_ns, pose)) = answer.stuck {
            self.n_stuck += 1;
            let id = MessageId { epoch_ns: EPOCH_NS, sequence: self.n_stuck };
            self.mail.stuck(&StuckMessage { id, valid_at_ns, pose });
        }
        answer
    }

    /// From now on samples at most `n` futures a decision; see [`Controller::use_rollouts`].
    pub fn use_rollouts(&mut self, n: usize) {
        self.pilot.use_rollouts(n);
    }

    /// What the vehicle is told to do.
    pub fn mission(&self) -> &Mission {
        self.leader.mission()
    }

    /// Physics' risk map, where somebody stands in and has had to.
    pub fn stand_in_map(&self) -> Option<RiskMessage<'_>> {
        self.physics.as_ref().and_then(|(physics, _)| physics.message())
    }

    /// The risk map with what it says of itself and the least times to the goal.
    pub fn risk(&self) -> Option<RiskMessage<'_>> {
        self.learned.message()
    }

    /// The ground as it is known.
    pub fn surface(&self) -> &GridMap<SurfaceCell> {
        self.surveyor.surface()
    }

    /// The risk map as the controller reads it, once there is one. After a jump of the localisation it lies where it
    /// lay, until the next scan, and the controller drives on it as if there had been none.
    pub fn risk_map(&self) -> Option<RiskMapView<'_>> {
        self.learned.view()
    }

    /// The controller, for its diagnostics and rollouts.
    pub fn controller(&self) -> &Controller<M, MovingDiscs> {
        self.pilot.controller()
    }

    /// Whoever corrects commands for the ground, for what became of them.
    pub fn corrector(&self) -> Option<&Corrector> {
        self.pilot.corrector()
    }

    /// How often the localisation corrected itself by a jump.
    pub fn n_jumps(&self) -> u64 {
        self.surveyor.n_jumps()
    }

    /// What became of the scans so far.
    pub fn scans(&self) -> &ScanTally {
        self.surveyor.tally()
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        self.surveyor.refused()
    }
}
