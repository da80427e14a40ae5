//! Residuals by quantity and horizon.

use crate::comparison::root_mean_square;
use crate::drive::{HORIZONS, STEP_S};
use crate::findings::{ResidualCell, ResidualState};
use crate::rollout::{N_QUANTITIES, PER_START};

const STATES: [ResidualState; N_QUANTITIES] = [
    ResidualState::Along,
    ResidualState::Across,
    ResidualState::Yaw,
    ResidualState::ForwardSpeed,
    ResidualState::YawRate,
];

/// One cell per quantity and horizon; without a null, `before` stands for the floor.
pub(crate) fn residual_cells(
    before: &[f32],
    after: &[f32],
    null: Option<&[ResidualCell]>,
) -> Vec<ResidualCell> {
    let size = |residuals: &[f32], place: usize| {
        let values: Vec<f32> = residuals.chunks(PER_START).map(|start| start[place]).collect();
        root_mean_square(&values)
    };
    let cell = |place: usize| ResidualCell {
        state: STATES[place % N_QUANTITIES],
        horizon_s: HORIZONS[place / N_QUANTITIES] as f64 * STEP_S,
        before: size(before, place),
        after: size(after, place),
        floor: null.map_or_else(|| size(before, place), |cells| cells[place].floor),
    };
    (0..PER_START).map(cell).collect()
}
