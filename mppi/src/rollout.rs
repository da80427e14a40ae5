//! The rollouts: every sampled control sequence through the model over the risk map, and what it costs.
//!
//! Positions are kept in cells of the map and yaws in turns, so that the map index is a truncation. Pack after pack
//! of rollouts walks through all steps; a rollout that leaves the map creeps on, as on
//! any ground that lets nothing through. On the way to a goal beyond the map its time ends there: what is left
//! counts from the border on.

mod motion;
mod stage;
pub(crate) mod together;
mod window;

use crate::chunk::Chunk;
use crate::cost::{Frame, Place, Step, StepCost};
use crate::diagnostics::CostTerm;
use crate::judgement::TRACTION_LEAST;
use crate::kernel::{self, CHUNK, Kernel, Row, Work};
use crate::objective::{ReferenceStep, TerminalField};
use crate::trace::TraceRows;
use bicycle::lanes::{Constant, Instructions, Real};
use bicycle::{Extent, GroundSample, LaneState, MotionStepper, Rates};
use motion::{Bare, Leaving, Motion, Plain, Whole};
use stage::{Grip, Lateral, Overspeed, PathTask, Reverse, Stage};
use traversability::{FrictionLimit, Ground, Risk, SpeedLimit};
pub(crate) use window::Window;

/// Most numbers per rollout that the effects may carry from step to step.
pub(crate) const MAX_SLOTS: usize = 64;

/// Everything that all rollouts of an iteration share.
pub(crate) struct Scene<'a, S, C> {
    /// The model in steps of the horizon, lengths in cells.
    pub(crate) stepper: &'a S,
    pub(crate) grid: Grid<'a>,
    pub(crate) start: Start,
    /// |roll| and |pitch| up to which the vehicle may leave, if it stands beyond a limit [rad].
    pub(crate) leaning_start_rad: Option<[Constant; 2]>,
    /// What the effects remember at the start.
    pub(crate) slots: &'a [f32],
    pub(crate) prices: Prices,
    pub(crate) task: Task<'a>,
    /// What the user adds to the cost of a step.
    pub(crate) cost: &'a C,
    pub(crate) frame: Frame,
    /// Whether it is to be kept where rollouts end.
    pub(crate) keeps_ends: bool,
}

impl<S, C> Scene<'_, S, C> {
    /// The same with another cost.
    pub(crate) fn with_cost<'b, D>(&'b self, cost: &'b D) -> Scene<'b, S, D> {
        let Self { stepper, grid, start, leaning_start_rad, slots, prices, task, frame, keeps_ends, .. } =
            *self;
        Scene { stepper, grid, start, leaning_start_rad, slots, prices, task, cost, frame, keeps_ends }
    }
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
    /// Steering angle [rad] or yaw rate [rad/s].
    pub(crate) turn: f64,
}

/// What things cost, and limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prices {
    pub(crate) roll_max_rad: Constant,
    pub(crate) pitch_max_rad: Constant,
    /// Of a step over a limit of attitude [s].
    pub(crate) attitude_s: Constant,
    pub(crate) lateral_max_mps2: Constant,
    /// Of a step over the limit of lateral acceleration [s].
    pub(crate) lateral_s: Constant,
    /// Of a step in reverse [s].
    pub(crate) reverse_s: Constant,
    /// Of a step that asks twice as much of the ground as it is known to hold [s].
    pub(crate) grip_s: Constant,
    /// Of a step at twice the fastest speed that the map allows [s].
    pub(crate) overspeed_s: Constant,
}

impl Prices {
    fn has_manoeuvres(&self) -> bool {
        self.lateral_s.value() > 0.0 || self.reverse_s.value() > 0.0 || self.has_overspeed()
    }

    fn has_overspeed(&self) -> bool {
        self.overspeed_s.value() > 0.0
    }

