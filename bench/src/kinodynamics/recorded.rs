//! A real car's recorded drives: how well yaw rates are foretold from commands, and commands told from driven curvatures.
//!
//! Runs are held out one after the other; whatever is fitted is fitted to the others. Errors are root mean squares over each
//! held-out run, and intervals a bootstrap over runs.

use bicycle::{Column, DriveLog};
use std::ops::ControlFlow;

use kinodynamics::{Desired, InverseModel, Settings, train_without_history};
use rand::RngExt;
use scenarios::stream;
use serde::Serialize;

use super::KinodynamicsError;

/// Commands slower than this ask for no curvature [m/s].
const SPEED_MIN_MPS: f64 = 0.5;
/// Commanded and driven curvatures beyond this are left out: the networks end there [1/m].
const CURVATURE_MAX_PER_M: f64 = 2.0;
/// Every so many rows one is used: neighbours of 50 ms are alike.
const STRIDE: usize = 2;
const DRAWS: usize = 2000;

/// One instant.
#[derive(Clone, Copy, Debug)]
struct Row {
    speed_mps: f64,
    commanded_per_m: f64,
    yaw_rate_radps: f64,
}

/// A value with its 95 % interval over runs.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OverRuns {
    /// Mean over the runs.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Errors of one model on runs that it was not fitted to.
