//! The perturbed control sequences.
//!
//! Noise is white or a stationary first-order Gauss-Markov sequence, on the controls or on their rates; the sampled
//! controls are brought within the limits before they are used, so that what is rolled out is what is averaged.
//! Rollout 0 is the nominal sequence itself.

use crate::chunk::Chunk;
use crate::diagnostics::CostTerm;
use crate::kernel::functions::Generator;
use crate::kernel::{self, CHUNK, Kernel, Work};
use bicycle::lanes::Instructions;

/// Speed and steering angle.
pub(crate) type Control = [f32; 2];

/// What the samples of one step are made of.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SampleStep {
    /// Nominal control.
    pub(crate) nominal: Control,
    /// Where the noise is added: the nominal control, or for rates its change in this step.
    pub(crate) base: Control,
    /// Standard deviation of what is new in the noise of this step.
    pub(crate) innovation: Control,
    /// Cost of a unit of deviation from the nominal control [s].
    pub(crate) gradient: Control,
}

/// Everything that the sampling of one iteration needs.
#[derive(Clone, Copy)]
pub(crate) struct Sampler<'a> {
    pub(crate) steps: &'a [SampleStep],
    /// Share of the noise that stays from step to step.
    pub(crate) kept_noise: Control,
    /// 1 when the noise is on rates, 0 when it is on controls.
    pub(crate) kept_control: f32,
    /// Bounds of the controls.
    pub(crate) low: Control,
    pub(crate) high: Control,
    /// Largest change in a step; infinite when the actuators are taken to be instant.
    pub(crate) change: Control,
    /// Control before the first step.
    pub(crate) start: Control,
    pub(crate) key: [u32; 4],
}

impl Sampler<'_> {
    /// Whether every step can be sampled for itself.
    fn is_independent(&self) -> bool {
        self.kept_noise == [0.0; 2] && self.kept_control == 0.0 && self.change == [f32::INFINITY; 2]
    }

    /// Gradients times nominal controls [s].
    fn nominal_cost(&self) -> f64 {
        let of_step = |step: &SampleStep| -> f64 {
            (0..2).map(|c| f64::from(step.gradient[c]) * f64::from(step.nominal[c])).sum()
        };
        self.steps.iter().map(of_step).sum()
    }
}

/// Samples the controls of chunk number `index`.
pub(crate) struct Sample<'a> {
    pub(crate) sampler: &'a Sampler<'a>,
    pub(crate) index: usize,
    pub(crate) chunk: &'a mut Chunk,
}

impl Sample<'_> {
    pub(crate) fn on(self, instructions: Instructions) {
        kernel::run(instructions, self);
    }
}

impl Work for Sample<'_> {
    type Output = ();
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        for first in (0..CHUNK).step_by(K::WIDTH) {
            let number = (self.index * CHUNK + first) as u32;
            let generator = Generator::new(kernel, self.sampler.key, number);
            if self.sampler.is_independent() {
                sample_pack::<K, true>(generator, self.sampler, self.chunk, first);
            } else {
                sample_pack::<K, false>(generator, self.sampler, self.chunk, first);
            }
        }
        if self.index == 0 {
            plant_nominal(self.sampler, self.chunk);
        }
    }
}

#[inline(always)]
fn sample_pack<K: Kernel, const INDEPENDENT: bool>(
    mut generator: Generator<K>,
    sampler: &Sampler<'_>,
    chunk: &mut Chunk,
    first: usize,
) {
    let kernel = generator.kernel();
    let all = |values: Control| values.map(|value| kernel.real(f64::from(value)));
    let (low, high, change) = (all(sampler.low), all(sampler.high), all(sampler.change));
    let (kept_noise, kept_control) = (all(sampler.kept_noise), kernel.real(f64::from(sampler.kept_control)));
    let mut noise = [kernel.real(0.0); 2];
    let mut control = all(sampler.start);
    let mut cost = kernel.real(-sampler.nominal_cost());
    for (step, rows) in sampler.steps.iter().zip(&mut chunk.controls) {
        let fresh = generator.normals();
        for c in 0..2 {
            let base = kernel.real(f64::from(step.base[c]));
            let innovation = kernel.real(f64::from(step.innovation[c]));
            let sampled = if INDEPENDENT {
                fresh[c].mul_add(innovation, base)
            } else {
                noise[c] = noise[c].mul_add(kept_noise[c], fresh[c] * innovation);
                let wished = control[c].mul_add(kept_control, base + noise[c]);
                wished.clamp(control[c] - change[c], control[c] + change[c])
            };
            control[c] = sampled.clamp(low[c], high[c]);
            cost = control[c].mul_add(kernel.real(f64::from(step.gradient[c])), cost);
            kernel.store(&mut rows[c], first, control[c].1);
        }
    }
    kernel.store(&mut chunk.terms[CostTerm::Control as usize], first, cost.1);
}

/// Puts the unperturbed sequence in the place of the first rollout.
fn plant_nominal(sampler: &Sampler<'_>, chunk: &mut Chunk) {
    let mut control = sampler.start;
    let mut cost = 0.0;
    for (step, rows) in sampler.steps.iter().zip(&mut chunk.controls) {
        for c in 0..2 {
            let reachable = [control[c] - sampler.change[c], control[c] + sampler.change[c]];
            let wished = step.nominal[c].max(reachable[0]).min(reachable[1]);
            control[c] = wished.max(sampler.low[c]).min(sampler.high[c]);
            cost += (control[c] - step.nominal[c]) * step.gradient[c];
            rows[c].0[0] = control[c];
        }
    }
    chunk.terms[CostTerm::Control as usize].0[0] = cost;
}

#[cfg(test)]
mod tests;
