//! Recorders that rotate, die and run out of disk while the vehicle drives.

use std::path::PathBuf;

use navigator::Belief;
use runtime::channel::Bus;
use runtime::replay::{self, Knowledge, Records, ReplayReport};
use runtime::status::Role;

use crate::fixture::{RecorderLimits, Run};
use crate::witness::Witness;

const OTHERS: [Role; 4] = [Role::Plant, Role::Mapping, Role::Learning, Role::Control];

fn read(files: &[PathBuf]) -> Records {
    replay::read(files).unwrap()
}

fn made_again(records: &Records) -> ReplayReport {
    let knowledge = Knowledge { belief: Belief::Physics, checkpoint: 0 };
    replay::replay(records, &knowledge).unwrap()
}

fn last_decision_ns(records: &Records) -> u64 {
    records.decisions.values().map(|record| record.decided_at_ns).max().unwrap_or(0)
}

#[test]
fn the_death_of_a_recorder_costs_a_second_at_most_before_its_last_sign_of_life() {
    let mut run = Run::new();
    run.start_all(&OTHERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    let bus = Bus::join(&run.name).unwrap();
    let mut statuses = bus.inlet(&Role::Recorder.status()).unwrap();
    run.start(Role::Recorder);
    witness.until("a file", |_| !run.recordings().is_empty());
    witness.decided.clear();
    witness.until("three seconds of decisions", |witness| witness.decided.len() >= 30);
    run.kill(Role::Recorder);
    let mut alive_ns = 0;
    statuses.poll(|stamp, _| alive_ns = stamp.published_at_ns);
    let decided = witness.decided.iter().map(|record| record.decided_at_ns);
    let must_be_kept = decided.filter(|at_ns| at_ns + 1_000_000_000 <= alive_ns).max().unwrap();
    let kept_ns = last_decision_ns(&read(&run.recordings()));
    println!("recorder killed: kept until {:.2} s before", alive_ns.saturating_sub(kept_ns) as f64 * 1e-9);
    assert!(kept_ns >= must_be_kept, "kept until {kept_ns} ns, alive at {alive_ns} ns");
    // The next one begins a file of its own, and what both kept is made again.
    let n_before = run.recordings().len();
    run.start(Role::Recorder);
    witness.until("the next file", |_| run.recordings().len() > n_before);
    witness.decided.clear();
    witness.until("a second of decisions", |witness| witness.decided.len() >= 10);
    run.end();
    let report = made_again(&read(&run.recordings()));
    assert_eq!(report.first_difference, None, "{report:?}");
    assert!(report.n_decisions > 30, "{report:?}");
}

#[test]
fn files_that_follow_one_another_hold_every_decision_once() {
    let by_time = RecorderLimits { file_time_max_s: 0.8, ..Default::default() };
    let by_size = RecorderLimits { file_bytes_max: 80_000, ..Default::default() };
    for limits in [by_time, by_size] {
        let mut run = Run::new();
        run.start_all(&OTHERS);
        run.start_recorder(&limits);
        let mut witness = Witness::new(&run);
        witness.until("a few files", |_| run.recordings().len() >= 4);
        run.end();
        hold_every_decision_once(&run.recordings());
    }
}

fn hold_every_decision_once(files: &[PathBuf]) {
    let records = read(files);
    assert_eq!(records.ended_early, None);
    let cycles: Vec<u64> = records.decisions.values().map(|record| record.cycle).collect();
    let follow = cycles.windows(2).all(|pair| pair[1] == pair[0] + 1);
    assert!(follow && !cycles.is_empty(), "a decision fell between two files: {cycles:?}");
    let each: usize = files.iter().map(|file| read(std::slice::from_ref(file)).decisions.len()).sum();
    assert_eq!(each, cycles.len(), "one is in two files");
    let report = made_again(&records);
    assert_eq!(report.first_difference, None, "{report:?}");
}

#[test]
fn a_full_disk_ends_the_recording_and_not_the_drive() {
    let mut run = Run::new();
    run.start_all(&OTHERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    run.start_recorder(&RecorderLimits { disk_bytes: Some(512 << 10), ..Default::default() });
    witness.until("the disk is full", |_| run.said_by_recorder().is_some());
    let said = run.said_by_recorder().unwrap();
    assert!(said.contains("drive-000.mcap: the recording ends here, a write failed: "), "{said}");
    assert!(said.ends_with("; driving on without a recording\n") && said.lines().count() == 1, "{said}");

    // The vehicle drives on, and the recorder lives on, without writing.
    witness.decided.clear();
    witness.until("ten more decisions", |witness| witness.decided.len() >= 10);
    witness.until_driving("without a recording");
    run.end();

    // What fitted is whole: it ends as a recording does, and is made again.
    let files = run.recordings();
    assert_eq!(files.len(), 1);
    let records = read(&files);
    assert_eq!(records.ended_early, None);
    let report = made_again(&records);
    assert_eq!(report.first_difference, None, "{report:?}");
    assert!(report.n_decisions > 5, "{report:?}");
}
