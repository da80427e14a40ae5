//! The rollouts: every sampled control sequence through the model over the risk map, and what it costs.
//!
//! Positions are kept in cells of the map and yaws in turns, so that the map index is a truncation. Pack after pack
//! of rollouts walks through all steps; a rollout that leaves the map is trapped on the border, where nothing moves.

use crate::chunk::Chunk;
use crate::diagnostics::CostTerm;
use crate::kernel::{CHUNK, Kernel, Row, Work};
use crate::objective::{ReferenceStep, TerminalField};
use bicycle::lanes::Real;
use bicycle::{GroundSample, LaneState, Stepper};
use traversability::{Ground, Risk};

/// Most numbers per rollout that the effects may carry from step to step.
pub(crate) const MAX_SLOTS: usize = 64;

/// Everything that all rollouts of an iteration share.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    /// The model in steps of the horizon, lengths in cells.
    pub(crate) stepper: &'a Stepper,
    pub(crate) grid: Grid<'a>,
    pub(crate) start: Start,
    /// What the effects remember at the start.
    pub(crate) slots: &'a [f32],
    pub(crate) prices: Prices,
    pub(crate) task: Task<'a>,
}

/// The risk map in numbers of cells.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'a> {
    pub(crate) n_rows: usize,
    pub(crate) n_cols: usize,
    pub(crate) n_yaws: usize,
    pub(crate) risks: &'a [Risk],
    pub(crate) ground: &'a [Ground],
}

/// Where all rollouts start: position in cells from the map's south-west corner, yaw in turns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) x_cells: f64,
    pub(crate) y_cells: f64,
    pub(crate) turns: f64,
    pub(crate) speed_mps: f64,
    pub(crate) steering_rad: f64,
}

/// What things cost, and limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prices {
    pub(crate) roll_max_rad: f64,
    pub(crate) pitch_max_rad: f64,
    /// Of a step over a limit of attitude [s].
    pub(crate) attitude_s: f64,
    pub(crate) lateral_max_mps2: f64,
    /// Of a step over the limit of lateral acceleration [s].
    pub(crate) lateral_s: f64,
    /// Of a step in reverse [s].
    pub(crate) reverse_s: f64,
}

impl Prices {
    fn has_manoeuvres(&self) -> bool {
        self.lateral_s > 0.0 || self.reverse_s > 0.0
    }
}

/// What the rollouts are to do.
#[derive(Clone, Copy)]
pub(crate) enum Task<'a> {
    /// Reach a point.
    Goal(GoalTask<'a>),
    /// Keep up with a point that moves along a path.
    Path(&'a [ReferenceStep]),
}

/// A point to reach, in cells.
#[derive(Clone, Copy)]
pub(crate) struct GoalTask<'a> {
    pub(crate) x_cells: f64,
    pub(crate) y_cells: f64,
    pub(crate) tolerance_cells: f64,
    /// Of a step on the way [s].
    pub(crate) step_s: f64,
    /// Of a cell of distance to the goal, per step [s].
    pub(crate) distance_s: f64,
    /// Of a cell of distance at the end [s].
    pub(crate) rest_s: f64,
    /// Time to go at the end instead of the straight line.
    pub(crate) field: Option<TerminalField<'a>>,
}

/// Rolls out one chunk.
pub(crate) struct RollOut<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) chunk: &'a mut Chunk,
}

impl Work for RollOut<'_> {
    type Output = ();
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let Self { scene, chunk } = self;
        match (scene.task, scene.stepper.has_effects(), scene.prices.has_manoeuvres()) {
            (Task::Goal(goal), false, false) => roll_chunk::<K, _, false, false>(kernel, scene, &goal, chunk),
            (Task::Goal(goal), false, true) => roll_chunk::<K, _, false, true>(kernel, scene, &goal, chunk),
            (Task::Goal(goal), true, _) => roll_chunk::<K, _, true, true>(kernel, scene, &goal, chunk),
            (Task::Path(path), _, _) => roll_chunk::<K, _, true, true>(kernel, scene, &PathTask(path), chunk),
        }
    }
}

