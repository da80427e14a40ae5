//! What a controller keeps from cycle to cycle.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::config::Actuation;
use crate::kernel::CHUNK;
use crate::{Costs, Objective, Terminal};
use bicycle::{Command, Effect, GroundSample, Limits, State, Stepper};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use traversability::{GridGeometry, Risk, RiskMap};

const STEP_S: f64 = 0.1;

fn model(drag_mps2: f64) -> Model {
    let limits = Limits {
        speed_max_mps: 2.0,
        reverse_speed_max_mps: 1.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 3.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    let values = [("speed_loop", 0.4), ("speed_integral", 3.0), ("rolling_drag", drag_mps2)];
    let effect = |(id, value): (&str, f64)| Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap();
    Model { wheelbase_m: 2.0, limits, effects: values.map(effect).to_vec() }
}

/// The vehicle's motor controller meets a drag of 0.6 m/s2 that the model does not know. Rolling at its command, its
/// integral holds 0.6 m/s2; the model's must hold nothing, because what pushes back and what it pushes against cancel in
/// every speed that was measured. A model that knows the drag must hold it.
#[test]
fn what_is_held_is_what_the_model_does_not_know_to_be_cancelled() {
    for (known_mps2, held_mps2) in [(0.0, 0.0), (0.6, 0.6)] {
        let map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 1, Risk::NONE);
        let objective =
            Objective::Goal { goal_m: [19.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
        let config = Config { n_threads: 1, n_rollouts: 256, ..Config::default() };
        let mut controller = Controller::new(config, model(known_mps2), 1).unwrap();
        let vehicle = Stepper::new(&model(0.6), STEP_S, 1.0);
        let mut memory = vec![0.0; vehicle.n_slots()];
        let mut state = State { x_m: -15.0, ..State::default() };
        for cycle in 0..100 {
            let input = Input { state, elapsed_s: STEP_S, cycle, map: map.view(), objective };
            let Decision::Drive(command) = controller.decide(&input) else { panic!("{cycle}") };
            state = vehicle.step_state(&state, command, &GroundSample::FIRM, &mut memory, cycle as usize);
        }
        assert!(state.speed_mps > 1.5 && (vehicle.held(&mut memory)[0] - 0.6).abs() < 0.2);
        let found_mps2 = controller.held_mps2[0];
        assert!((found_mps2 - held_mps2).abs() < 0.2, "{known_mps2}: {found_mps2}");
        controller.reset();
        assert_eq!(controller.held_mps2, [0.0]);
    }
}

/// Level ground with round obstacles, which are no finer than what rounding moves. Two of three are slopes beyond the
/// limits with a steeper middle.
fn obstacles(random: &mut Xoshiro256PlusPlus, n: usize) -> RiskMap {
    let mut map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 16, Risk::NONE);
    let geometry = *map.geometry();
    for kind in 0..n {
        let [x_m, y_m] = [0, 1].map(|_| random.random_range(-6.0..6.0_f64));
        let radius_m = random.random_range(0.5..1.5);
        map.fill(|risks, _| {
            for (index, risks) in risks.chunks_exact_mut(16).enumerate() {
                let centre_m = geometry.centre_m(geometry.cell(index));
                if (centre_m[0] - x_m).hypot(centre_m[1] - y_m) < radius_m {
                    let is_middle = (centre_m[0] - x_m).hypot(centre_m[1] - y_m) < 0.5 * radius_m;
                    let tilt_rad = if is_middle { 0.8 } else { 0.6 };
                    let tilted = |risk: &Risk| match kind % 3 {
                        0 => Risk { roll_rad: tilt_rad, ..*risk },
                        1 => Risk { pitch_rad: tilt_rad, ..*risk },
                        _ => risk.blocked(),
                    };
                    risks.iter_mut().for_each(|risk| *risk = tilted(risk));
                }
            }
        });
    }
    map
}

/// Whether the judge says that a rollout breaks a limit in the poses that the rollouts look at: all after the start but
/// the last. None where a millimetre or a tenth of a milliradian at the start would change the answer.
fn judged(controller: &Controller, map: &RiskMap, (chunk, lane): (usize, usize)) -> Option<bool> {
    let judge = controller.judge_over(map.view());
    let breaks = |east_m: f64, north_m: f64, left_rad: f64| {
        let MotionState { x_m, y_m, yaw_rad, .. } = controller.start;
        let start = MotionState {
            x_m: x_m + east_m,
            y_m: y_m + north_m,
            yaw_rad: yaw_rad + left_rad,
            ..controller.start
        };
        let controls = controller.chunks[chunk].controls_of(lane).take(controller.config.n_steps - 1);
        let mut memory = controller.slots.map(f64::from);
        judge.breaks_limits(&start, controls, &mut memory)
    };
    let found = breaks(0.0, 0.0, 0.0);
    let near = [(1e-3, 0.0, 0.0), (-1e-3, 0.0, 0.0), (0.0, 1e-3, 0.0), (0.0, -1e-3, 0.0)];
    let turned = [(0.0, 0.0, 1e-4), (0.0, 0.0, -1e-4)];
    let is_clear = near.into_iter().chain(turned).all(|(x, y, yaw)| breaks(x, y, yaw) == found);
    is_clear.then_some(found)
}

/// Over many scenes: with and without effects, instant and limited actuators, at rest, at speed, with commands that run
/// ahead of what was measured, and from poses beyond a limit, on every instruction set.
#[test]
fn the_rollouts_and_the_judge_agree_on_what_breaks_a_limit() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let (mut n_compared, mut n_broken, mut n_unclear, mut n_leaving) = (0, 0, 0, 0);
    for scene in 0..60 {
        let isa = crate::Isa::SETS[scene / 4 % crate::Isa::SETS.len()];
        let actuation = if scene % 4 == 0 { Actuation::Instant } else { Actuation::Limited };
        let config = Config { isa, actuation, n_rollouts: 256, ..Config::default() };
        let effects = if scene % 5 < 2 { model(0.3).effects } else { Vec::new() };
        let model = Model { effects, ..model(0.0) };
        let Ok(mut controller) = Controller::new(config, model, scene as u64) else { continue };
        let map = obstacles(&mut random, 5);
        let state = State {
            x_m: random.random_range(-5.0..5.0),
            y_m: random.random_range(-5.0..5.0),
            yaw_rad: random.random_range(-3.1..3.1),
            speed_mps: random.random_range(-0.5..2.0),
            steering_rad: random.random_range(-0.5..0.5),
        };
        // Told something else than what it does: commands start up to a metre per second ahead.
        let [speed_mps, steering_rad] = [random.random_range(-0.5..2.0), random.random_range(-0.5..0.5)];
        controller.stand_by(&Decision::Drive(Command { speed_mps, steering_rad }), STEP_S);
        let objective =
            Objective::Goal { goal_m: [19.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
        controller.decide(&Input { state, elapsed_s: STEP_S, cycle: 0, map: map.view(), objective });
        let is_leaving = map.view().risk_at(state.x_m, state.y_m, state.yaw_rad).roll_rad > 0.5;
        for index in 0..256 {
            let place = (index / CHUNK, index % CHUNK);
            let Some(expected) = judged(&controller, &map, place) else {
                n_unclear += 1;
                continue;
            };
            let found = controller.chunks[place.0].n_broken.0[place.1] > 0.0;
            assert_eq!(found, expected, "scene {scene} {isa:?} rollout {index}");
            n_compared += 1;
            n_broken += usize::from(expected);
            n_leaving += usize::from(is_leaving);
        }
    }
    assert!(n_compared > 4000 && 10 * n_unclear < n_compared, "{n_compared} compared, {n_unclear} unclear");
    assert!(n_broken > 500 && n_broken < n_compared - 500 && n_leaving > 500, "{n_broken} {n_leaving}");
}

/// The vehicle stands in what blocks it, which reaches 1 m to either side; ahead of it the ground leans by 0.6 rad, beyond
/// the limit of 0.5, behind it by 0.4. Nothing but the blocked poses is excused; where the ground under the start leans by
/// 0.7 rad itself, 0.6 is less. Half a metre per second for 3 s lead beyond the edge.
#[test]
fn who_leaves_an_obstacle_keeps_off_steeper_ground() {
    let mut map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 1, Risk::NONE);
    let geometry = *map.geometry();
    for (lean_rad, expected) in [(0.0_f32, [true, false]), (0.7, [false, false])] {
        map.fill(|risks, _| {
            for (index, risk) in risks.iter_mut().enumerate() {
                let [x_m, _] = geometry.centre_m(geometry.cell(index));
                let lean = |roll_rad| Risk { roll_rad, ..Risk::NONE };
                *risk = if x_m.abs() < 1.0 {
                    lean(lean_rad).blocked()
                } else {
                    lean(if x_m > 0.0 { 0.6 } else { 0.4 })
                };
            }
        });
        let config = Config { n_rollouts: 64, ..Config::default() };
        let mut controller = Controller::new(config, Model { effects: Vec::new(), ..model(0.0) }, 1).unwrap();
        let objective =
            Objective::Goal { goal_m: [19.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
        let input =
            Input { state: State::default(), elapsed_s: STEP_S, cycle: 0, map: map.view(), objective };
        controller.decide(&input);
        let found = [0.5, -0.5].map(|speed_mps| {
            let mut memory = controller.slots.map(f64::from);
            let controls = std::iter::repeat_n([speed_mps, 0.0], 30);
            controller.judge_over(map.view()).breaks_limits(&controller.start, controls, &mut memory)
        });
        assert_eq!(found, expected, "leaning by {lean_rad} rad in the obstacle");
    }
}

/// The vehicle stands where some heading would touch an obstacle; one metre ahead, and two to its end, it is touched at
/// any. Leaving excuses the first alone.
#[test]
fn who_leaves_a_blocked_pose_does_not_drive_into_the_obstacle() {
    let mut map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 1, Risk::NONE);
    let geometry = *map.geometry();
    map.fill(|risks, _| {
        for (index, risk) in risks.iter_mut().enumerate() {
            let [x_m, _] = geometry.centre_m(geometry.cell(index));
            *risk = match x_m {
                x_m if (1.0..2.0).contains(&x_m) => Risk::NONE.touching(),
                x_m if x_m.abs() < 2.5 => Risk::NONE.blocked(),
                _ => Risk::NONE,
            };
        }
    });
    let config = Config { n_rollouts: 64, ..Config::default() };
    let mut controller = Controller::new(config, Model { effects: Vec::new(), ..model(0.0) }, 1).unwrap();
    let objective =
        Objective::Goal { goal_m: [19.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
    let input = Input { state: State::default(), elapsed_s: STEP_S, cycle: 0, map: map.view(), objective };
    let decision = controller.decide(&input);
    assert!(matches!(decision, Decision::Drive(_)), "{decision:?}");
    let breaks = [1.0, -1.0].map(|speed_mps| {
        let mut memory = controller.slots.map(f64::from);
        let controls = std::iter::repeat_n([speed_mps, 0.0], 30);
        controller.judge_over(map.view()).breaks_limits(&controller.start, controls, &mut memory)
    });
    assert_eq!(breaks, [true, false], "ahead, behind");
}

/// A wall right ahead that costs next to nothing to drive through: mean and cheapest rollouts lead into it, many others
/// do not. One of those is driven; whether it keeps clear is looked at with equations of this test's own.
#[test]
fn a_feasible_rollout_is_driven_though_the_mean_and_the_cheapest_break_a_limit() {
    let costs = Costs { attitude_s: 1e-3, ..Config::default().costs };
    let config = Config { costs, ..Config::default() };
    let mut map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 1, Risk::NONE);
    let geometry = *map.geometry();
    let is_wall = |x_m: f64, y_m: f64| (1.0..3.0).contains(&x_m) && y_m.abs() < 6.0;
    map.fill(|risks, _| {
        for (index, risk) in risks.iter_mut().enumerate() {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
            *risk = if is_wall(x_m, y_m) { risk.blocked() } else { *risk };
        }
    });
    let objective =
        Objective::Goal { goal_m: [15.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
    let mut n_alone = 0;
    for seed in 0..10 {
        let model = Model { effects: Vec::new(), ..model(0.0) };
        let mut controller = Controller::new(config.clone(), model, seed).unwrap();
        let state = State { x_m: 0.3, speed_mps: 1.0, ..State::default() };
        let decision =
            controller.decide(&Input { state, elapsed_s: 0.0, cycle: 0, map: map.view(), objective });
        if controller.diagnostics().n_feasible == 0 {
            continue;
        }
        assert!(matches!(decision, Decision::Drive(_)), "{seed}: {decision:?}");
        n_alone += usize::from(controller.diagnostics().is_best_alone);
        let (mut x_m, mut y_m, mut yaw_rad, mut speed_mps, mut steering_rad) =
            (0.3, 0.0, 0.0_f64, 1.0, 0.0_f64);
        // From 1 m/s or a little more at 2 m/s2: it could stop within six steps.
        for command in controller.plan().take(6) {
            speed_mps += (f64::from(command.speed_mps) - speed_mps).clamp(-0.2, 0.2);
            steering_rad += (f64::from(command.steering_rad) - steering_rad).clamp(-0.1, 0.1);
            x_m += STEP_S * speed_mps * yaw_rad.cos();
            y_m += STEP_S * speed_mps * yaw_rad.sin();
            yaw_rad += STEP_S * speed_mps * steering_rad.tan() / 2.0;
            assert!(!is_wall(x_m - 1e-3, y_m), "{seed}: ({x_m}, {y_m})");
        }
    }
    assert!(n_alone >= 3, "{n_alone}: the wall was no temptation");
}

/// While somebody else decides, what was held against the ground's forces is let go, and time in which the vehicle was
/// not the controller's makes none.
#[test]
fn what_was_held_is_let_go_while_somebody_else_decides() {
    let map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 1, Risk::NONE);
    let objective =
        Objective::Goal { goal_m: [19.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
    let config = Config { n_rollouts: 64, ..Config::default() };
    let mut controller = Controller::new(config, model(0.0), 1).unwrap();
    let mut state = State { speed_mps: 1.0, ..State::default() };
    for cycle in 0..5 {
        controller.decide(&Input { state, elapsed_s: STEP_S, cycle, map: map.view(), objective });
        // Slower than the model foretells: something is held against it.
        state.speed_mps -= 0.25;
    }
    assert!(controller.held_mps2[0].abs() > 0.05, "{:?}", controller.held_mps2);
    for _ in 0..4 {
        controller.stand_by(&Decision::Stop(StopReason::StaleOdometry), STEP_S);
    }
    state.speed_mps = 0.0;
    controller.decide(&Input { state, elapsed_s: STEP_S, cycle: 9, map: map.view(), objective });
    assert_eq!(controller.held_mps2, [0.0]);
    // 0.45 s ago the last of the commands before the stop was in force, and a stop since.
    assert_eq!(controller.ledger.at(0.35).map(|command| command.speed_mps), Some(0.0));
    assert!(controller.ledger.at(0.45).is_some_and(|command| command.speed_mps != 0.0));
}
