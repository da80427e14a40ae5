//! The learned correction on residuals whose origin is known.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::best_training;
use super::features::{CORRECTION_S, Examples, N_CORRECTIONS, N_FEATURES, Scaling};
use super::network::{Trained, fitted};
use crate::comparison::root_mean_square;
use crate::drive::{HORIZONS, N_QUANTITIES};
use crate::rollout::PER_START;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The place of the speed among the features.
const SPEED: usize = 13;
/// Standard deviations of what is compared: two displacements [m], turn [rad], speed [m/s], yaw rate [rad/s], speed
/// to the left [m/s].
const SIGMA: [f32; N_QUANTITIES] = [0.05, 0.05, 0.02, 0.03, 0.02, 0.03];

/// Rollouts straight on at speeds of 1 to 3 m/s on a machine that turns by `yaw_rate(speed)` where the model goes
/// straight; measured with noise.
fn bent(n: usize, seed: u64, yaw_rate: impl Fn(f32) -> f32) -> Examples {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut examples = Examples {
        features: Vec::new(),
        foretold: [Vec::new(), Vec::new()],
        residuals: Vec::new(),
        per_sigma: SIGMA.map(|sigma| 1.0 / sigma).repeat(HORIZONS.len()),
    };
    for _ in 0..n {
        let speed = random.random_range(1.0..3.0_f32);
        let rate = yaw_rate(speed);
        for k in 0..N_CORRECTIONS {
            let mut features = [0.0_f32; N_FEATURES];
            features[12] = (k as f32 + 0.5) * CORRECTION_S as f32;
            features[SPEED] = speed / 3.0;
            examples.features.extend(features);
            examples.foretold[0].push(speed);
            examples.foretold[1].push(0.0);
        }
        for steps in HORIZONS {
            let time_s = steps as f32 * 0.02;
            let turn = rate * time_s;
            // An arc against the straight line that the model foretells.
            let [along, across] = if rate.abs() < 1e-6 {
                [speed * time_s, 0.0]
            } else {
                [speed * turn.sin() / rate, speed * (1.0 - turn.cos()) / rate]
            };
            let measured = [along, across, turn, speed, rate, 0.0];
            let foretold = [speed * time_s, 0.0, 0.0, speed, 0.0, 0.0];
            for ((measured, foretold), sigma) in measured.into_iter().zip(foretold).zip(SIGMA) {
                let noise: f32 = StandardNormal.sample(&mut random);
                examples.residuals.push((foretold - measured) / sigma + noise);
            }
        }
    }
    examples
}

/// Trained on two halves, judged on rollouts that were never seen: residuals before and after, if anything is learned.
fn learned(yaw_rate: fn(f32) -> f32) -> Option<(Vec<f32>, Vec<f32>)> {
    let halves = [bent(180, 1, yaw_rate), bent(180, 2, yaw_rate)];
    let training = best_training(&halves).unwrap()?;
    let all = bent(360, 3, yaw_rate);
    let scaling = Scaling::of(&all);
    let network = fitted(&all, &scaling, training, &mut |_, _| Ok(())).unwrap();
    let heldout = bent(400, 4, yaw_rate);
    let corrected = Trained { network: &network, scaling: &scaling }.corrected(&heldout).unwrap();
    Some((heldout.residuals, corrected))
}

/// A yaw rate that grows with the square of the speed is learned, and no more than it: what is left on rollouts that
/// were never seen is the noise, which the true model would leave as well.
#[test]
fn a_yaw_rate_that_depends_on_the_speed_is_recovered_and_no_more() {
    let (before, after) = learned(|speed| 0.03 * speed * speed).unwrap();
    let [before, left] = [before.as_slice(), &after].map(root_mean_square);
    assert!(before > 3.0, "{before}");
    assert!(left < 1.0 + 0.1 * (before - 1.0), "{before} {left}");
    // One standard deviation of noise on 400 x 20 numbers is known to 0.8 per cent.
    assert!(left > 0.97, "less than the truth leaves: {left}");
    // The yaw rate itself, horizon by horizon: what was added is taken away.
    let last: Vec<f32> = after.chunks(PER_START).map(|start| start[PER_START - 1]).collect();
    let mean = last.iter().sum::<f32>() / last.len() as f32;
    assert!(mean.abs() < 0.5, "{mean} standard deviations of 0.02 rad/s");
}

#[test]
fn in_noise_nothing_is_found() {
    assert!(learned(|_| 0.0).is_none());
}
