//! The posterior idea on measured ground, and the figures that the skid-steer prior was built from.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};

use bench::traction_map::{Head, Source, TractionMapReport, judge};
use formats::read_traction_map;

fn shared(file: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")).join(file)
}

fn report() -> TractionMapReport {
    let map = read_traction_map(&shared("traction_maps/wp_forest.npz")).unwrap();
    judge(&map, 1).unwrap().report
}

#[test]
fn the_forest_is_as_published() {
    let report = report();
    assert_eq!(report.height_step_m, Some(0.5), "a map of voxels");
    let published = [
        (&report.linear, Source::Prediction, 3.42),
        (&report.linear, Source::Uniform, 2.24),
        (&report.angular, Source::Prediction, 2.52),
        (&report.angular, Source::Uniform, 1.13),
    ];
    for (head, source, error) in published {
        let found = head.score(source).emd2.value;
        assert!((found - error).abs() < 0.01, "{source:?}: {found}");
    }
}

#[test]
fn physics_repairs_a_prediction_from_another_forest() {
    let report = report();
    let error = |head: &Head, source| head.score(source).emd2.value;
    let linear = error(&report.linear, Source::FusedWithPhysics);
    assert!(linear < error(&report.linear, Source::Prediction), "{linear}");
    assert!(linear < error(&report.linear, Source::Uniform), "{linear}");
    let angular = error(&report.angular, Source::FusedWithPhysics);
    assert!(angular < error(&report.angular, Source::Prediction), "{angular}");
    assert!(angular <= 1.05 * error(&report.angular, Source::Uniform), "{angular}");
}
