//! Whether what was found is the same throughout.

use super::{Made, arcs, effect};
use crate::answer::Division;
use crate::baseline::{Baseline, Experience, Null};
use crate::comparison::{Comparison, Yardstick};
use crate::constancy::{Changing, changing};
use crate::explanation::Screened;
use crate::limits_shown::LimitsShown;
use crate::score_test::Chance;
use crate::whitening::Whitening;
use bicycle::Effect;

/// The bicycle with the noise of a drive of its own.
fn bicycle() -> Baseline {
    let nominal = arcs(Made::RIGHT, 3);
    let rough = Yardstick::rough();
    let noise = Comparison::new(1.0, vec![&nominal], &rough).residuals(&[]);
    let null = Null {
        error: 1.0,
        loss: 1.0,
        chance: Chance::default(),
        gain_of_two: 0.0,
        limits_shown: LimitsShown::default(),
        cells: Vec::new(),
        starts: Vec::new(),
    };
    Baseline {
        wheelbase_m: 1.0,
        effects: Vec::new(),
        proportional: Vec::new(),
        yardstick: Yardstick::of(&noise, &rough),
        whitening: Whitening::none(),
        experience: Experience::none(),
        attitude: None,
        yaw_response: None,
        null,
    }
}

/// The best single effects of a machine, and which of them is not the same throughout.
fn found(made: Made) -> (Vec<Vec<Effect>>, Option<Changing>) {
    let baseline = bicycle();
    let drives = [1, 2].map(|seed| arcs(Made { curvature_ratio: 0.85, ..made }, seed));
    let singles = Screened::of(&baseline.trial(&drives.each_ref())).singles();
    let best: Vec<Vec<Effect>> = singles.into_iter().take(3).map(|single| single.causes).collect();
    let changing = changing(&baseline, &drives, &best);
    (best, changing)
}

#[test]
fn a_gain_that_is_the_same_on_both_sides_is_constant() {
    let (best, changing) = found(Made::RIGHT);
    assert_eq!((best[0][0].description().cause, changing), ("steer_gain", None));
}

/// 0.85 to the right and 0.85 * 0.9 to the left.
#[test]
fn a_gain_of_one_side_is_told_to_differ() {
    let changing = found(Made { left_ratio: 0.9, ..Made::RIGHT }).1.unwrap();
    assert_eq!(changing.division, Division::Steering);
    let [right, left] = changing.causes.each_ref().map(|causes| causes[0].values()[0]);
    // Rollouts see a second of one side and up to a second of the other.
    assert!((0.82..0.86).contains(&right) && (0.75..0.79).contains(&left), "{right} {left}");
    let told = changing.told();
    assert!(told.starts_with("steer_gain foretells"), "{told}");
    assert!(told.contains(&format!(": ratio {right:.3} to the right, {left:.3} to the left")), "{told}");
}

/// A gain of 0.85 is a bias to one side where one steers left and to the other where one steers right; beside the gain
/// itself, which is the same on both, that tells nothing.
#[test]
fn what_something_constant_foretells_as_well_is_constant() {
    let baseline = bicycle();
    let drives = [1, 2].map(|seed| arcs(Made { curvature_ratio: 0.85, ..Made::RIGHT }, seed));
    let wrong = vec![vec![effect("steer_bias", 0.01)], vec![effect("gyro_bias", 0.01)]];
    let right = [wrong.clone(), vec![vec![effect("steer_gain", 0.85)]]].concat();
    assert_eq!(changing(&baseline, &drives, &wrong).map(|found| found.division), Some(Division::Steering));
    assert_eq!(changing(&baseline, &drives, &right), None);
}
