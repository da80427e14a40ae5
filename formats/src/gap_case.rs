//! Sim-to-real cases: which drives belong together, the vehicle they were driven with, the ground they were driven on,
//! and what a labelled set says of them.
//!
//! Keys that the format does not know yet are passed over, so that a newer file can be read; what is needed is
//! demanded.

mod drive;
mod grid;
mod labels;
mod vehicle;

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::{ConfigError, ConfigText};
pub use drive::{DriveFileError, ReadDrive, drive_parts, read_drive, read_drive_named};
pub use grid::GapGround;
pub use labels::{GapKind, GapLabel, parse_gap_labels, read_gap_labels};
pub use vehicle::{
    DescribedVehicle, GapNoise, GapVehicle, GapVehicleError, parse_gap_vehicle, read_described_vehicle,
    read_gap_vehicle,
};

/// Name of the file that a case's folder holds.
const CASE_FILE: &str = "case.toml";

/// A case: paths are as usable from the current folder as the one that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct GapCase {
    /// Name.
    pub name: String,
    /// File of the vehicle.
    pub vehicle: PathBuf,
    /// Nominal drives; may be empty.
    pub sim: Vec<PathBuf>,
    /// Drives to find the cause in.
    pub real: Vec<PathBuf>,
    /// Drives to verify on; may be empty.
    pub heldout: Vec<PathBuf>,
}

#[derive(Deserialize)]
struct CaseFile {
    name: String,
    vehicle: PathBuf,
    #[serde(default)]
    sim: Vec<PathBuf>,
    real: Vec<PathBuf>,
    #[serde(default)]
    heldout: Vec<PathBuf>,
}

/// Reads a case from its folder or from its file. No drive is opened.
///
/// Errors: the file cannot be read or is no TOML, a key is missing or mistyped, `real` is empty, a drive is listed twice.
pub fn read_gap_case(folder_or_file: &Path) -> Result<GapCase, ConfigError> {
    let is_folder = folder_or_file.is_dir();
    let file = if is_folder { folder_or_file.join(CASE_FILE) } else { folder_or_file.to_owned() };
    let text = ConfigText::read(&file)?;
    let case: CaseFile = text.parse()?;
    check(&case, &text)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let from_folder = |paths: Vec<PathBuf>| paths.iter().map(|path| folder.join(path)).collect();
    Ok(GapCase {
        name: case.name,
        vehicle: folder.join(case.vehicle),
        sim: from_folder(case.sim),
        real: from_folder(case.real),
        heldout: from_folder(case.heldout),
    })
}

fn check(case: &CaseFile, text: &ConfigText) -> Result<(), ConfigError> {
    if case.name.trim().is_empty() {
        return Err(text.refuse("name", "a name", "an empty one"));
    }
    if case.real.is_empty() {
        return Err(text.refuse("real", "at least one drive", "none"));
    }
    let listed = [("sim", &case.sim), ("real", &case.real), ("heldout", &case.heldout)];
    let mut seen: Vec<(&str, &PathBuf)> = Vec::new();
    for (field, path) in listed.iter().flat_map(|(field, paths)| paths.iter().map(move |path| (*field, path)))
    {
        if let Some((before, _)) = seen.iter().find(|(_, other)| *other == path) {
            let found = format!("{} in {before} and in {field}", path.display());
            return Err(text.refuse(field, "each drive once", found));
        }
        seen.push((field, path));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str =
        "name = \"c\"\nvehicle = \"../v/vehicle.toml\"\nsim = [\"../v/s.csv\"]\nreal = [\"r.csv\"]\n";

    fn read(text: &str) -> Result<GapCase, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("case.toml"), text).unwrap();
        let case = read_gap_case(folder.path()).map_err(|error| error.to_string());
        case.map(|case| GapCase {
            real: case.real.iter().map(|p| p.strip_prefix(folder.path()).unwrap().to_owned()).collect(),
            vehicle: case.vehicle.strip_prefix(folder.path()).unwrap().to_owned(),
            ..case
        })
    }

    #[test]
    fn paths_are_taken_from_the_case_folder_and_new_keys_are_passed_over() {
        let case = read(&format!("{CASE}seasons = 4\n")).unwrap();
        assert_eq!((case.name.as_str(), case.vehicle.to_str().unwrap()), ("c", "../v/vehicle.toml"));
        assert_eq!((case.real[0].to_str().unwrap(), case.heldout.len()), ("r.csv", 0));
    }

    #[test]
    fn the_file_may_be_named_itself() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("other.toml");
        std::fs::write(&path, CASE).unwrap();
        assert_eq!(read_gap_case(&path).unwrap().real, [folder.path().join("r.csv")]);
        let missing = read_gap_case(&folder.path().join("none")).unwrap_err().to_string();
        assert!(missing.contains("none: expected a readable text file"), "{missing}");
    }

    #[test]
    fn what_no_case_can_be_is_refused_with_line_and_field() {
        let refusals = [
            (
                CASE.replace("name = \"c\"", "name = \" \""),
                "case.toml:1: name: expected a name, found an empty one",
            ),
            (CASE.replace("vehicle", "vehicles"), "vehicle: expected a value, found no such key"),
            (CASE.replace("[\"r.csv\"]", "[]"), "case.toml:4: real: expected at least one drive, found none"),
            (CASE.replace("[\"r.csv\"]", "\"r.csv\""), "case.toml:4: real: expected "),
            (
                CASE.replace("[\"r.csv\"]", "[\"../v/s.csv\"]"),
                "case.toml:4: real: expected each drive once, found ../v/s.csv in sim and in real",
            ),
        ];
        for (text, expected) in refusals {
            let told = read(&text).unwrap_err();
            assert!(told.contains(expected), "{told}");
        }
    }
}