#[inline(always)]
fn roll_chunk<K: Kernel, S: Stage<K>, const EFFECTS: bool, const MANOEUVRES: bool>(
    kernel: K,
    scene: &Scene<'_>,
    stage: &S,
    chunk: &mut Chunk,
) {
    if K::IN_FLIGHT == 2 {
        roll_packs::<K, S, 2, EFFECTS, MANOEUVRES>(kernel, scene, stage, chunk);
    } else {
        roll_packs::<K, S, 1, EFFECTS, MANOEUVRES>(kernel, scene, stage, chunk);
    }
}

/// One pack on its way. Aligned to a cache line, for what of it does not fit into registers.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Flight<K: Kernel> {
    state: LaneState<K>,
    /// Where the goal is not reached yet.
    under_way: K::Mask,
    /// Distance to the goal [cells], or nothing.
    distance: Real<K>,
    running: Real<K>,
    attitude: Real<K>,
    lateral: Real<K>,
    reverse: Real<K>,
}

impl<K: Kernel> Flight<K> {
    #[inline(always)]
    fn new(kernel: K, start: &Start) -> Self {
        let zero = kernel.real(0.0);
        let state = LaneState {
            x: kernel.real(start.x_cells),
            y: kernel.real(start.y_cells),
            turns: kernel.real(start.turns).wrap_turns(),
            speed: kernel.real(start.speed_mps),
            steering: kernel.real(start.steering_rad),
        };
        let under_way = zero.less(kernel.real(1.0));
        Self { state, under_way, distance: zero, running: zero, attitude: zero, lateral: zero, reverse: zero }
    }
}

/// What the effects of a pack carry from step to step.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Memory<K: Kernel>([K::Value; MAX_SLOTS]);

/// What a step and the end cost beside the limits.
trait Stage<K: Kernel> {
    fn step(&self, t: usize, flight: &mut Flight<K>);
    fn finish(&self, flight: &Flight<K>) -> Real<K>;
}

impl<K: Kernel> Stage<K> for GoalTask<'_> {
    #[inline(always)]
    fn step(&self, _t: usize, flight: &mut Flight<K>) {
        let kernel = flight.state.x.0;
        let dx = flight.state.x - kernel.real(self.x_cells);
        let dy = flight.state.y - kernel.real(self.y_cells);
        flight.distance = dx.mul_add(dx, dy * dy).sqrt();
        let cost = flight.distance.mul_add(kernel.real(self.distance_s), kernel.real(self.step_s));
        flight.running = flight.running.add_where(flight.under_way, cost);
        let away = kernel.real(self.tolerance_cells).less(flight.distance);
        flight.under_way = kernel.and(flight.under_way, away);
    }

    #[inline(always)]
    fn finish(&self, flight: &Flight<K>) -> Real<K> {
        let kernel = flight.distance.0;
        let rest = match &self.field {
            None => flight.distance * kernel.real(self.rest_s),
            Some(field) => field.seconds(flight.state.x, flight.state.y),
        };
        kernel.real(0.0).add_where(flight.under_way, rest)
    }
}

/// A moving point to keep up with.
struct PathTask<'a>(&'a [ReferenceStep]);

impl<K: Kernel> Stage<K> for PathTask<'_> {
    #[inline(always)]
    fn step(&self, t: usize, flight: &mut Flight<K>) {
        let (kernel, reference) = (flight.state.x.0, &self.0[t]);
        let dx = flight.state.x - kernel.real(reference.x_cells);
        let dy = flight.state.y - kernel.real(reference.y_cells);
        let [tx, ty] = reference.tangent.map(|value| kernel.real(value));
        let (along, across) = (dx.mul_add(tx, dy * ty), dy.mul_add(tx, -(dx * ty)));
        let along = along * along * kernel.real(reference.along_s);
        flight.running = flight.running + (across * across).mul_add(kernel.real(reference.across_s), along);
    }

    #[inline(always)]
    fn finish(&self, flight: &Flight<K>) -> Real<K> {
        flight.state.x.0.real(0.0)
    }
}

