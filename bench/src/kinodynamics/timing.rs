//! What one answer costs.

use bicycle::lanes::Instructions;
use kinodynamics::{Desired, Example, InverseModel};

use super::lap::Driver;
use super::{KinodynamicsError, Row};
use crate::Spread;
use crate::stopwatch::timed_ms;

/// Answers before the first that is timed, and those that are.
const WARM_UP: usize = 200;
const TIMED: usize = 2000;

/// From half a second of samples to a command, of the learned model [us].
pub(super) fn answer_us(
    drivers: &[(Row, Driver)],
    examples: &[Example],
    instructions: Instructions,
) -> Result<Option<Spread>, KinodynamicsError> {
    let learned = drivers.iter().find(|(row, _)| *row == Row::Learned);
    let Some((_, Driver::Model { checkpoint, .. })) = learned else { return Ok(None) };
    let mut model = InverseModel::new(checkpoint, instructions)?;
    let desired = Desired { speed_mps: 2.0, curvature_per_m: 0.8 };
    let mut sum = 0.0;
    let mut answer = |k: usize| {
        model.sense_columns(&examples[k % examples.len()].window);
        sum += model.command(desired).curvature_per_m;
    };
    (0..WARM_UP).for_each(&mut answer);
    let times = (0..TIMED).map(|k| 1e3 * timed_ms(|| answer(k)).0).collect();
    std::hint::black_box(sum);
    Ok(Some(Spread::of(times)))
}
