//! The controller: one decision per cycle.

mod settings;
mod start;
mod steps;
#[cfg(test)]
mod tests;

use crate::chunk::Chunk;
use crate::config::{Config, ConfigError};
use crate::cost::{Future, RolloutCost, StepCost};
use crate::diagnostics::Diagnostics;
use crate::driven::Driven;
use crate::judgement::Judge;
use crate::kernel::workers::Workers;
use crate::kernel::{CHUNK, functions};
use crate::ledger::Ledger;
use crate::objective::{Input, ReferenceStep};
use crate::plan::Plan;
use crate::ranking::Ranking;
use crate::recovery::{Mode, Watch};
use crate::rollout::MAX_SLOTS;
use crate::sampling::Control;
use crate::summary::Totals;
use crate::trace::TraceRows;
use crate::weights::WeightSummary;
use bicycle::lanes::Instructions;
use bicycle::{
    Decision, HoldReason, Model, MotionCommand, MotionLimits, MotionState, MotionStepper, StopReason,
};
use settings::Prepared;
use traversability::RiskMapView;

/// A cycle that took more of the model's steps than this tells nothing of a single one.
const LONGEST_STEPS: f64 = 3.0;
/// Most rollouts that are judged when the plan breaks a limit. Those that the rollouts themselves call feasible come
/// first, so it takes one or two where there is one.
const MOST_JUDGED: usize = 64;

/// A part of a decision, for whoever measures where time goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Shifting the plan, predicting the start, sampling the controls, rolling them out and pricing them.
    Rollout,
    /// Weighing, averaging and judging the result.
    Update,
}

/// Model predictive path integral control (Williams et al. 2017) over a risk map.
///
/// The model decides what a command is: speed and steering angle of the bicycle, [`bicycle::Model`], speed and yaw rate
/// of the [`bicycle::SkidSteer`]. Its equations become part of the rollouts' inner loop when the program is compiled.
///
/// Each cycle: shift the plan, predict the start, then sample, roll out, weigh and average; then judge the plan.
/// A decision is a function of the inputs since [`Controller::new`] or [`Controller::reset`], the configuration and
/// the seed, bit for bit, for any number of threads.
pub struct Controller<M: Driven = Model, S = (), R = ()> {
    pub(crate) config: Config,
    model: M,
    pub(crate) limits: MotionLimits,
    seed: u64,
    instructions: Instructions,
    workers: Workers,
    pub(crate) chunks: Vec<Chunk>,
    /// Chunks that are sampled, from the first on.
    pub(crate) n_used: usize,
    pub(crate) plan: Plan,
    ranking: Ranking,
    /// The model with lengths in metres, for judging.
    pub(crate) stepper: M::Stepper,
    /// The model with lengths in cells, for the rollouts.
    cell_stepper: M::Stepper,
    ledger: Ledger<M::Command>,
    /// Accelerations that the effects hold against the forces that the vehicle met [m/s2].
    held_mps2: Vec<f64>,
    /// Where the step began that is being driven.
    before: Option<MotionState>,
    watch: Watch,
    /// How far the model's effects and lags keep its actuators behind the commands [s].
    lag_s: [f64; 2],
    /// Of a radian of the vehicle's tightest turn [s].
    turning_s_per_rad: f64,
    reference: Vec<ReferenceStep>,
    /// Whether there is no plan yet.
    is_fresh: bool,
    /// What the effects remember at the start of the rollouts.
    pub(crate) slots: [f32; MAX_SLOTS],
    /// Where the last rollouts started.
    pub(crate) start: MotionState,
    temperature_s: f32,
    diagnostics: Diagnostics,
    step_cost: S,
    rollout_cost: R,
    /// Room for what whole rollouts cost.
    futures: Vec<Future>,
    added_s: Vec<f32>,
}

impl<M: Driven> Controller<M> {
    /// A controller of `model`, with its threads and all memory that it will ever use.
    ///
    /// # Errors
    /// A configuration or model out of range, an instruction set that the machine lacks, or a refused thread.
    pub fn new(config: Config, model: M, seed: u64) -> Result<Self, ConfigError> {
        Self::with_costs(config, model, ((), ()), seed)
    }
}

