//! Rollouts against a plain f64 loop over equation 2 and the map's own lookup, on every instruction set.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod prices;
mod skid_steer;

use super::*;
use crate::cost_to_go::{CostToGoView, N_HEADINGS};
use crate::kernel;
use bicycle::lanes::{Constant, Instructions};
use bicycle::{Command, Effect, Limits, Model, State, Stepper};
use std::f64::consts::{PI, TAU};
use traversability::{FrictionLimit, GridGeometry, Ground, RiskMap, SpeedLimit};

const N_STEPS: usize = 40;
const STEP_S: f64 = 0.1;
const WHEELBASE_M: f64 = 2.0;
/// East, north [m], yaw [rad].
const START: [f64; 3] = [1.2, -1.9, 0.6];
const GOAL_M: [f64; 2] = [2.6, -1.2];

fn machines() -> Vec<Instructions> {
    Instructions::all().collect()
}

fn model_limits() -> Limits {
    Limits {
        speed_max_mps: 3.0,
        reverse_speed_max_mps: 1.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 1.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    }
}

fn stepper(resolution_m: f64) -> Stepper {
    let model = Model { wheelbase_m: WHEELBASE_M, limits: model_limits(), effects: Vec::new() };
    Stepper::new(&model, STEP_S, resolution_m).with_instant_actuators()
}

/// Ground whose risk changes by cell and yaw.
fn map() -> RiskMap {
    let mut map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    map.fill(|risks, _| {
        for (index, risk) in risks.iter_mut().enumerate() {
            let wave = |factor: usize| ((index * factor) % 101) as f32 / 100.0;
            *risk = Risk {
                linear_traction: 0.5 + 0.5 * wave(7),
                angular_traction: 0.4 + 0.6 * wave(13),
                roll_rad: 0.55 * wave(29),
                pitch_rad: 0.53 * wave(43),
            };
        }
    });
    map
}

fn grid(map: &RiskMap) -> Grid<'_> {
    let view = map.view();
    let GridGeometry { n_rows, n_cols, .. } = view.geometry;
    Grid { n_rows, n_cols, n_yaws: view.n_yaws, risks: view.risks, ground: view.ground }
}

const PRICES: Prices = Prices {
    roll_max_rad: Constant::new(0.5),
    pitch_max_rad: Constant::new(0.5),
    attitude_s: Constant::new(10.0),
    lateral_max_mps2: Constant::new(1.0),
    lateral_s: Constant::new(3.0),
    reverse_s: Constant::new(0.2),
    grip_s: Constant::new(0.0),
    overspeed_s: Constant::new(0.0),
};

/// Controls that differ from lane to lane and over time.
fn control(lane: usize, t: usize) -> [f64; 2] {
    let phase = lane as f64 * 0.37;
    [1.2 + 1.7 * (0.13 * t as f64 + phase).sin(), 0.45 * (0.21 * t as f64 + 2.0 * phase).cos()]
        .map(|value| f64::from(value as f32))
}

fn chunk() -> Chunk {
    let mut chunk = Chunk::new(N_STEPS);
    for (t, rows) in chunk.controls.iter_mut().enumerate() {
        for lane in 0..CHUNK {
            let [speed, steering] = control(lane, t);
            (rows[0].0[lane], rows[1].0[lane]) = (speed as f32, steering as f32);
        }
    }
    chunk
}

