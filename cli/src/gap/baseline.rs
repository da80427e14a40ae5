//! What was calibrated on nominal drives, kept for the next case of the same vehicle.
#![allow(clippy::disallowed_methods, reason = "a rebuilt program must not trust what an older one has kept")]

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use bicycle::DriveLog;
use sim_to_real::{Baseline, GapError, Machine};

use super::progress::Progress;
use crate::{Program, summary};

/// The kept baseline of these inputs, else a new one, which is kept. A cache that cannot be read or written costs time
/// and nothing else; that is told in `doubts`.
///
/// Errors: those of the calibration.
pub(super) fn load_or_calibrate(
    machine: &Machine,
    sim: &[DriveLog],
    folder: Option<&Path>,
    doubts: &mut Vec<String>,
) -> Result<Baseline, GapError> {
    let file = folder.and_then(|folder| Some(folder.join(format!("{}.json", key(machine, sim)?))));
    if let Some(kept) = file.as_deref().and_then(load) {
        return Ok(kept);
    }
    let progress = Progress::calibration();
    let baseline = Baseline::calibrate(machine, sim, &|share| progress.reached(share));
    progress.finish();
    let baseline = baseline?;
    if let Some(file) = file
        && let Err(problem) = keep(&baseline, &file)
    {
        doubts.push(format!("the calibration is not kept for the next case: {problem}"));
    }
    Ok(baseline)
}

/// A file of another version, or a damaged one, is as good as none.
fn load(file: &Path) -> Option<Baseline> {
    serde_json::from_slice(&std::fs::read(file).ok()?).ok()
}

fn keep(baseline: &Baseline, file: &Path) -> anyhow::Result<()> {
    file.parent().map_or(Ok(()), std::fs::create_dir_all)?;
    Ok(formats::write_json_atomic(file, baseline)?)
}

/// Where baselines are kept unless told otherwise: the user's cache folder, if there is one.
pub(super) fn default_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let cache = set("XDG_CACHE_HOME").or_else(|| set("HOME").map(|home| home.join(".cache")))?;
    Some(cache.join("surefoot").join("baselines"))
}

/// Hash of everything that a baseline depends on: machine, drives and the program itself.
fn key(machine: &Machine, sim: &[DriveLog]) -> Option<String> {
    let inputs = (format!("{machine:?}"), format!("{sim:?}"), summary::revision(), program());
    formats::config_hash(&inputs).ok()
}

/// Size and time of the program's file: a revision alone does not tell uncommitted changes apart.
fn program() -> Option<(u64, u128)> {
    let file = Program::current().and_then(|program| std::fs::metadata(program.file())).ok()?;
    Some((file.len(), file.modified().ok()?.duration_since(UNIX_EPOCH).ok()?.as_nanos()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::{Column, DriveRow};

    fn drive(speed: f64) -> DriveLog {
        let mut log = DriveLog::default();
        log.push("", &DriveRow::new(0.0).with(Column::Vx, speed)).unwrap();
        log
    }

    fn machine() -> Machine {
        let (wheelbase_m, steering_max_rad, speed_max_mps) = (1.0, 0.5, 2.0);
        Machine {
            name: "m".to_owned(),
            wheelbase_m,
            steering_max_rad,
            speed_max_mps,
            noise: None,
            ground: None,
        }
    }

    #[test]
    fn the_key_follows_machine_and_drives() {
        let first = key(&machine(), &[drive(1.0)]).unwrap();
        assert_eq!(key(&machine(), &[drive(1.0)]).unwrap(), first);
        let nearly = f64::from_bits(1.0_f64.to_bits() + 1);
        assert_ne!(key(&machine(), &[drive(nearly)]).unwrap(), first);
        assert_ne!(key(&machine(), &[drive(1.0), drive(1.0)]).unwrap(), first);
        assert_ne!(key(&Machine { wheelbase_m: nearly, ..machine() }, &[drive(1.0)]).unwrap(), first);
    }

    #[test]
    fn what_is_damaged_is_calibrated_anew() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("b.json");
        std::fs::write(&file, "{ \"half\": ").unwrap();
        assert!(load(&file).is_none() && load(folder.path()).is_none());
    }
}
