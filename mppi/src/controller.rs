//! The controller: one decision per cycle.

use crate::chunk::Chunk;
use crate::config::{Actuation, Config, ConfigError, Temperature};
use crate::diagnostics::Diagnostics;
use crate::history::History;
use crate::judgement::Judge;
use crate::kernel::workers::Workers;
use crate::kernel::{CHUNK, Machine, functions};
use crate::objective::{Input, Objective, ReferenceStep, Terminal, TerminalField};
use crate::plan::Plan;
use crate::recovery::{Mode, Watch};
use crate::rollout::{GoalTask, Grid, MAX_SLOTS, Prices, RollOut, Scene, Start, Task};
use crate::sampling::{Control, Sample, Sampler};
use crate::summary::{Accumulate, Totals};
use crate::weights::{Weigh, WeightSummary};
use bicycle::{Command, Decision, HoldReason, Model, State, Stepper, StopReason};
use std::f64::consts::TAU;
use traversability::RiskMapView;

/// A part of a decision, for whoever measures where time goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Shifting the plan, predicting the start and sampling the controls.
    Noise,
    /// Rolling them out and pricing them.
    Rollout,
    /// Weighing, averaging and judging the result.
    Update,
}

/// Model predictive path integral control (Williams et al. 2017) over a risk map.
///
/// Each cycle: shift the plan, predict the start, then sample, roll out, weigh and average; then judge the plan.
/// A decision is a function of the inputs since [`Controller::new`] or [`Controller::reset`], the configuration and
/// the seed, bit for bit, for any number of threads.
pub struct Controller {
    pub(crate) config: Config,
    pub(crate) model: Model,
    seed: u64,
    machine: Machine,
    workers: Workers,
    pub(crate) chunks: Vec<Chunk>,
    pub(crate) plan: Plan,
    /// The model with lengths in metres, for judging.
    pub(crate) stepper: Stepper,
    /// The model with lengths in cells, for the rollouts.
    cell_stepper: Stepper,
    history: History,
    watch: Watch,
    reference: Vec<ReferenceStep>,
    /// Whether there is no plan yet.
    is_fresh: bool,
    /// What the effects remember at the start of the rollouts.
    pub(crate) slots: [f32; MAX_SLOTS],
    /// Where the last rollouts started.
    pub(crate) start: State,
    temperature_s: f32,
    diagnostics: Diagnostics,
}

impl Controller {
    /// A controller of `model`, with its threads and all memory that it will ever use.
    ///
    /// # Errors
    /// A configuration or model out of range, an instruction set that the machine lacks, or a refused thread.
    pub fn new(config: Config, model: Model, seed: u64) -> Result<Self, ConfigError> {
        config.validate()?;
        model.validate()?;
        let machine = Machine::find(config.isa).ok_or(ConfigError::IsaAbsent { isa: config.isa })?;
        let stepper = Stepper::new(&model, config.step_s, 1.0);
        let stepper = match config.actuation {
            Actuation::Instant => stepper.with_instant_actuators(),
            Actuation::Limited => stepper,
        };
        let n_slots = stepper.n_slots();
        if n_slots > MAX_SLOTS {
            return Err(ConfigError::EffectMemory { found: n_slots, step_s: config.step_s });
        }
        let n_chunks = config.n_rollouts / CHUNK;
        Ok(Self {
            workers: Workers::new(config.n_threads, n_chunks)?,
            chunks: vec![Chunk::new(config.n_steps); n_chunks],
            plan: Plan::new(&config),
            cell_stepper: stepper.clone(),
            stepper,
            history: History::new(),
            watch: Watch::new(config.recovery),
            reference: vec![ReferenceStep::default(); config.n_steps],
            is_fresh: true,
            slots: [0.0; MAX_SLOTS],
            start: State::default(),
            temperature_s: 1.0,
            diagnostics: Diagnostics::new(machine.isa()),
            config,
            model,
            seed,
            machine,
        })
    }

    /// Forgets plan, history and progress.
    pub fn reset(&mut self) {
        self.is_fresh = true;
        self.history = History::new();
        self.watch.reset();
        self.temperature_s = 1.0;
    }

