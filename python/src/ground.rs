//! The ground as arrays.

use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix2, Ix3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use terrain::{GridGeometry, GridMap, Knowledge, LATTICE_MAX, SurfaceCell, TerrainClass};

use crate::arrays::{array, optional, owned, require_shape, values};
use crate::failure::refused;
use crate::typed::{Array, Scalar};

/// Cells of a map: as many as an elevation map may have.
const CELLS_MAX: usize = 1 << 22;
/// Edges of cells [m].
const RESOLUTION_M: [f64; 2] = [1e-3, 1e3];
/// Highest and lowest ground [m]: beyond, a millimetre is lost to rounding a thousand times over.
const HEIGHT_MAX_M: f32 = 1e5;

/// The ground of a map: heights, variances, plants, classes, and what is unknown.
///
/// Made by `Surface.from_arrays` and `ElevationMap.surface`. Arrays have shape (row, col): row 0 is the south, column 0 the
/// west. Every property is an array of its own, copied out of the cells.
#[pyclass(frozen, module = "surefoot")]
pub struct Surface(pub GridMap<SurfaceCell>);

#[pymethods]
impl Surface {
    /// Ground of your own.
    ///
    /// height_m: float32 (row, col), NaN where nothing is known. resolution_m: edge of a cell [m]. origin: lattice index
    /// (col, row) of the south-west cell, whose south-west corner lies at origin * resolution_m. terrain_class: uint8
    /// (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle; or class_probability: float32 (row, col, class), which sums to
    /// one where the ground is known. vegetation_height_m: float32 (row, col), height of soft plants above the ground [m].
    /// height_variance_m2: float32 (row, col). knowledge: uint8 (row, col), 1 where a height was filled in between measured
    /// ones, else 2, and 0 where nothing is known. Cells are interleaved, so each array is copied. Raises `TypeError` for another type of number, `ValueError` for another shape and for values that no ground has.
    #[staticmethod]
    #[pyo3(signature = (
        height_m: "_Float32",
        resolution_m,
        *,
        origin=(0, 0),
        terrain_class: "_Uint8 | None" = None,
        vegetation_height_m: "_Float32 | None" = None,
        height_variance_m2: "_Float32 | None" = None,
        class_probability: "_Float32 | None" = None,
        knowledge: "_Uint8 | None" = None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn from_arrays(
        height_m: &Bound<'_, PyAny>,
        resolution_m: f64,
        origin: (i64, i64),
        terrain_class: Option<&Bound<'_, PyAny>>,
        vegetation_height_m: Option<&Bound<'_, PyAny>>,
        height_variance_m2: Option<&Bound<'_, PyAny>>,
        class_probability: Option<&Bound<'_, PyAny>>,
        knowledge: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let height = array::<f32, Ix2>("height_m", height_m, "row, col")?;
        let &[n_rows, n_cols] = height.shape() else { return Err(refused("height_m", "two axes", "others")) };
        let geometry = grid([n_rows, n_cols], resolution_m, origin)?;
        let heights_m = values("height_m", &height)?;
        let cells = heights_m.iter().map(|height_m| SurfaceCell {
            height_m: *height_m,
            ..SurfaceCell::certain(0.0, TerrainClass::Open, 0.0)
        });
        let mut cells: Vec<SurfaceCell> = cells.collect();
        let layer = |name, found| layer::<f32>(name, found, [n_rows, n_cols]);
        if let Some(heights_m) = layer("vegetation_height_m", vegetation_height_m)? {
            set(&mut cells, &heights_m, |cell, height_m| cell.vegetation_height_m = height_m);
        }
        if let Some(variances_m2) = layer("height_variance_m2", height_variance_m2)? {
            set(&mut cells, &variances_m2, |cell, variance_m2| cell.height_variance_m2 = variance_m2);
        }
        if let Some(classes) = self::layer::<u8>("terrain_class", terrain_class, [n_rows, n_cols])? {
            require_classes(&classes, n_cols)?;
            set(&mut cells, &classes, |cell, class| {
                cell.class_probability = [0.0; TerrainClass::COUNT];
                cell.class_probability[usize::from(class)] = 1.0;
            });
        }
        if let Some(class_probability) = class_probability {
            if terrain_class.is_some() {
                return Err(refused("class_probability", "no terrain_class beside it", "both"));
            }
            set_probabilities(&mut cells, class_probability, geometry)?;
        }
        for (index, cell) in cells.iter_mut().enumerate() {
            *cell = checked(*cell, geometry, index)?;
        }
        if let Some(knowledge) = self::layer::<u8>("knowledge", knowledge, [n_rows, n_cols])? {
            set_knowledge(&mut cells, &knowledge, n_cols)?;
        }
        let surface = GridMap::from_values(geometry, cells);
        surface.map(Self).ok_or_else(|| refused("height_m", "one value for every cell", "others"))
    }

