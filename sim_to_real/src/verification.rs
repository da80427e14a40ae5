//! The held-out drives, opened once the diagnosis stands: how far the gap really shrinks.

use crate::answer::{Answer, BeforeAfter};
use crate::baseline::{Baseline, GapError, drives_of};
use crate::causes::composed;
use crate::comparison::{Yardstick, n_measured, of_the_error, rollout_error};
use crate::diagnosis::{Diagnosis, closed};
use crate::drive::{Drive, HORIZONS, N_QUANTITIES, STEP_S, X, Y, YAW};
use crate::findings::{Prediction, PredictionModel, QuantityError, ResidualCell};
use crate::machine::Machine;
use crate::residual_table::{in_units, residual_cells};
use crate::rollout::{PER_START, Simulator};
use bicycle::{DriveLog, Effect};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Stretches that are drawn again and again for an interval [starts], ten seconds each.
const STRETCH: usize = 50;
const N_DRAWS: usize = 400;

/// What the held-out drives say of a diagnosis.
#[derive(Clone, Debug)]
pub struct Verification {
    /// Error of the calibrated nominal model and of the repaired one, in standard deviations.
    pub errors: [f64; 2],
    /// Closed part of the gap with its 90 % interval over stretches of the drives; absent where there is no gap.
    pub closed: Option<[f64; 3]>,
    /// Root mean square distance after two seconds, before and after; absent where no position was measured then [m].
    pub position_error_2s_m: Option<BeforeAfter>,
    /// Residuals by quantity and horizon.
    pub residuals: Vec<ResidualCell>,
    /// The same in the quantities' own units.
    pub errors_by_quantity: Vec<QuantityError>,
    /// Every rollout of both models.
    pub predictions: Vec<Prediction>,
}

/// Judges a diagnosis on drives that it has not seen.
///
/// # Errors
/// No run, or a run without the needed columns or too short.
pub fn verify(
    baseline: &Baseline,
    machine: &Machine,
    diagnosis: &Diagnosis,
    heldout: &[DriveLog],
) -> Result<Verification, GapError> {
    let drives = drives_of("held-out", machine, heldout)?;
    if drives.is_empty() {
        return Err(GapError::Few { set: "held-out", needed: 1, found: 0 });
    }
    let all: Vec<&Drive> = drives.iter().collect();
    let trial = baseline.trial(&all);
    let (before, after) = (trial.residuals(&[]), trial.residuals(diagnosis.effects()));
    let errors = [rollout_error(&before), rollout_error(&after)];
    let closed = baseline.closed(errors[0], errors[1]).map(|closed| {
        let [low, high] = closed_interval(baseline.null.error, &before, &after);
        [closed, low.min(closed), high.max(closed)]
    });
    let residuals = residual_cells(&before, &after, Some(&baseline.null.cells));
    Ok(Verification {
        errors,
        closed,
        position_error_2s_m: position_error(&baseline.yardstick, &before)
            .zip(position_error(&baseline.yardstick, &after))
            .map(|(before, after)| BeforeAfter { before, after }),
        errors_by_quantity: in_units(&residuals, &baseline.yardstick),
        residuals,
        predictions: predictions(baseline, &drives, diagnosis.effects()),
    })
}

/// Root mean square distance at the last horizon, over the rollouts that have a measured position there [m].
pub(crate) fn position_error(yardstick: &Yardstick, residuals: &[f32]) -> Option<f64> {
    let last = PER_START - N_QUANTITIES;
    let square = |start: &[f32]| {
        let [along, across] = [last, last + 1].map(|place| f64::from(start[place]) * yardstick.0[place]);
        let is_measured = start[last] != 0.0 || start[last + 1] != 0.0;
        is_measured.then_some(along * along + across * across)
    };
    let squares: Vec<f64> = residuals.chunks(PER_START).filter_map(square).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// Ends of the 90 % interval of the closed part, over stretches of the drives drawn with replacement.
pub(crate) fn closed_interval(floor: f64, before: &[f32], after: &[f32]) -> [f64; 2] {
    let stretches = before.chunks(STRETCH * PER_START).zip(after.chunks(STRETCH * PER_START));
    let sums = stretches.map(|(before, after)| {
        let n = n_measured(&of_the_error(before)) as f64;
        [n * rollout_error(before).powi(2), n * rollout_error(after).powi(2), n]
    });
    let sums: Vec<[f64; 3]> = sums.collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut draws: Vec<f64> = (0..N_DRAWS)
        .filter_map(|_| {
            let drawn = (0..sums.len()).map(|_| sums[random.random_range(0..sums.len())]);
            let [before, after, n] = drawn.fold([0.0; 3], |a, b| std::array::from_fn(|i| a[i] + b[i]));
            closed(floor, (before / n).sqrt(), (after / n).sqrt())
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    if draws.is_empty() {
        return [f64::NEG_INFINITY, f64::INFINITY];
    }
    let at = |share: f64| draws[((draws.len() - 1) as f64 * share).round() as usize];
    [at(0.05), at(0.95)]
}

fn predictions(baseline: &Baseline, drives: &[Drive], causes: &[Effect]) -> Vec<Prediction> {
    let models = [(PredictionModel::Nominal, &[][..]), (PredictionModel::Repaired, causes)];
    let mut predictions = Vec::new();
    for (model, causes) in models {
        let simulator = Simulator::new(baseline.wheelbase_m, &composed(&baseline.effects, causes));
        for (log, drive) in drives.iter().enumerate() {
            let predicted = simulator.predict(&[drive]);
            for (&start, outcomes) in drive.starts.iter().zip(predicted.chunks(PER_START)) {
                let ends_within = |(_, steps): &(&[f32], usize)| drive.measures(start + steps);
                let of = |(outcome, steps)| prediction(drive, (log, start), steps, (model, outcome));
                let horizons = outcomes.chunks(N_QUANTITIES).zip(HORIZONS);
                predictions.extend(horizons.filter(ends_within).map(of));
            }
        }
    }
    predictions
}

fn prediction(
    drive: &Drive,
    (log, start): (usize, usize),
    steps: usize,
    (model, outcome): (PredictionModel, &[f32]),
) -> Prediction {
    let [along, across, turn, speed_mps, yaw_rate_radps] = std::array::from_fn(|i| f64::from(outcome[i]));
    let [x_m, y_m, yaw_rad] = [X, Y, YAW].map(|quantity| drive.smooth[quantity][start]);
    let (sine, cosine) = yaw_rad.sin_cos();
    Prediction {
        log,
        start_s: drive.time_s + start as f64 * STEP_S,
        horizon_s: steps as f64 * STEP_S,
        model,
        x_m: x_m + along * cosine - across * sine,
        y_m: y_m + along * sine + across * cosine,
        yaw_rad: yaw_rad + turn,
        speed_mps,
        yaw_rate_radps,
    }
}

impl Verification {
    /// The answer with what the held-out drives have shown.
    pub fn complete(&self, mut answer: Answer) -> Answer {
        let shrink = &mut answer.shrink;
        [shrink.before, shrink.after] = self.errors.map(Some);
        shrink.closed = self.closed.map(|closed| closed[0]);
        shrink.closed_low = self.closed.map(|closed| closed[1]);
        shrink.closed_high = self.closed.map(|closed| closed[2]);
        shrink.position_error_2s_m = self.position_error_2s_m;
        answer.errors_by_quantity.clone_from(&self.errors_by_quantity);
        answer
    }
}
