//! Smooth random fields.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{GridGeometry, GridMap};

/// Number of plane waves that make a field.
const N_WAVES: usize = 64;

/// A Gaussian-like random field of unit variance without wavelengths below a bound: a sum of plane waves.
pub(crate) struct Waves {
    /// Wave vector [rad/m], phase [rad], amplitude.
    waves: Vec<([f64; 2], f64, f64)>,
}

impl Waves {
    pub(crate) fn random(wavelength_m: [f64; 2], rng: &mut Xoshiro256PlusPlus) -> Self {
        let [shortest, longest] = wavelength_m.map(f64::ln);
        let mut waves: Vec<_> = (0..N_WAVES)
            .map(|_| {
                let length_m = (shortest + (longest - shortest) * rng.random::<f64>()).exp();
                let (heading, phase) = (rng.random_range(0.0..TAU), rng.random_range(0.0..TAU));
                let number = TAU / length_m;
                ([number * f64::cos(heading), number * f64::sin(heading)], phase, length_m)
            })
            .collect();
        // A cosine of amplitude a has variance a^2 / 2; independent phases add up.
        let power: f64 = waves.iter().map(|(_, _, amplitude)| amplitude * amplitude / 2.0).sum();
        waves.iter_mut().for_each(|wave| wave.2 /= power.sqrt());
        Self { waves }
    }

    /// The field at the centres of the cells. A wave splits into a factor per column and one per row,
    /// which spares a cosine per cell and wave.
    pub(crate) fn on(&self, geometry: GridGeometry) -> GridMap<f64> {
        let mut field = GridMap::filled(geometry, 0.0);
        let centre = |index: usize, axis: usize| {
            (geometry.origin[axis] as f64 + index as f64 + 0.5) * geometry.resolution_m
        };
        for ([east, north], phase, amplitude) in &self.waves {
            let eastward: Vec<_> =
                (0..geometry.n_cols).map(|col| (east * centre(col, 0) + phase).sin_cos()).collect();
            for (row, values) in field.values_mut().chunks_exact_mut(geometry.n_cols).enumerate() {
                let (sin_north, cos_north) = (north * centre(row, 1)).sin_cos();
                for (value, (sin_east, cos_east)) in values.iter_mut().zip(&eastward) {
                    *value += amplitude * (cos_east * cos_north - sin_east * sin_north);
                }
            }
        }
        field
    }
}
