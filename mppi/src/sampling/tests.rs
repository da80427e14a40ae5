//! Statistics, limits and the control cost of the samples, on every instruction set of the machine.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use super::*;
use crate::config::{Config, SampleSpace, Sampling};
use crate::kernel::{self, functions::key};
use crate::plan::Plan;
use bicycle::lanes::Instructions;
use nalgebra::{DMatrix, DVector};

const N_STEPS: usize = 20;
const STEP_S: f64 = 0.1;

fn machines() -> Vec<Instructions> {
    Instructions::all().collect()
}

fn plan(space: SampleSpace, correlation_s: f64) -> Plan {
    let sampling = Sampling { space, speed_std: 0.8, steering_std: 0.3, correlation_s };
    Plan::new(&Config { n_steps: N_STEPS, step_s: STEP_S, sampling, ..Config::default() })
}

fn sampler(plan: &Plan) -> Sampler<'_> {
    Sampler {
        steps: &plan.steps,
        kept_noise: [plan.correlation(); 2],
        kept_control: plan.kept_control(),
        low: [-100.0; 2],
        high: [100.0; 2],
        change: [f32::INFINITY; 2],
        start: [0.0; 2],
        key: key(3, 5),
    }
}

fn sample(machine: Instructions, sampler: &Sampler<'_>, n_chunks: usize) -> Vec<Chunk> {
    let mut chunks = vec![Chunk::new(N_STEPS); n_chunks];
    for (index, chunk) in chunks.iter_mut().enumerate() {
        kernel::run(machine, Sample { sampler, index, chunk });
    }
    chunks
}

/// One channel of all rollouts but the nominal one: [rollout][step].
fn sequences(chunks: &[Chunk], channel: usize) -> Vec<Vec<f64>> {
    let of = |chunk: &Chunk, lane: usize| {
        chunk.controls.iter().map(|rows| f64::from(rows[channel].0[lane])).collect()
    };
    chunks.iter().flat_map(|chunk| (0..CHUNK).map(move |lane| of(chunk, lane))).skip(1).collect()
}

