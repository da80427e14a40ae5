//! How often intervals hold the truth.

use super::{Made, arcs, effect, normal};
use crate::causes::{Trial, candidates};
use crate::comparison::{Comparison, Yardstick};
use crate::intervals::named_effects;
use crate::least_squares::{Coordinate, Linearised, fit};

/// Half the width of a 90 % interval of ten stretches (Student, nine degrees).
const STUDENT_90: f64 = 1.833;

/// y = a + b t with noise of one standard deviation: 90 % intervals of the jackknife hold a and b in 90 % of 400 draws,
/// give or take three standard errors of that share and what a jackknife of ten is coarse by.
#[test]
fn jackknife_intervals_of_a_quadratic_loss_cover_at_their_rate() {
    const N: usize = 400;
    let truth = [0.7, -0.4];
    let coordinate = Coordinate { start: 0.0, low: -10.0, high: 10.0, scale: 1.0, pull: None };
    let mut held = [0; 2];
    for seed in 0..N as u64 {
        let mut noise = normal(seed);
        // Stretches have to be alike, as those of drives are: t is drawn and does not grow.
        let points: Vec<[f64; 2]> = (0..300)
            .map(|_| {
                let t = noise();
                [t, truth[0] + truth[1] * t + noise()]
            })
            .collect();
        let residuals = |values: &[f64]| -> Vec<f32> {
            points.iter().map(|[t, y]| (values[0] + values[1] * t - y) as f32).collect()
        };
        let found = fit(&[coordinate; 2], residuals);
        let errors = Linearised::at(&[coordinate; 2], &found.values, residuals).jackknife(10);
        for (place, held) in held.iter_mut().enumerate() {
            *held += usize::from((found.values[place] - truth[place]).abs() < STUDENT_90 * errors[place]);
        }
    }
    for held in held {
        let share = held as f64 / N as f64;
        assert!((0.85..=0.95).contains(&share), "{share}");
    }
}

/// Beside a parameter that no residual depends on, and one that a single number of a single stretch tells, a mean of 100 numbers
/// keeps its standard error, but for the number that the last takes with it.
#[test]
fn a_parameter_that_nothing_tells_takes_no_interval_with_it() {
    let coordinate = Coordinate { start: 0.0, low: -10.0, high: 10.0, scale: 1.0, pull: None };
    let number = |k: usize| if k.is_multiple_of(3) { 1.0 } else { 0.0 };
    let of_mean = |values: &[f64]| -> Vec<f32> { (0..100).map(|k| (values[0] - number(k)) as f32).collect() };
    let of_all = |values: &[f64]| -> Vec<f32> {
        let mut residuals = of_mean(values);
        residuals[7] += values[2] as f32;
        residuals
    };
    let alone = Linearised::at(&[coordinate], &[0.34], of_mean).jackknife(10);
    let errors = Linearised::at(&[coordinate; 3], &[0.34, 0.0, 0.0], of_all).jackknife(10);
    assert!(alone[0] > 0.01 && errors[0].is_finite(), "{alone:?} {errors:?}");
    assert!((errors[0] / alone[0] - 1.0).abs() < 0.1, "{alone:?} {errors:?}");
    assert_eq!(errors[1..], [f64::INFINITY; 2]);
}

/// The whole way from drives to intervals, on arcs whose curvature is off by a known ratio: tan(steering) times r is
/// tan(r steering) but for a per cent at these angles, which the interval's own allowance for the form has to hold.
#[test]
fn intervals_of_a_steering_ratio_hold_it_and_are_no_wider_than_they_need_be() {
    let truth = 0.88;
    let description = candidates().find(|description| description.id == "steer_gain").unwrap();
    let mut n_held = 0;
    for seed in 0..12 {
        let drive = arcs(Made { curvature_ratio: truth, ..Made::RIGHT }, 100 + seed);
        let comparison = Comparison::new(1.0, vec![&drive], &Yardstick::rough());
        let trial = Trial::fixed(comparison, &[]);
        let found = trial.with_one_more(&[], description).unwrap();
        let named = named_effects(&trial, &found.causes);
        let ratio = named[0].parameters["ratio"];
        assert!(ratio.low < ratio.value && ratio.value < ratio.high, "{ratio:?}");
        assert!(ratio.high - ratio.low < 0.1, "{ratio:?}");
        n_held += usize::from((ratio.low..=ratio.high).contains(&truth));
    }
    assert!(n_held >= 10, "{n_held} of 12");
}

/// Four times the drives, half the width where noise makes it; what the form may be wrong by stays.
#[test]
fn intervals_shrink_with_more_drives_down_to_the_error_of_the_form() {
    let made = Made { curvature_ratio: 0.88, ..Made::RIGHT };
    let drives: Vec<_> = (0..4).map(|seed| arcs(made, 200 + seed)).collect();
    let width = |n: usize| {
        let comparison = Comparison::new(1.0, drives.iter().take(n).collect(), &Yardstick::rough());
        let trial = Trial::fixed(comparison, &[]);
        let ratio = named_effects(&trial, &[effect("steer_gain", 0.88)])[0].parameters["ratio"];
        ratio.high - ratio.low
    };
    let [one, four] = [1, 4].map(width);
    // Eight per cent of the distance from no effect to either side.
    assert!(four < one && four > 2.0 * 0.08 * 0.12, "{one} {four}");
}
