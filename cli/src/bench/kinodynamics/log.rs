//! `surefoot bench kinodynamics --log`: a real car's recorded drives.

use std::path::Path;

use ::bench::kinodynamics::{KinodynamicsError, LogReport, OverRuns, VEHICLE, judge_log};

use crate::UsageError;
use crate::arguments::BenchKinodynamicsArguments;

pub(super) fn run(arguments: &BenchKinodynamicsArguments, path: &Path) -> anyhow::Result<()> {
    let log = formats::read_drive_log_csv(path).map_err(UsageError::from_input)?.log;
    let vehicle = formats::read_vehicle(VEHICLE).map_err(UsageError::from_input)?;
    let report = judge_log(&log, vehicle.geometry.wheelbase_m, arguments.epochs, arguments.seed)
        .map_err(told_error)?;
    print!("{}", told(&report));
    let file = arguments.out.join("kinodynamics_log.json");
    for path in [Some(&file), arguments.json.as_ref()].into_iter().flatten() {
        formats::write_json_atomic(path, &report)?;
    }
    println!("\n  {}", file.display());
    Ok(())
}

/// A log that nothing can be learned from is the user's choice; all else is not.
fn told_error(error: KinodynamicsError) -> anyhow::Error {
    match error {
        KinodynamicsError::TooFewRuns { .. } | KinodynamicsError::Train(_) => {
            UsageError::from_input(error).into()
        }
        other => other.into(),
    }
}

fn told(report: &LogReport) -> String {
    let mut told = format!(
        "  {} runs, each foretold by what was fitted to the others\n  {:<24}{:>32}{:>32}\n",
        report.runs.len(),
        "",
        "yaw rate off by [rad/s]",
        "command off by [1/m]"
    );
    for row in &report.rows {
        let yaw = row.yaw_rate_radps.map_or(String::new(), spread);
        told += &format!("  {:<24}{yaw:>32}{:>32}\n", row.model, spread(row.curvature_per_m));
    }
    told += &format!(
        "\n  {:<24}{:>9}{:>12}{:>12}{:>12}   gain, understeer [s2/m2], most lateral [m/s2]\n",
        "run", "instants", "identity", "bicycle", "network"
    );
    for (k, run) in report.runs.iter().enumerate() {
        let errors: String =
            report.rows.iter().map(|row| format!("{:>12.3}", row.curvature_of_runs_per_m[k])).collect();
        let [gain, understeer, most] = report.effects[k];
        told += &format!("  {run:<24}{:>9}{errors}   {gain:.2}, {understeer:.3}, {most:.1}\n", report.n[k]);
    }
    told
}

fn spread(over_runs: OverRuns) -> String {
    let OverRuns { mean, low, high } = over_runs;
    format!("{mean:.3} [{low:.3}, {high:.3}]")
}
