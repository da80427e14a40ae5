//! What the benchmark found, in numbers.

use evidential::{Architecture, Settings};
use serde::Serialize;

use super::metric::N_GROUPS;
use super::tally::{Domain, N_UNEVENNESS, Tally};
use super::{Chosen, EvidenceReport, Row, TestbedReport};
use crate::Verdict;

const N_HEADS: usize = Architecture::N_HEADS;

/// Mean and standard deviation over the seeds; NaN (null in JSON) where nothing was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanDeviation {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the sample; 0 for one seed, and for priors, which have none.
    pub deviation: f64,
}

impl MeanDeviation {
    pub(super) fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
        Self { mean, deviation: (squares / (n - 1.0).max(1.0)).sqrt() }
    }
}

/// Everything.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was driven.
    pub testbed: TestbedReport,
    /// Seeds of the trainings.
    pub n_seeds: u64,
    /// Where the parameters of the methods come from.
    pub chosen: Chosen,
    /// The parameters, of the first seed.
    pub settings: Vec<Settings>,
    /// All rows, in the order of [`Row::ALL`].
    pub rows: Vec<RowReport>,
    /// An upper bound of the irreducible error per parameter, overall, in and out of distribution: that of networks
    /// trained without evidence on all ground of other maps of the test's kind, mean over the seeds.
    pub achievable: [[f64; N_HEADS]; 3],
    /// The bins of figure 6.
    pub unevenness_bins: Vec<UnevennessBin>,
    /// What evidence there is, per method that has any.
    pub evidence: Vec<EvidenceReport>,
    /// The rules, and whether they hold.
    pub verdicts: Vec<Verdict>,
}

/// A bin of figure 6.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UnevennessBin {
    /// Lower edge [m].
    pub low_m: f32,
    /// Upper edge [m]; the last bin holds all that is more uneven too.
    pub high_m: f32,
    /// Test footprints.
    pub n: usize,
}

/// One row of the tables, with everything else that was found of it.
#[derive(Clone, Debug, Serialize)]
pub struct RowReport {
    /// Which.
    pub row: Row,
    /// All of the test.
    pub overall: DomainReport,
    /// Its even ground.
    pub in_distribution: DomainReport,
    /// Its uneven ground.
    pub out_of_distribution: DomainReport,
    /// Figure 6: the error in every bin of unevenness.
    pub curve: Vec<CurvePoint>,
    /// Published EMD2, overall, in and out of distribution; another unit.
    pub published: [f64; 3],
    /// Published ratios to the uniform prior.
    pub published_ratios: [f64; 3],
}

/// A row's errors and calibration in one domain.
#[derive(Clone, Debug, Serialize)]
pub struct DomainReport {
    /// EMD2 summed over the parameters [squared bins].
    pub total: MeanDeviation,
    /// EMD2 per parameter.
    pub heads: [MeanDeviation; N_HEADS],
    /// Total over that of the uniform prior.
    pub ratio_to_uniform: f64,
    /// EMD2 beyond the best achievable, per parameter; an estimate from below.
    pub excess: [f64; N_HEADS],
    /// Calibration per parameter; none for all of the test.
    pub calibration: Option<CalibrationReport>,
}

/// Calibration of a row in one domain.
#[derive(Clone, Debug, Serialize)]
pub struct CalibrationReport {
    /// Per parameter.
    pub heads: [HeadCalibration; N_HEADS],
}

/// Calibration of one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct HeadCalibration {
    /// Shares of the randomised probability integral transforms in tenths of their range, mean over the seeds; a
    /// calibrated prediction has 0.1 in each.
    pub transforms: [f64; N_GROUPS],
    /// Expected calibration error of the CDF: |predicted - observed| of the events "in bin k or below".
    pub expected_error: MeanDeviation,
}

/// A point of figure 6: EMD2 summed over the parameters.
pub type CurvePoint = MeanDeviation;

impl Report {
    /// A row by its name.
    pub fn row(&self, row: Row) -> &RowReport {
        &self.rows[row.place()]
    }

    /// Evidence of a row; `None` if it has none.
    pub fn evidence_of(&self, row: Row) -> Option<&EvidenceReport> {
        self.evidence.iter().find(|evidence| evidence.row == row)
    }
}

/// What a row is compared with, per domain: overall, in and out of distribution.
pub(super) struct Reference {
    pub uniform: [f64; 3],
    pub achievable: [[f64; N_HEADS]; 3],
}

/// Errors per parameter: overall, in and out of distribution.
pub(super) fn domain_errors(tally: &Tally) -> [[f64; N_HEADS]; 3] {
    [tally.overall_errors(), tally.errors(Domain::InDistribution), tally.errors(Domain::OutOfDistribution)]
}

/// One row from the tallies of its seeds.
pub(super) fn row_report(row: Row, tallies: &[&Tally], reference: &Reference) -> RowReport {
    let domain = |place: usize| domain_report(place, tallies, reference);
    let curve = (0..N_UNEVENNESS).map(|bin| MeanDeviation::of(tallies.iter().map(|t| t.bin_error(bin))));
    RowReport {
        row,
        overall: domain(0),
        in_distribution: domain(1),
        out_of_distribution: domain(2),
        curve: curve.collect(),
        published: row.published(),
        published_ratios: row.published_ratios(),
    }
}

fn domain_report(place: usize, tallies: &[&Tally], reference: &Reference) -> DomainReport {
    let errors: Vec<[f64; N_HEADS]> = tallies.iter().map(|tally| domain_errors(tally)[place]).collect();
    let total = MeanDeviation::of(errors.iter().map(|heads| heads.iter().sum()));
    let heads: [MeanDeviation; N_HEADS] =
        std::array::from_fn(|head| MeanDeviation::of(errors.iter().map(|heads| heads[head])));
    DomainReport {
        total,
        heads,
        ratio_to_uniform: total.mean / reference.uniform[place],
        excess: std::array::from_fn(|head| heads[head].mean - reference.achievable[place][head]),
        calibration: [None, Some(Domain::InDistribution), Some(Domain::OutOfDistribution)][place]
            .map(|domain| calibration_report(domain, tallies)),
    }
}

fn calibration_report(domain: Domain, tallies: &[&Tally]) -> CalibrationReport {
    let head = |head: usize| {
        let calibrations = || tallies.iter().map(|tally| tally.calibration(domain, head));
        let histograms: Vec<_> = calibrations().map(|calibration| calibration.histogram()).collect();
        let mean = |tenth: usize| histograms.iter().map(|h| h[tenth]).sum::<f64>() / histograms.len() as f64;
        let errors: Vec<f64> = calibrations().map(|calibration| calibration.expected_error()).collect();
        HeadCalibration {
            transforms: std::array::from_fn(mean),
            expected_error: MeanDeviation::of(errors.into_iter()),
        }
    };
    CalibrationReport { heads: std::array::from_fn(head) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviation_is_that_of_a_sample_and_none_of_one() {
        let two = MeanDeviation::of([1.0, 3.0].into_iter());
        assert_eq!((two.mean, two.deviation), (2.0, 2f64.sqrt()));
        let one = MeanDeviation::of([4.0].into_iter());
        assert_eq!((one.mean, one.deviation), (4.0, 0.0));
    }
}
