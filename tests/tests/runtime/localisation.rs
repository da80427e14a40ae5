//! Recordings whose localisation was tampered with: jumps, places of scans and the odometry that both come from.

use std::sync::LazyLock;

use bus::message::{OdometryRecord, SurfaceHeader};
use bus::status::Role;
use navigator::Belief;
use runtime::mapping::{FUSED, JUMPED};
use runtime::replay::{self, Key, Knowledge, Records, ReplayReport};

use crate::driver::{Driver, Misbehaviour};
use crate::fixture::{Run, eventually};
use crate::witness::Witness;

/// A drive in which scans fall between two odometry messages and the localisation jumps.
static RECORDED: LazyLock<Records> = LazyLock::new(|| {
    let mut run = Run::new();
    run.start(Role::Recorder);
    eventually(60.0, || (!run.recordings().is_empty()).then_some(())).unwrap();
    run.start_all(&[Role::Mapping, Role::Learning, Role::Control]);
    let mut witness = Witness::new(&run);
    let driver = Driver::start(&run.name);
    witness.until_driving("all is well");
    let (offset_m, turn_rad) = ([6.0, -9.0], 0.4);
    for is_sparse in [false, true] {
        driver.behave(Misbehaviour { offset_m, turn_rad, is_sparse, ..Misbehaviour::default() });
        witness.decided.clear();
        witness.until("two seconds of decisions", |witness| witness.decided.len() >= 20);
    }
    drop(driver);
    run.end();
    replay::read(&run.recordings()).unwrap()
});

/// What is said of the recording after a change.
fn after(change: impl FnOnce(&mut Records)) -> ReplayReport {
    let mut records = RECORDED.clone();
    change(&mut records);
    replay::replay(&records, &Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None }).unwrap()
}

/// The last map of the ground of an event that odometry was taken in for, or the one so many before it.
fn map_of(records: &Records, event: u64, before: usize) -> SurfaceHeader {
    *records
        .surfaces
        .values()
        .rev()
        .filter(|header| header.event == event && header.n_odometry > 0)
        .nth(before)
        .unwrap()
}

fn change_map(records: &mut Records, header: &SurfaceHeader, change: impl FnOnce(&mut SurfaceHeader)) {
    change(records.surfaces.get_mut(&Key::from(header.stamp.source())).unwrap());
}

/// Whether nothing of the odometry was lost on its way to the recorder, which a machine under load may be too slow for.
fn is_whole(records: &Records) -> bool {
    let keys: Vec<&Key> = records.odometry.keys().collect();
    keys.windows(2).all(|pair| pair[1].sequence == pair[0].sequence + 1)
}

#[test]
fn jumps_and_places_of_scans_are_made_out_again() {
    let (report, records) = (after(|_| ()), &*RECORDED);
    assert_eq!((report.contradictions.clone(), report.first_difference.clone()), (Vec::new(), None));
    assert_eq!(
        (report.n_unverified == 0, report.unverified.is_empty()),
        (is_whole(records), is_whole(records))
    );
    assert_eq!(report.n_localised + report.n_unverified, records.surfaces.len() as u64);
    assert!(report.n_localised > 15, "{report:?}");
    // What is verified is no matter of course: there was a jump, and a scan that no odometry is of the time of.
    let (jumped, fused) = (map_of(records, JUMPED, 0), map_of(records, FUSED, 0));
    assert!((jumped.jump_yaw_rad - 0.4).abs() < 0.03, "{jumped:?}");
    assert!(
        records.odometry.values().all(|(stamp, _)| stamp.valid_at_ns != fused.odometry_at_ns),
        "{fused:?}"
    );
}

#[test]
fn a_jump_that_was_changed_is_found_out() {
    let jumped = map_of(&RECORDED, JUMPED, 0);
    let of = format!(
        "map of the ground {}, of odometry {}: expected jump_m {:?}, found [",
        jumped.stamp.sequence, jumped.last_odometry.sequence, jumped.jump_m
    );
    let report = after(|records| change_map(records, &jumped, |header| header.jump_m[1] += 1e-9));
    assert_eq!(report.contradictions.len(), 1, "{:?}", report.contradictions);
    assert!(report.contradictions[0].starts_with(&of), "{:?}", report.contradictions);
    let report = after(|records| change_map(records, &jumped, |header| header.jump_yaw_rad = 0.0));
    assert!(report.contradictions[0].contains("expected jump_yaw_rad [0."), "{:?}", report.contradictions);
    // All jumps together, which stuck poses and footprints follow.
    let fused = map_of(&RECORDED, FUSED, 0);
    let report = after(|records| change_map(records, &fused, |header| header.shift_m[0] = 0.0));
    assert!(report.contradictions[0].contains("expected shift_m ["), "{:?}", report.contradictions);
}

