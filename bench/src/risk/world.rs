//! The ground that is driven over: which cell is covered by what, and how much traction it really gives.

use rand::RngExt;
use scenarios::stream;

use super::mixture::{Component, Mixture};

/// Cells along a side.
pub const N_CELLS: usize = 9;
/// Side of a cell [m].
pub const CELL_M: f64 = 1.0;
/// Start: east, north [m] and yaw [rad].
pub const START: [f64; 3] = [0.5, 0.5, std::f64::consts::FRAC_PI_4];
/// Goal: east, north [m].
pub const GOAL_M: [f64; 2] = [8.5, 8.5];

/// What covers a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cover {
    /// N(0.65, 0.1).
    Dirt,
    /// 0.6 N(0, 0.15) + 0.4 N(0.8, 0.1): it stops a vehicle, or it does not.
    Bush,
}

const DIRT: Mixture = Mixture(&[Component { share: 1.0, mean: 0.65, std: 0.1 }]);
const BUSH: Mixture =
    Mixture(&[Component { share: 0.6, mean: 0.0, std: 0.15 }, Component { share: 0.4, mean: 0.8, std: 0.1 }]);

impl Cover {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Dirt, Self::Bush];

    /// Distribution of the linear traction, and of the angular.
    pub fn traction(self) -> Mixture {
        match self {
            Self::Dirt => DIRT,
            Self::Bush => BUSH,
        }
    }
}

/// Nine by nine cells: the outer ring is dirt, each cell within it a bush with the probability `density`. Every cell has
/// a linear and an angular traction, drawn independently.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Row-major from the south-west corner.
    cells: Vec<(Cover, [f64; 2])>,
}

impl World {
    /// The world of a seed; worlds of different densities are independent.
    pub fn new(density: f64, seed: u64) -> Self {
        let mut rng = stream(seed, &[density.to_bits()]);
        let cell = |index: usize| {
            let is_inner = [index / N_CELLS, index % N_CELLS].iter().all(|i| (1..N_CELLS - 1).contains(i));
            let cover = if is_inner && rng.random::<f64>() < density { Cover::Bush } else { Cover::Dirt };
            (cover, [0; 2].map(|_| cover.traction().sample(&mut rng)))
        };
        Self { cells: (0..N_CELLS * N_CELLS).map(cell).collect() }
    }

    /// What covers the ground at a point; `None` outside.
    pub fn cover_at(&self, at_m: [f64; 2]) -> Option<Cover> {
        self.cell_at(at_m).map(|(cover, _)| *cover)
    }

    /// Linear and angular traction at a point; outside nothing moves.
    pub fn traction_at(&self, at_m: [f64; 2]) -> [f64; 2] {
        self.cell_at(at_m).map_or([0.0; 2], |(_, traction)| *traction)
    }

    fn cell_at(&self, at_m: [f64; 2]) -> Option<&(Cover, [f64; 2])> {
        let [col, row] = at_m.map(|value_m| (value_m / CELL_M).floor());
        let is_inside = [col, row].iter().all(|i| (0.0..N_CELLS as f64).contains(i));
        is_inside.then(|| &self.cells[row as usize * N_CELLS + col as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bushes(world: &World) -> usize {
        world.cells.iter().filter(|(cover, _)| *cover == Cover::Bush).count()
    }

    #[test]
    fn ring_is_dirt_and_density_is_of_what_lies_within() {
        assert_eq!(bushes(&World::new(0.0, 3)), 0);
        let full = World::new(1.0, 3);
        assert_eq!(bushes(&full), 49);
        for (east_m, north_m) in [(0.5, 4.5), (8.9, 0.1), (4.5, 8.5)] {
            assert_eq!(full.cover_at([east_m, north_m]), Some(Cover::Dirt));
        }
        // 49 cells in 200 worlds: five standard deviations are 0.025.
        let n: usize = (1..=200).map(|seed| bushes(&World::new(0.4, seed))).sum();
        assert!((n as f64 / (200.0 * 49.0) - 0.4).abs() < 0.025, "{n}");
    }

    #[test]
    fn linear_and_angular_traction_are_independent() {
        let pairs: Vec<[f64; 2]> = (1..=200)
            .flat_map(|seed| World::new(1.0, seed).cells)
            .filter_map(|(cover, traction)| (cover == Cover::Bush).then_some(traction))
            .collect();
        let n = pairs.len() as f64;
        let mean = [0, 1].map(|axis| pairs.iter().map(|pair| pair[axis]).sum::<f64>() / n);
        let moment = |a: usize, b: usize| -> f64 {
            pairs.iter().map(|pair| (pair[a] - mean[a]) * (pair[b] - mean[b])).sum::<f64>() / n
        };
        let correlation = moment(0, 1) / (moment(0, 0) * moment(1, 1)).sqrt();
        // Five standard deviations of a correlation of 9800 pairs.
        assert!(correlation.abs() < 5.0 / n.sqrt(), "{correlation}");
    }

    #[test]
    fn world_is_its_seed_and_ends_at_its_edge() {
        let world = World::new(0.7, 5);
        assert_eq!(world, World::new(0.7, 5));
        assert_ne!(world, World::new(0.7, 6));
        for outside_m in [[-0.01, 4.0], [4.0, 9.0], [f64::NAN, 1.0]] {
            assert_eq!((world.cover_at(outside_m), world.traction_at(outside_m)), (None, [0.0; 2]));
        }
        assert!(world.traction_at([8.99, 0.0])[0] > 0.0);
    }
}