/// Terms of one rollout in f64, and how near it came to a place where rounding decides: a cell's or bin's edge.
fn reference(map: &RiskMap, lane: usize, distance_s_per_m: f64) -> ([f64; CostTerm::COUNT], f64) {
    let view = map.view();
    let [mut x, mut y, mut yaw] = START;
    let mut terms = [0.0; CostTerm::COUNT];
    let mut margin = f64::INFINITY;
    for t in 0..N_STEPS {
        let [v, delta] = control(lane, t);
        let risk = view.risk_at(x, y, yaw);
        for place in [x / 0.5, y / 0.5, yaw / std::f64::consts::TAU * 13.0] {
            margin = margin.min((place - place.round()).abs());
        }
        let yaw_rate = f64::from(risk.angular_traction) * v * delta.tan() / WHEELBASE_M;
        x += STEP_S * f64::from(risk.linear_traction) * v * yaw.cos();
        y += STEP_S * f64::from(risk.linear_traction) * v * yaw.sin();
        yaw += STEP_S * yaw_rate;
        let tilted = f64::from(risk.roll_rad) > 0.5 || f64::from(risk.pitch_rad) > 0.5;
        terms[CostTerm::Attitude as usize] += if tilted { 10.0 } else { 0.0 };
        terms[CostTerm::Lateral as usize] += if (v * yaw_rate).abs() > 1.0 { 3.0 } else { 0.0 };
        margin = margin.min(((v * yaw_rate).abs() - 1.0).abs());
        terms[CostTerm::Reverse as usize] += if v < 0.0 { 0.2 } else { 0.0 };
        let distance_m = (x - GOAL_M[0]).hypot(y - GOAL_M[1]);
        terms[CostTerm::Running as usize] += STEP_S + distance_s_per_m * distance_m;
        margin = margin.min((distance_m - 0.5).abs());
        if distance_m <= 0.5 {
            return (terms, margin);
        }
    }
    terms[CostTerm::Terminal as usize] = (x - GOAL_M[0]).hypot(y - GOAL_M[1]) / 2.0;
    (terms, margin)
}

fn goal<'a>(map: &RiskMap, distance_s_per_m: f64, rest: Rest<'a>) -> GoalTask<'a> {
    let corner_m = map.geometry().south_west_m();
    GoalTask {
        x_cells: Constant::new((GOAL_M[0] - corner_m[0]) / 0.5),
        y_cells: Constant::new((GOAL_M[1] - corner_m[1]) / 0.5),
        tolerance_square: Constant::new(1.0),
        step_s: Constant::new(STEP_S),
        distance_s: Constant::new(0.5 * distance_s_per_m),
        rest_s: Constant::new(0.5 / 2.0),
        rest,
        window: None,
    }
}

fn scene<'a>(map: &'a RiskMap, stepper: &'a Stepper, task: Task<'a>) -> Scene<'a, Stepper, ()> {
    let corner_m = map.geometry().south_west_m();
    let start = Start {
        x_cells: (START[0] - corner_m[0]) / 0.5,
        y_cells: (START[1] - corner_m[1]) / 0.5,
        turns: START[2] / std::f64::consts::TAU,
        speed_mps: 0.0,
        turn: 0.0,
    };
    Scene {
        stepper,
        grid: grid(map),
        start,
        leaning_start_rad: None,
        slots: &[],
        prices: PRICES,
        task,
        cost: &(),
        frame: Frame { corner_m, cell_m: 0.5 },
        keeps_ends: false,
    }
}

/// Lanes whose f64 path comes within 1e-4 of an edge are left out: there the last bit decides.
#[test]
fn rollouts_cost_what_the_plain_loop_says() {
    let (map, stepper) = (map(), stepper(0.5));
    for distance_s_per_m in [0.0, 0.3] {
        let task = Task::Goal(goal(&map, distance_s_per_m, Rest::Straight));
        let scene = scene(&map, &stepper, task);
        for machine in machines() {
            let mut chunk = chunk();
            kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
            let (mut n_compared, mut n_arrived) = (0, 0);
            for lane in 0..CHUNK {
                let (expected, margin) = reference(&map, lane, distance_s_per_m);
                if margin < 1e-4 {
                    continue;
                }
                n_compared += 1;
                n_arrived += usize::from(expected[CostTerm::Terminal as usize] == 0.0);
                for (row, expected) in chunk.terms.iter().zip(expected) {
                    assert!((f64::from(row.0[lane]) - expected).abs() < 2e-3, "{machine:?} lane {lane}");
                }
                let total: f64 = expected.iter().sum();
                assert!((f64::from(chunk.costs.0[lane]) - total).abs() < 5e-3);
            }
            assert!(n_compared > 40 && n_arrived > 0, "{n_compared} compared, {n_arrived} arrived");
        }
    }
}

