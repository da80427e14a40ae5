//! What is to be diagnosed: names and files, before anything but a case's own file is opened.

use std::path::{Path, PathBuf};

use formats::Bag;

use sim_to_real::PoseUnknown;

use crate::UsageError;
use crate::arguments::{self, GapDiagnoseArguments};
use crate::drive_file::Mapping;

/// Which file or name stands for the vehicle, and which files hold its drives.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Request {
    /// Name of the case; without a case file the vehicle's is taken.
    pub name: Option<String>,
    pub vehicle: String,
    pub sim: Vec<PathBuf>,
    pub real: Vec<PathBuf>,
    pub heldout: Vec<PathBuf>,
    /// What columns of CSV drives and topics of bags are called.
    pub mapping: Mapping,
    /// What is not known of the robot's pose sensor.
    pub pose_unknowns: Vec<PoseUnknown>,
}

impl Request {
    pub(super) fn of(arguments: &GapDiagnoseArguments) -> Result<Self, UsageError> {
        let mapping = Mapping::of("--map", &arguments.map, arguments.robot.as_deref())?;
        let unknown = |unknown: &arguments::PoseUnknown| match unknown {
            arguments::PoseUnknown::TimeOffset => PoseUnknown::TimeOffset,
            arguments::PoseUnknown::LeverArm => PoseUnknown::LeverArm,
        };
        let pose_unknowns = arguments.estimate.iter().map(unknown).collect();
        let request = match (&arguments.case, &arguments.vehicle) {
            (Some(case), _) => Self { mapping, pose_unknowns, ..Self::of_case(case)? },
            (None, vehicle) => Self {
                name: None,
                vehicle: vehicle.clone().unwrap_or_default(),
                sim: arguments.sim.clone(),
                real: arguments.real.clone(),
                heldout: arguments.heldout.clone(),
                mapping,
                pose_unknowns,
            },
        };
        request.check()?;
        Ok(request)
    }

    fn of_case(case: &Path) -> Result<Self, UsageError> {
        let case = formats::read_gap_case(case).map_err(UsageError::from_input)?;
        Ok(Self {
            name: Some(case.name),
            vehicle: case.vehicle.to_string_lossy().into_owned(),
            sim: case.sim,
            real: case.real,
            heldout: case.heldout,
            mapping: Mapping::default(),
            pose_unknowns: Vec::new(),
        })
    }

    /// Every file of a drive stands where it is said to and is named once. No message of the held-out ones is read for it.
    fn check(&self) -> Result<(), UsageError> {
        let drives = self.sim.iter().chain(&self.real).chain(&self.heldout);
        let drives: Vec<PathBuf> = drives.flat_map(|path| formats::drive_parts(path)).collect();
        if let Some(missing) = drives.iter().find(|path| !path.is_file() && !Bag::is_at(path)) {
            return Err(UsageError(format!("{}: expected a file, found none", missing.display())));
        }
        let repeated = (0..drives.len()).find(|&drive| drives[..drive].contains(&drives[drive]));
        match repeated.map(|drive| drives[drive].display()) {
            Some(file) => Err(UsageError(format!("{file}: expected each drive once, found it twice"))),
            None => Ok(()),
        }
    }

    /// Files whose names contradict what they are given as. Errors: all of them do.
    pub(super) fn doubtful_names(&self) -> Result<Vec<String>, UsageError> {
        let (of_sim, of_real) = (named(&self.sim, "real", "nominal"), named(&self.real, "sim", "real"));
        let all_contradict = !of_sim.is_empty() && of_sim.len() == self.sim.len();
        if all_contradict && of_real.len() == self.real.len() {
            return Err(UsageError(format!(
                "--sim and --real: expected nominal and real drives, found them swapped? {}",
                of_sim[0]
            )));
        }
        Ok([of_sim, of_real].concat())
    }
}

/// What is to be said of drives whose file's name holds `word`.
fn named(paths: &[PathBuf], word: &str, role: &str) -> Vec<String> {
    let contradicts = |path: &&PathBuf| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
        stem.split(|c: char| !c.is_alphabetic()).any(|part| part == word)
    };
    let doubted = paths.iter().filter(contradicts);
    doubted.map(|path| format!("{}: given as a {role} drive, named '{word}'", path.display())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_contradict_their_role_are_told() {
        let request = Request {
            name: None,
            vehicle: "v".to_owned(),
            sim: vec!["a/real_1.csv".into(), "surreal.csv".into()],
            real: vec!["sim_real/drive.csv".into(), "SIM-2.csv".into()],
            heldout: Vec::new(),
            mapping: Mapping::default(),
            pose_unknowns: Vec::new(),
        };
        let told = request.doubtful_names().unwrap();
        let expected = [
            "a/real_1.csv: given as a nominal drive, named 'real'",
            "SIM-2.csv: given as a real drive, named 'sim'",
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn drives_that_are_all_named_otherwise_are_refused() {
        let with = |sim: &[&str], real: &[&str]| Request {
            name: None,
            vehicle: "v".to_owned(),
            sim: sim.iter().map(PathBuf::from).collect(),
            real: real.iter().map(PathBuf::from).collect(),
            heldout: Vec::new(),
            mapping: Mapping::default(),
            pose_unknowns: Vec::new(),
        };
        let told = with(&["real_1.csv", "real_2.csv"], &["sim_1.csv"]).doubtful_names().unwrap_err().0;
        assert!(told.contains("found them swapped? real_1.csv: given as a nominal drive"), "{told}");
        assert!(with(&[], &["sim_1.csv"]).doubtful_names().is_ok());
        assert!(with(&["real_1.csv"], &["monday.csv"]).doubtful_names().is_ok());
    }

    #[test]
    fn files_that_are_absent_or_twice_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("d.csv");
        std::fs::write(&file, "").unwrap();
        let with = |sim: &Path, real: &Path| Request {
            name: None,
            vehicle: "v".to_owned(),
            sim: vec![sim.to_owned()],
            real: vec![real.to_owned()],
            heldout: Vec::new(),
            mapping: Mapping::default(),
            pose_unknowns: Vec::new(),
        };
        let told = with(&file, &file).check().unwrap_err().0;
        assert!(told.ends_with("d.csv: expected each drive once, found it twice"), "{told}");
        let told = with(&file, &folder.path().join("e.csv")).check().unwrap_err().0;
        assert!(told.ends_with("e.csv: expected a file, found none"), "{told}");
    }
}
