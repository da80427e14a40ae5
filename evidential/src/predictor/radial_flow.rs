//! Density of latents under stacked radial flows (NOTES 1.1).
#![allow(clippy::needless_range_loop, reason = "arithmetic in registers: one index over several arrays")]

use bicycle::lanes::Block;
use pulp::Simd;

use super::lanes::ln;

/// Registers that go through a layer together: each waits for its sums, a root and a quotient.
const IN_FLIGHT: usize = 3;
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
    pub fn log_density<S: Simd>(&self, simd: S, latent: &mut [Block], log_density: &mut Block) {
        for start in (0..Block::n_registers::<S>()).step_by(IN_FLIGHT) {
            let mut log_determinant = [simd.splat_f32s(0.0); IN_FLIGHT];
            for layer in &self.layers {
                layer.apply(simd, latent, start, &mut log_determinant);
            }
            // That of the standard normal distribution, times -2.
            let mut normal = [simd.splat_f32s(self.n_latent as f32 * LN_TAU); IN_FLIGHT];
            for z in latent.iter() {
                for k in 0..IN_FLIGHT {
                    let z = z.get::<S>(start + k);
                    normal[k] = simd.add_f32s(normal[k], simd.mul_f32s(z, z));
                }
            }
            for k in 0..IN_FLIGHT {
                let half = simd.mul_f32s(normal[k], simd.splat_f32s(0.5));
                log_density.set::<S>(start + k, simd.sub_f32s(log_determinant[k], half));
            }
        }
    }
}

impl Radial {
    /// Moves the latents of some registers and adds the logarithms of the Jacobian's determinants.
    #[inline(always)]
    fn apply<S: Simd>(
        &self,
        simd: S,
        latent: &mut [Block],
        start: usize,
        log_determinant: &mut [S::f32s; IN_FLIGHT],
    ) {
        let real = |value: f32| simd.splat_f32s(value);
        let mut squares = [real(0.0); IN_FLIGHT];
        for (z, centre) in latent.iter().zip(&self.centre) {
            let centre = real(*centre);
            for k in 0..IN_FLIGHT {
                let off = simd.sub_f32s(z.get::<S>(start + k), centre);
                squares[k] = simd.add_f32s(squares[k], simd.mul_f32s(off, off));
            }
        }
        let mut bh = [real(0.0); IN_FLIGHT];
        for k in 0..IN_FLIGHT {
            let h = simd.div_f32s(real(1.0), simd.add_f32s(real(self.a), simd.sqrt_f32s(squares[k])));
            bh[k] = simd.mul_f32s(real(self.b), h);
            // Across the radius 1 + b h, along it 1 + b h - b r h^2 = 1 + a b h^2.
            let across = ln(simd, simd.add_f32s(real(1.0), bh[k]));
            let along = simd.add_f32s(real(1.0), simd.mul_f32s(simd.mul_f32s(real(self.a), bh[k]), h));
            let of_across = simd.mul_f32s(real(latent.len() as f32 - 1.0), across);
            let more = simd.add_f32s(of_across, ln(simd, along));
            log_determinant[k] = simd.add_f32s(log_determinant[k], more);
        }
        for (z, centre) in latent.iter_mut().zip(&self.centre) {
            let centre = real(*centre);
            for k in 0..IN_FLIGHT {
                let here = z.get::<S>(start + k);
                let step = simd.mul_f32s(bh[k], simd.sub_f32s(here, centre));
                z.set::<S>(start + k, simd.add_f32s(here, step));
            }
        }
    }
}

fn softplus(x: f64) -> f64 {
    x.max(0.0) + libm::log1p(libm::exp(-x.abs()))
}
