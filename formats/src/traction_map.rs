//! Measured and predicted traction over a map, as a NumPy archive.
//!
//! Arrays, [row, col] with row 0 in the south and [bin, row, col] for distributions, f2, f4 or f8 where nothing else
//! stands: `bin_values` [12], `cell` [m], `elevation` [m], `semantic_id` (u1; 255 = unknown), `unknown` (b1),
//! `measured_linear_pmf`, `measured_angular_pmf`, `predicted_linear_pmf`, `predicted_angular_pmf`,
//! `predicted_normalised_density`.

use std::io::{Cursor, Read, Seek};
use std::path::Path;

use terrain::{GridGeometry, GridMap};
use traversability::{Bins, N_BINS, Pmf};

use crate::numpy::{Archive, open, read_cell_m, required};
use crate::refusal::{ArrayFileError, Refusal};

/// How far the sum of twelve probabilities kept in half precision may lie from one; it is normalised away.
const SUM_TOLERANCE: f32 = 0.01;

/// How far a bin's value may lie from that of [`Bins::TRACTION`].
const BIN_TOLERANCE: f32 = 1e-3;

/// Traction over a map: what was measured, and what a network predicted there. All maps have one geometry.
#[derive(Clone, Debug)]
pub struct TractionMap {
    /// Where something is known. Elsewhere the elevation is NaN, the density NaN, every distribution uniform.
    pub known: GridMap<bool>,
    /// Height of the highest thing in the cell [m].
    pub elevation_m: GridMap<f32>,
    /// Class in the file's own numbering, [`TractionMap::UNKNOWN_CLASS`] where none was seen.
    pub semantic_id: GridMap<u8>,
    /// Distributions of the traction that a vehicle had.
    pub measured: TractionPmfs,
    /// Distributions that a network predicted.
    pub predicted: TractionPmfs,
    /// Log density of the network's features, scaled so that 0 and 1 are the least and the greatest of its training
    /// (EVORA); below 0 a cell is out of distribution.
    pub normalised_density: GridMap<f32>,
}

impl TractionMap {
    /// Class of a cell of which no class is known.
    pub const UNKNOWN_CLASS: u8 = 255;

    /// Where the cells lie.
    pub fn geometry(&self) -> &GridGeometry {
        self.known.geometry()
    }

    /// Positions of the known cells in the row-major arrays.
    pub fn known_cells(&self) -> impl Iterator<Item = usize> + '_ {
        self.known.values().iter().enumerate().filter_map(|(index, known)| known.then_some(index))
    }
}

/// Distributions over [`Bins::TRACTION`] of every cell.
#[derive(Clone, Debug)]
pub struct TractionPmfs {
    /// Achieved over commanded speed.
    pub linear: GridMap<Pmf>,
    /// Achieved over commanded yaw rate.
    pub angular: GridMap<Pmf>,
}

/// Reads a traction map from a file.
///
/// # Errors
/// Unreadable file, and all that [`parse_traction_map`] refuses.
pub fn read_traction_map(path: &Path) -> Result<TractionMap, ArrayFileError> {
    let (name, bytes) = ArrayFileError::read(path)?;
    parse_traction_map(&name, &bytes)
}

/// Reads a traction map from a file's bytes; `name` is how errors call it.
///
/// # Errors
/// Truncated archive, missing array, more cells than such a file holds, wrong shape or type, other bins than [`Bins::TRACTION`], cell size that is not
/// > 0, no known cell, and in known cells: a height or density that is not finite, a distribution that is none.
pub fn parse_traction_map(name: &str, bytes: &[u8]) -> Result<TractionMap, ArrayFileError> {
    parse(bytes).map_err(|refusal| ArrayFileError::refused(name, refusal))
}

fn parse(bytes: &[u8]) -> Result<TractionMap, Refusal> {
    let mut archive = open(Cursor::new(bytes), bytes.len() as u64)?;
    let cell_m = read_cell_m(&mut archive)?;
    check_bins(&mut archive)?;
    let unknown = required(&mut archive, "unknown")?;
    let &[n_rows, n_cols] = unknown.shape.as_slice() else {
        return Err(Refusal::new("unknown", "shape [row, col]", format!("shape {:?}", unknown.shape)));
    };
    if n_rows == 0 || n_cols == 0 {
        return Err(Refusal::new("unknown", "at least 1 x 1 cells", format!("{n_rows} x {n_cols}")));
    }
    let geometry = GridGeometry { resolution_m: cell_m, origin: [0, 0], n_rows, n_cols };
    let known: Vec<bool> = unknown.into_row_major().iter().map(|&flag| flag == 0.0).collect();
    if !known.contains(&true) {
        return Err(Refusal::new("unknown", "at least one known cell", "none"));
    }
    let known = map(geometry, known)?;
    let mut layers = Layers { archive, known: &known };
    Ok(TractionMap {
        elevation_m: layers.finite("elevation")?,
        semantic_id: layers.classes("semantic_id")?,
        measured: layers.pmfs("measured")?,
        predicted: layers.pmfs("predicted")?,
        normalised_density: layers.finite("predicted_normalised_density")?,
        known,
    })
}

