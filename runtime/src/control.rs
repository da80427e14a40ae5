//! The controller as a process: a decision at every deadline, on what there is, and never a wait for the map.

use bicycle::{Decision, Model};
use mppi::CostToGoView;
use navigator::{Chart, Config, Destination, Instruction, Pilot};

use crate::RuntimeError;
use crate::budget::Budget;
use crate::choice::is_learned;
use crate::mission::Heard;
use bus::ages::AgeLimits;
use bus::channel::{
    Bus, COMMAND, DECISION, Inlet, MISSION, Message, ODOMETRY, Outlet, RISK, RISK_PHYSICS, STUCK,
};
use bus::clock::{self, Cycle};
use bus::message::{
    CommandRecord, DecisionRecord, MissionRecord, OdometryRecord, RiskHeader, Source, Stamp, StuckRecord,
};
use bus::payload::risk_views;
use bus::status::{Health, Meter, Role};

/// Share of the period that a decision may take; the rest is for what else the processor does.
const BUDGET_SHARE: f64 = 0.5;

/// What controls.
pub struct ControlSetup {
    /// What is believed of the vehicle.
    pub model: Model,
    /// Settings of the pipeline.
    pub config: Config,
    /// Decides the samples.
    pub seed: u64,
    /// Time between two decisions [s].
    pub period_s: f64,
    /// How old maps and missions may be.
    pub ages: AgeLimits,
}

/// Decides at every deadline until `is_over` says to end.
pub fn run(bus: &Bus, setup: ControlSetup, is_over: &dyn Fn() -> bool) -> Result<(), RuntimeError> {
    let period_ns = clock::nanoseconds(setup.period_s);
    let mut control = Control::new(bus, setup)?;
    let mut cycle = Cycle::new(clock::now_ns() + period_ns, period_ns);
    while !is_over() {
        let began_ns = clock::sleep_until(cycle.deadline_ns());
        let lateness_ns = began_ns - cycle.deadline_ns();
        control.cycle(began_ns, lateness_ns)?;
        cycle.advance(clock::now_ns());
        control.report(lateness_ns, cycle.n_missed())?;
    }
    Ok(())
}

struct Control {
    pilot: Pilot,
    budget: Budget,
    inputs: Inputs,
    ages: AgeLimits,
    commands: Outlet<Stamp, CommandRecord>,
    decisions: Outlet<Stamp, DecisionRecord>,
    stuck: Outlet<Stamp, StuckRecord>,
    meter: Meter,
}

/// What a decision is made from.
struct Inputs {
    odometry: Inlet<Stamp, OdometryRecord>,
    missions: Inlet<Stamp, MissionRecord>,
    learned: MapInput,
    physics: MapInput,
    last_odometry: Option<Stamp>,
    n_odometry: u64,
    mission: Heard,
}

/// The newest map of an author.
struct MapInput {
    inlet: Inlet<RiskHeader, [f32; 4]>,
    held: Option<Message<RiskHeader, [f32; 4]>>,
}

impl MapInput {
    fn take(&mut self) {
        if let Some(newest) = self.inlet.newest() {
            self.held = Some(newest);
        }
    }

    fn source(&self) -> Source {
        self.held.as_ref().map_or(Source::default(), |map| map.header().stamp.source())
    }

    fn scan_at_ns(&self) -> Option<u64> {
        self.held.as_ref().map(|map| map.header().stamp.valid_at_ns)
    }

    fn age_s(&self, now_ns: u64) -> f64 {
        let age_s =
            |map: &Message<RiskHeader, [f32; 4]>| clock::age_s(now_ns, map.header().stamp.valid_at_ns);
        self.held.as_ref().map_or(f64::INFINITY, age_s)
    }
}

impl Inputs {
    fn new(bus: &Bus) -> Result<Self, RuntimeError> {
        let map = |channel| Ok::<_, RuntimeError>(MapInput { inlet: bus.inlet(channel)?, held: None });
        Ok(Self {
            odometry: bus.inlet(&ODOMETRY)?,
            missions: bus.inlet(&MISSION)?,
            learned: map(&RISK)?,
            physics: map(&RISK_PHYSICS)?,
            last_odometry: None,
            n_odometry: 0,
            mission: Heard::default(),
        })
    }

    /// Takes in what has come since the last decision.
    fn take(&mut self, pilot: &mut Pilot) {
        let (last, n_taken) = (&mut self.last_odometry, &mut self.n_odometry);
        *n_taken = 0;
        self.odometry.poll(|stamp, records| {
            let Some(record) = records.first() else { return };
            show(pilot, stamp, record);
            *last = Some(*stamp);
            *n_taken += 1;
        });
        let mission = &mut self.mission;
        self.missions.poll(|stamp, records| records.iter().for_each(|record| mission.note(stamp, record)));
        self.learned.take();
        self.physics.take();
    }

    /// The map to drive on: what was learned while it is fresh, else whatever knows of the younger scan.
    fn map(&self, now_ns: u64, learned_age_max_ns: u64) -> Option<&Message<RiskHeader, [f32; 4]>> {
        let [learned_at_ns, physics_at_ns] = [&self.learned, &self.physics].map(MapInput::scan_at_ns);
        if is_learned(learned_at_ns, physics_at_ns, now_ns, learned_age_max_ns) {
            self.learned.held.as_ref()
        } else {
            self.physics.held.as_ref()
        }
    }
}

