//! Outcomes of episodes on constructed grounds, the stepwise interface, faults.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

mod machines;

use std::ops::ControlFlow;
use std::sync::Arc;

use bicycle::{Column, Command, Decision, HoldReason, StopReason, Vehicle};
use machines::rc_car;
use scenarios::{
    ArenaConfig, BORDER_M, Episode, EpisodeConfig, Fault, Observation, OdometryConfig, Outcome, Patch,
    ROCK_FIELD_DISTANCE_M, RockFieldConfig, RockMap, SensorFault, Split, Stribeck, Task, World, drive_log,
};
use terrain::GridGeometry;

const CRUISE: Decision = Decision::Drive(Command { speed_mps: 1.0, steering_rad: 0.0 });

/// A strip of ground 20 m long for the RC car, start at x = 2, goal at x = 18.
fn strip(height_m: impl Fn(f64) -> f64, patch: impl Fn(f64) -> Patch) -> Task {
    let geometry = GridGeometry { resolution_m: 0.05, origin: [0, 0], n_rows: 80, n_cols: 400 };
    let world = World::from_fn("strip", geometry, |x, _| height_m(x), |x, _| patch(x)).unwrap();
    Task::in_world(Arc::new(world), [2.0, 2.0, 0.0], [18.0, 2.0], 0.2)
}

fn flat() -> Task {
    strip(|_| 0.0, |_| Patch::open(Stribeck::ASPHALT))
}

fn blind(vehicle: &Vehicle) -> EpisodeConfig {
    EpisodeConfig { range_sensor: None, ..EpisodeConfig::for_vehicle(vehicle) }
}

fn episode(task: Task) -> Episode {
    Episode::new(task, &rc_car(), blind(&rc_car()), 1).unwrap()
}

fn outcome(task: Task, decision: Decision) -> (Outcome, Episode) {
    let mut episode = episode(task);
    let outcome = episode.run(|_| decision, |_| ControlFlow::Continue(())).unwrap();
    (outcome, episode)
}

#[test]
fn straight_over_flat_ground_reaches_the_goal_in_distance_over_speed() {
    let (outcome, episode) = outcome(flat(), CRUISE);
    assert_eq!(outcome, Outcome::Goal);
    // 15.8 m at 1 m/s, 0.2 s to get there at 2.5 m/s2, a few per cent of slip.
    assert!((15.8..17.0).contains(&episode.time_s()), "{}", episode.time_s());
    assert!((episode.path_length_m() - 15.8).abs() < 0.1, "{}", episode.path_length_m());
    assert_eq!(episode.trace().len() as u64, episode.n_cycles());
}

#[test]
fn pairs_of_a_rock_map_differ_and_lie_within_its_borders() {
    let field = RockFieldConfig::default();
    let map = RockMap { seed: 3, split: Split::Test, index: 2 };
    let pairs: Vec<Task> = (0..6).map(|pair| Task::on_rock_map(&field, map, pair).unwrap()).collect();
    for (index, task) in pairs.iter().enumerate() {
        let [x_m, y_m, yaw_rad] = task.start;
        assert!((task.distance_to_goal_m(x_m, y_m) - ROCK_FIELD_DISTANCE_M).abs() < 1e-9);
        let ahead_m = [x_m + 40.0 * yaw_rad.cos(), y_m + 40.0 * yaw_rad.sin()];
        assert!((ahead_m[0] - task.goal_m[0]).hypot(ahead_m[1] - task.goal_m[1]) < 1e-9, "it faces the goal");
        for at_m in [x_m, y_m].into_iter().chain(task.goal_m) {
            assert!((BORDER_M..=field.side_m - BORDER_M).contains(&at_m), "{at_m}");
        }
        for other in &pairs[..index] {
            assert!((other.start[0] - x_m).hypot(other.start[1] - y_m) > 0.1);
        }
        // The rocks are those of the map; only the pads differ.
        let elsewhere = |task: &Task| task.world.height_m(25.3, 24.1);
        let clear_m = [&pairs[0], task].map(|task| {
            let [x_m, y_m, _] = task.start;
            (x_m - 25.3).hypot(y_m - 24.1).min((task.goal_m[0] - 25.3).hypot(task.goal_m[1] - 24.1))
        });
        assert!(clear_m[0].min(clear_m[1]) < 12.0 || elsewhere(task) == elsewhere(&pairs[0]));
    }
    let again = Task::on_rock_map(&field, map, 4).unwrap();
    assert_eq!((again.start, again.goal_m), (pairs[4].start, pairs[4].goal_m));
    let small = RockFieldConfig { side_m: 47.0, ..field };
    let told = Task::on_rock_map(&small, map, 0).unwrap_err().to_string();
    assert!(told.contains("side_m") && told.contains("47"), "{told}");
}

