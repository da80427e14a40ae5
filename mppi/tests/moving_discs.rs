//! What moves: what its nearness costs, what may not be driven, and what a plan makes of it.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod fixture;

use bicycle::{Command, Decision, GroundSample, Model, MotionState, State, Stepper, StopReason};
use fixture::{STEP_S, goal, level, model, rough};
use mppi::{Config, Controller, CostTerm, Disc, DiscPrices, Input, Isa, MovingDiscs, Outline, StepCost};
use nalgebra::{Isometry2, Point2, Vector2};

const OUTLINE: Outline = Outline { front_m: 2.5, rear_m: 0.5, half_width_m: 0.8 };
const PRICES: DiscPrices = DiscPrices { touch_s: 2.0, near_s: 0.5, foresight_s: 0.5 };
const N_STEPS: usize = 50;

/// The way of a disc: where it is at the end of a step, before the plan and in it.
#[derive(Clone, Copy)]
struct Walk {
    from_m: [f64; 2],
    velocity_mps: [f64; 2],
}

impl Walk {
    fn at_m(&self, time_s: f64) -> [f64; 2] {
        [0, 1].map(|axis| self.from_m[axis] + time_s * self.velocity_mps[axis])
    }
}

fn among(config: &Config) -> Controller<Model, MovingDiscs> {
    let discs = MovingDiscs::new(OUTLINE, PRICES, 4, config.n_steps);
    Controller::with_costs(config.clone(), model(), (discs, ()), 3).unwrap()
}

fn tell(controller: &mut Controller<Model, MovingDiscs>, walk: &Walk, now_s: f64) {
    let discs = controller.step_cost_mut();
    discs.clear();
    discs.add(|t| Disc {
        centre_m: walk.at_m(now_s + STEP_S * (t + 1) as f64),
        radius_m: 0.6,
        margin_m: 1.0,
    });
}

/// Least distance from a point to the body at a pose, by points all over it.
fn distance_m(pose: [f64; 3], at_m: [f64; 2]) -> f64 {
    let motion = Isometry2::new(Vector2::new(pose[0], pose[1]), pose[2]);
    let mut least_m = f64::INFINITY;
    for i in 0..=150 {
        for j in 0..=80 {
            let place = Point2::new(-0.5 + 3.0 * f64::from(i) / 150.0, -0.8 + 1.6 * f64::from(j) / 80.0);
            least_m = least_m.min((motion * place - Point2::from(at_m)).norm());
        }
    }
    least_m
}

#[test]
fn a_pose_is_forbidden_where_the_body_comes_nearer_than_it_may() {
    let mut discs = MovingDiscs::new(OUTLINE, PRICES, 2, 3);
    assert_eq!(discs.foresight_s(), None, "nothing is forbidden by nothing");
    discs.add(|t| Disc { centre_m: [4.0 + t as f64, 1.0], radius_m: 0.6, margin_m: 1.0 });
    let (mut n_forbidden, mut n_judged) = (0, 0);
    for k in 0..400_u32 {
        let [x_m, y_m, yaw_rad] = [k % 20, k / 20 % 20, k % 17].map(|v| f64::from(v) * 0.37).map(|v| v - 1.0);
        let t = (k % 3) as usize;
        let gap_m = distance_m([x_m, y_m, yaw_rad], [4.0 + t as f64, 1.0]) - 0.6;
        if gap_m.abs() < 0.02 {
            continue;
        }
        let state = MotionState { x_m, y_m, yaw_rad, ..MotionState::default() };
        assert_eq!(discs.forbids(t, &state), gap_m < 0.0, "{state:?}: {gap_m} m");
        n_judged += 1;
        n_forbidden += u32::from(gap_m < 0.0);
    }
    assert!(n_judged > 350 && n_forbidden > 30, "{n_forbidden} of {n_judged}");
    discs.clear();
    assert!(discs.is_empty() && !discs.forbids(0, &MotionState { x_m: 4.0, ..MotionState::default() }));
}

#[test]
fn no_disc_and_a_disc_far_away_change_no_bit() {
    let map = rough(4);
    let mut none = Controller::new(Config::default(), model(), 3).unwrap();
    let mut empty = among(&Config::default());
    let mut far = among(&Config::default());
    for cycle in 0..5 {
        let input = Input {
            state: State::default(),
            elapsed_s: if cycle == 0 { 0.0 } else { STEP_S },
            map: map.view(),
            objective: goal([15.0, 0.0]),
            cycle,
        };
        tell(&mut far, &Walk { from_m: [-400.0, 0.0], velocity_mps: [0.0; 2] }, 0.0);
        let expected = none.decide(&input);
        assert_eq!((empty.decide(&input), far.decide(&input)), (expected, expected), "cycle {cycle}");
    }
}