    /// Number of rows and columns.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        let GridGeometry { n_rows, n_cols, .. } = *self.0.geometry();
        (n_rows, n_cols)
    }

    /// Edge of a cell [m].
    #[getter]
    fn resolution_m(&self) -> f64 {
        self.0.geometry().resolution_m
    }

    /// Lattice index (col, row) of the south-west cell.
    #[getter]
    fn origin(&self) -> (i64, i64) {
        self.0.geometry().origin.into()
    }

    /// Height of the ground itself, below plants [m]: float32 (row, col), NaN where unknown.
    #[getter]
    fn height_m(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        self.cells(py, |cell| cell.height_m)
    }

    /// Variance of the height [m2]: float32 (row, col), infinite where unknown.
    #[getter]
    fn height_variance_m2(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        self.cells(py, |cell| cell.height_variance_m2)
    }

    /// Height of soft plants above the ground [m]: float32 (row, col).
    #[getter]
    fn vegetation_height_m(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        self.cells(py, |cell| cell.vegetation_height_m)
    }

    /// Likeliest class: uint8 (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle.
    #[getter]
    fn terrain_class(&self, py: Python<'_>) -> PyResult<Array<u8, Ix2>> {
        self.cells(py, |cell| cell.class() as u8)
    }

    /// Probability of each class: float32 (row, col, class).
    #[getter]
    fn class_probability(&self, py: Python<'_>) -> PyResult<Array<f32, Ix3>> {
        let (n_rows, n_cols) = self.shape();
        let values = self.0.values().iter().flat_map(|cell| cell.class_probability).collect();
        owned(py, values, [n_rows, n_cols, TerrainClass::COUNT])
    }

    /// How the height came to be known: uint8 (row, col), 0 unknown, 1 interpolated, 2 measured.
    #[getter]
    fn knowledge(&self, py: Python<'_>) -> PyResult<Array<u8, Ix2>> {
        self.cells(py, |cell| cell.knowledge as u8)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickled<'py>> {
        let layers = PyDict::new(py);
        layers.set_item("origin", self.origin())?;
        layers.set_item("vegetation_height_m", self.vegetation_height_m(py)?)?;
        // Unknown ground varies without bounds; what is said of it counts for nothing.
        let variance_m2 =
            |cell: &SurfaceCell| Some(cell.height_variance_m2).filter(|value| value.is_finite());
        layers.set_item("height_variance_m2", self.cells(py, |cell| variance_m2(cell).unwrap_or(0.0))?)?;
        layers.set_item("class_probability", self.class_probability(py)?)?;
        layers.set_item("knowledge", self.knowledge(py)?)?;
        let make = with_keywords(&py.get_type::<Self>().getattr("from_arrays")?, &layers)?;
        Ok((make, (self.height_m(py)?.0.into_bound(py).into_any(), self.resolution_m())))
    }

    fn __repr__(&self) -> String {
        let (n_rows, n_cols) = self.shape();
        format!("<surefoot.Surface of {n_rows} x {n_cols} cells of {} m>", self.resolution_m())
    }
}

impl Surface {
    fn cells<T: Scalar>(&self, py: Python<'_>, of: impl Fn(&SurfaceCell) -> T) -> PyResult<Array<T, Ix2>> {
        let (n_rows, n_cols) = self.shape();
        owned(py, self.0.values().iter().map(of).collect(), [n_rows, n_cols])
    }
}

/// How a map is made again: a function, what it is mostly made of, and the edge of a cell [m].
pub type Pickled<'py> = (Bound<'py, PyAny>, (Bound<'py, PyAny>, f64));

/// A function of Python's with these keywords, which can be pickled.
pub fn with_keywords<'py>(
    function: &Bound<'py, PyAny>,
    keywords: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    function.py().import("functools")?.getattr("partial")?.call((function,), Some(keywords))
}

/// A grid of at least 3 x 3 cells on the lattice, refused where cells cannot be counted.
pub fn grid([n_rows, n_cols]: [usize; 2], resolution_m: f64, origin: (i64, i64)) -> PyResult<GridGeometry> {
    let [finest_m, coarsest_m] = RESOLUTION_M;
    if !(finest_m..=coarsest_m).contains(&resolution_m) {
        return Err(refused(
            "resolution_m",
            format!("a length from {finest_m} to {coarsest_m} m"),
            resolution_m,
        ));
    }
    if n_rows < 3 || n_cols < 3 || n_rows.saturating_mul(n_cols) > CELLS_MAX {
        let expected = format!("at least 3 x 3 and at most {CELLS_MAX} cells");
        return Err(refused("rows and columns", expected, format!("{n_rows} x {n_cols}")));
    }
    if origin.0.saturating_abs() > LATTICE_MAX || origin.1.saturating_abs() > LATTICE_MAX {
        let expected = format!("cells within {LATTICE_MAX} of the map's origin");
        return Err(refused("origin", expected, format!("{origin:?}")));
    }
    Ok(GridGeometry { resolution_m, origin: origin.into(), n_rows, n_cols })
}

