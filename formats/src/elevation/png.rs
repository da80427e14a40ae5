//! Elevation as a grey PNG of 16 bits: 0 is the lowest height, 65535 the highest. Rows come from the north.

use std::io::{BufRead, Seek};
use std::path::{Path, PathBuf};

use ::png::{BitDepth, ColorType, Decoder, Limits};
use terrain::GridGeometry;

use super::{ElevationFile, Refusal, assemble, check_shape, flip_rows};
use crate::cells::CellLimit;
use crate::{ConfigError, ConfigText};

/// What the grey values of a PNG mean.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PngScale {
    /// Height of the value 0 [m].
    pub height_min_m: f64,
    /// Height of the value 65535 [m].
    pub height_max_m: f64,
    /// Edge of a pixel [m].
    pub cell_m: f64,
    /// Value that marks a hole; without it there are none.
    pub no_data: Option<u16>,
}

impl PngScale {
    /// Reads `<file>.toml` beside a PNG. Errors: it cannot be read, has an unknown, missing or mistyped key, a cell
    /// that is not > 0, or heights that are not finite or not in order.
    pub fn beside(png: &Path) -> Result<Self, ConfigError> {
        let mut sidecar = png.as_os_str().to_owned();
        sidecar.push(".toml");
        let text = ConfigText::read(&PathBuf::from(sidecar))?;
        let scale: Self = text.parse()?;
        match scale.check() {
            Ok(()) => Ok(scale),
            Err(Refusal { field, expected, found }) => Err(text.refuse(&field, expected, found)),
        }
    }

    fn check(&self) -> Result<(), Refusal> {
        super::check_cell("cell_m", self.cell_m)?;
        if !self.height_min_m.is_finite() {
            return Err(Refusal::new("height_min_m", "a finite number", self.height_min_m));
        }
        let ordered = self.height_max_m.is_finite() && self.height_max_m > self.height_min_m;
        let expected = || format!("a finite number > height_min_m = {}", self.height_min_m);
        if ordered { Ok(()) } else { Err(Refusal::new("height_max_m", expected(), self.height_max_m)) }
    }

    fn height_m(&self, value: u16) -> f32 {
        if self.no_data == Some(value) {
            return f32::NAN;
        }
        let share = f64::from(value) / f64::from(u16::MAX);
        (self.height_min_m + share * (self.height_max_m - self.height_min_m)) as f32
    }
}

pub(super) fn read(
    file: impl BufRead + Seek,
    n_bytes: u64,
    scale: PngScale,
) -> Result<ElevationFile, Refusal> {
    scale.check()?;
    let limit = CellLimit::of(n_bytes);
    // Two bytes for a cell; what else the file holds has room in as many.
    let decoder = Decoder::new_with_limits(file, Limits { bytes: 2 * limit.n_cells() });
    let mut reader = decoder.read_info().map_err(|error| broken("file", &error))?;
    let (n_rows, n_cols) = (reader.info().height as usize, reader.info().width as usize);
    check_shape("size", [n_rows, n_cols], &limit)?;
    let format = reader.output_color_type();
    if format != (ColorType::Grayscale, BitDepth::Sixteen) {
        let found = format!("{:?}, {:?} bits", format.0, format.1);
        return Err(Refusal::new("pixel type", "grey, 16 bits", found));
    }
    let mut bytes = vec![0; 2 * n_rows * n_cols];
    reader.next_frame(&mut bytes).map_err(|error| broken("pixels", &error))?;
    let heights_m: Vec<f32> =
        bytes.chunks_exact(2).map(|pair| scale.height_m(u16::from_be_bytes([pair[0], pair[1]]))).collect();
    let geometry = GridGeometry { resolution_m: scale.cell_m, origin: [0, 0], n_rows, n_cols };
    assemble("pixels", geometry, flip_rows(&heights_m, n_cols).collect())
}

fn broken(field: &str, error: &::png::DecodingError) -> Refusal {
    let found = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    Refusal::new(field, "a complete PNG", found)
}
