//! How tall plants are that hide the ground: as tall as those of their stand between which it is seen.

use super::ElevationConfig;
use super::cell::{CellState, Ground};
use crate::{CellRegion, GridGeometry, GridMap, SurfaceCell, TerrainClass};

/// Heights of plants, carried from where ground was seen between them into the stand behind.
///
/// Rays meet the front of a stand at every height, but only the tops of what is behind: judged by its lowest leaf, a
/// thicket is a lawn on a rise.
#[derive(Clone, Debug, Default)]
pub(super) struct Stands {
    plants: Vec<Plants>,
}

#[derive(Clone, Copy, Debug)]
struct Plants {
    hide_ground: bool,
    /// Of the nearest plants of the stand that stand on seen ground [m], and the variance of that ground [m2].
    height_m: f32,
    variance_m2: f32,
    /// Cells to them, along rows and columns; `FAR` without any.
    distance: u32,
}

const FAR: u32 = u32::MAX;

impl Stands {
    /// `surface` is what points tell of the ground in the cells of `states`.
    pub fn find(&mut self, surface: &[SurfaceCell], states: &GridMap<CellState>) {
        self.plants.clear();
        self.plants
            .extend(surface.iter().zip(states.values()).map(|(cell, state)| Plants::seen(cell, state)));
        if !self.plants.iter().any(|plants| plants.hide_ground) {
            return;
        }
        let geometry = states.geometry();
        (0..self.plants.len()).for_each(|index| self.compare_to_those_beside(index, geometry));
        let (n_cells, n_cols) = (self.plants.len(), geometry.n_cols);
        let is_first = |index: usize| index.is_multiple_of(n_cols);
        (1..n_cells).filter(|&east| !is_first(east)).for_each(|east| self.carry(east - 1, east));
        (1..n_cells).rev().filter(|&east| !is_first(east)).for_each(|east| self.carry(east, east - 1));
        (n_cols..n_cells).for_each(|north| self.carry(north - n_cols, north));
        (n_cols..n_cells).rev().for_each(|north| self.carry(north, north - n_cols));
    }

    /// Height of the ground that the plants of a cell hide, and its variance, were they as tall as the nearest of their
    /// stand on seen ground; `None` where there are none.
    ///
    /// Where in their height the ground lies is uncertain (the variance of a uniform distribution), though not more than
    /// without a stand.
    pub fn ground(&self, index: usize, state: &CellState, config: &ElevationConfig) -> Option<(f32, f32)> {
        let Plants { height_m, variance_m2, distance, .. } = self.plants[index];
        let unknown_m2 = config.hidden_ground_std_m * config.hidden_ground_std_m;
        let uncertain_m2 = (variance_m2 + height_m * height_m / 12.0).min(unknown_m2);
        (distance < FAR).then_some((state.vegetation_top_m - height_m, uncertain_m2))
    }

    /// Where the buffer lies and how much it holds.
    #[cfg(test)]
    pub fn buffer(&self) -> (usize, usize) {
        (self.plants.as_ptr() as usize, self.plants.capacity())
    }

    /// What one cell alone tells may be a point of something else: plants on seen ground count as no taller than the
    /// tallest of those beside them, and as unknown where there are none.
    fn compare_to_those_beside(&mut self, index: usize, geometry: &GridGeometry) {
        if self.plants[index].distance > 0 {
            return;
        }
        let around = CellRegion::of_cell(geometry.cell(index)).grown(1, geometry);
        let beside = around.cells().map(|cell| geometry.index(cell)).filter(|&other| other != index);
        let on_seen_ground = beside.map(|other| self.plants[other]).filter(|plants| plants.distance == 0);
        let tallest_m = on_seen_ground.map(|plants| plants.height_m).fold(f32::NEG_INFINITY, f32::max);
        let plants = &mut self.plants[index];
        plants.height_m = plants.height_m.min(tallest_m);
        if tallest_m < 0.0 {
            plants.distance = FAR;
        }
    }

    fn carry(&mut self, from: usize, to: usize) {
        let here = self.plants[from];
        let distance = here.distance.saturating_add(1);
        let there = &mut self.plants[to];
        if there.hide_ground && distance < there.distance {
            *there = Plants { hide_ground: true, distance, ..here };
        }
    }
}

impl Plants {
    fn seen(cell: &SurfaceCell, state: &CellState) -> Self {
        let [.., plants, obstacle] = cell.class_probability;
        let hide_ground = state.was_hit() && state.ground == Ground::Unseen && plants > obstacle;
        let on_seen_ground = cell.is_known() && cell.class() == TerrainClass::Vegetation;
        let distance = if on_seen_ground { 0 } else { FAR };
        let (height_m, variance_m2) = (cell.vegetation_height_m, cell.height_variance_m2);
        Self { hide_ground, height_m, variance_m2, distance }
    }
}
