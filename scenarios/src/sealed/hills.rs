//! Ground for test drives: rolling hills, with meadows and loose patches.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{GridGeometry, TerrainClass};

use crate::{Patch, Stribeck, World, WorldError};

/// Nodes along each side.
const N_NODES: usize = 176;
/// Waves that hills and patches are made of.
const N_WAVES: usize = 24;
/// Friction on loose ground over that on firm ground [-].
const LOOSE_GRIP: f32 = 0.8;
/// Resistance of loose ground over load [-].
const LOOSE_RESISTANCE: f32 = 0.03;

/// A smooth random function of the place, of unit variance.
struct Waves {
    /// Wave vector [rad/m] and phase [rad].
    waves: Vec<([f64; 2], f64)>,
}

impl Waves {
    fn draw(wavelengths_m: [f64; 2], rng: &mut Xoshiro256PlusPlus) -> Self {
        let wave = || {
            let [short, long] = wavelengths_m.map(f64::ln);
            let radpm = TAU / rng.random_range(short..long).exp();
            let heading_rad = rng.random_range(0.0..TAU);
            ([radpm * heading_rad.cos(), radpm * heading_rad.sin()], rng.random_range(0.0..TAU))
        };
        Self { waves: std::iter::repeat_with(wave).take(N_WAVES).collect() }
    }

    fn at(&self, x_m: f64, y_m: f64) -> f64 {
        let sum: f64 =
            self.waves.iter().map(|([u, v], phase_rad)| (u * x_m + v * y_m + phase_rad).cos()).sum();
        sum * (2.0 / N_WAVES as f64).sqrt()
    }

    /// Root mean square of the slope for waves of unit variance [1/m].
    fn slope_per_m(&self) -> f64 {
        let squares: f64 = self.waves.iter().map(|([u, v], _)| u * u + v * v).sum();
        (squares / N_WAVES as f64).sqrt()
    }
}

/// What the hills are like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hills {
    /// Of the machine that drives there [m].
    pub wheelbase_m: f64,
    /// Friction of the firm ground.
    pub friction: Stribeck,
    /// Height of the plants in the meadows [m].
    pub vegetation_m: f64,
}

impl Hills {
    /// Distance between nodes [m].
    pub(super) fn resolution_m(&self) -> f64 {
        0.4 * self.wheelbase_m
    }

    /// Half of the side [m].
    pub(super) fn half_side_m(&self) -> f64 {
        0.5 * N_NODES as f64 * self.resolution_m()
    }

    /// The world, around the origin.
    pub(super) fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Result<World, WorldError> {
        let lengths_m = |short: f64, long: f64| [short * self.wheelbase_m, long * self.wheelbase_m];
        let hills = Waves::draw(lengths_m(9.0, 30.0), rng);
        let slope = rng.random_range(0.06..0.1);
        let height_m = slope / hills.slope_per_m();
        let [meadows, loose] = [(); 2].map(|()| Waves::draw(lengths_m(14.0, 40.0), rng));
        let firm = Patch::open(self.friction);
        let patch = |x_m: f64, y_m: f64| {
            if meadows.at(x_m, y_m) > 0.55 {
                firm.overgrown(self.vegetation_m as f32)
            } else if loose.at(x_m, y_m) > 0.6 {
                let friction = self.friction.scaled(LOOSE_GRIP);
                let class = TerrainClass::Loose;
                Patch { class, friction, rolling_resistance: LOOSE_RESISTANCE, ..firm }
            } else {
                firm
            }
        };
        let geometry = GridGeometry::centred(self.resolution_m(), N_NODES, N_NODES, 0.0, 0.0);
        World::from_fn("hills", geometry, |x_m, y_m| height_m * hills.at(x_m, y_m), patch)
    }
}
