//! Two equal lags in series: later than one lag of both their time constants at first, and sooner there.

use super::{Constants, lag};
use crate::lanes::{Lanes, Real};

/// Of each.
pub(super) fn constants(time_constant_s: f64, step_s: f64) -> [f64; 4] {
    lag::constants(0.5 * time_constant_s, step_s)
}

/// What each has reached.
pub(super) fn n_slots(_parameter: f64, _step_s: f64) -> usize {
    2
}

/// Takes the command of this step in, gives the mean of the second lag over the step out.
#[inline(always)]
pub(super) fn pass<L: Lanes>(
    constants: &Constants,
    memory: &mut [L::Value],
    step: usize,
    command: Real<L>,
) -> Real<L> {
    let (first, second) = memory.split_at_mut(1);
    let between = lag::pass(constants, first, step, command);
    lag::pass(constants, second, step, between)
}
