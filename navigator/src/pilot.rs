//! The third part of the pipeline: the state of the vehicle and a risk map become a decision.

use std::collections::BTreeMap;

use bicycle::lanes::Instructions;
use bicycle::{
    Applied, AppliedBy, Decision, HoldReason, ImuSample, Model, MotionState, Odometry, StopReason,
};
use kinodynamics::{Checkpoint, Corrector};
use mppi::{Controller, CostToGoView, Driven, Input, MovingDiscs, Objective, ReferencePath, Terminal};
use traversability::RiskMapView;

use crate::choice::is_learned;
use crate::correction::Between;
use crate::guard::Admitted;
use crate::input_ledger::InputLedger;
use crate::message::TIMELESS_NS;
use crate::moving::{Horizon, MovingConfig, lay_out};
use crate::risk::StuckPose;
use crate::route::PATH_END_SHARE;
use crate::{
    CORNERS_MAX, Config, DecisionMessage, Instruction, Jump, MessageId, MissionMessage, NavigatorError,
    OdometryMessage, RiskHeader, RiskMapSource, RiskMessage, RiskMessages, Target, TracksMessage,
};

/// What the pilot drives on.
#[derive(Clone, Copy, Debug)]
struct RiskInput<'a> {
    /// Risk around the vehicle.
    map: RiskMapView<'a>,
    /// Least time to the goal over it.
    time_to_goal: CostToGoView<'a>,
    /// The goal that it leads to, as it was said [m]; to any other the straight line is taken.
    goal_m: [f64; 2],
    /// Time of the odometry in whose frame both lie [ns]; later jumps of the localisation have left them behind.
    odometry_at_ns: u64,
}

/// Where to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Destination {
    /// The place in the map frame [m].
    pub goal_m: [f64; 2],
    /// Distance that counts as there [m].
    pub tolerance_m: f64,
}

/// How old what a pilot is told may be [ns].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PilotAges {
    /// Scan of a learned map beyond which physics' map is driven on, if that knows of a younger one.
    pub learned_ns: u64,
    /// Mission that is not repeated.
    pub mission_ns: u64,
}

impl Default for PilotAges {
    /// Of scans five times a second, and a mission that is said again every second.
    fn default() -> Self {
        Self { learned_ns: 600_000_000, mission_ns: 2_500_000_000 }
    }
}

/// Watches what comes in and asks the controller. The motion model decides what a command is.
pub struct Pilot<M: Driven = Model> {
    ledger: InputLedger,
    ages: PilotAges,
    mission: Option<MissionMessage>,
    controller: Controller<M, MovingDiscs>,
    /// How what moves is dealt with, and how old it may be that is known of it [s].
    moving: Option<(MovingConfig, f64)>,
    tracks: Option<TracksMessage>,
    correction: kinodynamics::CorrectionConfig,
    between: Between,
    /// Of the map that the controller was asked on last, in whose frame it remembers places [ns].
    map_frame_at_ns: Option<u64>,
    /// Corners of a path in the frame of the map; their memory is kept.
    corners_m: Vec<[f64; 2]>,
    decided_at_ns: Option<u64>,
    elapsed_s: f64,
    cycle: u64,
    stuck: Option<StuckPose>,
}

impl Pilot<Model> {
    /// The same with somebody between the controller and the vehicle who corrects commands for the ground under the wheels,
    /// as far as the configuration lets it.
    ///
    /// # Errors
    /// Networks that make no corrector, and an instruction set that this machine lacks.
    pub fn with_corrector(self, checkpoint: &Checkpoint) -> Result<Self, NavigatorError> {
        let isa = self.controller.config().isa;
        let instructions = Instructions::find(isa).map_err(mppi::ConfigError::from)?;
        let corrector = Corrector::new(checkpoint, self.correction, instructions)?;
        Ok(Self { between: Between::new(Some(corrector)), ..self })
    }
}

impl<M: Driven> Pilot<M> {
    /// A pilot that knows nothing yet.
    pub fn new(model: M, config: &Config, seed: u64) -> Result<Self, NavigatorError> {
        config.validate()?;
        let model = model.with_attitude_share(config.attitude_share);
        let (own_body, n_steps) = (&config.elevation.own_body, config.controller.n_steps);
        let discs = config.moving.map_or_else(MovingDiscs::default, |moving| moving.discs(own_body, n_steps));
        Ok(Self {
            ledger: InputLedger::new(&config.guard, model.sensors()),
            ages: PilotAges::default(),
            mission: None,
            controller: Controller::with_costs(config.controller.clone(), model, (discs, ()), seed)?,
            moving: config.moving.map(|moving| (moving, config.guard.scan_age_max_s)),
            tracks: None,
            correction: config.correction,
            between: Between::new(None),
            map_frame_at_ns: None,
            corners_m: Vec::with_capacity(CORNERS_MAX),
            decided_at_ns: None,
            elapsed_s: 0.0,
            cycle: 0,
            stuck: None,
        })
    }

