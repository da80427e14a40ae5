//! Elevation files: the real ones, and small ones written by other libraries.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::io::Write as _;
use std::path::{Path, PathBuf};

use formats::{ElevationFile, PngScale, read_elevation, read_elevation_png};
use ndarray::{Array2, ShapeBuilder, arr0, arr2};
use ndarray_npy::NpzWriter;
use terrain::{Cell, GridMap};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

fn terrain_data(name: &str) -> ElevationFile {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/terrain"));
    read_elevation(&folder.join(name)).unwrap()
}

fn relief_m(map: &GridMap<f32>) -> f32 {
    let known = || map.values().iter().copied().filter(|height| height.is_finite());
    known().fold(f32::MIN, f32::max) - known().fold(f32::MAX, f32::min)
}

#[test]
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

/// Three rows from the south, four columns; row 1, column 2 is a hole.
fn hill() -> Array2<f32> {
    arr2(&[[0.0, 1.0, 2.0, 3.0], [10.0, 11.0, f32::NAN, 13.0], [20.0, 21.0, 22.5, 23.0]])
}

fn assert_is_hill(file: &ElevationFile, tolerance_m: f32) {
    assert_eq!((file.elevation.geometry().n_rows, file.elevation.geometry().n_cols), (3, 4));
    assert_eq!(file.n_holes, 1);
    for ((row, col), expected) in hill().indexed_iter() {
        let found = file.elevation[Cell { row, col }];
        let equal = (found - expected).abs() <= tolerance_m || (found.is_nan() && expected.is_nan());
        assert!(equal, "row {row}, column {col}: expected {expected}, found {found}");
    }
}

/// A folder for one test's files.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        std::fs::write(self.path(name), bytes).unwrap();
        self.path(name)
    }

    /// An archive written by another library.
    fn npz(&self, fill: impl FnOnce(&mut NpzWriter<std::fs::File>)) -> PathBuf {
        let path = self.path("a.npz");
        let mut writer = NpzWriter::new_compressed(std::fs::File::create(&path).unwrap());
        fill(&mut writer);
        writer.finish().unwrap();
        path
    }

    fn refusal(&self, path: &Path) -> String {
        let message = read_elevation(path).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        message.replace(&format!("{}/", self.0.path().display()), "")
    }
}