    fn has_grip(&self) -> bool {
        self.grip_s.value() > 0.0
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
    pub(crate) x_cells: Constant,
    pub(crate) y_cells: Constant,
    /// Square of the distance at which it is reached, with the sign of the distance [cells2].
    pub(crate) tolerance_square: Constant,
    /// Of a step on the way [s].
    pub(crate) step_s: Constant,
    /// Of a cell of distance to the goal, per step [s].
    pub(crate) distance_s: Constant,
    /// Of a cell of distance at the end [s].
    pub(crate) rest_s: Constant,
    pub(crate) rest: Rest<'a>,
    /// Where time counts, if some rollouts leave it.
    pub(crate) window: Option<&'a Window>,
}

/// What the rest of the way costs where a rollout ends.
#[derive(Clone, Copy)]
pub(crate) enum Rest<'a> {
    /// The straight line.
    Straight,
    /// The time of the field, and to turn to where it leads.
    Field(TerminalField<'a>),
    /// The straight line, and to turn to where the field leads.
    StraightFacing(TerminalField<'a>),
}

/// One chunk to roll out, and on which instructions.
pub struct Job<'a, S, C> {
    pub(crate) instructions: Instructions,
    pub(crate) scene: &'a Scene<'a, S, C>,
    pub(crate) chunk: &'a mut Chunk,
}

impl<S: MotionStepper, C: StepCost> Job<'_, S, C> {
    pub(crate) fn run(self) {
        kernel::run(self.instructions, RollOut { scene: self.scene, chunk: self.chunk });
    }
}

/// Rolls out one chunk.
pub(crate) struct RollOut<'a, S, C> {
    pub(crate) scene: &'a Scene<'a, S, C>,
    pub(crate) chunk: &'a mut Chunk,
}

impl<S: MotionStepper, C: StepCost> Work for RollOut<'_, S, C> {
    type Output = ();
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let Self { scene, chunk } = self;
        match &scene.task {
            Task::Goal(goal) => roll_to(kernel, scene, goal, chunk),
            Task::Path(path) => roll_along(kernel, scene, &PathTask(path), chunk),
        }
    }
}

/// To a goal, with no more of a step than the model and the prices ask for.
#[inline(always)]
fn roll_to<K: Kernel, P: MotionStepper, C: StepCost>(
    kernel: K,
    scene: &Scene<'_, P, C>,
    goal: &GoalTask<'_>,
    chunk: &mut Chunk,
) {
    let extent = scene.stepper.extent();
    let is_plain = extent != Extent::Whole && scene.leaning_start_rad.is_none() && !scene.prices.has_grip();
    if is_plain && extent == Extent::Bare && !scene.prices.has_manoeuvres() {
        roll_chunk::<K, P, C, _, Bare>(kernel, scene, goal, chunk);
    } else if is_plain {
        roll_chunk::<K, P, C, _, Plain>(kernel, scene, goal, chunk);
    } else {
        roll_along(kernel, scene, goal, chunk);
    }
}

/// Whatever the task and the model.
#[inline(always)]
fn roll_along<K: Kernel, P: MotionStepper, C: StepCost, S: Stage<K>>(
    kernel: K,
    scene: &Scene<'_, P, C>,
    stage: &S,
    chunk: &mut Chunk,
) {
    match scene.leaning_start_rad {
        None => roll_chunk::<K, P, C, S, Whole>(kernel, scene, stage, chunk),
        Some(_) => roll_chunk::<K, P, C, S, Leaving>(kernel, scene, stage, chunk),
    }
}

#[inline(always)]
fn roll_chunk<K: Kernel, P: MotionStepper, C: StepCost, S: Stage<K>, M: Motion>(
    kernel: K,
    scene: &Scene<'_, P, C>,
    stage: &S,
    chunk: &mut Chunk,
) {
    if K::IN_FLIGHT == 2 {
        roll_packs::<K, P, C, S, M, 2>(kernel, scene, stage, chunk);
    } else {
        roll_packs::<K, P, C, S, M, 1>(kernel, scene, stage, chunk);
    }
}

/// One pack on its way. Aligned to a cache line, for what of it does not fit into registers.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Flight<K: Kernel> {
    state: LaneState<K>,
    /// Where the goal is not reached yet.
    under_way: K::Mask,
    running: Real<K>,
    /// Steps beyond a limit of attitude.
    n_tilted: Real<K>,
    /// Of them, those that count as breaking it: all, but for a vehicle that leaves.
    n_broken: Real<K>,
    /// 1 until a vehicle that stood beyond a limit has left.
    leaving: Real<K>,
    lateral: Real<K>,
    reverse: Real<K>,
    /// What the user's cost comes to.
    added: Real<K>,
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
            steering: kernel.real(start.turn),
        };
        let under_way = zero.less(kernel.real(1.0));
        Self {
            state,
            under_way,
            running: zero,
            n_tilted: zero,
            n_broken: zero,
            leaving: kernel.real(1.0),
            lateral: zero,
            reverse: zero,
            added: zero,
        }
    }
}

