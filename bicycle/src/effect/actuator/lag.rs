//! A first-order lag of a command that is held over each step.

use super::Constants;
use crate::lanes::{Lanes, Real};

/// Share of its distance to the command that the value closes until the end of a step, and on average over it:
/// with r = exp(-dt / T), 1 - r and 1 - (1 - r) T / dt.
pub(in crate::effect) fn constants(time_constant_s: f64, step_s: f64) -> [f64; 4] {
    if time_constant_s <= 0.0 {
        return [1.0, 1.0, 0.0, 0.0];
    }
    let closed = -libm::expm1(-step_s / time_constant_s);
    [closed, 1.0 - closed * time_constant_s / step_s, 0.0, 0.0]
}

/// What is reached.
pub(super) fn n_slots(_parameter: f64, _step_s: f64) -> usize {
    1
}

/// Takes the command of this step in, gives the mean of the lagging value over the step out.
#[inline(always)]
pub(super) fn pass<L: Lanes>(
    constants: &Constants,
    memory: &mut [L::Value],
    _step: usize,
    command: Real<L>,
) -> Real<L> {
    let lanes = command.0;
    let reached = Real(lanes, memory[0]);
    let distance = command - reached;
    memory[0] = distance.mul_add(Real::constant(lanes, constants[0]), reached).1;
    distance.mul_add(Real::constant(lanes, constants[1]), reached)
}