/// Refuses numbers that are no class.
pub fn require_classes(classes: &[u8], n_cols: usize) -> PyResult<()> {
    match classes.iter().position(|&class| usize::from(class) >= TerrainClass::COUNT) {
        Some(index) => {
            let place = format!("terrain_class[{}, {}]", index / n_cols, index % n_cols);
            Err(refused(&place, "a class from 0 to 3", classes[index]))
        }
        None => Ok(()),
    }
}

/// The values of a layer of a grid, where there is one.
pub fn layer<T: numpy::Element + Copy>(
    argument: &str,
    found: Option<&Bound<'_, PyAny>>,
    shape: [usize; 2],
) -> PyResult<Option<Vec<T>>> {
    let Some(layer) = optional::<T, Ix2>(argument, found, "row, col")? else { return Ok(None) };
    require_shape(argument, layer.shape(), &shape)?;
    Ok(Some(values(argument, &layer)?.to_vec()))
}

/// Gradients [row, col, 2] of a grid, where there are any.
pub fn pairs(
    argument: &str,
    found: Option<&Bound<'_, PyAny>>,
    [n_rows, n_cols]: [usize; 2],
) -> PyResult<Option<Vec<[f32; 2]>>> {
    let Some(pairs) = optional::<f32, Ix3>(argument, found, "row, col, 2")? else { return Ok(None) };
    require_shape(argument, pairs.shape(), &[n_rows, n_cols, 2])?;
    Ok(Some(values(argument, &pairs)?.as_chunks().0.to_vec()))
}

/// Probabilities that sum to one, or to none at all where nothing was seen.
fn set_probabilities(
    cells: &mut [SurfaceCell],
    found: &Bound<'_, PyAny>,
    geometry: GridGeometry,
) -> PyResult<()> {
    let probabilities = array::<f32, Ix3>("class_probability", found, "row, col, class")?;
    let shape = [geometry.n_rows, geometry.n_cols, TerrainClass::COUNT];
    require_shape("class_probability", probabilities.shape(), &shape)?;
    let rows = values("class_probability", &probabilities)?.as_chunks().0;
    for (index, (cell, row)) in cells.iter_mut().zip(rows).enumerate() {
        let sum: f32 = row.iter().sum();
        let is_of_one = row.iter().all(|share| *share >= 0.0) && (sum - 1.0).abs() < 1e-3;
        let is_unseen = cell.height_m.is_nan() && *row == [0.0; TerrainClass::COUNT];
        if !(is_of_one || is_unseen) {
            let terrain::Cell { row: r, col } = geometry.cell(index);
            let expected = "probabilities that sum to one";
            return Err(refused(&format!("class_probability[{r}, {col}]"), expected, format!("{row:?}")));
        }
        cell.class_probability = *row;
    }
    Ok(())
}

/// How heights came to be known; none where there is none.
fn set_knowledge(cells: &mut [SurfaceCell], values: &[u8], n_cols: usize) -> PyResult<()> {
    for (index, (cell, value)) in cells.iter_mut().zip(values).enumerate() {
        cell.knowledge = match (value, cell.height_m.is_nan()) {
            (0, true) => Knowledge::Unknown,
            (1, false) => Knowledge::Interpolated,
            (2, false) => Knowledge::Measured,
            (_, is_unknown) => {
                let expected = if is_unknown { "0 where no height is known" } else { "1 or 2 where one is" };
                let place = format!("knowledge[{}, {}]", index / n_cols, index % n_cols);
                return Err(refused(&place, expected, value));
            }
        };
    }
    Ok(())
}

fn set<T: Copy>(cells: &mut [SurfaceCell], values: &[T], write: impl Fn(&mut SurfaceCell, T)) {
    cells.iter_mut().zip(values).for_each(|(cell, value)| write(cell, *value));
}

/// A cell as the crates know it: of one without a height nothing is known but an obstacle.
fn checked(cell: SurfaceCell, geometry: GridGeometry, index: usize) -> PyResult<SurfaceCell> {
    let refuse = |name: &str, expected: &str, found: f32| {
        let terrain::Cell { row, col } = geometry.cell(index);
        refused(&format!("{name}[{row}, {col}]"), expected, found)
    };
    if cell.height_m.is_nan() {
        let unknown = SurfaceCell::UNKNOWN;
        let is_seen = cell.class() == TerrainClass::Obstacle;
        let class_probability = if is_seen { cell.class_probability } else { unknown.class_probability };
        return Ok(SurfaceCell { class_probability, ..unknown });
    }
    if cell.height_m.abs() > HEIGHT_MAX_M {
        return Err(refuse(
            "height_m",
            "a height from -1e5 to 1e5 m, or NaN where nothing is known",
            cell.height_m,
        ));
    }
    let bounded = [
        ("vegetation_height_m", "a height from 0 to 1000 m", cell.vegetation_height_m),
        ("height_variance_m2", "a number from 0 to 1000", cell.height_variance_m2),
    ];
    match bounded.into_iter().find(|(_, _, found)| !(0.0..=1e3).contains(found)) {
        Some((name, expected, found)) => Err(refuse(name, expected, found)),
        None => Ok(cell),
    }
}
