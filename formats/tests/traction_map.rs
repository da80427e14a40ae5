//! Traction maps: what is read, and what is refused.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::io::Cursor;
use std::path::Path;

use formats::{ArrayFileError, TractionMap, parse_traction_map, read_traction_map};
use ndarray::{Array2, Array3, ShapeBuilder, arr0, arr1, arr2};
use ndarray_npy::NpzWriter;
use proptest::prelude::*;
use terrain::Cell;
use traversability::{Bins, Pmf};

/// A map of 2 x 3 cells, of which row 1, column 2 is unknown, before it is written.
struct Draft {
    bin_values: Vec<f32>,
    cell_m: f32,
    elevation: Array2<f32>,
    semantic_id: Array2<u8>,
    unknown: Array2<bool>,
    pmf: Array3<f32>,
    density: Array2<f32>,
    without: &'static str,
}

impl Draft {
    fn new() -> Self {
        // All mass of row r, column c in bin r + 3 c.
        let pmf =
            Array3::from_shape_fn((12, 2, 3), |(bin, row, col)| f32::from(u8::from(bin == row + 3 * col)));
        Self {
            bin_values: Bins::TRACTION.values().to_vec(),
            cell_m: 0.5,
            elevation: arr2(&[[0.0, 0.5, 1.0], [0.25, 0.5, f32::NAN]]),
            semantic_id: arr2(&[[0, 1, 2], [3, 255, 255]]),
            unknown: arr2(&[[false, false, false], [false, false, true]]),
            pmf,
            density: arr2(&[[1.0, 0.5, 0.0], [-1.0, -2.0, f32::NAN]]),
            without: "",
        }
    }

    /// What was measured, four bins higher.
    fn predicted(&self) -> Array3<f32> {
        let n_bins = self.pmf.dim().0;
        Array3::from_shape_fn(self.pmf.raw_dim(), |(bin, row, col)| {
            self.pmf[[(bin + n_bins - 4) % n_bins, row, col]]
        })
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut npz = NpzWriter::new(&mut bytes);
        let predicted = self.predicted();
        let mut fortran = Array3::<f64>::zeros(self.pmf.raw_dim().f());
        fortran.assign(&self.pmf.mapv(f64::from));
        macro_rules! add {
            ($name:literal, $array:expr) => {
                if $name != self.without {
                    npz.add_array($name, $array).unwrap();
                }
            };
        }
        add!("bin_values", &arr1(&self.bin_values));
        add!("cell", &arr0(self.cell_m));
        add!("elevation", &self.elevation);
        add!("semantic_id", &self.semantic_id);
        add!("unknown", &self.unknown);
        add!("measured_linear_pmf", &self.pmf);
        add!("measured_angular_pmf", &fortran);
        add!("predicted_linear_pmf", &predicted);
        add!("predicted_angular_pmf", &predicted);
        add!("predicted_normalised_density", &self.density);
        npz.finish().unwrap();
        bytes.into_inner()
    }

    fn refusal(&self) -> String {
        parse_traction_map("m.npz", &self.bytes()).unwrap_err().to_string()
    }
}

