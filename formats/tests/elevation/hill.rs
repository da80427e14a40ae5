//! A small hill that every format must hold, and folders for its files.

use std::path::{Path, PathBuf};

use formats::{ElevationFile, read_elevation};
use ndarray::{Array2, arr2};
use terrain::Cell;

/// Three rows from the south, four columns; row 1, column 2 is a hole.
pub fn hill() -> Array2<f32> {
    arr2(&[[0.0, 1.0, 2.0, 3.0], [10.0, 11.0, f32::NAN, 13.0], [20.0, 21.0, 22.5, 23.0]])
}

pub fn assert_is_hill(file: &ElevationFile, tolerance_m: f32) {
    assert_eq!((file.elevation.geometry().n_rows, file.elevation.geometry().n_cols), (3, 4));
    assert_eq!(file.n_holes, 1);
    for ((row, col), expected) in hill().indexed_iter() {
        let found = file.elevation[Cell { row, col }];
        let equal = (found - expected).abs() <= tolerance_m || (found.is_nan() && expected.is_nan());
        assert!(equal, "row {row}, column {col}: expected {expected}, found {found}");
    }
}

/// A folder for one test's files.
pub struct Folder(pub tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        std::fs::write(self.path(name), bytes).unwrap();
        self.path(name)
    }

    pub fn refusal(&self, path: &Path) -> String {
        let message = read_elevation(path).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        message.replace(&format!("{}/", self.0.path().display()), "")
    }
}