    /// The same for inputs that may be so old.
    pub fn with_ages(self, ages: PilotAges) -> Self {
        Self { ages, ..self }
    }

    /// Takes in where the vehicle is and what its actuators were told. What cannot be used is the reason for the next
    /// decision.
    pub fn hear_odometry(&mut self, message: &OdometryMessage<M::Command>) {
        self.note_applied(&message.applied);
        if let Ok(admitted) = self.ledger.take(message) {
            self.between.note(admitted);
            if admitted == Admitted::ClockSetBack {
                self.map_frame_at_ns = None;
                self.tracks = None;
            }
        }
    }

    /// Takes in what moves. What is older than what is known is no news.
    pub fn hear_tracks(&mut self, tracks: &TracksMessage) {
        if self.tracks.is_none_or(|known| known.valid_at_ns < tracks.valid_at_ns) {
            self.tracks = Some(*tracks);
        }
    }

    /// Takes in what the inertial measurement unit measured, in the order of time.
    pub fn hear_imu(&mut self, id: MessageId, samples: impl IntoIterator<Item = ImuSample>) {
        self.between.hear_imu(id, samples);
    }

    /// Takes in what the vehicle is told to do. It counts until it is said again, or is too old.
    pub fn hear_mission(&mut self, mission: &MissionMessage) {
        self.mission = Some(*mission);
    }

    /// When the mission was said last [ns]; `None` before the first time.
    pub fn mission_said_at_ns(&self) -> Option<u64> {
        self.mission.map(|mission| mission.valid_at_ns)
    }

    /// The decision for now, on what has come in and one of the maps that there are.
    pub fn answer(&mut self, now_ns: u64, maps: &RiskMessages<'_>) -> DecisionMessage<M::Command> {
        let cycle = self.cycle;
        let chosen = self.choose(now_ns, maps);
        let used = chosen.and_then(|(source, map)| Some((source, map.header, risk_input(map)?)));
        if let Some((_, header, _)) = used {
            self.note_map(header.valid_at_ns);
        }
        // A copy, because deciding changes everything else.
        let mission = self.mission;
        let instruction =
            mission.as_ref().map_or(Instruction::Stand(Decision::Hold(HoldReason::NoMission)), |mission| {
                mission.instruction(now_ns, self.ages.mission_ns)
            });
        let destination = match &instruction {
            Instruction::Drive(target) => Some(target.end()),
            Instruction::Stand(_) => None,
        };
        let decision = self.decide(now_ns, used.map(|(.., risk)| risk), &instruction);
        let (decision, correction) = self.between.correct(decision, self.ledger.odometry(), now_ns);
        if let Decision::Drive(sent) = decision {
            // The controller goes on from what was sent, not from what it planned.
            self.controller.note_followed(sent, 0.0);
        }
        // On maps of before a jump the vehicle was carried to where it stands there; the pose is one of now.
        let odometry_at_ns = self.ledger.frame_at_ns();
        let id_of = |map: &Option<RiskMessage<'_>>| map.map_or_else(Default::default, |map| map.header.id);
        DecisionMessage {
            decision,
            cycle,
            decided_at_ns: now_ns,
            odometry: self.ledger.take_count(),
            odometry_at_ns,
            risk: used.map(|(source, header, _)| (source, header)),
            held: [id_of(&maps.learned), id_of(&maps.physics)],
            tracks: self.tracks.map_or_else(Default::default, |tracks| tracks.id),
            mission: mission.map_or_else(Default::default, |mission| mission.id),
            destination,
            n_rollouts: self.controller.n_rollouts(),
            elapsed_s: self.elapsed_s,
            correction,
            imu: self.between.take_count(),
            stuck: self.stuck.take().map(|pose| (odometry_at_ns, pose)),
            state: self.ledger.odometry().map(Odometry::state).unwrap_or_default(),
        }
    }

