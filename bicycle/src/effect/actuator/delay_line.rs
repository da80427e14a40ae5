//! A ring of past commands, read at a fractional age.
//!
//! A command holds for a whole step, so a delay of n + f steps makes a step see the share f of command
//! k - n - 1 and the share 1 - f of command k - n.

use super::Constants;
use crate::lanes::{Lanes, Real};

/// Slots for a delay: the present command and the two that the delay falls between.
pub(super) fn n_slots(delay_s: f64, step_s: f64) -> usize {
    (delay_s / step_s).floor() as usize + 2
}

/// Whole steps, share of the older command, number of slots.
pub(super) fn constants(delay_s: f64, step_s: f64) -> [f64; 4] {
    let steps = delay_s / step_s;
    [steps.floor(), steps.fract(), n_slots(delay_s, step_s) as f64, 0.0]
}

/// Takes the command of this step in, gives the delayed one out.
#[inline(always)]
pub(super) fn pass<L: Lanes>(
    constants: &Constants,
    memory: &mut [L::Value],
    step: usize,
    command: Real<L>,
) -> Real<L> {
    let (whole, n) = (constants[0].value() as usize, memory.len());
    let lanes = command.0;
    let now = step % n;
    memory[now] = command.1;
    let back = |steps: usize| Real(lanes, memory[if now >= steps { now - steps } else { now + n - steps }]);
    let (newer, older) = (back(whole), back(whole + 1));
    (older - newer).mul_add(Real::constant(lanes, constants[1]), newer)
}
