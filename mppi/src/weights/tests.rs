//! Identities of the soft minimum, on every instruction set of the machine.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use super::*;
use crate::kernel;
use bicycle::lanes::Instructions;

fn machines() -> Vec<Instructions> {
    Instructions::all().collect()
}

/// 256 costs between 3 and 12 s.
fn costs() -> Vec<f32> {
    (0..256u32).map(|i| 3.0 + 9.0 * ((i * 97 % 256) as f32 / 255.0).powi(2)).collect()
}

fn weigh(machine: Instructions, costs: &[f32], temperature: Temperature) -> (Vec<Chunk>, WeightSummary) {
    let mut chunks = vec![Chunk::new(2); costs.len() / CHUNK];
    for (chunk, costs) in chunks.iter_mut().zip(costs.as_chunks::<CHUNK>().0) {
        chunk.costs.0 = *costs;
    }
    let summary = kernel::run(machine, Weigh { chunks: &mut chunks, temperature, last_s: 1.0 });
    (chunks, summary)
}

fn weights(chunks: &[Chunk]) -> Vec<f64> {
    chunks.iter().flat_map(|chunk| chunk.weights.0).map(f64::from).collect()
}

#[test]
fn weights_and_free_energy_are_those_of_the_definition() {
    let temperature_s = 0.7;
    for machine in machines() {
        let (chunks, summary) = weigh(machine, &costs(), Temperature::Fixed { temperature_s });
        assert_eq!(summary.baseline_s, 3.0);
        assert_eq!(costs()[summary.best.0 * CHUNK + summary.best.1], 3.0);
        let mut sum = 0.0;
        for (weight, cost) in weights(&chunks).into_iter().zip(costs()) {
            let expected = ((3.0 - f64::from(cost)) / temperature_s).exp();
            assert!((weight - expected).abs() < 2e-6, "{machine:?}: {weight} {expected}");
            sum += (-f64::from(cost) / temperature_s).exp();
        }
        // F = -T ln(mean exp(-S / T)), without the baseline that keeps f32 from underflow.
        let free_energy_s = -temperature_s * (sum / 256.0).ln();
        assert!((f64::from(summary.free_energy_s(256)) - free_energy_s).abs() < 1e-4);
        let mean_s = costs().iter().sum::<f32>() / 256.0;
        assert!(summary.baseline_s <= summary.free_energy_s(256) && summary.free_energy_s(256) <= mean_s);
    }
}

#[test]
fn an_offset_of_all_costs_changes_no_weight() {
    for machine in machines() {
        let fixed = Temperature::Fixed { temperature_s: 2.0 };
        let (plain, _) = weigh(machine, &costs(), fixed);
        // 64 is a power of two: the f32 costs keep all bits that matter to within 64 x 6e-8.
        let raised: Vec<f32> = costs().iter().map(|cost| cost + 64.0).collect();
        let (offset, _) = weigh(machine, &raised, fixed);
        for (a, b) in weights(&plain).into_iter().zip(weights(&offset)) {
            assert!((a - b).abs() < 1e-5);
        }
    }
}

#[test]
fn the_effective_sample_size_lies_between_one_and_all() {
    for machine in machines() {
        let cold = weigh(machine, &costs(), Temperature::Fixed { temperature_s: 1e-6 }).1;
        assert!((cold.effective_sample_size - 1.0).abs() < 1e-3);
        let hot = weigh(machine, &costs(), Temperature::Fixed { temperature_s: 1e6 }).1;
        assert!((hot.effective_sample_size - 256.0).abs() < 1e-2);
        let same = weigh(machine, &[5.0; 128], Temperature::Fixed { temperature_s: 1.0 }).1;
        assert!((same.effective_sample_size - 128.0).abs() < 1e-3);
    }
}

#[test]
fn a_wanted_effective_sample_size_is_held() {
    for machine in machines() {
        for fraction in [0.05, 0.2, 0.6] {
            let summary = weigh(machine, &costs(), Temperature::EffectiveSampleSize { fraction }).1;
            let wanted = 256.0 * fraction as f32;
            assert!((summary.effective_sample_size / wanted - 1.0).abs() < 0.02, "{summary:?}");
        }
    }
}

#[test]
fn costs_that_are_not_finite_get_no_weight() {
    for machine in machines() {
        let mut broken = costs();
        (broken[7], broken[100], broken[200]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
        let (chunks, summary) = weigh(machine, &broken, Temperature::Fixed { temperature_s: 1.0 });
        assert_eq!(summary.n_non_finite, 3);
        assert!([7, 100, 200].into_iter().all(|i| weights(&chunks)[i] == 0.0));
        assert!(summary.normalizer.is_finite() && summary.baseline_s == 3.0);
    }
}