    /// The map to drive on: what was learned while it is fresh, else whatever knows of the younger scan.
    fn choose<'a>(&self, now_ns: u64, maps: &RiskMessages<'a>) -> Option<(RiskMapSource, RiskMessage<'a>)> {
        let [learned_at_ns, physics_at_ns] =
            [maps.learned, maps.physics].map(|map| map.map(|map| map.header.valid_at_ns));
        if is_learned(learned_at_ns, physics_at_ns, now_ns, self.ages.learned_ns) {
            maps.learned.map(|map| (RiskMapSource::Learned, map))
        } else {
            maps.physics.map(|map| (RiskMapSource::Physics, map))
        }
    }

    /// What was given whole never gets old.
    fn note_map(&mut self, valid_at_ns: u64) {
        let newest_ns = self.ledger.frame_at_ns();
        self.note_scan(if valid_at_ns == TIMELESS_NS { newest_ns } else { valid_at_ns });
    }

    fn note_scan(&mut self, valid_at_ns: u64) {
        self.ledger.note_scan(valid_at_ns);
    }

    /// The command for now, or the reason for none. `now_ns` is on the clock of the measurements.
    ///
    /// What is wrong with the measurements is the more urgent reason to stand, and a map that is missing the less urgent.
    fn decide(
        &mut self,
        now_ns: u64,
        risk: Option<RiskInput<'_>>,
        instruction: &Instruction<'_>,
    ) -> Decision<M::Command> {
        self.elapsed_s =
            self.decided_at_ns.map_or(0.0, |then_ns| now_ns.saturating_sub(then_ns) as f64 * 1e-9);
        let decision = match self.ready(now_ns, risk, instruction) {
            Ok((risk, odometry, target)) => {
                self.lay_out_tracks(now_ns, &risk, &odometry);
                self.ask(&risk, &odometry, &target)
            }
            Err(decision) => {
                self.controller.stand_by(&decision, self.elapsed_s);
                decision
            }
        };
        self.decided_at_ns = Some(now_ns);
        self.cycle += 1;
        decision
    }

    /// Decisions so far.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// From now on samples at most `n` futures a decision; see [`Controller::use_rollouts`].
    pub fn use_rollouts(&mut self, n: usize) {
        self.controller.use_rollouts(n);
    }

    /// Whoever corrects commands for the ground, for what became of them.
    pub fn corrector(&self) -> Option<&Corrector> {
        self.between.corrector()
    }

    /// The controller, for its diagnostics and rollouts.
    pub fn controller(&self) -> &Controller<M, MovingDiscs> {
        &self.controller
    }

    /// The odometry, corrected, that the next decision would act on.
    pub fn odometry(&self) -> Option<&Odometry> {
        self.ledger.odometry()
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        self.ledger.refused()
    }

    /// Takes in what the actuators were told last, as the vehicle says with its odometry. Delays are replayed from it and the next plan starts from it, see [`Controller::note_sent`].
    fn note_applied(&mut self, applied: &Applied<M::Command>) {
        let Applied { command, since_ns, by } = *applied;
        let Some(decided_at_ns) = self.decided_at_ns else { return };
        let after_s = since_ns.wrapping_sub(decided_at_ns).cast_signed() as f64 * 1e-9;
        match by {
            AppliedBy::Vehicle => self.controller.note_sent(command, after_s),
            AppliedBy::Command => self.controller.note_followed(command, after_s),
        }
    }

    /// What the controller needs to be asked, or what to do without asking it.
    fn ready<'a, 'b>(
        &self,
        now_ns: u64,
        risk: Option<RiskInput<'a>>,
        instruction: &Instruction<'b>,
    ) -> Result<(RiskInput<'a>, Odometry, Target<'b>), Decision<M::Command>> {
        self.ledger.check(now_ns).map_err(Decision::Stop)?;
        let target = match *instruction {
            Instruction::Drive(target) => target,
            Instruction::Stand(Decision::Hold(reason)) => return Err(Decision::Hold(reason)),
            Instruction::Stand(Decision::Stop(reason)) => return Err(Decision::Stop(reason)),
            Instruction::Stand(Decision::Drive(never)) => match never {},
        };
        let (risk, odometry) =
            risk.zip(self.ledger.odometry().copied()).ok_or(Decision::Hold(HoldReason::NoMap))?;
        self.check_tracks(now_ns)?;
        Ok((risk, odometry, target))
    }

    /// Nobody drives among people of whom nothing is known, or nothing any more.
    fn check_tracks(&self, now_ns: u64) -> Result<(), Decision<M::Command>> {
        let Some((_, age_max_s)) = self.moving else { return Ok(()) };
        let tracks = self.tracks.ok_or(Decision::Hold(HoldReason::NoMap))?;
        let age_s = now_ns.saturating_sub(tracks.valid_at_ns) as f64 * 1e-9;
        if age_s > age_max_s { Err(Decision::Stop(StopReason::StaleScan)) } else { Ok(()) }
    }

    /// Tells the controller where what moves will be, in the frame of the map that it plans on.
    fn lay_out_tracks(&mut self, now_ns: u64, risk: &RiskInput<'_>, odometry: &Odometry) {
        let Some(((moving, _), tracks)) = self.moving.zip(self.tracks) else { return };
        let shift = self.ledger.moved_between(tracks.frame_at_ns, risk.odometry_at_ns);
        let step_s = self.controller.config().step_s;
        let age_s = now_ns.saturating_sub(tracks.valid_at_ns) as f64 * 1e-9;
        let begins_s = age_s + self.controller.config().delay_s;
        let back = self.ledger.moved_since(risk.odometry_at_ns).map(|jump| jump.inverse());
        let state = self.controller.model().measured_state(odometry);
        let vehicle = in_map_frame(state, back.as_ref()).into();
        let horizon = Horizon { vehicle, begins_s, step_s, shift: shift.as_ref() };
        lay_out(self.controller.step_cost_mut(), &tracks, &moving, &horizon);
    }

    fn ask(
        &mut self,
        risk: &RiskInput<'_>,
        odometry: &Odometry,
        target: &Target<'_>,
    ) -> Decision<M::Command> {
        let before_ns = self.map_frame_at_ns.replace(risk.odometry_at_ns);
        if let Some(jump) = before_ns.and_then(|at_ns| self.ledger.moved_between(at_ns, risk.odometry_at_ns))
        {
            self.controller.carry(|pose| jump.pose(pose));
        }
        // A map cannot be turned: until the next one, vehicle and target are carried back to where they stood on it.
        let back = self.ledger.moved_since(risk.odometry_at_ns).map(|jump| jump.inverse());
        let was_recovering = self.controller.diagnostics().is_recovering;
        let Self { controller, corners_m, .. } = self;
        let decision = controller.decide(&Input {
            state: in_map_frame(controller.model().measured_state(odometry), back.as_ref()),
            elapsed_s: self.elapsed_s,
            map: risk.map,
            objective: objective_in_map_frame(risk, target, back.as_ref(), corners_m),
            cycle: self.cycle,
        });
        if self.controller.diagnostics().is_no_way && !was_recovering {
            let [x_m, y_m, _] = odometry.position_m;
            self.stuck = Some(StuckPose { position_m: [x_m, y_m], yaw_rad: odometry.attitude_rad[2] });
        }
        decision
    }
}

