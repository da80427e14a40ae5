//! Where the residual lies: under which conditions it is large, beyond what it is there between nominal drives.

use crate::answer::{Condition, Place};
use crate::drive::{Drive, N_STEPS, STEP_S, VX, WZ, X, Y, YAW};
use crate::findings::{ConditionBin, ConditionTable, GroundResidual};
use crate::rollout::{N_QUANTITIES, PER_START};
use serde::{Deserialize, Serialize};

/// Bins of a condition, each with as many rollouts as the next.
const N_BINS: usize = 8;
/// How far before a rollout's start a change of the command still acts [s].
const BEFORE_S: f64 = 0.5;

/// The conditions that are a number, in the order of [`StartRecord::values`].
pub(crate) const MEASURED: [Condition; 9] = [
    Condition::Speed,
    Condition::Steering,
    Condition::SteeringChange,
    Condition::SpeedChange,
    Condition::LateralAcceleration,
    Condition::Pitch,
    Condition::Roll,
    Condition::TerrainClass,
    Condition::Heading,
];

/// A rollout's conditions and residuals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartRecord {
    /// Values of the [`MEASURED`] conditions, each the mean over the rollout or the largest change.
    pub(crate) values: [f64; MEASURED.len()],
    /// East, north [m].
    pub(crate) position_m: [f64; 2],
    /// Mean residual of each quantity over the horizons, in standard deviations.
    pub(crate) residual: [f64; N_QUANTITIES],
    /// Mean squared residual, in variances.
    pub(crate) mean_square: f64,
}

impl StartRecord {
    /// One record per start of every drive, in the order of the residuals.
    pub(crate) fn of(drives: &[&Drive], residuals: &[f32]) -> Vec<Self> {
        let starts = drives.iter().flat_map(|drive| drive.starts.iter().map(move |&start| (*drive, start)));
        starts
            .zip(residuals.chunks(PER_START))
            .map(|((drive, start), own)| Self::new(drive, start, own))
            .collect()
    }

    fn new(drive: &Drive, start: usize, residuals: &[f32]) -> Self {
        let horizons = (PER_START / N_QUANTITIES) as f64;
        let residual = std::array::from_fn(|quantity| {
            let own = residuals.iter().skip(quantity).step_by(N_QUANTITIES);
            own.map(|value| f64::from(*value)).sum::<f64>() / horizons
        });
        let squares: f64 = residuals.iter().map(|value| f64::from(*value).powi(2)).sum();
        Self {
            values: values(drive, start),
            position_m: [drive.smooth[X][start], drive.smooth[Y][start]],
            residual,
            mean_square: squares / PER_START as f64,
        }
    }
}

fn values(drive: &Drive, start: usize) -> [f64; MEASURED.len()] {
    let rows = start..start + N_STEPS;
    let n = N_STEPS as f64;
    let mean = |of: &dyn Fn(usize) -> f64| rows.clone().map(of).sum::<f64>() / n;
    let earlier = start.saturating_sub((BEFORE_S / STEP_S) as usize);
    let spread = |of: &dyn Fn(usize) -> f64| {
        let (low, high) = (earlier..start + N_STEPS)
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        high - low
    };
    let smooth = |quantity: usize| move |row: usize| drive.smooth[quantity][row];
    let slope = |left: bool| {
        move |row: usize| {
            let (sine, cosine) = drive.smooth[YAW][row].sin_cos();
            let [east, north] = [0, 1].map(|axis| f64::from(drive.gradient[axis][row]));
            if left { north * cosine - east * sine } else { east * cosine + north * sine }
        }
    };
    [
        mean(&smooth(VX)),
        mean(&|row| f64::from(drive.commands[row].steering_rad)),
        spread(&|row| f64::from(drive.commands[row].steering_rad)),
        spread(&|row| f64::from(drive.commands[row].speed_mps)),
        mean(&|row| drive.smooth[VX][row] * drive.smooth[WZ][row]),
        mean(&slope(false)),
        mean(&slope(true)),
        mean(&|row| f64::from(drive.class[row])),
        drive.smooth[YAW][start].sin().atan2(drive.smooth[YAW][start].cos()),
    ]
}

/// The tables of all conditions: strongest share first.
pub(crate) fn condition_tables(real: &[StartRecord], null: &[StartRecord]) -> Vec<ConditionTable> {
    let mut tables: Vec<ConditionTable> =
        (0..MEASURED.len()).filter_map(|place| condition_table(place, real, null)).collect();
    tables.push(constant_table(real, null));
    tables.sort_by(|a, b| b.share.total_cmp(&a.share));
    tables
}