/// Straight ahead at 1 m/s on firm ground, 2 m to the goal with a tolerance of 0.5 m: 15 steps of 0.1 s count, and
/// nothing that comes after.
#[test]
fn the_goal_latches() {
    let map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    let stepper = stepper(0.5);
    let corner_m = map.geometry().south_west_m();
    let task = GoalTask {
        x_cells: Constant::new((START[0] + 2.01 - corner_m[0]) / 0.5),
        y_cells: Constant::new((START[1] - corner_m[1]) / 0.5),
        ..goal(&map, 0.0, Rest::Straight)
    };
    let mut scene = scene(&map, &stepper, Task::Goal(task));
    scene.start.turns = 0.0;
    for machine in machines() {
        let mut chunk = Chunk::new(N_STEPS);
        chunk.controls.iter_mut().for_each(|rows| rows[0].0 = [1.0; CHUNK]);
        kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
        // 1.51 m until the rim: reached with the 16th step.
        assert!(chunk.costs.0.iter().all(|cost| (cost - 1.6).abs() < 1e-4), "{}", chunk.costs.0[0]);
    }
}

/// A field that is linear in x and y is interpolated exactly; the terminal cost is its value where the rollout ends, and
/// R (e - sin e) for the angle e from its heading to where the field falls, [-0.3, 0.2].
#[test]
fn the_cost_to_go_field_is_interpolated_between_cells() {
    let map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    let geometry = GridGeometry::centred(0.4, 90, 80, 1.3, -1.7);
    let linear = |[x_m, y_m]: [f64; 2]| 7.0 + 0.3 * x_m - 0.2 * y_m;
    let seconds: Vec<f32> =
        (0..geometry.n_cells()).map(|index| linear(geometry.centre_m(geometry.cell(index))) as f32).collect();
    const TURNING_S_PER_RAD: f64 = 2.5;
    let view = CostToGoView { geometry, seconds: &seconds, turning_s: &[] };
    let field = TerminalField::new(view, map.geometry(), TURNING_S_PER_RAD).unwrap();
    let stepper = stepper(0.5);
    let task = GoalTask { x_cells: Constant::new(1e6), ..goal(&map, 0.0, Rest::Field(field)) };
    let scene = scene(&map, &stepper, Task::Goal(task));
    for machine in machines() {
        let mut chunk = chunk();
        kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
        for lane in 0..CHUNK {
            let [mut x, mut y, mut yaw] = START;
            for t in 0..N_STEPS {
                let [v, delta] = control(lane, t);
                x += STEP_S * v * yaw.cos();
                y += STEP_S * v * yaw.sin();
                yaw += STEP_S * v * delta.tan() / WHEELBASE_M;
            }
            let found = f64::from(chunk.terms[CostTerm::Terminal as usize].0[lane]);
            let cosine = (-0.3 * yaw.cos() + 0.2 * yaw.sin()) / 0.3_f64.hypot(0.2);
            let expected = linear([x, y]) + TURNING_S_PER_RAD * (cosine.acos() - cosine.acos().sin());
            assert!((found - expected).abs() < 1.5e-3, "{found} {expected}");
        }
    }
}

