//! Elevation as GeoTIFF: one band, square pixels, projected metres; pixel scale from tag 33550, place from tag 33922,
//! the value of holes from GDAL's tag 42113. Rows come from the north and are turned over.

use std::io::{Read, Result as ReadResult, Seek, SeekFrom};

use terrain::GridGeometry;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use super::{ElevationFile, Refusal, assemble, check_cell, check_shape, flip_rows};
use crate::cells::CellLimit;

/// Keys of the GeoKey directory (GeoTIFF 1.1, section 7) and what they may say.
mod key {
    pub(super) const MODEL_TYPE: u64 = 1024;
    pub(super) const MODEL_TYPE_GEOGRAPHIC: u64 = 2;
    pub(super) const RASTER_TYPE: u64 = 1025;
    pub(super) const RASTER_TYPE_POINT: u64 = 2;
    pub(super) const PROJECTED_SYSTEM: u64 = 3072;
    /// Codes from here on are nobody's.
    pub(super) const PROJECTED_SYSTEM_OWN: u64 = 32767;
    pub(super) const LINEAR_UNITS: u64 = 3076;
    pub(super) const LINEAR_UNITS_METRE: u64 = 9001;
}

/// Longest value of a tag that is read: far above what tags of ours hold.
const TAG_BYTES_MAX: usize = 1 << 20;

pub(super) fn read(mut file: impl Read + Seek, n_bytes: u64) -> Result<ElevationFile, Refusal> {
    let limit = CellLimit::of(n_bytes);
    check_counts(&mut file, n_bytes)?;
    let decoder = Decoder::new(file).map_err(|error| broken("file", &error))?;
    let mut decoder = decoder.with_limits(limits(&limit));
    let (n_cols, n_rows) = decoder.dimensions().map_err(|error| broken("size", &error))?;
    let (n_rows, n_cols) = (n_rows as usize, n_cols as usize);
    check_shape("size", [n_rows, n_cols], &limit)?;
    let color = decoder.colortype().map_err(|error| broken("pixel type", &error))?;
    if !matches!(color, ColorType::Gray(_)) {
        return Err(Refusal::new("pixel type", "one band of heights", format!("{color:?}")));
    }
    let keys = GeoKeys::read(&mut decoder)?;
    let cell_m = pixel_scale_m(&mut decoder)?;
    let file_south_west_m = south_west_m(&mut decoder, &keys, cell_m, n_rows)?;
    let no_data = no_data(&mut decoder)?;
    let pixels = decoder.read_image().map_err(|error| broken("pixels", &error))?;
    let heights_m = heights(pixels)?;
    if let Some(index) = heights_m.iter().position(|height| height.is_nan()).filter(|_| no_data.is_none()) {
        let place = format!("NaN at row {}, column {} from the north-west", index / n_cols, index % n_cols);
        return Err(Refusal::new(
            "pixels",
            "finite heights, or tag 42113 to declare the value of holes",
            place,
        ));
    }
    let hole = |height: f64| no_data.is_some_and(|value| height as f32 == value as f32);
    let heights_m = heights_m.into_iter().map(|height| if hole(height) { f32::NAN } else { height as f32 });
    let heights_m: Vec<f32> = flip_rows(&heights_m.collect::<Vec<_>>(), n_cols).collect();
    let geometry = GridGeometry { resolution_m: cell_m, origin: [0, 0], n_rows, n_cols };
    Ok(ElevationFile {
        file_south_west_m,
        epsg: keys.projected_system(),
        ..assemble("pixels", geometry, heights_m)?
    })
}

/// The decoder takes memory for as many values as an entry of the directory claims before it looks at its limits.
fn check_counts(file: &mut (impl Read + Seek), n_bytes: u64) -> Result<(), Refusal> {
    let most = largest_count(file).and_then(|most| file.rewind().map(|()| most));
    let most = most.map_err(|error| Refusal::new("file", "a complete GeoTIFF", error))?;
    let expected = || format!("at most {n_bytes} values for a tag, the bytes of the file");
    if most > n_bytes { Err(Refusal::new("directory", expected(), most)) } else { Ok(()) }
}

/// The most values that an entry of the first directory claims. A file of another kind has none.
fn largest_count(file: &mut (impl Read + Seek)) -> ReadResult<u64> {
    let mut head = [0; 4];
    file.read_exact(&mut head)?;
    // Bytes of an offset and of a count, of the number of entries; the large kind says its own before the offset.
    let (is_little, width, n_width) = match &head {
        b"II*\0" => (true, 4, 2),
        b"MM\0*" => (false, 4, 2),
        b"II+\0" => (true, 8, 8),
        b"MM\0+" => (false, 8, 8),
        _ => return Ok(0),
    };
    if width == 8 {
        word(file, 4, is_little)?;
    }
    let directory = word(file, width, is_little)?;
    file.seek(SeekFrom::Start(directory))?;
    let mut most = 0;
    for _ in 0..word(file, n_width, is_little)? {
        // Tag and type.
        word(file, 4, is_little)?;
        most = most.max(word(file, width, is_little)?);
        // The values, or where they stand.
        word(file, width, is_little)?;
    }
    Ok(most)
}

/// A whole number of up to eight bytes.
fn word(file: &mut impl Read, n_bytes: usize, is_little: bool) -> ReadResult<u64> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes[..n_bytes])?;
    if !is_little {
        bytes[..n_bytes].reverse();
    }
    Ok(u64::from_le_bytes(bytes))
}

