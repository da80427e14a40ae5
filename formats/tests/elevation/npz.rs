//! NumPy archives.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use formats::{ElevationFile, read_elevation};
use ndarray::{Array2, ShapeBuilder, arr0, arr2};
use ndarray_npy::NpzWriter;
use terrain::GridMap;

use crate::hill::{Folder, assert_is_hill, hill};

fn terrain_data(name: &str) -> ElevationFile {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/terrain"));
    read_elevation(&folder.join(name)).unwrap()
}

fn relief_m(map: &GridMap<f32>) -> f32 {
    let known = || map.values().iter().copied().filter(|height| height.is_finite());
    known().fold(f32::MIN, f32::max) - known().fold(f32::MAX, f32::min)
}

#[test]
#[ignore = "needs the shared data"]
fn real_terrain_is_as_its_notes_say() {
    let cases = [
        ("lidr_topography.npz", 286, 286, 1.0, 25.8, 0.0),
        ("usgs_1m.npz", 1000, 1000, 1.0, 89.3, 0.0),
        ("bijou_gully_5m.npz", 77, 105, 4.9887447, 56.8, 0.0),
        ("monoforce_tradr.npz", 80, 80, 0.2, 4.9, 0.740),
    ];
    for (name, n_rows, n_cols, cell_m, relief, holes) in cases {
        let file = terrain_data(name);
        let geometry = file.elevation.geometry();
        assert_eq!((geometry.n_rows, geometry.n_cols), (n_rows, n_cols), "{name}");
        assert_eq!(geometry.resolution_m, cell_m, "{name}: the decimal that was meant, not its f32");
        assert!((relief_m(&file.elevation) - relief).abs() < 0.05 + 1e-3, "{name}");
        let share = file.n_holes as f64 / geometry.n_cells() as f64;
        assert!((share - holes).abs() < 5e-4, "{name}: {share}");
    }
}

#[test]
#[ignore = "needs the shared data"]
fn the_forest_has_its_layers() {
    let layers = terrain_data("lidr_topography.npz").layers;
    let range = |map: &Option<GridMap<f32>>| {
        let values = map.as_ref().unwrap().values().iter().filter(|value| value.is_finite());
        (values.clone().copied().fold(f32::MAX, f32::min), values.copied().fold(f32::MIN, f32::max))
    };
    let (low, high) = range(&layers.low_vegetation_fraction);
    assert!(low >= 0.0 && high <= 1.0 && high > 0.3, "a share: {low} to {high}");
    assert_eq!(range(&layers.water), (0.0, 1.0), "a mask of bytes");
    let (low, high) = range(&layers.canopy_height_m);
    assert!(low > -1.0 && (5.0..60.0).contains(&high), "trees: {low} to {high}");
    assert!(range(&layers.ground_gap_m).0 >= 0.0);
    assert!(terrain_data("usgs_1m.npz").layers.water.is_none());
}

/// An archive written by another library.
fn write_npz(folder: &Folder, fill: impl FnOnce(&mut NpzWriter<std::fs::File>)) -> PathBuf {
    let path = folder.path("a.npz");
    let mut writer = NpzWriter::new_compressed(std::fs::File::create(&path).unwrap());
    fill(&mut writer);
    writer.finish().unwrap();
    path
}

#[test]
fn npz_of_any_number_type_and_order_gives_the_same_hill() {
    let folder = Folder::new();
    let cell = arr0(0.5_f64);
    let mut fortran = Array2::<f64>::zeros((3, 4).f());
    fortran.assign(&hill().mapv(f64::from));
    let path = write_npz(&folder, |npz| {
        npz.add_array("elevation", &fortran).unwrap();
        npz.add_array("cell", &cell).unwrap();
        npz.add_array("note", &arr0(1_i64)).unwrap();
    });
    let file = read_elevation(&path).unwrap();
    assert_is_hill(&file, 0.0);
    assert_eq!(file.elevation.geometry().resolution_m, 0.5);
    assert_eq!(file.elevation.geometry().south_west_m(), [0.0, 0.0]);
    // The centre of the north-eastern cell: 3.5 and 2.5 cells of 0.5 m.
    assert_eq!(file.elevation.at(1.75, 1.25), Some(&23.0));

    let whole = arr2(&[[1_i16, -2], [300, 4]]);
    let water = arr2(&[[false, true], [false, false]]);
    let path = write_npz(&folder, |npz| {
        npz.add_array("elevation", &whole).unwrap();
        npz.add_array("cell", &arr0(1_i32)).unwrap();
        npz.add_array("water", &water).unwrap();
    });
    let file = read_elevation(&path).unwrap();
    assert_eq!(file.elevation.values(), [1.0, -2.0, 300.0, 4.0]);
    assert_eq!(file.layers.water.unwrap().values(), [0.0, 1.0, 0.0, 0.0]);
}

