//! Where results go: places tried out before the work, so that nobody works for nothing, and files written whole or not
//! at all.

use std::path::{Path, PathBuf};

use formats::OutputError;
use serde::Serialize;

use crate::arguments::{JsonArguments, ResultArguments};
use crate::{UsageError, summary};

/// Room that must be free in a folder beforehand: what a command leaves there takes less [bytes].
const ROOM_BYTES: u64 = 64 << 20;
/// The same for a lone JSON file [bytes].
const JSON_ROOM_BYTES: u64 = 1 << 16;

impl ResultArguments {
    /// Makes the folder where it is missing, and tries out the places of all results.
    ///
    /// # Errors
    /// A folder cannot be made or written, has no room, or `--json` names a folder.
    pub fn prepare(&self) -> Result<(), UsageError> {
        prepare_folder("--out", &self.out)?;
        self.copy.prepare()
    }

    /// A file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.out.join(name)
    }

    /// Writes a file of the folder.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), OutputError> {
        formats::write_bytes_atomic(&self.file(name), bytes)
    }

    /// Writes numbers as JSON into the folder, and to the file of `--json` if one was asked for.
    pub(crate) fn write_json(&self, name: &str, numbers: &impl Serialize) -> Result<(), OutputError> {
        formats::write_json_atomic(&self.file(name), numbers)?;
        self.copy.write(numbers)
    }
}

impl JsonArguments {
    /// Tries out the place of the file; what stands there is kept until the result replaces it.
    ///
    /// # Errors
    /// The path is a folder, or the folder it lies in cannot be made or written.
    pub fn prepare(&self) -> Result<(), UsageError> {
        self.json.as_deref().map_or(Ok(()), |path| prepare_file("--json", path, JSON_ROOM_BYTES))
    }

    /// Writes numbers to the file, if one was asked for.
    pub(crate) fn write(&self, numbers: &impl Serialize) -> Result<(), OutputError> {
        self.json.as_deref().map_or(Ok(()), |path| formats::write_json_atomic(path, numbers))
    }
}

/// Makes the folder that an option names where it is missing, and tries it out.
pub(crate) fn prepare_folder(option: &str, folder: &Path) -> Result<(), UsageError> {
    try_out(option, folder, ROOM_BYTES)
}

/// Tries out the place of the file that an option names, to be written with the same room as a folder's.
pub(crate) fn prepare_large_file(option: &str, path: &Path) -> Result<(), UsageError> {
    prepare_file(option, path, ROOM_BYTES)
}

fn prepare_file(option: &str, path: &Path, room_bytes: u64) -> Result<(), UsageError> {
    if path.is_dir() || path.file_name().is_none() {
        return Err(UsageError(format!("{option}: expected a file, found the folder {}", path.display())));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    try_out(option, folder.unwrap_or(Path::new(".")), room_bytes)
}

fn try_out(option: &str, folder: &Path, room_bytes: u64) -> Result<(), UsageError> {
    formats::prepare_out_dir(folder, room_bytes)
        .map_err(|error| UsageError(format!("{option}: {}", UsageError::from_input(error))))
}

/// Results with the revision of the program that made them.
#[derive(Serialize)]
pub(crate) struct WithRevision<'a, T> {
    revision: &'static str,
    #[serde(flatten)]
    results: &'a T,
}

impl<'a, T> WithRevision<'a, T> {
    pub(crate) fn of(results: &'a T) -> Self {
        Self { revision: summary::revision(), results }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;
    use std::fs;

    fn prepare(words: &[&str]) -> Result<ResultArguments, UsageError> {
        let words = ["surefoot", "drive"].iter().chain(words);
        match Arguments::try_parse_from(words).unwrap().command {
            Command::Drive(drive) => drive.results.prepare().map(|()| drive.results),
            _ => unreachable!("the words say drive"),
        }
    }

    #[test]
    fn folder_is_made_and_left_empty() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a/b");
        let results = prepare(&["--out", out.to_str().unwrap()]).unwrap();
        assert_eq!(fs::read_dir(&out).unwrap().count(), 0);
        assert_eq!(results.file("drive.png"), out.join("drive.png"));
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
        let prepare = |path: &Path| JsonArguments { json: Some(path.to_owned()) }.prepare();
        assert!(prepare(parent.path()).unwrap_err().0.starts_with("--json: expected a file"));
        let path = parent.path().join("s.json");
        fs::write(&path, "old").unwrap();
        prepare(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
    }

    #[test]
    fn numbers_go_to_both_places_with_the_revision_before_them() {
        #[derive(Serialize)]
        struct Numbers {
            share: f64,
        }
        let parent = tempfile::tempdir().unwrap();
        let json = parent.path().join("copy.json");
        let results = ResultArguments {
            out: parent.path().join("out"),
            copy: JsonArguments { json: Some(json.clone()) },
        };
        results.prepare().unwrap();
        results.write_json("numbers.json", &WithRevision::of(&Numbers { share: 0.25 })).unwrap();
        let read = |path: &Path| fs::read_to_string(path).unwrap();
        let value: serde_json::Value = serde_json::from_str(&read(&json)).unwrap();
        assert_eq!(read(&json), read(&results.file("numbers.json")));
        assert_eq!(
            (value["share"].as_f64(), value["revision"].as_str()),
            (Some(0.25), Some(summary::revision()))
        );
    }
}
