//! Density of latents under stacked radial flows (NOTES 1.1).

use pulp::Simd;

use super::lanes::{Lanes, ln};

/// ln(2 pi).
const LN_TAU: f32 = 1.837_877;

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
    pub fn log_density<S: Simd>(&self, simd: S, latent: &mut [Lanes], log_density: &mut Lanes) {
        for register in 0..Lanes::n_registers::<S>() {
            let mut log_determinant = simd.splat_f32s(0.0);
            for layer in &self.layers {
                let more = layer.apply(simd, latent, register);
                log_determinant = simd.add_f32s(log_determinant, more);
            }
            // That of the standard normal distribution, times -2.
            let mut normal = simd.splat_f32s(self.n_latent as f32 * LN_TAU);
            for z in latent.iter() {
                let z = z.get::<S>(register);
                normal = simd.add_f32s(normal, simd.mul_f32s(z, z));
            }
            let half = simd.mul_f32s(normal, simd.splat_f32s(0.5));
            log_density.set::<S>(register, simd.sub_f32s(log_determinant, half));
        }
    }
}

impl Radial {
    /// Moves the latents of one register; returns the logarithm of the Jacobian's determinant.
    #[inline(always)]
    fn apply<S: Simd>(&self, simd: S, latent: &mut [Lanes], register: usize) -> S::f32s {
        let real = |value: f32| simd.splat_f32s(value);
        let mut squares = real(0.0);
        for (z, centre) in latent.iter().zip(&self.centre) {
            let off = simd.sub_f32s(z.get::<S>(register), real(*centre));
            squares = simd.add_f32s(squares, simd.mul_f32s(off, off));
        }
        let h = simd.div_f32s(real(1.0), simd.add_f32s(real(self.a), simd.sqrt_f32s(squares)));
        let bh = simd.mul_f32s(real(self.b), h);
        for (z, centre) in latent.iter_mut().zip(&self.centre) {
            let here = z.get::<S>(register);
            let step = simd.mul_f32s(bh, simd.sub_f32s(here, real(*centre)));
            z.set::<S>(register, simd.add_f32s(here, step));
        }
        // Across the radius 1 + b h, along it 1 + b h - b r h^2 = 1 + a b h^2.
        let across = ln(simd, simd.add_f32s(real(1.0), bh));
        let along = simd.add_f32s(real(1.0), simd.mul_f32s(simd.mul_f32s(real(self.a), bh), h));
        simd.add_f32s(simd.mul_f32s(real(latent.len() as f32 - 1.0), across), ln(simd, along))
    }
}

fn softplus(x: f64) -> f64 {
    x.max(0.0) + libm::log1p(libm::exp(-x.abs()))
}
