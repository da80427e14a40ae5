//! Where the results of a drive go, tried out before the work so that nobody drives for nothing.

use std::path::{Path, PathBuf};

use formats::prepare_out_dir;

use crate::UsageError;
use crate::arguments::DriveArguments;

/// Room that must be free beforehand: the recording of a long drive takes less [bytes].
const RECORDING_ROOM_BYTES: u64 = 64 << 20;
/// The same for a lone JSON file [bytes].
const JSON_ROOM_BYTES: u64 = 1 << 16;

/// The files of one drive, in folders that exist and can be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFiles {
    /// `drive.png`.
    pub picture: PathBuf,
    /// `drive.mcap`.
    pub recording: PathBuf,
    /// `summary.json`, and the file of `--json` if one was asked for.
    pub summaries: Vec<PathBuf>,
}

impl OutputFiles {
    /// Makes the folders where they are missing and tries them out.
    ///
    /// # Errors
    /// A folder cannot be made or written, has no room, or `--json` names a folder.
    pub fn prepare(arguments: &DriveArguments) -> Result<Self, UsageError> {
        let file = |name: &str| arguments.out.join(name);
        try_out("--out", &arguments.out, RECORDING_ROOM_BYTES)?;
        let mut summaries = vec![file("summary.json")];
        if let Some(json) = &arguments.json {
            prepare_json(json)?;
            summaries.push(json.clone());
        }
        Ok(Self { picture: file("drive.png"), recording: file("drive.mcap"), summaries })
    }
}

/// Tries out the place of a `--json` file; what stands there is kept until the result replaces it.
///
/// # Errors
/// The path is a folder, or the folder it lies in cannot be made or written.
pub fn prepare_json(path: &Path) -> Result<(), UsageError> {
    if path.is_dir() {
        return Err(UsageError(format!("--json: expected a file, found the folder {}", path.display())));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    try_out("--json", folder.unwrap_or(Path::new(".")), JSON_ROOM_BYTES)
}

fn try_out(option: &str, folder: &Path, room_bytes: u64) -> Result<(), UsageError> {
    prepare_out_dir(folder, room_bytes)
        .map_err(|error| UsageError(format!("{option}: {}", UsageError::from_input(error))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;
    use std::fs;

    fn prepare(words: &[&str]) -> Result<OutputFiles, UsageError> {
        let words = ["surefoot", "drive"].iter().chain(words);
        match Arguments::try_parse_from(words).unwrap().command {
            Command::Drive(drive) => OutputFiles::prepare(&drive),
            _ => unreachable!("the words say drive"),
        }
    }

    #[test]
    fn folder_is_made_and_left_empty() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a/b");
        let files = prepare(&["--out", out.to_str().unwrap()]).unwrap();
        assert_eq!(fs::read_dir(&out).unwrap().count(), 0);
        assert_eq!(files.picture, out.join("drive.png"));
        assert_eq!(files.summaries, [out.join("summary.json")]);
    }

    #[test]
    fn file_in_the_way_is_told() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("taken");
        fs::write(&path, "").unwrap();
        let told = prepare(&["--out", path.to_str().unwrap()]).unwrap_err().0;
        assert!(told.starts_with("--out: ") && told.contains("taken: expected a folder"), "{told}");
    }

    #[test]
    fn json_that_is_a_folder_is_told_and_an_old_file_is_kept() {
        let parent = tempfile::tempdir().unwrap();
        assert!(prepare_json(parent.path()).unwrap_err().0.starts_with("--json: expected a file"));
        let path = parent.path().join("s.json");
        fs::write(&path, "old").unwrap();
        prepare_json(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
    }
}