/// Mean, variance and kurtosis of a normal number, within five standard errors; no correlation between channels.
#[test]
fn white_noise_is_normal() {
    let mut plan = plan(SampleSpace::Controls, 0.0);
    plan.prepare([0.0; 2], 0.0);
    for machine in machines() {
        let chunks = sample(machine, &sampler(&plan), 64);
        let [speed, steering] = [0, 1].map(|channel| sequences(&chunks, channel).concat());
        let n = speed.len() as f64;
        for (values, std) in [(&speed, 0.8), (&steering, 0.3)] {
            let moment = |power: i32| values.iter().map(|value| (value / std).powi(power)).sum::<f64>() / n;
            assert!(moment(1).abs() < 5.0 / n.sqrt());
            assert!((moment(2) - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
            assert!((moment(4) - 3.0).abs() < 5.0 * (96.0 / n).sqrt());
        }
        let product = speed.iter().zip(&steering).map(|(a, b)| a * b / 0.24).sum::<f64>() / n;
        assert!(product.abs() < 5.0 / n.sqrt());
        let neighbours: Vec<f64> = speed.windows(2).map(|pair| pair[0] * pair[1] / 0.64).collect();
        assert!(neighbours.iter().sum::<f64>().abs() / n < 5.0 / n.sqrt());
    }
}

/// Covariance of steps s and t is std^2 exp(-|s - t| dt / tau), from the first step on.
#[test]
fn coloured_noise_is_stationary_with_the_given_correlation_time() {
    let mut plan = plan(SampleSpace::Controls, 0.25);
    plan.prepare([0.0; 2], 0.0);
    for machine in machines() {
        let sequences = sequences(&sample(machine, &sampler(&plan), 128), 0);
        let n = sequences.len() as f64;
        for (s, t) in [(0, 0), (19, 19), (0, 1), (3, 6), (10, 19)] {
            let covariance = sequences.iter().map(|sequence| sequence[s] * sequence[t]).sum::<f64>() / n;
            let expected = 0.64 * (-(t as f64 - s as f64) * STEP_S / 0.25).exp();
            assert!((covariance - expected).abs() < 5.0 * 0.64 * (2.0 / n).sqrt(), "{s} {t} {covariance}");
        }
    }
}

/// Instruction sets draw the same numbers, but for rounding.
#[test]
fn every_instruction_set_draws_the_same() {
    let mut plan = plan(SampleSpace::Rates, 0.3);
    plan.prepare([0.4, 0.1], 0.2);
    let reference = sample(Instructions::Portable, &sampler(&plan), 4);
    for machine in machines() {
        let chunks = sample(machine, &sampler(&plan), 4);
        for (a, b) in sequences(&chunks, 1).concat().iter().zip(sequences(&reference, 1).concat()) {
            assert!((a - b).abs() < 1e-5);
        }
    }
}

#[test]
fn samples_keep_bounds_and_rates_and_the_first_is_the_nominal() {
    let mut plan = plan(SampleSpace::Rates, 0.3);
    plan.nominal
        .iter_mut()
        .enumerate()
        .for_each(|(t, control)| *control = [0.1 * t as f32, -0.02 * t as f32]);
    plan.prepare([0.0; 2], 0.0);
    let limited = Sampler { low: [-0.5, -0.3], high: [1.5, 0.3], change: [0.2, 0.1], ..sampler(&plan) };
    for machine in machines() {
        let chunks = sample(machine, &limited, 4);
        for (channel, (low, high, change)) in [(-0.5, 1.5, 0.2), (-0.3, 0.3, 0.1)].into_iter().enumerate() {
            for sequence in sequences(&chunks, channel) {
                assert!(sequence.iter().all(|value| (low - 1e-6..=high + 1e-6).contains(value)));
                assert!(sequence[0].abs() < change + 1e-6);
                assert!(sequence.windows(2).all(|pair| (pair[1] - pair[0]).abs() < change + 1e-6));
            }
        }
        for (t, rows) in chunks[0].controls.iter().enumerate() {
            assert!((rows[0].0[0] - (0.1 * t as f32).min(1.5)).abs() < 1e-6);
        }
    }
}

/// lambda u' S^-1 e with S written out as a matrix: std^2 exp(-|s - t| dt / tau), in the space that is sampled.
#[test]
fn the_control_cost_is_that_of_williams() {
    let start = [0.3, -0.1];
    for (space, correlation_s) in [
        (SampleSpace::Controls, 0.0),
        (SampleSpace::Controls, 0.3),
        (SampleSpace::Rates, 0.0),
        (SampleSpace::Rates, 0.3),
    ] {
        let mut plan = plan(space, correlation_s);
        let wave = |t: usize, c: usize| 0.4 * ((t as f32) * 0.5 + c as f32).sin();
        plan.nominal.iter_mut().enumerate().for_each(|(t, control)| *control = [wave(t, 0), wave(t, 1)]);
        plan.prepare(start, 1.7);
        let inverse = DMatrix::from_fn(N_STEPS, N_STEPS, |s, t| {
            let apart_s = (s as f64 - t as f64).abs() * STEP_S;
            if correlation_s > 0.0 { (-apart_s / correlation_s).exp() } else { f64::from(u8::from(s == t)) }
        })
        .try_inverse()
        .unwrap();
        // What is sampled, from controls: themselves, or their changes over the step's length.
        let sampled = |controls: &[f64], c: usize| match space {
            SampleSpace::Controls => DVector::from_row_slice(controls),
            SampleSpace::Rates => DVector::from_fn(N_STEPS, |t, _| {
                let before = if t == 0 { f64::from(start[c]) } else { controls[t - 1] };
                (controls[t] - before) / STEP_S
            }),
        };
        for machine in machines() {
            let chunks = sample(machine, &Sampler { start, ..sampler(&plan) }, 1);
            let (speeds, steerings) = (sequences(&chunks, 0), sequences(&chunks, 1));
            for (lane, sequence) in speeds.iter().zip(&steerings).enumerate() {
                let sequence = [sequence.0, sequence.1];
                let mut expected = 0.0;
                for (c, std) in [0.8, 0.3].into_iter().enumerate() {
                    let nominal: Vec<f64> =
                        plan.nominal.iter().map(|control| f64::from(control[c])).collect();
                    let mean = sampled(&nominal, c);
                    let noise = sampled(sequence[c], c) - &mean;
                    expected += 1.7 * (mean.transpose() * &inverse * noise)[0] / (std * std);
                }
                let found = f64::from(chunks[0].terms[CostTerm::Control as usize].0[lane + 1]);
                let tolerance = 2e-4 * (1.0 + expected.abs());
                assert!(
                    (found - expected).abs() < tolerance,
                    "{space:?} {correlation_s}: {found} {expected}"
                );
            }
        }
    }
}
