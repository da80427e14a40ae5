//! The steps of a cycle, in their order: samples, rollouts, weights, average.

use super::Controller;
use crate::chunk::Chunk;
use crate::config::{Actuation, Config, Temperature};
use crate::cost::{Frame, RolloutCost, StepCost};
use crate::diagnostics::CostTerm;
use crate::driven::Driven;
use crate::kernel::CHUNK;
use crate::kernel::workers::Workers;
use crate::objective::{Input, Objective, ReferencePath, ReferenceStep, Terminal, TerminalField};
use crate::plan::Plan;
use crate::recovery::Mode;
use crate::rollout::together::RollTogether;
use crate::rollout::{GoalTask, Grid, Job, Prices, Rest, Scene, Start, Task, Window};
use crate::sampling::{Control, Sample, Sampler};
use crate::summary::Accumulate;
use crate::trace::{Kept, Trace};
use crate::weights::{Weigh, WeightSummary};
use bicycle::lanes::{Constant, Instructions};
use bicycle::{MotionLimits, MotionState, MotionStepper};
use std::f64::consts::TAU;
use traversability::{GridGeometry, RiskMapView};

/// What to sample for, in metres.
#[derive(Clone, Copy)]
pub(super) enum TaskOrder<'a> {
    Goal([f64; 2], f64, Terminal<'a>),
    /// Come towards the point in reverse, and face the way on.
    Back([f64; 2], Terminal<'a>),
    Path(ReferencePath<'a>),
}

impl<M: Driven, S: StepCost, R: RolloutCost> Controller<M, S, R> {
    /// Where the plan's commands start from: the last one, as near to the measured state as the lag that is known allows.
    fn start_control(&self) -> Control {
        let reached = [self.start.speed_mps, self.start.turn];
        let last = self.ledger.last().map_or(reached, |command| {
            let channels: Control = command.into();
            channels.map(f64::from)
        });
        let reach = [0, 1].map(|c| self.limits.rates[c] * (self.config.tracking_s + self.lag_s[c]));
        [0, 1].map(|c| last[c].clamp(reached[c] - reach[c], reached[c] + reach[c]) as f32)
    }

    fn weighing_temperature_s(&self) -> f32 {
        match self.config.temperature {
            Temperature::Fixed { temperature_s } => temperature_s as f32,
            Temperature::EffectiveSampleSize { .. } => self.temperature_s,
        }
    }

    pub(super) fn task<'a>(&self, input: &Input<'a, MotionState>, mode: Mode) -> TaskOrder<'a> {
        match (mode, input.objective) {
            (Mode::BackUp { target_m, .. }, Objective::Goal { terminal, .. }) => {
                TaskOrder::Back(target_m, terminal)
            }
            (Mode::BackUp { target_m, .. }, _) => TaskOrder::Back(target_m, Terminal::StraightLine),
            (Mode::Onward, Objective::Goal { goal_m, tolerance_m, terminal }) => {
                TaskOrder::Goal(goal_m, tolerance_m, terminal)
            }
            (Mode::Onward, Objective::Path(path)) => TaskOrder::Path(path),
        }
    }

    /// Samples controls and rolls them out, chunk by chunk, so that what was sampled is still in the core's cache.
    pub(super) fn roll_out(
        &mut self,
        input: &Input<'_, MotionState>,
        order: TaskOrder<'_>,
        (key, mode): ([u32; 4], Mode),
    ) {
        let start = self.start_control();
        self.plan.prepare(start, self.config.control_cost * f64::from(self.weighing_temperature_s()));
        let geometry = &input.map.geometry;
        let frame = Frame { corner_m: geometry.south_west_m(), cell_m: geometry.resolution_m };
        if let TaskOrder::Path(path) = order {
            self.lay_out(&path, &frame);
        }
        let start_cells = frame.cells([self.start.x_m, self.start.y_m]);
        let window = Window::of(geometry, start_cells, self.horizon_m() / geometry.resolution_m);
        let terms = GoalTerms {
            config: &self.config,
            turning_s_per_rad: self.turning_s_per_rad,
            geometry,
            frame: &frame,
            window: window.as_ref(),
        };
        let task = match order {
            TaskOrder::Path(_) => Task::Path(&self.reference),
            TaskOrder::Back(target_m, terminal) => Task::Goal(terms.back(target_m, terminal)),
            TaskOrder::Goal(goal_m, tolerance_m, terminal) => {
                Task::Goal(terms.onward(goal_m, tolerance_m, terminal))
            }
        };
        let [x_cells, y_cells] = start_cells;
        let leaning_rad = self.judge_over(input.map).leaning_start_rad(&self.start);
        let scene = Scene {
            stepper: &self.cell_stepper,
            grid: grid(&input.map),
            start: Start {
                x_cells,
                y_cells,
                turns: (self.start.yaw_rad / TAU).rem_euclid(1.0),
                speed_mps: self.start.speed_mps,
                turn: self.start.turn,
            },
            leaning_start_rad: leaning_rad.map(|angles_rad| angles_rad.map(Constant::new)),
            slots: &self.slots[..self.cell_stepper.n_slots()],
            prices: self.prices(&order),
            task,
            cost: &self.step_cost,
            frame,
            keeps_ends: !R::IS_NOTHING,
        };
        let crew = Crew {
            workers: &mut self.workers,
            sampler: Sampler { start, key, ..sampler(&self.plan, &self.config, &self.limits, mode) },
            instructions: self.instructions,
            n_used: self.n_used,
        };
        if R::KEEPS_STEPS {
            let kept = Kept(&self.step_cost);
            crew.roll_out(&scene.with_cost(&kept), &mut self.chunks, |job| job.run());
        } else {
            crew.roll_out(&scene, &mut self.chunks, S::roll_out::<M>);
        }
    }

    /// Furthest way of a rollout [m].
    fn horizon_m(&self) -> f64 {
        let fastest_mps = self.limits.high[0].max(-self.limits.low[0]).max(self.start.speed_mps.abs());
        fastest_mps * self.config.step_s * self.config.n_steps as f64
    }

    /// Where the reference is at the end of every step.
    fn lay_out(&mut self, path: &ReferencePath<'_>, frame: &Frame) {
        let passed_m = path.project([self.start.x_m, self.start.y_m]);
        let (costs, step_s, cell_m) = (&self.config.costs, self.config.step_s, frame.cell_m);
        for (t, step) in self.reference.iter_mut().enumerate() {
            let (at_m, tangent) = path.at(passed_m + path.speed_mps * step_s * (t + 1) as f64);
            let [x_cells, y_cells] = frame.cells(at_m).map(Constant::new);
            let [along_s, across_s] = [costs.path_along_s_per_m2, costs.path_across_s_per_m2]
                .map(|price_s_per_m2| Constant::new(price_s_per_m2 * cell_m * cell_m));
            let tangent = tangent.map(Constant::new);
            *step = ReferenceStep { x_cells, y_cells, tangent, along_s, across_s };
        }
    }

    /// Asks what whole rollouts cost.
    pub(super) fn add_rollout_cost(&mut self, input: &Input<'_, MotionState>) {
        if R::IS_NOTHING {
            return;
        }
        let geometry = &input.map.geometry;
        let frame = Frame { corner_m: geometry.south_west_m(), cell_m: geometry.resolution_m };
        let n = self.n_rollouts();
        let (futures, added_s) = (&mut self.futures[..n], &mut self.added_s[..n]);
        for (number, future) in futures.iter_mut().enumerate() {
            *future = self.chunks[number / CHUNK].future(number % CHUNK, &frame);
        }
        added_s.fill(0.0);
        self.rollout_cost.add(futures, added_s);
        if R::KEEPS_STEPS {
            let trace = Trace { chunks: &self.chunks[..self.n_used], frame, start: self.start };
            self.rollout_cost.add_traced(&trace, added_s);
        }
        for (number, added_s) in added_s.iter().enumerate() {
            let (chunk, lane) = (&mut self.chunks[number / CHUNK], number % CHUNK);
            let term_s = &mut chunk.terms[CostTerm::Added as usize].0[lane];
            // Without a step cost nobody has written the term of this cycle.
            *term_s = added_s + if S::IS_NOTHING { 0.0 } else { *term_s };
            chunk.costs.0[lane] += added_s;
        }
    }

    /// Who is to back up pays nothing for it: a metre would cost more than it gains.
    fn prices(&self, order: &TaskOrder<'_>) -> Prices {
        let (limits, costs) = (&self.limits, &self.config.costs);
        let reverse_s = if matches!(order, TaskOrder::Back(..)) { 0.0 } else { costs.reverse_s };
        Prices {
            roll_max_rad: Constant::new(limits.roll_max_rad),
            pitch_max_rad: Constant::new(limits.pitch_max_rad),
            attitude_s: Constant::new(costs.attitude_s),
            lateral_max_mps2: Constant::new(limits.lateral_acceleration_max_mps2),
            lateral_s: Constant::new(costs.lateral_s),
            reverse_s: Constant::new(reverse_s),
            grip_s: Constant::new(costs.grip_s),
            overspeed_s: Constant::new(costs.overspeed_s),
        }
    }

    pub(super) fn weigh(&mut self) -> WeightSummary {
        let work = Weigh {
            chunks: &mut self.chunks[..self.n_used],
            temperature: self.config.temperature,
            last_s: self.temperature_s,
        };
        let summary = work.on(self.instructions);
        self.temperature_s = summary.temperature_s;
        summary
    }

    /// The weighted mean of all rollouts becomes the plan. Chunks are added in their order, whoever computed them.
    pub(super) fn average(&mut self, summary: &WeightSummary) {
        let (instructions, n_used) = (self.instructions, self.n_used);
        self.workers.run(&mut self.chunks, |index, chunk| {
            if index < n_used {
                Accumulate { chunk }.on(instructions);
            }
        });
        self.plan.nominal.fill([0.0; 2]);
        for chunk in self.chunks[..n_used].iter().filter(|chunk| !chunk.is_negligible) {
            for (nominal, sum) in self.plan.nominal.iter_mut().zip(&chunk.sums) {
                *nominal = [nominal[0] + sum[0], nominal[1] + sum[1]];
            }
        }
        let share = 1.0 / summary.normalizer;
        self.plan.nominal.iter_mut().flatten().for_each(|value| *value *= share);
    }
}

