//! Turning that changes with the square of the speed: 1 + K v^2, by which yaw rates are divided.

use super::definition::Constants;
use crate::lanes::{Lanes, Real};

/// Least that the divisor may become, at the limit of speed: yaw rates then grow to five times the kinematic ones.
const LEAST: f64 = 0.2;

/// The smallest K at speeds of up to `speed_mps`.
pub(super) fn least_at(speed_mps: f64) -> f64 {
    (LEAST - 1.0) / (speed_mps * speed_mps)
}

/// K v and 1 + K v^2; beyond the limit of speed no less than the least.
#[inline(always)]
pub(super) fn of<L: Lanes>(constants: &Constants, speed: Real<L>) -> [Real<L>; 2] {
    let lanes = speed.0;
    let gradient = Real::constant(lanes, constants[0]) * speed;
    let divisor = gradient.mul_add(speed, lanes.real(1.0));
    // In this order, NaN stays NaN.
    [gradient, lanes.real(LEAST).max(divisor)]
}
