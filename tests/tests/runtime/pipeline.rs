//! One schedule, two transports: parts that tell one another over shared memory, stepped by a clock of the test, decide and
//! map to the bit as the same parts in one object do.
//!
//! The schedule is recorded from a drive: what was measured, when each message came, and when each part worked.

mod in_process;
mod processes;
mod schedule;

use std::sync::LazyLock;

use bicycle::{HoldReason, StopReason};
use bus::ages::AgeLimits;

use crate::fixture::ages;
use in_process::{InProcess, Made, Shown};
use kinodynamics::Reason;
use processes::Processes;
use schedule::{BEGAN_NS, MILLISECOND_NS, Recorder, Schedule, Step};

static RECORDED: LazyLock<(Schedule, Vec<Made>)> = LazyLock::new(|| Recorder::new().record());

/// What the parts make of a schedule over shared memory, up to the first difference from what they are to make.
fn first_difference(
    schedule: &Schedule,
    ages: AgeLimits,
    expected: &[Made],
) -> Option<(usize, Option<Made>)> {
    let mut processes = Processes::new(ages);
    let mut expected = expected.iter();
    for (place, (at_ns, step)) in schedule.iter().enumerate() {
        for made in processes.step(*at_ns, step) {
            if expected.next() != Some(&made) {
                return Some((place, Some(made)));
            }
        }
    }
    expected.next().map(|_| (schedule.len(), None))
}

/// Everything that the parts have rules for happened.
#[test]
fn the_schedule_holds_what_there_are_rules_for() {
    let (schedule, made) = &*RECORDED;
    let decisions: Vec<Shown> = made
        .iter()
        .filter_map(|made| if let Made::Decision { record, .. } = made { Some(*record) } else { None })
        .collect();
    let n = |holds: &dyn Fn(&Shown) -> bool| decisions.iter().filter(|shown| holds(shown)).count();
    let stop = |reason: StopReason| {
        bus::message::STOP_REASONS.iter().position(|known| *known == reason).unwrap() as u32 + 1
    };
    let hold = |reason: HoldReason| {
        bus::message::HOLD_REASONS.iter().position(|known| *known == reason).unwrap() as u32 + 1
    };
    assert!(decisions.len() > 120, "{}", decisions.len());
    assert!(n(&|shown| shown.decision == 1 && shown.map_source == 1) > 50, "on learned maps: {decisions:?}");
    assert!(n(&|shown| shown.decision == 1 && shown.map_source == 2) > 5, "on physics' maps: {decisions:?}");
    for (decision, reason) in [
        (3, stop(StopReason::NonFiniteInput)),
        (3, stop(StopReason::StaleMission)),
        (2, hold(HoldReason::Paused)),
    ] {
        assert!(n(&|shown| (shown.decision, shown.reason) == (decision, reason)) > 0, "{decision} {reason}");
    }
    let late = runtime::convert::AS_PLANNED + Reason::ImuLate as u32;
    assert!(n(&|shown| matches!(shown.correction, 1 | 2)) > 30, "corrected: {decisions:?}");
    assert!(n(&|shown| shown.correction == late) > 0, "without the unit: {decisions:?}");
    let knows_stuck = |made: &&Made| matches!(made, Made::Risk { stuck, .. } if *stuck > 0);
    assert!(made.iter().filter(knows_stuck).count() > 3, "it got stuck");
    assert!(schedule.len() > 3000, "{}", schedule.len());
}

#[test]
fn processes_decide_and_map_to_the_bit_as_the_parts_in_one_object() {
    let (schedule, made) = &*RECORDED;
    let n_risks = made.iter().filter(|made| matches!(made, Made::Risk { .. })).count();
    let n_decisions = made.iter().filter(|made| matches!(made, Made::Decision { .. })).count();
    println!("{} steps, {n_risks} risk maps, {n_decisions} decisions", schedule.len());
    assert_eq!(first_difference(schedule, ages(), made), None);
}

/// Whatever happens, deciding takes no memory that it did not have; a place where the vehicle is stuck is told of by a
/// message, which does.
#[test]
fn deciding_takes_no_memory() {
    let (schedule, _) = &*RECORDED;
    let mut parts = InProcess::new();
    let mut n_measured = 0;
    for (at_ns, step) in schedule {
        let is_warm = *at_ns > BEGAN_NS + 2000 * MILLISECOND_NS;
        if !(is_warm && matches!(step, Step::Decide)) {
            parts.step(*at_ns, step);
            continue;
        }
        let mut is_stuck = false;
        let counted =
            allocation_counter::measure(|| is_stuck = parts.navigator.answer(*at_ns).stuck.is_some());
        assert!(is_stuck || counted.count_total == 0, "{counted:?} at {at_ns} ns");
        n_measured += 1;
    }
    assert!(n_measured > 100, "{n_measured}");
}

/// The witness for the bits: another limit on an age, or another order of two steps, shows.
#[test]
fn another_age_limit_or_another_order_makes_other_decisions() {
    let (schedule, made) = &*RECORDED;
    let usual = ages();
    for other in [
        AgeLimits { learned_ns: usual.learned_ns + 600 * MILLISECOND_NS, ..usual },
        AgeLimits { mission_ns: usual.mission_ns - 500 * MILLISECOND_NS, ..usual },
        AgeLimits { learning_silence_ns: usual.learning_silence_ns + 300 * MILLISECOND_NS, ..usual },
    ] {
        assert!(first_difference(schedule, other, made).is_some(), "{other:?}");
    }
    // Once, a decision is made before the odometry that came shortly before it.
    let before = |decide: usize| {
        let is_odometry = |place: &usize| matches!(schedule[*place].1, Step::Odometry(..));
        (decide.saturating_sub(3)..decide).rev().find(is_odometry)
    };
    let mut decisions = (0..schedule.len()).filter(|place| matches!(schedule[*place].1, Step::Decide));
    let (place, decide) = decisions.find_map(|decide| Some((before(decide)?, decide))).unwrap();
    let mut swapped = schedule.clone();
    swapped[place..=decide].rotate_right(1);
    (place..=decide).for_each(|k| swapped[k].0 = schedule[k].0);
    let (differs_at, _) = first_difference(&swapped, usual, made).expect("another order");
    assert_eq!(differs_at, place);
}
