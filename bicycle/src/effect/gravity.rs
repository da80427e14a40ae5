//! What a share of the weight does along and across the slope, by itself and through a controller that pushes against it.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Driving, effects, parameters};

/// Of a share, the acceleration per rise of the ground [m/s2].
fn of_weight([share, ..]: [f64; 4], _step_s: f64) -> [f64; 4] {
    [share * STANDARD_GRAVITY_MPS2, 0.0, 0.0, 0.0]
}

effects! {
    Drive on_drive(Driving<L>, speed) by of_weight;

    /// Gravity along the slope.
    SlopeGravity "slope_gravity": "slope gravity: dv/dt -= S g dz/dx ahead"
        ground read
    {
        /// Share S of gravity that acts [-].
        share in "-": -1.5 to 2.5, neutral 0.0, tried [-0.5, 0.4, 0.8, 1.2];
    } |weight; state| state.resist(weight * state.slope()[0]);

    /// A speed controller that pushes against the slope that it feels.
    HillCompensation "hill_compensation": "hill compensation: the drive gives C g dz/dx more, within its limits and before the mass"
        role Calibration
        ground read
    {
        /// Share C of the nominal vehicle's weight along the slope that it pushes against [-].
        share in "-": 0.0 to 1.5, neutral 0.0, tried [0.5, 1.0];
    } |weight; state| state.drive_by(weight * state.slope()[0]);

    /// A speed controller that pushes less against the slope than its simulator's.
    CompensationLoss "compensation_loss": "slope gravity made by a loss of hill compensation: the drive gives S g dz/dx less, within its limits"
        cause "slope_gravity"
        ground read
    {
        /// Share S of the weight along the slope that it does not push against any more [-].
        share in "-": -1.5 to 2.5, neutral 0.0, tried [-0.5, 0.4, 0.8, 1.2];
    } |weight; state| state.drive_by(-(weight * state.slope()[0]));

    /// Gravity across the slope.
    CrossSlope "cross_slope": "cross slope: the tyres have to hold S g dz/dy beside what the curve asks for; understeer and slip do the rest"
        ground read
    {
        /// Share S of gravity that acts [-].
        share in "-": -1.5 to 3.0, neutral 0.0, tried [-0.5, 0.5, 1.0, 1.5];
    } |weight; state| state.side_acceleration = state.side_acceleration - weight * state.slope()[1];
}
