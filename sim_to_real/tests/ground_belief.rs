//! Where a belief about the ground and what was met part. The drives are made of numbers: what was met follows from a
//! formula of the test's own.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use sim_to_real::{GroundCause, GroundChange, GroundCondition, PARAMETERS, Parting, judge_ground};
use terrain::TerrainClass;
use traversability::{Bins, Encounter, Foretold, GroundShown, Pmf};

/// A machine and its ground, as the test has them.
#[derive(Clone, Copy)]
struct Made {
    /// Slip per slope on open, loose and overgrown ground.
    slip: [f64; 3],
    /// Slip on the level on each.
    resistance: [f64; 3],
    height_m: [f64; 3],
    wheel_per_slope: f64,
    gain: f64,
    /// Whether overgrown ground is called open.
    is_mislabelled: bool,
}

const RIGHT: Made = Made {
    slip: [0.1, 0.15, 0.2],
    resistance: [0.01, 0.03, 0.08],
    height_m: [0.0, 0.0, 0.05],
    wheel_per_slope: 0.0,
    gain: 1.0,
    is_mislabelled: false,
};

fn drives(made: &Made, seed: u64) -> Vec<Encounter> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut met = Vec::new();
    for drive in 0..3 {
        let (mut slope, mut class) = (0.0, 0);
        for step in 0..400 {
            if step % 15 == 0 {
                slope = rng.random_range(-0.3..0.3);
                class = rng.random_range(0..3);
            }
            let mut noise = || rng.random_range(-0.02..0.02);
            let slip = made.resistance[class] + made.slip[class] * slope + noise();
            let wheel_share = 1.0 + made.wheel_per_slope * slope + noise();
            let pitch_rad = slope.atan().abs();
            let called = if made.is_mislabelled && class == 2 { 0 } else { class };
            let foretold = |bins: &Bins, value: f64| Pmf::interpolated(bins, value as f32).unwrap();
            let told = [
                foretold(&Bins::TRACTION, 0.9),
                foretold(&Bins::TRACTION, 0.9),
                foretold(&Bins::ATTITUDE, 0.05),
                foretold(&Bins::ATTITUDE, pitch_rad),
            ];
            met.push(Encounter {
                drive,
                time_s: 0.2 * f64::from(step),
                pose: [0.0; 3],
                distance_m: 0.0,
                speed_mps: 1.0,
                wheel_share,
                slip,
                measured: [
                    (wheel_share * (1.0 - slip)) as f32,
                    f32::NAN,
                    f32::NAN,
                    (made.gain * pitch_rad + noise()) as f32,
                ],
                ground: GroundShown {
                    class: TerrainClass::ALL[called],
                    vegetation_height_m: 0.0,
                    slope_along: slope,
                    slope_across: 0.0,
                    unevenness_m: 0.0,
                    height_error_m: made.height_m[class] + noise(),
                },
                foretold: Foretold { prior: told, networks: None, learned_share: [0.0; 4], posterior: told },
            });
        }
    }
    met
}

fn change(made: &Made) -> GroundChange {
    judge_ground(&drives(made, 2), &drives(&RIGHT, 1), 3).unwrap().change.unwrap()
}

#[test]
fn nothing_is_named_where_nothing_has_changed() {
    for seed in 10..30 {
        let report = judge_ground(&drives(&RIGHT, seed), &drives(&RIGHT, 1), 3).unwrap();
        let change = report.change.unwrap();
        assert_eq!((change.named, change.is_unknown), (None, false), "{seed}: {change:?}");
    }
}

#[test]
fn every_cause_is_told_by_its_trace() {
    let [open, loose, grown] = RIGHT.slip;
    let lifted = RIGHT.height_m.map(|height_m| height_m + 0.03);
    let cases = [
        (GroundCause::Friction(TerrainClass::Loose), Made { slip: [open, loose + 0.4, grown], ..RIGHT }),
        (GroundCause::Friction(TerrainClass::Open), Made { slip: [open + 0.4, loose, grown], ..RIGHT }),
        (GroundCause::Wet, Made { slip: RIGHT.slip.map(|slip| slip + 0.4), ..RIGHT }),
        (GroundCause::HeightBias, Made { height_m: lifted, ..RIGHT }),
        (
            GroundCause::Mislabelled(TerrainClass::Open, TerrainClass::Vegetation),
            Made { is_mislabelled: true, ..RIGHT },
        ),
        (GroundCause::Heavier, Made { wheel_per_slope: -0.2, gain: 1.2, height_m: lifted, ..RIGHT }),
    ];
    for (cause, made) in cases {
        let change = change(&made);
        assert_eq!(change.named, Some(cause), "{change:?}");
        assert!(change.credible.contains(&cause) && !change.is_unknown);
        assert!(change.ranking[0].explained > 0.6, "{change:?}");
    }
}

#[test]
fn what_no_cause_explains_is_unknown() {
    // Less pitch than the ground has: no load, and nothing that slip or heights show.
    let made = Made { gain: 0.6, ..RIGHT };
    let change = change(&made);
    assert_eq!((change.named, change.is_unknown), (None, true), "{change:?}");
    assert!(change.credible.is_empty());
}

