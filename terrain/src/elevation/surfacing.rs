//! From what is remembered of the cells to the surface that consumers read.

use super::cell::{CellState, Ground};
use super::gaps::{Enclosure, Inferred, infer};
use super::stands::Stands;
use super::{ElevationConfig, ElevationMap};
use crate::{CellRegion, GridMap, Knowledge, Pose, SurfaceCell, TerrainClass};

/// Buffers kept from scan to scan.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    next: Vec<SurfaceCell>,
    inferred: Vec<(u32, SurfaceCell)>,
    enclosure: Enclosure,
    stands: Stands,
}

/// A height is published anew when it moved by more than this share of the standard deviation that was told.
const DEVIATION_SHARE: f32 = 0.5;
/// A variance is published anew when it changed by more than this share.
const VARIANCE_SHARE: f32 = 0.2;
/// A class probability is published anew when it changed by more than this.
const PROBABILITY_STEP: f32 = 0.05;
/// A height is published at once when it moved by more than so many of the standard deviations that were told.
const URGENT_DEVIATIONS: f32 = 2.0;
/// Share of the visibility margin that filled-in ground may move by before it is published at once.
const FILLED_MARGIN_SHARE: f32 = 0.1;
/// A class probability is published at once when it changed by more than this.
const URGENT_PROBABILITY_STEP: f32 = 0.2;
/// Plants less likely than this have no height: a camera errs.
const PLANT_SHARE: f32 = 0.1;
/// Share of the visibility margin by which rays may pass below a filled gap: a ditch is worth more care than a
/// ghost.
const GAP_MARGIN_SHARE: f32 = 0.25;

impl ElevationMap {
    /// Brings the published surface up to date and notes what changed: all that is worth telling when it is time, else
    /// what is urgent near the vehicle. Told at once, what is not urgent makes whoever judges footprints judge each of
    /// them once.
    pub(super) fn publish(&mut self, due: Due) {
        let geometry = *self.surface.geometry();
        self.surfacing.draw(&self.states, &self.config);
        let [x, y] = geometry.origin;
        let next = &self.surfacing.next;
        for (index, (published, next)) in self.surface.values_mut().iter_mut().zip(next).enumerate() {
            let cell = geometry.cell(index);
            let place = [x + cell.col as i64, y + cell.row as i64];
            let is_due = match due {
                Due::All => true,
                Due::Urgent(near) => near.holds(place) && is_urgent(published, next, &self.config),
            };
            if is_due && differs(published, next, &self.config) {
                *published = *next;
                self.changed.include(place, place);
            }
        }
    }
}

/// What is to be published.
#[derive(Clone, Copy, Debug)]
pub(super) enum Due {
    /// All that is worth telling.
    All,
    /// What is urgent around the vehicle.
    Urgent(Circle),
}

/// Cells of the lattice around one of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Circle {
    centre: [i64; 2],
    /// In cells.
    radius: i64,
}

impl Due {
    /// After a scan taken at `pose`, the first of which is number 0.
    pub fn after_scan(number: u64, pose: &Pose, config: &ElevationConfig) -> Self {
        if number.is_multiple_of(u64::from(config.publish_period_scans)) {
            return Self::All;
        }
        let cells = |length_m: f64| (length_m / config.resolution_m).floor() as i64;
        let centre = [pose.x_m, pose.y_m].map(cells);
        Self::Urgent(Circle { centre, radius: cells(config.publish_near_m) })
    }
}

impl Circle {
    fn holds(self, [col, row]: [i64; 2]) -> bool {
        let [x, y] = self.centre;
        (col - x).pow(2) + (row - y).pow(2) <= self.radius.saturating_pow(2)
    }
}

impl Scratch {
    /// Draws the whole surface: first what points tell of the ground, then the ground below plants and
    /// obstacles, then small gaps.
    fn draw(&mut self, states: &GridMap<CellState>, config: &ElevationConfig) {
        self.next.clear();
        self.next.extend(states.values().iter().map(|state| seen_surface(state, config)));
        let datum_m = self.next.iter().find(|cell| cell.is_known()).map_or(0.0, |cell| cell.height_m);
        self.uncover(states, config, datum_m);
        self.fill_gaps(states, config, datum_m);
    }

    /// Infers the ground where only plants or obstacles were seen: from ground within twice the gap radius or from the
    /// stand of plants, whichever tells more; else from the lowest plant within the gap radius. It is never above anything
    /// that was seen there.
    fn uncover(&mut self, states: &GridMap<CellState>, config: &ElevationConfig, datum_m: f32) {
        let (geometry, radius) = (states.geometry(), config.gap_radius_cells());
        self.inferred.clear();
        self.stands.find(&self.next, states);
        for (index, state) in states.values().iter().enumerate() {
            if state.ground != Ground::Unseen || !state.was_hit() {
                continue;
            }
            let cell = geometry.cell(index);
            // What is named as ground clearly above a leaf that was seen here is a leaf itself, or says nothing of what is
            // below.
            let ceiling_m = state.lowest_m + config.visibility_margin_m;
            let around = infer(&self.next, geometry, cell, 2 * radius, [datum_m, ceiling_m])
                .map(|inferred| (inferred.surface.height_m, inferred.surface.height_variance_m2));
            let ground = [around, self.stands.ground(index, state, config)]
                .into_iter()
                .flatten()
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .or_else(|| lowest_plant(states, &CellRegion::of_cell(cell).grown(radius, geometry), config));
            let Some((height_m, height_variance_m2)) = ground else { continue };
            let height_m = height_m.min(state.lowest_m).min(state.ceiling_m);
            let knowledge = Knowledge::Interpolated;
            let class_probability = state.class_probability(config.open_prior);
            let vegetation_height_m = vegetation_height_m(state, height_m, &class_probability);
            let surface = SurfaceCell {
                height_m,
                height_variance_m2,
                vegetation_height_m,
                class_probability,
                knowledge,
            };
            self.inferred.push((index as u32, surface));
        }
        self.enter_inferred();
    }

