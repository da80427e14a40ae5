//! Result files: written whole or not at all, into a folder that was tried out before the work.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use data_encoding::HEXLOWER;
use serde::Serialize;
use sha2::{Digest, Sha256};
use tempfile::NamedTempFile;

/// Bytes written at a time while a folder is tried out.
const BLOCK_BYTES: usize = 1 << 20;

/// A result that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder cannot be made or written, or has no room.
    #[error("{}: expected a folder with room for {needed_bytes} bytes, found: {source}", folder.display())]
    Folder {
        /// Folder as given.
        folder: PathBuf,
        /// Room that was asked for.
        needed_bytes: u64,
        /// What the system said.
        source: io::Error,
    },
    /// The file cannot be written; what stood there before still stands.
    #[error("{}: expected a file that can be written, found: {source}", path.display())]
    File {
        /// Path as given.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The value has no form in JSON.
    #[error("{}: expected a value that JSON can hold, found: {source}", path.display())]
    NoJson {
        /// Path as given.
        path: PathBuf,
        /// What the serialiser said.
        source: serde_json::Error,
    },
}

/// Makes a folder, with its parents, and tries it out: writes `needed_bytes` and takes them away again, so that a
/// full disk, a quota or a missing right is found before the work and not after.
///
/// Errors: [`OutputError::Folder`].
pub fn prepare_out_dir(folder: &Path, needed_bytes: u64) -> Result<(), OutputError> {
    let attempt = || {
        std::fs::create_dir_all(folder)?;
        let mut probe = NamedTempFile::new_in(folder)?;
        let block = vec![0x5a; BLOCK_BYTES];
        let mut left = needed_bytes;
        while left > 0 {
            let now = left.min(BLOCK_BYTES as u64);
            probe.write_all(&block[..now as usize])?;
            left -= now;
        }
        // Some file systems find out that they are full only when the bytes really go there.
        probe.as_file().sync_data()
    };
    attempt().map_err(|source| OutputError::Folder { folder: folder.to_owned(), needed_bytes, source })
}

/// Writes a file by way of a temporary one beside it: readers see the old content or the new, never a part, even
/// after a crash. Errors: [`OutputError::File`].
pub fn write_bytes_atomic(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomic(path, |file| file.write_all(bytes))
}

/// Writes a value as indented JSON with a final newline, as [`write_bytes_atomic`] does. Numbers that are not finite
/// become null. Errors: also [`OutputError::NoJson`].
pub fn write_json_atomic(path: &Path, value: &impl Serialize) -> Result<(), OutputError> {
    let mut text = serde_json::to_vec_pretty(value)
        .map_err(|source| OutputError::NoJson { path: path.to_owned(), source })?;
    text.push(b'\n');
    write_bytes_atomic(path, &text)
}

/// SHA-256 of a configuration, as 64 hexadecimal digits. Taken over its JSON with sorted keys, so that neither the
/// order nor the comments of a file matter.
///
/// Errors: the value has no form in JSON, e.g. a map whose keys are no strings.
pub fn config_hash(config: &impl Serialize) -> Result<String, serde_json::Error> {
    let canonical = serde_json::to_string(&serde_json::to_value(config)?)?;
    Ok(sha256(canonical.as_bytes()))
}

/// SHA-256 as 64 hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    HEXLOWER.encode(&Sha256::digest(bytes))
}

/// Lets `write` fill a temporary file beside `path` and puts it in place once it is on the disk.
pub(crate) fn write_atomic(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), OutputError> {
    let attempt = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut file = new_file_in(folder)?;
        write(file.as_file_mut())?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    };
    attempt().map_err(|source| OutputError::File { path: path.to_owned(), source })
}

/// Temporary files are private by default; a result is as readable as any other file of its user.
fn new_file_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.prefix(".surefoot-").tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_replaced_whole_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes_atomic(&path, b"old and longer").unwrap();
        write_bytes_atomic(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_failed_write_leaves_the_old_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes_atomic(&path, b"old").unwrap();
        let broken = write_atomic(&path, |file| {
            file.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(
            broken.unwrap_err().to_string().contains("a.txt: expected a file that can be written, found: ")
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.txt"]);
        assert!(write_bytes_atomic(folder.path(), b"x").is_err(), "a folder stands there");
        assert!(write_bytes_atomic(&folder.path().join("absent/a.txt"), b"x").is_err());
    }

    #[test]
    #[cfg(unix)]
    fn results_are_as_readable_as_other_files() {
        use std::os::unix::fs::MetadataExt as _;
        let folder = tempfile::tempdir().unwrap();
        let (plain, result) = (folder.path().join("plain"), folder.path().join("result"));
        fs::write(&plain, b"").unwrap();
        write_bytes_atomic(&result, b"").unwrap();
        assert_eq!(fs::metadata(plain).unwrap().mode(), fs::metadata(result).unwrap().mode());
    }

    #[test]
    fn json_ends_with_a_newline_and_refuses_what_it_cannot_hold() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write_json_atomic(&path, &BTreeMap::from([("b", 1.5), ("a", f64::NAN)])).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "{\n  \"a\": null,\n  \"b\": 1.5\n}\n");
        let error = write_json_atomic(&path, &BTreeMap::from([([1, 2], 3)])).unwrap_err();
        assert!(error.to_string().contains("a.json: expected a value that JSON can hold, found: "));
    }

    #[test]
    fn a_folder_is_made_tried_out_and_left_empty() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("a/b");
        prepare_out_dir(&folder, BLOCK_BYTES as u64 + 3).unwrap();
        assert!(names(&folder).is_empty());
        fs::write(folder.join("taken"), b"").unwrap();
        let message = prepare_out_dir(&folder.join("taken"), 1).unwrap_err().to_string();
        assert!(message.contains("taken: expected a folder with room for 1 bytes, found: "), "{message}");
    }

    #[test]
    fn the_hash_is_sha_256_and_knows_no_order() {
        // SHA-256 of `null` and of `{"a":1,"b":2}`, from coreutils' sha256sum.
        let hash_of_null = "74234e98afe7498fb5daf1f36ac2d78acc339464f950703b8c019892f982b90b";
        let hash_of_map = "43258cff783fe7036d8a43033f830adfc60ec037382473548ac742b888292777";
        assert_eq!(config_hash(&()).unwrap(), hash_of_null);
        #[derive(Serialize)]
        struct Backwards {
            b: u8,
            a: u8,
        }
        assert_eq!(config_hash(&Backwards { b: 2, a: 1 }).unwrap(), hash_of_map);
    }
}