#[derive(Clone, Debug, Serialize)]
pub struct LogRow {
    /// Name.
    pub model: &'static str,
    /// Yaw rate foretold from commands, off by [rad/s].
    pub yaw_rate_radps: Option<OverRuns>,
    /// Command told from the driven curvature, off by [1/m].
    pub curvature_per_m: OverRuns,
    /// The latter in every run [1/m].
    pub curvature_of_runs_per_m: Vec<f64>,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct LogReport {
    /// Names of the runs, in order.
    pub runs: Vec<String>,
    /// Instants used in every run.
    pub n: Vec<usize>,
    /// Identity, bicycle, network.
    pub rows: Vec<LogRow>,
    /// Effects that were fitted without each run: gain of the steering, understeer [s2/m2], most lateral acceleration [m/s2].
    pub effects: Vec<[f64; 3]>,
}

/// Judges identity, bicycle with effects, and network without the unit.
///
/// # Errors
/// Fewer than two runs with the columns wz, cmd_speed and cmd_steer, or data that nothing can be learned from.
pub fn judge_log(
    log: &DriveLog,
    wheelbase_m: f64,
    epochs: usize,
    seed: u64,
) -> Result<LogReport, KinodynamicsError> {
    let (names, runs) = rows(log, wheelbase_m);
    if runs.len() < 2 {
        return Err(KinodynamicsError::TooFewRuns { found: runs.len() });
    }
    let mut errors: [Vec<[f64; 2]>; 3] = Default::default();
    let mut effects = Vec::new();
    for held_out in 0..runs.len() {
        let training: Vec<&[Row]> =
            runs.iter().enumerate().filter(|(k, _)| *k != held_out).map(|(_, run)| &run[..]).collect();
        let test = &runs[held_out];
        let bicycle = Bicycle::fit(&training);
        let mut network = network(&training, epochs, seed)?;
        errors[0].push(errors_of(test, |row| row.speed_mps * row.commanded_per_m, driven_per_m));
        errors[1].push(errors_of(test, |row| bicycle.yaw_rate_radps(row), |row| bicycle.command_per_m(row)));
        errors[2].push(errors_of(
            test,
            |_| f64::NAN,
            |row| {
                let [speed_mps, curvature_per_m] = [row.speed_mps as f32, driven_per_m(row) as f32];
                f64::from(network.command(Desired { speed_mps, curvature_per_m }).curvature_per_m)
            },
        ));
        effects.push([bicycle.gain, bicycle.understeer, bicycle.lateral_max_mps2]);
    }
    let names_of_models = ["identity", "bicycle with effects", "network without IMU"];
    let rows = names_of_models.into_iter().zip(&errors).map(|(model, errors)| LogRow {
        model,
        yaw_rate_radps: errors[0][0].is_finite().then(|| over_runs(errors, 0, seed)),
        curvature_per_m: over_runs(errors, 1, seed),
        curvature_of_runs_per_m: errors.iter().map(|pair| pair[1]).collect(),
    });
    Ok(LogReport { runs: names, n: runs.iter().map(Vec::len).collect(), rows: rows.collect(), effects })
}

fn rows(log: &DriveLog, wheelbase_m: f64) -> (Vec<String>, Vec<Vec<Row>>) {
    let mut named = (Vec::new(), Vec::new());
    for run in log.runs() {
        let rows: Vec<Row> = run
            .drive_rows()
            .step_by(STRIDE)
            .map(|row| Row {
                speed_mps: row.value(Column::CmdSpeed),
                commanded_per_m: row.value(Column::CmdSteer).tan() / wheelbase_m,
                yaw_rate_radps: row.value(Column::Wz),
            })
            .filter(|row| {
                row.speed_mps >= SPEED_MIN_MPS
                    && row.commanded_per_m.abs() <= CURVATURE_MAX_PER_M
                    && driven_per_m(row).abs() <= CURVATURE_MAX_PER_M
            })
            .collect();
        if !rows.is_empty() {
            named.0.push(run.name().to_owned());
            named.1.push(rows);
        }
    }
    named
}

fn driven_per_m(row: &Row) -> f64 {
    row.yaw_rate_radps / row.speed_mps
}

/// Root mean squares of yaw rate and curvature.
fn errors_of(
    test: &[Row],
    yaw_rate_radps: impl Fn(&Row) -> f64,
    mut command_per_m: impl FnMut(&Row) -> f64,
) -> [f64; 2] {
    let (mut yaw, mut curvature) = (0.0, 0.0);
    for row in test {
        yaw += (yaw_rate_radps(row) - row.yaw_rate_radps).powi(2);
        curvature += (command_per_m(row) - row.commanded_per_m).powi(2);
    }
    [yaw, curvature].map(|sum| (sum / test.len() as f64).sqrt())
}

fn over_runs(errors: &[[f64; 2]], which: usize, seed: u64) -> OverRuns {
    let values: Vec<f64> = errors.iter().map(|pair| pair[which]).collect();
    let n = values.len();
    let mut rng = stream(seed, &[0x10C]);
    let mean = |places: &mut dyn Iterator<Item = usize>| places.map(|k| values[k]).sum::<f64>() / n as f64;
    let mut drawn: Vec<f64> = (0..DRAWS).map(|_| mean(&mut (0..n).map(|_| rng.random_range(0..n)))).collect();
    drawn.sort_by(f64::total_cmp);
    let at = |share: f64| drawn[(share * DRAWS as f64) as usize];
    OverRuns { mean: mean(&mut (0..n)), low: at(0.025), high: at(0.975) }
}

/// The kinematic bicycle with a gain of the steering, understeer that grows with the square of the speed, and a most lateral
/// acceleration: curvature = g c / (1 + K v^2), v^2 curvature at most a (Gillespie, Fundamentals of Vehicle Dynamics, ch. 6).
#[derive(Clone, Copy, Debug)]
struct Bicycle {
    gain: f64,
    understeer: f64,
    lateral_max_mps2: f64,
}

impl Bicycle {
    fn yaw_rate_radps(&self, row: &Row) -> f64 {
        let v = row.speed_mps;
        let curvature = self.gain * row.commanded_per_m / (1.0 + self.understeer * v * v);
        let most = self.lateral_max_mps2 / (v * v);
        v * curvature.clamp(-most, most)
    }

