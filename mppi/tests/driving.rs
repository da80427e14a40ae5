//! What the controller does with a vehicle: closed forms on level ground, and the ways in which ground can be bad.

mod fixture;

use bicycle::effect::{RollingDrag, SpeedLoop};
use bicycle::{Command, Decision, Effect, HoldReason, Limits, Model, State, StopReason};
use fixture::{STEP_S, block, cell, drive, goal, level, model};
use mppi::{
    Config, Controller, CostToGo, CostToGoConfig, Input, Objective, Recovery, ReferencePath, Rollout,
    Terminal,
};
use traversability::{FrictionLimit, GridGeometry, Risk, RiskMap, RiskMapView, SpeedLimit};

fn smooth() -> Config {
    Config::default()
}

fn standing() -> State {
    State::default()
}

/// 9.5 m to the goal's rim at 2 m/s, 1 s of acceleration at 2 m/s2 on the way: 4.75 + 0.5 s are the least.
#[test]
fn a_straight_drive_takes_little_more_than_the_least_time() {
    let drive = drive(&smooth(), &model(), &level(), goal([10.0, 0.0]), (standing(), 120));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    let time_s = (drive.states.len() - 1) as f64 * STEP_S;
    assert!((5.25..6.8).contains(&time_s), "{time_s} s");
    assert!(drive.states.iter().all(|state| state.y_m.abs() < 0.7));
}

/// Half the traction, half the speed.
#[test]
fn half_the_traction_takes_twice_the_time() {
    let risk = Risk { linear_traction: 0.5, ..Risk::NONE };
    let mut map = level();
    map.fill(|risks, _| risks.fill(risk));
    let drive = drive(&smooth(), &model(), &map, goal([10.0, 0.0]), (standing(), 200));
    let time_s = (drive.states.len() - 1) as f64 * STEP_S;
    assert!((9.5 + 0.5..13.0).contains(&time_s), "{time_s} s");
}

#[test]
fn commands_keep_the_limits_of_the_actuators_from_the_measured_state_on() {
    let map = level();
    let config = Config { tracking_s: 0.0, ..smooth() };
    let start = State { speed_mps: 0.7, steering_rad: -0.2, ..standing() };
    let drive = drive(&config, &model(), &map, goal([3.0, 8.0]), (start, 60));
    let mut before = [0.7, -0.2];
    for decision in &drive.decisions {
        let Decision::Drive(Command { speed_mps, steering_rad }) = *decision else { continue };
        // 2 m/s2 and 1 rad/s over 0.1 s.
        assert!((f64::from(speed_mps) - before[0]).abs() < 0.2 + 1e-5);
        assert!((f64::from(steering_rad) - before[1]).abs() < 0.1 + 1e-5);
        assert!((-1.0..=2.0).contains(&speed_mps) && steering_rad.abs() <= 0.5);
        before = [f64::from(speed_mps), f64::from(steering_rad)];
    }
}

/// The speed loop closes 1 m/s of distance to the command with 1 m/s2 and drag takes 1.2: the vehicle moves only if the
/// command may run ahead farther than the second's half that actuators without a lag are given at 2 m/s2.
#[test]
fn commands_run_ahead_as_far_as_the_model_lags() {
    let mut model = model();
    model.effects = vec![
        Effect::SpeedLoop(SpeedLoop { time_constant_s: 1.0 }),
        Effect::RollingDrag(RollingDrag { deceleration_mps2: 1.2 }),
    ];
    let drive = drive(&smooth(), &model, &level(), goal([5.0, 0.0]), (standing(), 150));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
}

#[test]
fn a_blocked_stripe_is_driven_around() {
    let mut map = level();
    let blocked = |x_m: f64, y_m: f64| (4.0..5.0).contains(&x_m) && y_m.abs() < 2.0;
    block(&mut map, blocked);
    let drive = drive(&smooth(), &model(), &map, goal([10.0, 0.0]), (standing(), 200));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    let touched = |state: &State| map.view().risk(cell(&map, state.x_m, state.y_m), 0).roll_rad > 1.0;
    assert!(!drive.states.iter().any(touched));
}

