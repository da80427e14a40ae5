//! The rock testbed: square maps of convex rocks on gently rolling dirt, after the testbed that PIETRA simulates
//! (section V-A: 30 maps of 50 m, a third each for training, validation and test, the test maps more uneven).

use std::f64::consts::TAU;

use rand::RngExt;
use rand_distr::{Distribution, Poisson};
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{GridGeometry, GridMap};

use crate::random::stream;
use crate::waves::Waves;
use crate::{Patch, Stribeck, World, WorldError};

/// Maps in each split of the testbed.
pub const MAPS_PER_SPLIT: u32 = 10;

/// Rock above this height is bare rock to the tyre; below it is rubble in the dirt [m].
const BARE_ROCK_M: f64 = 0.03;

/// Length of the vehicle that the field of the fast table is told for [m].
const FULL_SIZE_M: f64 = 3.4;

/// What a map is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// To learn from.
    Train,
    /// To choose by.
    Validation,
    /// To report on: heights multiplied by [`RockFieldConfig::test_height_scale`].
    Test,
}

/// Which map: the same three numbers give the same map, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RockMap {
    /// Seed of the whole testbed.
    pub seed: u64,
    /// What the map is for.
    pub split: Split,
    /// Number within the split; the testbed of the papers ends at [`MAPS_PER_SPLIT`], any number works.
    pub index: u32,
}

/// Rocks of one kind, scattered as a Poisson process that is thinned where they would stand too close.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RockPopulation {
    /// Mean number of rocks per square metre, before any is left out.
    pub density_per_m2: f64,
    /// Smallest and largest height, log-uniform between [m].
    pub height_m: [f64; 2],
    /// Smallest and largest ratio of height to half the width at the foot: how steep the rocks stand [-].
    pub height_to_radius: [f64; 2],
    /// Smallest and largest ratio of length to width; above 2 the rocks are ridges [-].
    pub elongation: [f64; 2],
    /// A rock whose centre is nearer than this to one of its kind that is there already is left out [m].
    pub gap_m: f64,
}

/// What a rock field looks like. Density and steepness of `boulders` and `ridges` decide whether there is a way
/// through, `medium` how rough it is, `rolling_std_m` how much everything tilts.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RockFieldConfig {
    /// Side of the square map [m].
    pub side_m: f64,
    /// Edge of a cell [m].
    pub resolution_m: f64,
    /// Rocks that a wheel rolls over.
    pub small: RockPopulation,
    /// Rocks that tilt the vehicle.
    pub medium: RockPopulation,
    /// Rocks to drive around.
    pub boulders: RockPopulation,
    /// Long rocks to drive around.
    pub ridges: RockPopulation,
    /// Standard deviation of the rolling ground between the rocks [m].
    pub rolling_std_m: f64,
    /// Shortest and longest wavelength of the rolling ground [m].
    pub rolling_wavelength_m: [f64; 2],
    /// Relative variation of the friction from place to place (one standard deviation) [-].
    pub friction_variation: f64,
    /// What all heights of the test maps are multiplied by [-].
    pub test_height_scale: f64,
    /// Radius of the cleared level ground around a start or goal [m].
    pub pad_radius_m: f64,
}

impl Default for RockFieldConfig {
    fn default() -> Self {
        let population = |density_per_m2, height_m, height_to_radius, elongation| RockPopulation {
            density_per_m2,
            height_m,
            height_to_radius,
            elongation,
            gap_m: 0.0,
        };
        Self {
            side_m: 50.0,
            resolution_m: 0.1,
            small: population(0.25, [0.02, 0.07], [0.2, 0.45], [1.0, 1.6]),
            medium: population(0.03, [0.07, 0.18], [0.22, 0.5], [1.0, 1.8]),
            boulders: population(0.007, [0.3, 0.6], [0.2, 0.4], [1.0, 1.8]),
            ridges: population(0.0015, [0.3, 0.6], [0.25, 0.45], [3.0, 6.0]),
            rolling_std_m: 0.09,
            rolling_wavelength_m: [5.0, 25.0],
            friction_variation: 0.08,
            test_height_scale: 2.2,
            pad_radius_m: 5.0,
        }
    }
}

