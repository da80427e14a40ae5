//! Posterior of a block of footprints and its CVaR, in lanes (PIETRA, equations 6 and 11).
//!
//! The posterior's mean is a mixture of the prior's distribution and the networks'. Partial moments mix the same way
//! (see [`traversability::PartialMoments`]), so no posterior distribution is ever built.

use traversability::{Bins, N_BINS};

use crate::predictor::{Lanes, N_LANES};

/// Share of the networks in the posterior, s n / (n_prior + s n).
#[inline(always)]
pub(super) fn learned_share(evidence: Lanes, prior_evidence: f32) -> Lanes {
    evidence.map(|evidence| evidence / (prior_evidence + evidence))
}

/// CVaR of traction from the left.
///
/// `prior` holds partial moments by bin, `probabilities` the networks' distribution, `share` how much of it counts.
#[inline(always)]
pub(super) fn traction_cvar(
    prior: &[&[f32; N_LANES]; N_BINS],
    probabilities: &[Lanes; N_BINS],
    share: &Lanes,
    per_level: f32,
) -> Lanes {
    let values = Bins::TRACTION.values();
    let (mut mass, mut moment) = (Lanes::ZERO, Lanes::ZERO);
    let mut best = Lanes([values[0]; N_LANES]);
    for bin in 1..N_BINS {
        let step = values[bin] - values[bin - 1];
        for lane in 0..N_LANES {
            mass.0[lane] += probabilities[bin - 1].0[lane];
            moment.0[lane] += mass.0[lane] * step;
            let mixed = mixed(prior[bin][lane], moment.0[lane], share.0[lane]);
            let tail = values[bin] - per_level * mixed;
            best.0[lane] = if tail > best.0[lane] { tail } else { best.0[lane] };
        }
    }
    best
}

/// CVaR of an angle from the right [rad]; see [`traction_cvar`].
#[inline(always)]
pub(super) fn angle_cvar_rad(
    prior: &[&[f32; N_LANES]; N_BINS],
    probabilities: &[Lanes; N_BINS],
    share: &Lanes,
    per_level: f32,
) -> Lanes {
    let values = Bins::ATTITUDE.values();
    let (mut mass, mut moment) = (Lanes::ZERO, Lanes::ZERO);
    let mut best = Lanes([values[N_BINS - 1]; N_LANES]);
    for bin in (0..N_BINS - 1).rev() {
        let step = values[bin + 1] - values[bin];
        for lane in 0..N_LANES {
            mass.0[lane] += probabilities[bin + 1].0[lane];
            moment.0[lane] += mass.0[lane] * step;
            let mixed = mixed(prior[bin][lane], moment.0[lane], share.0[lane]);
            let tail = values[bin] + per_level * mixed;
            best.0[lane] = if tail < best.0[lane] { tail } else { best.0[lane] };
        }
    }
    best
}

#[inline(always)]
fn mixed(prior: f32, learned: f32, share: f32) -> f32 {
    prior * (1.0 - share) + learned * share
}
