use super::*;
use candle_core::{Device, Var};

const N_ROWS: usize = 3;

fn terms(prior: Prior) -> LossTerms {
    LossTerms { prior, prior_evidence: 12.0, log_budget: 1.5, physics_weight: 0.3, entropy_weight: 0.01 }
}

/// Any numbers between -1 and 1.
fn wild(k: usize) -> f32 {
    ((k as f32 * 12.9898).sin() * 43_758.547).fract()
}

fn outputs(prior: Prior) -> Vec<f32> {
    let width = if matches!(prior, Prior::None) { N_LOGITS } else { N_LOGITS + N_HEADS + 1 };
    (0..N_ROWS * width).map(|k| 2.0 * wild(k)).collect()
}

/// Priors with empty bins; the second row has one measurement that means nothing, the last none at all.
fn targets() -> Vec<f32> {
    let mut targets = Vec::new();
    for row in 0..N_ROWS {
        for head in 0..N_HEADS {
            let mut prior = [0.0; N_BINS];
            (prior[head + row], prior[head + row + 2], prior[8]) = (0.5, 0.3, 0.2);
            targets.extend(prior);
        }
        targets.extend((0..N_HEADS).map(|head| match row {
            0 => head as f32 * 3.0,
            1 if head != 2 => 11.0 - head as f32,
            _ => -1.0,
        }));
    }
    targets
}

/// The loss as the equations say it, one example and one parameter at a time.
fn by_the_equations(terms: &LossTerms, outputs: &[f32], targets: &[f32]) -> f64 {
    let width = outputs.len() / N_ROWS;
    let mut sum = 0.0;
    for head in 0..N_HEADS {
        let valid = (0..N_ROWS).filter(|row| targets[row * N_TARGETS + N_LOGITS + head] >= 0.0).count();
        for row in 0..N_ROWS {
            let (output, target) = (&outputs[row * width..][..width], &targets[row * N_TARGETS..]);
            let logits: PerBin = std::array::from_fn(|b| f64::from(output[head * N_BINS + b]));
            let total: f64 = logits.iter().map(|logit| logit.exp()).sum();
            let p = logits.map(|logit| logit.exp() / total);
            let physics: PerBin = std::array::from_fn(|b| f64::from(target[head * N_BINS + b]));
            let bin = target[N_LOGITS + head];
            let measured: PerBin = std::array::from_fn(|b| f64::from(u8::from(b as f32 == bin)));
            let share = if bin >= 0.0 { 1.0 / valid as f64 } else { 0.0 };
            let all = 1.0 / N_ROWS as f64;
            if matches!(terms.prior, Prior::None) {
                sum += share * dirichlet::emd2(&p, &measured);
                sum += all * terms.physics_weight * dirichlet::emd2(&p, &physics);
                continue;
            }
            let log_n = f64::from(output[N_LOGITS + N_HEADS]) + terms.log_budget;
            let n = log_n.clamp(-30.0, 30.0).exp() / (1.0 + (-f64::from(output[N_LOGITS + head])).exp());
            let prior = if matches!(terms.prior, Prior::Physics) { physics } else { [1.0 / 12.0; N_BINS] };
            let beta: PerBin = std::array::from_fn(|b| terms.prior_evidence * prior[b] + n * p[b]);
            sum += share * dirichlet::uemd2(&beta, &measured);
            sum += all * terms.physics_weight * dirichlet::uemd2(&beta, &physics);
            sum -= all * terms.entropy_weight * dirichlet::entropy(&beta.map(|b| b.max(0.01)));
        }
    }
    sum
}

#[test]
fn batch_is_the_mean_of_the_equations() {
    for prior in [Prior::Physics, Prior::Uniform, Prior::None] {
        let (terms, outputs, targets) = (terms(prior), outputs(prior), targets());
        let expected = by_the_equations(&terms, &outputs, &targets);
        let found = terms.batch(&outputs, &targets).0;
        assert!((found - expected).abs() < 1e-9, "{prior:?}: {found}, {expected}");
    }
}