fn check_bins<R: Read + Seek>(archive: &mut Archive<R>) -> Result<(), Refusal> {
    let values = required(archive, "bin_values")?.into_row_major();
    let ours = Bins::TRACTION.values();
    let same = values.len() == N_BINS && values.iter().zip(ours).all(|(a, b)| (a - b).abs() <= BIN_TOLERANCE);
    // One more than there should be says enough of an array that is too long.
    let told = &values[..values.len().min(N_BINS + 1)];
    if same { Ok(()) } else { Err(Refusal::new("bin_values", format!("{ours:?}"), format!("{told:?}"))) }
}

fn map<T>(geometry: GridGeometry, values: Vec<T>) -> Result<GridMap<T>, Refusal> {
    let n = values.len();
    GridMap::from_values(geometry, values)
        .ok_or_else(|| Refusal::new("cells", format!("{} cells", geometry.n_cells()), n))
}

/// Reads arrays of one geometry and checks them where the map is known.
struct Layers<'a, R> {
    archive: Archive<R>,
    known: &'a GridMap<bool>,
}

impl<R: Read + Seek> Layers<'_, R> {
    fn values(&mut self, name: &str, leading: &[usize]) -> Result<Vec<f32>, Refusal> {
        let array = required(&mut self.archive, name)?;
        let GridGeometry { n_rows, n_cols, .. } = *self.known.geometry();
        let expected = [leading, &[n_rows, n_cols]].concat();
        if array.shape != expected {
            let told = format!("shape {expected:?}, as `unknown` has it");
            return Err(Refusal::new(name, told, format!("shape {:?}", array.shape)));
        }
        Ok(array.into_row_major())
    }

    fn place(&self, index: usize) -> String {
        let cell = self.known.geometry().cell(index);
        format!("at row {}, column {}", cell.row, cell.col)
    }

    /// Numbers that are finite wherever the map is known, NaN elsewhere.
    fn finite(&mut self, name: &str) -> Result<GridMap<f32>, Refusal> {
        let mut values = self.values(name, &[])?;
        for (index, (value, &known)) in values.iter_mut().zip(self.known.values()).enumerate() {
            if known && !value.is_finite() {
                let found = format!("{value} {}", self.place(index));
                return Err(Refusal::new(name, "finite numbers in known cells", found));
            }
            *value = if known { *value } else { f32::NAN };
        }
        map(*self.known.geometry(), values)
    }

    fn classes(&mut self, name: &str) -> Result<GridMap<u8>, Refusal> {
        let values = self.values(name, &[])?;
        let mut classes = Vec::with_capacity(values.len());
        for (index, value) in values.into_iter().enumerate() {
            if !(value.fract() == 0.0 && (0.0..=255.0).contains(&value)) {
                let found = format!("{value} {}", self.place(index));
                return Err(Refusal::new(name, "whole numbers from 0 to 255", found));
            }
            classes.push(value as u8);
        }
        map(*self.known.geometry(), classes)
    }

    fn pmfs(&mut self, author: &str) -> Result<TractionPmfs, Refusal> {
        Ok(TractionPmfs {
            linear: self.head(&format!("{author}_linear_pmf"))?,
            angular: self.head(&format!("{author}_angular_pmf"))?,
        })
    }

    fn head(&mut self, name: &str) -> Result<GridMap<Pmf>, Refusal> {
        let values = self.values(name, &[N_BINS])?;
        let n_cells = self.known.geometry().n_cells();
        let mut pmfs = vec![Pmf::UNIFORM; n_cells];
        for (index, (pmf, &known)) in pmfs.iter_mut().zip(self.known.values()).enumerate() {
            if known {
                *pmf = distribution(std::array::from_fn(|bin| values[bin * n_cells + index]))
                    .map_err(|found| refused_pmf(name, &format!("{found} {}", self.place(index))))?;
            }
        }
        map(*self.known.geometry(), pmfs)
    }
}

fn refused_pmf(name: &str, found: &str) -> Refusal {
    let expected = format!("probabilities >= 0 whose sum is 1 within {SUM_TOLERANCE} in known cells");
    Refusal::new(name, expected, found)
}

/// Checks and normalises; an error says what stood there.
fn distribution(probabilities: [f32; N_BINS]) -> Result<Pmf, String> {
    let sum: f32 = probabilities.iter().sum();
    if let Some(wrong) = probabilities.iter().find(|p| !(p.is_finite() && **p >= 0.0)) {
        return Err(format!("the probability {wrong}"));
    }
    if (sum - 1.0).abs() > SUM_TOLERANCE {
        return Err(format!("the sum {sum}"));
    }
    Pmf::new(probabilities.map(|p| p / sum)).map_err(|error| error.to_string())
}
