//! Whether what was found is the same throughout.

use super::{Made, arcs};
use crate::baseline::{Baseline, Experience, Null};
use crate::comparison::{Comparison, Yardstick};
use crate::constancy::{Halves, differing_halves};
use crate::explanation::single_explanations;
use crate::limits_shown::LimitsShown;
use crate::whitening::Whitening;
use std::collections::BTreeMap;

/// The bicycle with the noise of a drive of its own.
fn bicycle() -> Baseline {
    let nominal = arcs(Made { curvature_ratio: 1.0, left_ratio: 1.0, speed_ratio: 1.0 }, 3);
    let rough = Yardstick::rough();
    let noise = Comparison::new(1.0, vec![&nominal], &rough).residuals(&[]);
    let null = Null {
        error: 1.0,
        loss: 1.0,
        gains: BTreeMap::new(),
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
        null,
    }
}

/// The best single effect of a machine, and between which halves of its drives it differs.
fn found(left_ratio: f64) -> (&'static str, Option<Halves>) {
    let baseline = bicycle();
    let drives = [1, 2].map(|seed| arcs(Made { curvature_ratio: 0.85, left_ratio, speed_ratio: 1.0 }, seed));
    let best = single_explanations(&baseline.trial(&drives.each_ref())).swap_remove(0);
    (best.ids()[0], differing_halves(&baseline, &drives, &best.causes))
}

#[test]
fn a_gain_that_is_the_same_on_both_sides_is_constant() {
    assert_eq!(found(1.0), ("steer_gain", None));
}

#[test]
fn a_gain_of_one_side_is_told_to_differ() {
    assert_eq!(found(0.9).1, Some(Halves::LeftAndRight));
}
