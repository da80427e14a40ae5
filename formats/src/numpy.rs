//! Arrays in NumPy archives, read without believing a header further than the data go.

use std::io::{Read, Seek};

use zip::ZipArchive;
use zip::result::ZipError;

use crate::cells::CellLimit;
use crate::refusal::Refusal;

/// Longest array header that is read; NumPy's are about 100 bytes.
const HEADER_BYTES_MAX: usize = 1 << 16;

/// An archive of arrays.
pub(crate) struct Archive<R> {
    zip: ZipArchive<R>,
    limit: CellLimit,
}

/// Opens an archive of so many bytes.
pub(crate) fn open<R: Read + Seek>(file: R, n_bytes: u64) -> Result<Archive<R>, Refusal> {
    let zip = ZipArchive::new(file)
        .map_err(|error| Refusal::new("file", "a complete NumPy archive (.npz)", one_line(&error)))?;
    Ok(Archive { zip, limit: CellLimit::of(n_bytes) })
}

/// The array `cell`: the edge of a cell [m].
pub(crate) fn read_cell_m<R: Read + Seek>(archive: &mut Archive<R>) -> Result<f64, Refusal> {
    let array = required(archive, "cell")?;
    if array.n_values() != 1 {
        return Err(Refusal::new("cell", "one number", format!("shape {:?}", array.shape)));
    }
    let cell_m = array.value(0);
    check_cell("cell", cell_m)?;
    // 0.2 kept as f32 is 0.20000000298: the shortest decimal that gives the same f32 is what was meant.
    let shortest = || (cell_m as f32).to_string().parse().unwrap_or(cell_m);
    Ok(if array.descriptor.ends_with("f4") { shortest() } else { cell_m })
}

/// Refuses what is no edge of a cell.
pub(crate) fn check_cell(field: &str, cell_m: f64) -> Result<(), Refusal> {
    let ok = cell_m.is_finite() && cell_m > 0.0;
    if ok { Ok(()) } else { Err(Refusal::new(field, "a finite number of metres > 0", cell_m)) }
}

/// An array that must be there.
pub(crate) fn required<R: Read + Seek>(archive: &mut Archive<R>, name: &str) -> Result<Array, Refusal> {
    let array = optional(archive, name)?;
    array.ok_or_else(|| {
        let names = archive.zip.file_names().filter_map(Result::ok);
        let mut names: Vec<_> = names.map(|name| name.trim_end_matches(".npy").to_owned()).collect();
        names.sort_unstable();
        Refusal::new(name, "an array of this name", format!("only: {}", names.join(", ")))
    })
}

/// An array that may be missing.
pub(crate) fn optional<R: Read + Seek>(
    archive: &mut Archive<R>,
    name: &str,
) -> Result<Option<Array>, Refusal> {
    let broken = |error: &dyn std::fmt::Display| Refusal::new(name, "a complete array", one_line(error));
    match archive.zip.by_name(&format!("{name}.npy")) {
        Ok(entry) => Array::read(name, entry, &archive.limit).map(Some),
        Err(ZipError::FileNotFound) => Ok(None),
        Err(error) => Err(broken(&error)),
    }
}

/// An array as NumPy stores it.
pub(crate) struct Array {
    pub shape: Vec<usize>,
    descriptor: String,
    decoder: Decoder,
    fortran_order: bool,
    bytes: Vec<u8>,
}

impl Array {
    /// Reads the `.npy` format, versions 1 to 3. The header is believed only as far as the data go: nothing is
    /// allocated for cells that are not there, and no more is unpacked than `limit` says.
    fn read(name: &str, mut source: impl Read, limit: &CellLimit) -> Result<Self, Refusal> {
        let header = read_header(&mut source)
            .map_err(|error| Refusal::new(name, "a NumPy array (.npy)", one_line(&error)))?;
        let wrong = |part: &str| Refusal::new(name, format!("a NumPy header with {part}"), &header);
        let descriptor = quoted_after(&header, "'descr':").ok_or_else(|| wrong("'descr'"))?;
        let shape = shape_of(&header).ok_or_else(|| wrong("'shape'"))?;
        let decoder = decoder(descriptor).ok_or_else(|| {
            Refusal::new(name, "type f2, f4, f8, i1 to i8, u1 to u8 or b1", format!("type {descriptor}"))
        })?;
        let n_bytes = limit.check(name, &shape, format!("shape {shape:?}"))? * decoder.width;
        let bytes = read_exactly(&mut source, n_bytes)
            .map_err(|found| Refusal::new(name, format!("{n_bytes} bytes"), found))?;
        let fortran_order = header.contains("'fortran_order': True");
        Ok(Self { shape, descriptor: descriptor.to_owned(), decoder, fortran_order, bytes })
    }

    fn n_values(&self) -> usize {
        self.bytes.len() / self.decoder.width
    }

    /// The value at a place of the file; f64 holds every accepted type up to 53 bits.
    fn value(&self, place: usize) -> f64 {
        let width = self.decoder.width;
        (self.decoder.value)(&self.bytes[place * width..][..width])
    }

    /// The values with the last index running fastest.
    pub fn into_row_major(self) -> Vec<f32> {
        let place = |index| if self.fortran_order { fortran_index(index, &self.shape) } else { index };
        (0..self.n_values()).map(|index| self.value(place(index)) as f32).collect()
    }
}

/// Where the element of a row-major index lies when the first index runs fastest.
fn fortran_index(row_major: usize, shape: &[usize]) -> usize {
    let mut rest = row_major;
    let mut place = 0;
    for (axis, extent) in shape.iter().enumerate().rev() {
        let stride: usize = shape[..axis].iter().product();
        place += rest % extent * stride;
        rest /= extent;
    }
    place
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
        "<f2" => Some(Decoder {
            width: 2,
            value: |bytes| bytes.try_into().map_or(f64::NAN, |bytes| half_to_f64(u16::from_le_bytes(bytes))),
        }),
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

/// An IEEE 754 number of 16 bits: sign, five bits of exponent, ten of fraction.
fn half_to_f64(bits: u16) -> f64 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x3ff) / 1024.0;
    sign * match i32::from(bits >> 10 & 0x1f) {
        0 => fraction * 2f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        exponent => (1.0 + fraction) * 2f64.powi(exponent - 15),
    }
}

fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_numbers_are_those_of_the_standard() {
        let cases: [(u16, f64); 8] = [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0400, 2f64.powi(-14)),
            (0x0001, 2f64.powi(-24)),
            (0x3555, 0.333_251_953_125),
            (0x7c00, f64::INFINITY),
        ];
        for (bits, value) in cases {
            assert_eq!(half_to_f64(bits), value, "{bits:#06x}");
        }
        assert!(half_to_f64(0x7e00).is_nan());
    }

    #[test]
    fn the_first_index_runs_fastest_in_fortran_order() {
        // Shape [2, 3, 4]: element (1, 2, 3) is the last, (0, 0, 1) comes after one 2 x 3 sheet.
        assert_eq!(fortran_index(23, &[2, 3, 4]), 23);
        assert_eq!(fortran_index(1, &[2, 3, 4]), 6);
        assert_eq!(fortran_index(12, &[2, 3, 4]), 1);
    }
}
