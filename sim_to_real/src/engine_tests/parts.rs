//! What parameters would be in parts of the drives.

use super::{Made, arcs, effect};
use crate::answer::{Division, PartEstimate};
use crate::causes::{Explanation, Trial};
use crate::comparison::{Comparison, Yardstick};
use crate::drive::Drive;
use crate::parts::{Parts, by_part};
use bicycle::Effect;

fn yardstick() -> Yardstick {
    let (nominal, rough) = (arcs(Made::RIGHT, 3), Yardstick::rough());
    Yardstick::of(&Comparison::new(1.0, vec![&nominal], &rough).residuals(&[]), &rough)
}

fn trial<'a>(drives: &'a [Drive], yardstick: &Yardstick) -> Trial<'a> {
    Trial::fixed(Comparison::new(1.0, drives.iter().collect(), yardstick), &[])
}

/// The ratio of the steering that drives ask for, fitted.
fn ratio(drives: &[Drive], yardstick: &Yardstick) -> Effect {
    let (trial, start) = (trial(drives, yardstick), vec![effect("steer_gain", 0.9)]);
    let loss = trial.loss(&start);
    trial.refined(Explanation::new(start, loss)).causes[0]
}

fn of_division(parts: &[PartEstimate], division: Division) -> Vec<&PartEstimate> {
    parts.iter().filter(|part| part.division == division).collect()
}

/// A ratio of 0.85 to the right and of 0.85 * 0.9 to the left, mixed by rollouts that see both: with residuals linear
/// around what all drives ask for, a part's least is where a fit to it alone ends, to half a hundredth.
#[test]
fn a_part_asks_for_what_a_fit_to_it_alone_finds() {
    let yardstick = yardstick();
    let made = Made { curvature_ratio: 0.85, left_ratio: 0.9, ..Made::RIGHT };
    let drives = [1, 2].map(|seed| arcs(made, seed));
    let whole = ratio(&drives, &yardstick);
    let parts = by_part(&trial(&drives, &yardstick), &[whole]);
    let sides = of_division(&parts, Division::Steering);
    let alone = Parts::right_and_left().split(&drives).unwrap();
    for (part, alone) in sides.iter().zip(&alone) {
        let found = ratio(alone, &yardstick).values()[0];
        assert!((part.estimate.value - found).abs() < 0.005, "{} {found}", part.estimate.value);
        assert_eq!(part.n_rollouts, alone.iter().map(|drive| drive.starts.len()).sum::<usize>());
    }
    let [right, left] = sides[..] else { panic!("expected two sides, found {}", sides.len()) };
    assert!(right.estimate.low > left.estimate.high, "{:?} {:?}", right.estimate, left.estimate);
    assert_eq!((right.from, left.to), (None, None));
    let quarters = of_division(&parts, Division::Time);
    assert_eq!(quarters.iter().map(|part| part.from.unwrap()).collect::<Vec<_>>(), [0.0, 0.25, 0.5, 0.75]);
    assert_eq!(of_division(&parts, Division::Drive).iter().filter_map(|part| part.from).sum::<f64>(), 3.0);
    // The ground is of one class.
    assert!(of_division(&parts, Division::TerrainClass).is_empty());
}

/// Of a constant ratio the intervals of quarters hold what all of the drives ask for. A quarter and the whole differ by
/// sqrt(1 - 1/4) of the quarter's own error, of which 1.645 / 0.866 = 1.90 standard deviations hold 94 %; rollouts of 2 s in
/// stretches of 3.4 s share what they see across their borders, which makes three stretches more alike than three drives
/// would be, and of 160 intervals 86 % hold.
#[test]
fn parts_of_what_is_constant_differ_by_chance() {
    let yardstick = yardstick();
    let (mut held, mut n) = (0, 0);
    for seed in 10..50 {
        let drives =
            [2 * seed, 2 * seed + 1].map(|seed| arcs(Made { curvature_ratio: 0.88, ..Made::RIGHT }, seed));
        let whole = ratio(&drives, &yardstick);
        for part in of_division(&by_part(&trial(&drives, &yardstick), &[whole]), Division::Time) {
            held += usize::from((part.estimate.low..=part.estimate.high).contains(&whole.values()[0]));
            n += 1;
        }
    }
    let share = f64::from(u32::try_from(held).unwrap()) / f64::from(n);
    assert!(n == 160 && (0.80..=0.96).contains(&share), "{share} of {n}");
}

#[test]
fn nothing_announced_has_no_parts() {
    let drives = [arcs(Made::RIGHT, 1)];
    assert!(by_part(&trial(&drives, &Yardstick::rough()), &[]).is_empty());
}
