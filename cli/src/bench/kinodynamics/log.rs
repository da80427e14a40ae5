//! `surefoot bench kinodynamics --log`: a real car's recorded drives.

use std::path::Path;

use ::bench::kinodynamics::{KinodynamicsError, VEHICLE, judge_log};

use crate::UsageError;
use crate::arguments::BenchKinodynamicsArguments;

pub(super) fn run(arguments: &BenchKinodynamicsArguments, path: &Path) -> anyhow::Result<()> {
    let log = formats::read_drive_log_csv(path).map_err(UsageError::from_input)?.log;
    let vehicle = formats::read_vehicle(VEHICLE).map_err(UsageError::from_input)?;
    let report = judge_log(&log, vehicle.geometry.wheelbase_m, arguments.epochs, arguments.seed)
        .map_err(told_error)?;
    print!("{}", report::kinodynamics::log_text(&report));
    let file = "kinodynamics_log.json";
    arguments.results.write_json(file, &report)?;
    println!("\n  {}", arguments.results.file(file).display());
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
