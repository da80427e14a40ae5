//! Which rollouts are driven like nominal ones: what a model was not calibrated on, it foretells worse, and its errors
//! there are no evidence for a cause.

use crate::drive::{Drive, N_STEPS, STEP_S, YAW};
use serde::{Deserialize, Serialize};

/// How a rollout is driven: slowest and fastest commanded speed, mean size of the commanded angle, largest lateral
/// acceleration that is asked for, how much angle and speed are changed, slope along and across.
const N_CONDITIONS: usize = 8;
/// Commands count from this long before the start [s].
const BEFORE_S: f64 = 0.5;
/// Of rollouts of a nominal drive, this share is as near to those of the others as is usual.
const USUAL: f64 = 0.9;
/// A rollout that is twice as far from all nominal ones as is usual counts for 1 / 2 to this power.
const FALL: i32 = 6;

/// Where all drives are driven alike, what is this near is, too [standard deviations].
const LEAST_USUAL: f32 = 1e-3;

type Conditions = [f32; N_CONDITIONS];

/// Conditions of nominal rollouts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Familiarity {
    known: Vec<Conditions>,
    /// One over the standard deviation of each.
    per_sigma: Conditions,
    /// Distance to the nearest, in standard deviations.
    usual: f32,
}

impl Familiarity {
    /// With everything.
    pub(crate) fn unlimited() -> Self {
        Self { known: Vec::new(), per_sigma: [0.0; N_CONDITIONS], usual: 0.0 }
    }

    /// With what nominal drives do; what is usual is learned by leaving out one after the other.
    pub(crate) fn with(drives: &[&Drive]) -> Self {
        let by_drive: Vec<Vec<Conditions>> = drives.iter().map(|drive| conditions(drive)).collect();
        let known = by_drive.concat();
        let per_sigma = std::array::from_fn(|k| per_sigma(&known, k));
        let without = |out: usize| by_drive.iter().enumerate().filter(move |(i, _)| *i != out);
        let mut distances = Vec::with_capacity(known.len());
        for (out, own) in by_drive.iter().enumerate() {
            let others: Vec<Conditions> = without(out).flat_map(|(_, of)| of.clone()).collect();
            distances.extend(own.iter().map(|row| distance(&others, row, &per_sigma)));
        }
        distances.sort_by(f32::total_cmp);
        let usual = distances[((distances.len() - 1) as f64 * USUAL) as usize].max(LEAST_USUAL);
        Self { known, per_sigma, usual }
    }

    /// What every rollout of a drive counts for, 1 at most.
    pub(crate) fn weights(&self, drive: &Drive) -> Vec<f32> {
        if self.known.is_empty() {
            return vec![1.0; drive.starts.len()];
        }
        let weight = |own: &Conditions| {
            let distance = distance(&self.known, own, &self.per_sigma);
            if distance <= self.usual { 1.0 } else { (self.usual / distance).powi(FALL) }
        };
        conditions(drive).iter().map(weight).collect()
    }
}

/// To the nearest of those that are known.
fn distance(known: &[Conditions], own: &Conditions, per_sigma: &Conditions) -> f32 {
    let square = |other: &Conditions| {
        let each = own.iter().zip(other).zip(per_sigma);
        each.map(|((own, other), per_sigma)| ((own - other) * per_sigma).powi(2)).sum::<f32>()
    };
    known.iter().map(square).fold(f32::INFINITY, f32::min).sqrt()
}

/// Of what never changes, 0: it tells nothing apart.
fn per_sigma(known: &[Conditions], k: usize) -> f32 {
    let n = known.len() as f32;
    let mean = known.iter().map(|own| own[k]).sum::<f32>() / n;
    let sigma = (known.iter().map(|own| (own[k] - mean).powi(2)).sum::<f32>() / n).sqrt();
    if sigma > 1e-4 { 1.0 / sigma } else { 0.0 }
}

/// Of every start of a drive.
fn conditions(drive: &Drive) -> Vec<Conditions> {
    drive.starts.iter().map(|&start| conditions_from(drive, start)).collect()
}

