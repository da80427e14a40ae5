//! Play: what follows moves only when the command pushes against an edge of it.

use super::Constants;
use crate::lanes::{Lanes, Real};

/// Half the play.
pub(super) fn constants(half_width: f64, _step_s: f64) -> [f64; 4] {
    [half_width, 0.0, 0.0, 0.0]
}

/// What is reached.
pub(super) fn n_slots(_parameter: f64, _step_s: f64) -> usize {
    1
}

/// Takes the command of this step in, gives what follows it out.
#[inline(always)]
pub(super) fn pass<L: Lanes>(
    constants: &Constants,
    memory: &mut [L::Value],
    _step: usize,
    command: Real<L>,
) -> Real<L> {
    let lanes = command.0;
    let half = Real::constant(lanes, constants[0]);
    let followed = Real(lanes, memory[0]).clamp(command - half, command + half);
    memory[0] = followed.1;
    followed
}
