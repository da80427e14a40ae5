//! A tile's file: a header, the cells or the one that all are like, and a checksum over all of it.

use super::cell::Packed;
use super::{Key, TILE_EDGE, TileError};
use data_encoding::HEXLOWER;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: &[u8; 8] = b"SFTILE01";
const CHECKSUM_BYTES: usize = 8;
const HEADER_BYTES: usize = 8 + 1 + 16;
/// Name of the file that holds the cells' size.
const RESOLUTION: &str = "resolution_m";

pub(super) fn system(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> TileError {
    let path = path.to_owned();
    move |source| TileError::System { path, action, source }
}

fn path_of(folder: &Path, Key { level, place: [east, north] }: Key) -> PathBuf {
    folder.join(format!("{level}_{east}_{north}.tile"))
}

/// Places of the finest level's tiles in a folder.
pub(super) fn finest(folder: &Path) -> Result<Vec<[i64; 2]>, TileError> {
    let mut places = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(system(folder, "list"))? {
        let name = entry.map_err(system(folder, "list"))?.file_name();
        let place = name.to_str().and_then(|name| {
            let (east, north) = name.strip_prefix("0_")?.strip_suffix(".tile")?.split_once('_')?;
            Some([east.parse().ok()?, north.parse().ok()?])
        });
        places.extend(place);
    }
    Ok(places)
}

/// Writes the size of the cells into a new map, and refuses a map of another.
pub(super) fn agree_on_resolution(folder: &Path, resolution_m: f64) -> Result<(), TileError> {
    let path = folder.join(RESOLUTION);
    match std::fs::read_to_string(&path) {
        Ok(text) if text.trim().parse() == Ok(resolution_m) => Ok(()),
        Ok(text) => Err(TileError::Field {
            path,
            field: "size of the cells [m]",
            expected: resolution_m.to_string(),
            found: text.trim().to_owned(),
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            put(folder, &path, format!("{resolution_m}\n").as_bytes())
        }
        Err(error) => Err(system(&path, "read")(error)),
    }
}

/// Whether a folder says that it holds a map.
pub(super) fn is_at(folder: &Path) -> bool {
    folder.join(RESOLUTION).is_file()
}

/// The size of a map's cells [m].
pub(super) fn resolution_m(folder: &Path) -> Result<f64, TileError> {
    let path = folder.join(RESOLUTION);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => "no such file".to_owned(),
        Err(error) => return Err(system(&path, "read")(error)),
    };
    let found = text.trim();
    found.parse().ok().filter(|size_m: &f64| size_m.is_finite() && *size_m > 0.0).ok_or_else(|| {
        TileError::Field {
            path,
            field: "map in tiles",
            expected: "the size of its cells in metres".to_owned(),
            found: found.to_owned(),
        }
    })
}

/// The cells of a tile's file; `None` where there is none.
pub(super) fn read(folder: &Path, key: Key) -> Result<Option<Vec<Packed>>, TileError> {
    let path = path_of(folder, key);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(system(&path, "read")(error)),
    };
    decode(&bytes, key).map(Some).map_err(|(field, expected, found)| TileError::Field {
        path,
        field,
        expected,
        found,
    })
}

pub(super) fn write(folder: &Path, key: Key, cells: &[Packed]) -> Result<(), TileError> {
    put(folder, &path_of(folder, key), &encode(key, cells))
}

pub(super) fn remove(folder: &Path, key: Key) -> Result<(), TileError> {
    let path = path_of(folder, key);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(system(&path, "remove")(error)),
        _ => Ok(()),
    }
}

fn put(folder: &Path, path: &Path, bytes: &[u8]) -> Result<(), TileError> {
    let attempt = || {
        let mut file = NamedTempFile::new_in(folder)?;
        file.write_all(bytes)?;
        file.persist(path).map_err(io::Error::from)
    };
    attempt().map(drop).map_err(system(path, "write"))
}

fn header(Key { level, place: [east, north] }: Key) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.push(level);
    bytes.extend(east.to_le_bytes());
    bytes.extend(north.to_le_bytes());
    bytes
}

fn encode(key: Key, cells: &[Packed]) -> Vec<u8> {
    let is_uniform = cells.iter().all(|cell| *cell == cells[0]);
    let n_kept = if is_uniform { 1 } else { cells.len() };
    let mut bytes = header(key);
    bytes.reserve(n_kept * Packed::BYTES + CHECKSUM_BYTES);
    for cell in &cells[..n_kept] {
        bytes.extend(cell.to_bytes());
    }
    bytes.extend(xxh3_64(&bytes).to_le_bytes());
    bytes
}

type Fault = (&'static str, String, String);

fn decode(bytes: &[u8], key: Key) -> Result<Vec<Packed>, Fault> {
    const N_CELLS: usize = TILE_EDGE * TILE_EDGE;
    let whole = [1, N_CELLS].map(|n| HEADER_BYTES + n * Packed::BYTES + CHECKSUM_BYTES);
    if !whole.contains(&bytes.len()) {
        return Err(("bytes", format!("{} or {}", whole[0], whole[1]), bytes.len().to_string()));
    }
    let (content, stored) = bytes.split_at(bytes.len() - CHECKSUM_BYTES);
    let sum = xxh3_64(content).to_le_bytes();
    if sum != stored {
        return Err(("checksum", HEXLOWER.encode(&sum), HEXLOWER.encode(stored)));
    }
    if content[..HEADER_BYTES] != header(key) {
        return Err(("header", format!("tile {key:?}"), "that of another tile or version".to_owned()));
    }
    let cells = content[HEADER_BYTES..].as_chunks::<{ Packed::BYTES }>().0;
    let cells: Vec<Packed> = cells.iter().map(|bytes| Packed::from_bytes(*bytes)).collect();
    Ok(if cells.len() == 1 { vec![cells[0]; N_CELLS] } else { cells })
}