/// A ramp of 0.25 ends 0.3 m high. At 1.2 m/s the front wheels leave it with 0.29 m/s upwards and land after
/// (0.29 + sqrt(0.29^2 + 2 * 9.81 * 0.3)) / 9.81 = 0.28 s; the rear wheels leave it 0.18 / 1.2 = 0.15 s later. Between these
/// times no wheel touches the ground, less where the nose falls onto it or the attitude ends the drive first.
#[test]
fn the_longest_time_without_a_wheel_on_the_ground_is_told() {
    let cruise = Decision::Drive(Command { speed_mps: 1.2, steering_rad: 0.0 });
    let (_, level) = outcome(flat(), cruise);
    assert_eq!(level.longest_flight_s(), 0.0);
    let ramp = |x_m: f64| if (4.0..5.2).contains(&x_m) { 0.25 * (x_m - 4.0) } else { 0.0 };
    let (_, thrown) = outcome(strip(ramp, |_| Patch::open(Stribeck::ASPHALT)), cruise);
    assert!((0.02..0.28).contains(&thrown.longest_flight_s()), "{}", thrown.longest_flight_s());
}

#[test]
fn starting_at_the_goal_is_being_there() {
    let task = Task { goal_m: [2.1, 2.0], ..flat() };
    assert_eq!(episode(task).outcome(), Some(Outcome::Goal));
}

#[test]
fn a_command_of_zero_is_stuck_after_five_seconds() {
    let (outcome, episode) = outcome(flat(), Decision::Drive(Command::default()));
    assert_eq!(outcome, Outcome::Stuck);
    assert!((episode.time_s() - 5.0).abs() < 0.11, "{}", episode.time_s());
}

#[test]
fn what_it_was_told_to_stop_does_not_make_it_stuck() {
    let mut episode = episode(flat());
    let three_s_of_stop = |observation: &Observation| match observation.valid_at_ns {
        2_000_000_000..5_000_000_000 => Decision::Stop(StopReason::StaleScan),
        _ => Decision::Drive(Command::default()),
    };
    assert_eq!(episode.run(three_s_of_stop, |_| ControlFlow::Continue(())).unwrap(), Outcome::Stuck);
    assert!((episode.time_s() - 8.0).abs() < 0.11, "{}", episode.time_s());
}

#[test]
fn a_hold_is_stuck_too_and_a_stop_is_stopped() {
    assert_eq!(outcome(flat(), Decision::Hold(HoldReason::NoMap)).0, Outcome::Stuck);
    let (stopped, episode) = outcome(flat(), Decision::Stop(StopReason::StaleScan));
    assert_eq!(stopped, Outcome::Stopped);
    assert!((episode.time_s() - 4.0).abs() < 0.11, "{}", episode.time_s());
}