impl<M: Driven, S: StepCost, R: RolloutCost> Controller<M, S, R> {
    /// [`Controller::new`] with costs of one's own: of every step, and of whole rollouts.
    ///
    /// # Errors
    /// As [`Controller::new`].
    pub fn with_costs(
        config: Config,
        model: M,
        (step_cost, rollout_cost): (S, R),
        seed: u64,
    ) -> Result<Self, ConfigError> {
        config.validate()?;
        model.validate()?;
        let instructions = Instructions::find(config.isa)?;
        let Prepared { limits, stepper, lag_s, turning_s_per_rad } = Prepared::new(&config, &model)?;
        let reach_s = config.delay_s + LONGEST_STEPS * config.step_s + stepper.past_s();
        let ledger = Ledger::new(reach_s, config.period_min_s);
        let n_chunks = config.n_rollouts / CHUNK;
        let n_traced = if R::KEEPS_STEPS { config.n_steps } else { 0 };
        let chunk = Chunk { trace: vec![TraceRows::ZERO; n_traced], ..Chunk::new(config.n_steps) };
        Ok(Self {
            workers: Workers::new(config.n_threads, n_chunks)?,
            chunks: vec![chunk; n_chunks],
            n_used: n_chunks,
            plan: Plan::new(&config),
            ranking: Ranking::new(config.n_rollouts),
            cell_stepper: stepper.clone(),
            held_mps2: vec![0.0; stepper.n_held()],
            stepper,
            ledger,
            before: None,
            watch: Watch::new(config.recovery),
            lag_s,
            turning_s_per_rad,
            reference: vec![ReferenceStep::default(); config.n_steps],
            is_fresh: true,
            slots: [0.0; MAX_SLOTS],
            start: MotionState::default(),
            temperature_s: 1.0,
            diagnostics: Diagnostics::new(instructions.isa()),
            futures: vec![Future::default(); if R::IS_NOTHING { 0 } else { config.n_rollouts }],
            added_s: vec![0.0; if R::IS_NOTHING { 0 } else { config.n_rollouts }],
            step_cost,
            rollout_cost,
            config,
            limits,
            model,
            seed,
            instructions,
        })
    }

    /// Forgets plan, history and progress.
    pub fn reset(&mut self) {
        self.is_fresh = true;
        self.ledger.clear();
        self.let_go();
        self.watch.reset();
        self.temperature_s = 1.0;
    }

    /// From now on samples at most `n` futures a cycle, in whole blocks of 64, at least one and at most as many as
    /// are configured: for a processor that is too slow for all of them. Decisions are then those of a controller
    /// that is configured for as many.
    pub fn use_rollouts(&mut self, n: usize) {
        self.n_used = (n / CHUNK).clamp(1, self.chunks.len());
    }

    /// Futures that a cycle samples.
    pub fn n_rollouts(&self) -> usize {
        self.n_used * CHUNK
    }

    /// What the last cycle that sampled tells about itself.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }

    /// The cost of every step, to be changed between decisions.
    pub fn step_cost_mut(&mut self) -> &mut S {
        &mut self.step_cost
    }

