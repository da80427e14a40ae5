//! Where the residual lies: under which conditions it is large, beyond what it is there between nominal drives.

use crate::answer::{Condition, Place};
use crate::comparison::root_mean_square;
use crate::drive::{Drive, HORIZONS, N_QUANTITIES, STEP_S, VX, WZ, X, Y, YAW};
use crate::findings::{ConditionBin, ConditionTable, GroundResidual};
use crate::rollout::PER_START;
use serde::{Deserialize, Serialize};

/// Bins of a condition, each with as many rollouts as the next.
pub(crate) const N_BINS: usize = 8;
/// Horizons at which the residual is laid out over the conditions, as places in [`HORIZONS`]: long enough for a motion to
/// show, short enough for the conditions to be one.
pub(crate) const LAID_OUT: [usize; 2] = [1, 2];
/// A change of the command counts from this long before the rollout, for steering and for speed [s].
const BEFORE_S: [f64; 2] = [0.2, 0.5];

/// The conditions that are a number, in the order of [`Window::values`].
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

/// Place of the speed among them.
const SPEED: usize = 0;
/// Quantities along the vehicle: what is short of its speed is short in these.
const LONGITUDINAL: [usize; 2] = [0, 3];

/// A rollout's conditions and residuals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartRecord {
    /// East, north [m].
    pub(crate) position_m: [f64; 2],
    /// Mean squared residual, in variances.
    pub(crate) mean_square: f64,
    /// From the start to each horizon that is laid out.
    pub(crate) windows: [Window; LAID_OUT.len()],
}

/// What a rollout met until a horizon, and how far it was off there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Window {
    /// Values of the [`MEASURED`] conditions: means, and changes with their sign.
    pub(crate) values: [f64; MEASURED.len()],
    /// Residual of each quantity, in standard deviations.
    pub(crate) residual: [f64; N_QUANTITIES],
}

impl Window {
    /// Mean squared residual of the quantities that were measured, if any was.
    fn mean_square(&self) -> Option<f64> {
        let squares = self.residual.iter().filter(|value| **value != 0.0).map(|value| value * value);
        let squares: Vec<f64> = squares.collect();
        (!squares.is_empty()).then(|| mean(&squares))
    }
}

impl StartRecord {
    /// One record per start of every drive, in the order of the residuals.
    pub(crate) fn of(drives: &[&Drive], residuals: &[f32]) -> Vec<Self> {
        let starts = drives.iter().flat_map(|drive| drive.starts.iter().map(move |&start| (*drive, start)));
        let records = starts.zip(residuals.chunks(PER_START));
        records.map(|((drive, start), own)| Self::new(drive, start, own)).collect()
    }

    fn new(drive: &Drive, start: usize, residuals: &[f32]) -> Self {
        let window = |horizon: usize| Window {
            values: values(drive, start, HORIZONS[horizon]),
            residual: std::array::from_fn(|quantity| f64::from(residuals[horizon * N_QUANTITIES + quantity])),
        };
        Self {
            position_m: [drive.smooth[X][start], drive.smooth[Y][start]],
            mean_square: root_mean_square(residuals).powi(2),
            windows: LAID_OUT.map(window),
        }
    }
}

fn values(drive: &Drive, start: usize, steps: usize) -> [f64; MEASURED.len()] {
    let end = start + steps;
    let mean = |of: &dyn Fn(usize) -> f64| (start..end).map(of).sum::<f64>() / steps as f64;
    let smooth = |quantity: usize| move |row: usize| drive.smooth[quantity][row];
    let steering = |row: usize| f64::from(drive.commands[row].steering_rad);
    let speed = |row: usize| f64::from(drive.commands[row].speed_mps);
    let earlier = BEFORE_S.map(|before_s| start.saturating_sub((before_s / STEP_S) as usize));
    let slope = |[ahead, left]: [f64; 2]| {
        move |row: usize| {
            let (sine, cosine) = drive.smooth[YAW][row].sin_cos();
            let [east, north] = [0, 1].map(|axis| f64::from(drive.gradient[axis][row]));
            ahead * (east * cosine + north * sine) + left * (north * cosine - east * sine)
        }
    };
    let yaw = drive.smooth[YAW][start];
    [
        mean(&smooth(VX)),
        mean(&steering),
        steering(end) - steering(earlier[0]),
        speed(end) - speed(earlier[1]),
        mean(&|row| drive.smooth[VX][row] * drive.smooth[WZ][row]),
        mean(&slope([1.0, 0.0])),
        mean(&slope([0.0, 1.0])),
        mean(&|row| f64::from(drive.class[row])),
        yaw.sin().atan2(yaw.cos()),
    ]
}

/// The tables of all conditions: strongest share first.
pub(crate) fn condition_tables(real: &[StartRecord], null: &[StartRecord]) -> Vec<ConditionTable> {
    let mut tables: Vec<ConditionTable> =
        (0..MEASURED.len()).filter_map(|place| condition_table(place, real, null)).collect();
    let mut constant = constant_table(real, null);
    let with_speed = share_in_proportion_to_speed(real);
    constant.share -= with_speed;
    tables.push(constant);
    let of_speed = tables.iter_mut().find(|table| table.condition == Condition::Speed);
    of_speed.into_iter().for_each(|table| table.share += with_speed);
    tables.sort_by(|a, b| b.share.total_cmp(&a.share));
    tables
}

