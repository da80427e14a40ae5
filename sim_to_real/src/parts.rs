//! Parts of drives: early and late, to the left and to the right, slow and fast, by class of the ground, drive by drive;
//! and what announced parameters would be in each of them.

use crate::answer::{Division, Estimate, PartEstimate};
use crate::calibration::{coordinates_of_causes, value_at, with_values};
use crate::causes::Trial;
use crate::conditions::{between_classes, bin_of, quantiles};
use crate::drive::{Drive, VX};
use crate::least_squares::Linearised;
use crate::rollout::PER_START;
use bicycle::Effect;

/// Rollouts without which a part says nothing.
const FEWEST: usize = 15;
/// Steering and speed count over this many steps from a rollout's start.
const LOOK_AHEAD: usize = 50;
/// Parts of equal length in every drive, and of as many rollouts by speed.
const N_QUARTERS: usize = 4;
const N_SPEEDS: usize = 3;
/// Rollouts of the stretches that are left out in turn, five seconds, and how many there are at least and at most.
const STRETCH: usize = 25;
const N_STRETCHES: [usize; 2] = [3, 10];
/// Half the width of a 90 % interval in standard errors of a jackknife over 3 to 10 stretches (Student, 2 to 9 degrees).
const STUDENT_90: [f64; 8] = [2.920, 2.353, 2.132, 2.015, 1.943, 1.895, 1.860, 1.833];

/// A division with the values that part it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parts {
    pub(crate) division: Division,
    /// Ends of the parts, one more than there are parts.
    edges: Vec<f64>,
}

impl Parts {
    /// The first half of every drive and the second.
    pub(crate) fn early_and_late() -> Self {
        Self { division: Division::Time, edges: vec![0.0, 0.5, 1.0] }
    }

    /// Steering to the right and to the left; straight on counts as to the right.
    pub(crate) fn right_and_left() -> Self {
        let edges = vec![f64::NEG_INFINITY, f64::MIN_POSITIVE, f64::INFINITY];
        Self { division: Division::Steering, edges }
    }

    /// What drives are divided by for a picture; a division into one part is none.
    fn shown(drives: &[&Drive]) -> Vec<Self> {
        let all = |value: &dyn Fn(&Drive, usize) -> f64| -> Vec<f64> {
            drives.iter().flat_map(|drive| (0..drive.starts.len()).map(|place| value(drive, place))).collect()
        };
        let even = |n: usize| (0..=n).map(|k| k as f64 / n as f64).collect();
        let of_drives = (0..=drives.len()).map(|k| k as f64 + 0.5).collect();
        let shown = [
            Self { division: Division::Time, edges: even(N_QUARTERS) },
            Self { division: Division::Drive, edges: of_drives },
            Self::right_and_left(),
            Self { division: Division::Speed, edges: quantiles(all(&speed_mps), N_SPEEDS) },
            Self { division: Division::TerrainClass, edges: between_classes(all(&class)) },
        ];
        shown.into_iter().filter(|parts| parts.edges.len() > 2).collect()
    }

    /// The part that a rollout belongs to, of the drive with this number.
    fn part_of(&self, (number, drive): (usize, &Drive), place: usize) -> usize {
        let value = match self.division {
            Division::Time => place as f64 / drive.starts.len() as f64,
            Division::Drive => number as f64,
            Division::Steering => steering_rad(drive, place),
            Division::Speed => speed_mps(drive, place),
            Division::TerrainClass => class(drive, place),
        };
        bin_of(value, &self.edges)
    }

    /// Where a part begins and ends, where anything bounds it; what is counted is told by its number.
    fn bounds(&self, part: usize) -> [Option<f64>; 2] {
        let edges = [self.edges[part], self.edges[part + 1]];
        match self.division {
            Division::Drive | Division::TerrainClass => [Some(0.5 * (edges[0] + edges[1])); 2],
            Division::Time | Division::Steering | Division::Speed => {
                edges.map(|edge| Some(edge).filter(|edge| edge.is_finite()))
            }
        }
    }