    /// What the last cycle that sampled tells about itself.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Decides what to do now. Allocates nothing.
    pub fn decide(&mut self, input: &Input<'_>) -> Decision {
        self.decide_observed(input, |_| ())
    }

    /// [`Controller::decide`], telling `observe` at the end of every phase which one it was; with several iterations
    /// each phase ends once per iteration. Cycles that do not sample tell nothing.
    pub fn decide_observed(&mut self, input: &Input<'_>, mut observe: impl FnMut(Phase)) -> Decision {
        self.history.age(input.elapsed_s.max(0.0));
        let decision = match self.reason_not_to_plan(input) {
            Some(decision) => decision,
            None => self.plan_cycle(input, &mut observe),
        };
        self.remember(input, decision);
        decision
    }

    fn reason_not_to_plan(&self, input: &Input<'_>) -> Option<Decision> {
        let State { x_m, y_m, yaw_rad, speed_mps, steering_rad } = input.state;
        let numbers = [x_m, y_m, yaw_rad, speed_mps, steering_rad, input.elapsed_s];
        let Some((end_m, tolerance_m)) = input.objective.end() else {
            return Some(Decision::Stop(StopReason::NonFiniteInput));
        };
        if !numbers.iter().all(|number| number.is_finite()) {
            return Some(Decision::Stop(StopReason::NonFiniteInput));
        }
        if !is_usable(&input.map) {
            return Some(Decision::Hold(HoldReason::NoMap));
        }
        if (end_m[0] - x_m).hypot(end_m[1] - y_m) <= tolerance_m {
            return Some(Decision::Hold(HoldReason::AtGoal));
        }
        let outside = input.map.geometry.cell_at(x_m, y_m).is_none();
        outside.then_some(Decision::Stop(StopReason::OutsideMap))
    }

    /// A cycle that samples.
    fn plan_cycle(&mut self, input: &Input<'_>, observe: &mut impl FnMut(Phase)) -> Decision {
        self.plan.shift(input.elapsed_s / self.config.step_s);
        let mode = self.watch.observe(&input.state, input.elapsed_s);
        self.start = self.predict_start(input);
        self.recall_slots();
        if std::mem::take(&mut self.is_fresh) {
            self.plan.hold([self.start.speed_mps as f32, self.start.steering_rad as f32]);
        }
        self.cell_stepper.rescale(input.map.geometry.resolution_m);
        let task = self.task(input, mode);
        let mut summary = WeightSummary::default();
        for iteration in 0..self.config.n_iterations {
            let number =
                input.cycle.wrapping_mul(self.config.n_iterations as u64).wrapping_add(iteration as u64);
            self.sample(functions::key(self.seed, number), mode);
            observe(Phase::Noise);
            self.roll_out(input, task);
            observe(Phase::Rollout);
            summary = self.weigh();
            self.average(&summary);
            if iteration + 1 < self.config.n_iterations {
                observe(Phase::Update);
            }
        }
        self.describe(&summary, mode);
        let decision = self.judge(input, &summary);
        observe(Phase::Update);
        decision
    }

    /// The measured state, carried over the known delay by the commands that are already on their way.
    fn predict_start(&self, input: &Input<'_>) -> State {
        let mut state = input.state;
        let n_steps = (self.config.delay_s / self.config.step_s).ceil() as usize;
        if n_steps == 0 {
            return state;
        }
        let step_s = self.config.delay_s / n_steps as f64;
        let judge = Judge { stepper: &self.stepper, limits: &self.model.limits, map: input.map };
        let mut memory = self.slots.map(f64::from);
        for k in 0..n_steps {
            // In force during this step: the command that was sent a delay ago.
            let age_s = self.config.delay_s - (k as f64 + 0.5) * step_s;
            let standing =
                Command { speed_mps: state.speed_mps as f32, steering_rad: state.steering_rad as f32 };
            let next = judge.step(&state, self.history.at(age_s).unwrap_or(standing), &mut memory, k);
            let share = step_s / self.config.step_s;
            state = between(&state, &next, share);
        }
        state
    }