#[test]
fn layers_come_back_by_their_names_and_are_absent_where_they_are_not_there() {
    let folder = Folder::new();
    let layer = |first: f32| Array2::from_shape_fn((3, 4), |(row, col)| first + (4 * row + col) as f32);
    let path = write_npz(&folder, |npz| {
        npz.add_array("elevation", &hill()).unwrap();
        npz.add_array("cell", &arr0(1.0_f64)).unwrap();
        npz.add_array("canopy_height", &layer(100.0)).unwrap();
        npz.add_array("low_veg_fraction", &layer(200.0)).unwrap();
        npz.add_array("ground_gap", &layer(300.0)).unwrap();
    });
    let layers = read_elevation(&path).unwrap().layers;
    let of = |map: Option<GridMap<f32>>| map.unwrap().values().to_vec();
    assert_eq!(of(layers.canopy_height_m), layer(100.0).into_raw_vec_and_offset().0);
    assert_eq!(of(layers.low_vegetation_fraction), layer(200.0).into_raw_vec_and_offset().0);
    assert_eq!(of(layers.ground_gap_m), layer(300.0).into_raw_vec_and_offset().0);
    assert!(layers.water.is_none());
}

#[test]
fn npz_refusals_name_file_field_expected_and_found() {
    let folder = Folder::new();
    let flat = Array2::<f32>::zeros((3, 4));
    let refuse = |elevation: &Array2<f32>, cell: f32| {
        folder.refusal(&write_npz(&folder, |npz| {
            npz.add_array("elevation", elevation).unwrap();
            npz.add_array("cell", &arr0(cell)).unwrap();
        }))
    };
    let cell = "a.npz: cell: expected a finite number of metres > 0, found ";
    assert_eq!(refuse(&flat, 0.0), format!("{cell}0"));
    assert_eq!(refuse(&flat, -0.5), format!("{cell}-0.5"));
    assert_eq!(refuse(&flat, f32::NAN), format!("{cell}NaN"));
    let mut spike = flat.clone();
    spike[[2, 1]] = f32::INFINITY;
    assert_eq!(
        refuse(&spike, 1.0),
        "a.npz: elevation: expected finite heights, or NaN where nothing was measured, \
         found inf at row 2, column 1 from the south-west"
    );
    assert_eq!(
        refuse(&flat.mapv(|_| f32::NAN), 1.0),
        "a.npz: elevation: expected at least one measured cell, found holes only"
    );
    assert_eq!(
        refuse(&Array2::zeros((1, 4)), 1.0),
        "a.npz: elevation: expected at least 2 x 2 cells, found 1 x 4"
    );
}

#[test]
fn npz_with_missing_or_misshapen_arrays_is_refused() {
    let folder = Folder::new();
    let flat = Array2::<f32>::zeros((3, 4));
    let refuse =
        |fill: &dyn Fn(&mut NpzWriter<std::fs::File>)| folder.refusal(&write_npz(&folder, |npz| fill(npz)));
    let missing = refuse(&|npz| {
        npz.add_array("height", &flat).unwrap();
        npz.add_array("cell", &arr0(1.0_f64)).unwrap();
    });
    assert_eq!(missing, "a.npz: elevation: expected an array of this name, found only: cell, height");
    let cube = refuse(&|npz| {
        npz.add_array("elevation", &ndarray::Array3::<f32>::zeros((2, 2, 2))).unwrap();
        npz.add_array("cell", &arr0(1.0_f64)).unwrap();
    });
    assert_eq!(cube, "a.npz: elevation: expected shape [row, col], found shape [2, 2, 2]");
    let layer = refuse(&|npz| {
        npz.add_array("elevation", &flat).unwrap();
        npz.add_array("cell", &arr0(1.0_f64)).unwrap();
        npz.add_array("water", &Array2::<u8>::zeros((4, 3))).unwrap();
    });
    assert_eq!(layer, "a.npz: water: expected elevation's shape [3, 4], found shape [4, 3]");
}

