//! The controller as a process: a decision at every deadline, on what there is, and never a wait for the map.

use std::sync::Arc;

use bicycle::{Decision, ImuSample, Model, State};
use mppi::{Controller, StepCost};
use navigator::{Config, Pilot, PilotAges, RiskMapSource, RiskMessage, RiskMessages};

use traversability::RiskMapView;

use crate::RuntimeError;
use crate::budget::Budget;
use crate::convert::{
    decision_record, id_of, mission_message, odometry_message, risk_message, tracks_message,
};
use bus::ages::AgeLimits;
use bus::channel::{
    Bus, COMMAND, Counts, DECISION, FUTURES, IMU, Inlet, MISSION, Message, ODOMETRY, Outlet, PLAN, RISK,
    RISK_PHYSICS, STUCK, TRACKS,
};
use bus::clock::{self, Clock, Cycle};
use bus::message::{
    CommandRecord, DecisionRecord, FutureRecord, ImuRecord, MissionRecord, OdometryRecord, PlanRecord,
    RiskHeader, Stamp, StuckRecord, TrackRecord, TracksHeader,
};
use bus::payload::risk_views;
use bus::status::{Health, Meter, Role};

/// Share of the period that a decision may take; the rest is for what else the processor does.
const BUDGET_SHARE: f64 = 0.5;

/// Futures that are told of those that were tried.
const FUTURES_TOLD: usize = 32;
/// Time between two tellings of them [ns].
const FUTURES_PERIOD_NS: u64 = 500_000_000;

/// What controls.
pub struct ControlSetup {
    /// What is believed of the vehicle.
    pub model: Model,
    /// Settings of the pipeline.
    pub config: Config,
    /// What corrects commands for the ground, if anything does.
    pub corrector: Option<Arc<kinodynamics::Checkpoint>>,
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

/// The pilot and its channels, stepped by whoever has its clock.
pub struct Control {
    clock: Clock,
    pilot: Pilot,
    budget: Budget,
    inputs: Inputs,
    commands: Outlet<Stamp, CommandRecord>,
    decisions: Outlet<Stamp, DecisionRecord>,
    plans: Outlet<Stamp, PlanRecord>,
    futures: Outlet<Stamp, FutureRecord>,
    /// When futures were told last [ns].
    futures_at_ns: u64,
    stuck: Outlet<Stamp, StuckRecord>,
    meter: Meter,
}

/// What a decision is made from.
struct Inputs {
    odometry: Inlet<Stamp, OdometryRecord>,
    /// `None` where nobody corrects commands.
    imu: Option<Inlet<Stamp, ImuRecord>>,
    missions: Inlet<Stamp, MissionRecord>,
    tracks: Inlet<TracksHeader, TrackRecord>,
    learned: MapInput,
    physics: MapInput,
    odometry_at_ns: Option<u64>,
}

/// The newest map of a source.
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

    fn message(&self) -> Option<RiskMessage<'_>> {
        self.held.as_ref().map(|map| risk_message(map.header(), map.payload()))
    }

    fn age_s(&self, now_ns: u64) -> f64 {
        let age_s =
            |map: &Message<RiskHeader, [f32; 4]>| clock::age_s(now_ns, map.header().stamp.valid_at_ns);
        self.held.as_ref().map_or(f64::INFINITY, age_s)
    }
}

impl Inputs {
    fn new(bus: &Bus, corrects: bool) -> Result<Self, RuntimeError> {
        let map = |channel| Ok::<_, RuntimeError>(MapInput { inlet: bus.inlet(channel)?, held: None });
        Ok(Self {
            odometry: bus.inlet(&ODOMETRY)?,
            imu: if corrects { Some(bus.inlet(&IMU)?) } else { None },
            missions: bus.inlet(&MISSION)?,
            tracks: bus.inlet(&TRACKS)?,
            learned: map(&RISK)?,
            physics: map(&RISK_PHYSICS)?,
            odometry_at_ns: None,
        })
    }

    /// Takes in what has come since the last decision.
    fn take(&mut self, pilot: &mut Pilot) {
        let newest_ns = &mut self.odometry_at_ns;
        self.odometry.poll(|stamp, records| {
            let Some(record) = records.first() else { return };
            pilot.hear_odometry(&odometry_message(stamp, record));
            *newest_ns = Some(stamp.valid_at_ns);
        });
        if let Some(imu) = &mut self.imu {
            imu.poll(|stamp, records| {
                pilot.hear_imu(id_of(stamp.source()), records.iter().map(ImuSample::from));
            });
        }
        self.missions.poll(|stamp, records| {
            records.iter().for_each(|record| pilot.hear_mission(&mission_message(stamp, record)));
        });
        self.tracks.poll(|header, records| pilot.hear_tracks(&tracks_message(header, records)));
        self.learned.take();
        self.physics.take();
    }
}

