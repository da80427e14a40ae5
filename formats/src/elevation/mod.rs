//! Elevation files: `.npz`, GeoTIFF and 16-bit PNG with a scale.

mod geotiff;
mod npz;
mod png;

use std::path::Path;

use terrain::{GridGeometry, GridMap};

use crate::ConfigError;
use crate::MapReference;
use crate::cells::CellLimit;
use crate::numpy::check_cell;
use crate::refusal::{ArrayFileError, Refusal};

pub use png::PngScale;

/// Measured ground as a file holds it. The map frame's origin is the grid's south-west corner, x east, y north.
#[derive(Clone, Debug)]
pub struct ElevationFile {
    /// Height of the ground at the cells' centres [m]; NaN where the file declares that nothing was measured.
    pub elevation: GridMap<f32>,
    /// Number of cells without a height.
    pub n_holes: usize,
    /// The grid's south-west corner in the file's own coordinates (GeoTIFF), else (0, 0).
    pub file_south_west_m: [f64; 2],
    /// Code of the reference system of these coordinates in the registry of EPSG, where the file tells one (GeoTIFF).
    pub epsg: Option<u16>,
    /// What else the file says of each cell.
    pub layers: ElevationLayers,
}

impl ElevationFile {
    /// Where the map frame lies on the globe, if the file tells.
    pub fn reference(&self) -> Option<MapReference> {
        Some(MapReference { epsg: self.epsg?, origin_m: self.file_south_west_m })
    }
}

/// Optional layers, each of the elevation's geometry; NaN where the file knows nothing, never infinite.
#[derive(Clone, Debug, Default)]
pub struct ElevationLayers {
    /// Highest return above the ground, `canopy_height` [m].
    pub canopy_height_m: Option<GridMap<f32>>,
    /// Share of returns 0.3 to 3 m above the ground, `low_veg_fraction` [-].
    pub low_vegetation_fraction: Option<GridMap<f32>>,
    /// Open water where above zero, `water` [-].
    pub water: Option<GridMap<f32>>,
    /// Distance to the nearest measurement of the ground, `ground_gap` [m].
    pub ground_gap_m: Option<GridMap<f32>>,
}

/// An elevation file that cannot be used. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum ElevationError {
    /// The file, or a part of it.
    #[error(transparent)]
    File(#[from] ArrayFileError),
    /// The sidecar that scales a PNG is wrong.
    #[error(transparent)]
    Sidecar(#[from] ConfigError),
}

/// Reads an elevation file; the format is told by the extension: `.npz`, `.tif`, `.tiff`, or `.png` with a scale in
/// `<file>.toml` beside it (`hill.png.toml`).
///
/// A file holds up to 64 cells for each of its bytes, and a million whatever its size: what compresses further claims
/// more than measured ground does.
///
/// Errors: unreadable or truncated file, unknown extension, missing array or tag, wrong shape or type, more cells than
/// that, cell size that is not > 0, infinite height, no height at all.
pub fn read_elevation(path: &Path) -> Result<ElevationFile, ElevationError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match extension.as_str() {
        "npz" => open_and(path, npz::read),
        "tif" | "tiff" => open_and(path, geotiff::read),
        "png" => read_elevation_png(path, PngScale::beside(path)?),
        _ => {
            let refusal = Refusal::new("file name", "the extension npz, tif, tiff or png", path.display());
            Err(refused(path, refusal))
        }
    }
}

/// Reads a 16-bit PNG with a scale given by the caller. Errors: see [`read_elevation`].
pub fn read_elevation_png(path: &Path, scale: PngScale) -> Result<ElevationFile, ElevationError> {
    open_and(path, |file, n_bytes| png::read(file, n_bytes, scale))
}

type Reader = std::io::BufReader<std::fs::File>;

fn open_and(
    path: &Path,
    read: impl FnOnce(Reader, u64) -> Result<ElevationFile, Refusal>,
) -> Result<ElevationFile, ElevationError> {
    let open = || {
        let file = std::fs::File::open(path)?;
        let about = file.metadata()?;
        if about.is_dir() {
            return Err(std::io::ErrorKind::IsADirectory.into());
        }
        Ok((std::io::BufReader::new(file), about.len()))
    };
    let (file, n_bytes) =
        open().map_err(|source| ArrayFileError::Unreadable { file: path.display().to_string(), source })?;
    read(file, n_bytes).map_err(|refusal| refused(path, refusal))
}

fn refused(path: &Path, refusal: Refusal) -> ElevationError {
    ArrayFileError::refused(&path.display().to_string(), refusal).into()
}

/// Refuses sizes that are no map, or more than a file of this size holds.
fn check_shape(field: &str, [n_rows, n_cols]: [usize; 2], limit: &CellLimit) -> Result<(), Refusal> {
    let found = format!("{n_rows} x {n_cols}");
    if n_rows < 2 || n_cols < 2 {
        return Err(Refusal::new(field, "at least 2 x 2 cells", found));
    }
    limit.check(field, &[n_rows, n_cols], found).map(drop)
}

/// Builds the result from rows that start in the south; NaN is a hole, infinity is refused.
fn assemble(field: &str, geometry: GridGeometry, heights_m: Vec<f32>) -> Result<ElevationFile, Refusal> {
    let place = |index| {
        let cell = geometry.cell(index);
        format!("at row {}, column {} from the south-west", cell.row, cell.col)
    };
    if let Some(index) = heights_m.iter().position(|height| height.is_infinite()) {
        let found = format!("{} {}", heights_m[index], place(index));
        return Err(Refusal::new(field, "finite heights, or NaN where nothing was measured", found));
    }
    let n_holes = heights_m.iter().filter(|height| height.is_nan()).count();
    if n_holes == heights_m.len() {
        return Err(Refusal::new(field, "at least one measured cell", "holes only"));
    }
    let n_values = heights_m.len();
    let elevation = GridMap::from_values(geometry, heights_m)
        .ok_or_else(|| Refusal::new(field, format!("{} cells", geometry.n_cells()), n_values))?;
    Ok(ElevationFile {
        elevation,
        n_holes,
        file_south_west_m: [0.0; 2],
        epsg: None,
        layers: ElevationLayers::default(),
    })
}

/// Images start in the north, maps in the south.
fn flip_rows<T: Copy>(values: &[T], n_cols: usize) -> impl Iterator<Item = T> + '_ {
    values.chunks_exact(n_cols).rev().flatten().copied()
}
