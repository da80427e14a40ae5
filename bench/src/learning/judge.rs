//! From trained networks to the report.

use bicycle::lanes::Instructions;
use evidential::{Architecture, Dataset, Example, Method, Prediction, Predictor, Prior, Sidecar};
use rayon::prelude::*;
use traversability::N_BINS;

use super::evidence::{Weights, ground_evidence, weights};
use super::metric::Probabilities;
use super::report::{Reference, domain_errors, row_report};
use super::tally::{Case, N_UNEVENNESS, Tally, UnevennessBins, cases};
use super::verdict::verdicts;
use super::{
    Absurd, EvidenceReport, Ground, LearningError, Plan, Report, Row, Subject, Testbed, Trained,
    UnevennessBin,
};

const N_HEADS: usize = Architecture::N_HEADS;

/// What one training, or a prior, comes to.
struct Judged {
    subject: Subject,
    tallies: Vec<(Row, Tally)>,
    weights: Vec<(Row, Ground, Vec<Weights>)>,
}

/// The test as it is judged.
struct Test<'a> {
    testbed: &'a Testbed,
    cases: Vec<Case>,
    absurd: Vec<(Absurd, Vec<Vec<f32>>)>,
}

/// Judges all that was trained by a plan, on `n_threads`; the result does not depend on them.
///
/// # Errors
/// Networks that cannot be used.
pub fn judge(
    testbed: &Testbed,
    plan: &Plan,
    trained: &[Trained],
    n_threads: usize,
) -> Result<Report, LearningError> {
    let bins = UnevennessBins::of(&testbed.test);
    let test = Test::new(testbed, &bins);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
    let networks: Vec<Judged> =
        pool.install(|| trained.par_iter().map(|trained| test.judge(trained)).collect::<Result<_, _>>())?;
    let judged: Vec<Judged> = networks.into_iter().chain([test.judge_priors()]).collect();
    let of_row = |row: Row| -> Vec<&Tally> { tallies(&judged, Subject::Tables, row).collect() };
    let reference = Reference {
        uniform: domain_errors(of_row(Row::UniformPrior)[0]).map(|heads| heads.iter().sum()),
        achievable: achievable(&judged),
    };
    let mut report = Report {
        testbed: testbed.report(),
        n_seeds: plan.n_seeds,
        chosen: plan.chosen(testbed),
        settings: plan.settings_of_the_first_seed(),
        rows: Row::ALL.map(|row| row_report(row, &of_row(row), &reference)).into(),
        achievable: reference.achievable,
        unevenness_bins: unevenness_bins(&bins, &test.cases),
        evidence: evidence(&judged, plan.n_seeds as usize),
        verdicts: Vec::new(),
    };
    report.verdicts = verdicts(&report);
    Ok(report)
}

fn tallies(judged: &[Judged], subject: Subject, row: Row) -> impl Iterator<Item = &Tally> {
    let of_subject = judged.iter().filter(move |judged| judged.subject == subject);
    of_subject.flat_map(|judged| &judged.tallies).filter(move |(of, _)| *of == row).map(|(_, tally)| tally)
}

/// Mean over the seeds, per domain and parameter.
fn achievable(judged: &[Judged]) -> [[f64; N_HEADS]; 3] {
    let errors: Vec<_> = tallies(judged, Subject::Achievable, Row::Vanilla).map(domain_errors).collect();
    let mean = |domain: usize, head: usize| {
        errors.iter().map(|errors| errors[domain][head]).sum::<f64>() / errors.len() as f64
    };
    std::array::from_fn(|domain| std::array::from_fn(|head| mean(domain, head)))
}

fn unevenness_bins(bins: &UnevennessBins, cases: &[Case]) -> Vec<UnevennessBin> {
    let bin = |bin: usize| {
        let [low_m, high_m] = bins.edges_m(bin);
        UnevennessBin { low_m, high_m, n: cases.iter().filter(|case| case.unevenness_bin == bin).count() }
    };
    (0..N_UNEVENNESS).map(bin).collect()
}

fn evidence(judged: &[Judged], n_seeds: usize) -> Vec<EvidenceReport> {
    let uneven = (0..N_UNEVENNESS).map(Ground::Uneven);
    let grounds: Vec<Ground> = [Ground::Validation, Ground::InDistribution]
        .into_iter()
        .chain(uneven)
        .chain(Absurd::ALL.map(Ground::Absurd))
        .collect();
    let on = |row: Row, ground: Ground| {
        let gathered = judged.iter().flat_map(|judged| &judged.weights);
        let gathered = gathered.filter(|(of, on, _)| *of == row && *on == ground);
        let weights: Vec<Weights> = gathered.flat_map(|(_, _, weights)| weights).copied().collect();
        ground_evidence(ground, n_seeds, &weights)
    };
    let has_evidence = |row: &Row| row.method().is_some_and(Method::is_evidential) && *row != Row::Switch;
    let rows = Row::ALL.into_iter().filter(has_evidence);
    rows.map(|row| EvidenceReport { row, grounds: grounds.iter().map(|&ground| on(row, ground)).collect() })
        .collect()
}

