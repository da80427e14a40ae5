//! What the network sees of a rollout, and what is to be explained.

use crate::baseline::Baseline;
use crate::causes::Trial;
use crate::comparison::{Comparison, root_mean_square};
use crate::drive::{Drive, HORIZONS, N_QUANTITIES, N_STEPS, STEP_S, VX, WZ, YAW};
use crate::machine::Machine;
use crate::rollout::{PER_START, Simulator};
use bicycle::Effect;

/// Rows between two corrections.
pub(super) const ROWS_PER_CORRECTION: usize = 5;
/// Corrections of a rollout.
pub(super) const N_CORRECTIONS: usize = N_STEPS / ROWS_PER_CORRECTION;
/// Time between two corrections [s].
pub(super) const CORRECTION_S: f64 = ROWS_PER_CORRECTION as f64 * STEP_S;
/// How long before a correction the commands are seen, in rows.
const LAGS: [usize; 6] = [0, 5, 10, 20, 35, 50];
/// Numbers that the network sees.
pub(super) const N_FEATURES: usize = 2 * LAGS.len() + 15;

/// Rollouts of a model, with what their corrections may depend on.
#[derive(Clone, Debug)]
pub(super) struct Examples {
    /// [`N_CORRECTIONS`] times [`N_FEATURES`] per rollout.
    pub(super) features: Vec<f32>,
    /// Foretold speed [m/s] and turn since the start [rad] at the middle of each correction's time.
    pub(super) foretold: [Vec<f32>; 2],
    /// Foretold less measured, in standard deviations, [`PER_START`] per rollout; exactly 0 where nothing was measured.
    pub(super) residuals: Vec<f32>,
    /// One over the standard deviation of each; 0 where nothing was measured.
    pub(super) per_sigma: Vec<f32>,
}

impl Examples {
    pub(super) fn of(baseline: &Baseline, effects: &[Effect], drives: &[Drive], machine: &Machine) -> Self {
        let all: Vec<&Drive> = drives.iter().collect();
        let comparison = Comparison::new(baseline.wheelbase_m, all, &baseline.yardstick);
        let residuals = Trial::fixed(comparison, effects).residuals(&[]);
        let simulator = Simulator::new(baseline.wheelbase_m, effects);
        let mut examples = Self {
            features: Vec::new(),
            foretold: [Vec::new(), Vec::new()],
            residuals,
            per_sigma: baseline.yardstick.per_sigma(),
        };
        for drive in drives {
            let predicted = simulator.predict(&[drive]);
            for (&start, outcomes) in drive.starts.iter().zip(predicted.chunks(PER_START)) {
                examples.add(drive, machine, (start, outcomes));
            }
        }
        examples
    }

    /// Number of rollouts.
    pub(super) fn n(&self) -> usize {
        self.residuals.len() / PER_START
    }

    fn add(&mut self, drive: &Drive, machine: &Machine, (start, outcomes): (usize, &[f32])) {
        let way = Foretold { drive, start, outcomes };
        for k in 0..N_CORRECTIONS {
            let time_s = (k as f64 + 0.5) * CORRECTION_S;
            let [turn, speed, yaw_rate] = [2, 3, 4].map(|quantity| way.at(quantity, time_s));
            self.foretold[0].push(speed as f32);
            self.foretold[1].push(turn as f32);
            let own = features(drive, machine, start, (time_s, [turn, speed, yaw_rate]));
            self.features.extend(own.map(|value| value as f32));
        }
    }
}

/// What a model foretells after a start, between horizons along straight lines.
struct Foretold<'a> {
    drive: &'a Drive,
    start: usize,
    outcomes: &'a [f32],
}

impl Foretold<'_> {
    fn at(&self, quantity: usize, time_s: f64) -> f64 {
        let first = match quantity {
            3 => self.drive.smooth[VX][self.start],
            4 => self.drive.smooth[WZ][self.start],
            _ => 0.0,
        };
        let mut before = (0.0, first);
        for (horizon, &steps) in HORIZONS.iter().enumerate() {
            let end = (steps as f64 * STEP_S, f64::from(self.outcomes[horizon * N_QUANTITIES + quantity]));
            if time_s <= end.0 {
                return before.1 + (time_s - before.0) / (end.0 - before.0) * (end.1 - before.1);
            }
            before = end;
        }
        before.1
    }
}