#[test]
fn stops_that_come_and_go_do_not_end_a_drive() {
    let mut episode = episode(flat());
    let decide = |observation: &Observation| {
        let second = observation.valid_at_ns / 1_000_000_000;
        if second % 4 == 3 { Decision::Stop(StopReason::StaleScan) } else { CRUISE }
    };
    let outcome = episode.run(decide, |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(outcome, Outcome::Goal);
}

#[test]
fn driving_up_a_wall_of_45_degrees_breaks_the_limit_and_a_cliff_rolls_over() {
    // The RC car's pitch limit is 45 degrees; 50 degrees are steeper, and momentum carries it up a step of 0.3 m.
    let mut vehicle = rc_car();
    vehicle.limits.pitch_max_rad = 0.4;
    let ramp = strip(|x| (x - 6.0).clamp(0.0, 3.0) * 0.5, |_| Patch::open(Stribeck::ASPHALT));
    let mut up = Episode::new(ramp, &vehicle, blind(&vehicle), 1).unwrap();
    assert_eq!(up.run(|_| CRUISE, |_| ControlFlow::Continue(())).unwrap(), Outcome::AttitudeLimit);
    // tan(0.46) = 0.5: it broke the limit of 0.4 rad on the slope, front wheels first at x = 6 - 0.18 m.
    assert!((5.7..6.3).contains(&up.motion().pose.x_m), "{}", up.motion().pose.x_m);

    let cliff = strip(|x| if x < 6.0 { 2.0 } else { 0.0 }, |_| Patch::open(Stribeck::ASPHALT));
    assert_eq!(outcome(cliff, CRUISE).0, Outcome::RolledOver);
}

#[test]
fn a_slope_too_steep_for_the_friction_is_stuck_and_bushes_too_tall_are() {
    // Ice holds up to 0.4: a slope of 0.5 does not let go up.
    let icy = strip(
        |x| (x - 6.0).max(0.0) * 0.5,
        |x| if x > 5.0 { Patch::open(Stribeck::ICE) } else { Patch::open(Stribeck::ASPHALT) },
    );
    let (end, episode) = outcome(icy, CRUISE);
    // Spinning wheels hold sideways no better: it stays at the foot of the slope or slides off beside it.
    assert!(matches!(end, Outcome::Stuck | Outcome::OutOfBounds), "{end:?}");
    assert!(episode.trace().iter().all(|row| row.motion.pose.x_m < 7.5));
    let bushes = strip(
        |_| 0.0,
        |x| {
            if x > 6.0 { Patch::open(Stribeck::GRASS).overgrown(0.4) } else { Patch::open(Stribeck::ASPHALT) }
        },
    );
    assert_eq!(outcome(bushes, CRUISE).0, Outcome::Stuck);
}

#[test]
fn leaving_the_bounds_ends_it_even_where_the_world_goes_on() {
    let mut task = flat();
    task.bounds.north_east_m[0] = 10.0;
    let (outcome, episode) = outcome(task, CRUISE);
    assert_eq!(outcome, Outcome::OutOfBounds);
    assert!((episode.motion().pose.x_m - 10.0).abs() < 0.02);
}

#[test]
fn circling_runs_out_of_time() {
    let mut config = blind(&rc_car());
    config.rules.time_limit_s = 20.0;
    let mut episode = Episode::new(flat(), &rc_car(), config, 1).unwrap();
    let circle = Decision::Drive(Command { speed_mps: 0.5, steering_rad: 0.5 });
    assert_eq!(episode.run(|_| circle, |_| ControlFlow::Continue(())).unwrap(), Outcome::Timeout);
    assert!((episode.time_s() - 20.0).abs() < 0.006);
}

#[test]
fn breaking_off_ends_as_stopped_and_nothing_goes_on_after_the_end() {
    let mut episode = episode(flat());
    let until_two_seconds = |episode: &Episode| {
        if episode.time_s() > 2.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    assert_eq!(episode.run(|_| CRUISE, until_two_seconds).unwrap(), Outcome::Stopped);
    let time_s = episode.time_s();
    episode.apply(&CRUISE).unwrap();
    assert_eq!(episode.time_s(), time_s);
}

#[test]
fn a_command_that_is_no_number_is_refused() {
    let bad = Decision::Drive(Command { speed_mps: f32::NAN, steering_rad: 0.0 });
    assert!(episode(flat()).apply(&bad).is_err());
}

#[test]
fn step_by_step_is_the_same_as_run_and_repeats_bit_for_bit() {
    let task = || Task::arena(&ArenaConfig::default()).unwrap();
    let wiggle = |observation: &Observation| {
        let steering_rad = (0.3 * (observation.valid_at_ns as f64 * 1e-9).sin()) as f32;
        Decision::Drive(Command { speed_mps: 0.8, steering_rad })
    };
    let seen = |run_whole: bool| {
        let config = EpisodeConfig::for_vehicle(&rc_car());
        let mut episode = Episode::new(task(), &rc_car(), config, 4).unwrap();
        let mut observations = Vec::new();
        if run_whole {
            let keep = |episode: &Episode| {
                observations.push(format!("{:?}", episode.observe()));
                if episode.time_s() > 2.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            episode.run(wiggle, keep).unwrap();
        } else {
            while episode.time_s() <= 2.0 && episode.outcome().is_none() {
                let decision = wiggle(episode.observe());
                episode.apply(&decision).unwrap();
                observations.push(format!("{:?}", episode.observe()));
            }
        }
        (observations, format!("{:?}", episode.trace()))
    };
    let whole = seen(true);
    assert_eq!(whole, seen(false));
    assert!(whole.0.len() > 20);
}

/// Drives the arena through points with a steering proportional to the bearing.
fn through(bush_height_m: f64, points_m: &[[f64; 2]]) -> (Outcome, Episode) {
    let task = Task::arena(&ArenaConfig { bush_height_m, ..ArenaConfig::default() }).unwrap();
    let mut points_m = [points_m, &[task.goal_m]].concat();
    let mut config = blind(&rc_car());
    config.odometry = OdometryConfig::PERFECT;
    let mut episode = Episode::new(task, &rc_car(), config, 1).unwrap();
    let decide = |observation: &Observation| {
        let [x_m, y_m, _] = observation.odometry.position_m;
        let away = |point: &[f64; 2]| [point[0] - x_m, point[1] - y_m];
        if points_m.len() > 1 && away(&points_m[0])[0].hypot(away(&points_m[0])[1]) < 0.25 {
            points_m.remove(0);
        }
        let [east, north] = away(&points_m[0]);
        let bearing = north.atan2(east) - observation.odometry.attitude_rad[2];
        let steering_rad = (2.0 * bearing.sin().atan2(bearing.cos())).clamp(-0.5, 0.5) as f32;
        Decision::Drive(Command { speed_mps: 1.0, steering_rad })
    };
    let outcome = episode.run(decide, |_| ControlFlow::Continue(())).unwrap();
    (outcome, episode)
}

#[test]
fn the_arena_offers_three_ways_of_which_tall_bushes_close_one() {
    let ramp = [[2.6, 5.4], [6.9, 5.4]];
    let gap = [[2.8, 2.0], [4.2, 0.6], [5.5, 0.6], [7.0, 2.0]];
    let (low, straight) = through(0.05, &[]);
    assert_eq!(low, Outcome::Goal);
    assert_eq!(through(0.25, &[]).0, Outcome::Stuck);
    let (over, climbed) = through(0.25, &ramp);
    assert_eq!(over, Outcome::Goal);
    assert!(climbed.largest_pitch_rad() > 0.12, "{}", climbed.largest_pitch_rad());
    let (around, circled) = through(0.25, &gap);
    assert_eq!(around, Outcome::Goal);
    let times_s = [straight.time_s(), climbed.time_s(), circled.time_s()];
    println!("straight, ramp, gap: {times_s:.1?} s");
    assert!(times_s.is_sorted());
}

#[test]
fn observations_come_at_their_rates() {
    let mut episode = Episode::new(flat(), &rc_car(), EpisodeConfig::for_vehicle(&rc_car()), 1).unwrap();
    assert!(episode.observe().scan.is_some() && episode.observe().imu.is_empty());
    for cycle in 1..=10_u64 {
        episode.apply(&CRUISE).unwrap();
        let Observation { valid_at_ns, odometry, imu, scan } = episode.observe();
        assert_eq!(*valid_at_ns, cycle * 100_000_000);
        assert_eq!(odometry.valid_at_ns, *valid_at_ns);
        assert_eq!(imu.len(), 20);
        assert_eq!(imu.last().unwrap().valid_at_ns, *valid_at_ns);
        assert_eq!(scan.is_some(), cycle % 2 == 0);
        assert!(scan.as_ref().is_none_or(|scan| scan.valid_at_ns == *valid_at_ns));
    }
}

/// Observations of three seconds of cruising with a fault from second 1 to second 2.
fn with_fault(sensor: SensorFault) -> Vec<Observation> {
    let mut config = EpisodeConfig::for_vehicle(&rc_car());
    config.odometry = OdometryConfig::PERFECT;
    config.faults = vec![Fault { sensor, from_s: 1.0, until_s: 2.0 }];
    let mut episode = Episode::new(flat(), &rc_car(), config, 1).unwrap();
    let mut observations = Vec::new();
    for _ in 0..30 {
        episode.apply(&CRUISE).unwrap();
        observations.push(episode.observe().clone());
    }
    observations
}

#[test]
fn faults_come_and_go_on_time() {
    // Observation k is of time (k + 1) / 10 s: the fault is on for k = 9 to 18.
    let x_m = |o: &Observation| o.odometry.position_m[0];
    let jumped = with_fault(SensorFault::PoseJump([1.0, 0.0]));
    assert!(x_m(&jumped[9]) - x_m(&jumped[8]) > 1.0 && x_m(&jumped[19]) - x_m(&jumped[18]) < -0.8);

    let frozen = with_fault(SensorFault::FrozenOdometry);
    assert_eq!(x_m(&frozen[9]), x_m(&frozen[18]));
    assert_eq!(x_m(&frozen[8]), x_m(&frozen[18]));
    assert!(frozen[18].odometry.valid_at_ns > frozen[9].odometry.valid_at_ns);
    assert!(frozen[18].odometry.wheel_speed_mps > 0.9);
    assert!(x_m(&frozen[19]) > x_m(&frozen[18]) + 0.5);

    let silent = with_fault(SensorFault::SilentOdometry);
    assert_eq!(silent[18].odometry.valid_at_ns, silent[8].odometry.valid_at_ns);

    let n_bad = |o: &Observation| {
        let scan = o.scan.as_ref().unwrap();
        scan.points.iter().filter(|p| p.position_m.iter().any(|v| !v.is_finite())).count() * 3
            / scan.points.len()
    };
    let non_finite = with_fault(SensorFault::NonFinitePoints);
    assert_eq!((n_bad(&non_finite[7]), n_bad(&non_finite[11]), n_bad(&non_finite[21])), (0, 1, 0));

    let empty = with_fault(SensorFault::EmptyScan);
    assert!(empty[11].scan.as_ref().unwrap().points.is_empty());
    assert!(with_fault(SensorFault::MissingScan)[11].scan.is_none());
    assert!(!with_fault(SensorFault::NonFiniteOdometry)[11].odometry.is_finite());
}

#[test]
fn the_trace_is_a_drive_log() {
    let mut episode = episode(flat());
    for _ in 0..10 {
        episode.apply(&CRUISE).unwrap();
    }
    let log = drive_log(episode.trace(), "run").unwrap();
    let run = log.runs().next().unwrap();
    assert_eq!(run.time_s().len(), 10);
    assert_eq!(run.column(Column::CmdSpeed).unwrap()[3], 1.0);
    assert!((run.column(Column::X).unwrap()[0] - 2.0).abs() < 1e-6);
    assert!(run.column(Column::Vx).unwrap()[9] > 0.9);
}

#[test]
fn the_default_drive_starts_40_m_from_its_goal_heading_for_it() {
    for seed in 0..5 {
        let task = Task::rock_field(&RockFieldConfig::default(), seed).unwrap();
        let [x_m, y_m, yaw_rad] = task.start;
        assert!((task.distance_to_goal_m(x_m, y_m) - 40.0).abs() < 1e-9);
        let ahead_m = [x_m + 40.0 * yaw_rad.cos(), y_m + 40.0 * yaw_rad.sin()];
        assert!(task.distance_to_goal_m(ahead_m[0], ahead_m[1]) < 1e-9);
        // The body reaches 3 m ahead of the rear axle and a start may lie 5 m from the border.
        assert!([x_m, y_m, task.goal_m[0], task.goal_m[1]].iter().all(|v| (4.9..45.1).contains(v)));
    }
}

/// The car rolls into a wall of a metre at x = 8 m.
fn walled(height_m: f32) -> Task {
    strip(
        |_| 0.0,
        move |x| {
            let open = Patch::open(Stribeck::ASPHALT);
            if x > 8.0 { open.obstructed(height_m) } else { open }
        },
    )
}

#[test]
fn touching_an_obstacle_is_a_collision_with_its_impulse() {
    let (end, episode) = outcome(walled(1.0), CRUISE);
    assert_eq!(end, Outcome::Collision);
    // Wheels and bumper reach 0.255 m ahead, the wall begins half a cell of 0.05 m before x = 8.
    let collision = episode.collision().unwrap();
    assert!((7.68..7.78).contains(&collision.at_m[0]), "{collision:?}");
    assert!((collision.time_s - episode.time_s()).abs() < 0.2, "{collision:?} {}", episode.time_s());
    // 3 kg at 1 m/s: 3 N s until it stands, of which the brakes of the floor take nothing yet; and what the wheels push
    // meanwhile, at most 0.98 of the weight in the 35 ms that two tyres of 3000 N/m take to stop 3 kg: 1 N s.
    assert!((2.8..4.2).contains(&collision.impulse_ns), "{collision:?}");
    // Half as fast, half as hard.
    let slow = Decision::Drive(Command { speed_mps: 0.5, steering_rad: 0.0 });
    let (end, slowly) = outcome(walled(1.0), slow);
    assert_eq!(end, Outcome::Collision);
    assert!(slowly.collision().unwrap().impulse_ns < 0.8 * collision.impulse_ns);
    // A drive that touches nothing has none.
    assert_eq!(outcome(flat(), CRUISE).1.collision(), None);
}

#[test]
fn water_ends_the_drive_where_the_first_wheel_stands_in_it() {
    let (end, episode) = outcome(walled(0.0), CRUISE);
    assert_eq!(end, Outcome::InWater);
    // The front axle is 0.18 m ahead of the rear one.
    assert!((7.79..7.86).contains(&episode.motion().pose.x_m), "{:?}", episode.motion().pose);
    assert_eq!(episode.collision(), None);
}

#[test]
fn a_vehicle_whose_controller_is_still_being_started_is_neither_stuck_nor_stopped() {
    let mut config = blind(&rc_car());
    config.rules.startup_s = 10.0;
    for (waiting, end, ends_s) in [
        (Decision::Stop(StopReason::StaleCommand), Outcome::Stopped, 14.0),
        (Decision::Hold(HoldReason::NoMap), Outcome::Stuck, 15.0),
    ] {
        let mut episode = Episode::new(flat(), &rc_car(), config.clone(), 1).unwrap();
        assert_eq!(episode.run(|_| waiting, |_| ControlFlow::Continue(())).unwrap(), end);
        assert!((episode.time_s() - ends_s).abs() < 0.25, "{}", episode.time_s());
    }
    // Told to drive for a moment, it is judged as any other from then on.
    let mut episode = Episode::new(flat(), &rc_car(), config.clone(), 1).unwrap();
    let begins = |observation: &Observation| match observation.valid_at_ns {
        0 => Decision::Drive(Command::default()),
        _ => Decision::Stop(StopReason::StaleCommand),
    };
    assert_eq!(episode.run(begins, |_| ControlFlow::Continue(())).unwrap(), Outcome::Stopped);
    assert!((episode.time_s() - 4.1).abs() < 0.25, "{}", episode.time_s());
    config.rules.startup_s = f64::NAN;
    assert!(Episode::new(flat(), &rc_car(), config, 1).is_err());
}
