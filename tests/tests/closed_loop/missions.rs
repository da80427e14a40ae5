//! Missions in one loop with the plant: goals in their order, a path, and what becomes of a vehicle whose mission ends.

use bench::closed_loop::ClosedLoop;
use bicycle::{Decision, HoldReason, StopReason};
use navigator::{Order, Route};
use scenarios::Outcome;

use crate::course::{Course, ground};

fn places_m(closed: &ClosedLoop) -> Vec<[f64; 2]> {
    closed.episode.trace().iter().map(|row| [row.motion.pose.x_m, row.motion.pose.y_m]).collect()
}

fn distance_m(one_m: [f64; 2], other_m: [f64; 2]) -> f64 {
    (one_m[0] - other_m[0]).hypot(one_m[1] - other_m[1])
}

fn to_the_end(closed: &mut ClosedLoop) -> Outcome {
    loop {
        if let Some(outcome) = closed.episode.outcome() {
            return outcome;
        }
        closed.cycle().unwrap();
    }
}

#[test]
fn goals_are_passed_in_their_order_without_a_stop_and_the_last_one_ends_the_drive() {
    // The straight way from start to end is 1.5 m off the others.
    let goals_m = [[9.0, -1.5], [14.0, 1.5], [19.0, 0.0]];
    let mut course = Course::flat(6.0);
    course.episode.rules.time_limit_s = 60.0;
    let mut closed = course.begin();
    closed.follow(Route::goals(goals_m.to_vec(), 1.0).unwrap()).unwrap();
    let outcome = loop {
        if let Some(outcome) = closed.episode.outcome() {
            break outcome;
        }
        let decision = closed.cycle().unwrap().decision;
        let is_first = closed.episode.n_cycles() < 5;
        let is_last = closed.navigator.mission().progress() == (2, 3);
        let may_hold = is_last && decision == Decision::Hold(HoldReason::AtGoal);
        assert!(is_first || may_hold || matches!(decision, Decision::Drive(_)), "{decision:?}");
    };
    assert_eq!(outcome, Outcome::Goal);
    // The place where each was passed lies behind that of the one before on the way.
    let way_m = places_m(&closed);
    let passed = goals_m.map(|goal_m| way_m.iter().rposition(|at_m| distance_m(*at_m, goal_m) < 1.3));
    assert!(passed.iter().all(Option::is_some) && passed.is_sorted(), "{passed:?}");
}

#[test]
fn a_path_is_followed_at_its_speed_to_its_end() {
    // A detour of four metres to the side that no goal would ask for.
    let corners_m = [[4.0, 0.0], [8.0, 1.0], [12.0, 4.0], [16.0, 4.0], [20.0, 1.0]];
    let speed_mps = 0.7;
    let mut course = Course::flat(16.0);
    course.episode.rules.time_limit_s = 60.0;
    let mut closed = course.begin();
    closed.follow(Route::path(corners_m.to_vec(), speed_mps, 1.0).unwrap()).unwrap();
    let outcome = to_the_end(&mut closed);
    assert_eq!(
        outcome,
        Outcome::Goal,
        "{:?} {:?}",
        closed.navigator.mission().progress(),
        places_m(&closed).last()
    );
    // The turning circle of the vehicle cuts corners.
    let off_m =
        |at_m: [f64; 2]| corners_m.windows(2).map(|ends| off_line_m(at_m, ends)).fold(f64::MAX, f64::min);
    let farthest_m = places_m(&closed).into_iter().map(off_m).fold(0.0, f64::max);
    assert!(farthest_m < 1.0, "{farthest_m} m off the path");
    let time_s = closed.episode.time_s();
    // 18 m up to the tolerance at 0.7 m/s take 25 s; at the full speed of 1 m/s they would take 18 s.
    assert!((22.0..35.0).contains(&time_s), "{time_s} s");
}

fn off_line_m(at_m: [f64; 2], ends: &[[f64; 2]]) -> f64 {
    let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
    let length_m = along[0].hypot(along[1]);
    let share =
        ((at_m[0] - ends[0][0]) * along[0] + (at_m[1] - ends[0][1]) * along[1]) / (length_m * length_m);
    let share = share.clamp(0.0, 1.0);
    distance_m(at_m, [ends[0][0] + share * along[0], ends[0][1] + share * along[1]])
}

/// Up and down a slope of 0.2, which pulls with 1.9 m/s2: more than the vehicle accelerates with.
#[test]
fn on_a_slope_the_vehicle_stops_within_its_time_and_is_held() {
    for (rise, name) in [(0.2, "uphill"), (-0.2, "downhill"), (0.0, "level")] {
        for (order, expected) in [
            (Order::Cancel, Decision::Hold(HoldReason::NoMission)),
            (Order::Pause, Decision::Hold(HoldReason::Paused)),
            (Order::EmergencyStop, Decision::Stop(StopReason::EmergencyStop)),
        ] {
            let mut course = Course::along_x(ground(|x_m, _| rise * x_m, |_, _| false), 16.0);
            (course.episode.rules.immobile_s, course.episode.rules.stopped_s) = (100.0, 100.0);
            let mut closed = course.begin();
            while closed.episode.time_s() < 5.0 {
                closed.cycle().unwrap();
            }
            let speed_mps = closed.episode.motion().velocity_mps[0];
            assert!(speed_mps > 0.5, "{name}: {speed_mps} m/s");
            let (ordered_s, now_ns) = (closed.episode.time_s(), closed.episode.observe().valid_at_ns);
            closed.navigator.order(order.clone(), now_ns).unwrap().unwrap();
            let mut stood_s = None;
            let mut stood_m = [0.0; 2];
            while closed.episode.time_s() < ordered_s + 15.0 {
                assert_eq!(closed.cycle().unwrap().decision, expected, "{name}");
                let motion = closed.episode.motion();
                if stood_s.is_none() && motion.velocity_mps[0].abs() < 0.05 {
                    stood_s = Some(closed.episode.time_s() - ordered_s);
                    stood_m = [motion.pose.x_m, motion.pose.y_m];
                }
            }
            let pose = closed.episode.motion().pose;
            let moved_m = distance_m([pose.x_m, pose.y_m], stood_m);
            println!("{name:9} {order:?}: stands after {stood_s:?} s, moved {moved_m:.3} m since");
            // From 1 m/s with 1 m/s2, and half a second for cycle, servo and tyres.
            assert!(stood_s.is_some_and(|stood_s| stood_s < 1.5), "{name}: {stood_s:?} s");
            assert!(moved_m < 0.1, "{name}: moved by {moved_m} m");
        }
    }
}