/// What turning adds is looked up where the rollout ends: here by a table that is linear in x and y for every heading, and
/// between headings linear in yaw.
#[test]
fn what_turning_adds_is_interpolated_between_cells_and_headings() {
    let map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    let geometry = GridGeometry::centred(0.4, 90, 80, 1.3, -1.7);
    let knight = 0.5_f64.atan();
    let yaws = [0.0, knight, PI / 4.0, PI / 2.0 - knight];
    let heading_rad = |heading: usize| yaws[heading % 4] + PI / 2.0 * (heading / 4 % 4) as f64;
    let added = |heading: usize, [x_m, y_m]: [f64; 2]| {
        20.0 + 1.5 * (heading as f64 - 8.0).abs() + 0.1 * heading as f64 * x_m - 0.2 * y_m
    };
    let seconds = vec![7.0; geometry.n_cells()];
    let turning_s: Vec<f32> = (0..N_HEADINGS)
        .flat_map(|heading| (0..geometry.n_cells()).map(move |index| (heading, index)))
        .map(|(heading, index)| added(heading, geometry.centre_m(geometry.cell(index))) as f32)
        .collect();
    let view = CostToGoView { geometry, seconds: &seconds, turning_s: &turning_s };
    let field = TerminalField::new(view, map.geometry(), 2.5).unwrap();
    assert!(
        TerminalField::new(CostToGoView { turning_s: &turning_s[1..], ..view }, map.geometry(), 2.5)
            .is_none()
    );
    let stepper = stepper(0.5);
    let task = GoalTask { x_cells: Constant::new(1e6), ..goal(&map, 0.0, Rest::Field(field)) };
    let mut scene = scene(&map, &stepper, Task::Goal(task));
    for machine in machines() {
        // Nobody moves: the pose is that of the start.
        for k in 0..64 {
            let yaw_rad = TAU * (f64::from(k) / 64.0 - 0.5) + 0.01;
            scene.start.turns = yaw_rad / TAU;
            let mut chunk = Chunk::new(N_STEPS);
            kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
            let yaw_rad = yaw_rad.rem_euclid(TAU);
            let first = (0..N_HEADINGS).rev().find(|heading| heading_rad(*heading) <= yaw_rad).unwrap();
            let next_rad = if first == 15 { TAU } else { heading_rad(first + 1) };
            let share = (yaw_rad - heading_rad(first)) / (next_rad - heading_rad(first));
            let at = [START[0], START[1]];
            let expected =
                7.0 + (1.0 - share) * added(first, at) + share * added((first + 1) % N_HEADINGS, at);
            let found = f64::from(chunk.terms[CostTerm::Terminal as usize].0[k as usize]);
            assert!((found - expected).abs() < 2e-3, "{yaw_rad}: {found} {expected}");
        }
    }
}

/// Effects at every stage, in the order of a machine: delays and lags of both commands, gains, play, rate limits, a
/// speed loop under drags and slope, understeer, slip and grip, and the sensors, which change no rollout.
fn whole_model() -> Model {
    let given: [(&str, [f64; 4]); 20] = [
        ("steer_delay", [0.13, 0.0, 0.0, 0.0]),
        ("speed_delay", [0.21, 0.0, 0.0, 0.0]),
        ("speed_scale", [0.95, 0.0, 0.0, 0.0]),
        ("steer_gain", [1.05, 0.0, 0.0, 0.0]),
        ("steer_bias", [0.01, 0.0, 0.0, 0.0]),
        ("backlash", [0.01, 0.0, 0.0, 0.0]),
        ("steer_rate", [0.9, 0.0, 0.0, 0.0]),
        ("steer_lag", [0.15, 0.0, 0.0, 0.0]),
        ("steer_lag", [0.05, 0.0, 0.0, 0.0]),
        ("speed_loop", [0.4, 0.0, 0.0, 0.0]),
        ("feed_forward", [0.5, 0.0, 0.0, 0.0]),
        ("speed_integral", [1.5, 0.0, 0.0, 0.0]),
        ("rolling_drag", [0.2, 0.0, 0.0, 0.0]),
        ("quad_drag", [0.02, 0.0, 0.0, 0.0]),
        ("veg_drag", [0.5, 0.0, 0.0, 0.0]),
        ("slope_gravity", [0.8, 0.0, 0.0, 0.0]),
        ("cross_slope", [0.6, 0.0, 0.0, 0.0]),
        ("understeer", [0.02, 0.0, 0.0, 0.0]),
        ("rear_slip", [0.01, 0.0, 0.0, 0.0]),
        ("yaw_misalign", [0.1, 0.0, 0.0, 0.0]),
    ];
    let effects = given.iter().map(|&(id, values)| Effect::from_values(id, values).unwrap()).collect();
    let limits = Limits { steering_rate_max_radps: 0.8, ..model_limits() };
    Model { wheelbase_m: WHEELBASE_M, limits, effects }
}

/// Slopes and plants that change from cell to cell.
fn hilly() -> RiskMap {
    let mut map = map();
    map.fill(|_, grounds| {
        for (index, ground) in grounds.iter_mut().enumerate() {
            let wave = |factor: usize| ((index * factor) % 97) as f32 / 96.0 - 0.5;
            *ground = Ground {
                gradient: [0.3 * wave(5), 0.3 * wave(11)],
                class: (index % 3) as u8,
                ..Ground::default()
            };
        }
    });
    map
}

/// The command in force `age_s` before the start.
fn past(age_s: f64) -> Command {
    Command { speed_mps: (1.0 - 0.4 * age_s) as f32, steering_rad: (0.3 * (3.0 * age_s).sin()) as f32 }
}

