//! A rear axle that does not follow the body: it slips, or is steered.

use super::definition::{Moving, as_they_are, effects, parameters};

effects! {
    Motion on_motion(Moving<L>, forward) by as_they_are;

    /// Sideslip of the rear axle.
    RearSlip "rear_slip": "rear slip: lateral speed = -C v (v yaw_rate - a_side)"
        role Calibration
    {
        /// Slip angle C per lateral acceleration of the tyres [s2/m].
        compliance_s2_per_m in "s2/m": -0.05 to 0.2, neutral 0.0, tried [0.005, 0.02];
    } |compliance; state| {
        let slip = state.tyre_acceleration() * compliance;
        state.lateral = state.lateral - slip * state.forward;
    };

    /// Rear wheels that are steered along with the front ones.
    RearSteer "rear_steer": "rear steering: lateral speed = -C v tan(steering)"
        role Calibration
    {
        /// Angle C of the rear wheels over that of the front ones, against it [-].
        share in "-": -1.0 to 1.0, neutral 0.0, tried [0.1, 0.3];
    } |share; state| state.lateral = state.lateral - share * state.steering_tangent * state.forward;
}
