//! What a model knows after one minute of its own data, and after an hour.

use std::ops::ControlFlow;

use bicycle::lanes::Instructions;
use kinodynamics::{Desired, InverseModel, LabelConfig, Recording, label, train};
use serde::Serialize;

use super::teleoperation::{Teleoperation, teleoperate};
use super::{KinodynamicsError, Request, Row, Stage, Watch};

/// Minutes of the drive that all models are judged on; nobody learned from it.
const TEST_MINUTES: u32 = 6;

/// A model after so many minutes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DataPoint {
    /// Minutes of random driving.
    pub minutes: u32,
    /// Which model.
    pub row: Row,
    /// Root mean square of what the commanded curvature is off by on the test drive [1/m].
    pub rmse_per_m: f64,
    /// The same of the wish itself [1/m].
    pub identity_rmse_per_m: f64,
    /// Examples of the test drive.
    pub n: usize,
}

/// Trains ablation and learned model on the first minutes of one drive, and judges them on another.
///
/// # Errors
/// See [`KinodynamicsError`]; too few minutes leave too few examples.
pub fn data_curve(
    request: &Request,
    minutes: &[u32],
    revision: &str,
    watch: &dyn Watch,
) -> Result<Vec<DataPoint>, KinodynamicsError> {
    let most = minutes.iter().copied().max().unwrap_or(1);
    watch.stage(Stage::Driving(u64::from(most + TEST_MINUTES)));
    let drive = |minutes: u32, seed: u64| {
        let asked = Teleoperation { minutes, only: None, seed };
        teleoperate(&request.vehicle, &asked, &|| watch.step())
    };
    let recording = drive(most, request.seed)?;
    let test = drive(TEST_MINUTES, request.seed.wrapping_add(0x7E57))?;
    let mut points = Vec::new();
    for &minutes in minutes {
        let part = Recording { runs: recording.runs[..minutes as usize].to_vec(), ..recording.clone() };
        for row in [Row::Ablation, Row::Learned] {
            let Some(settings) = row.settings(request) else { continue };
            watch.stage(Stage::Training(row, settings.n_passes() as u64));
            let outcome = train(&part, &settings, revision, &mut |_| {
                watch.step();
                if watch.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })?;
            let mut model = InverseModel::new(&outcome.checkpoint, Instructions::widest())?;
            points.push(judge(&mut model, &test, &request.labels.after(&outcome.latency), (minutes, row)));
        }
    }
    Ok(points)
}

fn judge(
    model: &mut InverseModel,
    test: &Recording,
    labels: &LabelConfig,
    (minutes, row): (u32, Row),
) -> DataPoint {
    let (examples, _) = label(test, labels);
    let (mut off, mut identity) = (0.0, 0.0);
    for example in &examples {
        model.sense_columns(&example.window);
        let [speed_mps, curvature_per_m] = example.driven;
        let answer = model.command(Desired { speed_mps, curvature_per_m }).curvature_per_m;
        off += f64::from(answer - example.commanded[0]).powi(2);
        identity += f64::from(curvature_per_m - example.commanded[0]).powi(2);
    }
    let n = examples.len();
    let [rmse_per_m, identity_rmse_per_m] = [off, identity].map(|sum| (sum / n as f64).sqrt());
    DataPoint { minutes, row, rmse_per_m, identity_rmse_per_m, n }
}