/// Numbers of the grid in every lane.
struct Index<K: Kernel> {
    last_col: Real<K>,
    last_row: Real<K>,
    n_yaws: Real<K>,
    last_yaw: Real<K>,
    cols: K::Bits,
    yaws: K::Bits,
}

impl<K: Kernel> Index<K> {
    #[inline(always)]
    fn new(kernel: K, grid: &Grid<'_>) -> Self {
        Self {
            last_col: kernel.real((grid.n_cols - 1) as f64),
            last_row: kernel.real((grid.n_rows - 1) as f64),
            n_yaws: kernel.real(grid.n_yaws as f64),
            last_yaw: kernel.real((grid.n_yaws - 1) as f64),
            cols: kernel.word(grid.n_cols as u32),
            yaws: kernel.word(grid.n_yaws as u32),
        }
    }

    /// Position in the ground array; poses beyond the map count as on its border.
    #[inline(always)]
    fn cell(&self, state: &LaneState<K>) -> K::Bits {
        let (kernel, zero) = (state.x.0, state.x.0.real(0.0));
        let col = kernel.truncate(state.x.clamp(zero, self.last_col).1);
        let row = kernel.truncate(state.y.clamp(zero, self.last_row).1);
        kernel.add_bits(kernel.mul_bits(row, self.cols), col)
    }

    /// Position in the risk array.
    #[inline(always)]
    fn risk(&self, cell: K::Bits, turns: Real<K>) -> K::Bits {
        let kernel = turns.0;
        let positive = turns.add_where(turns.less(kernel.real(0.0)), kernel.real(1.0));
        let yaw = kernel.truncate((positive * self.n_yaws).min(self.last_yaw).1);
        kernel.add_bits(kernel.mul_bits(cell, self.yaws), yaw)
    }
}

#[inline(always)]
fn roll_packs<K: Kernel, S: Stage<K>, const G: usize, const EFFECTS: bool, const MANOEUVRES: bool>(
    kernel: K,
    scene: &Scene<'_>,
    stage: &S,
    chunk: &mut Chunk,
) {
    let index = Index::new(kernel, &scene.grid);
    let mut memory = [Memory::<K>([kernel.real(0.0).1; MAX_SLOTS]); G];
    for first in (0..CHUNK).step_by(G * K::WIDTH) {
        let mut flights = [Flight::new(kernel, &scene.start); G];
        if EFFECTS {
            for pack in &mut memory {
                recall(kernel, scene.slots, pack);
            }
        }
        for (t, controls) in chunk.controls.iter().enumerate() {
            // Written out, because flights that a loop indexes would live in memory instead of registers.
            let fly = Fly { scene, index: &index, stage, controls, t };
            fly.step::<EFFECTS, MANOEUVRES>(&mut flights[0], &mut memory[0], first);
            if G == 2 {
                fly.step::<EFFECTS, MANOEUVRES>(&mut flights[1], &mut memory[1], first + K::WIDTH);
            }
        }
        settle(stage.finish(&flights[0]), &flights[0], chunk, first);
        if G == 2 {
            settle(stage.finish(&flights[1]), &flights[1], chunk, first + K::WIDTH);
        }
    }
}

/// What the packs in flight share in one step.
struct Fly<'a, K: Kernel, S: Stage<K>> {
    scene: &'a Scene<'a>,
    index: &'a Index<K>,
    stage: &'a S,
    controls: &'a [Row; 2],
    t: usize,
}

