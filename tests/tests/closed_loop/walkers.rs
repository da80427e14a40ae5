//! People in the vehicle's way.

use std::sync::Arc;

use bench::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use bicycle::{Command, Decision, HoldReason, Model, StopReason, Vehicle};
use navigator::{Config, MovingConfig};
use scenarios::{EpisodeConfig, Outcome, Patch, Stribeck, Stride, Task, Walker, World};
use terrain::{GridGeometry, TerrainClass};
use traversability::CvarLevel;

/// Longest that somebody who has left stays on the map while rays pass where he stood [s].
const CLEARED_S: f64 = 2.0;

/// 16 m eastwards over level ground, the start at (8, 12) m.
fn closed(vehicle: &Vehicle, walkers: Vec<Walker>, moving: Option<MovingConfig>) -> ClosedLoop {
    let geometry = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 240, n_cols: 320 };
    let world = World::from_fn("level", geometry, |_, _| 0.0, |_, _| Patch::open(Stribeck::DIRT)).unwrap();
    let mut config = Config { moving, ..Config::for_vehicle(vehicle) };
    config.controller.n_threads = 1;
    let mut episode = EpisodeConfig { walkers, ..EpisodeConfig::for_vehicle(vehicle) };
    (episode.rules.immobile_s, episode.rules.stopped_s) = (60.0, 60.0);
    ClosedLoop::new(Drive {
        task: Task::in_world(Arc::new(world), [8.0, 12.0, 0.0], [24.0, 12.0], 1.0),
        vehicle,
        model: Model::of(vehicle),
        config,
        episode,
        method: Method::Physics,
        networks: None,
        corrector: None,
        map_source: MapSource::Sensed,
        level: CvarLevel::new(0.6).unwrap(),
        seed: 3,
    })
    .unwrap()
}

fn full_size() -> Vehicle {
    formats::read_vehicle("pietra_full_size").unwrap()
}

fn stands(duration_s: f64) -> Stride {
    Stride { duration_s, velocity_mps: [0.0; 2] }
}

#[test]
fn who_leaves_is_off_the_map_two_seconds_later() {
    let place_m = [13.0, 14.5];
    let (waits_s, speed_mps) = (4.0, 1.5);
    let leaves = Stride { duration_s: 20.0, velocity_mps: [0.0, speed_mps] };
    let walker = Walker::new(place_m, vec![stands(waits_s), leaves]);
    let mut closed = closed(&full_size(), vec![walker], Some(MovingConfig::default()));
    let is_obstacle = |closed: &ClosedLoop, reach_m: f64| {
        let surface = closed.navigator.surface();
        (-3..=3).flat_map(|i| (-3..=3).map(move |k| [i, k].map(|n| f64::from(n) * reach_m / 3.0))).any(
            |[east_m, north_m]| {
                let cell = surface.at(place_m[0] + east_m, place_m[1] + north_m);
                cell.is_some_and(|cell| cell.class() == TerrainClass::Obstacle)
            },
        )
    };
    let mut was_there = false;
    // Half a metre away he is when the last of him has left the circle.
    let left_s = waits_s + 1.0 + 0.8 / speed_mps;
    while closed.episode.time_s() < left_s + CLEARED_S {
        let seen = closed.episode.observe().clone();
        closed.navigator.observe(seen.valid_at_ns, &seen.odometry, seen.scan.as_deref()).unwrap();
        closed.navigator.decide(seen.valid_at_ns).unwrap();
        closed.episode.apply(&Decision::Hold(HoldReason::Paused)).unwrap();
        was_there |= closed.episode.time_s() < waits_s && is_obstacle(&closed, 0.2);
    }
    assert!(was_there, "he stood on the map");
    assert!(!is_obstacle(&closed, 0.4), "and no longer does");
}

/// He crosses the way when the vehicle would be there: straight on it strikes him, and could have stopped.
#[test]
fn a_walker_is_let_pass_and_the_goal_is_reached() {
    let vehicle = full_size();
    let crosses = || {
        let walk = Stride { duration_s: 12.0, velocity_mps: [0.0, -1.2] };
        Walker::new([15.0, 18.0], vec![stands(0.3), walk])
    };
    let mut blind = closed(&vehicle, vec![crosses()], None).episode;
    while blind.outcome().is_none() {
        blind.apply(&Decision::Drive(Command { speed_mps: 1.0, steering_rad: 0.0 })).unwrap();
    }
    assert_eq!(blind.outcome(), Some(Outcome::WalkerStruck));
    assert!(blind.strike().unwrap().was_avoidable, "{:?}", blind.strike());

    let mut closed = closed(&vehicle, vec![crosses()], Some(MovingConfig::default()));
    let mut least_m = f64::INFINITY;
    while closed.episode.outcome().is_none() {
        closed.cycle().unwrap();
        let (walker, pose) = (&closed.episode.walkers()[0], closed.episode.motion().pose);
        least_m = least_m.min(walker.clearance_m(&vehicle.geometry, &pose));
    }
    assert_eq!((closed.episode.outcome(), closed.episode.strike()), (Some(Outcome::Goal), None));
    assert_eq!(closed.episode.n_walked_into(), 0);
    assert!(least_m > 0.3, "{least_m} m");
}

/// Somebody steps before the bumper of a vehicle that drives: it stops for him, and goes on when he has gone.
#[test]
fn who_steps_before_the_bumper_is_stopped_for() {
    let vehicle = full_size();
    // He walks beside the way, as if to pass, and then across it.
    let beside = Stride { duration_s: 4.5, velocity_mps: [0.5, 0.0] };
    let across = Stride { duration_s: 6.0, velocity_mps: [0.0, -1.6] };
    let mut closed = closed(
        &vehicle,
        vec![Walker::new([14.0, 14.8], vec![beside, across])],
        Some(MovingConfig::default()),
    );
    let mut n_stops = 0;
    while closed.episode.outcome().is_none() {
        let decision = closed.cycle().unwrap().decision;
        n_stops += u32::from(decision == Decision::Stop(StopReason::MovingObstacle));
    }
    assert_eq!((closed.episode.outcome(), closed.episode.strike()), (Some(Outcome::Goal), None));
    assert!(n_stops > 0, "it stopped for him");
}
