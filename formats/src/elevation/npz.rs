//! Elevation as a NumPy archive: `elevation` [row, col] in metres with row 0 in the south, `cell` in metres,
//! optional layers of the same shape. A height that is NaN is a hole: the format has no other way to declare one.

use std::io::{Read, Seek};

use terrain::{GridGeometry, GridMap};
use zip::ZipArchive;

use super::{CELLS_MAX, ElevationFile, ElevationLayers, Refusal, assemble, check_cell, check_shape};

/// Longest array header that is read; NumPy's are about 100 bytes.
const HEADER_BYTES_MAX: usize = 1 << 16;

pub(super) fn read(file: impl Read + Seek) -> Result<ElevationFile, Refusal> {
    let mut archive = ZipArchive::new(file)
        .map_err(|error| Refusal::new("file", "a complete NumPy archive (.npz)", one_line(&error)))?;
    let cell_m = read_cell(&mut archive)?;
    let array = required(&mut archive, "elevation")?;
    let &[n_rows, n_cols] = array.shape.as_slice() else {
        return Err(Refusal::new("elevation", "shape [row, col]", format!("shape {:?}", array.shape)));
    };
    check_shape("elevation", n_rows, n_cols)?;
    let geometry = GridGeometry { resolution_m: cell_m, origin: [0, 0], n_rows, n_cols };
    let mut file = assemble("elevation", geometry, array.into_row_major())?;
    let mut layer = |name| read_layer(&mut archive, name, geometry);
    file.layers = ElevationLayers {
        canopy_height_m: layer("canopy_height")?,
        low_vegetation_fraction: layer("low_veg_fraction")?,
        water: layer("water")?,
        ground_gap_m: layer("ground_gap")?,
    };
    Ok(file)
}

fn read_cell<R: Read + Seek>(archive: &mut ZipArchive<R>) -> Result<f64, Refusal> {
    let array = required(archive, "cell")?;
    let &[cell_m] = array.values.as_slice() else {
        return Err(Refusal::new("cell", "one number", format!("shape {:?}", array.shape)));
    };
    check_cell("cell", cell_m)?;
    // 0.2 kept as f32 is 0.20000000298: the shortest decimal that gives the same f32 is what was meant.
    let shortest = || (cell_m as f32).to_string().parse().unwrap_or(cell_m);
    Ok(if array.descriptor.ends_with("f4") { shortest() } else { cell_m })
}

fn read_layer<R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &str,
    geometry: GridGeometry,
) -> Result<Option<GridMap<f32>>, Refusal> {
    let Some(array) = optional(archive, name)? else { return Ok(None) };
    if array.shape != [geometry.n_rows, geometry.n_cols] {
        let expected = format!("elevation's shape [{}, {}]", geometry.n_rows, geometry.n_cols);
        return Err(Refusal::new(name, expected, format!("shape {:?}", array.shape)));
    }
    let values = array.into_row_major();
    if let Some(index) = values.iter().position(|value| value.is_infinite()) {
        let cell = geometry.cell(index);
        let found = format!("{} at row {}, column {}", values[index], cell.row, cell.col);
        return Err(Refusal::new(name, "finite values, or NaN where nothing is known", found));
    }
    Ok(GridMap::from_values(geometry, values))
}

fn required<R: Read + Seek>(archive: &mut ZipArchive<R>, name: &str) -> Result<Array, Refusal> {
    let array = optional(archive, name)?;
    array.ok_or_else(|| {
        let mut names: Vec<_> = archive.file_names().map(|name| name.trim_end_matches(".npy")).collect();
        names.sort_unstable();
        Refusal::new(name, "an array of this name", format!("only: {}", names.join(", ")))
    })
}

fn optional<R: Read + Seek>(archive: &mut ZipArchive<R>, name: &str) -> Result<Option<Array>, Refusal> {
    let broken = |error: &dyn std::fmt::Display| Refusal::new(name, "a complete array", one_line(error));
    match archive.by_name(&format!("{name}.npy")) {
        Ok(entry) => Array::read(name, entry).map(Some),
        Err(zip::result::ZipError::FileNotFound) => Ok(None),
        Err(error) => Err(broken(&error)),
    }
}

/// An array as NumPy stores it. Values go through f64, which holds every accepted type up to 53 bits.
struct Array {
    shape: Vec<usize>,
    descriptor: String,
    fortran_order: bool,
    values: Vec<f64>,
}

