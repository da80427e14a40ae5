//! Processes that are killed, stopped and joined by others from outside, and what becomes of the drive.

use bicycle::{Decision, StopReason};
use bus::channel::{Bus, COMMAND, ChannelError};
use bus::message::DecisionRecord;
use bus::status::Role;
use runtime::replay::{self, Knowledge};
use rustix::process::Signal;

use crate::fixture::Run;
use crate::witness::Witness;

const PLANNERS: [Role; 3] = [Role::Mapping, Role::Learning, Role::Control];

#[test]
fn every_process_may_fail_and_the_vehicle_is_safe() {
    let mut run = Run::new();
    // In no sensible order: each finds the others.
    run.start_all(&[
        Role::Control,
        Role::Recorder,
        Role::Mapping,
        Role::Mission,
        Role::Plant,
        Role::Learning,
    ]);
    let mut witness = Witness::new(&run);
    let mut table = Vec::new();
    witness.until_driving("all processes up");

    run.kill(Role::Control);
    table.push(("control killed: stands", witness.until_standing_alone("without control")));
    run.start(Role::Control);
    table.push(("control restarted: drives", witness.until_driving("with control again")));

    table.extend(drive_on_when_learning_is_killed(&mut run, &mut witness));

    run.signal(Role::Mapping, Signal::STOP);
    let took = witness.until("old scans stop it", |witness| {
        witness.decision_now() == Some(Decision::Stop(StopReason::StaleScan))
    });
    table.push(("mapping stopped: stop is decided", took));
    table.push(("mapping stopped: stands", witness.until_standing("without maps")));
    run.signal(Role::Mapping, Signal::CONT);
    table.push(("mapping goes on: drives", witness.until_driving("with maps again")));

    run.signal(Role::Control, Signal::STOP);
    table.push(("control stopped: stands", witness.until_standing_alone("control does not answer")));
    run.signal(Role::Control, Signal::CONT);
    table.push(("control goes on: drives", witness.until_driving("control answers again")));

    run.signal(Role::Plant, Signal::STOP);
    let took = witness.until("old odometry stops it", |witness| {
        witness.decision_now() == Some(Decision::Stop(StopReason::StaleOdometry))
    });
    table.push(("odometry ends: stop is decided", took));
    run.signal(Role::Plant, Signal::CONT);
    witness.until_driving("odometry goes on");

    for (fault, ms) in &table {
        println!("{fault:36} {ms:7.0} ms");
    }
    // The recorder outlived them all, and what it kept of the last control's life can be decided again.
    run.end();
    let files = run.recordings();
    let records = replay::read(&files).unwrap();
    assert_eq!((records.ended_early.as_ref(), run.said_by_recorder()), (None, None));
    let knowledge = Knowledge { belief: navigator::Belief::Physics, checkpoint: 0, corrector: None };
    let report = replay::replay(&records, &knowledge).unwrap();
    assert_eq!(report.first_difference, None, "{report:?}");
    assert!(report.n_identical > 50, "{report:?}");
}

/// Learning dies and comes back. The witness holds every decision in between to the younger map, and every stop to want
/// of one that is young enough.
fn drive_on_when_learning_is_killed(run: &mut Run, witness: &mut Witness) -> [(&'static str, f64); 2] {
    run.kill(Role::Learning);
    let over_ms = witness.until("physics takes over", |witness| witness.drives_on(2));
    witness.until_driving("on physics alone");
    run.start(Role::Learning);
    let back_ms = witness.until("learning is back", |witness| witness.drives_on(1));
    witness.until_driving("on what was learned");
    [("learning killed: physics judges", over_ms), ("learning restarted: it judges", back_ms)]
}

#[test]
fn maps_that_come_late_are_replaced_by_physics_and_then_by_a_stop() {
    let mut run = Run::new();
    run.start_all(&[Role::Plant, Role::Mission]);
    run.start_all(&PLANNERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    // Learning works for 30 ms of every second: its maps are older than physics' whenever they come.
    let by_physics = witness.in_turns(&run, Role::Learning, [970, 30], |witness| {
        let on_physics = |record: &&DecisionRecord| record.map_source == 2;
        let drives = |record: &DecisionRecord| matches!(record.command.decision(), Some(Decision::Drive(_)));
        witness.decided.iter().filter(on_physics).any(drives)
    });
    println!("learning late: drives on physics      {by_physics:7.0} ms");
    witness.until("learning is in time again", |witness| witness.drives_on(1));
    // Mapping works for 30 ms of every 1.5 s: what anybody knows of the ground is too old most of the time.
    let stopped = witness.in_turns(&run, Role::Mapping, [1470, 30], |witness| {
        witness.decision_now() == Some(Decision::Stop(StopReason::StaleScan))
    });
    println!("mapping late: stop is decided         {stopped:7.0} ms");
    witness.until_driving("mapping is in time again");
    run.end();
}

#[test]
fn a_second_control_never_takes_the_wheel() {
    let mut run = Run::new();
    run.start_all(&[Role::Plant, Role::Mission]);
    run.start_all(&PLANNERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    // A second one finds the channel taken, for as long as it tries.
    let other = Bus::join(&run.name).unwrap();
    let refused = other.outlet(&COMMAND, 1).err();
    assert!(matches!(refused, Some(ChannelError::Taken { channel: "command" })), "{refused:?}");
    let from_m = witness.last.unwrap().position_m;
    witness.until("it drives on", |witness| {
        let to_m = witness.last.unwrap().position_m;
        (to_m[0] - from_m[0]).hypot(to_m[1] - from_m[1]) > 1.0
    });
    run.end();
}

#[test]
fn everything_killed_at_once_begins_again_without_cleaning_and_leaves_nothing_behind() {
    let mut run = Run::new();
    let mut counts = Vec::new();
    for _ in 0..4 {
        run.start_all(&[Role::Plant, Role::Mission]);
        run.start_all(&PLANNERS);
        {
            let mut witness = Witness::new(&run);
            witness.until("a decision", |witness| witness.decision.is_some());
        }
        for role in [Role::Plant, Role::Mission, Role::Mapping, Role::Learning, Role::Control] {
            run.kill(role);
        }
        counts.push(run.shared_memory().len());
    }
    let bus = Bus::join(&run.name).unwrap();
    bus.clear_dead();
    drop(bus);
    // How much is open when a process dies differs by a few files from time to time; what adds up is four times as
    // much the fourth time.
    let fewest = counts.iter().min().unwrap();
    assert!(counts[3] < 2 * fewest, "leftovers of dead processes add up: {counts:?}");
    let left = run.shared_memory();
    let is_common = |file: &std::path::PathBuf| file.to_string_lossy().ends_with(".global_mgmt");
    assert!(left.len() <= 1 && left.iter().all(is_common), "but for the run's own page: {left:?}");
}