#[test]
fn gradient_matches_finite_differences() {
    for prior in [Prior::Physics, Prior::Uniform, Prior::None] {
        let (terms, outputs, targets) = (terms(prior), outputs(prior), targets());
        let (_, gradient) = terms.batch(&outputs, &targets);
        for place in 0..outputs.len() {
            let step = 1.0 / 256.0;
            let moved = |by: f32| {
                let mut moved = outputs.clone();
                moved[place] += by;
                by_the_equations(&terms, &moved, &targets)
            };
            let slope = (moved(step) - moved(-step)) / f64::from(2.0 * step);
            let error = (f64::from(gradient[place]) - slope).abs();
            assert!(error < 2e-4 * slope.abs().max(0.1), "{prior:?} {place}: {} {slope}", gradient[place]);
        }
    }
}

#[test]
fn operation_hands_loss_and_gradient_to_autograd() {
    let (terms, outputs, targets) = (terms(Prior::Physics), outputs(Prior::Physics), targets());
    let (loss, gradient) = terms.batch(&outputs, &targets);
    let width = outputs.len() / N_ROWS;
    let variable = Var::from_vec(outputs, (N_ROWS, width), &Device::Cpu).unwrap();
    let targets = Tensor::from_vec(targets, (N_ROWS, N_TARGETS), &Device::Cpu).unwrap();
    let found = variable.apply_op2(&targets, BatchLoss::new(terms)).unwrap();
    assert!((f64::from(found.to_scalar::<f32>().unwrap()) - loss).abs() < 1e-6 * loss.abs());
    let tripled = (found * 3.0).unwrap().backward().unwrap();
    let by_outputs = tripled.get(&variable).unwrap().flatten_all().unwrap().to_vec1::<f32>().unwrap();
    for (found, slope) in by_outputs.iter().zip(&gradient) {
        assert!((found - 3.0 * slope).abs() <= 1e-6 * slope.abs());
    }
}

#[test]
fn measurements_that_mean_nothing_leave_no_trace() {
    let terms = LossTerms { physics_weight: 0.0, entropy_weight: 0.0, ..terms(Prior::Physics) };
    let (outputs, targets) = (outputs(Prior::Physics), targets());
    let width = outputs.len() / N_ROWS;
    let (loss, gradient) = terms.batch(&outputs, &targets);
    assert!(gradient[2 * width..].iter().all(|&slope| slope == 0.0));
    let mut changed = outputs.clone();
    changed[2 * width..].iter_mut().for_each(|value| *value = -*value);
    assert_eq!(terms.batch(&changed, &targets).0, loss);
    assert!(terms.score(&outputs[2 * width..], &targets[2 * N_TARGETS..]).emd2.iter().all(Option::is_none));
}

#[test]
fn evidence_stays_within_its_bounds() {
    assert_eq!(evidence(1e6, 0.0), 30f64.exp());
    assert_eq!(evidence(-1e6, 0.0), (-30f64).exp());
    assert!((evidence(-2.0, 5.0) - 3f64.exp()).abs() < 1e-12);
    let mut outputs = outputs(Prior::Physics);
    let width = outputs.len() / N_ROWS;
    for (row, extreme) in [1e4, -1e4, f32::MAX].into_iter().enumerate() {
        outputs[row * width + N_LOGITS + N_HEADS] = extreme;
    }
    let (loss, gradient) = terms(Prior::Physics).batch(&outputs, &targets());
    assert!(loss.is_finite() && gradient.iter().all(|slope| slope.is_finite()));
}

#[test]
fn score_without_evidence_is_the_priors_and_with_much_the_predictions() {
    let (terms, targets) = (terms(Prior::Physics), targets());
    let mut outputs = outputs(Prior::Physics);
    let score = |log_density: f32, outputs: &mut [f32]| {
        outputs[N_LOGITS + N_HEADS] = log_density;
        terms.score(&outputs[..N_LOGITS + N_HEADS + 1], &targets[..N_TARGETS])
    };
    let physics: PerBin = std::array::from_fn(|b| f64::from(targets[b]));
    let none = score(-100.0, &mut outputs);
    assert!((none.emd2[0].unwrap() - dirichlet::emd2(&physics, &one_hot(0))).abs() < 1e-6);
    assert!(none.learned_weight.unwrap() < 1e-9);
    let much = score(100.0, &mut outputs);
    let predicted = softmax(&outputs[..N_BINS]);
    assert!((much.emd2[0].unwrap() - dirichlet::emd2(&predicted, &one_hot(0))).abs() < 1e-9);
    assert!(much.learned_weight.unwrap() > 1.0 - 1e-9);
}
