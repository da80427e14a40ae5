//! Residuals that depend on one condition, on none, and on nothing at all.

use super::normal;
use crate::answer::Condition;
use crate::conditions::{MEASURED, StartRecord, Window, condition_tables, places, with_announced};
use crate::drive::{N_QUANTITIES, VY};
use crate::findings::ConditionTable;

/// Records whose residuals are noise and, in their first quantity, a function of the conditions' values; without a speed to
/// the left.
pub(super) fn records(
    n: usize,
    seed: u64,
    residual: impl Fn(&[f64; MEASURED.len()]) -> f64,
) -> Vec<StartRecord> {
    let mut noise = normal(seed);
    let mut window = || {
        let mut values: [f64; MEASURED.len()] = std::array::from_fn(|_| noise());
        let class = MEASURED.iter().position(|own| *own == Condition::TerrainClass).unwrap();
        values[class] = (1.5 * values[class].abs()).floor().min(2.0);
        let mut residuals: [f64; N_QUANTITIES] =
            std::array::from_fn(|quantity| if quantity == VY { 0.0 } else { noise() });
        residuals[0] += residual(&values);
        Window { values, residual: residuals }
    };
    (0..n)
        .map(|_| StartRecord { position_m: [0.0; 2], mean_square: 1.0, windows: [window(), window()] })
        .collect()
}

#[test]
fn a_residual_that_depends_on_one_condition_is_found_in_it() {
    let null = records(600, 1, |_| 0.0);
    for (place, condition) in MEASURED.into_iter().enumerate() {
        let real = records(600, 2, |values| 4.0 * values[place]);
        let mut tables = condition_tables(&real, &null);
        // A class is never negative, so that its residuals have a mean as well.
        tables.retain(|table| table.condition != Condition::Constant);
        assert_eq!(tables[0].condition, condition, "{tables:?}");
        assert!(tables[0].share > 0.3 && tables[0].share < 1.0, "{condition:?}: {}", tables[0].share);
        assert!(tables[1].share < 0.1 * tables[0].share, "{condition:?}: {:?}", tables[1].condition);
    }
}

/// With the sign of the condition, without it, beyond a threshold: the shape does not matter.
#[test]
fn any_shape_of_dependence_is_found() {
    let null = records(600, 3, |_| 0.0);
    let shapes: [fn(f64) -> f64; 3] =
        [|value| 4.0 * value.abs(), |value| 3.0 * value * value, |value| if value > 1.0 { 8.0 } else { 0.0 }];
    for shape in shapes {
        let real = records(600, 4, |values| shape(values[0]));
        let tables = condition_tables(&real, &null);
        let speed = tables.iter().find(|table| table.condition == Condition::Speed).unwrap();
        let others =
            tables.iter().filter(|table| ![Condition::Speed, Condition::Constant].contains(&table.condition));
        assert!(speed.share > 0.2, "{}", speed.share);
        assert!(others.into_iter().all(|table| table.share < 0.1 * speed.share), "{tables:?}");
    }
}

#[test]
fn noise_is_no_place() {
    for seed in 0..10 {
        let (real, null) = (records(400, 10 + seed, |_| 0.0), records(400, 30 + seed, |_| 0.0));
        let found = places(&condition_tables(&real, &null));
        assert!(found.iter().all(|place| place.share < 0.01), "seed {seed}: {found:?}");
    }
}

/// What the simulator's own drives show under a condition is not the gap's.
#[test]
fn what_nominal_drives_show_as_well_is_taken_away() {
    let own = |values: &[f64; MEASURED.len()]| 3.0 * values[4];
    let (real, null) = (records(600, 5, own), records(600, 6, own));
    let tables = condition_tables(&real, &null);
    let lateral = tables.iter().find(|table| table.condition == Condition::LateralAcceleration).unwrap();
    assert!(lateral.share.abs() < 0.06 && lateral.null_share > 0.4, "{lateral:?}");
}

