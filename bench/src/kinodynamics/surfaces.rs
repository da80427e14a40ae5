//! What the car drives on: four surfaces in patches, each covered more or less densely, and a floor that nobody learned on.
//!
//! Rough ground is loose and slippery ground here, because leaves and twigs are all three; so what the unit feels tells
//! something of how the ground gives way under the tyres, and of its friction. Frozen before the first model was trained.

use scenarios::{Patch, Plant, Stribeck, World, WorldError, seed_of};
use terrain::{GridGeometry, TerrainClass};

/// Edge of a cell [m].
const RESOLUTION_M: f64 = 0.025;
/// Distance of the patches' centres [m].
const PATCH_M: f64 = 1.6;
/// Friction that the densest cover takes away [-].
const COVER_FRICTION: f32 = 0.2;

/// Numbers of [`Layout::coefficients_under`].
pub(super) const COEFFICIENTS: usize = 4;
/// What the ground is to a tyre.
pub(super) type Coefficients = [f32; COEFFICIENTS];

/// A surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Name.
    pub name: &'static str,
    /// Friction where nothing covers it.
    friction: Stribeck,
    /// Standard deviation of the heights where nothing covers it [m].
    roughness_m: f64,
    /// Resistance over load [-].
    rolling_resistance: f32,
    /// Shear deformation modulus where nothing covers it [m].
    shear_deformation_m: f32,
    class: TerrainClass,
}

/// Cement, dirt, grass, and leaves: the paper's ground. What soil holds is Mohr and Coulomb's, cohesion over pressure and the
/// tangent of the friction angle; under a car that presses with 7 kPa that is more than under a lorry. Sources of both
/// properties: docs/plant.md, "Loose ground".
pub const SURFACES: [Surface; 4] = [
    Surface {
        name: "cement",
        friction: Stribeck::ASPHALT,
        roughness_m: 0.0002,
        rolling_resistance: 0.0,
        shear_deformation_m: 0.0,
        class: TerrainClass::Open,
    },
    Surface {
        name: "dirt",
        friction: soil(0.90, 0.85),
        roughness_m: 0.0010,
        rolling_resistance: 0.01,
        shear_deformation_m: 0.0006,
        class: TerrainClass::Loose,
    },
    Surface {
        name: "grass",
        friction: soil(0.85, 0.80),
        roughness_m: 0.0020,
        rolling_resistance: 0.03,
        shear_deformation_m: 0.0010,
        class: TerrainClass::Vegetation,
    },
    Surface {
        name: "leaves",
        friction: soil(0.70, 0.65),
        roughness_m: 0.0030,
        rolling_resistance: 0.02,
        shear_deformation_m: 0.0020,
        class: TerrainClass::Loose,
    },
];

const fn soil(static_friction: f32, dynamic_friction: f32) -> Stribeck {
    Stribeck { static_friction, dynamic_friction, viscous_friction: 0.005, stribeck_speed_mps: 5.0 }
}

/// A wooden floor: even, and less grip than cement.
const WOOD: Surface = Surface {
    name: "wood",
    friction: Stribeck {
        static_friction: 0.75,
        dynamic_friction: 0.60,
        viscous_friction: 0.0,
        stribeck_speed_mps: 4.5,
    },
    roughness_m: 0.0001,
    rolling_resistance: 0.0,
    shear_deformation_m: 0.0,
    class: TerrainClass::Open,
};

/// Where patches lie, and what covers them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// Patches of all four surfaces.
    Patches {
        /// Decides which lies where, and its cover.
        seed: u64,
    },
    /// One surface, uncovered.
    One(usize),
    /// The floor that nobody learned on.
    Wood {
        /// Decides its texture.
        seed: u64,
    },
}

/// What lies at a point.
struct Place {
    surface: Surface,
    index: Option<u32>,
    /// 0 bare, 1 densely covered.
    cover: f64,
}

impl Layout {
    /// Index into [`SURFACES`] of what lies at a point; none of the floor.
    pub fn surface_at(&self, x_m: f64, y_m: f64) -> Option<u32> {
        self.place(x_m, y_m).index
    }

    /// Everything that acts on the tyres, in numbers of about one, the mean of what lies under the wheels: static and sliding
    /// friction, shear deformation modulus [mm] and standard deviation of the heights [mm].
    pub(super) fn coefficients_under(&self, plant: &Plant) -> Coefficients {
        let mut mean = [0.0; COEFFICIENTS];
        for wheel in plant.wheels() {
            let [x_m, y_m, _] = wheel.hub_m;
            let (Place { surface, cover, .. }, patch) = (self.place(x_m, y_m), self.patch(x_m, y_m));
            let roughness_m = (surface.roughness_m * (1.0 + cover)) as f32;
            let friction = patch.friction;
            let millimetres = [patch.shear_deformation_m, roughness_m].map(|metres| 1e3 * metres);
            let found = [friction.static_friction, friction.dynamic_friction, millimetres[0], millimetres[1]];
            for (mean, found) in mean.iter_mut().zip(found) {
                *mean += 0.25 * found;
            }
        }
        mean
    }