/// What the effects of a pack carry from step to step.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Memory<K: Kernel>([K::Value; MAX_SLOTS]);

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
        let kernel = state.x.0;
        let col = kernel.truncate_within(state.x.1, self.last_col.1);
        let row = kernel.truncate_within(state.y.1, self.last_row.1);
        kernel.add_bits(kernel.mul_bits(row, self.cols), col)
    }

    /// Position in the risk array.
    #[inline(always)]
    fn risk(&self, cell: K::Bits, turns: Real<K>) -> K::Bits {
        let kernel = turns.0;
        let positive = turns.add_where(turns.less(kernel.real(0.0)), kernel.real(1.0));
        let yaw = kernel.truncate_up_to((positive * self.n_yaws).1, self.last_yaw.1);
        kernel.add_bits(kernel.mul_bits(cell, self.yaws), yaw)
    }
}

#[inline(always)]
fn roll_packs<K: Kernel, P: MotionStepper, C: StepCost, S: Stage<K>, M: Motion, const G: usize>(
    kernel: K,
    scene: &Scene<'_, P, C>,
    stage: &S,
    chunk: &mut Chunk,
) {
    let index = Index::new(kernel, &scene.grid);
    let mut memory = [Memory::<K>([kernel.real(0.0).1; MAX_SLOTS]); G];
    for first in (0..CHUNK).step_by(G * K::WIDTH) {
        let mut flights = [Flight::new(kernel, &scene.start); G];
        if M::HAS_EFFECTS {
            for pack in &mut memory {
                recall(kernel, scene.slots, pack);
            }
        }
        for (t, controls) in chunk.controls.iter().enumerate() {
            // Written out, because flights that a loop indexes would live in memory instead of registers.
            let fly = Fly { scene, index: &index, stage, controls, t };
            let mut trace = if C::KEEPS_STEPS { chunk.trace.get_mut(t) } else { None };
            fly.step::<M>(&mut flights[0], &mut memory[0], first, trace.as_deref_mut());
            if G == 2 {
                fly.step::<M>(&mut flights[1], &mut memory[1], first + K::WIDTH, trace);
            }
        }
        store_costs::<K, P, C, S, M>((scene, stage), flights[0], chunk, first);
        if G == 2 {
            store_costs::<K, P, C, S, M>((scene, stage), flights[1], chunk, first + K::WIDTH);
        }
    }
}

/// What a pack meets where a step begins.
struct Met<K: Kernel> {
    risk: [Real<K>; 4],
    ground: GroundSample<Real<K>>,
    /// Friction that the ground is known to hold [-].
    friction: Real<K>,
    /// Fastest that it may be driven over [m/s].
    fastest_mps: Real<K>,
}

/// What the packs in flight share in one step.
struct Fly<'a, K: Kernel, P, C, S: Stage<K>> {
    scene: &'a Scene<'a, P, C>,
    index: &'a Index<K>,
    stage: &'a S,
    controls: &'a [Row; 2],
    t: usize,
}

