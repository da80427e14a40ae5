//! Where the time of a rollout counts.

use bicycle::LaneState;
use bicycle::lanes::{Constant, Lanes, Real};
use traversability::GridGeometry;

/// The map without its border ring, where the way leads out of it. What lies beyond is not known, and whoever leaves stays
/// near the border; the rest of the way counts from there. If time went on, who is there soon would be no better off than
/// who comes there late. With the goal within, nobody has to leave, and who does pays for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// Column and row of its middle [cells].
    middle_cells: [Constant; 2],
    /// From there to its border, east and north [cells].
    reach_cells: [Constant; 2],
}

impl Window {
    /// `None` for who cannot leave: from `start_cells` no rollout covers more than `reach_cells`.
    pub(crate) fn of(geometry: &GridGeometry, start_cells: [f64; 2], reach_cells: f64) -> Option<Self> {
        let middle = [geometry.n_cols, geometry.n_rows].map(|n| 0.5 * n as f64);
        let leaves =
            |axis: usize| (start_cells[axis] - middle[axis]).abs() + reach_cells > middle[axis] - 1.0;
        (leaves(0) || leaves(1)).then(|| Self {
            middle_cells: middle.map(Constant::new),
            reach_cells: middle.map(|half| Constant::new(half - 1.0)),
        })
    }

    /// Whether a place lies beyond it [cells].
    pub(crate) fn leaves_out(&self, at_cells: [f64; 2]) -> bool {
        let is_beyond = |axis: usize| {
            (at_cells[axis] - self.middle_cells[axis].value()).abs() >= self.reach_cells[axis].value()
        };
        is_beyond(0) || is_beyond(1)
    }

    /// `value` within the window, 0 beyond.
    #[inline(always)]
    pub(super) fn within<L: Lanes>(&self, state: &LaneState<L>, value: Real<L>) -> Real<L> {
        let lanes = value.0;
        let holds = |at: Real<L>, axis: usize| {
            let middle = Real::constant(lanes, self.middle_cells[axis]);
            (at - middle).abs().less(Real::constant(lanes, self.reach_cells[axis]))
        };
        let (zero, east) = (lanes.real(0.0), lanes.real(0.0).add_where(holds(state.x, 0), value));
        zero.add_where(holds(state.y, 1), east)
    }
}
