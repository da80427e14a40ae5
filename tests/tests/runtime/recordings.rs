//! Recorders that rotate, die and run out of disk while the vehicle drives.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use bus::channel::Bus;
use bus::message::Source;
use bus::status::Role;
use navigator::Belief;
use runtime::replay::{self, Knowledge, Records, ReplayReport};

use crate::fixture::{RecorderLimits, Run, eventually};
use crate::witness::Witness;

const OTHERS: [Role; 5] = [Role::Plant, Role::Mapping, Role::Learning, Role::Control, Role::Mission];

fn read(files: &[PathBuf]) -> Records {
    replay::read(files).unwrap()
}

fn made_again(records: &Records) -> ReplayReport {
    let knowledge = Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None };
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

/// A library that stands in for the system's where a file is to be put onto its disk, and says that it cannot be.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn library_of_a_broken_disk(folder: &Path) -> PathBuf {
    let (source, library) = (folder.join("disk.rs"), folder.join("libdisk.so"));
    std::fs::write(&source, "#[no_mangle] pub extern \"C\" fn fdatasync(_: i32) -> i32 { -1 }\n").unwrap();
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let made = std::process::Command::new(rustc)
        .args(["--edition", "2021", "--crate-type", "cdylib", "-A", "warnings", "-o"])
        .args([&library, &source])
        .status();
    assert!(made.unwrap().success());
    library
}

/// Whether the disk is asked cannot be seen from outside, but its refusal is.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[test]
fn what_is_recorded_is_put_onto_the_disk_while_the_drive_goes_on() {
    let mut run = Run::new();
    run.start_all(&OTHERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    let library = library_of_a_broken_disk(run.folder.path());
    run.start_recorder_with(&library);
    witness.until("the disk was asked", |_| run.said_by_recorder().is_some());
    let said = run.said_by_recorder().unwrap();
    assert!(
        said.contains("drive-000.mcap: the recording ends here, a write failed: onto the disk: "),
        "{said}"
    );
    witness.until_driving("without a recording");
    run.end();
}

#[test]
fn a_quota_ends_the_recording_and_not_the_drive() {
    let mut run = Run::new();
    // Of an earlier drive: it stays, and counts.
    let earlier = run.folder.path().join("drive-000.mcap");
    std::fs::write(&earlier, [7; 100_000]).unwrap();
    run.start_all(&OTHERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    let bus = Bus::join(&run.name).unwrap();
    let mut statuses = bus.inlet(&Role::Recorder.status()).unwrap();
    let quota_bytes = 400_000;
    run.start_recorder(&RecorderLimits { quota_bytes, file_bytes_max: 120_000, ..Default::default() });
    witness.until("the quota is reached", |_| run.said_by_recorder().is_some());
    let said = run.said_by_recorder().unwrap();
    assert!(said.contains("expected recordings of at most 0.4 MB together, found 0."), "{said}");
    assert!(said.ends_with("; driving on without a recording\n") && said.lines().count() == 1, "{said}");

    // The vehicle drives on, and the recorder counts what it does not keep.
    let mut n_missed = 0;
    witness.decided.clear();
    witness.until("ten more decisions", |witness| witness.decided.len() >= 10);
    witness.until_driving("without a recording");
    witness.until("messages that are not kept are counted", |_| {
        statuses.poll(|_, statuses| n_missed = statuses[0].n_missed);
        n_missed > 20
    });
    run.end();

    assert_eq!(std::fs::read(&earlier).unwrap(), [7; 100_000], "an earlier recording was written over");
    let files = run.recordings();
    let n_bytes: u64 = files.iter().map(|file| file.metadata().unwrap().len()).sum();
    // What a half second takes, and the index of the last file.
    assert!(files.len() > 2 && n_bytes < 2 * quota_bytes, "{n_bytes} bytes in {files:?}");
    let records = read(&files[1..]);
    assert_eq!(records.ended_early, None);
    let report = made_again(&records);
    assert_eq!(report.first_difference, None, "{report:?}");
}

#[test]
fn recordings_of_before_count_for_the_quota() {
    let mut run = Run::new();
    let earlier = run.folder.path().join("drive-000.mcap");
    std::fs::write(&earlier, [7; 100_000]).unwrap();
    run.start_recorder(&RecorderLimits { quota_bytes: 90_000, ..Default::default() });
    let (_, said) = eventually(60.0, || run.said_by_recorder()).expect("nothing more may be recorded");
    assert!(said.contains("expected recordings of at most 0.1 MB together, found 0.1 MB"), "{said}");
    run.end();
    assert_eq!(run.recordings(), [earlier]);
}

/// Nanoseconds of UTC since 1970.
fn utc_ns() -> u64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or(Duration::ZERO).as_nanos() as u64
}

#[test]
fn a_recording_is_placed_in_time() {
    let mut run = Run::new();
    let began_ns = utc_ns();
    run.start_all(&OTHERS);
    run.start(Role::Recorder);
    let mut witness = Witness::new(&run);
    witness.until("a second of decisions", |witness| witness.decided.len() >= 10);
    run.end();
    let ended_ns = utc_ns();
    let records = read(&run.recordings());
    let clock = records.setup.as_ref().unwrap().clock.clone();
    let [monotonic_ns, utc_ns] =
        [&clock.monotonic_ns, &clock.utc_ns].map(|text| text.parse::<u64>().unwrap());
    let decided_ns = last_decision_ns(&records) - monotonic_ns + utc_ns;
    assert!((began_ns..=ended_ns).contains(&decided_ns), "{began_ns} {decided_ns} {ended_ns}");
}

/// What is said of a recording after a change of what it holds.
fn contradictions_after(run: &Run, change: impl FnOnce(&mut Records)) -> String {
    let mut records = read(&run.recordings());
    change(&mut records);
    made_again(&records).contradictions.join("\n")
}

#[test]
fn a_decision_that_names_another_map_than_it_had_is_noticed() {
    let mut run = Run::new();
    run.start(Role::Recorder);
    run.start_all(&OTHERS);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    witness.decided.clear();
    witness.until("two seconds of decisions", |witness| witness.decided.len() >= 20);
    run.end();
    assert_eq!(contradictions_after(&run, |_| ()), "");
    // A later one that was made on a map, and what it says of that map.
    let last =
        |records: &Records| *records.decisions.iter().rfind(|(_, made)| made.map_source != 0).unwrap().0;
    let told = contradictions_after(&run, |records| {
        let record = records.decisions.get_mut(&last(records)).unwrap();
        (record.risk.sequence, record.learned.sequence) =
            (record.risk.sequence - 3, record.learned.sequence - 3);
    });
    assert!(told.contains("or a later one, which it had") || told.contains("which was there"), "{told}");
    let told = contradictions_after(&run, |records| {
        let record = records.decisions.get_mut(&last(records)).unwrap();
        record.risk.sequence -= 1;
    });
    assert!(told.contains("expected to be made on learned risk map"), "{told}");
    let told = contradictions_after(&run, |records| {
        let record = records.decisions.get_mut(&last(records)).unwrap();
        (record.risk, record.map_source) = (Source::default(), 0);
    });
    assert!(told.contains("found none of source 0"), "{told}");
}
