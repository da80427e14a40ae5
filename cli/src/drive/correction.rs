//! What corrects commands for the ground under the wheels: as asked, and nothing else.

use std::path::Path;
use std::sync::Arc;

use bicycle::Vehicle;
use kinodynamics::Checkpoint;

use super::knowledge::read;
use crate::UsageError;
use crate::arguments::DriveArguments;

/// The files of an inverse model in its folder.
const WEIGHTS: &str = "kinodynamics.safetensors";
const SIDECAR: &str = "kinodynamics.json";

/// The networks that were asked for; refuses those of another vehicle.
pub(super) fn choose(
    arguments: &DriveArguments,
    vehicle: &Vehicle,
) -> Result<Option<Arc<Checkpoint>>, UsageError> {
    let (Some(_), Some(folder)) = (arguments.correct, &arguments.kinodynamics_weights) else {
        return Ok(None);
    };
    let told = |text: String| UsageError(format!("--kinodynamics-weights {}: {text}", folder.display()));
    let checkpoint = read_inverse_model(folder).map_err(|UsageError(text)| told(text))?;
    checkpoint.require_vehicle(&vehicle.into()).map_err(|error| told(error.to_string()))?;
    Ok(Some(Arc::new(checkpoint)))
}

/// The networks of a folder as `surefoot train kinodynamics` leaves it.
pub(crate) fn read_inverse_model(folder: &Path) -> Result<Checkpoint, UsageError> {
    let [weights, sidecar] = [WEIGHTS, SIDECAR].map(|name| read(&folder.join(name)));
    Checkpoint::from_bytes(&weights.map_err(UsageError)?, &sidecar.map_err(UsageError)?)
        .map_err(UsageError::from_input)
}