#[test]
fn ground_that_is_worse_than_foretold_is_called_that() {
    let report = judge_ground(&drives(&Made { resistance: [0.4; 3], ..RIGHT }, 5), &[], 3).unwrap();
    let linear = &report.calibration[0];
    // 1 - 0.4 was met, 0.9 foretold.
    let bias = linear.bias.unwrap();
    assert!((bias.value + 0.3).abs() < 0.02, "{bias:?}");
    assert_eq!(linear.parting, Parting::TooOptimistic);
    assert_eq!(report.calibration[1].parting, Parting::Unknown, "no angular traction was measured");
    assert!((linear.pit.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    assert!(linear.pit[0] > 0.99, "{:?}", linear.pit);
    assert!(report.change.is_none());
}

#[test]
fn a_calibrated_belief_has_a_level_transform_and_covers_nine_of_ten() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut met = drives(&RIGHT, 6);
    // Half of the outcomes in one bin, a quarter in each of two others, as foretold.
    let mut told = [0.0; 12];
    (told[3], told[6], told[9]) = (0.25, 0.5, 0.25);
    for encounter in &mut met {
        encounter.foretold.posterior[0] = Pmf::new(told).unwrap();
        let bin = [3, 6, 6, 9][rng.random_range(0..4)];
        encounter.measured[0] = Bins::TRACTION.values()[bin];
    }
    let report = judge_ground(&met, &[], 3).unwrap();
    let linear = &report.calibration[0];
    assert_eq!(linear.parting, Parting::None, "{linear:?}");
    assert!(linear.pit.iter().all(|share| (share - 0.1).abs() < 0.02), "{:?}", linear.pit);
    let coverage = linear.coverage.unwrap();
    // A quarter on either side, of which a fifth lies outside: 1 - 2 * 0.25 * 0.2.
    assert!((coverage.value - 0.9).abs() < 0.01, "{coverage:?}");
    // The mean foretold: 0.25 * 0.25 + 0.5 * 0.55 + 0.25 * 0.85 = 0.55.
    let [low, high] = linear.bias.unwrap().interval;
    assert!(low < 0.02 && high > -0.02, "{linear:?}");
    // Certain of one value, it is wrong half of the time and right in the mean.
    for encounter in &mut met {
        encounter.foretold.posterior[0] = Pmf::interpolated(&Bins::TRACTION, 0.55).unwrap();
    }
    let certain = judge_ground(&met, &[], 3).unwrap();
    assert_eq!(certain.calibration[0].parting, Parting::OverConfident, "{:?}", certain.calibration[0]);
    // Whoever holds everything around 0.55 possible is right, but knows less than there is to know.
    let wide = std::array::from_fn(|bin| if (2..=10).contains(&bin) { 1.0 / 9.0 } else { 0.0 });
    for encounter in &mut met {
        encounter.foretold.posterior[0] = Pmf::new(wide).unwrap();
    }
    let vague = judge_ground(&met, &[], 3).unwrap();
    assert_eq!(vague.calibration[0].parting, Parting::UnderConfident, "{:?}", vague.calibration[0]);
}

#[test]
fn a_mean_knows_that_neighbours_are_alike() {
    let mut met = drives(&RIGHT, 7);
    for encounter in &mut met {
        encounter.ground.height_error_m = (encounter.time_s / 3.0).floor() % 2.0;
    }
    let mean = judge_ground(&met, &[], 3).unwrap().heights.all.unwrap();
    // 80 s in blocks of 3 s: 27 a drive, the last of 2 s; 13 of them count 1.
    assert_eq!((mean.n, mean.n_blocks), (1200, 81));
    assert!((mean.value - 13.0 * 15.0 / 400.0).abs() < 1e-12, "{mean:?}");
    // Blocks of 15 that are 0 or 1: half a block's spread over the root of 81, and not of 1200.
    let half = 0.5 * (mean.interval[1] - mean.interval[0]);
    assert!((half - 1.645 * 0.5 / 81f64.sqrt()).abs() < 0.005, "{mean:?}");
    // Three blocks are too few.
    assert!(judge_ground(&met[..40], &[], 1).unwrap().heights.all.is_none());
}

#[test]
fn the_place_where_it_parts_is_found() {
    let met = drives(&Made { resistance: [0.05, 0.4, 0.05], ..RIGHT }, 8);
    let report = judge_ground(&met, &[], 3).unwrap();
    let first = &report.places[0];
    assert_eq!((first.parameter, first.condition), (PARAMETERS[0], GroundCondition::Class));
    assert!(first.share > 0.8, "{first:?}");
    let loose = first.bins.iter().find(|bin| bin.label == "loose").unwrap();
    assert!((loose.bias.value + 0.3).abs() < 0.05, "{loose:?}");
}

#[test]
fn drives_without_any_footprint_are_refused() {
    let told = judge_ground(&[], &[], 2).unwrap_err().to_string();
    assert_eq!(told, "drives: expected footprints on ground that the map shows, found none in 2 drives");
}
