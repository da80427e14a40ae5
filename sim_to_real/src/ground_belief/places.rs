//! Where a belief and what was met part: by class, slope, roughness, familiarity, distance, speed and time.

use serde::Serialize;
use terrain::TerrainClass;
use traversability::Encounter;

use super::block_mean::{BlockMean, block_mean};
use super::calibration::{PARAMETERS, residual};

/// A way to sort footprints into bins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GroundCondition {
    /// The class that the map shows.
    Class,
    /// Slope along the heading [deg]; climbing is positive.
    Slope,
    /// Standard deviation of elevation under the footprint [m].
    Roughness,
    /// Share of the networks in the posterior.
    Familiarity,
    /// How far ahead the footprint was judged [m].
    Distance,
    /// Speed over ground [m/s].
    Speed,
    /// Time since the drive began [s].
    Time,
}

/// A bin of a condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaceBin {
    /// What it holds, with its unit.
    pub label: String,
    /// What was met less what was foretold.
    pub bias: BlockMean,
}

/// How a parameter's residual goes with a condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaceTable {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// What it was sorted by.
    pub condition: GroundCondition,
    /// Share of the residual's mean square that the bins' means explain, less what chance gives them.
    pub share: f64,
    /// The bins that hold enough, in order.
    pub bins: Vec<PlaceBin>,
}

impl GroundCondition {
    const ALL: [Self; 7] = [
        Self::Class,
        Self::Slope,
        Self::Roughness,
        Self::Familiarity,
        Self::Distance,
        Self::Speed,
        Self::Time,
    ];

    /// In words, with the unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Class => "class",
            Self::Slope => "slope along the heading [deg]",
            Self::Roughness => "roughness [m]",
            Self::Familiarity => "weight of what was learned [-]",
            Self::Distance => "distance ahead [m]",
            Self::Speed => "speed [m/s]",
            Self::Time => "time [s]",
        }
    }

    /// Inner edges of the bins of a quantity; those of a drive's own range are found in the data.
    fn edges(self, values: &mut [f64]) -> Vec<f64> {
        match self {
            Self::Class => vec![0.5, 1.5, 2.5],
            Self::Slope => vec![-20.0, -10.0, -5.0, 5.0, 10.0, 20.0],
            Self::Roughness => vec![0.02, 0.05, 0.1],
            Self::Familiarity => vec![0.1, 0.5, 0.9],
            Self::Distance | Self::Speed | Self::Time => quartiles(values),
        }
    }

    fn of(self, encounter: &Encounter) -> f64 {
        match self {
            Self::Class => f64::from(encounter.ground.class as u8),
            Self::Slope => encounter.ground.slope_along.atan().to_degrees(),
            Self::Roughness => f64::from(encounter.ground.unevenness_m),
            Self::Familiarity => {
                encounter.foretold.learned_share.iter().map(|s| f64::from(*s)).sum::<f64>() / 4.0
            }
            Self::Distance => encounter.distance_m,
            Self::Speed => encounter.speed_mps,
            Self::Time => encounter.time_s,
        }
    }

    fn label(self, edges: &[f64], bin: usize) -> String {
        match (self, bin.checked_sub(1).map(|below| edges[below]), edges.get(bin)) {
            (Self::Class, ..) => class_name(bin).to_owned(),
            (_, Some(low), Some(high)) => format!("{low:.2} to {high:.2}"),
            (_, Some(low), None) => format!("from {low:.2}"),
            (_, None, Some(high)) => format!("below {high:.2}"),
            (_, None, None) => "all".to_owned(),
        }
    }
}

/// A class in words.
pub fn class_name(class: usize) -> &'static str {
    match TerrainClass::ALL.get(class) {
        Some(TerrainClass::Open) => "open",
        Some(TerrainClass::Loose) => "loose",
        Some(TerrainClass::Vegetation) => "vegetation",
        Some(TerrainClass::Obstacle) => "obstacle",
        None => "unknown",
    }
}

fn quartiles(values: &mut [f64]) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values.get((share * values.len() as f64) as usize).copied();
    let mut edges: Vec<f64> = [0.25, 0.5, 0.75].into_iter().filter_map(at).collect();
    edges.dedup();
    edges
}

/// Every parameter by every condition, what tells most first. `near` were judged by the newest map, `all` from afar
/// too.
pub(super) fn place_tables(near: &[&Encounter], all: &[&Encounter]) -> Vec<PlaceTable> {
    let mut tables = Vec::new();
    for parameter in 0..PARAMETERS.len() {
        for condition in GroundCondition::ALL {
            let encounters = if condition == GroundCondition::Distance { all } else { near };
            tables.extend(table(encounters, parameter, condition));
        }
    }
    tables.sort_by(|a, b| b.share.total_cmp(&a.share));
    tables
}

fn table(encounters: &[&Encounter], parameter: usize, condition: GroundCondition) -> Option<PlaceTable> {
    let met: Vec<&Encounter> =
        encounters.iter().copied().filter(|met| !met.measured[parameter].is_nan()).collect();
    let edges = condition.edges(&mut met.iter().map(|met| condition.of(met)).collect::<Vec<_>>());
    let bin_of = |met: &Encounter| edges.partition_point(|edge| *edge <= condition.of(met));
    let square: f64 = met.iter().map(|met| residual(met, parameter).powi(2)).sum();
    let (mut bins, mut explained) = (Vec::new(), 0.0);
    for bin in 0..=edges.len() {
        let inside = met.iter().copied().filter(|met| bin_of(met) == bin);
        let Some(bias) = block_mean(inside, |met| residual(met, parameter)) else { continue };
        explained += bias.n as f64 * (bias.value.powi(2) - bias.standard_error().powi(2));
        bins.push(PlaceBin { label: condition.label(&edges, bin), bias });
    }
    let share = if square > 0.0 { (explained / square).max(0.0) } else { 0.0 };
    (bins.len() > 1).then_some(PlaceTable { parameter: PARAMETERS[parameter], condition, share, bins })
}