impl<'a> Test<'a> {
    fn new(testbed: &'a Testbed, bins: &UnevennessBins) -> Self {
        let absurd = |absurd: Absurd| (absurd, absurd.footprints(&testbed.test, testbed.unevenness_max_m));
        Self {
            testbed,
            cases: cases(&testbed.test, testbed.unevenness_max_m, bins),
            absurd: Absurd::ALL.map(absurd).into(),
        }
    }

    fn judge(&self, trained: &Trained) -> Result<Judged, LearningError> {
        let refused =
            |source| LearningError::Prediction { training: trained.planned.name(), source: Box::new(source) };
        let sidecar = &trained.checkpoint.sidecar;
        let predictor = Predictor::new(&trained.checkpoint, Instructions::widest()).map_err(refused)?;
        let predictions = predictor.predict(&features(&self.testbed.test)).map_err(refused)?;
        let rows = Row::ALL.into_iter().filter(|row| row.method() == Some(sidecar.method));
        let tally = |row: Row| {
            let mut tally = Tally::default();
            for ((example, case), prediction) in
                self.testbed.test.examples.iter().zip(&self.cases).zip(&predictions)
            {
                tally.add(case, &predicted(row, example, prediction, sidecar));
            }
            (row, tally)
        };
        let tallies = rows.map(tally).collect();
        let weights = self.weights(&predictor, sidecar, &predictions).map_err(refused)?;
        Ok(Judged { subject: trained.planned.subject, tallies, weights })
    }

    /// Weights of what was learned on all kinds of ground; none without evidence.
    fn weights(
        &self,
        predictor: &Predictor,
        sidecar: &Sidecar,
        predictions: &[Prediction],
    ) -> Result<Vec<(Row, Ground, Vec<Weights>)>, evidential::PredictorError> {
        let rows = Row::ALL.into_iter().filter(|row| *row != Row::Switch);
        let Some(row) = rows.into_iter().find(|row| row.method() == Some(sidecar.method)) else {
            return Ok(Vec::new());
        };
        let Some(density) = &sidecar.density else { return Ok(Vec::new()) };
        let weight = |prediction: &Prediction| {
            prediction.evidence.map(|evidence| weights(&evidence, density, sidecar.prior.evidence))
        };
        let on_test = |is_there: &dyn Fn(&Case) -> bool| -> Vec<Weights> {
            let there = self.cases.iter().zip(predictions).filter(|(case, _)| is_there(case));
            there.filter_map(|(_, prediction)| weight(prediction)).collect()
        };
        let validation = predictor.predict(&features(&self.testbed.validation))?;
        let mut gathered = vec![
            (row, Ground::Validation, validation.iter().filter_map(weight).collect()),
            (row, Ground::InDistribution, on_test(&|case| case.domain == super::Domain::InDistribution)),
        ];
        for bin in 0..N_UNEVENNESS {
            gathered.push((row, Ground::Uneven(bin), on_test(&|case| case.unevenness_bin == bin)));
        }
        for (absurd, footprints) in &self.absurd {
            let predictions = predictor.predict(footprints)?;
            gathered.push((row, Ground::Absurd(*absurd), predictions.iter().filter_map(weight).collect()));
        }
        Ok(gathered)
    }

    fn judge_priors(&self) -> Judged {
        let tally = |row: Row, of: &dyn Fn(&Example) -> [Probabilities; N_HEADS]| {
            let mut tally = Tally::default();
            for (example, case) in self.testbed.test.examples.iter().zip(&self.cases) {
                tally.add(case, &of(example));
            }
            (row, tally)
        };
        let tallies =
            vec![tally(Row::PhysicsPrior, &physics_prior), tally(Row::UniformPrior, &|_| [UNIFORM; N_HEADS])];
        Judged { subject: Subject::Tables, tallies, weights: Vec::new() }
    }
}

fn features(dataset: &Dataset) -> Vec<&[f32]> {
    dataset.examples.iter().map(|example| example.features.as_slice()).collect()
}

const UNIFORM: Probabilities = [1.0 / N_BINS as f64; N_BINS];

fn physics_prior(example: &Example) -> [Probabilities; N_HEADS] {
    example.prior.map(|pmf| pmf.map(f64::from))
}

/// What a row expects at an example: the mean of its posterior (equation 11), or the prediction of its networks.
fn predicted(
    row: Row,
    example: &Example,
    prediction: &Prediction,
    sidecar: &Sidecar,
) -> [Probabilities; N_HEADS] {
    let learned = prediction.pmfs.map(|pmf| pmf.probabilities().map(f64::from));
    let physics = physics_prior(example);
    if row == Row::Switch {
        let is_familiar = prediction
            .evidence
            .zip(sidecar.density)
            .is_some_and(|(evidence, density)| f64::from(evidence.log_density) >= density.min);
        return if is_familiar { learned } else { physics };
    }
    let prior = match sidecar.method.prior() {
        Prior::Physics => physics,
        Prior::Uniform => [UNIFORM; N_HEADS],
        Prior::None => return learned,
    };
    let Some(evidence) = prediction.evidence else { return learned };
    std::array::from_fn(|head| {
        let count = f64::from(evidence.counts[head]);
        let share = count / (count + sidecar.prior.evidence);
        std::array::from_fn(|bin| (1.0 - share) * prior[head][bin] + share * learned[head][bin])
    })
}
