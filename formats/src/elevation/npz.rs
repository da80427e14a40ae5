//! Elevation as a NumPy archive: `elevation` [row, col] in metres with row 0 in the south, `cell` in metres,
//! optional layers of the same shape. A height that is NaN is a hole: the format has no other way to declare one.

use std::io::{Read, Seek};

use terrain::{GridGeometry, GridMap};

use super::{ElevationFile, ElevationLayers, assemble, check_shape};
use crate::cells::CellLimit;
use crate::numpy::{Archive, open, optional, read_cell_m, required};
use crate::refusal::Refusal;

pub(super) fn read(file: impl Read + Seek, n_bytes: u64) -> Result<ElevationFile, Refusal> {
    let mut archive = open(file, n_bytes)?;
    let cell_m = read_cell_m(&mut archive)?;
    let array = required(&mut archive, "elevation")?;
    let &[n_rows, n_cols] = array.shape.as_slice() else {
        return Err(Refusal::new("elevation", "shape [row, col]", format!("shape {:?}", array.shape)));
    };
    check_shape("elevation", [n_rows, n_cols], &CellLimit::of(n_bytes))?;
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

fn read_layer<R: Read + Seek>(
    archive: &mut Archive<R>,
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