/// Where the model of one vehicle in f64 ends, with the past that it remembers, and how near it came to a place where
/// rounding decides.
fn journey(map: &RiskMap, model: &Model, lane: usize) -> ([f64; 2], f64) {
    let (view, stepper) = (map.view(), Stepper::new(model, STEP_S, 1.0));
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.recall(&past, &mut memory);
    let [x_m, y_m, yaw_rad] = START;
    let mut state = State { x_m, y_m, yaw_rad, speed_mps: 0.8, steering_rad: 0.1 };
    let mut margin = f64::INFINITY;
    for t in 0..N_STEPS {
        for place in [state.x_m / 0.5, state.y_m / 0.5, state.yaw_rad / std::f64::consts::TAU * 13.0] {
            margin = margin.min((place - place.round()).abs());
        }
        let risk = view.risk_at(state.x_m, state.y_m, state.yaw_rad);
        let cell = view.geometry.cell_at(state.x_m, state.y_m).unwrap();
        let ground = view.ground[view.geometry.index(cell)];
        let sample = GroundSample {
            linear_traction: f64::from(risk.linear_traction),
            angular_traction: f64::from(risk.angular_traction),
            gradient: ground.gradient.map(f64::from),
            class: f64::from(ground.class),
        };
        let [speed, steering] = control(lane, t);
        let command = Command { speed_mps: speed as f32, steering_rad: steering as f32 };
        state = stepper.step_state(&state, command, &sample, &mut memory, t);
    }
    ([state.x_m, state.y_m], margin)
}

/// How far from where they should be rollouts may end [m].
const OFF_M: f64 = 2e-3;

/// An effect that the others leave nothing to do could be wrong and nobody would see it.
#[test]
fn every_effect_of_the_whole_model_shows_where_rollouts_end() {
    let (map, model) = (hilly(), whole_model());
    for (place, effect) in model.effects.iter().enumerate().filter(|(_, effect)| !effect.acts_on_sensors()) {
        let mut others = model.clone();
        others.effects.remove(place);
        let shows = |lane: &usize| {
            let [with, without] = [&model, &others].map(|model| journey(&map, model, *lane).0);
            (with[0] - without[0]).hypot(with[1] - without[1]) > 10.0 * OFF_M
        };
        let n_shown = (0..CHUNK).filter(shows).count();
        assert!(8 * n_shown >= CHUNK, "{}: shows in {n_shown} of {CHUNK}", effect.description().id);
    }
}

/// Every lane of every instruction set goes where the model of one vehicle in f64 goes on the same ground: as far from
/// a goal in the east and from one in the north, which are near enough for either to see an error across. Lanes that
/// come within 1e-4 of a cell's or bin's edge are left out.
#[test]
fn rollouts_of_a_whole_model_go_where_one_vehicle_goes() {
    let (map, model) = (hilly(), whole_model());
    let stepper = Stepper::new(&model, STEP_S, 0.5);
    assert!(stepper.n_slots() <= MAX_SLOTS);
    let mut remembered = vec![0.0; stepper.n_slots()];
    stepper.recall(&past, &mut remembered);
    let slots: Vec<f32> = remembered.iter().map(|value| *value as f32).collect();
    let corner_m = map.geometry().south_west_m();
    for goal_m in [[START[0] + 20.0, START[1]], [START[0], START[1] + 20.0]] {
        let [x_cells, y_cells] = [0, 1].map(|axis| Constant::new((goal_m[axis] - corner_m[axis]) / 0.5));
        let task = Task::Goal(GoalTask { x_cells, y_cells, ..goal(&map, 0.0, Rest::Straight) });
        let mut scene = scene(&map, &stepper, task);
        (scene.slots, scene.start.speed_mps, scene.start.turn) = (&slots, 0.8, 0.1);
        for machine in machines() {
            let mut chunk = chunk();
            kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
            let mut n_compared = 0;
            for lane in 0..CHUNK {
                let ([x_m, y_m], margin) = journey(&map, &model, lane);
                if margin < 1e-4 {
                    continue;
                }
                n_compared += 1;
                let expected_m = (x_m - goal_m[0]).hypot(y_m - goal_m[1]);
                // The cost at the end is the time for the rest of the way, at 2 m/s.
                let found_m = 2.0 * f64::from(chunk.terms[CostTerm::Terminal as usize].0[lane]);
                assert!(
                    (found_m - expected_m).abs() < OFF_M,
                    "{machine:?} lane {lane}: {found_m} {expected_m}"
                );
            }
            assert!(n_compared > 40, "{n_compared} compared");
        }
    }
}