/// An archive whose `elevation` is what the caller writes, header and all.
fn raw_npz(folder: &Folder, header: &str, data: &[u8]) -> PathBuf {
    let path = folder.path("a.npz");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    let array = |header: &str, data: &[u8]| {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    };
    let options = zip::write::SimpleFileOptions::default();
    archive.start_file("elevation.npy", options).unwrap();
    archive.write_all(&array(header, data)).unwrap();
    archive.start_file("cell.npy", options).unwrap();
    let scalar = "{'descr': '<f8', 'fortran_order': False, 'shape': (), }";
    archive.write_all(&array(scalar, &1.0_f64.to_le_bytes())).unwrap();
    archive.finish().unwrap();
    path
}

#[test]
fn ground_that_is_too_flat_to_be_measured_is_unpacked_up_to_a_million_cells() {
    let folder = Folder::new();
    let flat = |side: usize| {
        let path = folder.path("a.npz");
        let mut npz = NpzWriter::new_compressed(std::fs::File::create(&path).unwrap());
        npz.add_array("elevation", &Array2::<f32>::zeros((side, side))).unwrap();
        npz.add_array("cell", &arr0(1.0_f64)).unwrap();
        npz.finish().unwrap();
        path
    };
    assert_eq!(read_elevation(&flat(1024)).unwrap().elevation.geometry().n_cells(), 1 << 20);
    // 10 MB in some 10 kB.
    let told = folder.refusal(&flat(1600));
    assert!(told.starts_with("a.npz: elevation: expected at most 1048576 cells in a file of "), "{told}");
    assert!(told.ends_with(" bytes, found shape [1600, 1600]"), "{told}");
}

#[test]
fn a_hostile_npz_is_refused_without_being_believed() {
    let folder = Folder::new();
    let refuse = |descriptor: &str, shape: &str, data: &[u8]| {
        let header = format!("{{'descr': '{descriptor}', 'fortran_order': False, 'shape': {shape}, }}");
        folder.refusal(&raw_npz(&folder, &header, data))
    };
    // 4 TB by its header, 16 bytes in truth.
    let told = refuse("<f4", "(1000000, 1000000)", &[0; 16]);
    assert!(told.starts_with("a.npz: elevation: expected at most 1048576 cells in a file of "), "{told}");
    assert!(told.ends_with(" bytes, found shape [1000000, 1000000]"), "{told}");
    assert_eq!(
        refuse("<f4", "(1000, 1000)", &[0; 16]),
        "a.npz: elevation: expected 4000000 bytes, found 16 bytes"
    );
    assert_eq!(refuse("<f4", "(2, 2)", &[0; 20]), "a.npz: elevation: expected 16 bytes, found more bytes");
    assert!(refuse("<f4", "(18446744073709551615, 2)", &[]).contains("expected at most 1048576 cells"));
    assert!(refuse("<f4", "(-3, 2)", &[]).contains("expected a NumPy header with 'shape'"));
    assert_eq!(
        refuse("<U8", "(2, 2)", &[0; 128]),
        "a.npz: elevation: expected type f2, f4, f8, i1 to i8, u1 to u8 or b1, found type <U8"
    );
    let path = raw_npz(&folder, "no dictionary", &[]);
    assert!(folder.refusal(&path).contains("expected a NumPy header with 'descr'"));
}

#[test]
fn truncated_or_damaged_files_are_refused() {
    let folder = Folder::new();
    let whole = std::fs::read(write_npz(&folder, |npz| {
        npz.add_array("elevation", &hill()).unwrap();
        npz.add_array("cell", &arr0(1.0_f64)).unwrap();
    }))
    .unwrap();
    for length in [0, 1, 30, whole.len() / 2, whole.len() - 1] {
        let message = folder.refusal(&folder.write("a.npz", &whole[..length]));
        assert!(message.starts_with("a.npz: file: expected a complete NumPy archive"), "{message}");
    }
    // One flipped bit in the compressed heights: the archive's checksum notices.
    let mut damaged = whole.clone();
    damaged[70] ^= 1;
    let message = folder.refusal(&folder.write("a.npz", &damaged));
    assert!(message.starts_with("a.npz: elevation: expected "), "{message}");
    assert!(folder.refusal(&folder.path("absent.npz")).contains("expected a readable file, found: "));
    assert!(folder.refusal(folder.0.path()).contains("expected the extension npz, tif, tiff or png"));
    std::fs::create_dir(folder.path("folder.npz")).unwrap();
    assert!(folder.refusal(&folder.path("folder.npz")).contains("expected a readable file, found: "));
}