/// A wall of 24 m before the goal: the straight line leads into it, the field leads around.
#[test]
fn the_cost_to_go_field_leads_around_what_the_horizon_cannot_see() {
    let mut map = level();
    block(&mut map, |x_m, y_m| (5.0..6.0).contains(&x_m) && (-12.0..12.0).contains(&y_m));
    let mut field = CostToGo::new(CostToGoConfig::default(), &model().limits, 160, 160).unwrap();
    field.update(map.view(), [10.0, 0.0], 0.0).unwrap();
    let terminal = Terminal::CostToGo(field.view());
    let objective = Objective::Goal { goal_m: [10.0, 0.0], tolerance_m: 0.5, terminal };
    let drive = drive(&smooth(), &model(), &map, objective, (standing(), 500));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
}

/// Without a reverse gear at 1 m/s a horizon of 5 s is less than half a circle of R = 2 m / tan(0.5) = 3.66 m, at whose
/// end the vehicle is farther from a goal 15 m behind than at its start. The shortest way (Dubins 1957) is an arc of
/// 2 pi - 2 acos(R / d), d = hypot(15, R), and the tangent of 15 m: 28.2 m with 0.5 m less for the tolerance, 28 s. Half a
/// second to gather speed and one to steer, and a sixth for what the mean of clipped samples leaves of the tightest turn.
#[test]
fn a_goal_behind_is_turned_around_for_though_the_horizon_is_shorter_than_the_turn() {
    let limits = Limits { speed_max_mps: 1.0, reverse_speed_max_mps: 0.0, ..model().limits };
    let model = Model { limits, ..model() };
    let map = level();
    let mut field = CostToGo::new(CostToGoConfig::default(), &model.limits, 160, 160).unwrap();
    field.update(map.view(), [-15.0, 0.0], 0.0).unwrap();
    let terminal = Terminal::CostToGo(field.view());
    let objective = Objective::Goal { goal_m: [-15.0, 0.0], tolerance_m: 0.5, terminal };
    let drive = drive(&smooth(), &model, &map, objective, (standing(), 400));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    let time_s = (drive.states.len() - 1) as f64 * STEP_S;
    assert!((27.5..7.0 / 6.0 * 28.0 + 1.5).contains(&time_s), "{time_s} s");
}