    /// The command that drives a curvature, below the most lateral acceleration.
    fn command_per_m(&self, row: &Row) -> f64 {
        let command = driven_per_m(row) * (1.0 + self.understeer * row.speed_mps * row.speed_mps) / self.gain;
        command.clamp(-CURVATURE_MAX_PER_M, CURVATURE_MAX_PER_M)
    }

    /// Least squares of the yaw rate, over a grid that is refined around its best point.
    fn fit(training: &[&[Row]]) -> Self {
        let mut centre = [1.0, 0.1, 8.0];
        let mut reach = [0.4, 0.1, 6.0];
        let square = |[gain, understeer, lateral_max_mps2]: [f64; 3]| {
            let model = Self { gain, understeer, lateral_max_mps2 };
            let rows = training.iter().flat_map(|run| run.iter().step_by(5));
            rows.map(|row| (model.yaw_rate_radps(row) - row.yaw_rate_radps).powi(2)).sum::<f64>()
        };
        for _ in 0..6 {
            let mut best = (f64::INFINITY, centre);
            for k in 0..125 {
                let step = |axis: u32| f64::from((k / 5i32.pow(axis)) % 5 - 2) / 2.0;
                let mut tried = [0, 1, 2].map(|axis| centre[axis] + reach[axis] * step(axis as u32));
                (tried[1], tried[2]) = (tried[1].max(0.0), tried[2].max(1.0));
                let found = square(tried);
                if found < best.0 {
                    best = (found, tried);
                }
            }
            centre = best.1;
            reach = reach.map(|reach| 0.5 * reach);
        }
        let [gain, understeer, lateral_max_mps2] = centre;
        Self { gain, understeer, lateral_max_mps2 }
    }
}

fn network(training: &[&[Row]], epochs: usize, seed: u64) -> Result<InverseModel, KinodynamicsError> {
    let mut examples = Vec::new();
    for (run, rows) in training.iter().enumerate() {
        for (k, row) in rows.iter().enumerate() {
            examples.push(kinodynamics::Example {
                time_s: 0.05 * (STRIDE * k) as f64,
                driven: [row.speed_mps as f32, driven_per_m(row) as f32],
                commanded: [row.commanded_per_m as f32, row.speed_mps as f32],
                window: Vec::new(),
                run,
                ground: None,
            });
        }
    }
    let settings = Settings { epochs, ..Settings::paper(kinodynamics::Architecture::ABLATION, seed) };
    let outcome = train_without_history(&examples, &settings, &mut |_| ControlFlow::Continue(()))?;
    Ok(InverseModel::new(&outcome.checkpoint, bicycle::lanes::Instructions::widest())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::DriveRow;

    /// Three runs of a car that understeers, by arithmetic of its own: curvature 1.1 c / (1 + 0.08 v^2).
    fn log() -> DriveLog {
        let mut log = DriveLog::default();
        for run in 0..3 {
            for k in 0..3000 {
                let t = 0.05 * f64::from(k);
                let (v, c) = (1.5 + (0.31 * t + f64::from(run)).sin(), 0.8 * (0.7 * t).sin());
                let row = DriveRow::new(t)
                    .with(Column::CmdSpeed, v)
                    .with(Column::CmdSteer, (0.324 * c).atan())
                    .with(Column::Wz, v * 1.1 * c / (1.0 + 0.08 * v * v));
                log.push(&run.to_string(), &row).unwrap();
            }
        }
        log
    }

    #[test]
    fn bicycle_finds_the_understeer_of_a_car_and_the_network_comes_near() {
        let report = judge_log(&log(), 0.324, 60, 1).unwrap();
        for [gain, understeer, _] in &report.effects {
            assert!((gain - 1.1).abs() < 0.02 && (understeer - 0.08).abs() < 0.01, "{gain} {understeer}");
        }
        let error = |k: usize| report.rows[k].curvature_per_m.mean;
        assert!(
            error(1) < 0.2 * error(0) && error(2) < 0.7 * error(0),
            "{} {} {}",
            error(0),
            error(1),
            error(2)
        );
    }
}
