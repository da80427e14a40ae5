#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::Route;
use bicycle::{Applied, AppliedBy, Command, Odometry};

const PERIOD_NS: u64 = 1000;
const SECOND_NS: u64 = 1_000_000_000;

fn leader() -> Leader {
    Leader::new(Mission::new(0), &GuardConfig::default(), SensorModel::NEUTRAL, PERIOD_NS)
}

fn said(sequence: u64) -> Said {
    Said { at_ns: 0, sender_ns: 1, sequence }
}

fn at(x_m: f64, at_ns: u64) -> OdometryMessage {
    let odometry = Odometry { valid_at_ns: at_ns, position_m: [x_m, 0.0, 0.0], ..Odometry::default() };
    let applied = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command };
    OdometryMessage { id: MessageId::default(), odometry, applied }
}

#[test]
fn a_mission_is_said_when_it_changes_and_again_after_its_period() {
    let mut leader = leader();
    assert!(leader.is_due(0), "nobody has heard anything");
    leader.tell(MessageId::default(), 0);
    assert!(!leader.is_due(PERIOD_NS - 1) && leader.is_due(PERIOD_NS));
    let route = Route::goals(vec![[0.0, 0.0]], 1.0).unwrap();
    assert_eq!(leader.hear_order(Ok(Order::Drive(route)), said(1), 0), Ok(()));
    assert!(leader.is_due(1), "another order");
    assert!(leader.tell(MessageId::default(), 1).destination.is_some());
    leader.hear_odometry(&at(5.0, SECOND_NS));
    assert!(!leader.is_due(2), "on its way");
    leader.hear_odometry(&at(0.5, 2 * SECOND_NS));
    assert!(leader.is_due(2), "it is there");
    assert!(leader.tell(MessageId::default(), 2).is_over);
    assert_eq!(leader.time_s(), 1.0);
    assert_eq!(leader.hear_order(Err(OrderRefusal::Malformed), said(2), 3), Err(OrderRefusal::Malformed));
    assert!(leader.is_due(3), "who asked is answered");
    assert_eq!(leader.mission().refused()[&OrderRefusal::Malformed], 1);
}

/// What the guard of every other part refuses brings no vehicle to its goal.
#[test]
fn odometry_that_nobody_uses_leads_nowhere() {
    let mut leader = leader();
    let route = Route::goals(vec![[0.0, 0.0]], 1.0).unwrap();
    leader.hear_order(Ok(Order::Drive(route)), said(1), 0).unwrap();
    leader.hear_odometry(&at(5.0, 2 * SECOND_NS));
    leader.tell(MessageId::default(), 0);
    leader.hear_odometry(&at(0.0, SECOND_NS));
    assert!(!leader.is_due(1), "older than what was taken in");
    leader.hear_odometry(&at(0.0, 3 * SECOND_NS));
    assert!(leader.is_due(1));
}
