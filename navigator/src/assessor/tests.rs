//! Where stuck poses lie when the localisation jumps around them.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::StuckPose;
use bicycle::Odometry;

const JUMP: Jump = Jump { step_m: [10.0, 0.0, 0.0], yaw_rad: 0.0 };
const JUMPED_AT_NS: u64 = 500;

fn assessor() -> Assessor {
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let (config, level) = (Config::for_vehicle(&vehicle), CvarLevel::new(0.5).unwrap());
    Assessor::new(&vehicle, &vehicle.limits, &config, &Belief::Nominal, level).unwrap()
}

fn surface(epoch_ns: u64, frame_at_ns: u64, shift: Jump) -> SurfaceHeader {
    SurfaceHeader {
        id: MessageId { epoch_ns, sequence: frame_at_ns },
        valid_at_ns: frame_at_ns,
        scan: MessageId::default(),
        odometry: Odometry::default(),
        frame_at_ns,
        last_odometry: MessageId::default(),
        n_odometry: 0,
        jump: None,
        shift,
    }
}

fn stuck(valid_at_ns: u64) -> StuckMessage {
    let pose = StuckPose { position_m: [1.0, 2.0], yaw_rad: 0.3 };
    StuckMessage { id: MessageId { epoch_ns: 1, sequence: valid_at_ns }, valid_at_ns, pose }
}

fn places_m(assessor: &Assessor) -> Vec<f64> {
    assessor.layer.stuck().iter().map(|(_, pose)| pose.position_m[0]).collect()
}

#[test]
fn a_stuck_pose_moves_with_the_jumps_after_it_and_with_no_others() {
    // Told of before the map of the jump, and after it.
    for is_late in [false, true] {
        let mut assessor = assessor();
        assessor.hear_surface(&surface(1, 100, Jump::NONE));
        let before = stuck(JUMPED_AT_NS - 1);
        let after = stuck(JUMPED_AT_NS);
        if !is_late {
            [before, after].iter().for_each(|stuck| assessor.hear_stuck(stuck));
        }
        assessor.hear_surface(&surface(1, JUMPED_AT_NS, JUMP));
        if is_late {
            [before, after].iter().for_each(|stuck| assessor.hear_stuck(stuck));
        }
        assert_eq!(places_m(&assessor), [11.0, 1.0], "late: {is_late}");
        // The same jump is told of again with every later map.
        assessor.hear_surface(&surface(1, JUMPED_AT_NS + 100, JUMP));
        assert_eq!(places_m(&assessor), [11.0, 1.0], "late: {is_late}");
        assessor.hear_surface(&surface(1, JUMPED_AT_NS + 200, JUMP.then(&JUMP)));
        assert_eq!(places_m(&assessor), [21.0, 11.0], "late: {is_late}");
    }
}

#[test]
fn a_surveyor_that_began_anew_counts_its_jumps_from_nothing() {
    let mut assessor = assessor();
    assessor.hear_surface(&surface(1, 100, JUMP));
    assessor.hear_stuck(&stuck(200));
    assessor.hear_surface(&surface(9, 300, Jump::NONE));
    assert_eq!(places_m(&assessor), [1.0]);
}