/// Up to eight bytes for a cell, as it is decoded and as it is read.
fn limits(limit: &CellLimit) -> Limits {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 8 * limit.n_cells();
    limits.intermediate_buffer_size = 8 * limit.n_cells();
    limits.ifd_value_size = TAG_BYTES_MAX;
    limits
}

fn broken(field: &str, error: &TiffError) -> Refusal {
    let found = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    Refusal::new(field, "a complete GeoTIFF", found)
}

/// Numbers of a tag; `None` when the file has none.
fn numbers<R: Read + Seek>(decoder: &mut Decoder<R>, tag: Tag) -> Result<Option<Vec<f64>>, Refusal> {
    let field = format!("tag {}", tag.to_u16());
    let value = decoder.find_tag(tag).map_err(|error| broken(&field, &error))?;
    let value = value.map(|value| value.into_f64_vec().map_err(|error| broken(&field, &error)));
    value.transpose()
}

fn pixel_scale_m<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<f64, Refusal> {
    const FIELD: &str = "tag 33550 (pixel scale)";
    let scale = numbers(decoder, Tag::ModelPixelScaleTag)?;
    let Some(&[x_m, y_m, ..]) = scale.as_deref() else {
        return Err(Refusal::new(FIELD, "the edges of a pixel in metres", "no such tag"));
    };
    check_cell(FIELD, x_m)?;
    if (x_m - y_m).abs() > 1e-6 * x_m {
        return Err(Refusal::new(FIELD, "square pixels", format!("{x_m} x {y_m} m")));
    }
    Ok(x_m)
}

/// Where the south-west corner of the south-western pixel lies in the file's coordinates.
fn south_west_m<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    keys: &GeoKeys,
    cell_m: f64,
    n_rows: usize,
) -> Result<[f64; 2], Refusal> {
    let tie = numbers(decoder, Tag::ModelTiepointTag)?;
    let Some(&[col, row, _, x_m, y_m, ..]) = tie.as_deref() else { return Ok([0.0; 2]) };
    if ![col, row, x_m, y_m].iter().all(|value| value.is_finite()) {
        return Err(Refusal::new("tag 33922 (tie point)", "finite numbers", format!("{tie:?}")));
    }
    // A point raster ties the pixel's centre, an area raster its north-west corner.
    let to_corner = if keys.get(key::RASTER_TYPE) == Some(key::RASTER_TYPE_POINT) { 0.5 } else { 0.0 };
    let west_m = x_m - (col + to_corner) * cell_m;
    let north_m = y_m + (row + to_corner) * cell_m;
    Ok([west_m, north_m - n_rows as f64 * cell_m])
}

/// The value that marks a hole.
fn no_data<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Option<f64>, Refusal> {
    let value = decoder.find_tag(Tag::GdalNodata).map_err(|error| broken("tag 42113", &error))?;
    let Some(value) = value else { return Ok(None) };
    let text = value.into_string().map_err(|error| broken("tag 42113", &error))?;
    let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    let number = text.parse().map_err(|_| Refusal::new("tag 42113 (no data)", "a number", text));
    number.map(Some)
}

fn heights(pixels: DecodingResult) -> Result<Vec<f64>, Refusal> {
    Ok(match pixels {
        DecodingResult::F32(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::F64(values) => values,
        DecodingResult::U8(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::I8(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::U16(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::I16(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::U32(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::I32(values) => values.into_iter().map(f64::from).collect(),
        _ => return Err(Refusal::new("pixel type", "8 to 32 bit integers or floats", "another type")),
    })
}

/// The GeoKey directory: what the coordinates mean.
struct GeoKeys(Vec<(u64, u64)>);

impl GeoKeys {
    /// Refuses angles and feet, which would be taken for metres.
    fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Self, Refusal> {
        let entries = decoder.find_tag_unsigned_vec::<u64>(Tag::GeoKeyDirectoryTag);
        let entries = entries.map_err(|error| broken("tag 34735", &error))?.unwrap_or_default();
        // Four numbers each: key, where its value is stored (0 = here), count, value; the first four are a header.
        let here = entries.chunks_exact(4).skip(1).filter(|entry| entry[1] == 0);
        let keys = Self(here.map(|entry| (entry[0], entry[3])).collect());
        if keys.get(key::MODEL_TYPE) == Some(key::MODEL_TYPE_GEOGRAPHIC) {
            let found = "longitude and latitude in degrees (reproject it, e.g. to UTM)";
            return Err(Refusal::new("tag 34735 (coordinates)", "projected metres", found));
        }
        match keys.get(key::LINEAR_UNITS) {
            None | Some(key::LINEAR_UNITS_METRE) => Ok(keys),
            Some(unit) => {
                let found = format!("unit {unit}");
                Err(Refusal::new("tag 34735 (coordinates)", "metres (unit 9001)", found))
            }
        }
    }

    /// Code of EPSG of the projected coordinates.
    fn projected_system(&self) -> Option<u16> {
        let code =
            self.get(key::PROJECTED_SYSTEM).filter(|code| (1..key::PROJECTED_SYSTEM_OWN).contains(code))?;
        code.try_into().ok()
    }

    fn get(&self, key: u64) -> Option<u64> {
        self.0.iter().find(|(found, _)| *found == key).map(|(_, value)| *value)
    }
}
