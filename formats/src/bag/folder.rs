//! Which files of a folder are a bag, and in which order.

use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Storage;

/// The file in which a bag tells of itself.
pub(super) const METADATA: &str = "metadata.yaml";
/// Longest such file that is read.
const METADATA_BYTES_MAX: u64 = 1 << 24;

/// What a bag says of itself, as far as it is of use here.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct BagMetadata {
    /// What its files are, by rosbag2's name: mcap or sqlite3.
    #[serde(rename = "storage_identifier")]
    pub storage: String,
    /// Messages of all its files.
    #[serde(rename = "message_count")]
    pub n_messages: u64,
    /// Its files, in their order.
    #[serde(rename = "relative_file_paths")]
    pub files: Vec<PathBuf>,
}

#[derive(Deserialize)]
struct Document {
    rosbag2_bagfile_information: BagMetadata,
}

/// The files of the bag in a folder, and what it says of itself.
#[expect(clippy::type_complexity, reason = "two answers to one question")]
pub(super) fn look(folder: &Path) -> io::Result<(Vec<PathBuf>, Result<Option<BagMetadata>, String>)> {
    let metadata = metadata(folder);
    if let Ok(Some(BagMetadata { files, .. })) = &metadata {
        // Older bags name their own folder, too, which may have been renamed since.
        let names = files.iter().filter_map(|file| file.file_name());
        return Ok((names.map(|name| folder.join(name)).collect(), metadata));
    }
    let mut files = Vec::new();
    for entry in folder.read_dir()? {
        let file = entry?.path();
        files.extend(Storage::of(&file).map(|_| file));
    }
    files.sort_by_cached_key(|file| order(file));
    Ok((files, metadata))
}

fn metadata(folder: &Path) -> Result<Option<BagMetadata>, String> {
    let path = folder.join(METADATA);
    let refused = |problem: String| {
        let problem = problem.split_whitespace().collect::<Vec<_>>().join(" ");
        format!("{METADATA}: expected what rosbag2 writes, found: {problem}")
    };
    let n_bytes = match path.metadata() {
        Ok(file) => file.len(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(refused(error.to_string())),
    };
    if n_bytes > METADATA_BYTES_MAX {
        return Err(refused(format!("{n_bytes} bytes")));
    }
    let text = std::fs::read_to_string(&path).map_err(|error| refused(error.to_string()))?;
    let document: Document = serde_saphyr::from_str(&text).map_err(|error| refused(error.to_string()))?;
    Ok(Some(document.rosbag2_bagfile_information))
}

/// Files are numbered at the ends of their names, without leading zeros.
fn order(file: &Path) -> (String, u64) {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (name, number) = stem.rsplit_once('_').unwrap_or((&stem, ""));
    match number.parse() {
        Ok(number) => (name.to_owned(), number),
        Err(_) => (stem, 0),
    }
}