impl Control {
    /// Nothing has been decided yet.
    ///
    /// # Errors
    /// A channel that cannot be used, settings that cannot be.
    pub fn new(bus: &Bus, setup: ControlSetup) -> Result<Self, RuntimeError> {
        let ControlSetup { model, config, corrector, seed, period_s, ages } = setup;
        let (n_max, n_steps) = (config.controller.n_rollouts, config.controller.n_steps);
        let ages = PilotAges { learned_ns: ages.learned_ns, mission_ns: ages.mission_ns };
        let pilot = Pilot::new(model, &config, seed)?.with_ages(ages);
        let pilot = match &corrector {
            Some(checkpoint) => pilot.with_corrector(checkpoint)?,
            None => pilot,
        };
        Ok(Self {
            clock: bus.clock().clone(),
            budget: Budget::new(n_max, clock::nanoseconds(BUDGET_SHARE * period_s)),
            inputs: Inputs::new(bus, pilot.corrector().is_some())?,
            pilot,
            commands: bus.outlet(&COMMAND, 1)?,
            decisions: bus.outlet(&DECISION, 1)?,
            plans: bus.outlet(&PLAN, n_steps + 1)?,
            futures: bus.outlet(&FUTURES, FUTURES_TOLD * (n_steps + 1))?,
            futures_at_ns: 0,
            stuck: bus.outlet(&STUCK, 1)?,
            meter: Meter::new(bus, Role::Control)?,
        })
    }

    /// Decides now, `lateness_ns` after the time when it was to be decided.
    pub fn cycle(&mut self, began_ns: u64, lateness_ns: u64) -> Result<(), RuntimeError> {
        self.inputs.take(&mut self.pilot);
        let n_rollouts = self.budget.n_rollouts();
        self.pilot.use_rollouts(n_rollouts);
        let thinking_ns = self.clock.now_ns();
        let maps =
            RiskMessages { learned: self.inputs.learned.message(), physics: self.inputs.physics.message() };
        let answer = self.pilot.answer(began_ns, &maps);
        if matches!(answer.decision, Decision::Drive(_)) {
            self.budget.learn(n_rollouts, self.clock.now_ns() - thinking_ns);
        }
        let record = decision_record(&answer);
        self.commands.send_one(Stamp::default(), record.command, began_ns)?;
        let record = DecisionRecord { duration_ns: self.clock.now_ns() - began_ns, lateness_ns, ..record };
        self.decisions.send_one(Stamp::default(), record, began_ns)?;
        if matches!(answer.decision, Decision::Drive(_))
            && let Some((source, _)) = answer.risk
        {
            self.tell_plan(source, began_ns)?;
        }
        if let Some((at_ns, pose)) = answer.stuck {
            let record = StuckRecord { position_m: pose.position_m, yaw_rad: pose.yaw_rad };
            self.stuck.send_one(Stamp::default(), record, at_ns)?;
        }
        Ok(())
    }

    /// Where the plan leads over the map that it was made on, and now and then, where others would have led.
    fn tell_plan(&mut self, source: RiskMapSource, at_ns: u64) -> Result<(), RuntimeError> {
        let Inputs { learned, physics, .. } = &self.inputs;
        let map = match source {
            RiskMapSource::Learned => learned,
            RiskMapSource::Physics => physics,
        };
        let views = map.held.as_ref().and_then(|map| risk_views(map.header(), map.payload()));
        let Some((view, _)) = views else { return Ok(()) };
        if at_ns.saturating_sub(self.futures_at_ns) >= FUTURES_PERIOD_NS {
            self.futures_at_ns = at_ns;
            let mut places = futures(self.pilot.controller(), view);
            let n_max = self.futures.n_max();
            let loan = self.futures.write(n_max, |_| places.next().unwrap_or_default())?;
            self.futures.send(loan, at_ns)?;
        }
        let mut states = self.pilot.controller().nominal_states(view);
        let place = |state: State| PlanRecord {
            position_m: [state.x_m, state.y_m],
            yaw_rad: state.yaw_rad,
            speed_mps: state.speed_mps,
        };
        // There is one state more than steps, as many as there is room for.
        let loan = self.plans.write(self.plans.n_max(), |_| states.next().map(place).unwrap_or_default())?;
        Ok(self.plans.send(loan, at_ns).map(drop)?)
    }

    fn report(&mut self, lateness_ns: u64, n_missed: u64) -> Result<(), RuntimeError> {
        self.meter.count(lateness_ns);
        let now_ns = self.clock.now_ns();
        let (inputs, pilot) = (&self.inputs, &self.pilot);
        Ok(self.meter.report(now_ns, || {
            let since_s = |at_ns: Option<u64>| at_ns.map_or(-1.0, |at_ns| clock::age_s(now_ns, at_ns));
            let odometry_s = since_s(inputs.odometry_at_ns);
            let mission_s = since_s(pilot.mission_said_at_ns());
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
            .with(inputs.tracks.counts())
            .with(inputs.imu.as_ref().map_or(&Counts::default(), Inlet::counts))
        })?)
    }
}

/// Every so many of the futures of the last decision, place by place.
fn futures<'a>(
    controller: &'a Controller<Model, impl StepCost>,
    map: RiskMapView<'a>,
) -> impl Iterator<Item = FutureRecord> + 'a {
    // Whole blocks of 64 are sampled, so that there are always as many.
    let stride = controller.n_rollouts() / FUTURES_TOLD;
    let told = (0..FUTURES_TOLD).filter_map(move |k| Some((k, controller.sampled_states(k * stride, map)?)));
    told.flat_map(|(number, (cost_s, states))| {
        let (cost_s, number) = (f64::from(cost_s), number as u64);
        states.map(move |State { x_m, y_m, .. }| FutureRecord { position_m: [x_m, y_m], cost_s, number })
    })
}