    /// Both parts of the drives; `None` where one of them is too little of a drive.
    pub(crate) fn split(&self, drives: &[Drive]) -> Option<[Vec<Drive>; 2]> {
        let part = |part: usize| {
            drives.iter().enumerate().map(move |(number, drive)| {
                let places =
                    (0..drive.starts.len()).filter(|&i| self.part_of((number + 1, drive), i) == part);
                Drive { starts: places.map(|i| drive.starts[i]).collect(), ..drive.clone() }
            })
        };
        let parts = [0, 1].map(|half| part(half).collect::<Vec<_>>());
        parts.iter().flatten().all(|drive| drive.starts.len() >= FEWEST).then_some(parts)
    }

    /// Numbers of a part's rollouts among those of all drives.
    fn rollouts(&self, drives: &[&Drive], part: usize) -> Vec<usize> {
        let places = drives.iter().enumerate().flat_map(|(number, drive)| {
            (0..drive.starts.len()).map(move |place| self.part_of((number + 1, drive), place))
        });
        places.enumerate().filter(|(_, own)| *own == part).map(|(rollout, _)| rollout).collect()
    }
}

fn ahead(drive: &Drive, place: usize) -> std::ops::Range<usize> {
    let start = drive.starts[place];
    start..start + LOOK_AHEAD
}

fn steering_rad(drive: &Drive, place: usize) -> f64 {
    let ahead = &drive.commands[ahead(drive, place)];
    ahead.iter().map(|command| f64::from(command.steering_rad)).sum::<f64>() / LOOK_AHEAD as f64
}

fn speed_mps(drive: &Drive, place: usize) -> f64 {
    drive.smooth[VX][ahead(drive, place)].iter().sum::<f64>() / LOOK_AHEAD as f64
}

fn class(drive: &Drive, place: usize) -> f64 {
    f64::from(drive.class[drive.starts[place]])
}

/// What the parameters of announced effects would be in every part of the drives: where its loss is least, the residuals
/// linear around where all drives put them and the calibration held, with the interval of a jackknife over the part's
/// stretches. What the model and the effects' forms add to the intervals of the whole is the same in every part, and not in
/// these.
pub(crate) fn by_part(trial: &Trial<'_>, causes: &[Effect]) -> Vec<PartEstimate> {
    if causes.is_empty() {
        return Vec::new();
    }
    let coordinates = coordinates_of_causes(causes);
    let whole: Vec<f64> = coordinates.iter().map(|coordinate| coordinate.start).collect();
    let linearised =
        Linearised::at(&coordinates, &whole, |values| trial.judged_residuals(&with_values(causes, values)));
    let drives: Vec<&Drive> = trial.comparison.drives().collect();
    let of_part = |parts: &Parts, part: usize| {
        let rollouts = parts.rollouts(&drives, part);
        (rollouts.len() >= FEWEST).then_some(())?;
        let (change, own) = linearised.of_rows(&rollouts, PER_START).at_its_least()?;
        let n = (rollouts.len() / STRETCH).clamp(N_STRETCHES[0], N_STRETCHES[1]);
        let half = own.jackknife(n).into_iter().map(move |error| STUDENT_90[n - N_STRETCHES[0]] * error);
        let places = whole.iter().zip(change.iter()).map(|(whole, change)| whole + change);
        let found: Vec<(f64, f64)> = places.zip(half).collect();
        Some(estimates(causes, &found, (parts, part, rollouts.len())))
    };
    let all = Parts::shown(&drives);
    let of_division = |parts: &Parts| -> Vec<PartEstimate> {
        (0..parts.edges.len() - 1).filter_map(|part| of_part(parts, part)).flatten().collect()
    };
    all.iter().flat_map(of_division).collect()
}

/// The parameters in one part, from places and half-widths in the coordinates of the fit.
fn estimates(
    causes: &[Effect],
    found: &[(f64, f64)],
    (parts, part, n_rollouts): (&Parts, usize, usize),
) -> Vec<PartEstimate> {
    let [from, to] = parts.bounds(part);
    let of = |cause: &Effect| {
        let effect = cause.description().cause;
        cause.description().parameters.iter().map(move |parameter| (effect, parameter))
    };
    let told = causes.iter().flat_map(of).zip(found).filter(|(_, (_, half))| half.is_finite());
    told.map(|((effect, parameter), &(place, half))| {
        let [value, low, high] = [0.0, -half, half].map(|apart| value_at(parameter, place + apart));
        PartEstimate {
            effect: effect.to_owned(),
            parameter: parameter.name.to_owned(),
            division: parts.division,
            from,
            to,
            n_rollouts,
            estimate: Estimate { value, low, high },
        }
    })
    .collect()
}