impl<K: Kernel, P: MotionStepper, C: StepCost, S: Stage<K>> Fly<'_, K, P, C, S> {
    #[inline(always)]
    fn step<M: Motion>(
        &self,
        flight: &mut Flight<K>,
        memory: &mut Memory<K>,
        first: usize,
        trace: Option<&mut TraceRows>,
    ) {
        let kernel = flight.state.x.0;
        let command = self.controls.each_ref().map(|row| Real(kernel, kernel.load(row, first)));
        let met = look_up::<K, P, C, M>(self.scene, self.index, &flight.state);
        let rates = M::step(self.scene.stepper, &mut flight.state, command, &met.ground, (memory, self.t));
        self.arrive::<M>(flight, command, (rates, &met), first, trace);
    }

    /// What the step comes to, whose end is where the flight is now.
    #[inline(always)]
    fn arrive<M: Motion>(
        &self,
        flight: &mut Flight<K>,
        command: [Real<K>; 2],
        (rates, met): (Rates<K>, &Met<K>),
        first: usize,
        trace: Option<&mut TraceRows>,
    ) {
        watch_attitude::<K, P, C, M>(self.scene, flight, [met.risk[2], met.risk[3]]);
        let place = Place { state: flight.state, frame: &self.scene.frame };
        let step = Step { t: self.t, place, rates, command, risk: met.risk };
        if C::KEEPS_STEPS
            && let Some(rows) = trace
        {
            keep(&step, flight.under_way, rows, first);
        }
        if M::HAS_EFFECTS && self.scene.prices.has_grip() {
            let grip = Grip { price_s: self.scene.prices.grip_s, met };
            flight.lateral = flight.lateral.add_where(flight.under_way, grip.step(&step));
        }
        if M::HAS_MANOEUVRES && self.scene.prices.has_overspeed() {
            let overspeed = Overspeed { price_s: self.scene.prices.overspeed_s, met };
            flight.lateral = flight.lateral.add_where(flight.under_way, overspeed.step(&step));
        }
        self.pay::<M>(flight, &step);
    }

    /// What the step costs, which counts until the goal is reached.
    #[inline(always)]
    fn pay<M: Motion>(&self, flight: &mut Flight<K>, step: &Step<'_, K>) {
        let under_way = flight.under_way;
        if M::HAS_MANOEUVRES {
            let Prices { lateral_max_mps2: most_mps2, lateral_s, reverse_s, .. } = self.scene.prices;
            let (lateral, reverse) =
                (Lateral { most_mps2, price_s: lateral_s }, Reverse { price_s: reverse_s });
            flight.lateral = flight.lateral.add_where(under_way, lateral.step(step));
            flight.reverse = flight.reverse.add_where(under_way, reverse.step(step));
        }
        flight.running = flight.running.add_where(under_way, self.stage.step(step));
        if !C::IS_NOTHING {
            flight.added = flight.added.add_where(under_way, self.scene.cost.step(step));
        }
        flight.under_way = self.stage.goes_on(step, under_way);
    }
}

/// Keeps a step of a pack for who looks at it later.
#[inline(always)]
fn keep<K: Kernel>(step: &Step<'_, K>, under_way: K::Mask, rows: &mut TraceRows, first: usize) {
    let kernel = step.lanes();
    let LaneState { x, y, turns, speed, steering } = step.place.state;
    for (row, value) in rows.state.iter_mut().zip([x, y, turns, speed, steering]) {
        kernel.store(row, first, value.1);
    }
    for (row, value) in rows.rates.iter_mut().zip([step.rates.speed, step.rates.yaw_rate]) {
        kernel.store(row, first, value.1);
    }
    for (row, value) in rows.risk.iter_mut().zip(step.risk) {
        kernel.store(row, first, value.1);
    }
    let counts = kernel.real(0.0).add_where(under_way, kernel.real(1.0));
    kernel.store(&mut rows.under_way, first, counts.1);
}

/// Every rollout starts with the same memory.
#[inline(always)]
fn recall<K: Kernel>(kernel: K, slots: &[f32], memory: &mut Memory<K>) {
    for (value, slot) in memory.0.iter_mut().zip(slots) {
        *value = kernel.real(f64::from(*slot)).1;
    }
}

/// The risk where a pack stands, and the ground that its next step drives on.
#[inline(always)]
fn look_up<K: Kernel, P: MotionStepper, C, M: Motion>(
    scene: &Scene<'_, P, C>,
    index: &Index<K>,
    state: &LaneState<K>,
) -> Met<K> {
    let kernel = state.x.0;
    let cell = index.cell(state);
    let risk = kernel.risks(scene.grid.risks, index.risk(cell, state.turns)).map(|value| Real(kernel, value));
    let least = kernel.real_single(TRACTION_LEAST);
    // In this order NaN stays NaN.
    let (linear_traction, angular_traction) = (least.max(risk[0]), least.max(risk[1]));
    let zero = kernel.real(0.0);
    let ground = GroundSample { linear_traction, angular_traction, gradient: [zero; 2], class: zero };
    let friction = kernel.real(f64::from(FrictionLimit::UNLIMITED));
    let fastest_mps = kernel.real_single(SpeedLimit::UNLIMITED_MPS);
    let mut met = Met { risk, ground, friction, fastest_mps };
    if M::HAS_MANOEUVRES && scene.prices.has_overspeed() {
        met.fastest_mps = Real(kernel, kernel.fastest_mps(scene.grid.ground, cell));
    }
    if M::HAS_EFFECTS && (scene.stepper.uses_ground() || scene.prices.has_grip()) {
        let grounds = kernel.grounds(scene.grid.ground, cell).map(|value| Real(kernel, value));
        let [east, north, class, friction] = grounds;
        (met.ground.gradient, met.ground.class, met.friction) = ([east, north], class, friction);
    }
    met
}