#[test]
fn every_cell_comes_back_where_it_was() {
    let map = parse_traction_map("m.npz", &Draft::new().bytes()).unwrap();
    let geometry = map.geometry();
    assert_eq!((geometry.n_rows, geometry.n_cols, geometry.resolution_m), (2, 3, 0.5));
    assert_eq!(map.known_cells().collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    let place = Cell { row: 1, col: 1 };
    assert_eq!((map.elevation_m[place], map.normalised_density[place]), (0.5, -2.0));
    assert_eq!(map.semantic_id[place], TractionMap::UNKNOWN_CLASS);
    for index in map.known_cells() {
        let Cell { row, col } = geometry.cell(index);
        // The angular map was written in Fortran order.
        for pmf in [&map.measured.linear, &map.measured.angular] {
            assert_eq!(pmf.values()[index].probabilities()[row + 3 * col], 1.0);
        }
        for pmf in [&map.predicted.linear, &map.predicted.angular] {
            assert_eq!(pmf.values()[index].probabilities()[row + 3 * col + 4], 1.0);
        }
    }
    let unknown = Cell { row: 1, col: 2 };
    assert_eq!(map.measured.linear[unknown], Pmf::UNIFORM);
    assert!(map.elevation_m[unknown].is_nan() && map.normalised_density[unknown].is_nan());
}

#[test]
fn rounding_of_half_precision_is_normalised_away() {
    let mut draft = Draft::new();
    draft.pmf.mapv_inplace(|p| p * 1.004);
    let map = parse_traction_map("m.npz", &draft.bytes()).unwrap();
    assert!((map.measured.linear.values()[0].probabilities()[0] - 1.0).abs() < 1e-6);
}

#[test]
fn a_missing_array_is_named() {
    for without in ["bin_values", "cell", "elevation", "unknown", "measured_angular_pmf", "semantic_id"] {
        let told = Draft { without, ..Draft::new() }.refusal();
        assert!(told.starts_with(&format!("m.npz: {without}: expected an array of this name")), "{told}");
    }
}

#[test]
fn wrong_shapes_and_bins_are_refused() {
    let told = Draft { elevation: Array2::zeros((3, 2)), ..Draft::new() }.refusal();
    assert_eq!(told, "m.npz: elevation: expected shape [2, 3], as `unknown` has it, found shape [3, 2]");
    let told = Draft { pmf: Array3::zeros((11, 2, 3)), ..Draft::new() }.refusal();
    assert!(told.contains("measured_linear_pmf: expected shape [12, 2, 3]"), "{told}");
    let mut draft = Draft::new();
    draft.bin_values[5] = 0.5;
    assert!(draft.refusal().starts_with("m.npz: bin_values: expected [0.0, 0.05"), "{}", draft.refusal());
    draft.bin_values = vec![0.0; 3];
    assert!(draft.refusal().contains("found [0.0, 0.0, 0.0]"));
    let told = Draft { cell_m: -1.0, ..Draft::new() }.refusal();
    assert!(told.contains("cell: expected a finite number of metres > 0, found -1"), "{told}");
    let told = Draft { unknown: Array2::from_elem((2, 3), true), ..Draft::new() }.refusal();
    assert!(told.contains("unknown: expected at least one known cell"), "{told}");
}

#[test]
fn numbers_that_are_none_are_told_with_their_place() {
    let mut draft = Draft::new();
    draft.elevation[[0, 2]] = f32::INFINITY;
    assert!(
        draft
            .refusal()
            .contains("elevation: expected finite numbers in known cells, found inf at row 0, column 2")
    );
    let mut draft = Draft::new();
    draft.density[[1, 0]] = f32::NAN;
    assert!(draft.refusal().contains("predicted_normalised_density"), "{}", draft.refusal());
    for (value, found) in
        [(f32::NAN, "the probability NaN"), (-0.5, "the probability -0.5"), (0.5, "the sum 1.5")]
    {
        let mut draft = Draft::new();
        draft.pmf[[7, 1, 0]] = value;
        assert!(
            draft.refusal().contains(&format!("found {found} at row 1, column 0")),
            "{}",
            draft.refusal()
        );
    }
}

#[test]
fn a_truncated_file_is_refused_at_every_length() {
    let bytes = Draft::new().bytes();
    for length in (0..bytes.len()).step_by(7) {
        let told = parse_traction_map("m.npz", &bytes[..length]).unwrap_err();
        assert!(matches!(told, ArrayFileError::Field { .. }), "{length}: {told}");
    }
}

#[test]
fn a_file_that_is_not_there_is_told() {
    let told = read_traction_map(Path::new("nowhere/m.npz")).unwrap_err().to_string();
    assert!(told.starts_with("nowhere/m.npz: expected a readable file, found: "), "{told}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn hostile_bytes_are_refused_or_give_a_sound_map(places in prop::collection::vec((any::<u16>(), any::<u8>()), 1..6)) {
        let mut bytes = Draft::new().bytes();
        for (place, value) in places {
            let place = usize::from(place) % bytes.len();
            bytes[place] = value;
        }
        if let Ok(map) = parse_traction_map("m.npz", &bytes) {
            for index in map.known_cells() {
                prop_assert!(map.elevation_m.values()[index].is_finite());
                prop_assert!(Pmf::new(*map.measured.linear.values()[index].probabilities()).is_ok());
            }
        }
    }
}
