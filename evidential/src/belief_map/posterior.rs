//! Posterior of a block of footprints and its CVaR, in lanes (PIETRA, equations 6 and 11).
//!
//! The posterior's mean is a mixture of the prior's distribution and the networks'. Partial moments mix the same way
//! (see [`traversability::PartialMoments`]), so no posterior distribution is ever built.

use bicycle::lanes::Block;
use pulp::Simd;
use traversability::{Bins, N_BINS};

/// What CVaR is taken of: a mixture of two distributions.
#[derive(Clone, Copy)]
pub(super) struct Mixture<'a> {
    /// Of the prior.
    pub moments: &'a [Block; N_BINS],
    /// Of the networks.
    pub probabilities: &'a [Block; N_BINS],
    /// Share of the networks.
    pub share: &'a Block,
}

/// Share of the networks in the posterior, s n / (n_prior + s n).
#[inline(always)]
pub(super) fn learned_share<S: Simd>(simd: S, evidence: &Block, prior_evidence: f32) -> Block {
    let mut share = Block::ZERO;
    for register in 0..Block::n_registers::<S>() {
        let evidence = evidence.get::<S>(register);
        let total = simd.add_f32s(simd.splat_f32s(prior_evidence), evidence);
        share.set::<S>(register, simd.div_f32s(evidence, total));
    }
    share
}

impl Mixture<'_> {
    /// CVaR of traction from the left: the largest v - E[(v - Z)^+] / level.
    #[inline(always)]
    pub fn traction_cvar<S: Simd>(&self, simd: S, per_level: f32) -> Block {
        let values = Bins::TRACTION.values();
        let mut cvar = Block::ZERO;
        for register in 0..Block::n_registers::<S>() {
            let (mut mass, mut moment) = (simd.splat_f32s(0.0), simd.splat_f32s(0.0));
            let mut best = simd.splat_f32s(values[0]);
            for bin in 1..N_BINS {
                let more = self.probabilities[bin - 1].get::<S>(register);
                mass = simd.add_f32s(mass, more);
                let step = simd.splat_f32s(values[bin] - values[bin - 1]);
                moment = simd.add_f32s(moment, simd.mul_f32s(mass, step));
                let mixed = self.mixed(simd, register, bin, moment);
                let below = simd.mul_f32s(simd.splat_f32s(per_level), mixed);
                best = simd.max_f32s(best, simd.sub_f32s(simd.splat_f32s(values[bin]), below));
            }
            cvar.set::<S>(register, best);
        }
        cvar
    }

    /// CVaR of an angle from the right, the smallest v + E[(Z - v)^+] / level [rad].
    #[inline(always)]
    pub fn angle_cvar_rad<S: Simd>(&self, simd: S, per_level: f32) -> Block {
        let values = Bins::ATTITUDE.values();
        let mut cvar = Block::ZERO;
        for register in 0..Block::n_registers::<S>() {
            let (mut mass, mut moment) = (simd.splat_f32s(0.0), simd.splat_f32s(0.0));
            let mut best = simd.splat_f32s(values[N_BINS - 1]);
            for bin in (0..N_BINS - 1).rev() {
                let more = self.probabilities[bin + 1].get::<S>(register);
                mass = simd.add_f32s(mass, more);
                let step = simd.splat_f32s(values[bin + 1] - values[bin]);
                moment = simd.add_f32s(moment, simd.mul_f32s(mass, step));
                let mixed = self.mixed(simd, register, bin, moment);
                let above = simd.mul_f32s(simd.splat_f32s(per_level), mixed);
                best = simd.min_f32s(best, simd.add_f32s(simd.splat_f32s(values[bin]), above));
            }
            cvar.set::<S>(register, best);
        }
        cvar
    }

    #[inline(always)]
    fn mixed<S: Simd>(&self, simd: S, register: usize, bin: usize, learned: S::f32s) -> S::f32s {
        let prior = self.moments[bin].get::<S>(register);
        let share = self.share.get::<S>(register);
        let rest = simd.sub_f32s(simd.splat_f32s(1.0), share);
        simd.add_f32s(simd.mul_f32s(prior, rest), simd.mul_f32s(learned, share))
    }
}