fn conditions_from(drive: &Drive, start: usize) -> Conditions {
    let end = start + N_STEPS;
    let commands = &drive.commands[start.saturating_sub((BEFORE_S / STEP_S) as usize)..end];
    let speeds = || commands.iter().map(|command| command.speed_mps);
    let lateral = |command: &bicycle::Command| (command.speed_mps.powi(2) * command.steering_rad).abs();
    let changes = |of: fn(&bicycle::Command) -> f32| -> f32 {
        commands.windows(2).map(|pair| (of(&pair[1]) - of(&pair[0])).abs()).sum()
    };
    let [mut along, mut across] = [0.0_f64; 2];
    for row in start..end {
        let (sine, cosine) = drive.smooth[YAW][row].sin_cos();
        let [east, north] = [0, 1].map(|axis| f64::from(drive.gradient[axis][row]));
        along += east * cosine + north * sine;
        across += north * cosine - east * sine;
    }
    [
        speeds().fold(f32::INFINITY, f32::min),
        speeds().fold(f32::NEG_INFINITY, f32::max),
        commands.iter().map(|command| command.steering_rad.abs()).sum::<f32>() / commands.len() as f32,
        commands.iter().map(lateral).fold(0.0, f32::max),
        changes(|command| command.steering_rad),
        changes(|command| command.speed_mps),
        (along / N_STEPS as f64) as f32,
        (across / N_STEPS as f64).abs() as f32,
    ]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::comparison::{Comparison, Yardstick};
    use crate::engine_tests::{Made, arcs};
    use crate::rollout::PER_START;
    use crate::whitening::Whitening;

    fn driven(seed: u64) -> Drive {
        arcs(Made::RIGHT, seed)
    }

    fn faster(drive: &Drive, ratio: f32) -> Drive {
        let mut drive = drive.clone();
        drive.commands.iter_mut().for_each(|command| command.speed_mps *= ratio);
        drive
    }

    /// Of a drive like them, 0.9 of the rollouts are usual, give or take what three drives of 24 s leave to chance; none is
    /// that goes three times as fast.
    #[test]
    fn what_is_driven_otherwise_counts_for_little() {
        let nominal = [3, 4, 5].map(driven);
        let familiarity = Familiarity::with(&nominal.each_ref());
        let share = |drive: &Drive, weigh: fn(&f32) -> bool| {
            let weights = familiarity.weights(drive);
            weights.iter().filter(|weight| weigh(weight)).count() as f64 / weights.len() as f64
        };
        let alike = driven(6);
        assert!(share(&alike, |weight| *weight == 1.0) > 0.7);
        assert!(share(&faster(&alike, 3.0), |weight| *weight < 0.1) > 0.95);
        // What nominal drives did themselves is known.
        assert!(share(&nominal[0], |weight| *weight == 1.0) == 1.0);
        assert!(Familiarity::unlimited().weights(&faster(&alike, 3.0)).iter().all(|weight| *weight == 1.0));
    }

    /// Two nominal drives tell nothing of what is usual once one is left out, and one alone even less.
    #[test]
    fn one_drive_alone_is_familiar_with_everything() {
        let alone = driven(3);
        let weights = Familiarity::with(&[&alone]).weights(&faster(&alone, 3.0));
        assert!(weights.iter().all(|weight| *weight == 1.0), "{weights:?}");
    }

    /// Whatever is unfamiliar, weights have a mean square of 1: they tell which rollouts count for more, and never that all
    /// count for less.
    #[test]
    fn weights_have_a_mean_square_of_one() {
        let (nominal, other) = ([3, 4].map(driven), driven(6));
        let familiarity = Familiarity::with(&nominal.each_ref());
        for drive in [faster(&other, 3.0), faster(&other, 1.3)] {
            let whitening = Whitening::none();
            let comparison = Comparison::new(1.0, vec![&drive], &Yardstick::rough());
            let plain = comparison.residuals(&[]);
            let judged = comparison.judged_by(&whitening, &familiarity).judged_residuals(&[]);
            let square = |(judged, plain): (&[f32], &[f32])| {
                let measured = plain.iter().position(|residual| residual.abs() > 0.0).unwrap();
                f64::from(judged[measured] / plain[measured]).powi(2)
            };
            let starts = judged.chunks(PER_START).zip(plain.chunks(PER_START));
            let squares: Vec<f64> = starts.map(square).collect();
            let [least, most] = [f64::min, f64::max].map(|of| squares.iter().copied().reduce(of).unwrap());
            assert!(most > 2.0 * least, "rollouts of one weight tell nothing: {least} to {most}");
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            assert!((mean - 1.0).abs() < 1e-4, "{mean}");
        }
    }
}