/// Conditions that explain more than their null.
pub(crate) fn places(tables: &[ConditionTable]) -> Vec<Place> {
    let stands_out = tables.iter().filter(|table| table.share > 0.0);
    stands_out.map(|table| Place { condition: table.condition, share: table.share }).collect()
}

fn condition_table(place: usize, real: &[StartRecord], null: &[StartRecord]) -> Option<ConditionTable> {
    let edges = quantiles(real.iter().map(|record| record.values[place]).collect());
    if edges.len() < 3 {
        return None;
    }
    let null_share = explained(place, null, &edges);
    let bins = edges.windows(2).enumerate().map(|(i, edge)| {
        let inside = |records: &[StartRecord]| {
            let own = records.iter().filter(|record| bin_of(record.values[place], &edges) == i);
            own.map(|record| record.mean_square).collect::<Vec<f64>>()
        };
        let (own, nominal) = (inside(real), inside(null));
        ConditionBin {
            low: edge[0],
            high: edge[1],
            n: own.len(),
            mean_square: mean(&own),
            null_mean_square: mean(&nominal),
        }
    });
    Some(ConditionTable {
        condition: MEASURED[place],
        share: explained(place, real, &edges) - null_share,
        null_share,
        bins: bins.filter(|bin| bin.n > 0).collect(),
    })
}

/// The share of the squared residual that a constant offset makes.
fn constant_table(real: &[StartRecord], null: &[StartRecord]) -> ConditionTable {
    let share = |records: &[StartRecord]| {
        let offset = |quantity: usize| {
            let values: Vec<f64> = records.iter().map(|record| record.residual[quantity]).collect();
            mean(&values).powi(2)
        };
        let squares: Vec<f64> =
            records.iter().flat_map(|record| record.residual.map(|value| value * value)).collect();
        (0..N_QUANTITIES).map(offset).sum::<f64>() / (mean(&squares) * N_QUANTITIES as f64)
    };
    let null_share = share(null);
    ConditionTable {
        condition: Condition::Constant,
        share: share(real) - null_share,
        null_share,
        bins: Vec::new(),
    }
}

/// Part of the variance of the residuals that bins explain, freed of what so many bins explain of noise: signed
/// residuals of every quantity, and their squares.
fn explained(place: usize, records: &[StartRecord], edges: &[f64]) -> f64 {
    let quantities = (0..N_QUANTITIES)
        .map(|quantity| variance_shares(place, records, edges, |record| record.residual[quantity]))
        .fold([0.0; 2], |sum, [between, total]| [sum[0] + between, sum[1] + total]);
    quantities[0] / quantities[1].max(1e-12)
}

/// Variance between bins, less that of as many bins of noise, and in all.
fn variance_shares(
    place: usize,
    records: &[StartRecord],
    edges: &[f64],
    of: impl Fn(&StartRecord) -> f64,
) -> [f64; 2] {
    let all: Vec<f64> = records.iter().map(&of).collect();
    let centre = mean(&all);
    let total: f64 = all.iter().map(|value| (value - centre).powi(2)).sum();
    let mut between = 0.0;
    for bin in 0..edges.len() - 1 {
        let own: Vec<f64> =
            records.iter().filter(|record| bin_of(record.values[place], edges) == bin).map(&of).collect();
        if !own.is_empty() {
            between += own.len() as f64 * (mean(&own) - centre).powi(2);
        }
    }
    [between, total]
}

/// Residuals over the ground.
pub(crate) fn ground_residuals(before: &[StartRecord], after: &[StartRecord]) -> Vec<GroundResidual> {
    let both = before.iter().zip(after);
    both.map(|(before, after)| GroundResidual {
        x_m: before.position_m[0],
        y_m: before.position_m[1],
        before: before.mean_square.sqrt(),
        after: after.mean_square.sqrt(),
    })
    .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Edges between bins with equally many values; fewer where values repeat.
fn quantiles(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    let mut edges: Vec<f64> = (0..=N_BINS).map(|k| values[last * k / N_BINS]).collect();
    edges.dedup();
    edges
}

/// The bin of a value; what lies outside belongs to the nearest.
fn bin_of(value: f64, edges: &[f64]) -> usize {
    edges[1..edges.len() - 1].partition_point(|edge| *edge <= value)
}