#[test]
fn an_offset_is_everywhere_the_same_and_in_no_condition() {
    let (real, null) = (records(600, 7, |_| 5.0), records(600, 8, |_| 0.0));
    let tables = condition_tables(&real, &null);
    assert_eq!(tables[0].condition, Condition::Constant);
    // 25 of 30.
    assert!((tables[0].share - 25.0 / 30.0).abs() < 0.02, "{}", tables[0].share);
    assert!(tables[1].share < 0.01, "{tables:?}");
}

/// A wheel of another size is off in proportion to the speed, a drag by the same at every speed: both have a mean, and
/// the first belongs to the speed. With speeds of 3 +- 1 the square of 2 v is 4 (9 + 1), of 6 it is 36; noise adds 5.
#[test]
fn a_shortfall_in_proportion_to_the_speed_belongs_to_the_speed() {
    let off = |shortfall: fn(f64) -> f64| {
        let mut real = records(600, 9, |_| 0.0);
        for window in real.iter_mut().flat_map(|record| &mut record.windows) {
            window.values[0] += 3.0;
            window.residual[0] += shortfall(window.values[0]);
        }
        let tables = condition_tables(&real, &records(600, 10, |_| 0.0));
        (tables[0].condition, tables[0].share, tables[1].share)
    };
    let (condition, share, next) = off(|speed| 2.0 * speed);
    assert_eq!(condition, Condition::Speed);
    assert!((share - 40.0 / 45.0).abs() < 0.03 && next < 0.02, "{share} {next}");
    let (condition, share, next) = off(|_| 6.0);
    assert_eq!(condition, Condition::Constant);
    assert!((share - 36.0 / 41.0).abs() < 0.03 && next < 0.02, "{share} {next}");
}

/// A residual of 2 v beside one of 3 p that the model misses: the second is the larger part, and an explanation takes the
/// first off. Variances of 4, 9 and the noise of five quantities: 4 / 18 is the speed's, less what eight bins leave of a
/// normal variable, 0.055 of it.
#[test]
fn an_explanation_lies_where_what_it_takes_off_does() {
    let pitch = MEASURED.iter().position(|own| *own == Condition::Pitch).unwrap();
    let real = records(2000, 13, |values| 2.0 * values[0] + 3.0 * values[pitch]);
    let measured = condition_tables(&real, &records(600, 14, |_| 0.0));
    assert_eq!(measured[0].condition, Condition::Pitch);
    let mut taken_off = real.clone();
    for window in taken_off.iter_mut().flat_map(|record| &mut record.windows) {
        window.residual = [0.0; N_QUANTITIES];
        window.residual[0] = 2.0 * window.values[0];
    }
    let tables = with_announced(&measured, (&real, &taken_off));
    let told = places(&tables);
    assert_eq!(told[0].condition, Condition::Speed);
    assert!((told[0].share - 0.945 * 4.0 / 18.0).abs() < 0.01, "{}", told[0].share);
    assert!(told[1..].iter().all(|place| place.share < 0.01), "{told:?}");
    // What was measured in the bins stays.
    let bins = |tables: &[ConditionTable]| {
        tables.iter().find(|table| table.condition == Condition::Pitch).unwrap().bins.clone()
    };
    assert_eq!(bins(&tables), bins(&measured));
}

/// Classes are names: each has its own bin, and one between two others is neither.
#[test]
fn every_class_has_its_own_bin() {
    let class = MEASURED.iter().position(|own| *own == Condition::TerrainClass).unwrap();
    let real = records(600, 11, |values| if values[class] == 1.0 { 4.0 } else { 0.0 });
    let tables = condition_tables(&real, &records(600, 12, |_| 0.0));
    assert_eq!(tables[0].condition, Condition::TerrainClass);
    // Five quantities of variance 1, and 16 in the middle.
    let squares: Vec<f64> = tables[0].bins.iter().map(|bin| bin.mean_square).collect();
    let expected = [1.0, 21.0 / 5.0, 1.0];
    assert!(squares.iter().zip(expected).all(|(own, expected)| (own - expected).abs() < 0.2), "{squares:?}");
    assert_eq!(tables[0].bins.iter().map(|bin| bin.low).collect::<Vec<f64>>(), [-0.5, 0.5, 1.5]);
}