/// Counts the poses beyond a limit. A vehicle that stands beyond one may leave: its first poses break a limit only where
/// the ground leans beyond it and more than where it stands. The same rule as [`crate::judgement::Judge::breaks_limits`].
#[inline(always)]
fn watch_attitude<K: Kernel, P, C, M: Motion>(
    scene: &Scene<'_, P, C>,
    flight: &mut Flight<K>,
    [roll, pitch]: [Real<K>; 2],
) {
    let kernel = roll.0;
    let (one, prices) = (kernel.real(1.0), &scene.prices);
    let [roll_max, pitch_max] =
        [prices.roll_max_rad, prices.pitch_max_rad].map(|limit| Real::constant(kernel, limit));
    let beyond = kernel.or(roll.exceeds(roll_max), pitch.exceeds(pitch_max));
    let tilted = kernel.and(beyond, flight.under_way);
    flight.n_tilted = flight.n_tilted.add_where(tilted, one);
    if let Some(start) = scene.leaning_start_rad.filter(|_| M::IS_LEAVING) {
        let [start_roll, start_pitch] = start.map(|angle| Real::constant(kernel, angle));
        let added = kernel.real(f64::from(Risk::BLOCKED_RAD));
        let open = roll.less(added);
        let [roll, pitch] = [roll, pitch].map(|angle| angle.or_else(open, angle - added));
        let worse = kernel.or(roll.exceeds(start_roll), pitch.exceeds(start_pitch));
        let counts = kernel.or(worse, flight.leaving.less(one));
        flight.n_broken = flight.n_broken.add_where(kernel.and(tilted, counts), one);
        flight.leaving = flight.leaving.or_else(beyond, kernel.real(0.0));
    }
}

/// Writes the costs of a pack that has arrived.
#[inline(always)]
fn store_costs<K: Kernel, P, C: StepCost, S: Stage<K>, M: Motion>(
    (scene, stage): (&Scene<'_, P, C>, &S),
    flight: Flight<K>,
    chunk: &mut Chunk,
    first: usize,
) {
    let (kernel, end) = (flight.running.0, Place { state: flight.state, frame: &scene.frame });
    let terminal = kernel.real(0.0).add_where(flight.under_way, stage.finish(&end));
    let control = Real(kernel, kernel.load(&chunk.terms[CostTerm::Control as usize], first));
    let mut total = control;
    for (term, value) in [
        (CostTerm::Running, flight.running),
        (CostTerm::Attitude, flight.n_tilted * Real::constant(kernel, scene.prices.attitude_s)),
        (CostTerm::Lateral, flight.lateral),
        (CostTerm::Reverse, flight.reverse),
        (CostTerm::Terminal, terminal),
    ] {
        total = total + value;
        kernel.store(&mut chunk.terms[term as usize], first, value.1);
    }
    if !C::IS_NOTHING {
        let added = flight.added.add_where(flight.under_way, scene.cost.end(&end));
        total = total + added;
        kernel.store(&mut chunk.terms[CostTerm::Added as usize], first, added.1);
    }
    if scene.keeps_ends {
        let LaneState { x, y, turns, speed, steering } = flight.state;
        for (row, value) in chunk.ends.iter_mut().zip([x, y, turns, speed, steering]) {
            kernel.store(row, first, value.1);
        }
    }
    let n_broken = if M::IS_LEAVING { flight.n_broken } else { flight.n_tilted };
    kernel.store(&mut chunk.n_broken, first, n_broken.1);
    kernel.store(&mut chunk.costs, first, total.1);
}

#[cfg(test)]
mod tests;
