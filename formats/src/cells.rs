//! How many cells a file may hold: compression is believed as far as measured ground ever compresses, so that a few
//! bytes that claim a continent are refused before there is memory for it.

use std::fmt::Display;

use crate::refusal::Refusal;

/// Most cells of an array in any file: 256 MB as f32.
const CELLS_MAX: usize = 1 << 26;
/// Cells that a file of any size may hold in an array, however flat the ground is.
const CELLS_ALWAYS: usize = 1 << 20;
/// Cells of an array for every byte of the file beyond that. Measured ground takes more than a byte for a cell, ground
/// that is mostly holes some tens of cells for a byte; a file that is not compressed has no more than one.
const CELLS_PER_BYTE: usize = 64;

/// Most cells that an array of a file may hold.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellLimit {
    n_cells: usize,
    n_file_bytes: u64,
}

impl CellLimit {
    /// The limit of a file of this size.
    pub fn of(n_file_bytes: u64) -> Self {
        let n_bytes = usize::try_from(n_file_bytes).unwrap_or(usize::MAX);
        let n_cells = n_bytes.saturating_mul(CELLS_PER_BYTE).clamp(CELLS_ALWAYS, CELLS_MAX);
        Self { n_cells, n_file_bytes }
    }

    /// The limit [cells].
    pub fn n_cells(&self) -> usize {
        self.n_cells
    }

    /// The product of the extents, unless it is beyond the limit.
    pub fn check(&self, field: &str, extents: &[usize], found: impl Display) -> Result<usize, Refusal> {
        let n_cells = extents.iter().try_fold(1_usize, |n, extent| n.checked_mul(*extent));
        n_cells.filter(|n| *n <= self.n_cells).ok_or_else(|| {
            let Self { n_cells, n_file_bytes } = self;
            Refusal::new(field, format!("at most {n_cells} cells in a file of {n_file_bytes} bytes"), found)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_grows_with_the_file_between_its_ends() {
        let limits = [0, 1 << 14, 1 << 16, 1 << 40, u64::MAX].map(|n_bytes| CellLimit::of(n_bytes).n_cells());
        assert_eq!(limits, [1 << 20, 1 << 20, 1 << 22, 1 << 26, 1 << 26]);
    }

    #[test]
    fn what_is_beyond_is_refused_with_both_numbers() {
        let limit = CellLimit::of(100);
        assert_eq!(limit.check("a", &[1 << 10, 1 << 10], "").unwrap(), 1 << 20);
        for extents in [&[1 << 10, (1 << 10) + 1][..], &[1 << 40, 1 << 40]] {
            let refusal = limit.check("a", extents, "too many").unwrap_err();
            assert_eq!(refusal.expected, "at most 1048576 cells in a file of 100 bytes");
            assert_eq!((refusal.field.as_str(), refusal.found.as_str()), ("a", "too many"));
        }
    }
}