impl Array {
    /// Reads the `.npy` format, versions 1 to 3. The header is believed only as far as the data go: nothing is
    /// allocated for cells that are not there.
    fn read(name: &str, mut source: impl Read) -> Result<Self, Refusal> {
        let header = read_header(&mut source)
            .map_err(|error| Refusal::new(name, "a NumPy array (.npy)", one_line(&error)))?;
        let wrong = |part: &str| Refusal::new(name, format!("a NumPy header with {part}"), &header);
        let descriptor = quoted_after(&header, "'descr':").ok_or_else(|| wrong("'descr'"))?;
        let shape = shape_of(&header).ok_or_else(|| wrong("'shape'"))?;
        let decode = decoder(descriptor).ok_or_else(|| {
            Refusal::new(name, "type f4, f8, i1 to i8, u1 to u8 or b1", format!("type {descriptor}"))
        })?;
        let n_values = shape.iter().try_fold(1_usize, |n, extent| n.checked_mul(*extent));
        let Some(n_values) = n_values.filter(|n| *n <= CELLS_MAX) else {
            return Err(Refusal::new(name, format!("at most {CELLS_MAX} cells"), format!("shape {shape:?}")));
        };
        let bytes = read_exactly(&mut source, n_values * decode.width)
            .map_err(|found| Refusal::new(name, format!("{} bytes", n_values * decode.width), found))?;
        let values = bytes.chunks_exact(decode.width).map(decode.value).collect();
        let fortran_order = header.contains("'fortran_order': True");
        Ok(Self { shape, descriptor: descriptor.to_owned(), fortran_order, values })
    }

    /// The values row by row; only for two dimensions.
    fn into_row_major(self) -> Vec<f32> {
        match *self.shape.as_slice() {
            [n_rows, n_cols] if self.fortran_order => (0..n_rows * n_cols)
                .map(|index| self.values[(index % n_cols) * n_rows + index / n_cols] as f32)
                .collect(),
            _ => self.values.iter().map(|value| *value as f32).collect(),
        }
    }
}

fn read_header(source: &mut impl Read) -> std::io::Result<String> {
    let invalid = |text: String| std::io::Error::new(std::io::ErrorKind::InvalidData, text);
    let mut start = [0; 8];
    source.read_exact(&mut start)?;
    if &start[..6] != b"\x93NUMPY" {
        return Err(invalid("no NumPy magic bytes".into()));
    }
    let n_bytes = if start[6] == 1 {
        let mut length = [0; 2];
        source.read_exact(&mut length)?;
        usize::from(u16::from_le_bytes(length))
    } else {
        let mut length = [0; 4];
        source.read_exact(&mut length)?;
        u32::from_le_bytes(length) as usize
    };
    if n_bytes > HEADER_BYTES_MAX {
        return Err(invalid(format!("a header of {n_bytes} bytes")));
    }
    let mut header = vec![0; n_bytes];
    source.read_exact(&mut header)?;
    String::from_utf8(header).map(|text| text.trim().to_owned()).map_err(|error| invalid(error.to_string()))
}

fn quoted_after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let rest = header.split_once(key)?.1.trim_start().strip_prefix('\'')?;
    rest.split_once('\'').map(|(value, _)| value)
}

fn shape_of(header: &str) -> Option<Vec<usize>> {
    let rest = header.split_once("'shape':")?.1.trim_start().strip_prefix('(')?;
    let extents = rest.split_once(')')?.0.split(',').map(str::trim).filter(|extent| !extent.is_empty());
    extents.map(|extent| extent.parse().ok()).collect()
}

/// Exactly `n_bytes` and then the end, where the archive checks its checksum; else what was found.
fn read_exactly(source: &mut impl Read, n_bytes: usize) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    match source.take(n_bytes as u64 + 1).read_to_end(&mut bytes) {
        Err(error) => Err(one_line(&error)),
        Ok(_) if bytes.len() < n_bytes => Err(format!("{} bytes", bytes.len())),
        Ok(_) if bytes.len() > n_bytes => Err("more bytes".into()),
        Ok(_) => Ok(bytes),
    }
}

/// How one element turns into a number.
struct Decoder {
    width: usize,
    value: fn(&[u8]) -> f64,
}

/// The decoder of a NumPy type descriptor such as `<f4`.
fn decoder(descriptor: &str) -> Option<Decoder> {
    macro_rules! number {
        ($type:ty, $from_bytes:ident) => {
            Some(Decoder {
                width: size_of::<$type>(),
                value: |bytes| bytes.try_into().map_or(f64::NAN, |bytes| <$type>::$from_bytes(bytes) as f64),
            })
        };
    }
    match descriptor {
        "<f4" => number!(f32, from_le_bytes),
        ">f4" => number!(f32, from_be_bytes),
        "<f8" => number!(f64, from_le_bytes),
        ">f8" => number!(f64, from_be_bytes),
        "|u1" | "|b1" => number!(u8, from_le_bytes),
        "|i1" => number!(i8, from_le_bytes),
        "<u2" => number!(u16, from_le_bytes),
        "<i2" => number!(i16, from_le_bytes),
        "<u4" => number!(u32, from_le_bytes),
        "<i4" => number!(i32, from_le_bytes),
        "<u8" => number!(u64, from_le_bytes),
        "<i8" => number!(i64, from_le_bytes),
        _ => None,
    }
}

fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