impl<K: Kernel, S: Stage<K>> Fly<'_, K, S> {
    #[inline(always)]
    fn step<const EFFECTS: bool, const MANOEUVRES: bool>(
        &self,
        flight: &mut Flight<K>,
        memory: &mut Memory<K>,
        first: usize,
    ) {
        let kernel = flight.state.x.0;
        let [speed, steering] = self.controls;
        let command = [Real(kernel, kernel.load(speed, first)), Real(kernel, kernel.load(steering, first))];
        advance::<K, EFFECTS, MANOEUVRES>(self.scene, self.index, flight, command, (memory, self.t));
        self.stage.step(self.t, flight);
    }
}

/// Every rollout starts with the same memory.
#[inline(always)]
fn recall<K: Kernel>(kernel: K, slots: &[f32], memory: &mut Memory<K>) {
    for (value, slot) in memory.0.iter_mut().zip(slots) {
        *value = kernel.real(f64::from(*slot)).1;
    }
}

/// One step of one pack: the model over the ground where it stands, and the limits.
#[inline(always)]
fn advance<K: Kernel, const EFFECTS: bool, const MANOEUVRES: bool>(
    scene: &Scene<'_>,
    index: &Index<K>,
    flight: &mut Flight<K>,
    command: [Real<K>; 2],
    (memory, t): (&mut Memory<K>, usize),
) {
    let kernel = command[0].0;
    let cell = index.cell(&flight.state);
    let risks = kernel.risks(scene.grid.risks, index.risk(cell, flight.state.turns));
    let [linear_traction, angular_traction, roll, pitch] = risks.map(|value| Real(kernel, value));
    let zero = kernel.real(0.0);
    let mut ground = GroundSample { linear_traction, angular_traction, gradient: [zero; 2], class: zero };
    let rates = if EFFECTS {
        if scene.stepper.uses_ground() {
            let [east, north, class] =
                kernel.grounds(scene.grid.ground, cell).map(|value| Real(kernel, value));
            (ground.gradient, ground.class) = ([east, north], class);
        }
        scene.stepper.step(&mut flight.state, command, &ground, &mut memory.0, t)
    } else {
        scene.stepper.step_bare(&mut flight.state, command, &ground)
    };
    let prices = &scene.prices;
    let tilted = kernel
        .or(roll.exceeds(kernel.real(prices.roll_max_rad)), pitch.exceeds(kernel.real(prices.pitch_max_rad)));
    let tilted = kernel.and(tilted, flight.under_way);
    flight.attitude = flight.attitude.add_where(tilted, kernel.real(prices.attitude_s));
    if MANOEUVRES {
        let sideways = (rates.speed * rates.yaw_rate).abs().exceeds(kernel.real(prices.lateral_max_mps2));
        let sideways = kernel.and(sideways, flight.under_way);
        flight.lateral = flight.lateral.add_where(sideways, kernel.real(prices.lateral_s));
        let backwards = kernel.and(rates.speed.less(zero), flight.under_way);
        flight.reverse = flight.reverse.add_where(backwards, kernel.real(prices.reverse_s));
    }
}

/// Writes the costs of a pack that has arrived.
#[inline(always)]
fn settle<K: Kernel>(terminal: Real<K>, flight: &Flight<K>, chunk: &mut Chunk, first: usize) {
    let kernel = terminal.0;
    let control = Real(kernel, kernel.load(&chunk.terms[CostTerm::Control as usize], first));
    let mut total = control;
    for (term, value) in [
        (CostTerm::Running, flight.running),
        (CostTerm::Attitude, flight.attitude),
        (CostTerm::Lateral, flight.lateral),
        (CostTerm::Reverse, flight.reverse),
        (CostTerm::Terminal, terminal),
    ] {
        total = total + value;
        kernel.store(&mut chunk.terms[term as usize], first, value.1);
    }
    kernel.store(&mut chunk.costs, first, total.1);
}

#[cfg(test)]
mod tests;
