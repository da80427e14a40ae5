//! Which layer of a belief says so: physics prior, networks, what they make together, heights and classes of the map.

use serde::Serialize;
use terrain::TerrainClass;
use traversability::{Encounter, N_BINS, Pmf};

use super::block_mean::{BlockMean, block_mean};
use super::calibration::{BINS, PARAMETERS};
use super::places::class_name;

/// Error of every layer's distributions, EMD2 to what was met (PIETRA, equation 12, in squared bins).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LayerErrors {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// Of the physics prior.
    pub prior: Option<BlockMean>,
    /// Of the networks, where they judged.
    pub networks: Option<BlockMean>,
    /// Of what was driven on.
    pub posterior: Option<BlockMean>,
    /// Of knowing nothing.
    pub uniform: Option<BlockMean>,
}

/// Heights of the map under the wheels less those that the vehicle had there [m].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeightErrors {
    /// On all ground.
    pub all: Option<BlockMean>,
    /// By class.
    pub by_class: Vec<(&'static str, BlockMean)>,
}

/// EMD2 of a distribution to what was met; NaN where the measurement means nothing.
fn error(pmf: &Pmf, encounter: &Encounter, parameter: usize) -> f64 {
    let Some(met) = BINS[parameter].bin_of(encounter.measured[parameter]) else { return f64::NAN };
    let (mut gap, mut sum) = (0.0, 0.0);
    for bin in 0..N_BINS {
        gap += f64::from(pmf.probabilities()[bin]) - f64::from(u8::from(bin == met));
        sum += gap * gap;
    }
    sum
}

impl LayerErrors {
    pub(super) fn of(encounters: &[&Encounter], parameter: usize) -> Self {
        let of = |layer: &dyn Fn(&Encounter) -> Option<Pmf>| {
            block_mean(encounters.iter().copied(), |met| {
                layer(met).map_or(f64::NAN, |pmf| error(&pmf, met, parameter))
            })
        };
        Self {
            parameter: PARAMETERS[parameter],
            prior: of(&|met| Some(met.foretold.prior[parameter])),
            networks: of(&|met| met.foretold.networks.map(|networks| networks[parameter])),
            posterior: of(&|met| Some(met.foretold.posterior[parameter])),
            uniform: of(&|_| Some(Pmf::UNIFORM)),
        }
    }
}

impl HeightErrors {
    pub(super) fn of(encounters: &[&Encounter]) -> Self {
        let of = |is_meant: &dyn Fn(TerrainClass) -> bool| {
            let meant = encounters.iter().copied().filter(|met| is_meant(met.ground.class));
            block_mean(meant, |met| met.ground.height_error_m)
        };
        let by_class = TerrainClass::ALL.into_iter().filter_map(|class| {
            let mean = of(&|other| other == class)?;
            Some((class_name(class as usize), mean))
        });
        Self { all: of(&|_| true), by_class: by_class.collect() }
    }
}