/// A risk map's message as the controller is asked on it.
fn risk_input(map: RiskMessage<'_>) -> Option<RiskInput<'_>> {
    let (risk, time_to_goal) = map.content?;
    let RiskHeader { destination: Destination { goal_m, .. }, frame_at_ns, .. } = map.header;
    Some(RiskInput { map: risk, time_to_goal, goal_m, odometry_at_ns: frame_at_ns })
}

fn in_map_frame<S: Into<MotionState> + From<MotionState>>(state: S, back: Option<&Jump>) -> S {
    let Some(back) = back else { return state };
    let state: MotionState = state.into();
    let [x_m, y_m, yaw_rad] = back.pose([state.x_m, state.y_m, state.yaw_rad]);
    MotionState { x_m, y_m, yaw_rad, ..state }.into()
}

/// The target in the frame of a map. What that tells of the time to the goal leads to where the goal was until the next
/// one comes; if it leads to another goal, it is not asked.
fn objective_in_map_frame<'a>(
    risk: &RiskInput<'a>,
    target: &Target<'a>,
    back: Option<&Jump>,
    corners_m: &'a mut Vec<[f64; 2]>,
) -> Objective<'a> {
    let carried = |[x_m, y_m]: [f64; 2]| {
        let [x_m, y_m, _] = back.map_or([x_m, y_m, 0.0], |back| back.pose([x_m, y_m, 0.0]));
        [x_m, y_m]
    };
    match target {
        Target::Goal(Destination { goal_m, tolerance_m }) => {
            let is_known = *goal_m == risk.goal_m;
            let terminal =
                if is_known { Terminal::CostToGo(risk.time_to_goal) } else { Terminal::StraightLine };
            Objective::Goal { goal_m: carried(*goal_m), tolerance_m: *tolerance_m, terminal }
        }
        Target::Path(path) => {
            corners_m.clear();
            corners_m.extend(path.points_m.iter().take(CORNERS_MAX).copied().map(carried));
            let tolerance_m = PATH_END_SHARE * path.tolerance_m;
            Objective::Path(ReferencePath { points_m: corners_m, tolerance_m, ..*path })
        }
    }
}

#[cfg(test)]
mod tests;