    fn recall_slots(&mut self) {
        let (history, start) = (&self.history, &self.start);
        let standing = Command { speed_mps: start.speed_mps as f32, steering_rad: start.steering_rad as f32 };
        let past = |age_s: f64| history.at(age_s).unwrap_or(standing);
        let slots = &mut self.slots;
        self.stepper.recall(&past, |slot, value| slots[slot] = value as f32);
    }

    /// Where the commands of the plan start from: the last command, held near the measured state.
    fn start_control(&self) -> Control {
        let limits = &self.model.limits;
        let reached = [self.start.speed_mps, self.start.steering_rad];
        let last = self
            .history
            .last()
            .map_or(reached, |command| [f64::from(command.speed_mps), f64::from(command.steering_rad)]);
        let reach = [limits.acceleration_max_mps2, limits.steering_rate_max_radps]
            .map(|rate| rate * self.config.tracking_s);
        [0, 1].map(|c| last[c].clamp(reached[c] - reach[c], reached[c] + reach[c]) as f32)
    }

    fn sample(&mut self, key: [u32; 4], mode: Mode) {
        let limits = &self.model.limits;
        let step_s = self.config.step_s;
        let start = self.start_control();
        self.plan.prepare(start, self.config.control_cost * f64::from(self.weighing_temperature_s()));
        let change = match self.config.actuation {
            Actuation::Instant => [f32::INFINITY; 2],
            Actuation::Limited => [limits.acceleration_max_mps2, limits.steering_rate_max_radps]
                .map(|rate| (rate * step_s) as f32),
        };
        let speed_max_mps = if mode == Mode::Onward { limits.speed_max_mps } else { 0.0 };
        let sampler = Sampler {
            steps: &self.plan.steps,
            kept_noise: [self.plan.correlation(); 2],
            kept_control: self.plan.kept_control(),
            low: [-limits.reverse_speed_max_mps as f32, -limits.steering_max_rad as f32],
            high: [speed_max_mps as f32, limits.steering_max_rad as f32],
            change,
            start,
            key,
        };
        let machine = self.machine;
        self.workers.run(&mut self.chunks, |index, chunk| {
            machine.run(Sample { sampler: &sampler, index, chunk });
        });
    }

    fn weighing_temperature_s(&self) -> f32 {
        match self.config.temperature {
            Temperature::Fixed { temperature_s } => temperature_s as f32,
            Temperature::EffectiveSampleSize { .. } => self.temperature_s,
        }
    }

