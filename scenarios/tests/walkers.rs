//! People who walk about: what a sensor sees of them, who is struck, and who could have been spared.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod machines;

use std::ops::ControlFlow;
use std::sync::Arc;

use bicycle::{Command, Decision, HoldReason, Vehicle};
use machines::rc_car;
use scenarios::{
    Episode, EpisodeConfig, Outcome, Patch, RangeSensor, RangeSensorConfig, Stribeck, Stride, Task, Walker,
    World,
};
use terrain::{GridGeometry, Pose, TerrainClass};

const CRUISE: Decision = Decision::Drive(Command { speed_mps: 1.5, steering_rad: 0.0 });
const STAND: Decision = Decision::Hold(HoldReason::NoMission);

/// Level ground 20 m long for the RC car, start at x = 2, goal at x = 18.
fn strip() -> Task {
    let geometry = GridGeometry { resolution_m: 0.05, origin: [0, 0], n_rows: 160, n_cols: 400 };
    let world = World::from_fn("strip", geometry, |_, _| 0.0, |_, _| Patch::open(Stribeck::ASPHALT)).unwrap();
    Task::in_world(Arc::new(world), [2.0, 4.0, 0.0], [18.0, 4.0], 0.2)
}

fn stands(duration_s: f64) -> Stride {
    Stride { duration_s, velocity_mps: [0.0; 2] }
}

/// From beside the way at `x_m` and `beside_m` north of it, southwards after a while.
fn crosses(x_m: f64, beside_m: f64, waits_s: f64, speed_mps: f64) -> Walker {
    let walk = Stride { duration_s: 60.0, velocity_mps: [0.0, -speed_mps] };
    Walker::new([x_m, 4.0 + beside_m], vec![stands(waits_s), walk])
}

fn sighted(vehicle: &Vehicle) -> EpisodeConfig {
    EpisodeConfig::for_vehicle(vehicle)
}

fn blind(vehicle: &Vehicle) -> EpisodeConfig {
    EpisodeConfig { range_sensor: None, ..EpisodeConfig::for_vehicle(vehicle) }
}

fn driven(config: EpisodeConfig, walker: Walker, decide: impl Fn(u64) -> Decision) -> (Outcome, Episode) {
    let config = EpisodeConfig { walkers: vec![walker], ..config };
    let mut episode = Episode::new(strip(), &rc_car(), config, 1).unwrap();
    let outcome =
        episode.run(|seen| decide(seen.valid_at_ns / 1_000_000), |_| ControlFlow::Continue(())).unwrap();
    (outcome, episode)
}

#[test]
fn who_drives_on_into_somebody_in_plain_view_could_have_stopped() {
    let standing = Walker::new([10.0, 4.1], Vec::new());
    let (outcome, episode) = driven(sighted(&rc_car()), standing, |_| CRUISE);
    assert_eq!(outcome, Outcome::WalkerStruck);
    let strike = episode.strike().unwrap();
    assert!(strike.was_avoidable, "{strike:?}");
    // The conflict is told once it is 4 s away, or once 5 m away and seen: after 1 s of driving up at the latest.
    assert!((0.2..2.5).contains(&strike.foreseen_at_s.unwrap()), "{strike:?}");
    assert!((strike.speed_mps - 1.5).abs() < 0.2 && strike.at_m == [10.0, 4.1]);
    let geometry = rc_car().geometry;
    let bumper_m = geometry.length_m - geometry.rear_overhang_m;
    let touch_m = 10.0 - (0.3_f64 * 0.3 - 0.1 * 0.1).sqrt() + 0.02;
    let gap_m = touch_m - (episode.motion().pose.x_m + bumper_m);
    assert!(gap_m.abs() < 0.05, "the front touches his side: {gap_m} m");
}

#[test]
fn nobody_who_was_never_seen_could_have_been_spared() {
    let standing = Walker::new([6.0, 4.1], Vec::new());
    let (outcome, episode) = driven(blind(&rc_car()), standing, |_| CRUISE);
    assert_eq!(outcome, Outcome::WalkerStruck);
    let strike = episode.strike().unwrap();
    assert_eq!((strike.foreseen_at_s, strike.was_avoidable), (None, false));
}

/// He stands half a metre from the car's side and jumps before it when it is nearly there: no brake is that good.
#[test]
fn who_jumps_before_the_wheels_could_not_have_been_spared() {
    let mut outcomes = Vec::new();
    for waits_s in [2.5, 2.6, 2.7, 2.8, 2.9, 3.0] {
        let (outcome, episode) = driven(sighted(&rc_car()), crosses(7.0, 0.55, waits_s, 2.0), |_| CRUISE);
        if outcome == Outcome::WalkerStruck {
            outcomes.push(episode.strike().unwrap());
        }
    }
    let spared = outcomes.iter().filter(|strike| strike.was_avoidable).count();
    let foreseen = outcomes.iter().filter(|strike| strike.foreseen_at_s.is_some()).count();
    assert!(outcomes.len() >= 2 && spared < outcomes.len() && foreseen > 0, "{outcomes:?}");
}