#[test]
fn npz_of_any_number_type_and_order_gives_the_same_hill() {
    let folder = Folder::new();
    let cell = arr0(0.5_f64);
    let mut fortran = Array2::<f64>::zeros((3, 4).f());
    fortran.assign(&hill().mapv(f64::from));
    let path = folder.npz(|npz| {
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
    let path = folder.npz(|npz| {
        npz.add_array("elevation", &whole).unwrap();
        npz.add_array("cell", &arr0(1_i32)).unwrap();
        npz.add_array("water", &water).unwrap();
    });
    let file = read_elevation(&path).unwrap();
    assert_eq!(file.elevation.values(), [1.0, -2.0, 300.0, 4.0]);
    assert_eq!(file.layers.water.unwrap().values(), [0.0, 1.0, 0.0, 0.0]);
}

#[test]
fn npz_refusals_name_file_field_expected_and_found() {
    let folder = Folder::new();
    let flat = Array2::<f32>::zeros((3, 4));
    let refuse = |elevation: &Array2<f32>, cell: f32| {
        folder.refusal(&folder.npz(|npz| {
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
        "a.npz: elevation: expected 2 x 2 to 67108864 cells, found 1 x 4"
    );
}

#[test]
fn npz_with_missing_or_misshapen_arrays_is_refused() {
    let folder = Folder::new();
    let flat = Array2::<f32>::zeros((3, 4));
    let refuse = |fill: &dyn Fn(&mut NpzWriter<std::fs::File>)| folder.refusal(&folder.npz(|npz| fill(npz)));
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
fn a_hostile_npz_is_refused_without_being_believed() {
    let folder = Folder::new();
    let refuse = |descriptor: &str, shape: &str, data: &[u8]| {
        let header = format!("{{'descr': '{descriptor}', 'fortran_order': False, 'shape': {shape}, }}");
        folder.refusal(&raw_npz(&folder, &header, data))
    };
    // 4 TB by its header, 16 bytes in truth.
    assert_eq!(
        refuse("<f4", "(1000000, 1000000)", &[0; 16]),
        "a.npz: elevation: expected at most 67108864 cells, found shape [1000000, 1000000]"
    );
    assert_eq!(
        refuse("<f4", "(8000, 8000)", &[0; 16]),
        "a.npz: elevation: expected 256000000 bytes, found 16 bytes"
    );
    assert_eq!(refuse("<f4", "(2, 2)", &[0; 20]), "a.npz: elevation: expected 16 bytes, found more bytes");
    assert!(refuse("<f4", "(18446744073709551615, 2)", &[]).contains("expected at most 67108864 cells"));
    assert!(refuse("<f4", "(-3, 2)", &[]).contains("expected a NumPy header with 'shape'"));
    assert_eq!(
        refuse("<U8", "(2, 2)", &[0; 128]),
        "a.npz: elevation: expected type f4, f8, i1 to i8, u1 to u8 or b1, found type <U8"
    );
    let path = raw_npz(&folder, "no dictionary", &[]);
    assert!(folder.refusal(&path).contains("expected a NumPy header with 'descr'"));
}

#[test]
fn truncated_or_damaged_files_are_refused() {
    let folder = Folder::new();
    let whole = std::fs::read(folder.npz(|npz| {
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

/// The hill as an image, from the north, with `hole` in the hole's place.
fn hill_from_north(hole: f32) -> Vec<f32> {
    let rows = hill();
    (0..3)
        .rev()
        .flat_map(|row| (0..4).map(move |col| (row, col)))
        .map(|place| rows[place])
        .map(|height| if height.is_nan() { hole } else { height })
        .collect()
}

/// A GeoTIFF of the hill with 2 m pixels; the tags are what the caller says.
fn geotiff(folder: &Folder, pixels: &[f32], tags: &[(Tag, Vec<f64>)], no_data: Option<&str>) -> PathBuf {
    let path = folder.path("a.tif");
    let mut encoder = TiffEncoder::new(std::fs::File::create(&path).unwrap()).unwrap();
    let mut image = encoder.new_image::<colortype::Gray32Float>(4, 3).unwrap();
    for (tag, values) in tags {
        if *tag == Tag::GeoKeyDirectoryTag {
            let keys: Vec<u16> = values.iter().map(|value| *value as u16).collect();
            image.encoder().write_tag(*tag, keys.as_slice()).unwrap();
        } else {
            image.encoder().write_tag(*tag, values.as_slice()).unwrap();
        }
    }
    if let Some(text) = no_data {
        image.encoder().write_tag(Tag::GdalNodata, text).unwrap();
    }
    image.write_data(pixels).unwrap();
    path
}

fn scale_m(x: f64, y: f64) -> (Tag, Vec<f64>) {
    (Tag::ModelPixelScaleTag, vec![x, y, 0.0])
}

#[test]
fn a_geotiff_is_turned_over_and_placed() {
    let folder = Folder::new();
    // The north-west corner of the raster lies at (500000, 4000006): three rows of 2 m further south ends the map.
    let tie = (Tag::ModelTiepointTag, vec![0.0, 0.0, 0.0, 500_000.0, 4_000_006.0, 0.0]);
    let tags = [scale_m(2.0, 2.0), tie.clone()];
    let file = read_elevation(&geotiff(&folder, &hill_from_north(-9999.0), &tags, Some("-9999"))).unwrap();
    assert_is_hill(&file, 0.0);
    assert_eq!(file.elevation.geometry().resolution_m, 2.0);
    assert_eq!(file.file_south_west_m, [500_000.0, 4_000_000.0]);
    // A point raster ties the pixel's centre: half a pixel further west and north.
    let point = (Tag::GeoKeyDirectoryTag, vec![1.0, 1.0, 0.0, 1.0, 1025.0, 0.0, 1.0, 2.0]);
    let tags = [scale_m(2.0, 2.0), tie, point];
    let file = read_elevation(&geotiff(&folder, &hill_from_north(f32::NAN), &tags, Some("nan"))).unwrap();
    assert_is_hill(&file, 0.0);
    assert_eq!(file.file_south_west_m, [499_999.0, 4_000_001.0]);
}

#[test]
fn geotiff_refusals_name_tag_expected_and_found() {
    let folder = Folder::new();
    let refuse = |pixels: &[f32], tags: &[(Tag, Vec<f64>)], no_data| {
        folder.refusal(&geotiff(&folder, pixels, tags, no_data))
    };
    let solid = hill_from_north(0.0);
    let square = [scale_m(2.0, 2.0)];
    assert_eq!(
        refuse(&solid, &[], None),
        "a.tif: tag 33550 (pixel scale): expected the edges of a pixel in metres, found no such tag"
    );
    assert_eq!(
        refuse(&solid, &[scale_m(2.0, 3.0)], None),
        "a.tif: tag 33550 (pixel scale): expected square pixels, found 2 x 3 m"
    );
    assert!(
        refuse(&solid, &[scale_m(-2.0, 2.0)], None)
            .ends_with("expected a finite number of metres > 0, found -2")
    );
    assert_eq!(
        refuse(&hill_from_north(f32::NAN), &square, None),
        "a.tif: pixels: expected finite heights, or tag 42113 to declare the value of holes, \
         found NaN at row 1, column 2 from the north-west"
    );
    assert!(
        refuse(&solid, &square, Some("none")).ends_with("tag 42113 (no data): expected a number, found none")
    );
    assert!(
        refuse(&hill_from_north(f32::INFINITY), &square, None)
            .contains("found inf at row 1, column 2 from the south")
    );
    let directory = |key: f64, value: f64| {
        [scale_m(2.0, 2.0), (Tag::GeoKeyDirectoryTag, vec![1.0, 1.0, 0.0, 1.0, key, 0.0, 1.0, value])]
    };
    assert!(
        refuse(&solid, &directory(1024.0, 2.0), None).contains("expected projected metres, found longitude")
    );
    assert!(
        refuse(&solid, &directory(3076.0, 9002.0), None)
            .contains("expected metres (unit 9001), found unit 9002")
    );
    let whole = std::fs::read(geotiff(&folder, &solid, &square, None)).unwrap();
    for length in [0, 7, whole.len() / 2, whole.len() - 1] {
        let message = folder.refusal(&folder.write("a.tif", &whole[..length]));
        assert!(message.contains("expected a complete GeoTIFF"), "{length}: {message}");
    }
    let path = folder.path("rgb.tif");
    let mut encoder = TiffEncoder::new(std::fs::File::create(&path).unwrap()).unwrap();
    encoder.write_image::<colortype::RGB8>(4, 3, &[0; 36]).unwrap();
    assert!(
        folder.refusal(&path).starts_with("rgb.tif: pixel type: expected one band of heights, found RGB")
    );
}

fn write_png(folder: &Folder, color: png::ColorType, depth: png::BitDepth, bytes: &[u8]) -> PathBuf {
    let path = folder.path("a.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&path).unwrap(), 4, 3);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
    path
}

const HILL_SCALE: PngScale =
    PngScale { height_min_m: -10.0, height_max_m: 30.0, cell_m: 0.25, no_data: Some(65535) };

/// The hill between -10 and 30 m in steps of 40 / 65535 m.
fn hill_png(folder: &Folder) -> PathBuf {
    let value =
        |height: f32| if height.is_nan() { 65535 } else { ((height + 10.0) / 40.0 * 65535.0).round() as u16 };
    let bytes: Vec<u8> = hill_from_north(f32::NAN).into_iter().flat_map(|h| value(h).to_be_bytes()).collect();
    write_png(folder, png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes)
}

#[test]
fn a_png_is_scaled_by_its_sidecar() {
    let folder = Folder::new();
    let path = hill_png(&folder);
    let half_step_m = 0.5 * 40.0 / 65535.0 + 1e-6;
    assert_is_hill(&read_elevation_png(&path, HILL_SCALE).unwrap(), half_step_m);
    folder.write("a.png.toml", b"height_min_m = -10\nheight_max_m = 30.0\ncell_m = 0.25\nno_data = 65535\n");
    let file = read_elevation(&path).unwrap();
    assert_is_hill(&file, half_step_m);
    assert_eq!(file.elevation.geometry().resolution_m, 0.25);
}

#[test]
fn png_refusals_name_file_line_and_field() {
    let folder = Folder::new();
    let path = hill_png(&folder);
    let message = read_elevation(&path).unwrap_err().to_string();
    assert!(message.contains("a.png.toml: expected a readable text file, found: "), "{message}");
    let refuse = |sidecar: &str| {
        folder.write("a.png.toml", sidecar.as_bytes());
        read_elevation(&path).unwrap_err().to_string().replace(&format!("{}/", folder.0.path().display()), "")
    };
    assert_eq!(
        refuse("height_min_m = 5\nheight_max_m = 5\ncell_m = 1"),
        "a.png.toml:2: height_max_m: expected a finite number > height_min_m = 5, found 5"
    );
    assert_eq!(
        refuse("height_min_m = 5\nheight_max_m = 6\n\ncell_m = 0"),
        "a.png.toml:4: cell_m: expected a finite number of metres > 0, found 0"
    );
    assert!(refuse("scale = 2").starts_with("a.png.toml:1: scale: expected one of "));
    let whole = std::fs::read(&path).unwrap();
    let path = folder.write("a.png", &whole[..whole.len() / 2]);
    let message = read_elevation_png(&path, HILL_SCALE).unwrap_err().to_string();
    assert!(message.contains("expected a complete PNG"), "{message}");
    let path = write_png(&folder, png::ColorType::Grayscale, png::BitDepth::Eight, &[0; 12]);
    let message = read_elevation_png(&path, HILL_SCALE).unwrap_err().to_string();
    assert!(
        message.ends_with("pixel type: expected grey, 16 bits, found Grayscale, Eight bits"),
        "{message}"
    );
}