    fn task<'a>(&self, input: &Input<'a>, mode: Mode) -> TaskOrder<'a> {
        match (mode, input.objective) {
            (Mode::BackUp { target_m }, _) => TaskOrder::Goal(target_m, 0.0, Terminal::StraightLine),
            (Mode::Onward, Objective::Goal { goal_m, tolerance_m, terminal }) => {
                TaskOrder::Goal(goal_m, tolerance_m, terminal)
            }
            (Mode::Onward, Objective::Path(path)) => TaskOrder::Path(path),
        }
    }

    fn roll_out(&mut self, input: &Input<'_>, order: TaskOrder<'_>) {
        let geometry = &input.map.geometry;
        let (corner_m, cell_m) = (geometry.south_west_m(), geometry.resolution_m);
        let cells = |at_m: [f64; 2]| [0, 1].map(|axis| (at_m[axis] - corner_m[axis]) / cell_m);
        if let TaskOrder::Path(path) = order {
            let passed_m = path.project([self.start.x_m, self.start.y_m]);
            let (costs, step_s) = (&self.config.costs, self.config.step_s);
            for (t, step) in self.reference.iter_mut().enumerate() {
                let (at_m, tangent) = path.at(passed_m + path.speed_mps * step_s * (t + 1) as f64);
                let [x_cells, y_cells] = cells(at_m);
                let along_s = costs.path_along_s_per_m2 * cell_m * cell_m;
                let across_s = costs.path_across_s_per_m2 * cell_m * cell_m;
                *step = ReferenceStep { x_cells, y_cells, tangent, along_s, across_s };
            }
        }
        let task = match order {
            TaskOrder::Path(_) => Task::Path(&self.reference),
            TaskOrder::Goal(goal_m, tolerance_m, terminal) => {
                let [x_cells, y_cells] = cells(goal_m);
                let field = match terminal {
                    Terminal::StraightLine => None,
                    Terminal::CostToGo(view) => TerminalField::new(view, geometry),
                };
                Task::Goal(GoalTask {
                    x_cells,
                    y_cells,
                    tolerance_cells: tolerance_m / cell_m,
                    step_s: self.config.step_s,
                    distance_s: self.config.costs.distance_s_per_m * cell_m,
                    rest_s: cell_m / self.config.costs.rest_speed_mps,
                    field,
                })
            }
        };
        let [x_cells, y_cells] = cells([self.start.x_m, self.start.y_m]);
        let scene = Scene {
            stepper: &self.cell_stepper,
            grid: grid(&input.map),
            start: Start {
                x_cells,
                y_cells,
                turns: (self.start.yaw_rad / TAU).rem_euclid(1.0),
                speed_mps: self.start.speed_mps,
                steering_rad: self.start.steering_rad,
            },
            slots: &self.slots[..self.cell_stepper.n_slots()],
            prices: self.prices(),
            task,
        };
        let machine = self.machine;
        self.workers.run(&mut self.chunks, |_, chunk| machine.run(RollOut { scene: &scene, chunk }));
    }

    fn prices(&self) -> Prices {
        let (limits, costs) = (&self.model.limits, &self.config.costs);
        Prices {
            roll_max_rad: limits.roll_max_rad,
            pitch_max_rad: limits.pitch_max_rad,
            attitude_s: costs.attitude_s,
            lateral_max_mps2: limits.lateral_acceleration_max_mps2,
            lateral_s: costs.lateral_s,
            reverse_s: costs.reverse_s,
        }
    }

    fn weigh(&mut self) -> WeightSummary {
        let work = Weigh {
            chunks: &mut self.chunks,
            temperature: self.config.temperature,
            last_s: self.temperature_s,
        };
        let summary = self.machine.run(work);
        self.temperature_s = summary.temperature_s;
        summary
    }

    /// The weighted mean of all rollouts becomes the plan. Chunks are added in their order, whoever computed them.
    fn average(&mut self, summary: &WeightSummary) {
        let machine = self.machine;
        self.workers.run(&mut self.chunks, |_, chunk| machine.run(Accumulate { chunk }));
        self.plan.nominal.fill([0.0; 2]);
        for chunk in self.chunks.iter().filter(|chunk| !chunk.is_negligible) {
            for (nominal, sum) in self.plan.nominal.iter_mut().zip(&chunk.sums) {
                *nominal = [nominal[0] + sum[0], nominal[1] + sum[1]];
            }
        }
        let share = 1.0 / summary.normalizer;
        self.plan.nominal.iter_mut().flatten().for_each(|value| *value *= share);
    }

    fn describe(&mut self, summary: &WeightSummary, mode: Mode) {
        let totals = self.chunks.iter().fold(Totals::default(), |totals, chunk| totals.plus(&chunk.totals));
        let (chunk, lane) = summary.best;
        self.diagnostics = Diagnostics {
            isa: self.machine.isa(),
            best_terms_s: self.chunks[chunk].terms.each_ref().map(|row| row.0[lane]),
            mean_terms_s: totals.mean_terms_s(),
            baseline_s: summary.baseline_s,
            normalizer: summary.normalizer,
            effective_sample_size: summary.effective_sample_size,
            temperature_s: summary.temperature_s,
            free_energy_s: summary.free_energy_s(self.config.n_rollouts),
            n_feasible: totals.n_feasible as usize,
            n_non_finite: summary.n_non_finite,
            is_recovering: mode != Mode::Onward,
            is_best_alone: false,
        };
    }

    /// The plan's first command, if the plan may be driven; else that of the best rollout, if that may.
    fn judge(&mut self, input: &Input<'_>, summary: &WeightSummary) -> Decision {
        let finite = self.plan.nominal.iter().flatten().all(|value| value.is_finite());
        if summary.n_non_finite == self.config.n_rollouts || !finite {
            self.is_fresh = true;
            return Decision::Stop(StopReason::NonFiniteResult);
        }
        let judge = Judge { stepper: &self.stepper, limits: &self.model.limits, map: input.map };
        let n_steps = self.steps_to_stop();
        let mut memory = self.slots.map(f64::from);
        let plan = self.plan.nominal.iter().copied().take(n_steps);
        if !judge.breaks_limits(&self.start, plan, &mut memory) {
            return Decision::Drive(self.plan.command(0));
        }
        let (chunk, lane) = summary.best;
        let controls = self.chunks[chunk].controls.iter().map(|rows| [rows[0].0[lane], rows[1].0[lane]]);
        let mut memory = self.slots.map(f64::from);
        if judge.breaks_limits(&self.start, controls.clone().take(n_steps), &mut memory) {
            self.plan.stop();
            return Decision::Stop(StopReason::NoFeasibleRollout);
        }
        self.plan.nominal.iter_mut().zip(controls).for_each(|(nominal, control)| *nominal = control);
        self.diagnostics.is_best_alone = true;
        Decision::Drive(self.plan.command(0))
    }

    /// Steps in which the vehicle could stop, one to spare, from the faster of its speed and the planned one.
    fn steps_to_stop(&self) -> usize {
        let speed_mps = self.start.speed_mps.abs().max(f64::from(self.plan.nominal[0][0].abs()));
        let stop_s = speed_mps / self.model.limits.acceleration_max_mps2;
        ((stop_s / self.config.step_s).ceil() as usize + 1).min(self.config.n_steps)
    }

    /// Keeps what the next cycle needs to know of this decision.
    fn remember(&mut self, input: &Input<'_>, decision: Decision) {
        match decision {
            Decision::Drive(command) => self.history.send(command),
            Decision::Hold(_) => {
                self.watch.reset();
                self.is_fresh = true;
                self.history.send(standing(&input.state));
            }
            Decision::Stop(_) => {
                self.history.send(standing(&input.state));
            }
        }
    }
}

