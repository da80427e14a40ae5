//! Whether networks were trained on a vehicle.

use bicycle::Geometry;

use crate::Checkpoint;

/// Lengths that agree to this share are the same.
const LENGTH_TOLERANCE: f64 = 1e-6;

/// Networks of another vehicle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("trained on vehicle {vehicle}, {field}: expected {expected} as there, found {found}")]
pub struct VehicleMismatch {
    /// Name of the vehicle in training.
    pub vehicle: String,
    /// Which length differs.
    pub field: &'static str,
    /// Of the vehicle in training [m].
    pub expected: f64,
    /// Of this vehicle [m].
    pub found: f64,
}

impl Checkpoint {
    /// Refuses a vehicle that stands on the ground in another way than the one in training.
    ///
    /// # Errors
    /// Wheelbase, track or wheels differ.
    pub fn check_vehicle(&self, geometry: &Geometry) -> Result<(), VehicleMismatch> {
        let layout = &self.sidecar.layout;
        let lengths = [
            ("wheelbase_m", layout.wheels.wheelbase_m, geometry.wheelbase_m),
            ("track_m", layout.wheels.track_m, geometry.track_m),
            ("wheel_radius_m", layout.height_scale_m, geometry.wheel_radius_m),
        ];
        for (field, expected, found) in lengths {
            let is_same = (found - expected).abs() <= LENGTH_TOLERANCE * expected.abs();
            if !is_same {
                let vehicle = self.sidecar.vehicle.clone();
                return Err(VehicleMismatch { vehicle, field, expected, found });
            }
        }
        Ok(())
    }
}
