//! Grids of numbers in CSV: one row per step east, one column per step north, no header.

use std::path::Path;
use std::str::FromStr;

use super::GapVehicleError;

/// Heights and classes at the nodes of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GapGround {
    /// Position of node (0, 0): east, north [m].
    pub origin_m: [f64; 2],
    /// Between nodes [m].
    pub resolution_m: f64,
    /// Number of nodes east and north.
    pub n_nodes: [usize; 2],
    /// Heights, north index fastest: node (i east, j north) at `i * n_nodes[1] + j` [m].
    pub height_m: Vec<f32>,
    /// Classes in the same order: 0 open, 1 loose, 2 vegetation.
    pub class: Vec<u8>,
}

/// The cells of a grid and its shape.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid<T> {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Row after row.
    pub cells: Vec<T>,
}

/// Reads a grid whose cells `is_allowed`. Errors: unreadable file, rows of different lengths, fewer than two rows or
/// columns, a cell that is not `expected`.
pub(super) fn read_grid<T: FromStr + Copy>(
    path: &Path,
    expected: &str,
    is_allowed: impl Fn(T) -> bool,
) -> Result<Grid<T>, GapVehicleError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|source| GapVehicleError::Unreadable { file: file.clone(), source })?;
    let refuse = |line: usize, column: usize, expected: String, found: String| {
        Err(GapVehicleError::Cell { file: file.clone(), line, column, expected, found })
    };
    let (mut n_rows, mut n_columns, mut cells) = (0, 0, Vec::new());
    for (row, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let before = cells.len();
        for (column, cell) in line.split(',').enumerate() {
            match cell.trim().parse().ok().filter(|value| is_allowed(*value)) {
                Some(value) => cells.push(value),
                None => return refuse(row + 1, column + 1, expected.into(), format!("'{}'", cell.trim())),
            }
        }
        let length = cells.len() - before;
        if n_rows > 0 && length != n_columns {
            return refuse(row + 1, length, format!("{n_columns} columns as above"), length.to_string());
        }
        (n_rows, n_columns) = (n_rows + 1, length);
    }
    if n_rows < 2 || n_columns < 2 {
        let found = format!("{n_rows} x {n_columns}");
        return refuse(1, 1, "at least 2 rows (x) and 2 columns (y)".into(), found);
    }
    Ok(Grid { shape: [n_rows, n_columns], cells })
}
