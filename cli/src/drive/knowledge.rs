//! What the controller is to know of the ground: as asked, else the best there is for the vehicle.

use std::path::Path;
use std::sync::Arc;

use bench::closed_loop::Method;
use bicycle::Vehicle;
use evidential::{Checkpoint, shipped};

use super::correction;
use crate::UsageError;
use crate::arguments::DriveArguments;

/// The files of a checkpoint in its folder.
const WEIGHTS: &str = "weights.safetensors";
const SIDECAR: &str = "weights.json";
/// No networks that fit the control computer are larger [bytes].
const FILE_BYTES_MAX: u64 = 1 << 28;

/// A method and its networks.
pub(crate) struct Knowledge {
    pub method: Method,
    /// `None` for a method without any.
    pub networks: Option<Arc<Checkpoint>>,
    /// Why nothing learned is used although nobody asked for that.
    pub why_not_learned: Option<String>,
    /// What corrects commands for the ground under the wheels, if anything does.
    pub corrector: Option<Arc<kinodynamics::Checkpoint>>,
}

impl Knowledge {
    /// Reads what was asked for; refuses networks that do not fit the vehicle or the method.
    pub fn choose(arguments: &DriveArguments, vehicle: &Vehicle) -> Result<Self, UsageError> {
        let corrector = correction::choose(arguments, vehicle)?;
        let asked = arguments.method.map(Method::from);
        Ok(Self { corrector, ..Self::of_ground(arguments.weights.as_deref(), asked, vehicle)? })
    }

    /// The same without what corrects commands: networks of a folder, of a method, or the best that come with the program.
    pub fn of_ground(
        weights: Option<&Path>,
        asked: Option<Method>,
        vehicle: &Vehicle,
    ) -> Result<Self, UsageError> {
        if let Some(folder) = weights {
            return Self::from_folder(folder, asked, vehicle);
        }
        match asked {
            Some(method) => {
                let networks = match method.learned() {
                    Some((training, _)) => {
                        Some(shipped(training, &vehicle.geometry).map_err(UsageError::from_input)?)
                    }
                    None => None,
                };
                Ok(Self::without_corrector(method, networks))
            }
            None => Ok(Self::best_for(vehicle)),
        }
    }

    fn best_for(vehicle: &Vehicle) -> Self {
        match shipped(evidential::Method::Pietra, &vehicle.geometry) {
            Ok(networks) => Self::without_corrector(Method::Pietra, Some(networks)),
            Err(error) => Self {
                why_not_learned: Some(UsageError::from_input(error).0),
                ..Self::without_corrector(Method::Physics, None)
            },
        }
    }

    fn without_corrector(method: Method, networks: Option<Checkpoint>) -> Self {
        Self { method, networks: networks.map(Arc::new), why_not_learned: None, corrector: None }
    }

    fn from_folder(folder: &Path, asked: Option<Method>, vehicle: &Vehicle) -> Result<Self, UsageError> {
        let told = |text: String| UsageError(format!("--weights {}: {text}", folder.display()));
        let checkpoint = read_checkpoint(folder).map_err(|UsageError(text)| told(text))?;
        let trained = checkpoint.sidecar.method;
        checkpoint.check_vehicle(&vehicle.geometry).map_err(|error| told(error.to_string()))?;
        let drives_on_these =
            |method: &Method| method.learned().is_some_and(|(training, _)| training == trained);
        let all =
            [Method::Pietra, Method::PietraAvoid, Method::Evora, Method::PhysicsInformed, Method::Vanilla];
        let method = match asked {
            Some(method) => Some(method).filter(drives_on_these),
            None => all.into_iter().find(drives_on_these),
        };
        let method = method.ok_or_else(|| {
            let expected = match asked.and_then(Method::learned) {
                Some((training, _)) => training.name(),
                None => "pietra, evora, physics-informed or vanilla, and a --method that drives on them",
            };
            told(format!("expected networks of method {expected}, found {}", trained.name()))
        })?;
        Ok(Self::without_corrector(method, Some(checkpoint)))
    }
}

/// The networks of a folder as `surefoot train` leaves it.
pub(crate) fn read_checkpoint(folder: &Path) -> Result<Checkpoint, UsageError> {
    let [weights, sidecar] = [WEIGHTS, SIDECAR].map(|name| read(&folder.join(name)));
    Checkpoint::from_bytes(&weights.map_err(UsageError)?, &sidecar.map_err(UsageError)?)
        .map_err(UsageError::from_input)
}

/// A whole file, refused when it is too large for networks.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, String> {
    let told =
        |error: std::io::Error| format!("{}: expected a readable file, found: {error}", path.display());
    let n_bytes = std::fs::metadata(path).map_err(told)?.len();
    if n_bytes > FILE_BYTES_MAX {
        return Err(format!("{}: expected at most {FILE_BYTES_MAX} bytes, found {n_bytes}", path.display()));
    }
    std::fs::read(path).map_err(told)
}
