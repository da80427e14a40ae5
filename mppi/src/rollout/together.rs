//! All rollouts side by side, a step at a time, for models that are asked for all vehicles at once.

use super::motion::{Leaving, Motion, Whole};
use super::stage::{PathTask, Stage};
use super::{Flight, Fly, Index, Scene, Task, look_up, store_costs};
use crate::chunk::Chunk;
use crate::cost::{Frame, StepCost};
use crate::kernel::{self, CHUNK, Kernel, Work};
use bicycle::lanes::{Instructions, Real, SPAN};
use bicycle::{GroundSample, LaneState, MotionStepper, Rates, StepInput, StepOutcome};
use std::f64::consts::TAU;

/// Rolls out all chunks.
pub(crate) struct RollTogether<'a, S, C> {
    pub(crate) scene: &'a Scene<'a, S, C>,
    pub(crate) chunks: &'a mut [Chunk],
}

impl<S: MotionStepper, C: StepCost> RollTogether<'_, S, C> {
    pub(crate) fn on(self, instructions: Instructions) {
        kernel::run(instructions, self);
    }
}

impl<S: MotionStepper, C: StepCost> Work for RollTogether<'_, S, C> {
    type Output = ();
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let Self { scene, chunks } = self;
        match &scene.task {
            Task::Goal(goal) => roll(kernel, scene, goal, chunks),
            Task::Path(path) => roll(kernel, scene, &PathTask(path), chunks),
        }
    }
}

fn roll<K: Kernel, P: MotionStepper, C: StepCost, S: Stage<K>>(
    kernel: K,
    scene: &Scene<'_, P, C>,
    stage: &S,
    chunks: &mut [Chunk],
) {
    match scene.leaning_start_rad {
        None => roll_packs::<K, P, C, S, Whole>(kernel, scene, stage, chunks),
        Some(_) => roll_packs::<K, P, C, S, Leaving>(kernel, scene, stage, chunks),
    }
}

fn roll_packs<K: Kernel, P: MotionStepper, C: StepCost, S: Stage<K>, M: Motion>(
    kernel: K,
    scene: &Scene<'_, P, C>,
    stage: &S,
    chunks: &mut [Chunk],
) {
    let index = Index::new(kernel, &scene.grid);
    let n_packs = CHUNK / K::WIDTH;
    let place = |number: usize| (number / n_packs, number % n_packs * K::WIDTH);
    let mut flights = vec![Flight::new(kernel, &scene.start); n_packs * chunks.len()];
    let mut outcomes = vec![StepOutcome::default(); CHUNK * chunks.len()];
    let mut inputs = Vec::with_capacity(outcomes.len());
    let mut asked = Vec::with_capacity(flights.len());
    for t in 0..chunks.first().map_or(0, |chunk| chunk.controls.len()) {
        inputs.clear();
        asked.clear();
        for (number, flight) in flights.iter().enumerate() {
            let (chunk, first) = place(number);
            let command =
                chunks[chunk].controls[t].each_ref().map(|row| Real(kernel, kernel.load(row, first)));
            let met = look_up::<K, P, C, M>(scene, &index, &flight.state);
            inputs.extend(spread(&flight.state, command, &met.ground, &scene.frame));
            asked.push((command, met));
        }
        scene.stepper.step_together(&inputs, &mut outcomes);
        let landed = outcomes.chunks_exact(K::WIDTH).zip(&asked);
        for (number, (flight, (outcomes, (command, met)))) in flights.iter_mut().zip(landed).enumerate() {
            let (chunk, first) = place(number);
            let Chunk { controls, trace, .. } = &mut chunks[chunk];
            let rates = land(flight, outcomes, &scene.frame);
            let fly = Fly { scene, index: &index, stage, controls: &controls[t], t };
            fly.arrive::<M>(flight, *command, (rates, met), first, trace.get_mut(t));
        }
    }
    for (number, flight) in flights.into_iter().enumerate() {
        let (chunk, first) = place(number);
        store_costs::<K, P, C, S, M>((scene, stage), flight, &mut chunks[chunk], first);
    }
}

/// A pack, vehicle by vehicle.
fn spread<K: Kernel>(
    state: &LaneState<K>,
    command: [Real<K>; 2],
    ground: &GroundSample<Real<K>>,
    frame: &Frame,
) -> impl Iterator<Item = StepInput> {
    let LaneState { x, y, turns, speed, steering } = *state;
    let (states, commands) = ([x, y, turns, speed, steering].map(numbers), command.map(numbers));
    let traction = [ground.linear_traction, ground.angular_traction].map(numbers);
    let [east, north] = ground.gradient.map(numbers);
    let class = numbers(ground.class);
    (0..K::WIDTH).map(move |lane| StepInput {
        state: frame.state(states.each_ref().map(|values| values[lane])),
        command: commands.each_ref().map(|values| values[lane]),
        ground: GroundSample {
            linear_traction: f64::from(traction[0][lane]),
            angular_traction: f64::from(traction[1][lane]),
            gradient: [east[lane], north[lane]].map(f64::from),
            class: f64::from(class[lane]),
        },
    })
}

/// Puts a pack where its vehicles have come to.
fn land<K: Kernel>(flight: &mut Flight<K>, outcomes: &[StepOutcome], frame: &Frame) -> Rates<K> {
    let kernel = flight.state.x.0;
    let pack = |of: &dyn Fn(&StepOutcome) -> f64| {
        let mut span = [0.0; SPAN];
        span.iter_mut().zip(outcomes).for_each(|(value, outcome)| *value = of(outcome) as f32);
        kernel.real_of_span(&span, 0)
    };
    let cells = |axis: usize| pack(&|outcome| frame.cells([outcome.state.x_m, outcome.state.y_m])[axis]);
    flight.state = LaneState {
        x: cells(0),
        y: cells(1),
        turns: pack(&|outcome| outcome.state.yaw_rad / TAU).wrap_turns(),
        speed: pack(&|outcome| outcome.state.speed_mps),
        steering: pack(&|outcome| outcome.state.turn),
    };
    Rates {
        speed: flight.state.speed,
        side_speed: kernel.real(0.0),
        yaw_rate: pack(&|outcome| outcome.yaw_rate_radps),
    }
}

/// The numbers of a pack.
fn numbers<K: Kernel>(pack: Real<K>) -> [f32; SPAN] {
    let mut span = [0.0; SPAN];
    pack.0.to_span(pack.1, &mut span, 0);
    span
}