/// Futures that all but keep the speed they start with, within a disc as wide as the map and half a margin away from one:
/// what the 50 steps cost, on every instruction set. And nothing is left of that when it has gone.
#[test]
fn steps_near_a_disc_cost_what_they_are_said_to() {
    let map = level();
    let around = Disc { centre_m: [0.0; 2], radius_m: 100.0, margin_m: 1.0 };
    let half_a_margin_away = Disc { centre_m: [0.0, 1000.8], radius_m: 950.0, margin_m: 100.0 };
    for isa in Isa::SETS {
        let mut config = Config { isa, ..Config::default() };
        (config.sampling.speed_std, config.sampling.steering_std) = (1e-3, 1e-3);
        let discs = MovingDiscs::new(OUTLINE, PRICES, 1, N_STEPS);
        let Ok(mut controller) = Controller::with_costs(config, model(), (discs, ()), 3) else { continue };
        // A price of 0.5 s at 1 m/s and more, a quarter of it at half of that speed.
        for (speed_mps, near_s) in [(2.0, 0.5), (1.2, 0.5), (0.5, 0.125), (0.0, 0.0)] {
            let mut added_s = |disc: Option<Disc>| {
                controller.reset();
                controller.step_cost_mut().clear();
                disc.into_iter().for_each(|disc| controller.step_cost_mut().add(|_| disc));
                let state = State { speed_mps, ..State::default() };
                let objective = goal([15.0, 0.0]);
                let input = Input { state, elapsed_s: 0.0, map: map.view(), objective, cycle: 0 };
                let decision = controller.decide(&input);
                (controller.diagnostics().mean_terms_s[CostTerm::Added as usize], decision)
            };
            let n_steps = N_STEPS as f32;
            let (within_s, decision) = added_s(Some(around));
            assert_eq!(decision, Decision::Stop(StopReason::MovingObstacle), "{isa:?}");
            let expected_s = n_steps * (2.0 + near_s);
            assert!((within_s - expected_s).abs() < 0.02 * expected_s, "{isa:?}, {speed_mps}: {within_s} s");
            let (away_s, _) = added_s(Some(half_a_margin_away));
            let expected_s = 0.25 * n_steps * near_s;
            assert!(
                (away_s - expected_s).abs() < 0.1 * expected_s + 0.01,
                "{isa:?}, {speed_mps}: {away_s} s"
            );
            let (nothing_s, decision) = added_s(None);
            assert!(nothing_s == 0.0 && matches!(decision, Decision::Drive(_)), "{isa:?}: {nothing_s} s");
        }
    }
}

/// The model drives itself to a goal 12 m ahead while a disc crosses its way: least distance kept, and all decisions.
fn crossed(walk: &Walk) -> (f64, Vec<Decision>) {
    let (map, stepper) = (level(), Stepper::new(&model(), STEP_S, 1.0));
    let mut controller = among(&Config::default());
    let (mut state, mut nearest_m, mut decisions) = (State::default(), f64::INFINITY, Vec::new());
    for cycle in 0..300 {
        let now_s = STEP_S * cycle as f64;
        tell(&mut controller, walk, now_s);
        let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
        let objective = goal([12.0, 0.0]);
        let decision = controller.decide(&Input { state, elapsed_s, map: map.view(), objective, cycle });
        decisions.push(decision);
        if matches!(decision, Decision::Hold(_)) {
            return (nearest_m, decisions);
        }
        let command = decision.command(Command::default());
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut [], 0);
        let gap_m = distance_m([state.x_m, state.y_m, state.yaw_rad], walk.at_m(now_s + STEP_S)) - 0.6;
        nearest_m = nearest_m.min(gap_m);
    }
    panic!("not there: {state:?}")
}

#[test]
fn what_crosses_is_let_pass_or_driven_around_and_then_the_goal_is_reached() {
    for (from_m, velocity_mps) in [
        ([6.0, -6.0], [0.0, 1.5]),
        ([8.0, 5.0], [0.0, -1.0]),
        ([9.0, -4.0], [-0.3, 0.8]),
        ([16.0, 0.2], [-1.2, 0.0]),
    ] {
        let (nearest_m, _) = crossed(&Walk { from_m, velocity_mps });
        assert!(nearest_m > -0.02, "{from_m:?}: {nearest_m} m");
    }
    let through = Walk { from_m: [6.0, -6.0], velocity_mps: [0.0, 1.5] };
    let straight_m = (0..80).map(|k| {
        let time_s = 0.1 * f64::from(k);
        distance_m(
            [if time_s < 1.0 { time_s * time_s } else { 2.0 * time_s - 1.0 }, 0.0, 0.0],
            through.at_m(time_s),
        ) - 0.6
    });
    assert!(straight_m.fold(f64::INFINITY, f64::min) < 0.0, "straight on they would have met");
}

#[test]
fn what_cannot_be_avoided_otherwise_is_stopped_for() {
    // As wide as the way and all beside it, from ahead: nothing but to stand helps, and it turns off in time.
    let (map, mut controller) = (level(), among(&Config::default()));
    let mut input = Input {
        state: State { speed_mps: 2.0, ..State::default() },
        elapsed_s: 0.0,
        map: map.view(),
        objective: goal([15.0, 0.0]),
        cycle: 0,
    };
    controller.step_cost_mut().add(|_| Disc { centre_m: [23.4, 0.0], radius_m: 20.0, margin_m: 1.0 });
    // 0.9 m from the bumper, where it takes 1 m to stop.
    assert_eq!(controller.decide(&input), Decision::Stop(StopReason::MovingObstacle));
    controller.step_cost_mut().clear();
    (input.elapsed_s, input.cycle) = (STEP_S, 1);
    assert!(matches!(controller.decide(&input), Decision::Drive(_)), "it has gone");
}