#[test]
fn a_goal_close_behind_is_reached_in_reverse_only_with_the_gear() {
    let run = |reverse_speed_max_mps: f64| {
        let limits = Limits { reverse_speed_max_mps, ..model().limits };
        let model = Model { limits, ..model() };
        drive(&smooth(), &model, &level(), goal([-3.0, 0.0]), (standing(), 80))
    };
    let with = run(1.0);
    assert_eq!(with.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    assert!(with.states.iter().any(|state| state.speed_mps < -0.3));
    assert!(run(0.0).states.iter().all(|state| state.speed_mps >= 0.0));
}

/// Half a metre of ground without traction lies before the vehicle; it can only come free backwards, and does so
/// when its patience ends, though driving on looks no worse on the map that it is given.
#[test]
fn a_stuck_vehicle_backs_up() {
    let recovery = Recovery { patience_s: 1.0, progress_m: 0.3, distance_m: 1.0, duration_s: 3.0 };
    let config = Config { recovery, ..smooth() };
    let map = level();
    let mut controller = Controller::new(config, model(), 5).unwrap();
    let mut backed_up = 0;
    for cycle in 0..30 {
        // The wheels turn as they are asked to, but the vehicle stays.
        let input = Input {
            state: standing(),
            elapsed_s: if cycle == 0 { 0.0 } else { STEP_S },
            map: map.view(),
            objective: goal([10.0, 0.0]),
            cycle,
        };
        let decision = controller.decide(&input);
        let is_recovering = controller.diagnostics().is_recovering;
        if cycle != 10 {
            assert_eq!(is_recovering, cycle > 10, "patience ends with the tenth or eleventh cycle");
        }
        if let Decision::Drive(command) = decision {
            backed_up += usize::from(is_recovering && command.speed_mps < 0.0);
        }
    }
    assert!(backed_up > 10, "{backed_up}");
}

/// At 0.5 m/s the horizon of 5 s reaches a metre, where arriving early is what gains, and not 4 m, where a metre gains 1 s
/// and would be priced at 2 s. Half the horizon is driven, with a quarter of a second to gather speed.
#[test]
fn a_slow_reverse_gear_backs_up_without_delay() {
    for (distance_m, least_m) in [(1.0, 0.65), (4.0, 0.9)] {
        let recovery = Recovery { patience_s: 1.0, progress_m: 0.3, distance_m, duration_s: 4.0 };
        let model = Model { limits: Limits { reverse_speed_max_mps: 0.5, ..model().limits }, ..model() };
        let mut controller = Controller::new(Config { recovery, ..smooth() }, model, 5).unwrap();
        let map = level();
        let mut state = standing();
        for cycle in 0..36 {
            let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
            let input = Input { state, elapsed_s, map: map.view(), objective: goal([10.0, 0.0]), cycle };
            let decision = controller.decide(&input);
            // The ground holds the vehicle until it is to back up.
            if let (true, Decision::Drive(command)) = (controller.diagnostics().is_recovering, decision) {
                state.speed_mps = f64::from(command.speed_mps);
                state.x_m += state.speed_mps * STEP_S;
            }
        }
        assert!(-state.x_m > least_m, "{distance_m}: {}", state.x_m);
    }
}

#[test]
fn a_vehicle_within_an_obstacle_is_let_out() {
    let mut map = level();
    block(&mut map, |x_m, y_m| x_m.abs() < 1.0 && y_m.abs() < 1.0);
    let drive = drive(&smooth(), &model(), &map, goal([8.0, 0.0]), (standing(), 150));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
}

#[test]
fn a_vehicle_walled_in_at_arm_s_length_stops() {
    let mut map = level();
    // Blocked from 0.5 m on all around: from 2 m/s at 2 m/s2 it takes 1 m to stop.
    block(&mut map, |x_m, y_m| x_m.hypot(y_m) > 0.5);
    let mut controller = Controller::new(smooth(), model(), 5).unwrap();
    let state = State { speed_mps: 2.0, ..standing() };
    let objective = goal([8.0, 0.0]);
    let input = Input { state, elapsed_s: 0.0, map: map.view(), objective, cycle: 0 };
    assert_eq!(controller.decide(&input), Decision::Stop(StopReason::NoFeasibleRollout));
}

#[test]
fn rollouts_creep_beyond_the_border() {
    let map = level();
    let config = Config { n_steps: 100, ..smooth() };
    let mut controller = Controller::new(config, model(), 5).unwrap();
    // Two metres from the east border of the 40 m map, headed for a goal far beyond.
    let state = State { x_m: 18.0, speed_mps: 2.0, ..standing() };
    let input = Input { state, elapsed_s: 0.0, map: map.view(), objective: goal([99.0, 0.0]), cycle: 0 };
    controller.decide(&input);
    let rollouts = controller.best_rollouts(1024, map.view());
    let furthest_m = |rollout: &Rollout| rollout.states.iter().map(|state| state.x_m).fold(0.0, f64::max);
    // A step of 0.2 m from the last inner cell reaches into the ring from 19.75 m on; from there a tenth of it is left, for
    // less than the 89 of 100 steps that two metres leave.
    assert!(rollouts.iter().all(|rollout| furthest_m(rollout) < 19.95 + 89.0 * 0.02));
    assert!(rollouts.iter().filter(|rollout| furthest_m(rollout) > 19.75).count() > 100);
}

#[test]
fn lateral_acceleration_is_kept_at_speed() {
    let limits = Limits {
        speed_max_mps: 6.0,
        lateral_acceleration_max_mps2: 1.0,
        acceleration_max_mps2: 4.0,
        ..model().limits
    };
    let model = Model { limits, ..model() };
    let start = State { speed_mps: 4.0, ..standing() };
    let drive = drive(&smooth(), &model, &level(), goal([6.0, 9.0]), (start, 120));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    for state in &drive.states {
        let lateral_mps2 = state.speed_mps.powi(2) * state.steering_rad.tan() / 2.0;
        assert!(lateral_mps2.abs() < 1.3, "{lateral_mps2} m/s2");
    }
}

/// Three quarters of the grip of tyres with a friction coefficient of 0.272 are 2 m/s2.
#[test]
fn lateral_acceleration_is_kept_below_a_known_grip() {
    let limits = Limits {
        speed_max_mps: 6.0,
        lateral_acceleration_max_mps2: 9.0,
        acceleration_max_mps2: 4.0,
        ..model().limits
    };
    let values = [0.272, 1.0, 10.0, 0.0];
    let model = Model { limits, effects: vec![Effect::from_values("friction", values).unwrap()], ..model() };
    let start = State { speed_mps: 4.0, ..standing() };
    let drive = drive(&smooth(), &model, &level(), goal([6.0, 9.0]), (start, 160));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    let lateral_mps2 = drive.states.windows(2).map(|two| {
        let turned_rad = (two[1].yaw_rad - two[0].yaw_rad).sin();
        (two[1].speed_mps * turned_rad / STEP_S).abs()
    });
    let most_mps2 = lateral_mps2.fold(0.0, f64::max);
    assert!(most_mps2 < 2.2, "{most_mps2} m/s2 of 2.67");
}

/// Around the same corner, ground that is known to hold 0.2 is asked for less than half as much as ground of which nobody
/// has said anything, and nobody asks for it where no price says so.
#[test]
fn ground_that_is_known_to_be_slippery_is_turned_on_slowly() {
    let limits = Limits {
        speed_max_mps: 6.0,
        lateral_acceleration_max_mps2: 9.0,
        acceleration_max_mps2: 4.0,
        ..model().limits
    };
    let model = Model { limits, ..model() };
    let mut slippery = level();
    slippery.ground_mut().iter_mut().for_each(|ground| ground.friction = FrictionLimit::new(0.2));
    let most_mps2 = |grip_s: f64, map: &RiskMap| {
        let config = Config { costs: mppi::Costs { grip_s, ..smooth().costs }, ..smooth() };
        let start = State { speed_mps: 3.0, ..standing() };
        let drive = drive(&config, &model, map, goal([6.0, 9.0]), (start, 200));
        assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
        let lateral_mps2 = drive
            .states
            .iter()
            .map(|state| (state.speed_mps.powi(2) * state.steering_rad.tan() / model.wheelbase_m).abs());
        lateral_mps2.fold(0.0, f64::max)
    };
    let [told, untold, unpriced] =
        [(0.5, &slippery), (0.5, &level()), (0.0, &slippery)].map(|(grip_s, map)| most_mps2(grip_s, map));
    assert!(told < 0.5 * untold && told < 0.5 * unpriced, "{told} {untold} {unpriced} m/s2");
}

/// A stripe across the way that may be driven over with 1.3 m/s, of a vehicle that drives 2 m/s and slows down with 2 m/s2.
#[test]
fn ground_is_driven_over_no_faster_than_it_may_be() {
    let mut map = level();
    let stripe = |x_m: f64| (4.0..5.5).contains(&x_m);
    let geometry = *map.geometry();
    for (index, ground) in map.ground_mut().iter_mut().enumerate() {
        let [x_m, _] = geometry.centre_m(geometry.cell(index));
        ground.speed = if stripe(x_m) { SpeedLimit::new(1.3) } else { SpeedLimit::NONE };
    }
    let driven = |overspeed_s: f64| {
        let config = Config { costs: mppi::Costs { overspeed_s, ..smooth().costs }, ..smooth() };
        let drive = drive(&config, &model(), &map, goal([9.0, 0.0]), (standing(), 200));
        assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
        let fastest_mps = |is_within: bool| {
            let there = drive.states.iter().filter(|state| stripe(state.x_m) == is_within);
            there.map(|state| state.speed_mps).fold(0.0, f64::max)
        };
        [true, false].map(fastest_mps)
    };
    let ([on_stripe, beside], [unpriced, _]) = (driven(20.0), driven(0.0));
    assert!(on_stripe < 1.4 && beside > 1.7 && unpriced > 1.7, "{on_stripe} {beside} {unpriced} m/s");
}

#[test]
fn a_path_is_followed_to_its_end() {
    let points_m: Vec<[f64; 2]> =
        (0..=60).map(|i| f64::from(i) * 0.2).map(|x_m| [x_m, 1.5 * (x_m / 2.5).sin()]).collect();
    let path = ReferencePath { points_m: &points_m, speed_mps: 1.2, tolerance_m: 0.4 };
    let start = State { yaw_rad: 0.54, ..standing() };
    let drive = drive(&smooth(), &model(), &level(), Objective::Path(path), (start, 300));
    assert_eq!(drive.decisions.last(), Some(&Decision::Hold(HoldReason::AtGoal)));
    let across_m = |state: &State| (state.y_m - 1.5 * (state.x_m / 2.5).sin()).abs();
    let worst_m = drive.states.iter().map(across_m).fold(0.0, f64::max);
    assert!(worst_m < 0.5, "{worst_m} m off the path");
}

#[test]
fn what_cannot_be_planned_with_stops_or_holds() {
    let map = level();
    let mut controller = Controller::new(smooth(), model(), 5).unwrap();
    let mut decide = |state: State, objective: Objective<'_>, map: RiskMapView<'_>| {
        controller.decide(&Input { state, elapsed_s: 0.1, map, objective, cycle: 0 })
    };
    let ahead = goal([5.0, 0.0]);
    let broken = State { yaw_rad: f64::NAN, ..standing() };
    assert_eq!(decide(broken, ahead, map.view()), Decision::Stop(StopReason::NonFiniteInput));
    let nowhere = goal([f64::INFINITY, 0.0]);
    assert_eq!(decide(standing(), nowhere, map.view()), Decision::Stop(StopReason::NonFiniteInput));
    let outside = State { x_m: 30.0, ..standing() };
    assert_eq!(decide(outside, ahead, map.view()), Decision::Stop(StopReason::OutsideMap));
    let arrived = State { x_m: 4.6, ..standing() };
    assert_eq!(decide(arrived, ahead, map.view()), Decision::Hold(HoldReason::AtGoal));
    let nothing = GridGeometry { n_rows: 0, n_cols: 0, ..*map.geometry() };
    let empty = RiskMapView::new(nothing, 13, &[], &[]).unwrap();
    assert_eq!(decide(standing(), ahead, empty), Decision::Hold(HoldReason::NoMap));
    assert!(matches!(decide(standing(), ahead, map.view()), Decision::Drive(_)), "and recovers");
}

#[test]
fn broken_numbers_in_the_map_are_quarantined() {
    let mut map = level();
    let geometry = *map.geometry();
    let n_yaws = map.view().n_yaws;
    map.fill(|risks, _| {
        for (index, risks) in risks.chunks_exact_mut(n_yaws).enumerate() {
            // Everything north of y = 1 m is broken.
            if geometry.centre_m(geometry.cell(index))[1] > 1.0 {
                risks.fill(Risk { linear_traction: f32::NAN, ..Risk::NONE });
            }
        }
    });
    let mut controller = Controller::new(smooth(), model(), 5).unwrap();
    let input =
        Input { state: standing(), elapsed_s: 0.0, map: map.view(), objective: goal([8.0, 0.0]), cycle: 0 };
    assert!(matches!(controller.decide(&input), Decision::Drive(_)));
    let diagnostics = controller.diagnostics();
    assert!(diagnostics.n_non_finite > 0 && diagnostics.n_non_finite < 1024);
    assert!(diagnostics.mean_terms_s.iter().all(|term| term.is_finite()));
    map.fill(|risks, _| risks.fill(Risk { angular_traction: f32::NAN, ..Risk::NONE }));
    let input =
        Input { state: standing(), elapsed_s: 0.0, map: map.view(), objective: goal([8.0, 0.0]), cycle: 1 };
    assert_eq!(controller.decide(&input), Decision::Stop(StopReason::NonFiniteResult));
}

/// The field of times to go has an answer for every place, the goal's latch for every distance: neither may be taken for
/// the cost of a future that is nowhere.
#[test]
fn who_is_nowhere_has_no_time_to_go() {
    let mut map = level();
    let GridGeometry { n_rows, n_cols, .. } = *map.geometry();
    let mut field = CostToGo::new(CostToGoConfig::default(), &model().limits, n_rows, n_cols).unwrap();
    field.update(map.view(), [8.0, 0.0], 0.0).unwrap();
    let terminal = Terminal::CostToGo(field.view());
    let objective = Objective::Goal { goal_m: [8.0, 0.0], tolerance_m: 0.5, terminal };
    map.fill(|risks, _| risks.fill(Risk { linear_traction: f32::NAN, ..Risk::NONE }));
    let mut controller = Controller::new(smooth(), model(), 5).unwrap();
    let input = Input { state: standing(), elapsed_s: 0.0, map: map.view(), objective, cycle: 0 };
    assert_eq!(controller.decide(&input), Decision::Stop(StopReason::NonFiniteResult));
    assert_eq!(controller.diagnostics().n_non_finite, 1024);
}

/// Unknown attitude is not level ground.
#[test]
fn an_attitude_that_is_not_a_number_counts_as_too_steep() {
    let mut map = level();
    map.fill(|risks, _| risks.fill(Risk { roll_rad: f32::NAN, ..Risk::NONE }));
    let mut controller = Controller::new(smooth(), model(), 5).unwrap();
    let input =
        Input { state: standing(), elapsed_s: 0.0, map: map.view(), objective: goal([8.0, 0.0]), cycle: 0 };
    controller.decide(&input);
    assert_eq!(controller.diagnostics().n_feasible, 0);
}

/// Commands on their way for 0.3 s: the plan starts where they will have led. The oracle
/// follows the three commands before the last with 2 m/s2.
#[test]
fn the_plan_starts_where_the_commands_on_their_way_lead() {
    let config = Config { delay_s: 0.3, ..smooth() };
    let map = level();
    let mut controller = Controller::new(config, model(), 5).unwrap();
    let mut sent = Vec::new();
    for cycle in 0..4 {
        let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
        let input =
            Input { state: standing(), elapsed_s, map: map.view(), objective: goal([10.0, 0.0]), cycle };
        let Decision::Drive(command) = controller.decide(&input) else { panic!("level ground") };
        sent.push(f64::from(command.speed_mps));
    }
    let start = controller.nominal_trajectory(map.view())[0];
    let (mut speed_mps, mut x_m) = (0.0f64, 0.0);
    for command_mps in &sent[..3] {
        speed_mps += (command_mps - speed_mps).clamp(-0.2, 0.2);
        x_m += 0.1 * speed_mps;
    }
    assert!((start.speed_mps - speed_mps).abs() < 1e-6 && (start.x_m - x_m).abs() < 1e-3, "{start:?} {x_m}");
    assert!(x_m > 0.02, "{sent:?}");
}

/// The same at a hundred decisions a second with commands on their way for two seconds: 200 of them are remembered. The
/// vehicle is measured at rest all the while, so that the oracle follows the commands alone.
#[test]
fn a_long_delay_is_replayed_whole_at_a_high_rate() {
    let (delay_s, period_s) = (2.0, 0.01);
    let config = Config { delay_s, n_rollouts: 64, ..smooth() };
    let map = level();
    let mut controller = Controller::new(config, model(), 5).unwrap();
    let mut sent = Vec::new();
    for cycle in 0..300 {
        let elapsed_s = if cycle == 0 { 0.0 } else { period_s };
        let input =
            Input { state: standing(), elapsed_s, map: map.view(), objective: goal([10.0, 0.0]), cycle };
        let Decision::Drive(_) = controller.decide(&input) else { panic!("level ground") };
        // Told something of its own instead: a speed that rises and falls, and differs in every cycle.
        let speed_mps = 1.0 + (0.02 * cycle as f32).sin();
        controller.note_sent(Command { speed_mps, steering_rad: 0.0 }, 0.0);
        sent.push(f64::from(speed_mps));
    }
    let input = Input {
        state: standing(),
        elapsed_s: period_s,
        map: map.view(),
        objective: goal([10.0, 0.0]),
        cycle: 300,
    };
    controller.decide(&input);
    let start = controller.nominal_trajectory(map.view())[0];
    let (mut speed_mps, mut x_m) = (0.0f64, 0.0);
    for step in 0..20 {
        // Steps of 0.1 s; in force in the middle of each is what was sent (2 - 0.05 - 0.1 step) s ago.
        let age_s = delay_s - STEP_S * (f64::from(step) + 0.5);
        let command_mps = sent[300 - (age_s / period_s).round() as usize];
        speed_mps += (command_mps - speed_mps).clamp(-0.2, 0.2);
        x_m += STEP_S * speed_mps;
    }
    // The middle of a step lies on the moment of a sending: one command earlier or later is 0.02 m/s.
    assert!((start.speed_mps - speed_mps).abs() < 0.03 && (start.x_m - x_m).abs() < 0.05, "{start:?} {x_m}");
}

#[test]
fn settings_that_make_no_controller_are_refused_with_field_range_and_value() {
    let told = |config: Config| match Controller::new(config, model(), 1) {
        Ok(_) => panic!("must be refused"),
        Err(error) => error.to_string(),
    };
    assert_eq!(
        told(Config { step_s: 1e-9, ..smooth() }),
        "step_s: expected a time from 0.01 to 1 s, found 0.000000001"
    );
    assert_eq!(
        told(Config { period_min_s: 1e-9, ..smooth() }),
        "period_min_s: expected a time from 0.001 to 1 s, found 0.000000001"
    );
    assert_eq!(told(Config { delay_s: 3.0, ..smooth() }), "delay_s: expected a time from 0 to 2 s, found 3");
    assert!(told(Config { tracking_s: f64::NAN, ..smooth() }).starts_with("tracking_s: expected a time"));
    let many = Config { n_rollouts: 1 << 20, n_steps: 1000, ..smooth() };
    assert_eq!(told(many), "n_rollouts x n_steps: expected at most 67108864, found 1048576000");
    // A deviation whose square is no number in f32, a noise that never changes, a cost beyond all others.
    let sampling = |change: &dyn Fn(&mut mppi::Sampling)| {
        let mut config = smooth();
        change(&mut config.sampling);
        told(config)
    };
    assert!(sampling(&|sampling| sampling.speed_std = 1e-30).starts_with("sampling.speed_std"));
    assert!(sampling(&|sampling| sampling.steering_std = 1e30).starts_with("sampling.steering_std"));
    assert!(sampling(&|sampling| sampling.correlation_s = 1e30).starts_with("sampling.correlation_s"));
    let mut config = smooth();
    config.costs.rest_speed_mps = 1e-300;
    assert!(told(config).starts_with("costs.rest_speed_mps"));
}
