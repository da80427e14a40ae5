//! Costs that a user brings along: what they come to, and what they change.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod fixture;

use bicycle::lanes::{Lanes, Real};
use bicycle::{Command, Decision, GroundSample, Model, MotionState, State, Stepper};
use fixture::{STEP_S, goal, level, model, rough};
use mppi::{Config, Controller, CostTerm, Future, Input, Isa, RolloutCost, Step, StepCost, Trace};
use traversability::RiskMap;

/// The same for every step.
struct PerStep(f64);

impl StepCost for PerStep {
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        step.lanes().real(self.0)
    }
}

/// A second for every step within a disc.
struct KeepOut {
    centre_m: [f64; 2],
    radius_m: f64,
}

impl StepCost for KeepOut {
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let lanes = step.lanes();
        let inside = step.distance_m(self.centre_m).less(lanes.real(self.radius_m));
        lanes.real(0.0).add_where(inside, lanes.real(1.0))
    }
}

/// Both prices of a step and the disc add up. One type for all tests: the rollouts are compiled once for a type of cost and
/// an instruction set.
type Steps = (PerStep, PerStep, KeepOut);

/// Seconds of a step, and no disc.
fn per_step(price_s: f64) -> Steps {
    (PerStep(price_s), PerStep(0.0), KeepOut { centre_m: [0.0; 2], radius_m: 0.0 })
}

/// Seconds per metre of how far north a rollout ends.
struct NotNorth(f32);

impl RolloutCost for NotNorth {
    fn add(&self, futures: &[Future], added_s: &mut [f32]) {
        for (future, added_s) in futures.iter().zip(added_s) {
            *added_s += self.0 * future.end.y_m as f32;
        }
    }
}

/// Takes away that a rollout is finite.
struct Broken;

impl RolloutCost for Broken {
    fn add(&self, _: &[Future], added_s: &mut [f32]) {
        added_s[..100].fill(f32::NAN);
    }
}

fn input(map: &RiskMap, cycle: u64) -> Input<'_> {
    let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
    Input { state: State::default(), elapsed_s, map: map.view(), objective: goal([15.0, 0.0]), cycle }
}

fn controller<S: StepCost, R: RolloutCost>(costs: (S, R)) -> Controller<Model, S, R> {
    Controller::with_costs(Config::default(), model(), costs, 3).unwrap()
}

/// Mean cost of what was added, over all rollouts [s].
fn added_s<S: StepCost, R: RolloutCost>(controller: &Controller<Model, S, R>) -> f32 {
    controller.diagnostics().mean_terms_s[CostTerm::Added as usize]
}

/// Nothing to pay is the controller without costs, to the bit, whatever it is called.
#[test]
fn a_cost_of_nothing_changes_no_bit() {
    let map = rough(4);
    let decisions = |mut decide: Box<dyn FnMut(&Input<'_>) -> Decision>| -> Vec<Decision> {
        (0..5).map(|cycle| decide(&input(&map, cycle))).collect()
    };
    let (mut none, mut nothing) = (controller(((), ())), controller((per_step(0.0), NotNorth(0.0))));
    let mut new = Controller::new(Config::default(), model(), 3).unwrap();
    let expected = decisions(Box::new(move |input| new.decide(input)));
    assert_eq!(decisions(Box::new(move |input| none.decide(input))), expected);
    assert_eq!(decisions(Box::new(move |input| nothing.decide(input))), expected);
}

/// No rollout of 5 s at 2 m/s reaches a goal 15 m away: all 50 steps count. Costs add up, alone and as tuples, and do not
/// pile up from cycle to cycle.
#[test]
fn costs_of_steps_add_up() {
    let map = level();
    for isa in Isa::SETS {
        let config = Config { isa, ..Config::default() };
        let costs: Steps = (PerStep(0.01), PerStep(0.02), KeepOut { centre_m: [0.0, 0.0], radius_m: 100.0 });
        let Ok(mut controller) = Controller::with_costs(config, model(), (costs, ()), 3) else { continue };
        for cycle in 0..3 {
            assert!(matches!(controller.decide(&input(&map, cycle)), Decision::Drive(_)));
            assert!((added_s(&controller) - 51.5).abs() < 1e-3, "{isa:?} {}", added_s(&controller));
        }
        controller.step_cost_mut().0 = PerStep(0.03);
        controller.decide(&input(&map, 3));
        assert!((added_s(&controller) - 52.5).abs() < 1e-3, "changed between decisions");
    }
}