/// Why no rock field can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RockFieldError {
    /// A setting is out of range.
    #[error("rock field {field}: expected {expected}, found {found}")]
    Setting {
        /// Dotted path of the setting.
        field: String,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The heights make no world.
    #[error(transparent)]
    World(#[from] WorldError),
}

impl RockFieldConfig {
    /// The testbed on which traversability is learned: rocks everywhere, after the one that PIETRA simulates, so that
    /// even the smoother half of the footprints lean and slip. The default field is for driving: it has ways through.
    pub fn testbed() -> Self {
        let default = Self::default();
        Self {
            medium: RockPopulation { density_per_m2: 0.6, height_m: [0.07, 0.35], ..default.medium },
            boulders: RockPopulation { density_per_m2: 0.0, ..default.boulders },
            rolling_std_m: 0.15,
            ..default
        }
    }

    /// The field of the navigation benchmark: boulders that nothing drives over, with room for a vehicle between them,
    /// among rocks that the belly clears. Frozen on drives that believe in level ground, about half of which fail, and
    /// on drives that know the truth, which hardly ever do.
    pub fn navigation() -> Self {
        let default = Self::default();
        Self {
            medium: RockPopulation { density_per_m2: 0.06, height_m: [0.07, 0.13], ..default.medium },
            boulders: RockPopulation {
                density_per_m2: 0.04,
                height_m: [0.5, 0.7],
                height_to_radius: [0.4, 0.6],
                elongation: [1.0, 1.3],
                gap_m: 5.5,
            },
            ridges: RockPopulation { density_per_m2: 0.0, ..default.ridges },
            rolling_std_m: 0.08,
            pad_radius_m: 7.0,
            ..default
        }
    }

    /// The field of the fast table, for a vehicle of a length [m]: mounds to fly off, crests that hide what is behind them,
    /// and boulders that ask for turns, in proportion to the vehicle. None of it is in the way of whoever is slow.
    pub fn fast(length_m: f64) -> Self {
        let scale = length_m / FULL_SIZE_M;
        let population =
            |per_m2: f64, height_m: [f64; 2], height_to_radius, elongation, gap_m: f64| RockPopulation {
                density_per_m2: per_m2 / (scale * scale),
                height_m: height_m.map(|height_m| scale * height_m),
                height_to_radius,
                elongation,
                gap_m: scale * gap_m,
            };
        Self {
            side_m: 50.0,
            resolution_m: if scale < 0.5 { 0.05 } else { 0.1 },
            small: population(0.1, [0.02, 0.05], [0.2, 0.4], [1.0, 1.6], 0.0),
            medium: population(0.02, [0.15, 0.35], [0.15, 0.3], [1.0, 2.0], 2.0),
            boulders: population(0.004, [1.0, 1.4], [0.4, 0.6], [1.0, 1.3], 8.0),
            ridges: population(0.003, [0.3, 0.6], [0.18, 0.3], [3.0, 6.0], 4.0),
            rolling_std_m: scale * 0.15,
            rolling_wavelength_m: [scale * 5.0, scale * 25.0],
            friction_variation: 0.08,
            test_height_scale: 1.0,
            pad_radius_m: scale * 7.0,
        }
    }

    /// Refuses settings that no field can have.
    pub fn validate(&self) -> Result<(), RockFieldError> {
        let positive = "a finite number > 0";
        let not_negative = "a finite number >= 0";
        check("side_m", self.side_m, positive, |v| v > 0.0)?;
        check("resolution_m", self.resolution_m, positive, |v| v > 0.0)?;
        check("side_m / resolution_m", self.side_m / self.resolution_m, "from 2 to 5000 cells", |v| {
            (2.0..=5000.0).contains(&v)
        })?;
        check("rolling_std_m", self.rolling_std_m, not_negative, |v| v >= 0.0)?;
        check_range("rolling_wavelength_m", self.rolling_wavelength_m)?;
        check("friction_variation", self.friction_variation, "from 0 to 0.3", |v| (0.0..=0.3).contains(&v))?;
        check("test_height_scale", self.test_height_scale, positive, |v| v > 0.0)?;
        check("pad_radius_m", self.pad_radius_m, not_negative, |v| v >= 0.0)?;
        for (name, population) in self.populations() {
            let density = population.density_per_m2;
            check(&format!("{name}.density_per_m2"), density, "from 0 to 10 per m2", |v| {
                (0.0..=10.0).contains(&v)
            })?;
            check_range(&format!("{name}.height_m"), population.height_m)?;
            check_range(&format!("{name}.height_to_radius"), population.height_to_radius)?;
            check_range(&format!("{name}.elongation"), population.elongation)?;
            check(&format!("{name}.gap_m"), population.gap_m, not_negative, |v| v >= 0.0)?;
        }
        Ok(())
    }

    fn populations(&self) -> [(&'static str, &RockPopulation); 4] {
        [
            ("small", &self.small),
            ("medium", &self.medium),
            ("boulders", &self.boulders),
            ("ridges", &self.ridges),
        ]
    }
}

fn check(
    field: &str,
    found: f64,
    expected: &'static str,
    allowed: impl Fn(f64) -> bool,
) -> Result<(), RockFieldError> {
    if found.is_finite() && allowed(found) {
        return Ok(());
    }
    Err(RockFieldError::Setting { field: field.to_owned(), expected, found })
}

fn check_range(field: &str, [smallest, largest]: [f64; 2]) -> Result<(), RockFieldError> {
    check(&format!("{field}[0]"), smallest, "a finite number > 0", |v| v > 0.0)?;
    check(&format!("{field}[1]"), largest, "a finite number >= its lower end", |v| v >= smallest)
}

/// Makes a rock field with its south-west corner at the origin and level cleared ground around each of `pads_m`.
pub fn rock_field(
    config: &RockFieldConfig,
    map: RockMap,
    pads_m: &[[f64; 2]],
) -> Result<World, RockFieldError> {
    config.validate()?;
    let n = (config.side_m / config.resolution_m).round() as usize;
    let geometry = GridGeometry { resolution_m: config.resolution_m, origin: [0, 0], n_rows: n, n_cols: n };
    let key = |part: u64| stream(map.seed, &[map.split as u64, u64::from(map.index), part]);
    let scale = if map.split == Split::Test { config.test_height_scale } else { 1.0 };

    let mut rocks = GridMap::filled(geometry, 0.0);
    for (part, (_, population)) in (0..).zip(config.populations()) {
        scatter(population, config.side_m, &mut key(part), &mut rocks);
    }
    let rolling = Waves::random(config.rolling_wavelength_m, &mut key(10));
    let grip = Waves::random([1.0, 10.0], &mut key(11));
    let (rolling, grip) = (rolling.on(geometry), grip.on(geometry));

    let mut heights = GridMap::filled(geometry, 0.0);
    let mut patches = GridMap::filled(geometry, Patch::open(Stribeck::DIRT));
    for index in 0..geometry.n_cells() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let rock_m = pads_m.iter().fold(rocks.values()[index], |rock_m, pad_m| {
            rock_m.min(((x_m - pad_m[0]).hypot(y_m - pad_m[1]) - config.pad_radius_m).max(0.0))
        });
        let ground_m = config.rolling_std_m * levelled(&rolling, config.pad_radius_m, pads_m, index);
        heights.values_mut()[index] = (scale * (rock_m + ground_m)) as f32;
        let grip = 1.0 + (config.friction_variation * grip.values()[index]).clamp(-0.5, 0.5);
        patches.values_mut()[index] = ground(rock_m, grip as f32);
    }
    let name = format!("rock field {:?} {} of seed {}", map.split, map.index, map.seed).to_lowercase();
    Ok(World::new(name, heights, patches)?)
}

fn ground(rock_m: f64, grip: f32) -> Patch {
    if rock_m > BARE_ROCK_M {
        return Patch::open(Stribeck::ROCK.scaled(grip));
    }
    Patch { rolling_resistance: 0.02, ..Patch::open(Stribeck::DIRT.scaled(grip)) }
}

/// Rolling ground, levelled on each pad and blended back into the field at twice the pad's radius.
fn levelled(rolling: &GridMap<f64>, pad_radius_m: f64, pads_m: &[[f64; 2]], index: usize) -> f64 {
    let geometry = rolling.geometry();
    let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
    pads_m.iter().fold(rolling.values()[index], |height, pad_m| {
        let away = (x_m - pad_m[0]).hypot(y_m - pad_m[1]) / pad_radius_m.max(f64::MIN_POSITIVE) - 1.0;
        let t = away.clamp(0.0, 1.0);
        let level = rolling.at(pad_m[0], pad_m[1]).copied().unwrap_or(height);
        level + (height - level) * t * t * (3.0 - 2.0 * t)
    })
}

fn scatter(population: &RockPopulation, side_m: f64, rng: &mut Xoshiro256PlusPlus, rocks: &mut GridMap<f64>) {
    // Rocks centred beyond the border reach in: without them the field would thin out towards its edges.
    let margin_m = population.height_m[1] / population.height_to_radius[0] * population.elongation[1];
    let mean = population.density_per_m2 * (side_m + 2.0 * margin_m).powi(2);
    let Ok(count) = Poisson::new(mean) else { return };
    let mut centres_m: Vec<[f64; 2]> = Vec::new();
    for _ in 0..count.sample(rng) as usize {
        let centre_m = [(); 2].map(|()| rng.random_range(-margin_m..side_m + margin_m));
        let rock = Rock::random(population, centre_m, rng);
        let is_near = |[x_m, y_m]: &[f64; 2]| (centre_m[0] - x_m).hypot(centre_m[1] - y_m) < population.gap_m;
        if !centres_m.iter().any(is_near) {
            rock.raise(rocks);
            centres_m.push(centre_m);
        }
    }
}

/// A convex polyhedron standing on the ground: a tilted top cut by steep sides.
struct Rock {
    centre_m: [f64; 2],
    /// Unit vector of the long axis.
    axis: [f64; 2],
    elongation: f64,
    height_m: f64,
    /// Slope of the top along and across the axis.
    tilt: [f64; 2],
    sides: Vec<Side>,
}

/// Half-space of a rock: below a plane that meets the ground at `distance_m` from the centre.
struct Side {
    /// Outward unit vector, along and across the rock's axis.
    outward: [f64; 2],
    distance_m: f64,
    slope: f64,
}

impl Rock {
    fn random(population: &RockPopulation, centre_m: [f64; 2], rng: &mut Xoshiro256PlusPlus) -> Self {
        let between = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
        let height_m = between(population.height_m.map(f64::ln), rng.random()).exp();
        let radius_m = height_m / between(population.height_to_radius, rng.random());
        let turn: f64 = rng.random_range(0.0..TAU);
        let n_sides = rng.random_range(5..=8);
        let sides = (0..n_sides)
            .map(|k| {
                let angle = TAU * (f64::from(k) + rng.random_range(-0.3..0.3)) / f64::from(n_sides);
                let distance_m = radius_m * rng.random_range(0.8..1.15);
                // The side reaches the full height somewhere between the middle and two thirds of the way out.
                let slope = height_m / (distance_m * rng.random_range(0.35..0.8));
                Side { outward: [angle.cos(), angle.sin()], distance_m, slope }
            })
            .collect();
        Self {
            centre_m,
            axis: [turn.cos(), turn.sin()],
            elongation: between(population.elongation, rng.random()),
            height_m,
            tilt: [(); 2].map(|()| rng.random_range(-0.25..0.25)),
            sides,
        }
    }

    /// Height of the rock above its ground, zero beside it [m].
    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let (east, north) = (x_m - self.centre_m[0], y_m - self.centre_m[1]);
        let along = (east * self.axis[0] + north * self.axis[1]) / self.elongation;
        let across = north * self.axis[0] - east * self.axis[1];
        let top = self.height_m + self.tilt[0] * along + self.tilt[1] * across;
        let cut = |height: f64, side: &Side| {
            let reach = side.outward[0] * along + side.outward[1] * across;
            height.min((side.distance_m - reach) * side.slope)
        };
        self.sides.iter().fold(top, cut).max(0.0)
    }

    /// Raises the map to the union of what it held and this rock.
    fn raise(&self, rocks: &mut GridMap<f64>) {
        let geometry = *rocks.geometry();
        // Five sides at 72 +- 43 degrees may leave a corner far out: 2.5 distances cover it.
        let reach_m =
            2.5 * self.elongation * self.sides.iter().fold(0.0, |reach: f64, s| reach.max(s.distance_m));
        let span = |centre_m: f64, n: usize| {
            let index = |edge_m: f64| ((edge_m / geometry.resolution_m).max(0.0) as usize).min(n);
            index(centre_m - reach_m)..index(centre_m + reach_m)
        };
        for row in span(self.centre_m[1], geometry.n_rows) {
            for col in span(self.centre_m[0], geometry.n_cols) {
                let cell = terrain::Cell { row, col };
                let [x_m, y_m] = geometry.centre_m(cell);
                rocks[cell] = rocks[cell].max(self.height_m(x_m, y_m));
            }
        }
    }
}