    /// The cost of whole rollouts, to be changed between decisions.
    pub fn rollout_cost_mut(&mut self) -> &mut R {
        &mut self.rollout_cost
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Decides what to do now. Allocates nothing.
    ///
    /// Takes it that the vehicle is told [`Decision::command`] of the result; where it is told something else, say so
    /// with [`Controller::note_sent`].
    pub fn decide(&mut self, input: &Input<'_, M::State>) -> Decision<M::Command> {
        self.decide_observed(input, |_| ())
    }

    /// [`Controller::decide`], telling `observe` at the end of every phase which one it was; with several iterations
    /// each phase ends once per iteration. Cycles that do not sample tell nothing.
    pub fn decide_observed(
        &mut self,
        input: &Input<'_, M::State>,
        mut observe: impl FnMut(Phase),
    ) -> Decision<M::Command> {
        let input = &input.in_shared_terms();
        if let Some(decision) = self.reason_not_to_plan(input) {
            self.stand_by(&decision, input.elapsed_s);
            return decision;
        }
        self.ledger.pass(input.elapsed_s);
        let decision = self.plan_cycle(input, &mut observe);
        self.send(&decision);
        match decision {
            Decision::Drive(_) => self.before = Some(input.state),
            Decision::Hold(_) | Decision::Stop(_) => self.let_go(),
        }
        decision
    }

    /// A cycle that somebody else decides, `elapsed_s` after the cycle before: time passes and the vehicle is told what
    /// that decision says. The next plan starts from there, with nothing of the last one.
    pub fn stand_by(&mut self, decision: &Decision<M::Command>, elapsed_s: f64) {
        self.ledger.pass(elapsed_s);
        self.send(decision);
        self.is_fresh = true;
        self.let_go();
        self.watch.reset();
    }

    /// What the vehicle was really told from `after_s` after the last cycle on, or before it where that is negative, whatever
    /// has been decided since: whoever stands between controller and vehicle has changed it. While it does something else
    /// than it is told it is not stuck. Numbers that are not finite are no command and change nothing.
    pub fn note_sent(&mut self, sent: M::Command, after_s: f64) {
        if is_finite(sent, after_s) {
            self.ledger.replace(after_s, sent);
            self.watch.reset();
        }
    }

    /// What the vehicle says that it has been following since `after_s` after the last cycle, where it is not what was
    /// decided last before: it follows again, or one before was lost. What was decided later is still on its way.
    pub fn note_followed(&mut self, followed: M::Command, after_s: f64) {
        if is_finite(followed, after_s) {
            self.ledger.resume(after_s, followed);
        }
    }

    /// The frame that states, maps and goals are told in moved: a pose of before, east, north [m] and yaw [rad], lies where
    /// `carry` takes it. What the controller remembers of places moves along.
    pub fn carry(&mut self, carry: impl Fn([f64; 3]) -> [f64; 3]) {
        self.watch.carry(|[x_m, y_m]| {
            let [x_m, y_m, _] = carry([x_m, y_m, 0.0]);
            [x_m, y_m]
        });
        self.before = self.before.map(|before| {
            let [x_m, y_m, yaw_rad] = carry([before.x_m, before.y_m, before.yaw_rad]);
            MotionState { x_m, y_m, yaw_rad, ..before }
        });
    }

    fn send(&mut self, decision: &Decision<M::Command>) {
        let last = self.ledger.last().unwrap_or_default();
        self.ledger.send(decision.command(last));
    }

    fn reason_not_to_plan(&self, input: &Input<'_, MotionState>) -> Option<Decision<M::Command>> {
        let MotionState { x_m, y_m, yaw_rad, speed_mps, turn } = input.state;
        let numbers = [x_m, y_m, yaw_rad, speed_mps, turn, input.elapsed_s];
        let Some((end_m, tolerance_m)) = input.objective.end() else {
            return Some(Decision::Stop(StopReason::NonFiniteInput));
        };
        if !numbers.iter().all(|number| number.is_finite()) {
            return Some(Decision::Stop(StopReason::NonFiniteInput));
        }
        if !is_usable(&input.map) {
            return Some(Decision::Hold(HoldReason::NoMap));
        }
        if libm::hypot(end_m[0] - x_m, end_m[1] - y_m) <= tolerance_m {
            return Some(Decision::Hold(HoldReason::AtGoal));
        }
        let outside = input.map.geometry.cell_at(x_m, y_m).is_none();
        outside.then_some(Decision::Stop(StopReason::OutsideMap))
    }

    /// A cycle that samples.
    fn plan_cycle(
        &mut self,
        input: &Input<'_, MotionState>,
        observe: &mut impl FnMut(Phase),
    ) -> Decision<M::Command> {
        self.plan.shift(input.elapsed_s / self.config.step_s);
        let told_mps = self.ledger.last().map_or(0.0, |command| f64::from(command.speed_mps()));
        let mode = self.watch.observe(&input.state, told_mps, input.elapsed_s);
        self.follow_held(input);
        self.start = self.predict_start(input);
        // No model steps from farther: what is measured may exceed what the wheels can do.
        self.start.turn = self.start.turn.clamp(-self.limits.turn_domain, self.limits.turn_domain);
        self.recall_slots(self.start, 0.0);
        if std::mem::take(&mut self.is_fresh) {
            self.plan.hold(start::as_control(&self.start));
        }
        self.cell_stepper.rescale(input.map.geometry.resolution_m);
        let task = self.task(input, mode);
        let mut summary = WeightSummary::default();
        for iteration in 0..self.config.n_iterations {
            let number =
                input.cycle.wrapping_mul(self.config.n_iterations as u64).wrapping_add(iteration as u64);
            self.roll_out(input, task, (functions::key(self.seed, number), mode));
            self.add_rollout_cost(input);
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

    fn describe(&mut self, summary: &WeightSummary, mode: Mode) {
        let totals = self.chunks[..self.n_used]
            .iter()
            .fold(Totals::default(), |totals, chunk| totals.plus(&chunk.totals));
        let (chunk, lane) = summary.best;
        self.diagnostics = Diagnostics {
            isa: self.instructions.isa(),
            best_terms_s: self.chunks[chunk].terms.each_ref().map(|row| row.0[lane]),
            mean_terms_s: totals.mean_terms_s(),
            baseline_s: summary.baseline_s,
            normalizer: summary.normalizer,
            effective_sample_size: summary.effective_sample_size,
            temperature_s: summary.temperature_s,
            free_energy_s: summary.free_energy_s(self.n_rollouts()),
            n_feasible: totals.n_feasible as usize,
            n_non_finite: summary.n_non_finite,
            is_recovering: mode != Mode::Onward,
            is_no_way: matches!(mode, Mode::BackUp { is_no_way: true, .. }),
            is_best_alone: false,
        };
    }

    /// The plan's first command, if the plan may be driven; else that of the best rollout that may.
    fn judge(&mut self, input: &Input<'_, MotionState>, summary: &WeightSummary) -> Decision<M::Command> {
        let finite = self.plan.nominal.iter().flatten().all(|value| value.is_finite());
        if summary.n_non_finite == self.n_rollouts() || !finite {
            self.is_fresh = true;
            return Decision::Stop(StopReason::NonFiniteResult);
        }
        if let Err(reason) = self.check(input, self.plan.nominal.iter().copied()) {
            let Some((chunk, lane)) = self.best_that_may_be_driven(input) else {
                self.plan.hold(M::Command::from(self.plan.nominal[0]).at_standstill().into());
                return Decision::Stop(reason);
            };
            let controls = self.chunks[chunk].controls_of(lane);
            self.plan.nominal.iter_mut().zip(controls).for_each(|(nominal, control)| *nominal = control);
            self.diagnostics.is_best_alone = true;
        }
        Decision::Drive(self.plan.nominal[0].into())
    }

    /// Chunk and lane of the first rollout in the order of [`Ranking`] that may be driven.
    fn best_that_may_be_driven(&mut self, input: &Input<'_, MotionState>) -> Option<(usize, usize)> {
        let mut ranking = std::mem::take(&mut self.ranking);
        let best = ranking
            .first(MOST_JUDGED, &self.chunks[..self.n_used])
            .find(|&(chunk, lane)| self.check(input, self.chunks[chunk].controls_of(lane)).is_ok());
        self.ranking = ranking;
        best
    }

    /// Whether controls keep the limits of attitude for as long as the vehicle would need to stop, and lead nowhere that is
    /// forbidden; else the reason to stop.
    fn check(
        &self,
        input: &Input<'_, MotionState>,
        controls: impl Iterator<Item = Control> + Clone,
    ) -> Result<(), StopReason> {
        let judge = self.judge_over(input.map);
        let n_steps = self.steps_to_stop(controls.clone().next().unwrap_or_default());
        let mut memory = self.slots.map(f64::from);
        if judge.breaks_limits(&self.start, controls.clone().take(n_steps), &mut memory) {
            return Err(StopReason::NoFeasibleRollout);
        }
        let Some(foresight_s) = self.step_cost.foresight_s() else { return Ok(()) };
        let n_steps = n_steps + (foresight_s / self.config.step_s).ceil() as usize;
        let mut memory = self.slots.map(f64::from);
        let is_forbidden = |t: usize, state: &MotionState| self.step_cost.forbids(t, state);
        let meets = judge.leads(&self.start, controls.take(n_steps), &mut memory, is_forbidden);
        if meets { Err(StopReason::MovingObstacle) } else { Ok(()) }
    }

    /// The reference model over a map.
    pub(crate) fn judge_over<'a>(&'a self, map: RiskMapView<'a>) -> Judge<'a, M::Stepper> {
        Judge { stepper: &self.stepper, limits: &self.limits, map }
    }

    /// Steps in which the vehicle could stop, one to spare, from the faster of its speed and the one asked for.
    fn steps_to_stop(&self, [speed_mps, _]: Control) -> usize {
        let speed_mps = self.start.speed_mps.abs().max(f64::from(speed_mps.abs()));
        let stop_s = speed_mps / self.limits.rates[0] + self.lag_s[0];
        ((stop_s / self.config.step_s).ceil() as usize + 1).min(self.config.n_steps)
    }
}

fn is_finite(command: impl Into<Control>, after_s: f64) -> bool {
    command.into().iter().all(|channel| channel.is_finite()) && after_s.is_finite()
}

/// Whether there is anything in the map, and no more than a lane's index counts.
fn is_usable(map: &RiskMapView<'_>) -> bool {
    let resolution_m = map.geometry.resolution_m;
    let indexable = i32::try_from(map.risks.len()).is_ok();
    !map.risks.is_empty() && indexable && resolution_m.is_finite() && resolution_m > 0.0
}
