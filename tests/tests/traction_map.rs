//! The posterior idea on measured ground, and the figures that the skid-steer prior was built from.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};

use bench::traction_map::{Head, Interval, Source, TractionMapReport, judge};
use bicycle::Column;
use formats::{read_drive_log_csv, read_traction_map};
use physics_prior::{ANGULAR, LINEAR, Quantiles};

fn shared(file: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")).join(file)
}

fn report() -> TractionMapReport {
    let map = read_traction_map(&shared("traction_maps/wp_forest.npz")).unwrap();
    judge(&map, 1).unwrap().report
}

#[test]
#[ignore = "needs the shared data"]
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
    // What docs/traction_map.md says that fusing changes against the prior alone.
    for (head, told) in
        [(&report.linear, [-0.059, -0.024, 0.012]), (&report.angular, [-0.067, -0.044, -0.019])]
    {
        let Interval { low, value, high } = head.score(Source::FusedWithPhysics).less_prior;
        let found = [low, value, high];
        assert!(found.iter().zip(told).all(|(found, told)| (found - told).abs() < 6e-4), "{found:?}");
    }
}

#[test]
#[ignore = "needs the shared data"]
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

/// Achieved over commanded motion of the recorded drive, one value per window of 2 s in steady state whose command is
/// at least `command_min`; ascending.
fn efficiencies(command: Column, achieved: Column, command_min: f64) -> Vec<f64> {
    let file = read_drive_log_csv(&shared("logs/drive_warthog.csv")).unwrap();
    let steady = &file.other_columns.iter().find(|column| column.name == "steady").unwrap().cells;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let mut first = 0;
    let mut found = Vec::new();
    for run in file.log.runs() {
        let is_steady = steady[first] == "1";
        first += run.time_s().len();
        let command = mean(run.column(command).unwrap());
        if is_steady && command.abs() > command_min {
            found.push(mean(run.column(achieved).unwrap()) / command);
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

#[test]
#[ignore = "needs the shared data"]
fn the_skid_steer_prior_has_the_quantiles_of_the_recorded_drive() {
    let cases = [
        (LINEAR, efficiencies(Column::CmdSpeed, Column::Vx, 0.5)),
        (ANGULAR, efficiencies(Column::CmdWz, Column::Wz, 0.3)),
    ];
    for (quantiles, measured) in cases {
        assert!(measured.len() > 150, "{} windows", measured.len());
        for (knot, probability) in quantiles.values.iter().zip(Quantiles::PROBABILITIES).skip(1).take(5) {
            let found = measured[(probability * (measured.len() - 1) as f64).round() as usize];
            assert!((found - knot).abs() < 0.012, "{probability}: {found} instead of {knot}");
        }
    }
}

#[test]
#[ignore = "needs the shared data"]
fn the_warthogs_effective_track_is_that_of_its_drive() {
    // Yaw rate over that of its wheels: 1 / 1.69.
    let efficiencies = efficiencies(Column::WheelWz, Column::Wz, 0.3);
    let median = efficiencies[efficiencies.len() / 2];
    assert!((1.0 / median - 1.69).abs() < 0.02, "{}", 1.0 / median);
}
