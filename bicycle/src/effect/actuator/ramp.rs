//! A limit of how fast a command that is held over each step is followed.

use super::Constants;
use crate::lanes::{Lanes, Real};

/// Largest change over a step, and one over twice that.
pub(super) fn constants(rate_per_s: f64, step_s: f64) -> [f64; 4] {
    [rate_per_s * step_s, 0.5 / (rate_per_s * step_s), 0.0, 0.0]
}

/// What is reached.
pub(super) fn n_slots(_parameter: f64, _step_s: f64) -> usize {
    1
}

/// Takes the command of this step in, gives the mean of the following value over the step out: a ramp that ends when
/// the command is reached falls short of it by m^2 / (2 R dt) on average, with the change m.
#[inline(always)]
pub(super) fn pass<L: Lanes>(
    constants: &Constants,
    memory: &mut [L::Value],
    _step: usize,
    command: Real<L>,
) -> Real<L> {
    let lanes = command.0;
    let (reached, limit) = (Real(lanes, memory[0]), Real::constant(lanes, constants[0]));
    let change = (command - reached).clamp(-limit, limit);
    memory[0] = (reached + change).1;
    let ramped = change.abs() * Real::constant(lanes, constants[1]);
    (change * (lanes.real(1.0) - ramped)) + reached
}
