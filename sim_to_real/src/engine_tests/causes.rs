//! Explanations on drives whose difference from the bicycle is known.

use super::{Made, arcs, effect};
use crate::causes::{Trial, composed};
use crate::comparison::{Comparison, Yardstick};
use crate::explanation::Screened;
use std::collections::BTreeSet;

fn on<T>(made: Made, told: impl Fn(&Trial<'_>) -> T) -> T {
    let drives = [arcs(made, 1), arcs(made, 2)];
    // One set of drives of the bicycle itself tells the noise.
    let nominal = arcs(Made::RIGHT, 3);
    let rough = Yardstick::rough();
    let noise = Comparison::new(1.0, vec![&nominal], &rough).residuals(&[]);
    let yardstick = Yardstick::of(&noise, &rough);
    let comparison = Comparison::new(1.0, drives.iter().collect(), &yardstick);
    told(&Trial::fixed(comparison, &[]))
}

#[test]
fn the_effect_that_was_put_in_is_the_best_alone_with_its_size() {
    on(Made { curvature_ratio: 0.85, ..Made::RIGHT }, |trial| {
        let singles = Screened::of(trial).singles();
        let best = &singles[0];
        assert_eq!(best.ids(), ["steer_gain"], "{:?}", best.causes);
        assert!((best.causes[0].values()[0] - 0.85).abs() < 0.01, "{:?}", best.causes);
        // What is left is noise, which was one before.
        assert!(best.loss < 1.2 && trial.loss(&[]) > 5.0, "{} {}", best.loss, trial.loss(&[]));
    });
}

#[test]
fn every_cause_stands_once_however_many_forms_it_has() {
    on(Made::RIGHT, |trial| {
        let ids: Vec<&str> = Screened::of(trial).singles().iter().map(|single| single.ids()[0]).collect();
        let unique: BTreeSet<&str> = ids.iter().copied().collect();
        assert_eq!(unique.len(), ids.len(), "{ids:?}");
    });
}

#[test]
fn on_drives_of_the_model_itself_nothing_explains_anything() {
    on(Made::RIGHT, |trial| {
        let (none, singles) = (trial.loss(&[]), Screened::of(trial).singles());
        assert!(singles.iter().all(|single| (none / single.loss).ln() < 0.03), "{none} {:?}", singles[0]);
        assert!(singles.windows(2).all(|pair| pair[0].loss <= pair[1].loss));
    });
}

#[test]
fn two_effects_that_were_put_in_are_the_best_pair() {
    on(Made { curvature_ratio: 0.85, speed_ratio: 0.9, ..Made::RIGHT }, |trial| {
        let singles = Screened::of(trial).singles();
        let pair = Screened::of(trial).best_pair(&singles).unwrap();
        let mut ids = pair.ids();
        ids.sort_unstable();
        assert_eq!(ids, ["speed_scale", "steer_gain"], "{:?}", pair.causes);
        for cause in &pair.causes {
            let expected = if cause.description().cause == "steer_gain" { 0.85 } else { 0.9 };
            assert!((cause.values()[0] - expected).abs() < 0.01, "{cause:?}");
        }
        assert!(pair.loss < 0.5 * singles[0].loss);
    });
}

/// Causes in the command act before the calibrated actuators, whatever the order of the catalogue; all others after
/// those of their kind; what was calibrated stays as it was.
#[test]
fn causes_stand_where_they_act() {
    let baseline = [effect("steer_delay", 0.05), effect("steer_lag", 0.1), effect("understeer", 0.01)];
    let causes = [effect("understeer", 0.02), effect("steer_lag", 0.3), effect("steer_gain", 0.9)];
    let expected = [causes[2], causes[1], baseline[0], baseline[1], baseline[2], causes[0]];
    assert_eq!(composed(&baseline, &causes), expected);
    assert_eq!(composed(&baseline, &[]), baseline);
}
