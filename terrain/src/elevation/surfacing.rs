//! From what is remembered of the cells to the surface that consumers read.

use super::ElevationMap;
use super::cell::{CellState, Ground};
use crate::{GridMap, Knowledge, SurfaceCell};

/// Buffers kept from scan to scan.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    next: Vec<SurfaceCell>,
}

/// A variance is published anew when it changed by more than this share.
const VARIANCE_SHARE: f32 = 0.2;
/// A class probability is published anew when it changed by more than this.
const PROBABILITY_STEP: f32 = 0.05;

impl ElevationMap {
    /// Brings the published surface up to date and notes what changed.
    pub(super) fn publish(&mut self) {
        let next = &mut self.surfacing.next;
        next.clear();
        next.extend(self.states.values().iter().map(seen_surface));
        let geometry = *self.surface.geometry();
        let [x, y] = geometry.origin;
        for (index, (published, next)) in self.surface.values_mut().iter_mut().zip(next.iter()).enumerate() {
            if differs(published, next, self.config.publish_step_m) {
                *published = *next;
                let cell = geometry.cell(index);
                let place = [x + cell.col as i64, y + cell.row as i64];
                self.changed.include(place, place);
            }
        }
    }
}

/// The surface of a cell as far as its own points tell.
fn seen_surface(state: &CellState) -> SurfaceCell {
    let class_probability = state.class_probability();
    let knowledge = match state.ground {
        Ground::Unseen => return SurfaceCell { class_probability, ..SurfaceCell::UNKNOWN },
        Ground::Assumed => Knowledge::Interpolated,
        Ground::Seen => Knowledge::Measured,
    };
    SurfaceCell {
        height_m: state.ground_m,
        height_variance_m2: state.variance_m2 + state.spread_m2,
        vegetation_height_m: (state.vegetation_top_m - state.ground_m).max(0.0),
        class_probability,
        knowledge,
    }
}

fn differs(published: &SurfaceCell, next: &SurfaceCell, step_m: f32) -> bool {
    let moved = |a: f32, b: f32| (a - b).abs() > step_m;
    let variance_m2 = published.height_variance_m2;
    published.knowledge != next.knowledge
        || moved(published.height_m, next.height_m)
        || moved(published.vegetation_height_m, next.vegetation_height_m)
        || (variance_m2 - next.height_variance_m2).abs() > VARIANCE_SHARE * variance_m2
        || (published.class_probability.iter().zip(&next.class_probability))
            .any(|(a, b)| (a - b).abs() > PROBABILITY_STEP)
}

/// Grows the published variances as time passes.
pub(super) fn fade(surface: &mut GridMap<SurfaceCell>, by_m2: f32) {
    for cell in surface.values_mut() {
        cell.height_variance_m2 += by_m2;
    }
}
