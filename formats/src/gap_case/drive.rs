//! A drive by the ending of its file: CSV, or a recording of our own.

use std::path::{Path, PathBuf};

use bicycle::DriveLog;

use crate::{ColumnNames, DriveLogFileError, McapReadError, read_drive_log_csv_named, read_drive_log_mcap};

/// A drive and what is to be said of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadDrive {
    /// The drive.
    pub log: DriveLog,
    /// Where and why a recording breaks off; `None` when it is complete.
    pub ended_early: Option<String>,
}

/// A drive that cannot be read. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum DriveFileError {
    /// Not a file of a known kind.
    #[error("{file}: expected a drive in a file ending in .csv or .mcap, found another ending")]
    Ending {
        /// Path as given.
        file: String,
    },
    /// The CSV is wrong.
    #[error(transparent)]
    Csv(#[from] DriveLogFileError),
    /// The recording is wrong.
    #[error(transparent)]
    Mcap(#[from] McapReadError),
}

/// Reads a drive from a CSV file or from a recording, whichever the file's ending says.
///
/// Errors: another ending; as [`crate::read_drive_log_csv`] and [`read_drive_log_mcap`].
pub fn read_drive(path: &Path) -> Result<ReadDrive, DriveFileError> {
    read_drive_named(path, &ColumnNames::default())
}

/// The same where the columns of CSV files have names of their own; those of recordings are ours.
///
/// Errors: another ending; as [`read_drive_log_csv_named`] and [`read_drive_log_mcap`].
pub fn read_drive_named(path: &Path, names: &ColumnNames) -> Result<ReadDrive, DriveFileError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match ending.as_str() {
        "csv" => Ok(ReadDrive { log: read_drive_log_csv_named(path, names)?.log, ended_early: None }),
        "mcap" => {
            let read = read_drive_log_mcap(path)?;
            Ok(ReadDrive { log: read.log, ended_early: read.ended_early })
        }
        _ => Err(DriveFileError::Ending { file: path.display().to_string() }),
    }
}

/// The files that hold a drive: one, or several with `+` between them, as `pose.csv+can.csv`. Those after the first are
/// looked for in its folder, then as they are given. A file whose own name holds a `+` is one.
pub fn drive_parts(path: &Path) -> Vec<PathBuf> {
    let Some(mut rest) = path.to_str().filter(|_| !path.exists()) else { return vec![path.to_owned()] };
    let mut parts: Vec<PathBuf> = Vec::new();
    loop {
        let placed = |name: &str| {
            let beside = parts.first().and_then(|first| first.parent()).map(|folder| folder.join(name));
            beside.filter(|path| path.exists()).unwrap_or_else(|| PathBuf::from(name))
        };
        let ends_a_part = |(at, _): &(usize, &str)| placed(&rest[..*at]).exists();
        let cut = rest.match_indices('+').find(ends_a_part).map(|(at, _)| at);
        let part = placed(&rest[..cut.unwrap_or(rest.len())]);
        parts.push(part);
        match cut {
            Some(at) => rest = &rest[at + 1..],
            None => return parts,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_decides_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.CSV");
        std::fs::write(&path, "t,vx\n0,1\n0.1,2\n").unwrap();
        assert_eq!(read_drive(&path).unwrap().log.n_rows(), 2);
        let told = read_drive(Path::new("drive.txt")).unwrap_err().to_string();
        assert_eq!(
            told,
            "drive.txt: expected a drive in a file ending in .csv or .mcap, found another ending"
        );
        std::fs::rename(&path, folder.path().join("drive.mcap")).unwrap();
        assert!(matches!(read_drive(&folder.path().join("drive.mcap")), Err(DriveFileError::Mcap(_))));
    }

    #[test]
    fn a_clock_that_runs_backwards_is_refused_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("d.csv");
        std::fs::write(&path, "t,vx\n0,1\n0.1,2\n0.05,2\n").unwrap();
        let told = read_drive(&path).unwrap_err().to_string();
        assert!(
            told.ends_with("d.csv:4: t: expected a time > 0.1 s, the row before it in run '', found 0.05"),
            "{told}"
        );
    }

    #[test]
    fn a_drive_may_lie_in_several_files() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("c++")).unwrap();
        for name in ["c++/pose.csv", "c++/can.csv", "imu.csv", "c++/a+b.csv"] {
            std::fs::write(at(name), "").unwrap();
        }
        let parts = |text: &str| drive_parts(&at(text));
        assert_eq!(parts("imu.csv"), [at("imu.csv")]);
        assert_eq!(parts("c++/a+b.csv"), [at("c++/a+b.csv")]);
        assert_eq!(
            parts("c++/pose.csv+can.csv+a+b.csv"),
            ["c++/pose.csv", "c++/can.csv", "c++/a+b.csv"].map(at)
        );
        let elsewhere = format!("c++/pose.csv+{}", at("imu.csv").display());
        assert_eq!(parts(&elsewhere), [at("c++/pose.csv"), at("imu.csv")]);
        assert_eq!(parts("c++/pose.csv+none.csv"), [at("c++/pose.csv"), PathBuf::from("none.csv")]);
        assert_eq!(parts("c++/none.csv+can.csv"), [at("c++/none.csv+can.csv")]);
    }
}
