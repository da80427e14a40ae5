//! Turning that changes with the load of the tyres.

use super::definition::{Moving, as_they_are, effects, parameters};

/// Accelerations along the body beyond this move the load no further [m/s2].
const MOST_MPS2: f64 = 5.0;

effects! {
    Motion on_motion(Moving<L>, forward) by as_they_are;

    /// Turning that changes with the load of the tyres: brakes load the front axle, curves saturate it.
    YawLoad "yaw_load": "load of the tyres: yaw rate *= (1 + C dv/dt) / (1 + Q a^2) with the lateral acceleration a of the tyres, |dv/dt| up to 5 m/s2"
        role Calibration
    {
        /// Change of the turning per acceleration C [s2/m].
        per_acceleration_s2_per_m in "s2/m": -0.15 to 0.15, neutral 0.0, tried [-0.06, 0.06];
        /// Saturation Q [s4/m2].
        saturation_s4_per_m2 in "s4/m2": 0.0 to 0.5, neutral 0.0, tried [0.02];
    } |per_acceleration, saturation; state| {
        let lanes = state.forward.0;
        let (most, one) = (lanes.real(MOST_MPS2), lanes.real(1.0));
        let load = state.acceleration.clamp(-most, most).mul_add(per_acceleration, one);
        let tyres = state.tyre_acceleration();
        state.yaw_rate = state.yaw_rate * load / (tyres * tyres).mul_add(saturation, one);
    };
}
