//! What the learning process learns by while driving, and what it tells of it.

use std::path::{Path, PathBuf};

use bicycle::SensorModel;
use evidential::{Checkpoint, ShippedData, shipped_data};
use formats::write_bytes_atomic;
use runtime::online::{LearnerSetup, Round, SchoolSetup, Told};
use tracing::{error, info, warn};

use crate::UsageError;
use crate::arguments::UpArguments;
use crate::collect::read_dataset;
use crate::drive::scene::Machine;

/// Folder of the networks that were learned, in that of the output.
const LEARNED: &str = "learned";

/// Everything that learning while driving needs; `None` when nobody asked for it.
pub(super) fn school(arguments: &UpArguments, machine: &Machine) -> Result<Option<SchoolSetup>, UsageError> {
    if !arguments.learn {
        return match &arguments.validation {
            None => Ok(None),
            Some(_) => Err(UsageError("--validation: expected only with --learn, found without".to_owned())),
        };
    }
    let (Some((_, unfamiliar)), Some(original)) =
        (machine.knowledge.method.learned(), &machine.knowledge.networks)
    else {
        let found = machine.knowledge.method.name();
        return Err(UsageError(format!(
            "--learn: expected a --method with networks that fit the vehicle, found {found}"
        )));
    };
    let shipped = shipped_data(original).map_err(UsageError::from_input)?;
    let (validation, familiar) = match (&arguments.validation, shipped) {
        (Some(path), shipped) => (read_dataset(path)?, shipped.map(|data| data.familiar)),
        (None, Some(ShippedData { familiar, validation })) => (validation, Some(familiar)),
        (None, None) => {
            return Err(UsageError(
                "--learn: expected --validation FILE, as `surefoot collect` leaves it, to judge these networks by; \
                 found none that comes with the program for their vehicle and prior"
                    .to_owned(),
            ));
        }
    };
    let learner = LearnerSetup {
        geometry: machine.vehicle.geometry,
        limits: machine.vehicle.limits,
        resolution_m: machine.config.elevation.resolution_m,
        original: original.clone(),
        validation,
        familiar,
        seed: arguments.drive.seed,
    };
    let sensors = SensorModel::of(&machine.model.effects);
    Ok(Some(SchoolSetup { learner, unfamiliar, sensors }))
}

/// Tells what became of a round, and keeps networks that are used from now on.
pub(super) fn tell(told: Told<'_>, out: &Path) {
    match told {
        Told::Ended(why) => warn!("{why}"),
        Told::Round(round, checkpoint) => {
            info!("{}", in_words(round));
            let kept = checkpoint.map_or(Ok(()), |checkpoint| keep(checkpoint, &out.join(LEARNED)));
            if let Err(error) = kept {
                error!("{error}; driving on without having kept the networks");
            }
        }
    }
}

fn in_words(round: &Round) -> String {
    let Round { number, n_examples, recent, recent_standard_error, original, share, decision } = round;
    format!(
        "round {number}, {} footprints: {}; EMD2 on {} held out {:.3} -> {:.3} (standard error {:.3}), on the \
         original validation data {:.3} -> {:.3}, {:.0} % of the way",
        n_examples[0],
        decision.name(),
        n_examples[1],
        recent[0],
        recent[1],
        recent_standard_error,
        original[0],
        original[1],
        100.0 * share
    )
}

/// As `surefoot train` leaves them. The sidecar holds the hash of the weights: a half-written pair is refused.
fn keep(checkpoint: &Checkpoint, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)?;
    let file = |name: &str| -> PathBuf { folder.join(name) };
    write_bytes_atomic(&file("weights.safetensors"), &checkpoint.weights_bytes()?)?;
    write_bytes_atomic(&file("weights.json"), &checkpoint.sidecar_bytes()?)?;
    Ok(())
}