#[test]
fn a_jump_that_is_kept_quiet_is_found_out() {
    let jumped = map_of(&RECORDED, JUMPED, 0);
    let report = after(|records| change_map(records, &jumped, |header| header.event = FUSED));
    let shows = format!("of the jump that odometry {} shows, found none", jumped.last_odometry.sequence);
    assert!(report.contradictions[0].contains(&shows), "{:?}", report.contradictions);
}

#[test]
fn a_scan_that_was_paired_with_another_odometry_is_found_out() {
    let fused = map_of(&RECORDED, FUSED, 1);
    let of =
        format!("map of the ground {}, of scan {}: expected ", fused.stamp.sequence, fused.scan.sequence);
    let told = |change: &dyn Fn(&mut SurfaceHeader)| {
        let contradictions = after(|records| change_map(records, &fused, change)).contradictions;
        assert!(contradictions[0].starts_with(&of), "{contradictions:?}");
        contradictions[0][of.len()..].to_owned()
    };
    // The odometry before it, as it stands; and only its place.
    let (stamp, record) = RECORDED.odometry[&Key::from(fused.last_odometry)];
    let other = told(&|header| (header.odometry, header.odometry_at_ns) = (record, stamp.valid_at_ns));
    assert!(other.starts_with(&format!("odometry_at_ns {}, found", fused.odometry_at_ns)), "{other}");
    let other = told(&|header| header.odometry.position_m = record.position_m);
    assert!(
        other.starts_with(&format!("odometry.position_m {:?}, found", fused.odometry.position_m)),
        "{other}"
    );
    let other = told(&|header| header.frame_at_ns -= 1);
    assert!(other.starts_with(&format!("frame_at_ns {}, found", fused.frame_at_ns)), "{other}");
}

#[test]
fn odometry_that_was_altered_is_found_out() {
    let fused = map_of(&RECORDED, FUSED, 1);
    let changes: [fn(&mut OdometryRecord); 2] =
        [|record| record.position_m[0] += 1e-9, |record| record.applied_speed_mps += 1.0];
    for change in changes {
        let report = after(|records| {
            change(&mut records.odometry.get_mut(&Key::from(fused.last_odometry)).unwrap().1);
        });
        let [told] = &report.contradictions[..] else { panic!("{:?}", report.contradictions) };
        assert!(
            told.starts_with(&format!("map of the ground {}: odometry ", fused.stamp.sequence)),
            "{told}"
        );
        assert!(
            told.contains("expected what mapping took in, of hash ") && told.contains(", found "),
            "{told}"
        );
    }
}

#[test]
fn odometry_that_is_missing_leaves_maps_unverified_and_says_so() {
    let whole = after(|_| ());
    let gone = map_of(&RECORDED, JUMPED, 0).last_odometry;
    let report = after(|records| assert!(records.odometry.remove(&Key::from(gone)).is_some()));
    assert_eq!(report.contradictions, Vec::<String>::new());
    assert!(report.n_unverified > whole.n_unverified, "{report:?}");
    assert_eq!(report.n_localised + report.n_unverified, whole.n_localised + whole.n_unverified);
    let told = format!(": odometry {}", gone.sequence);
    assert!(report.unverified.iter().any(|why| why.ends_with(&told)), "{:?}", report.unverified);
    // It knows again where it is: what comes later is held against the odometry, and found out as before.
    assert!(report.n_localised > 10, "{report:?}");
    let fused = map_of(&RECORDED, FUSED, 0);
    let report = after(|records| {
        records.odometry.remove(&Key::from(gone));
        change_map(records, &fused, |header| header.odometry.attitude_rad[2] += 1e-9);
    });
    assert!(
        report.contradictions[0].contains("expected odometry.attitude_rad ["),
        "{:?}",
        report.contradictions
    );
}
