//! Score tests, against what is known of made-up machines.

use super::{Made, arcs, effect};
use crate::causes::{Explanation, Trial};
use crate::comparison::{Comparison, Yardstick};
use crate::drive::Drive;
use crate::least_squares::mean_loss;
use crate::score_test::{Chance, tried_scores};

fn yardstick() -> Yardstick {
    let nominal = arcs(Made::RIGHT, 3);
    let rough = Yardstick::rough();
    Yardstick::of(&Comparison::new(1.0, vec![&nominal], &rough).residuals(&[]), &rough)
}

fn trial<'a>(drives: &[&'a Drive], yardstick: &Yardstick) -> Trial<'a> {
    Trial::fixed(Comparison::new(1.0, drives.to_vec(), yardstick), &[])
}

/// What nominal drives say of a gain and of a lag that they do not have.
fn chance(yardstick: &Yardstick) -> Chance {
    let sizes = [effect("steer_gain", 0.9), effect("steer_gain", 1.1), effect("steer_lag", 0.2)];
    let nominal = [4, 5, 6, 7].map(|seed| arcs(Made::RIGHT, seed));
    let scores = nominal.each_ref().map(|drive| tried_scores(&trial(&[drive], yardstick), &sizes));
    Chance::of(&scores.each_ref())
}

fn support(made: [Made; 2], id: &str) -> crate::Support {
    let yardstick = yardstick();
    let drives = [arcs(made[0], 1), arcs(made[1], 2)];
    let trial = trial(&drives.each_ref(), &yardstick);
    let before = trial.judged_residuals(&[]);
    let none = mean_loss(&before);
    let description = bicycle::effect::CATALOGUE.iter().find(|own| own.id == id).unwrap();
    let own: Explanation = trial.with_one_more(&[], description).unwrap();
    chance(&yardstick).support((&trial, &before), &own, none)
}

/// A gain of 0.95 that both drives have is asked for by both many times as strongly as chance does, and by nominal drives
/// not at all; a lag that nobody has is asked for like chance.
#[test]
fn an_effect_is_asked_for_by_those_that_have_it() {
    let made = Made { curvature_ratio: 0.95, ..Made::RIGHT };
    let gain = support([made; 2], "steer_gain");
    assert!(gain.strength > 10.0 && gain.least_strength > 6.0 && gain.gain > 0.1, "{gain:?}");
    assert!(gain.nominal.abs() < 0.1, "{gain:?}");
    let lag = support([Made::RIGHT; 2], "steer_lag");
    assert!(lag.strength < 4.0 && lag.gain < 0.02, "{lag:?}");
}

/// Of two drives one has the gain: the other asks for nothing, and that they do not agree is chance to both together.
#[test]
fn drives_that_do_not_agree_ask_for_little() {
    let made = Made { curvature_ratio: 0.9, ..Made::RIGHT };
    let (both, one) = (support([made; 2], "steer_gain"), support([made, Made::RIGHT], "steer_gain"));
    assert!(one.least_strength < 0.01 * both.least_strength, "{both:?} {one:?}");
    assert!(one.strength < 0.1 * both.strength, "{both:?} {one:?}");
}

/// The chance is that of the effect's own direction, whatever its size: twice the effect is asked for twice as strongly.
#[test]
fn twice_the_effect_is_asked_for_twice_as_strongly() {
    let made = |curvature_ratio: f64| [Made { curvature_ratio, ..Made::RIGHT }; 2];
    let (small, large) = (support(made(0.98), "steer_gain"), support(made(0.96), "steer_gain"));
    let ratio = large.strength / small.strength;
    assert!((1.5..2.5).contains(&ratio), "twice the effect, {ratio} times the strength: {small:?} {large:?}");
}