    /// Fills cells that are enclosed by known ones, unless a ray passed below the height they would get: then
    /// there is a ditch.
    fn fill_gaps(&mut self, states: &GridMap<CellState>, config: &ElevationConfig, datum_m: f32) {
        let (geometry, radius) = (states.geometry(), config.gap_radius_cells());
        self.enclosure.find(&self.next, geometry, radius);
        self.inferred.clear();
        for (index, quadrants) in self.enclosure.quadrants.iter().enumerate() {
            let state = &states.values()[index];
            if *quadrants != Enclosure::ALL || self.next[index].is_known() || state.was_hit() {
                continue;
            }
            let inferred =
                infer(&self.next, geometry, geometry.cell(index), radius, [datum_m, f32::INFINITY]);
            let Some(Inferred { mut surface, seen_m2 }) = inferred else { continue };
            let tolerance_m = GAP_MARGIN_SHARE * config.visibility_margin_m + seen_m2.sqrt();
            if surface.height_m <= state.ceiling_m + tolerance_m {
                surface.height_m = surface.height_m.min(state.ceiling_m);
                self.inferred.push((index as u32, surface));
            }
        }
        self.enter_inferred();
    }

    /// Enters what was inferred; only now, so that nothing is inferred from what was inferred beside it.
    fn enter_inferred(&mut self) {
        for &(index, surface) in &self.inferred {
            self.next[index as usize] = surface;
        }
    }
}

/// The surface of a cell as far as its own points tell.
fn seen_surface(state: &CellState, config: &ElevationConfig) -> SurfaceCell {
    let class_probability = state.class_probability(config.open_prior);
    let knowledge = match state.ground {
        Ground::Unseen => return SurfaceCell { class_probability, ..SurfaceCell::UNKNOWN },
        Ground::Assumed => Knowledge::Interpolated,
        Ground::Seen => Knowledge::Measured,
    };
    SurfaceCell {
        height_m: state.ground_m,
        height_variance_m2: state.variance_m2 + state.spread_m2,
        vegetation_height_m: vegetation_height_m(state, state.ground_m, &class_probability),
        class_probability,
        knowledge,
    }
}

/// Height of the plants above the ground, zero where next to none were seen.
fn vegetation_height_m(
    state: &CellState,
    ground_m: f32,
    class_probability: &[f32; TerrainClass::COUNT],
) -> f32 {
    if class_probability[TerrainClass::Vegetation as usize] < PLANT_SHARE {
        return 0.0;
    }
    (state.vegetation_top_m - ground_m).max(0.0)
}

/// Height and variance of the lowest plant or obstacle point among cells: all that is known of the ground in
/// a meadow without a bare spot.
fn lowest_plant(
    states: &GridMap<CellState>,
    around: &CellRegion,
    config: &ElevationConfig,
) -> Option<(f32, f32)> {
    let height_m = around.cells().fold(f32::INFINITY, |low_m, cell| low_m.min(states[cell].lowest_m));
    height_m.is_finite().then_some((height_m, config.hidden_ground_std_m * config.hidden_ground_std_m))
}

/// Whether a cell tells so much that it cannot wait.
fn is_urgent(published: &SurfaceCell, next: &SurfaceCell, config: &ElevationConfig) -> bool {
    let told_m = URGENT_DEVIATIONS * published.height_variance_m2.sqrt();
    // What was filled in may turn out to be a ditch.
    let share = if next.knowledge == Knowledge::Interpolated { FILLED_MARGIN_SHARE } else { 1.0 };
    let step_m = told_m.min(share * config.visibility_margin_m).max(config.publish_step_m);
    let pairs = published.class_probability.iter().zip(&next.class_probability);
    published.is_known() != next.is_known()
        || (published.height_m - next.height_m).abs() > step_m
        || (published.vegetation_height_m - next.vegetation_height_m).abs() > step_m
        || published.class() != next.class()
        || pairs.into_iter().any(|(a, b)| (a - b).abs() > URGENT_PROBABILITY_STEP)
}

fn differs(published: &SurfaceCell, next: &SurfaceCell, config: &ElevationConfig) -> bool {
    let variance_m2 = published.height_variance_m2;
    let (step_m, share, probability_step) = if config.publish_step_m > 0.0 {
        let step_m = config.publish_step_m.max(DEVIATION_SHARE * variance_m2.sqrt());
        (step_m, VARIANCE_SHARE, PROBABILITY_STEP)
    } else {
        (0.0, 0.0, 0.0)
    };
    let moved = |a: f32, b: f32| (a - b).abs() > step_m;
    published.knowledge != next.knowledge
        || moved(published.height_m, next.height_m)
        || moved(published.vegetation_height_m, next.vegetation_height_m)
        || (variance_m2 - next.height_variance_m2).abs() > share * variance_m2
        || (published.class_probability.iter().zip(&next.class_probability))
            .any(|(a, b)| (a - b).abs() > probability_step)
}

#[cfg(test)]
impl Scratch {
    /// Where the buffers lie and how much they hold.
    pub fn buffers(&self) -> [(usize, usize); 4] {
        [
            self.stands.buffer(),
            (self.next.as_ptr() as usize, self.next.capacity()),
            (self.inferred.as_ptr() as usize, self.inferred.capacity()),
            (self.enclosure.quadrants.as_ptr() as usize, self.enclosure.quadrants.capacity()),
        ]
    }
}