/// A risk map's message as the pilot reads it: control and its replay.
pub fn chart_of<'a>(header: &RiskHeader, payload: &'a [[f32; 4]]) -> Option<Chart<'a>> {
    let (map, seconds) = risk_views(header, payload)?;
    let time_to_goal = CostToGoView { geometry: map.geometry, seconds };
    Some(Chart { map, time_to_goal, goal_m: header.goal_m, odometry_at_ns: header.odometry_at_ns })
}

/// Where an instruction leads; nowhere to stand.
fn destination(instruction: &Instruction<'_>) -> Destination {
    match instruction {
        Instruction::Drive(target) => target.end(),
        Instruction::Stand(_) => Destination { goal_m: [0.0; 2], tolerance_m: 0.0 },
    }
}

/// Shows a pilot what the vehicle says of itself: control and its replay.
pub(crate) fn show(pilot: &mut Pilot, stamp: &Stamp, record: &OdometryRecord) {
    pilot.note_applied(&record.applied());
    pilot.admit(&record.odometry(stamp.valid_at_ns));
}

impl Control {
    fn new(bus: &Bus, setup: ControlSetup) -> Result<Self, RuntimeError> {
        let ControlSetup { model, config, seed, period_s, ages } = setup;
        let n_max = config.controller.n_rollouts;
        Ok(Self {
            budget: Budget::new(n_max, clock::nanoseconds(BUDGET_SHARE * period_s)),
            pilot: Pilot::new(model, &config, seed)?,
            inputs: Inputs::new(bus)?,
            ages,
            commands: bus.outlet(&COMMAND, 1)?,
            decisions: bus.outlet(&DECISION, 1)?,
            stuck: bus.outlet(&STUCK, 1)?,
            meter: Meter::new(bus, Role::Control)?,
        })
    }

    fn cycle(&mut self, began_ns: u64, lateness_ns: u64) -> Result<(), RuntimeError> {
        self.inputs.take(&mut self.pilot);
        let newest = self.inputs.map(began_ns, self.ages.learned_ns);
        let map = newest.map(|message| (*message.header(), message.payload()));
        let chart = map.as_ref().and_then(|(header, payload)| chart_of(header, payload));
        let cycle = self.pilot.cycle();
        let used = map.as_ref().map(|(header, _)| header).filter(|_| chart.is_some());
        if let Some(header) = used {
            self.pilot.note_scan(header.stamp.valid_at_ns);
        }
        let instruction = self.inputs.mission.instruction(began_ns, self.ages.mission_ns);
        let destination = destination(&instruction);
        let n_rollouts = self.budget.n_rollouts();
        self.pilot.use_rollouts(n_rollouts);
        let thinking_ns = clock::now_ns();
        let decision = self.pilot.decide(began_ns, chart, &instruction);
        if matches!(decision, Decision::Drive(_)) {
            self.budget.learn(n_rollouts, clock::now_ns() - thinking_ns);
        }
        let odometry_at_ns = self.pilot.odometry().map_or(0, |odometry| odometry.valid_at_ns);
        let scan_at_ns = used.map_or(0, |header| header.stamp.valid_at_ns);
        let command = CommandRecord::from(&decision).decided_on(odometry_at_ns, scan_at_ns);
        self.commands.send_one(Stamp::default(), command, began_ns)?;
        let state = self.pilot.odometry().map(|odometry| odometry.state()).unwrap_or_default();
        let record = DecisionRecord {
            command,
            cycle,
            decided_at_ns: began_ns,
            odometry: self.inputs.last_odometry.map_or(Source::default(), |stamp| stamp.source()),
            n_odometry: self.inputs.n_odometry,
            risk: used.map_or(Source::default(), |header| header.stamp.source()),
            author: used.map_or(0, |header| header.author),
            mission: self.inputs.mission.source(),
            learned: self.inputs.learned.source(),
            physics: self.inputs.physics.source(),
            goal_m: destination.goal_m,
            tolerance_m: destination.tolerance_m,
            n_rollouts: self.pilot.controller().n_rollouts() as u64,
            elapsed_s: self.pilot.elapsed_s(),
            state: [state.x_m, state.y_m, state.yaw_rad, state.speed_mps, state.steering_rad],
            duration_ns: clock::now_ns() - began_ns,
            lateness_ns,
        };
        self.decisions.send_one(Stamp::default(), record, began_ns)?;
        if let Some(pose) = self.pilot.take_stuck() {
            let record = StuckRecord { position_m: pose.position_m, yaw_rad: pose.yaw_rad };
            self.stuck.send_one(Stamp::default(), record, began_ns)?;
        }
        Ok(())
    }

    fn report(&mut self, lateness_ns: u64, n_missed: u64) -> Result<(), RuntimeError> {
        self.meter.count(lateness_ns);
        let now_ns = clock::now_ns();
        let (inputs, pilot) = (&self.inputs, &self.pilot);
        Ok(self.meter.report(now_ns, || {
            let odometry_s =
                inputs.last_odometry.map_or(-1.0, |stamp| clock::age_s(now_ns, stamp.valid_at_ns));
            let mission_s = inputs.mission.said_at_ns().map_or(-1.0, |at_ns| clock::age_s(now_ns, at_ns));
            let [learned_s, physics_s] = [&inputs.learned, &inputs.physics]
                .map(|input| Some(input.age_s(now_ns)).filter(|age_s| age_s.is_finite()).unwrap_or(-1.0));
            Health {
                age_s: [odometry_s, learned_s, physics_s, mission_s],
                n_missed,
                figure: pilot.controller().n_rollouts() as f64,
                ..Health::default()
            }
            .with(inputs.odometry.counts())
            .with(inputs.learned.inlet.counts())
            .with(inputs.physics.inlet.counts())
            .with(inputs.missions.counts())
        })?)
    }
}