/// The same tables with what an explanation tells of the real residuals: the shares of what it takes off them, in which there
/// is neither noise nor what the model misses besides. The strongest of these comes first.
pub(crate) fn with_announced(
    tables: &[ConditionTable],
    (real, taken_off): (&[StartRecord], &[StartRecord]),
) -> Vec<ConditionTable> {
    let [of_real, of_taken] = [real, taken_off].map(|records| squares(&windows(records).collect::<Vec<_>>()));
    let part = of_taken / of_real.max(f64::MIN_POSITIVE);
    let told = condition_tables(taken_off, &[]).into_iter();
    let with_share = |told: ConditionTable| {
        let table = tables.iter().find(|table| table.condition == told.condition)?;
        Some(ConditionTable { announced_share: Some(told.share * part), ..table.clone() })
    };
    told.filter_map(with_share).collect()
}

/// Conditions where the gap lies: by what is announced where that is all of it, else by what they explain beyond their null.
pub(crate) fn places(tables: &[ConditionTable]) -> Vec<Place> {
    let shares = tables.iter().map(|table| Place {
        condition: table.condition,
        share: table.announced_share.unwrap_or(table.share),
    });
    shares.filter(|place| place.share > 0.0).collect()
}

fn condition_table(place: usize, real: &[StartRecord], null: &[StartRecord]) -> Option<ConditionTable> {
    let values = windows(real).map(|window| window.values[place]).collect();
    let edges = edges(place, values)?;
    let null_share = explained(place, null, &edges);
    let bins = edges.windows(2).enumerate().map(|(bin, edge)| {
        let inside = |records: &[StartRecord]| {
            let own = windows(records).filter(|window| bin_of(window.values[place], &edges) == bin);
            own.filter_map(Window::mean_square).collect::<Vec<f64>>()
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
        announced_share: None,
        bins: bins.filter(|bin| bin.n > 0).collect(),
    })
}

fn windows(records: &[StartRecord]) -> impl Iterator<Item = &Window> {
    records.iter().flat_map(|record| &record.windows)
}

/// The share of the squared residual that its mean makes.
fn constant_table(real: &[StartRecord], null: &[StartRecord]) -> ConditionTable {
    let share = |records: &[StartRecord]| {
        let all: Vec<&Window> = windows(records).collect();
        mean_squares(&all) / squares(&all).max(f64::MIN_POSITIVE)
    };
    let null_share = share(null);
    ConditionTable {
        condition: Condition::Constant,
        share: share(real) - null_share,
        null_share,
        announced_share: None,
        bins: Vec::new(),
    }
}

/// The constant share that belongs to the speed: of the quantities along the vehicle whose residual is in proportion to
/// the speed rather than the same at every speed, as that of a wheel of another size is.
fn share_in_proportion_to_speed(records: &[StartRecord]) -> f64 {
    let all: Vec<&Window> = windows(records).collect();
    let along = |quantity: usize| {
        let sum = |of: &dyn Fn(f64, f64) -> f64| {
            all.iter().map(|window| of(window.residual[quantity], window.values[SPEED])).sum::<f64>()
        };
        let the_same = sum(&|residual, _| residual).powi(2) / all.len().max(1) as f64;
        let in_proportion = sum(&|residual, speed| residual * speed).powi(2)
            / sum(&|_, speed| speed * speed).max(f64::MIN_POSITIVE);
        if in_proportion > the_same { the_same } else { 0.0 }
    };
    LONGITUDINAL.into_iter().map(along).sum::<f64>() / squares(&all).max(f64::MIN_POSITIVE)
}

/// The share of the squared residual that the means of bins make beyond the mean of all.
fn explained(place: usize, records: &[StartRecord], edges: &[f64]) -> f64 {
    let all: Vec<&Window> = windows(records).collect();
    let of_bin = |bin: usize| {
        let inside = all.iter().filter(|window| bin_of(window.values[place], edges) == bin);
        mean_squares(&inside.copied().collect::<Vec<&Window>>())
    };
    let between = (0..edges.len() - 1).map(of_bin).sum::<f64>() - mean_squares(&all);
    between / squares(&all).max(f64::MIN_POSITIVE)
}

/// Number of windows times the squared mean residual, over all quantities.
fn mean_squares(windows: &[&Window]) -> f64 {
    let sums = windows.iter().fold([0.0; N_QUANTITIES], |sums, window| {
        std::array::from_fn(|quantity| sums[quantity] + window.residual[quantity])
    });
    sums.iter().map(|sum| sum * sum).sum::<f64>() / windows.len().max(1) as f64
}

/// Squared residuals over all windows and quantities.
fn squares(windows: &[&Window]) -> f64 {
    windows.iter().flat_map(|window| window.residual).map(|value| value * value).sum()
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

/// Edges between the bins of a condition; `None` where it has one value.
pub(crate) fn edges(condition: usize, values: Vec<f64>) -> Option<Vec<f64>> {
    let is_class = MEASURED[condition] == Condition::TerrainClass;
    let edges = if is_class { between_classes(values) } else { quantiles(values, N_BINS) };
    (edges.len() > 2).then_some(edges)
}

/// Edges between so many bins with equally many values; fewer where values repeat.
pub(crate) fn quantiles(mut values: Vec<f64>, n_bins: usize) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    let mut edges: Vec<f64> = (0..=n_bins).map(|k| values[last * k / n_bins]).collect();
    edges.dedup();
    edges
}

/// Edges half way between the numbers of the classes.
pub(crate) fn between_classes(values: Vec<f64>) -> Vec<f64> {
    let last = values.into_iter().fold(0.0, f64::max).round() as u8;
    (0..=u16::from(last) + 1).map(|class| f64::from(class) - 0.5).collect()
}

/// The bin of a value; what lies outside belongs to the nearest.
pub(crate) fn bin_of(value: f64, edges: &[f64]) -> usize {
    edges[1..edges.len() - 1].partition_point(|edge| *edge <= value)
}
