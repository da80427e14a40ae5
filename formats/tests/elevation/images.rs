//! GeoTIFF and PNG.

use std::path::PathBuf;

use formats::{PngScale, read_elevation, read_elevation_png};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

use crate::hill::{Folder, assert_is_hill, hill};

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
    assert_eq!(file.reference(), None, "it does not say in which system");
    // Zone 33 of UTM on WGS 84; 32767 is one of the file's own.
    for (code, found) in [(32633, Some(32633)), (32767, None)] {
        let keys = (Tag::GeoKeyDirectoryTag, vec![1.0, 1.0, 0.0, 1.0, 3072.0, 0.0, 1.0, f64::from(code)]);
        let file = read_elevation(&geotiff(&folder, &hill_from_north(0.0), &[scale_m(2.0, 2.0), keys], None))
            .unwrap();
        assert_eq!(file.epsg, found);
    }
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

/// Rewrites a number of 32 bits of a file.
fn overwrite(path: &PathBuf, at: usize, bytes: [u8; 4]) {
    let mut file = std::fs::read(path).unwrap();
    file[at..at + 4].copy_from_slice(&bytes);
    std::fs::write(path, file).unwrap();
}

#[test]
fn images_that_claim_more_than_a_file_of_their_size_holds_are_refused() {
    let folder = Folder::new();
    let path = folder.path("a.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&path).unwrap(), 2000, 1000);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&vec![0; 2 * 2000 * 1000]).unwrap();
    let message = read_elevation_png(&path, HILL_SCALE).unwrap_err().to_string();
    assert!(message.contains("size: expected at most 1048576 cells in a file of "), "{message}");
    assert!(message.ends_with(" bytes, found 1000 x 2000"), "{message}");
    // The first entry of the directory is the width; its value stands in its last four bytes.
    let path = geotiff(&folder, &hill_from_north(0.0), &[scale_m(2.0, 2.0)], None);
    let bytes = std::fs::read(&path).unwrap();
    let directory = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    overwrite(&path, directory + 2 + 8, 1_000_000_u32.to_le_bytes());
    let message = folder.refusal(&path);
    assert!(message.starts_with("a.tif: size: expected at most 1048576 cells in a file of "), "{message}");
    assert!(message.ends_with(" bytes, found 3 x 1000000"), "{message}");
}