    /// A world between two corners.
    ///
    /// # Errors
    /// Corners that leave no ground between them.
    pub fn world(&self, low_m: [f64; 2], high_m: [f64; 2]) -> Result<World, WorldError> {
        let cells = |value_m: f64| (value_m / RESOLUTION_M).round() as i64;
        let origin = low_m.map(cells);
        let [n_cols, n_rows] = [0, 1].map(|axis| (cells(high_m[axis]) - origin[axis]).max(0) as usize);
        let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin, n_rows, n_cols };
        World::from_fn("surfaces", geometry, |x, y| self.height_m(x, y), |x, y| self.patch(x, y))
    }

    fn place(&self, x_m: f64, y_m: f64) -> Place {
        match *self {
            Self::One(index) => Place { surface: SURFACES[index], index: Some(index as u32), cover: 0.0 },
            Self::Wood { .. } => Place { surface: WOOD, index: None, cover: 0.0 },
            Self::Patches { seed } => {
                let (index, cover) = nearest_patch(seed, x_m, y_m);
                Place { surface: SURFACES[index], index: Some(index as u32), cover }
            }
        }
    }

    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let Place { surface, cover, .. } = self.place(x_m, y_m);
        let seed = match *self {
            Self::Patches { seed } | Self::Wood { seed } => seed,
            Self::One(index) => index as u64,
        };
        let cell = |value_m: f64| (value_m / RESOLUTION_M).floor() as i64 as u64;
        let share = uniform(seed_of(seed, &[7, cell(x_m), cell(y_m)]));
        // Uniform within the root of three has a deviation of one.
        surface.roughness_m * (1.0 + cover) * (2.0 * share - 1.0) * 3f64.sqrt()
    }

    fn patch(&self, x_m: f64, y_m: f64) -> Patch {
        let Place { surface, cover, .. } = self.place(x_m, y_m);
        let friction = surface.friction.scaled(1.0 - COVER_FRICTION * cover as f32);
        Patch {
            class: surface.class,
            rolling_resistance: surface.rolling_resistance,
            shear_deformation_m: surface.shear_deformation_m * (1.0 + cover as f32),
            ..Patch::open(friction)
        }
    }
}

fn uniform(word: u64) -> f64 {
    (word >> 11) as f64 / (1_u64 << 53) as f64
}

/// Surface and cover of the patch whose centre is nearest: one centre somewhere in every square.
fn nearest_patch(seed: u64, x_m: f64, y_m: f64) -> (usize, f64) {
    let [col, row] = [x_m, y_m].map(|value_m| (value_m / PATCH_M).floor() as i64);
    let mut best = (0, 0.0);
    let mut least = f64::INFINITY;
    for k in 0..9 {
        let (col, row) = (col + k % 3 - 1, row + k / 3 - 1);
        let draw = |what: u64| uniform(seed_of(seed, &[what, col as u64, row as u64]));
        let off_m = [x_m - PATCH_M * (col as f64 + draw(1)), y_m - PATCH_M * (row as f64 + draw(2))];
        let square = off_m[0] * off_m[0] + off_m[1] * off_m[1];
        if square < least {
            least = square;
            best = ((draw(3) * SURFACES.len() as f64) as usize, draw(4));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_takes_about_a_quarter_of_the_ground() {
        let layout = Layout::Patches { seed: 5 };
        let mut counts = [0.0; 4];
        for k in 0..40_000 {
            let (x_m, y_m) = (f64::from(k % 200) * 0.5, f64::from(k / 200) * 0.5);
            counts[layout.surface_at(x_m, y_m).unwrap() as usize] += 1.0 / 40_000.0;
        }
        assert!(counts.iter().all(|share| (0.22..0.28).contains(share)), "{counts:?}");
    }

    #[test]
    fn heights_scatter_as_much_as_the_surface_says() {
        let world = Layout::One(3).world([0.0, 0.0], [5.0, 5.0]).unwrap();
        let heights = world.heights.values();
        let mean = heights.iter().map(|h| f64::from(*h)).sum::<f64>() / heights.len() as f64;
        let square =
            heights.iter().map(|h| (f64::from(*h) - mean).powi(2)).sum::<f64>() / heights.len() as f64;
        assert!((square.sqrt() / 0.003 - 1.0).abs() < 0.02, "{}", square.sqrt());
    }
}
