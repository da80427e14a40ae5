//! Predictions of held-out measurements: as CSV, and as the strip of one drive.

use std::path::Path;

use bicycle::{Column, DriveLog, Run};
use sim_to_real::{Drives, Prediction, PredictionModel};

use super::{HeldOutSample, HeldOutStrip};

/// The horizon that the strip shows [s].
const STRIP_HORIZON_S: f64 = 1.2;

/// Names of all runs of all drives, in order: the drive's without its folder, and the run if it has a name.
pub(super) fn run_names(drives: &Drives) -> Vec<String> {
    let of_log = |(log, name): (&DriveLog, &String)| {
        let file =
            Path::new(name).file_name().map_or(name.clone(), |file| file.to_string_lossy().into_owned());
        let name = move |run: Run<'_>| match run.name() {
            "" => file.clone(),
            run => format!("{file} {run}"),
        };
        log.runs().map(name).collect::<Vec<_>>()
    };
    drives.logs.iter().zip(&drives.names).flat_map(of_log).collect()
}

/// `log,t0,horizon_s,model,x,y,yaw,vx,wz`: every prediction, numbers as they come back bit by bit.
pub(super) fn csv(predictions: &[Prediction], run_names: &[String]) -> String {
    let names: Vec<String> = run_names.iter().map(|name| quoted(name)).collect();
    let row = |p: &Prediction| {
        let model = match p.model {
            PredictionModel::Nominal => "nominal",
            PredictionModel::Repaired => "repaired",
        };
        let name = names.get(p.log).map_or("", String::as_str);
        // The grid of starts and horizons is one of hundredths; what sums of steps add to it is rounding.
        let (start_s, horizon_s) = (rounded(p.start_s), rounded(p.horizon_s));
        let [x, y, yaw, vx, wz] = [p.x_m, p.y_m, p.yaw_rad, p.speed_mps, p.yaw_rate_radps];
        format!("{name},{start_s},{horizon_s},{model},{x},{y},{yaw},{vx},{wz}\n")
    };
    let header = "log,t0,horizon_s,model,x,y,yaw,vx,wz\n".to_owned();
    header + &predictions.iter().map(row).collect::<String>()
}

/// To a microsecond.
fn rounded(time_s: f64) -> f64 {
    (time_s * 1e6).round() / 1e6
}

/// A cell of a CSV file.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// The held-out run with the most predictions, the first of them, with what both models had predicted for it; `None` without predictions or measurements.
pub(super) fn strip(
    predictions: &[Prediction],
    logs: &[DriveLog],
    run_names: &[String],
) -> Option<HeldOutStrip> {
    let n_of = |log: usize| predictions.iter().filter(|p| p.log == log).count();
    let shown = (0..run_names.len()).rev().max_by_key(|&log| n_of(log))?;
    let run = logs.iter().flat_map(DriveLog::runs).nth(shown)?;
    let of = |model| {
        let is_shown = move |p: &&Prediction| {
            p.log == shown && p.model == model && (p.horizon_s - STRIP_HORIZON_S).abs() < 1e-6
        };
        predictions.iter().filter(is_shown)
    };
    let pairs = of(PredictionModel::Nominal).zip(of(PredictionModel::Repaired));
    let same = pairs.take_while(|(nominal, repaired)| nominal.start_s == repaired.start_s);
    let samples: Vec<_> = same.filter_map(|(nominal, repaired)| sample(&run, nominal, repaired)).collect();
    let drive = run_names.get(shown)?.clone();
    (samples.len() > 1).then_some(HeldOutStrip { drive, horizon_s: STRIP_HORIZON_S, samples })
}

fn sample(run: &Run<'_>, nominal: &Prediction, repaired: &Prediction) -> Option<HeldOutSample> {
    let time_s = nominal.start_s + nominal.horizon_s;
    let row = run.time_s().partition_point(|time| *time < time_s - 1e-6);
    let measured = |column| run.column(column)?.get(row).copied();
    let (x_m, y_m) = (measured(Column::X)?, measured(Column::Y)?);
    Some(HeldOutSample {
        time_s,
        yaw_rate_radps: [measured(Column::Wz)?, nominal.yaw_rate_radps, repaired.yaw_rate_radps],
        speed_mps: [measured(Column::Vx)?, nominal.speed_mps, repaired.speed_mps],
        position_error_m: [nominal, repaired].map(|p| (p.x_m - x_m).hypot(p.y_m - y_m)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::DriveRow;

    fn drive() -> DriveLog {
        let mut log = DriveLog::default();
        for k in 0..300 {
            let time_s = 10.0 + 0.02 * f64::from(k);
            let row = DriveRow::new(time_s).with(Column::X, time_s).with(Column::Y, 0.0);
            log.push("", &row.with(Column::Vx, 1.0).with(Column::Wz, 0.1 * time_s)).unwrap();
        }
        log
    }

    fn prediction(start_s: f64, model: PredictionModel) -> Prediction {
        let x_m = start_s + STRIP_HORIZON_S + if model == PredictionModel::Nominal { 0.3 } else { 0.0 };
        let (speed_mps, yaw_rate_radps) = (1.1, 0.5);
        Prediction {
            log: 0,
            start_s,
            horizon_s: STRIP_HORIZON_S,
            model,
            x_m,
            y_m: 0.4,
            yaw_rad: 0.0,
            speed_mps,
            yaw_rate_radps,
        }
    }

    #[test]
    fn the_strip_holds_measurement_and_predictions_of_the_same_instant() {
        let both = [PredictionModel::Nominal, PredictionModel::Repaired];
        let predictions: Vec<_> =
            both.iter().flat_map(|model| [11.5, 11.7].map(|start_s| prediction(start_s, *model))).collect();
        let strip = strip(&predictions, &[drive()], &["d.csv".to_owned()]).unwrap();
        let first = strip.samples[0];
        assert!(
            (first.time_s - 12.7).abs() < 1e-9 && (first.yaw_rate_radps[0] - 1.27).abs() < 1e-9,
            "{first:?}"
        );
        // 3-4-5: 0.3 m ahead and 0.4 m aside; the repaired one only aside.
        assert!(
            (first.position_error_m[0] - 0.5).abs() < 1e-9 && (first.position_error_m[1] - 0.4).abs() < 1e-9
        );
        assert_eq!((strip.samples.len(), strip.drive.as_str()), (2, "d.csv"));
    }

    #[test]
    fn the_table_has_a_row_per_prediction_and_quotes_names() {
        let row = Prediction {
            start_s: 1.500_000_000_000_2,
            horizon_s: 0.300_000_000_000_000_04,
            ..prediction(0.0, PredictionModel::Repaired)
        };
        let table = csv(&[row], &["a,b.csv".to_owned()]);
        let expected =
            "log,t0,horizon_s,model,x,y,yaw,vx,wz\n\"a,b.csv\",1.5,0.3,repaired,1.2,0.4,0,1.1,0.5\n";
        assert_eq!(table, expected);
    }
}