fn features(
    drive: &Drive,
    machine: &Machine,
    start: usize,
    (time_s, [turn, speed, yaw_rate]): (f64, [f64; 3]),
) -> [f64; N_FEATURES] {
    let row = (start + (time_s / STEP_S) as usize).min(drive.commands.len() - 1);
    let earlier = |lag: usize| &drive.commands[row.saturating_sub(lag)];
    let steering = |lag: usize| f64::from(earlier(lag).steering_rad) / machine.steering_max_rad;
    let asked = |lag: usize| f64::from(earlier(lag).speed_mps) / machine.speed_max_mps;
    let speed_share = speed / machine.speed_max_mps;
    let (sine, cosine) = (drive.smooth[YAW][start] + turn).sin_cos();
    let [east, north] = [0, 1].map(|axis| f64::from(drive.gradient[axis][row]));
    let class = |own: f32| f64::from(u8::from(drive.class[row] == own));
    let mut features = [0.0; N_FEATURES];
    for (place, &lag) in LAGS.iter().enumerate() {
        features[2 * place] = steering(lag) - if place == 0 { 0.0 } else { steering(0) };
        features[2 * place + 1] = asked(lag) - if place == 0 { 0.0 } else { asked(0) };
    }
    features[2 * LAGS.len()..].copy_from_slice(&[
        time_s,
        speed_share,
        asked(0) - speed_share,
        yaw_rate,
        speed * yaw_rate,
        speed_share * steering(0),
        speed_share * speed_share * steering(0),
        speed_share * steering(0).abs(),
        (drive.smooth[VX][start] - speed) / machine.speed_max_mps,
        sine,
        cosine,
        east * cosine + north * sine,
        north * cosine - east * sine,
        class(1.0),
        class(2.0),
    ]);
    // A column that was not measured is no number.
    features.map(|value| if value.is_finite() { value } else { 0.0 })
}

/// Centres and spreads of the features, and sizes of the corrections.
#[derive(Clone, Debug)]
pub(super) struct Scaling {
    pub(super) centre: Vec<f32>,
    pub(super) per_spread: Vec<f32>,
    /// What one unit of each of the network's outputs is: ahead, to the left [m/s], yaw rate [rad/s], and in the
    /// sensors speed [m/s], yaw rate [rad/s] and speed to the left [m/s].
    pub(super) unit: [f32; N_QUANTITIES],
}

impl Scaling {
    pub(super) fn of(examples: &Examples) -> Self {
        let n = (examples.features.len() / N_FEATURES).max(1) as f32;
        let column = |feature: usize| examples.features.iter().skip(feature).step_by(N_FEATURES);
        let centre: Vec<f32> = (0..N_FEATURES).map(|feature| column(feature).sum::<f32>() / n).collect();
        let per_spread = (0..N_FEATURES).map(|feature| {
            let square = column(feature).map(|value| (value - centre[feature]).powi(2)).sum::<f32>() / n;
            // A feature that hardly changed says nothing here and must not say much elsewhere.
            1.0 / square.sqrt().max(0.02)
        });
        let last = PER_START - N_QUANTITIES;
        let horizon_s = N_STEPS as f32 * STEP_S as f32;
        let unit = std::array::from_fn(|quantity| {
            let place = last + quantity;
            let values: Vec<f32> = examples.residuals.chunks(PER_START).map(|own| own[place]).collect();
            let size = match examples.per_sigma[place] {
                0.0 => 0.0,
                per_sigma => root_mean_square(&values).max(1.0) as f32 / per_sigma,
            };
            if quantity < 3 { size / horizon_s } else { size }
        });
        Self { per_spread: per_spread.collect(), centre, unit }
    }
}
