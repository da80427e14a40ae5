//! What moves, over its channel, into a recording, and out of it again.

use std::sync::LazyLock;

use bus::message::Source;
use bus::status::Role;
use navigator::Belief;
use runtime::replay::{self, Key, Knowledge, Records, ReplayReport};

use crate::fixture::{Run, eventually};
use crate::witness::Witness;

/// A drive past somebody who walks up and down.
static RECORDED: LazyLock<Records> = LazyLock::new(|| {
    let mut run = Run::new();
    run.start(Role::Recorder);
    eventually(60.0, || (!run.recordings().is_empty()).then_some(())).unwrap();
    run.start_all(&[Role::Plant, Role::Mapping, Role::Learning, Role::Control, Role::Mission]);
    let mut witness = Witness::new(&run);
    witness.until_driving("all processes up");
    witness.decided.clear();
    witness.until("six seconds of decisions", |witness| witness.decided.len() >= 60);
    run.end();
    replay::read(&run.recordings()).unwrap()
});

/// What is said of the recording after a change.
fn after(change: impl FnOnce(&mut Records)) -> ReplayReport {
    let mut records = RECORDED.clone();
    change(&mut records);
    replay::replay(&records, &Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None }).unwrap()
}

/// A message that tells of somebody and that a decision named.
fn told() -> Key {
    let named: Vec<Key> = RECORDED.decisions.values().map(|decision| Key::from(decision.tracks)).collect();
    let tells = RECORDED.tracks.iter().filter(|(key, (_, tracks))| !tracks.is_empty() && named.contains(key));
    *tells.map(|(key, _)| key).next().expect("somebody was tracked while it was decided")
}

#[test]
fn decisions_among_people_are_made_again_to_the_bit() {
    let report = after(|_| ());
    assert_eq!((report.contradictions.clone(), report.first_difference.clone()), (Vec::new(), None));
    assert!(report.n_identical > 50, "{report:?}");
    let named = RECORDED.decisions.values().filter(|decision| decision.tracks != Source::default());
    assert!(named.count() > 50);
    told();
}

#[test]
fn tracks_that_the_scans_do_not_show_are_found_out() {
    let key = told();
    let report = after(|records| records.tracks.get_mut(&key).unwrap().1[0].position_m[0] += 1e-9);
    assert!(report.contradictions.iter().any(|told| told.starts_with("tracks of scan")), "{report:?}");
}

#[test]
fn tracks_that_are_missing_or_concealed_are_told() {
    let key = told();
    let report = after(|records| drop(records.tracks.remove(&key)));
    assert!(report.missing.iter().any(|told| *told == format!("tracks {}", key.sequence)), "{report:?}");
    assert!(report.n_unmade > 0);
    let report = after(|records| {
        let last = records.decisions.values_mut().last().unwrap();
        last.tracks = Source { sequence: 1, ..last.tracks };
    });
    assert!(report.contradictions.iter().any(|told| told.contains("expected tracks")), "{report:?}");
}