/// Steps count until the goal is reached: 2 m away, that is long before the horizon.
#[test]
fn costs_end_at_the_goal() {
    let map = level();
    let mut controller = controller((per_step(1.0), ()));
    let state = State { speed_mps: 2.0, ..State::default() };
    controller.decide(&Input { state, objective: goal([2.0, 0.0]), ..input(&map, 0) });
    let best = controller.diagnostics().best_terms_s[CostTerm::Added as usize];
    // 1.5 m to the rim at 2 m/s: with the eighth step.
    assert!((8.0..=9.0).contains(&best), "{best}");
}

/// A rollout's end is told in the map frame, and its cost is what the diagnostics say.
#[test]
fn futures_are_told_where_they_end() {
    struct Recorded(std::sync::Mutex<Vec<Future>>);
    impl RolloutCost for Recorded {
        fn add(&self, futures: &[Future], _: &mut [f32]) {
            *self.0.lock().unwrap() = futures.to_vec();
        }
    }
    let map = rough(2);
    let mut controller = controller(((), Recorded(std::sync::Mutex::default())));
    let state = State { x_m: 1.0, y_m: -2.0, yaw_rad: 0.4, ..State::default() };
    controller.decide(&Input { state, ..input(&map, 0) });
    let best = controller.best_rollouts(20, map.view());
    let futures = controller.rollout_cost_mut().0.lock().unwrap().clone();
    assert_eq!(futures.len(), 1024);
    let mut n_matched = 0;
    for rollout in &best {
        let end = MotionState::from(*rollout.states.last().unwrap());
        let future = futures.iter().find(|future| future.cost_s == rollout.cost_s).unwrap();
        let off_m = (future.end.x_m - end.x_m).hypot(future.end.y_m - end.y_m);
        // Where rounding decides between two cells, the twin goes another way.
        n_matched += usize::from(off_m < 1e-3 && (future.end.speed_mps - end.speed_mps).abs() < 1e-4);
    }
    assert!(n_matched >= 10, "{n_matched} of {}", best.len());
}

/// The straight way leads through the disc, the cost leads around it.
#[test]
fn a_disc_to_keep_out_of_is_driven_around() {
    let nearest_m = |mut decide: Box<dyn FnMut(&Input<'_>) -> Decision>| {
        let (map, stepper) = (level(), Stepper::new(&model(), STEP_S, 1.0));
        let (mut state, mut nearest_m) = (State::default(), f64::INFINITY);
        for cycle in 0..150 {
            let decision = decide(&Input { state, objective: goal([12.0, 0.0]), ..input(&map, cycle) });
            if matches!(decision, Decision::Hold(_)) {
                return nearest_m;
            }
            let command = decision.command(Command::default());
            state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut [], 0);
            nearest_m = nearest_m.min((state.x_m - 6.0).hypot(state.y_m - 0.2));
        }
        panic!("not there: {state:?}")
    };
    let mut without = controller(((), ()));
    assert!(nearest_m(Box::new(move |input| without.decide(input))) < 0.8);
    let disc = KeepOut { centre_m: [6.0, 0.2], radius_m: 1.5 };
    let mut with = controller(((PerStep(0.0), PerStep(0.0), disc), ()));
    let kept_m = nearest_m(Box::new(move |input| with.decide(input)));
    assert!(kept_m > 1.4, "{kept_m} m");
}

/// What ends north costs: the plan bends south, and the other way round.
#[test]
fn a_cost_of_whole_rollouts_bends_the_plan() {
    let map = level();
    let north_m = |price_s_per_m: f32| {
        let mut controller = controller(((), NotNorth(price_s_per_m)));
        for cycle in 0..5 {
            controller.decide(&input(&map, cycle));
        }
        controller.nominal_trajectory(map.view()).last().unwrap().y_m
    };
    assert!(north_m(2.0) < -0.3 && north_m(-2.0) > 0.3, "{} {}", north_m(2.0), north_m(-2.0));
}

#[test]
fn a_cost_that_is_no_number_leaves_the_rollout_out() {
    let map = level();
    let mut controller = controller(((), Broken));
    assert!(matches!(controller.decide(&input(&map, 0)), Decision::Drive(_)));
    assert_eq!(controller.diagnostics().n_non_finite, 100);
}

/// Lateral acceleration and reverse as the controller prices them, but over the steps that it kept, and a price for what
/// is asked for.
struct Retold {
    lateral_max_mps2: f32,
    lateral_s: f32,
    reverse_s: f32,
}

impl RolloutCost for Retold {
    const KEEPS_STEPS: bool = true;

    fn add(&self, _: &[Future], _: &mut [f32]) {}

