//! Resistances: what is taken from the acceleration, by what it depends on.

use super::definition::{Driving, as_they_are, effects, parameters};
use crate::lanes::Constant;

effects! {
    Drive on_drive(Driving<L>, speed) by as_they_are;

    /// Constant resistance.
    RollingDrag "rolling_drag": "rolling drag: dv/dt -= C against the motion"
    {
        /// Deceleration C [m/s2].
        deceleration_mps2 in "m/s2": -1.0 to 5.0, neutral 0.0, tried [0.2, 0.6, 1.2];
    } |drag; state| state.resist(drag * state.direction());

    /// Resistance growing with the square of the speed.
    QuadDrag "quad_drag": "quadratic drag: dv/dt -= C v |v|"
    {
        /// Coefficient C [1/m].
        coefficient_per_m in "1/m": -0.05 to 2.0, neutral 0.0, tried [0.01, 0.03, 0.1, 0.3];
    } |drag; state| state.resist(drag * state.speed * state.speed.abs());

    /// Resistance in vegetation.
    VegDrag "veg_drag": "vegetation drag: dv/dt -= C against the motion, in vegetation only"
        ground read
    {
        /// Deceleration C [m/s2].
        deceleration_mps2 in "m/s2": -1.0 to 8.0, neutral 0.0, tried [0.4, 1.2, 2.5];
    } |drag; state| state.resist(drag * state.on_class(Constant::new(2.0)) * state.direction());

    /// Resistance of loose ground.
    LooseDrag "loose_drag": "loose-ground drag: dv/dt -= C against the motion, in loose ground only"
        role Calibration
        ground read
    {
        /// Deceleration C [m/s2].
        deceleration_mps2 in "m/s2": -1.0 to 8.0, neutral 0.0, tried [0.4, 1.2, 2.5];
    } |drag; state| state.resist(drag * state.on_class(Constant::new(1.0)) * state.direction());

    /// Resistance of the turned front wheels.
    CorneringDrag "cornering_drag": "cornering drag: dv/dt -= C v |yaw_rate tan(steering)|, the front tyres lateral force along the body"
        role Calibration
    {
        /// Share C of the ideal tyre force [-].
        share in "-": -1.0 to 5.0, neutral 0.0, tried [0.3, 1.0];
    } |share; state| state.resist(state.speed * (state.yaw_rate * state.steering_tangent).abs() * share);
}
