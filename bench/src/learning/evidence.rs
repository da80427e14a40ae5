//! How much what was learned weighs against its prior, on familiar ground and beyond.

use evidential::{Architecture, DensityRange, Evidence};
use serde::Serialize;

use super::{Absurd, Row};

const N_HEADS: usize = Architecture::N_HEADS;
/// Logarithms of evidence stay within plus and minus this (NatPN).
const LOG_EVIDENCE_MAX: f64 = 30.0;

/// Ground on which evidence is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// The validation drives over even ground.
    Validation,
    /// The even ground of the test.
    InDistribution,
    /// A bin of unevenness of the test, from 0.
    Uneven(usize),
    /// Even ground of the test with something put into it.
    Absurd(Absurd),
}

impl Ground {
    /// What it is, for people.
    pub fn name(self) -> String {
        match self {
            Self::Validation => "ID, validation".to_owned(),
            Self::InDistribution => "ID, test".to_owned(),
            Self::Uneven(bin) => format!("unevenness bin {}", bin + 1),
            Self::Absurd(absurd) => absurd.name().to_owned(),
        }
    }
}

/// Percentiles of a weight over footprints and seeds; NaN (null in JSON) without footprints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WeightPercentiles {
    /// 5 % lie below.
    pub p05: f64,
    /// Half lies below.
    pub p50: f64,
    /// 95 % lie below.
    pub p95: f64,
}

impl WeightPercentiles {
    /// Nearest rank, without interpolation.
    fn of(mut weights: Vec<f64>) -> Self {
        weights.sort_by(f64::total_cmp);
        let last = weights.len().saturating_sub(1) as f64;
        let at = |share: f64| weights.get((share * last).round() as usize).copied().unwrap_or(f64::NAN);
        Self { p05: at(0.05), p50: at(0.5), p95: at(0.95) }
    }
}

/// Weights of what was learned on one kind of ground.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroundEvidence {
    /// Which ground.
    pub ground: Ground,
    /// Footprints.
    pub n: usize,
    /// n / (n + n_prior).
    pub weight: WeightPercentiles,
    /// s n / (s n + n_prior) of each parameter: its share in the posterior.
    pub heads: [WeightPercentiles; N_HEADS],
}

/// Weights of what a method has learned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EvidenceReport {
    /// The method.
    pub row: Row,
    /// All kinds of ground.
    pub grounds: Vec<GroundEvidence>,
}

impl EvidenceReport {
    /// Weights on one kind of ground.
    pub fn on(&self, ground: Ground) -> Option<&GroundEvidence> {
        self.grounds.iter().find(|evidence| evidence.ground == ground)
    }
}

/// Weight of a footprint: n / (n + n_prior), then s n / (s n + n_prior) of each parameter.
pub(super) type Weights = [f64; 1 + N_HEADS];

/// Weights of an answer of the networks.
pub(super) fn weights(evidence: &Evidence, density: &DensityRange, prior_evidence: f64) -> Weights {
    let log_count = f64::from(evidence.log_density) + density.log_budget;
    let count = log_count.clamp(-LOG_EVIDENCE_MAX, LOG_EVIDENCE_MAX).exp();
    std::array::from_fn(|place| {
        let count = if place == 0 { count } else { f64::from(evidence.counts[place - 1]) };
        count / (count + prior_evidence)
    })
}

/// Percentiles over everything gathered on one kind of ground by all seeds.
pub(super) fn ground_evidence(ground: Ground, n_seeds: usize, weights: &[Weights]) -> GroundEvidence {
    let of = |place: usize| WeightPercentiles::of(weights.iter().map(|weights| weights[place]).collect());
    GroundEvidence {
        ground,
        n: weights.len() / n_seeds.max(1),
        weight: of(0),
        heads: std::array::from_fn(|head| of(1 + head)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_one_half_where_evidence_equals_the_prior() {
        let density = DensityRange { min: -5.0, max: 5.0, log_budget: 2.0 };
        let log_density = 12f32.ln() - 2.0;
        let counts = [12.0, 4.0, 0.0, 36.0];
        let found = weights(&Evidence { log_density, counts }, &density, 12.0);
        for (found, expected) in found.into_iter().zip([0.5, 0.5, 0.25, 0.0, 0.75]) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn percentiles_are_ranks_and_none_of_nothing() {
        let weights: Vec<Weights> = (0..=100).map(|k| [f64::from(k) / 100.0; 5]).collect();
        let found = ground_evidence(Ground::InDistribution, 1, &weights);
        assert_eq!((found.n, found.weight), (101, WeightPercentiles { p05: 0.05, p50: 0.5, p95: 0.95 }));
        assert!(ground_evidence(Ground::Validation, 1, &[]).heads[3].p50.is_nan());
    }
}