    fn add_traced(&self, trace: &Trace<'_>, added_s: &mut [f32]) {
        assert_eq!((trace.n_rollouts(), trace.n_steps()), (1024, 50));
        assert!(trace.step(1024, 0).is_none() && trace.step(0, 50).is_none());
        for (rollout, added_s) in added_s.iter_mut().enumerate() {
            for step in (0..trace.n_steps()).filter_map(|t| trace.step(rollout, t)) {
                let is_sideways = (step.speed_mps * step.yaw_rate_radps).abs() > self.lateral_max_mps2;
                let lateral_s = if is_sideways { self.lateral_s } else { 0.0 };
                let reverse_s = if step.speed_mps < 0.0 { self.reverse_s } else { 0.0 };
                *added_s += if step.is_under_way { lateral_s + reverse_s } else { 0.0 };
            }
        }
    }
}

/// A term of the controller's own and its copy over the kept steps come to the same, on every instruction set, and the
/// rollouts that are kept are those of the controller that keeps none.
#[test]
fn a_copy_of_a_term_over_the_steps_that_were_kept_costs_the_same() {
    let map = rough(3);
    let own = mppi::Costs { lateral_s: 0.7, reverse_s: 0.4, ..Config::default().costs };
    let none = mppi::Costs { lateral_s: 0.0, reverse_s: 0.0, ..own };
    let mut limits = model().limits;
    (limits.reverse_speed_max_mps, limits.lateral_acceleration_max_mps2) = (1.0, 0.3);
    let model = Model { limits, ..model() };
    for isa in Isa::SETS {
        let config = |costs| Config { isa, costs, ..Config::default() };
        let Ok(mut compiled) = Controller::new(config(own), model.clone(), 3) else { continue };
        let retold = Retold { lateral_max_mps2: 0.3, lateral_s: 0.7, reverse_s: 0.4 };
        let mut kept = Controller::with_costs(config(none), model.clone(), ((), retold), 3).unwrap();
        for cycle in 0..3 {
            let (decided, expected) =
                (kept.decide(&input(&map, cycle)), compiled.decide(&input(&map, cycle)));
            let (Decision::Drive(decided), Decision::Drive(expected)) = (decided, expected) else { panic!() };
            assert!(
                (decided.speed_mps - expected.speed_mps).abs() < 1e-4,
                "{isa:?} {decided:?} {expected:?}"
            );
            assert!((decided.steering_rad - expected.steering_rad).abs() < 1e-4, "{decided:?} {expected:?}");
            let terms = compiled.diagnostics().mean_terms_s;
            let paid_s = [CostTerm::Lateral, CostTerm::Reverse].map(|term| terms[term as usize]);
            assert!(paid_s.iter().all(|paid_s| *paid_s > 0.01), "there is something to pay: {paid_s:?}");
            let expected_s: f32 = paid_s.iter().sum();
            let found_s = added_s(&kept);
            assert!((found_s - expected_s).abs() < 1e-4 * expected_s, "{isa:?} {found_s} {expected_s}");
        }
    }
}

/// What is kept of a step is where it ends, in the map frame, and the last one is the end that is told.
#[test]
fn kept_steps_lead_from_the_start_to_the_end() {
    struct Recorded(std::sync::Mutex<Vec<(MotionState, Vec<MotionState>, MotionState)>>);
    impl RolloutCost for Recorded {
        const KEEPS_STEPS: bool = true;
        fn add(&self, futures: &[Future], _: &mut [f32]) {
            let ends = futures.iter().map(|future| (MotionState::default(), Vec::new(), future.end));
            *self.0.lock().unwrap() = ends.collect();
        }
        fn add_traced(&self, trace: &Trace<'_>, _: &mut [f32]) {
            for (rollout, (start, steps, _)) in self.0.lock().unwrap().iter_mut().enumerate() {
                *start = trace.start();
                *steps = (0..50).map(|t| trace.step(rollout, t).unwrap().state).collect();
            }
        }
    }
    let map = level();
    let mut controller = controller(((), Recorded(std::sync::Mutex::default())));
    let state = State { x_m: 1.0, y_m: -2.0, yaw_rad: 0.4, speed_mps: 1.0, ..State::default() };
    controller.decide(&Input { state, ..input(&map, 0) });
    let kept = controller.rollout_cost_mut().0.lock().unwrap().clone();
    assert_eq!(kept.len(), 1024);
    for (start, steps, end) in kept {
        assert_eq!((start.x_m, start.y_m, start.yaw_rad), (1.0, -2.0, 0.4));
        assert_eq!(*steps.last().unwrap(), end);
        let ways_m = std::iter::once(&start)
            .chain(&steps)
            .zip(&steps)
            .map(|(from, to)| (to.x_m - from.x_m).hypot(to.y_m - from.y_m));
        assert!(ways_m.fold(0.0, f64::max) < 2.0 * STEP_S + 1e-3);
    }
}
