//! What becomes of a vehicle in one loop with the plant when its mission ends.

use bicycle::{Decision, HoldReason, StopReason};
use navigator::Order;

use crate::course::{Course, ground};

fn distance_m(one_m: [f64; 2], other_m: [f64; 2]) -> f64 {
    (one_m[0] - other_m[0]).hypot(one_m[1] - other_m[1])
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
            closed.navigator.order(order.clone(), now_ns).unwrap();
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