/// Who samples, from what, and rolls out.
struct Crew<'a> {
    workers: &'a mut Workers,
    sampler: Sampler<'a>,
    instructions: Instructions,
    n_used: usize,
}

impl Crew<'_> {
    /// Chunk by chunk on all threads, or all of them a step at a time where the model asks for that.
    fn roll_out<P: MotionStepper, C: StepCost>(
        self,
        scene: &Scene<'_, P, C>,
        chunks: &mut [Chunk],
        run: impl Fn(Job<'_, P, C>) + Sync,
    ) {
        let Self { workers, sampler, instructions, n_used } = self;
        let sample = |index, chunk: &mut Chunk| Sample { sampler: &sampler, index, chunk }.on(instructions);
        if P::GOES_TOGETHER {
            workers.run(chunks, |index, chunk| {
                if index < n_used {
                    sample(index, chunk);
                }
            });
            RollTogether { scene, chunks: &mut chunks[..n_used] }.on(instructions);
        } else {
            workers.run(chunks, |index, chunk| {
                if index < n_used {
                    sample(index, chunk);
                    run(Job { instructions, scene, chunk });
                }
            });
        }
    }
}

/// What goals are priced by, in cells of the map.
struct GoalTerms<'a> {
    config: &'a Config,
    turning_s_per_rad: f64,
    geometry: &'a GridGeometry,
    frame: &'a Frame,
    window: Option<&'a Window>,
}

