//! Residuals by quantity and horizon.

use crate::comparison::{Yardstick, n_measured, root_mean_square};
use crate::drive::{HORIZONS, N_QUANTITIES, STEP_S};
use crate::findings::{QuantityError, ResidualCell, ResidualState};
use crate::rollout::PER_START;

/// The quantities in the order of a rollout's residuals.
pub(crate) const STATES: [ResidualState; N_QUANTITIES] = [
    ResidualState::Along,
    ResidualState::Across,
    ResidualState::Yaw,
    ResidualState::ForwardSpeed,
    ResidualState::YawRate,
    ResidualState::SideSpeed,
];

/// The cells in units of their quantities, of which the yardstick holds the standard deviations.
pub(crate) fn in_units(cells: &[ResidualCell], yardstick: &Yardstick) -> Vec<QuantityError> {
    let place = |cell: &ResidualCell| {
        let horizon = HORIZONS.iter().position(|&steps| steps as f64 * STEP_S == cell.horizon_s)?;
        let state = STATES.iter().position(|state| *state == cell.state)?;
        Some(horizon * N_QUANTITIES + state)
    };
    let in_unit = |cell: &ResidualCell| {
        let sigma = yardstick.0[place(cell)?];
        let [before, after, floor] = [cell.before, cell.after, cell.floor].map(|size| size * sigma);
        let (quantity, unit, horizon_s) = (cell.state, cell.state.unit().to_owned(), cell.horizon_s);
        Some(QuantityError { quantity, unit, horizon_s, before, after, floor })
    };
    cells.iter().filter_map(in_unit).collect()
}

/// One cell per quantity and horizon that was measured; without a null, `before` stands for the floor.
pub(crate) fn residual_cells(
    before: &[f32],
    after: &[f32],
    null: Option<&[ResidualCell]>,
) -> Vec<ResidualCell> {
    let at = |residuals: &[f32], place: usize| -> Vec<f32> {
        residuals.chunks(PER_START).map(|start| start[place]).collect()
    };
    let cell = |place: usize| {
        let own = at(before, place);
        let (state, horizon_s) =
            (STATES[place % N_QUANTITIES], HORIZONS[place / N_QUANTITIES] as f64 * STEP_S);
        let nominal = |cells: &[ResidualCell]| {
            cells
                .iter()
                .find(|cell| cell.state == state && cell.horizon_s == horizon_s)
                .map(|cell| cell.floor)
        };
        let size = root_mean_square(&own);
        (n_measured(&own) > 0).then(|| ResidualCell {
            state,
            horizon_s,
            before: size,
            after: root_mean_square(&at(after, place)),
            floor: null.and_then(nominal).unwrap_or(size),
        })
    };
    (0..PER_START).filter_map(cell).collect()
}
