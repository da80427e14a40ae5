//! Points of one sweep of a range sensor, as a NumPy archive: `xyz` [point, 3] in metres, sensor frame.

use std::io::Cursor;
use std::path::Path;

use crate::numpy::{open, required};
use crate::refusal::{ArrayFileError, Refusal};

/// Reads the points of a file [m]. Some may be no numbers, as sensors give them; whoever maps them drops these.
///
/// # Errors
/// Unreadable file, and all that [`parse_scan_points`] refuses.
pub fn read_scan_points(path: &Path) -> Result<Vec<[f32; 3]>, ArrayFileError> {
    let (name, bytes) = ArrayFileError::read(path)?;
    parse_scan_points(&name, &bytes)
}

/// Reads points from a file's bytes; `name` is how errors call it.
///
/// # Errors
/// Truncated archive, no array `xyz` or one of another shape or type, no point.
pub fn parse_scan_points(name: &str, bytes: &[u8]) -> Result<Vec<[f32; 3]>, ArrayFileError> {
    parse(bytes).map_err(|refusal| ArrayFileError::refused(name, refusal))
}

fn parse(bytes: &[u8]) -> Result<Vec<[f32; 3]>, Refusal> {
    let xyz = required(&mut open(Cursor::new(bytes), bytes.len() as u64)?, "xyz")?;
    if !matches!(xyz.shape.as_slice(), &[n_points, 3] if n_points > 0) {
        let found = format!("{:?}", xyz.shape);
        return Err(Refusal::new("xyz", "shape [points, 3] with at least one point", found));
    }
    Ok(xyz.into_row_major().as_chunks().0.to_vec())
}
