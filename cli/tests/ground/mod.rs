//! Measured ground as its users have it: a NumPy archive of layers, made of functions of the place.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;

use ndarray::Array2;
use ndarray_npy::NpzWriter;

/// A layer's name in the archive, and its value at a place east and north [m].
pub type Layer<'a> = (&'a str, &'a dyn Fn(f64, f64) -> f64);

/// Writes a square of `side_m` metres, one cell a metre, south-west corner at the origin.
pub fn write(path: &Path, side_m: usize, layers: &[Layer]) {
    let mut npz = NpzWriter::new(std::fs::File::create(path).unwrap());
    npz.add_array("cell", &ndarray::arr0(1.0_f64)).unwrap();
    for (name, value) in layers {
        let at = |(row, col)| value(col as f64 + 0.5, row as f64 + 0.5) as f32;
        npz.add_array(*name, &Array2::from_shape_fn((side_m, side_m), at)).unwrap();
    }
    npz.finish().unwrap();
}