impl<'a> GoalTerms<'a> {
    fn onward(&self, goal_m: [f64; 2], tolerance_m: f64, terminal: Terminal<'a>) -> GoalTask<'a> {
        let rest = self.field(terminal).map_or(Rest::Straight, Rest::Field);
        let tolerance_cells = tolerance_m / self.frame.cell_m;
        let tolerance_square = Constant::new(tolerance_cells * tolerance_cells.abs());
        GoalTask { tolerance_square, ..self.to(goal_m, self.config.costs.distance_s_per_m, rest) }
    }

    /// Nothing ends at the target, so it counts to be near early.
    fn back(&self, target_m: [f64; 2], terminal: Terminal<'a>) -> GoalTask<'a> {
        let rest = self.field(terminal).map_or(Rest::Straight, Rest::StraightFacing);
        self.to(target_m, self.config.step_s / self.config.costs.rest_speed_mps, rest)
    }

    fn to(&self, at_m: [f64; 2], distance_s_per_m: f64, rest: Rest<'a>) -> GoalTask<'a> {
        let at_cells = self.frame.cells(at_m);
        let [x_cells, y_cells] = at_cells.map(Constant::new);
        let cell_m = self.frame.cell_m;
        GoalTask {
            x_cells,
            y_cells,
            tolerance_square: Constant::new(0.0),
            step_s: Constant::new(self.config.step_s),
            distance_s: Constant::new(distance_s_per_m * cell_m),
            rest_s: Constant::new(cell_m / self.config.costs.rest_speed_mps),
            rest,
            window: self.window.filter(|window| window.leaves_out(at_cells)),
        }
    }

    fn field(&self, terminal: Terminal<'a>) -> Option<TerminalField<'a>> {
        match terminal {
            Terminal::StraightLine => None,
            Terminal::CostToGo(view) => TerminalField::new(view, self.geometry, self.turning_s_per_rad),
        }
    }
}

/// How samples are drawn around a plan, from no movement and with no key.
fn sampler<'a>(plan: &'a Plan, config: &Config, limits: &MotionLimits, mode: Mode) -> Sampler<'a> {
    let speed_max_mps = if mode == Mode::Onward { limits.high[0] } else { 0.0 };
    Sampler {
        steps: &plan.steps,
        kept_noise: [plan.correlation(); 2],
        kept_control: plan.kept_control(),
        low: limits.low.map(|value| value as f32),
        high: [speed_max_mps as f32, limits.high[1] as f32],
        change: match config.actuation {
            Actuation::Instant => [f32::INFINITY; 2],
            Actuation::Limited => limits.rates.map(|rate| (rate * config.step_s) as f32),
        },
        start: [0.0; 2],
        key: [0; 4],
    }
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
