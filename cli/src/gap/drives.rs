//! Drives of a diagnosis: read, screened, split where they break.

use std::path::{Path, PathBuf};

use bicycle::DriveLog;
use formats::ColumnNames;
use sim_to_real::{Gravity, Machine, Steering, Suspicion, screen, screen_sets, split_at_breaks};

use crate::UsageError;

/// Reads drives; what their files leave out is told in `doubts`.
pub(super) fn read(
    paths: &[PathBuf],
    names: &ColumnNames,
    doubts: &mut Vec<String>,
) -> Result<Vec<DriveLog>, UsageError> {
    let mut read_one = |path: &PathBuf| {
        let drive = formats::read_drive_named(path, names).map_err(UsageError::from_input)?;
        if let Some(problem) = drive.ended_early {
            doubts.push(format!("{}: the recording ends early, {problem}", path.display()));
        }
        Ok(drive.log)
    };
    paths.iter().map(&mut read_one).collect()
}

/// The drives without their breaks; what is doubtful is told in `doubts`. Errors: a drive that would be misread.
pub(super) fn screened(
    machine: &Machine,
    paths: &[PathBuf],
    drives: Vec<DriveLog>,
    doubts: &mut Vec<String>,
) -> Result<Vec<DriveLog>, UsageError> {
    let mut screened_one = |(path, log): (&PathBuf, DriveLog)| {
        let found = screen(machine, &log);
        refuse_grave(path, &found)?;
        doubts.extend(found.iter().map(|suspicion| format!("{}: {suspicion}", path.display())));
        let is_broken = found.iter().any(is_break);
        let split = if is_broken { split_at_breaks(machine, &log) } else { Ok(log) };
        split.map_err(|error| UsageError(format!("{}: {}", path.display(), UsageError::from_input(error))))
    };
    paths.iter().zip(drives).map(&mut screened_one).collect()
}

fn refuse_grave(path: &Path, found: &[Suspicion]) -> Result<(), UsageError> {
    match found.iter().find(|suspicion| suspicion.gravity() == Gravity::Refused) {
        Some(grave) => Err(UsageError(format!("{}: {grave}", path.display()))),
        None => Ok(()),
    }
}

fn is_break(suspicion: &Suspicion) -> bool {
    use Suspicion::{Gap, Leap, Reset, YawLeap};
    matches!(suspicion, Gap { .. } | Leap { .. } | Reset { .. } | YawLeap { .. })
}

/// What only all drives together show. Errors: drives that no cause can be found in.
pub(super) fn screen_together(
    machine: &Machine,
    sim: &[DriveLog],
    real: &[DriveLog],
    doubts: &mut Vec<String>,
) -> Result<(), UsageError> {
    let found = screen_sets(machine, sim, real);
    match found.iter().find(|suspicion| suspicion.gravity() == Gravity::Refused) {
        Some(grave) => Err(UsageError(grave.to_string())),
        None => {
            doubts.extend(found.iter().map(ToString::to_string));
            Ok(())
        }
    }
}

/// An effect on the steering means an angle or a yaw rate: drives of both cannot be held against one another.
pub(super) fn refuse_mixed_steering(
    machine: &Machine,
    drives: &[(&[DriveLog], &[PathBuf])],
) -> Result<(), UsageError> {
    let all = drives.iter().flat_map(|(logs, paths)| logs.iter().zip(*paths));
    let told = all.filter_map(|(log, path)| Some((Steering::of(machine, log)?, path)));
    let told: Vec<(Steering, &PathBuf)> = told.collect();
    let Some(&(first, first_path)) = told.first() else { return Ok(()) };
    let word = |steering: Steering| match steering {
        Steering::Angle => "steers by an angle (cmd_steer, steer_meas)",
        Steering::YawRate => "is skid-steered (cmd_wz, wheel_wz)",
    };
    match told.iter().find(|(steering, _)| *steering != first) {
        None => Ok(()),
        Some((other, path)) => Err(UsageError(format!(
            "{}: expected a machine that {} as in {}, found one that {}",
            path.display(),
            word(first),
            first_path.display(),
            word(*other)
        ))),
    }
}

/// A held-out drive must be none of those that the answer was made from.
pub(super) fn refuse_seen(
    heldout: &[DriveLog],
    paths: &[PathBuf],
    seen: &[DriveLog],
    seen_paths: &[&PathBuf],
) -> Result<(), UsageError> {
    for (log, path) in heldout.iter().zip(paths) {
        if let Some((_, same)) = seen.iter().zip(seen_paths).find(|(other, _)| *other == log) {
            let found = format!("the drive of {}", same.display());
            return Err(UsageError(format!(
                "{}: expected a drive not used before, found {found}",
                path.display()
            )));
        }
    }
    Ok(())
}
