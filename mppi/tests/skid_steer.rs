//! A skid-steered vehicle driven by the controller: the same controller, another model.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod fixture;

use bicycle::{
    Decision, GroundSample, HoldReason, MotionModel, MotionStepper, SkidSteer, SkidSteerCommand,
    SkidSteerLimits, SkidSteerState, StopReason,
};
use fixture::{STEP_S, block, cell, goal, level, rough};
use mppi::{Config, Controller, CostToGo, CostToGoConfig, Input, Objective, Terminal};
use traversability::{Risk, RiskMap};

fn model() -> SkidSteer {
    let limits = SkidSteerLimits {
        speed_max_mps: 2.0,
        reverse_speed_max_mps: 0.0,
        yaw_rate_max_radps: 1.5,
        acceleration_max_mps2: 2.0,
        yaw_acceleration_max_radps2: 3.0,
        lateral_acceleration_max_mps2: 3.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    SkidSteer { limits, speed_lag_s: 0.1, yaw_rate_lag_s: 0.1, turning_point_ahead_m: 0.0 }
}

fn config() -> Config {
    let mut config = Config::default();
    config.sampling.steering_std = 2.0;
    config
}

/// What a drive did.
struct Drive {
    states: Vec<SkidSteerState>,
    decisions: Vec<Decision<SkidSteerCommand>>,
}

/// The model follows its own commands, a step per cycle, until it holds or the cycles are over.
fn drive(config: &Config, map: &RiskMap, objective: Objective<'_>, n_cycles: u64) -> Drive {
    let mut controller = Controller::new(config.clone(), model(), 7).unwrap();
    let stepper = model().stepper(STEP_S, 1.0);
    let mut state = SkidSteerState::default();
    let mut drive = Drive { states: Vec::new(), decisions: Vec::new() };
    for cycle in 0..n_cycles {
        let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
        let decision = controller.decide(&Input { state, elapsed_s, map: map.view(), objective, cycle });
        drive.states.push(state);
        drive.decisions.push(decision);
        if matches!(decision, Decision::Hold(_)) {
            break;
        }
        let command = decision.command(SkidSteerCommand::default());
        let risk = map.view().risk_at(state.x_m, state.y_m, state.yaw_rad);
        let ground = GroundSample {
            linear_traction: f64::from(risk.linear_traction),
            angular_traction: f64::from(risk.angular_traction),
            ..GroundSample::FIRM
        };
        state = stepper.step_one(&state.into(), command.into(), &ground, &mut [], cycle as usize).into();
    }
    drive
}

fn has_arrived(drive: &Drive) -> bool {
    drive.decisions.last() == Some(&Decision::Hold(HoldReason::AtGoal))
}

/// 9.5 m to the goal's rim at 2 m/s, 1 s of acceleration at 2 m/s2 on the way: 4.75 + 0.5 s are the least.
#[test]
fn a_straight_drive_takes_little_more_than_the_least_time() {
    let drive = drive(&config(), &level(), goal([10.0, 0.0]), 120);
    assert!(has_arrived(&drive));
    let time_s = (drive.states.len() - 1) as f64 * STEP_S;
    assert!((5.25..6.8).contains(&time_s), "{time_s} s");
    assert!(drive.states.iter().all(|state| state.y_m.abs() < 0.7));
}

/// Without a reverse gear: it turns round in less than the circle of 3.7 m of radius that a bicycle of 2 m needs.
#[test]
fn a_goal_behind_is_turned_to() {
    let drive = drive(&config(), &level(), goal([-5.0, 0.0]), 150);
    assert!(has_arrived(&drive));
    assert!(drive.states.iter().all(|state| state.speed_mps >= 0.0));
    let widest_m = drive.states.iter().map(|state| state.x_m.max(state.y_m.abs())).fold(0.0, f64::max);
    assert!(widest_m < 3.5, "{widest_m} m");
}

#[test]
fn a_blocked_stripe_is_driven_around() {
    let mut map = level();
    block(&mut map, |x_m, y_m| (4.0..5.0).contains(&x_m) && y_m.abs() < 2.0);
    let drive = drive(&config(), &map, goal([10.0, 0.0]), 200);
    assert!(has_arrived(&drive));
    let touched = |state: &SkidSteerState| map.view().risk(cell(&map, state.x_m, state.y_m), 0).is_blocked();
    assert!(!drive.states.iter().any(touched));
}

#[test]
fn the_cost_to_go_field_leads_it_around_what_the_horizon_cannot_see() {
    let mut map = level();
    block(&mut map, |x_m, y_m| (5.0..6.0).contains(&x_m) && (-12.0..12.0).contains(&y_m));
    let mut field = CostToGo::new(CostToGoConfig::default(), &model().limits, 160, 160).unwrap();
    field.update(map.view(), [10.0, 0.0], 0.0).unwrap();
    let terminal = Terminal::CostToGo(field.view());
    let objective = Objective::Goal { goal_m: [10.0, 0.0], tolerance_m: 0.5, terminal };
    assert!(has_arrived(&drive(&config(), &map, objective, 500)));
}

#[test]
fn commands_keep_the_limits_in_the_models_own_terms() {
    let drive = drive(&Config { tracking_s: 0.0, ..config() }, &level(), goal([-3.0, 8.0]), 60);
    let mut fastest_radps = 0.0_f32;
    for decision in &drive.decisions {
        let Decision::Drive(SkidSteerCommand { speed_mps, yaw_rate_radps }) = *decision else { continue };
        assert!((0.0..=2.0).contains(&speed_mps) && yaw_rate_radps.abs() <= 1.5);
        fastest_radps = fastest_radps.max(yaw_rate_radps.abs());
    }
    assert!(fastest_radps > 0.9, "a yaw rate, not a steering angle: {fastest_radps}");
}

/// A vehicle that is told to stop while it turns is told to turn no more.
#[test]
fn where_nothing_may_be_driven_it_stops_and_turns_no_more() {
    let mut map = level();
    block(&mut map, |x_m, y_m| x_m.hypot(y_m) > 0.6);
    let mut controller = Controller::new(config(), model(), 7).unwrap();
    let state = SkidSteerState { speed_mps: 2.0, yaw_rate_radps: 0.4, ..SkidSteerState::default() };
    let input = Input { state, elapsed_s: 0.0, map: map.view(), objective: goal([10.0, 0.0]), cycle: 0 };
    assert_eq!(controller.decide(&input), Decision::Stop(StopReason::NoFeasibleRollout));
    assert!(controller.plan().all(|command| command == SkidSteerCommand::default()));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let map = rough(5);
    let of = |n_threads: usize| {
        let drive = drive(&Config { n_threads, ..config() }, &map, goal([15.0, 8.0]), 15);
        drive.decisions.iter().map(|decision| decision.command(SkidSteerCommand::default())).collect()
    };
    let alone: Vec<SkidSteerCommand> = of(1);
    assert!(alone.iter().filter(|command| command.speed_mps != 0.0).count() >= 10, "the vehicle drives");
    assert_eq!(of(3), alone);
}

/// Half the traction, half the speed.
#[test]
fn half_the_traction_takes_twice_the_time() {
    let mut map = level();
    map.fill(|risks, _| risks.fill(Risk { linear_traction: 0.5, ..Risk::NONE }));
    let drive = drive(&config(), &map, goal([10.0, 0.0]), 200);
    let time_s = (drive.states.len() - 1) as f64 * STEP_S;
    assert!(has_arrived(&drive) && (9.5 + 0.5..13.0).contains(&time_s), "{time_s} s");
}
