//! From what is remembered of the cells to the surface that consumers read.

use super::cell::{CellState, Ground};
use super::gaps::{Enclosure, Inferred, Support};
use super::{ElevationConfig, ElevationMap};
use crate::{CellRegion, GridMap, Knowledge, SurfaceCell, TerrainClass};

/// Buffers kept from scan to scan.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    next: Vec<SurfaceCell>,
    support: Support,
    covered: Vec<(u32, Inferred)>,
    enclosure: Enclosure,
}

/// A variance is published anew when it changed by more than this share.
const VARIANCE_SHARE: f32 = 0.2;
/// A class probability is published anew when it changed by more than this.
const PROBABILITY_STEP: f32 = 0.05;
/// Share of the visibility margin by which rays may pass below a filled gap: a ditch is worth more care than a
/// ghost.
const GAP_MARGIN_SHARE: f32 = 0.25;

impl ElevationMap {
    /// Brings the published surface up to date and notes what changed.
    pub(super) fn publish(&mut self) {
        let geometry = *self.surface.geometry();
        self.surfacing.draw(&self.states, &self.config);
        let [x, y] = geometry.origin;
        let next = &self.surfacing.next;
        for (index, (published, next)) in self.surface.values_mut().iter_mut().zip(next).enumerate() {
            if differs(published, next, self.config.publish_step_m) {
                *published = *next;
                let cell = geometry.cell(index);
                let place = [x + cell.col as i64, y + cell.row as i64];
                self.changed.include(place, place);
            }
        }
    }
}

impl Scratch {
    /// Draws the whole surface: first what points tell of the ground, then the ground below plants and
    /// obstacles, then small gaps.
    fn draw(&mut self, states: &GridMap<CellState>, config: &ElevationConfig) {
        self.next.clear();
        self.next.extend(states.values().iter().map(seen_surface));
        self.support.heights_m.clear();
        self.support.heights_m.extend(self.next.iter().map(|cell| cell.height_m));
        self.support.variances_m2.clear();
        self.support.variances_m2.extend(self.next.iter().map(|cell| cell.height_variance_m2));
        self.uncover(states, config);
        self.fill_gaps(states, config);
    }

    /// Infers the ground where only plants or obstacles were seen: from ground within twice the gap radius,
    /// else from the lowest plant within the gap radius. It is never above anything that was seen there.
    fn uncover(&mut self, states: &GridMap<CellState>, config: &ElevationConfig) {
        let geometry = states.geometry();
        let radius = config.gap_radius_cells();
        self.covered.clear();
        for (index, state) in states.values().iter().enumerate() {
            if state.ground != Ground::Unseen || !state.was_hit() {
                continue;
            }
            let cell = geometry.cell(index);
            let inferred = self.support.infer(geometry, cell, 2 * radius);
            let around = CellRegion::of_cell(cell).grown(radius, geometry);
            let Some(mut inferred) = inferred.or_else(|| lowest_plant(states, &around, config)) else {
                continue;
            };
            inferred.height_m = inferred.height_m.min(state.lowest_m).min(state.ceiling_m);
            self.covered.push((index as u32, inferred));
        }
        for &(index, inferred) in &self.covered {
            let index = index as usize;
            self.support.heights_m[index] = inferred.height_m;
            self.support.variances_m2[index] = inferred.variance_m2;
            self.next[index] = SurfaceCell {
                height_m: inferred.height_m,
                height_variance_m2: inferred.variance_m2,
                vegetation_height_m: (states.values()[index].vegetation_top_m - inferred.height_m).max(0.0),
                knowledge: Knowledge::Interpolated,
                ..self.next[index]
            };
        }
    }

    /// Fills cells that are enclosed by seen ones, unless a ray passed below the height they would get: then
    /// there is a ditch.
    fn fill_gaps(&mut self, states: &GridMap<CellState>, config: &ElevationConfig) {
        let (geometry, radius) = (states.geometry(), config.gap_radius_cells());
        self.enclosure.find(&self.support.heights_m, geometry, radius);
        for (index, state) in states.values().iter().enumerate() {
            let is_gap = !self.next[index].is_known() && !state.was_hit();
            if !is_gap || self.enclosure.quadrants[index] != Enclosure::ALL {
                continue;
            }
            let cell = geometry.cell(index);
            let Some(inferred) = self.support.infer(geometry, cell, radius) else { continue };
            let tolerance_m = GAP_MARGIN_SHARE * config.visibility_margin_m + 2.0 * inferred.seen_m2.sqrt();
            if inferred.height_m <= state.ceiling_m + tolerance_m {
                let around = CellRegion::of_cell(cell).grown(radius, geometry);
                let (class_probability, vegetation_height_m) = mean_cover(states, &self.next, &around);
                self.next[index] = SurfaceCell {
                    height_m: inferred.height_m,
                    height_variance_m2: inferred.variance_m2,
                    vegetation_height_m,
                    class_probability,
                    knowledge: Knowledge::Interpolated,
                };
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

/// The lowest plant or obstacle point among cells; all that is known in a meadow without a bare spot.
fn lowest_plant(
    states: &GridMap<CellState>,
    around: &CellRegion,
    config: &ElevationConfig,
) -> Option<Inferred> {
    let height_m = around.cells().fold(f32::INFINITY, |low_m, cell| low_m.min(states[cell].lowest_m));
    let std_m = config.hidden_ground_std_m;
    height_m.is_finite().then_some(Inferred { height_m, variance_m2: std_m * std_m, seen_m2: std_m * std_m })
}

/// Mean class probability and vegetation height of the cells in which something was seen.
fn mean_cover(
    states: &GridMap<CellState>,
    surface: &[SurfaceCell],
    around: &CellRegion,
) -> ([f32; TerrainClass::COUNT], f32) {
    let (mut n, mut probability, mut height_m) = (0.0_f32, [0.0; TerrainClass::COUNT], 0.0);
    for cell in around.cells().filter(|&cell| states[cell].was_hit()) {
        let seen = &surface[states.geometry().index(cell)];
        n += 1.0;
        height_m += seen.vegetation_height_m;
        for (sum, p) in probability.iter_mut().zip(&seen.class_probability) {
            *sum += p;
        }
    }
    if n > 0.0 { (probability.map(|sum| sum / n), height_m / n) } else { (probability, 0.0) }
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
