//! Density of latents under stacked radial flows (NOTES 1.1).

use super::lanes::{Lanes, N_LANES, ln};

/// One layer: z + b h (z - centre) with h = 1 / (a + |z - centre|).
#[derive(Clone, Debug)]
struct Radial {
    centre: Vec<f32>,
    a: f32,
    b: f32,
}

/// From latents to a standard normal distribution, layer by layer.
#[derive(Clone, Debug)]
pub(crate) struct RadialFlow {
    layers: Vec<Radial>,
    n_latent: usize,
}

impl RadialFlow {
    /// From centres of shape [layer, latent] and, per layer, the raw parameters a' and b' of
    /// a = softplus(a'), b = softplus(b') - a, which keep every layer invertible.
    pub fn new(centres: &[f32], raw_a: &[f32], raw_b: &[f32], n_latent: usize) -> Self {
        let layer = |((centre, raw_a), raw_b): ((&[f32], &f32), &f32)| {
            // Rounded once: b is a small difference of large numbers.
            let (a, sum) = (softplus(f64::from(*raw_a)), softplus(f64::from(*raw_b)));
            // Not zero, or a latent at the centre would be divided by nothing.
            Radial { centre: centre.to_vec(), a: (a as f32).max(1e-12), b: (sum - a) as f32 }
        };
        Self { layers: centres.chunks(n_latent).zip(raw_a).zip(raw_b).map(layer).collect(), n_latent }
    }

    /// Log densities of latents, which are used up.
    #[inline(always)]
    pub fn log_density(&self, latent: &mut [Lanes]) -> Lanes {
        let mut log_determinant = Lanes::ZERO;
        for layer in &self.layers {
            layer.apply(latent, &mut log_determinant);
        }
        let per_dimension = self.n_latent as f32 * std::f32::consts::TAU.ln();
        let mut squares = Lanes::ZERO;
        for z in latent.iter() {
            squares = squares.zip(*z, |sum, z| sum + z * z);
        }
        log_determinant
            .zip(squares, |log_determinant, squares| log_determinant - 0.5 * (per_dimension + squares))
    }
}

impl Radial {
    #[inline(always)]
    fn apply(&self, latent: &mut [Lanes], log_determinant: &mut Lanes) {
        let mut squares = Lanes::ZERO;
        for (z, centre) in latent.iter().zip(&self.centre) {
            squares = squares.zip(*z, |sum, z| sum + (z - centre) * (z - centre));
        }
        let mut stretch = Lanes::ZERO;
        let rest = latent.len() as f32 - 1.0;
        for lane in 0..N_LANES {
            let h = 1.0 / (self.a + squares.0[lane].sqrt());
            let bh = self.b * h;
            stretch.0[lane] = bh;
            // The second factor is 1 + b h - b r h^2 = 1 + a b h^2.
            log_determinant.0[lane] += rest * ln(1.0 + bh) + ln(1.0 + self.a * bh * h);
        }
        for (z, centre) in latent.iter_mut().zip(&self.centre) {
            *z = z.zip(stretch, |z, bh| z + bh * (z - centre));
        }
    }
}

fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}
