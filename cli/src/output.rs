//! The place where results go, tried out before the work so that nobody drives for nothing.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::UsageError;

/// Room that must be free beforehand: the recording of a long drive takes less [bytes].
const ROOM_NEEDED_BYTES: usize = 32 << 20;

/// A folder that exists, can be written and has room.
#[derive(Clone, Debug)]
pub struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// Makes the folder where it is missing and tries it out.
    ///
    /// # Errors
    /// The folder cannot be made or written, or has no room for a recording.
    pub fn prepare(path: &Path) -> Result<Self, UsageError> {
        let refuse = |error: io::Error| refuse("--out", path, &error);
        fs::create_dir_all(path).map_err(refuse)?;
        try_out(path, ROOM_NEEDED_BYTES).map_err(refuse)?;
        Ok(Self { path: path.to_owned() })
    }

    /// Path of a file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

/// Tries out the folder that a result file shall lie in; the file itself stays as it is.
///
/// # Errors
/// The path is a folder, or the folder it lies in is missing or cannot be written.
pub fn check_file(option: &str, path: &Path) -> Result<(), UsageError> {
    if path.is_dir() {
        return Err(UsageError(format!("{option}: expected a file, found the folder {}", path.display())));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    try_out(folder.unwrap_or(Path::new(".")), 4096).map_err(|error| refuse(option, path, &error))
}

fn refuse(option: &str, path: &Path, error: &io::Error) -> UsageError {
    UsageError(format!("{option}: expected a place that can be written, found {}: {error}", path.display()))
}

/// Writes a file of the given size and removes it again.
fn try_out(folder: &Path, n_bytes: usize) -> io::Result<()> {
    let path = folder.join(format!(".surefoot-{}", std::process::id()));
    let written = fill(&path, n_bytes);
    let removed = fs::remove_file(&path);
    written.and(removed)
}

/// A full disk may show only when the bytes really go there, hence the sync.
fn fill(path: &Path, n_bytes: usize) -> io::Result<()> {
    let mut file = File::create(path)?;
    let block = vec![0x5a_u8; 1 << 16];
    let mut left = n_bytes;
    while left > 0 {
        let now = left.min(block.len());
        file.write_all(&block[..now])?;
        left -= now;
    }
    file.sync_data()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folder_is_made_and_left_empty() {
        let parent = tempfile::tempdir().unwrap();
        let folder = OutputFolder::prepare(&parent.path().join("a/b")).unwrap();
        assert_eq!(fs::read_dir(parent.path().join("a/b")).unwrap().count(), 0);
        assert_eq!(folder.file("drive.png"), parent.path().join("a/b/drive.png"));
    }

    #[test]
    fn file_in_the_way_is_told() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("taken");
        fs::write(&path, "").unwrap();
        let error = OutputFolder::prepare(&path).unwrap_err();
        assert!(error.0.starts_with("--out: expected") && error.0.contains("taken"), "{error}");
    }

    #[test]
    fn json_in_a_missing_folder_is_told_and_an_old_file_is_kept() {
        let parent = tempfile::tempdir().unwrap();
        assert!(check_file("--json", &parent.path().join("missing/s.json")).is_err());
        assert!(check_file("--json", parent.path()).is_err());
        let path = parent.path().join("s.json");
        fs::write(&path, "old").unwrap();
        check_file("--json", &path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
    }
}
