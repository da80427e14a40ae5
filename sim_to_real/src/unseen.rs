//! Which effects the real drives could not have shown, by what each would change in their predictions.

use crate::baseline::Baseline;
use crate::causes::candidates;
use crate::diagnosis::Diagnosis;
use crate::drive::Drive;
use crate::least_squares::mean_loss;
use crate::machine::Machine;
use crate::{GapError, baseline::drives_of};
use bicycle::effect::Description;
use bicycle::{DriveLog, Effect};

/// An effect shows when predictions without it are worse by this in the logarithm of their loss.
const SHOWS: f64 = 0.2;
/// Slopes below this are level ground [-].
const LEVEL: f64 = 0.02;
/// Class of vegetation.
const VEGETATION: f32 = 2.0;

/// The effects that would not show at any of the sizes that the catalogue tries, each at its largest one.
pub(crate) fn unseen(baseline: &Baseline, drives: &[&Drive], announced: &[Effect]) -> Vec<Effect> {
    let trial = baseline.trial(drives);
    let before = trial.residuals(announced);
    let is_announced = |own: &Description| announced.iter().any(|effect| effect.description().id == own.id);
    let mut unseen = Vec::new();
    for description in candidates().filter(|own| !is_announced(own)) {
        let shows = |effect: &Effect| {
            let with: Vec<Effect> = announced.iter().copied().chain([*effect]).collect();
            let after = trial.residuals(&with);
            let change: Vec<f32> = before.iter().zip(&after).map(|(a, b)| a - b).collect();
            (1.0 + mean_loss_of_all(&change) / baseline.null.loss).ln() > SHOWS
        };
        let sizes = sizes(description);
        if !sizes.is_empty() && !sizes.iter().any(shows) {
            unseen.extend(sizes.last());
        }
    }
    unseen
}

fn mean_loss_of_all(change: &[f32]) -> f64 {
    if change.iter().all(|value| *value == 0.0) { 0.0 } else { mean_loss(change) }
}

/// The effect at the values that the catalogue tries, all parameters small together to all large together.
fn sizes(description: &Description) -> Vec<Effect> {
    let n = description.parameters.iter().map(|parameter| parameter.tried.len()).max().unwrap_or(0);
    let at = |size: usize| {
        let mut values = [0.0; 4];
        for (value, parameter) in values.iter_mut().zip(description.parameters) {
            // From the value nearest to no effect to the one farthest from it.
            let mut tried = parameter.tried.to_vec();
            let distance = |value: &f64| (value - parameter.neutral).abs();
            tried.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            *value = tried[size.min(tried.len() - 1)];
        }
        Effect::from_values(description.id, values)
    };
    (0..n).filter_map(at).collect()
}

/// Sentences on what the real drives could not have shown, and what in them is missing.
///
/// # Errors
/// Drives that could not be diagnosed either.
pub fn unseen_effects(
    baseline: &Baseline,
    machine: &Machine,
    diagnosis: &Diagnosis,
    real: &[DriveLog],
) -> Result<Vec<String>, GapError> {
    let drives = drives_of("real", machine, real)?;
    let all: Vec<&Drive> = drives.iter().collect();
    let hidden = unseen(baseline, &all, diagnosis.effects());
    let id = |effect: &Effect| effect.description().id;
    let (by_ground, by_driving): (Vec<Effect>, Vec<Effect>) =
        hidden.iter().partition(|effect| effect.uses_ground());
    let mut sentences = Vec::new();
    if !by_ground.is_empty() {
        let names: Vec<&str> = by_ground.iter().map(id).collect();
        sentences.push(format!(
            "{} would hardly have shown in these drives, at the sizes that are tried: {}",
            names.join(", "),
            missing_ground(&all)
        ));
    }
    if !by_driving.is_empty() {
        let names: Vec<&str> = by_driving.iter().map(id).collect();
        sentences.push(format!(
            "{} would hardly have shown in these drives, at the sizes that are tried: {}",
            names.join(", "),
            driven(&all)
        ));
    }
    Ok(sentences)
}

fn missing_ground(drives: &[&Drive]) -> String {
    let rows = || drives.iter().flat_map(|drive| drive.class.iter());
    let in_vegetation = rows().filter(|class| (**class - VEGETATION).abs() < 0.5).count() as f64;
    let steep = drives.iter().flat_map(|drive| drive.gradient[0].iter().zip(&drive.gradient[1]));
    let n_steep = steep.filter(|(east, north)| f64::from(east.hypot(**north)) > LEVEL).count() as f64;
    let n = rows().count() as f64;
    format!(
        "{:.0} % of the way was on slopes, {:.0} % in vegetation",
        100.0 * n_steep / n,
        100.0 * in_vegetation / n
    )
}

/// What the drives asked of the machine, in plain words.
fn driven(drives: &[&Drive]) -> String {
    let commands = || drives.iter().flat_map(|drive| &drive.commands);
    let range = |of: &dyn Fn(&bicycle::Command) -> f32| {
        commands().map(of).fold([f32::MAX, f32::MIN], |[low, high], value| [low.min(value), high.max(value)])
    };
    let speeds = range(&|command| command.speed_mps);
    let angles = range(&|command| command.steering_rad);
    let lateral = drives.iter().flat_map(|drive| {
        drive.smooth[crate::drive::VX].iter().zip(&drive.smooth[crate::drive::WZ]).map(|(v, w)| (v * w).abs())
    });
    format!(
        "commanded speeds {:.1} to {:.1} m/s, angles {:.2} to {:.2} rad, lateral acceleration up to {:.1} m/s2",
        speeds[0],
        speeds[1],
        angles[0],
        angles[1],
        lateral.fold(0.0, f64::max)
    )
}