/// Ground east of 3 m whose numbers are not finite, in one field or the other.
fn broken(field: usize, number: f32) -> RiskMap {
    let mut map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    let geometry = *map.geometry();
    map.fill(|risks, grounds| {
        for (index, (risks, ground)) in risks.chunks_exact_mut(13).zip(grounds).enumerate() {
            if geometry.centre_m(geometry.cell(index))[0] > 3.0 {
                match field {
                    0 => risks.iter_mut().for_each(|risk| risk.linear_traction = number),
                    1 => risks.iter_mut().for_each(|risk| risk.angular_traction = number),
                    _ => ground.gradient = [number, 0.1],
                }
            }
        }
    });
    map
}

/// Whether a rollout reads broken ground with a step left to tell, and how near to its edge it comes: in f64 over ground
/// that is whole.
fn reads_broken(stepper: &Stepper, slots: usize, lane: usize) -> (bool, f64) {
    let mut memory = vec![0.0; slots];
    let mut state = State { x_m: START[0], y_m: START[1], yaw_rad: START[2], ..State::default() };
    let mut margin = f64::INFINITY;
    for t in 0..N_STEPS {
        margin = margin.min((state.x_m - 3.0).abs());
        if state.x_m > 3.0 {
            // What the last step leaves behind, only some of the costs see.
            return if t + 1 < N_STEPS { (true, margin) } else { (false, 0.0) };
        }
        let [speed, steering] = control(lane, t);
        let command = Command { speed_mps: speed as f32, steering_rad: steering as f32 };
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut memory, t);
    }
    (false, margin)
}

/// A number that is not finite makes the rollout that meets it cost no finite number, and no other, whatever the
/// instruction set: none may round infinity to nothing, nor may a bound turn NaN into itself. Less than the least traction is
/// no such number: it counts as the least.
#[test]
fn a_rollout_that_meets_no_number_costs_none_on_every_instruction_set() {
    let friction = Effect::from_values("friction", [0.8, 1.0, 3.0, 0.0]).unwrap();
    let slope = Effect::from_values("slope_gravity", [1.0, 0.0, 0.0, 0.0]).unwrap();
    let whole = Model { wheelbase_m: WHEELBASE_M, limits: model_limits(), effects: vec![slope, friction] };
    let plain = Model { effects: Vec::new(), ..whole.clone() };
    for (model, field, number) in [
        (&plain, 0, f32::NAN),
        (&plain, 0, f32::INFINITY),
        (&plain, 1, f32::NAN),
        (&plain, 1, f32::INFINITY),
        (&whole, 1, f32::INFINITY),
        (&whole, 2, f32::NAN),
    ] {
        let map = broken(field, number);
        let (stepper, reference) = (Stepper::new(model, STEP_S, 0.5), Stepper::new(model, STEP_S, 1.0));
        let task = Task::Goal(GoalTask { x_cells: Constant::new(1e3), ..goal(&map, 0.0, Rest::Straight) });
        let slots = vec![0.0; stepper.n_slots()];
        let mut scene = scene(&map, &stepper, task);
        scene.slots = &slots;
        for machine in machines() {
            let mut chunk = chunk();
            kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
            let (mut n_met, mut n_missed) = (0, 0);
            for lane in 0..CHUNK {
                let (is_met, margin) = reads_broken(&reference, stepper.n_slots(), lane);
                if margin < 1e-3 {
                    continue;
                }
                let cost_s = chunk.costs.0[lane];
                assert_eq!(!cost_s.is_finite(), is_met, "{machine:?} {field} {number} lane {lane}: {cost_s}");
                (n_met, n_missed) = (n_met + usize::from(is_met), n_missed + usize::from(!is_met));
            }
            assert!(n_met > 10 && n_missed > 10, "{n_met} {n_missed}");
        }
    }
}