/// What to sample for, in metres.
#[derive(Clone, Copy)]
enum TaskOrder<'a> {
    Goal([f64; 2], f64, Terminal<'a>),
    Path(crate::objective::ReferencePath<'a>),
}

/// Whether the arrays have the shape that the geometry says.
fn is_usable(map: &RiskMapView<'_>) -> bool {
    let n_cells = map.geometry.n_cells();
    let resolution_m = map.geometry.resolution_m;
    let indexable = i32::try_from(map.risks.len()).is_ok();
    let shaped = map.risks.len() == n_cells * map.n_yaws && map.ground.len() == n_cells;
    !map.risks.is_empty() && shaped && indexable && resolution_m.is_finite() && resolution_m > 0.0
}

fn grid<'a>(map: &RiskMapView<'a>) -> Grid<'a> {
    Grid {
        n_rows: map.geometry.n_rows,
        n_cols: map.geometry.n_cols,
        n_yaws: map.n_yaws,
        risks: map.risks,
        ground: map.ground,
    }
}

/// What stops a vehicle: no speed, the wheels as they are.
fn standing(state: &State) -> Command {
    let steering_rad = if state.steering_rad.is_finite() { state.steering_rad as f32 } else { 0.0 };
    Command { speed_mps: 0.0, steering_rad }
}

/// The state a share of the way from one to the other; yaw the short way round.
fn between(from: &State, to: &State, share: f64) -> State {
    let blend = |from: f64, to: f64| from + share * (to - from);
    let turn_rad = (to.yaw_rad - from.yaw_rad + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    State {
        x_m: blend(from.x_m, to.x_m),
        y_m: blend(from.y_m, to.y_m),
        yaw_rad: from.yaw_rad + share * turn_rad,
        speed_mps: blend(from.speed_mps, to.speed_mps),
        steering_rad: blend(from.steering_rad, to.steering_rad),
    }
}
