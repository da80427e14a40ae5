//! Turning that changes with the square of the speed: 1 + K v^2, by which yaw rates are divided.

use super::definition::{Constants, Definition, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

/// Least that the divisor may become, at the limit of speed: yaw rates then grow to five times the kinematic ones.
const LEAST: f64 = 0.2;

/// The smallest K at speeds of up to `speed_mps`.
fn least_at(speed_mps: f64) -> f64 {
    (LEAST - 1.0) / (speed_mps * speed_mps)
}

/// K v and 1 + K v^2; beyond the limit of speed no less than the least.
#[inline(always)]
fn gradient_and_divisor<L: Lanes>(constants: &Constants, speed: Real<L>) -> [Real<L>; 2] {
    let lanes = speed.0;
    let gradient = Real::constant(lanes, constants[0]) * speed;
    let divisor = gradient.mul_add(speed, lanes.real(1.0));
    // In this order, NaN stays NaN.
    [gradient, lanes.real(LEAST).max(divisor)]
}

/// Effects by what the tyres have to hold beside the curve: K v times that is added to the yaw rate.
macro_rules! yaw_gains {
    ($($(#[$doc:meta])* $name:ident $id:literal: $meaning:literal $(cause $cause:literal)? {$($parameters:tt)*}
        |$gradient:pat_param, $state:ident| $yaw_rate:expr;)*) => {$(
        parameters! { $(#[$doc])* $name {$($parameters)*} }

        impl Definition for $name {
            const ID: &'static str = $id;
            const MEANING: &'static str = $meaning;
            $(const CAUSE: &'static str = $cause;)?
            const STAGES: &'static [Stage] = &[Stage::Motion];

            fn least_at(speed_mps: f64) -> f64 {
                least_at(speed_mps)
            }

            #[inline(always)]
            fn on_motion<L: Lanes>(constants: &Constants, $state: &mut Moving<L>) {
                let [$gradient, divisor] = gradient_and_divisor(constants, $state.forward);
                $state.yaw_rate = $yaw_rate / divisor;
            }
        }
    )*};
}

yaw_gains! {
    /// Understeer growing with speed.
    Understeer "understeer": "understeer: yaw rate = (v tan(steering) / L + K v a_side) / (1 + K v^2)"
    {
        /// Coefficient K [s2/m2].
        gradient_s2_per_m2 in "s2/m2": -0.01 to 1.0, neutral 0.0, tried [-0.004, 0.004, 0.012, 0.04, 0.12];
    } |gradient, state| gradient.mul_add(state.side_acceleration, state.yaw_rate);

    /// Steering that yields as the speed grows.
    SteerYield "steer_yield": "understeer of the steering, not of the tyres: yaw rate = v tan(steering) / (L (1 + K v^2)), whatever pushes sideways"
        cause "understeer"
    {
        /// Coefficient K [s2/m2].
        gradient_s2_per_m2 in "s2/m2": -0.01 to 1.0, neutral 0.0, tried [-0.004, 0.004, 0.012, 0.04, 0.12];
    } |_, state| state.yaw_rate;
}
