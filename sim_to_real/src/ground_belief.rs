//! Where a belief about the ground and what a drive met there part, which layer of the belief says so, and what has
//! changed since drives on which all was right.

mod block_mean;
mod calibration;
mod causes;
mod layers;
mod places;
mod signature;

use serde::Serialize;
use traversability::Encounter;

pub use block_mean::BlockMean;
pub use calibration::{Calibration, N_PIT, PARAMETERS, Parting};
pub use causes::{GroundCause, GroundChange, RankedGroundCause};
pub use layers::{HeightErrors, LayerErrors};
pub use places::{GroundCondition, PlaceBin, PlaceTable};

use signature::Signature;

/// Version of the report's layout in files.
pub const GROUND_SCHEMA_VERSION: u32 = 1;

/// What drives say of the belief that they were driven by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroundReport {
    /// Version of this layout.
    pub schema_version: u32,
    /// Footprints that were judged by the newest map before they were met.
    pub n_met: usize,
    /// The same of the reference drives.
    pub n_reference: usize,
    /// Every parameter, what was foretold against what was met.
    pub calibration: Vec<Calibration>,
    /// By class, slope and so on, what tells most first.
    pub places: Vec<PlaceTable>,
    /// Error of every layer.
    pub layers: Vec<LayerErrors>,
    /// Of the map.
    pub heights: HeightErrors,
    /// What has changed since the reference drives; `None` without any, or when both sets show nothing in common.
    pub change: Option<GroundChange>,
}

/// Nothing to judge a belief by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GroundBeliefError {
    /// No footprint of the drives was judged.
    #[error("drives: expected footprints on ground that the map shows, found none in {n_drives} drives")]
    NothingMet {
        /// Drives that were looked at.
        n_drives: usize,
    },
}

/// Holds what was foretold against what was met. `reference` are drives of a time, or of a simulator, with which all was
/// right; it may be empty. Encounters come drive by drive in the order of time.
///
/// # Errors
/// No footprint was judged.
pub fn judge_ground(
    met: &[Encounter],
    reference: &[Encounter],
    n_drives: usize,
) -> Result<GroundReport, GroundBeliefError> {
    let near = newest(met);
    if near.is_empty() {
        return Err(GroundBeliefError::NothingMet { n_drives });
    }
    let all: Vec<&Encounter> = met.iter().collect();
    let parameters = 0..PARAMETERS.len();
    let before = newest(reference);
    let change = (!before.is_empty())
        .then(|| causes::change(&Signature::of(&near), &Signature::of(&before)))
        .flatten();
    Ok(GroundReport {
        schema_version: GROUND_SCHEMA_VERSION,
        n_met: near.len(),
        n_reference: before.len(),
        calibration: parameters.clone().map(|parameter| Calibration::of(&near, parameter)).collect(),
        places: places::place_tables(&near, &all),
        layers: parameters.map(|parameter| LayerErrors::of(&near, parameter)).collect(),
        heights: HeightErrors::of(&near),
        change,
    })
}

/// Of every footprint, what was foretold by the newest map: the first of those that were met at one time.
fn newest(encounters: &[Encounter]) -> Vec<&Encounter> {
    let together = encounters.chunk_by(|a, b| a.drive == b.drive && a.time_s == b.time_s);
    together.filter_map(<[Encounter]>::first).collect()
}
