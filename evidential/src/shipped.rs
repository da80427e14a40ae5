//! The networks that come with the program.

use bicycle::Geometry;

use crate::{Checkpoint, CheckpointError, Dataset, DatasetFileError, Method, VehicleMismatch};

/// The two files of a checkpoint.
struct Files {
    method: Method,
    weights: &'static [u8],
    sidecar: &'static [u8],
}

/// Every checkpoint under `evidential/weights/`; a method may have one for each of several vehicles.
const FILES: &[Files] = &[
    Files {
        method: Method::Pietra,
        weights: include_bytes!("../weights/pietra/weights.safetensors"),
        sidecar: include_bytes!("../weights/pietra/weights.json"),
    },
    Files {
        method: Method::Evora,
        weights: include_bytes!("../weights/evora/weights.safetensors"),
        sidecar: include_bytes!("../weights/evora/weights.json"),
    },
    Files {
        method: Method::PhysicsInformed,
        weights: include_bytes!("../weights/physics-informed/weights.safetensors"),
        sidecar: include_bytes!("../weights/physics-informed/weights.json"),
    },
    Files {
        method: Method::Vanilla,
        weights: include_bytes!("../weights/vanilla/weights.safetensors"),
        sidecar: include_bytes!("../weights/vanilla/weights.json"),
    },
];

/// What the networks learned from, and what they were chosen by: of each, 512 footprints.
pub struct ShippedData {
    /// Of the data that they were trained on.
    pub familiar: Dataset,
    /// Of the data that they were chosen by, on other maps.
    pub validation: Dataset,
}

/// Why no networks that come with the program will do.
#[derive(Debug, thiserror::Error)]
pub enum ShippedError {
    /// None of that method.
    #[error("networks of method {method}: expected some that come with the program, found none")]
    Absent {
        /// Name of the method.
        method: &'static str,
    },
    /// All of that method were trained on other vehicles.
    #[error("networks of method {method}: {mismatch}")]
    Vehicle {
        /// Name of the method.
        method: &'static str,
        /// How the last one differs.
        mismatch: VehicleMismatch,
    },
    /// They are broken.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The data that come with the program are broken.
    #[error(transparent)]
    Data(#[from] DatasetFileError),
}

/// The networks of a method that were trained on a vehicle of this geometry.
///
/// # Errors
/// None come with the program, or none that fit the vehicle.
pub fn shipped(method: Method, geometry: &Geometry) -> Result<Checkpoint, ShippedError> {
    let mut refused = ShippedError::Absent { method: method.name() };
    for files in FILES.iter().filter(|files| files.method == method) {
        let checkpoint = Checkpoint::from_bytes(files.weights, files.sidecar)?;
        match checkpoint.check_vehicle(geometry) {
            Ok(()) => return Ok(checkpoint),
            Err(mismatch) => refused = ShippedError::Vehicle { method: method.name(), mismatch },
        }
    }
    Err(refused)
}

/// The data that come with the program, to learn on beside and to judge by; `None` for networks of another vehicle,
/// layout or prior.
///
/// # Errors
/// They are broken.
pub fn shipped_data(checkpoint: &Checkpoint) -> Result<Option<ShippedData>, ShippedError> {
    let familiar = Dataset::from_bytes(include_bytes!("../weights/familiar.safetensors"))?;
    let validation = Dataset::from_bytes(include_bytes!("../weights/validation.safetensors"))?;
    let fits = [&familiar, &validation].into_iter().all(|data| {
        checkpoint.require_vehicle(&data.origin.vehicle).is_ok()
            && checkpoint.require_layout(&data.origin.layout).is_ok()
            && checkpoint.require_prior(&data.origin.prior).is_ok()
    });
    Ok(fits.then_some(ShippedData { familiar, validation }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_fit_every_network_and_what_is_judged_by_was_driven_on_other_maps() {
        for files in FILES {
            let checkpoint = Checkpoint::from_bytes(files.weights, files.sidecar).unwrap();
            let data = shipped_data(&checkpoint).unwrap().unwrap();
            assert_eq!((data.familiar.examples.len(), data.validation.examples.len()), (512, 512));
            let provenance = [&data.familiar, &data.validation].map(|data| &data.origin.provenance);
            assert!(provenance[0].contains("Train") && provenance[1].contains("Validation"));
            let mut other = checkpoint;
            other.sidecar.vehicle = "another".to_owned();
            assert!(shipped_data(&other).unwrap().is_none());
        }
    }

    #[test]
    fn all_that_is_shipped_can_be_used_and_is_small() {
        for files in FILES {
            let checkpoint = Checkpoint::from_bytes(files.weights, files.sidecar).unwrap();
            assert_eq!(checkpoint.sidecar.method, files.method);
            crate::Predictor::new(&checkpoint, bicycle::lanes::Instructions::widest()).unwrap();
        }
        let n_bytes: usize = FILES.iter().map(|files| files.weights.len() + files.sidecar.len()).sum();
        assert!(n_bytes < 1_000_000, "{n_bytes} bytes");
    }

    #[test]
    fn a_vehicle_that_nobody_trained_is_told_so() {
        let nobody = Geometry {
            wheelbase_m: 7.0,
            track_m: 3.0,
            length_m: 9.0,
            width_m: 3.5,
            rear_overhang_m: 1.0,
            ground_clearance_m: 0.5,
            wheel_radius_m: 0.8,
        };
        for method in Method::ALL {
            let told = shipped(method, &nobody).unwrap_err().to_string();
            assert!(told.contains(method.name()) && told.contains("expected"), "{told}");
        }
    }
}