#[test]
fn a_vehicle_that_stands_strikes_nobody_and_who_walks_into_it_turns_round() {
    let mut config = blind(&rc_car());
    config.rules.time_limit_s = 6.0;
    config.rules.immobile_s = 20.0;
    let (outcome, episode) = driven(config, crosses(2.1, 2.0, 0.0, 1.0), |_| STAND);
    assert_eq!((outcome, episode.strike(), episode.n_walked_into()), (Outcome::Timeout, None, 1));
    let [x_m, y_m] = episode.walkers()[0].position_m();
    assert!(x_m == 2.1 && y_m > 6.5, "back where he came from: {y_m}");
}

#[test]
fn who_stops_in_time_lets_the_walker_pass_and_reaches_the_goal() {
    // He is on the way from 2.5 s to 4 s; the car waits before him.
    let walker = crosses(7.0, 3.0, 0.0, 1.0);
    let decide = |time_ms| if (1500..4500).contains(&time_ms) { STAND } else { CRUISE };
    let (outcome, episode) = driven(blind(&rc_car()), walker.clone(), decide);
    assert_eq!((outcome, episode.strike()), (Outcome::Goal, None));
    let (outcome, _) = driven(blind(&rc_car()), walker, |_| CRUISE);
    assert_eq!(outcome, Outcome::WalkerStruck, "and had there been no wait");
}

#[test]
fn a_sensor_sees_the_near_side_of_a_person_and_not_through_him() {
    let (task, vehicle) = (strip(), rc_car());
    let config = RangeSensorConfig {
        noise_m: 0.0,
        noise_per_range: 0.0,
        dropout: 0.0,
        class_confusion: 0.0,
        ..RangeSensorConfig::for_vehicle(&vehicle)
    };
    let sensor = RangeSensor::new(config, Arc::clone(&task.world), 1).unwrap();
    let pose = Pose { x_m: 6.0, y_m: 4.0, z_m: vehicle.geometry.wheel_radius_m, ..Pose::default() };
    let walkers = [[8.5, 4.3], [9.5, 4.5], [3.0, 5.0]].map(|at_m| Walker::new(at_m, Vec::new()));
    let (scan, n_returns) = sensor.scan_among(&walkers, &pose, 0, 0);
    let origin_m = config.origin_m;
    let mut counted = [0; 3];
    for point in scan.points.iter().filter(|point| point.class == TerrainClass::Obstacle) {
        let [x_m, y_m, z_m] = point.position_m.map(f64::from);
        let at_m = [x_m + 6.0, y_m + 4.0];
        let whose = walkers.iter().position(|walker| {
            let centre_m = walker.position_m();
            ((at_m[0] - centre_m[0]).hypot(at_m[1] - centre_m[1]) - 0.3).abs() < 1e-3
        });
        counted[whose.unwrap()] += 1;
        assert!((-0.01..=1.7).contains(&(z_m + pose.z_m)), "between sole and crown");
        let centre_m = walkers[whose.unwrap()].position_m();
        let facing =
            (at_m[0] - centre_m[0]) * (origin_m[0] - x_m) + (at_m[1] - centre_m[1]) * (origin_m[1] - y_m);
        assert!(facing > -1e-3, "the side that faces the sensor");
    }
    assert_eq!(counted.to_vec(), n_returns);
    assert!(counted[0] > 50 && counted[2] > 50, "{counted:?}");
    let (_, alone) = sensor.scan_among(&walkers[1..2], &pose, 0, 0);
    assert!(n_returns[1] < alone[0] / 2, "the second stands behind the first: {n_returns:?}, {alone:?}");
    assert_eq!(sensor.scan_among(&[], &pose, 3, 7).0, sensor.scan(&pose, 3, 7));
}

#[test]
fn crossings_belong_to_their_seed_and_lead_over_the_way() {
    let task = strip();
    let people = task.crossing_walkers(40, 1.5, 9);
    assert_eq!(people, task.crossing_walkers(40, 1.5, 9));
    assert_ne!(people, task.crossing_walkers(40, 1.5, 10));
    assert_eq!(people[..3], task.crossing_walkers(3, 1.5, 9), "who is there does not depend on how many are");
    let n_across = people.iter().filter(|walker| {
        let mut walker = (*walker).clone();
        let side = walker.position_m()[1] > 4.0;
        assert!((walker.position_m()[1] - 4.0).abs() > 4.0, "{walker:?}");
        (0..12_000).any(|_| {
            walker.advance(0.005);
            (walker.position_m()[1] > 4.0) != side
        })
    });
    assert!(n_across.count() >= 35, "most cross, whatever they do on the way");
}
