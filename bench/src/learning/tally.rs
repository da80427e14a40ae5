//! What adds up as examples are judged: errors by domain and by unevenness, and calibration.

use evidential::{Architecture, Dataset, PARAMETER_BINS};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use super::metric::{Calibration, Cdf, Probabilities};

const N_HEADS: usize = Architecture::N_HEADS;
/// Seed of what the transforms of the calibration are drawn with, the same for every prediction.
const SHARE_SEED: u64 = 0x9117;
/// Bins of unevenness.
pub(super) const N_UNEVENNESS: usize = 9;
/// The bins end where this share of the test footprints lies below; the last holds the rest too.
const SHOWN_SHARE: f64 = 0.99;

/// Whether ground is like that of the training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Domain {
    /// Not more uneven than half of the training drives.
    InDistribution,
    /// More uneven.
    OutOfDistribution,
}

/// Bins of equal width from level ground up.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct UnevennessBins {
    width_m: f32,
}

impl UnevennessBins {
    pub fn of(test: &Dataset) -> Self {
        Self { width_m: test.unevenness_quantile_m(SHOWN_SHARE) / N_UNEVENNESS as f32 }
    }

    pub fn edges_m(&self, bin: usize) -> [f32; 2] {
        [bin as f32, bin as f32 + 1.0].map(|edge| edge * self.width_m)
    }

    fn bin_of(&self, unevenness_m: f32) -> usize {
        ((unevenness_m / self.width_m) as usize).min(N_UNEVENNESS - 1)
    }
}

/// One example as it is judged.
pub(super) struct Case {
    pub domain: Domain,
    pub unevenness_bin: usize,
    /// Bin of each measurement.
    pub measured: [Option<usize>; N_HEADS],
    shares: [f64; N_HEADS],
}

/// All examples of a test.
pub(super) fn cases(test: &Dataset, unevenness_max_m: f32, bins: &UnevennessBins) -> Vec<Case> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(SHARE_SEED);
    let case = |example: &evidential::Example| Case {
        domain: match example.unevenness_m <= unevenness_max_m {
            true => Domain::InDistribution,
            false => Domain::OutOfDistribution,
        },
        unevenness_bin: bins.bin_of(example.unevenness_m),
        measured: std::array::from_fn(|head| PARAMETER_BINS[head].bin_of(example.measured[head])),
        shares: std::array::from_fn(|_| rng.random()),
    };
    test.examples.iter().map(case).collect()
}

/// A mean that grows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Mean {
    sum: f64,
    n: u64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.n += 1;
    }

    /// NaN of nothing.
    pub fn value(self) -> f64 {
        self.sum / self.n as f64
    }

    fn with(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, n: self.n + other.n }
    }
}

/// Errors and calibration of one row and seed.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    errors: [[Mean; N_HEADS]; 2],
    by_unevenness: [[Mean; N_HEADS]; N_UNEVENNESS],
    calibrations: [[Calibration; N_HEADS]; 2],
}

impl Tally {
    pub fn add(&mut self, case: &Case, predicted: &[Probabilities; N_HEADS]) {
        let domain = case.domain as usize;
        for (head, probabilities) in predicted.iter().enumerate() {
            let Some(measured) = case.measured[head] else { continue };
            let cdf = Cdf::of(probabilities);
            let error = cdf.emd2(measured);
            self.errors[domain][head].add(error);
            self.by_unevenness[case.unevenness_bin][head].add(error);
            self.calibrations[domain][head].add(&cdf, measured, case.shares[head]);
        }
    }

    /// Mean error per parameter in a domain.
    pub fn errors(&self, domain: Domain) -> [f64; N_HEADS] {
        self.errors[domain as usize].map(Mean::value)
    }

    /// Mean error per parameter over all examples.
    pub fn overall_errors(&self) -> [f64; N_HEADS] {
        std::array::from_fn(|head| self.errors[0][head].with(self.errors[1][head]).value())
    }

    /// Error of an unevenness bin, summed over the parameters.
    pub fn bin_error(&self, bin: usize) -> f64 {
        self.by_unevenness[bin].iter().map(|mean| mean.value()).sum()
    }

    pub fn calibration(&self, domain: Domain, head: usize) -> &Calibration {
        &self.calibrations[domain as usize][head]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_go_to_their_domain_and_missing_measurements_to_none() {
        let uniform = [[1.0 / 12.0; 12]; N_HEADS];
        let case = |domain, unevenness_bin, first: Option<usize>| Case {
            domain,
            unevenness_bin,
            measured: [first, None, Some(5), Some(5)],
            shares: [0.5; N_HEADS],
        };
        let mut tally = Tally::default();
        tally.add(&case(Domain::InDistribution, 0, Some(0)), &uniform);
        tally.add(&case(Domain::OutOfDistribution, 3, Some(5)), &uniform);
        tally.add(&case(Domain::OutOfDistribution, 3, None), &uniform);
        let [outer, middle] = [506.0 / 144.0, 146.0 / 144.0];
        let near =
            |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        near(tally.errors(Domain::InDistribution)[0], outer);
        near(tally.errors(Domain::OutOfDistribution)[0], middle);
        near(tally.overall_errors()[0], 0.5 * (outer + middle));
        near(tally.overall_errors()[2], middle);
        assert!(tally.overall_errors()[1].is_nan() && tally.bin_error(0).is_nan());
    }

    #[test]
    fn the_last_bin_of_unevenness_has_no_upper_end() {
        let bins = UnevennessBins { width_m: 0.05 };
        assert_eq!([0.0, 0.049, 0.051, 0.44, 9.0].map(|u| bins.bin_of(u)), [0, 0, 1, 8, 8]);
        assert_eq!(bins.edges_m(2), [2.0 * 0.05, 3.0 * 0.05]);
    }
}
