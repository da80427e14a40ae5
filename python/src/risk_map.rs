//! The risk map as arrays.

use numpy::ndarray::{Ix2, Ix3, Ix4};
use numpy::{PyArray4, PyArrayMethods, PyReadonlyArray4, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use terrain::{Cell, GridGeometry};
use traversability::{Ground, GroundFlags, Risk, RiskMapView};

use crate::arrays::{array, numbers, owned, require_shape, values};
use crate::failure::{refused, refused_value};
use crate::ground::{Pickled, grid, layer, pairs, require_classes, with_keywords};
use crate::typed::{Array, Scalar};

/// Numbers of one risk: linear traction, angular traction, |roll|, |pitch|.
const N_PARAMETERS: usize = 4;
/// Poses of a map, as many as the controller can count.
const POSES_MAX: usize = i32::MAX as usize;

/// The worst expected traversability of every cell and heading, and the ground under it: what the controller drives on.
///
/// Made by `RiskMap.from_arrays`, and by `PhysicsPrior.judge` and `Evidential.judge`. Rows count north, columns east, yaw
/// bin k is centred at (k + 1/2) 2 pi / n_yaws. The outermost ring of cells is closed: its risks are zero, nothing moves
/// there.
#[pyclass(frozen, module = "surefoot")]
pub struct RiskMap {
    geometry: GridGeometry,
    n_yaws: usize,
    /// Float32 (row, col, yaw, parameter), without gaps. No other object of Python's refers to it, so that nobody gives it
    /// another type or shape.
    risks: Py<PyArray4<f32>>,
    ground: Vec<Ground>,
}

#[pymethods]
impl RiskMap {
    /// Whether a risk is that of a pose that touches an obstacle: from this |roll| on [rad].
    #[classattr]
    const BLOCKED_RAD: f32 = Risk::BLOCKED_RAD;

    /// A risk map of your own.
    ///
    /// risks: float32 (row, col, yaw, 4): linear and angular traction, achieved over commanded, from 0 to 1, and the worst
    /// |roll| and |pitch| [rad]. resolution_m: edge of a cell [m]. origin: lattice index (col, row) of the south-west cell,
    /// whose south-west corner lies at origin * resolution_m. gradient: float32 (row, col, 2), height change per metre east
    /// and north. terrain_class: uint8 (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle. flags: uint8 (row, col), the
    /// sum of 1 obstacle, 2 unknown, 4 out of distribution.
    ///
    /// The map reads risks where they lie if they lie row by row without gaps and their outermost ring is zero; else it
    /// reads a copy, in which that ring is zero. Values are checked here and not again: who writes to the array later
    /// changes the map, and may do so between calls. Raises `TypeError` for another type of number, `ValueError` for
    /// another shape, and for values out of range with their place.
    #[staticmethod]
    #[pyo3(signature = (
        risks: "_Float32",
        resolution_m,
        *,
        origin=(0, 0),
        gradient: "_Float32 | None" = None,
        terrain_class: "_Uint8 | None" = None,
        flags: "_Uint8 | None" = None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn from_arrays(
        py: Python<'_>,
        risks: &Bound<'_, PyAny>,
        resolution_m: f64,
        origin: (i64, i64),
        gradient: Option<&Bound<'_, PyAny>>,
        terrain_class: Option<&Bound<'_, PyAny>>,
        flags: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let risks = array::<f32, Ix4>("risks", risks, "row, col, yaw, 4")?;
        let &[n_rows, n_cols, n_yaws, _] = risks.shape() else {
            return Err(refused("risks", "four axes", risks.ndim()));
        };
        let geometry = grid([n_rows, n_cols], resolution_m, origin)?;
        require_shape("risks", risks.shape(), &[n_rows, n_cols, n_yaws, N_PARAMETERS])?;
        if n_yaws == 0 || geometry.n_cells().saturating_mul(n_yaws) > POSES_MAX {
            return Err(refused(
                "risks",
                format!("from 1 to {POSES_MAX} poses, one yaw at the least"),
                "others",
            ));
        }
        let ground = Layers { gradient, terrain_class, flags }.ground([n_rows, n_cols])?;
        let poses: &[Risk] = bytemuck::cast_slice(values("risks", &risks)?);
        check(poses, geometry, n_yaws)?;
        if is_closed(poses, geometry, n_yaws) {
            return Self::over(&risks, geometry, n_yaws, ground);
        }
        let mut map = traversability::RiskMap::constant(geometry, n_yaws, Risk::OUTSIDE);
        map.fill(|own, own_ground| {
            own.copy_from_slice(poses);
            own_ground.copy_from_slice(&ground);
        });
        Self::copied(&map).into_python(py)
    }

    /// Number of rows, columns and yaws.
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        (self.geometry.n_rows, self.geometry.n_cols, self.n_yaws)
    }

    /// Edge of a cell [m].
    #[getter]
    fn resolution_m(&self) -> f64 {
        self.geometry.resolution_m
    }

    /// Lattice index (col, row) of the south-west cell.
    #[getter]
    fn origin(&self) -> (i64, i64) {
        self.geometry.origin.into()
    }

    /// The risks that the map reads, float32 (row, col, yaw, 4), to be read: the same memory, no copy.
    #[getter]
    fn risks(&self, py: Python<'_>) -> PyResult<Array<f32, Ix4>> {
        let view = self.risks.bind(py).call_method0("view")?;
        view.getattr("flags")?.setattr("writeable", false)?;
        Ok(Array(view.cast_into::<PyArray4<f32>>()?.unbind()))
    }

    /// Height change per metre east and north: float32 (row, col, 2), a copy.
    #[getter]
    fn gradient(&self, py: Python<'_>) -> PyResult<Array<f32, Ix3>> {
        let GridGeometry { n_rows, n_cols, .. } = self.geometry;
        owned(py, self.ground.iter().flat_map(|ground| ground.gradient).collect(), [n_rows, n_cols, 2])
    }

    /// What covers the ground: uint8 (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle, a copy.
    #[getter]
    fn terrain_class(&self, py: Python<'_>) -> PyResult<Array<u8, Ix2>> {
        self.cells(py, |ground| ground.class)
    }

    /// The sum of 1 obstacle, 2 unknown, 4 out of distribution: uint8 (row, col), a copy.
    #[getter]
    fn flags(&self, py: Python<'_>) -> PyResult<Array<u8, Ix2>> {
        self.cells(py, |ground| ground.flags.0)
    }

    /// The risk of a pose: linear traction, angular traction, |roll|, |pitch|; all zero beyond the map.
    #[pyo3(signature = (pose: "_Floats"))]
    fn risk_at(&self, py: Python<'_>, pose: &Bound<'_, PyAny>) -> PyResult<(f32, f32, f32, f32)> {
        let [x_m, y_m, yaw_rad] = numbers("pose", pose, ["x_m", "y_m", "yaw_rad"])?;
        let risk = self.with_view(py, |view| view.risk_at(x_m, y_m, yaw_rad))?;
        Ok((risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickled<'py>> {
        let layers = PyDict::new(py);
        layers.set_item("origin", self.origin())?;
        layers.set_item("gradient", self.gradient(py)?)?;
        layers.set_item("terrain_class", self.terrain_class(py)?)?;
        layers.set_item("flags", self.flags(py)?)?;
        let make = with_keywords(&py.get_type::<Self>().getattr("from_arrays")?, &layers)?;
        Ok((make, (self.risks(py)?.0.into_bound(py).into_any(), self.resolution_m())))
    }

    fn __repr__(&self) -> String {
        let (n_rows, n_cols, n_yaws) = self.shape();
        let resolution_m = self.resolution_m();
        format!("<surefoot.RiskMap of {n_rows} x {n_cols} cells of {resolution_m} m, {n_yaws} yaws>")
    }
}

impl RiskMap {
    /// Reads the risks where they lie.
    fn over(
        risks: &PyReadonlyArray4<'_, f32>,
        geometry: GridGeometry,
        n_yaws: usize,
        ground: Vec<Ground>,
    ) -> PyResult<Self> {
        let own = risks.call_method0("view")?.cast_into::<PyArray4<f32>>()?.unbind();
        Ok(Self { geometry, n_yaws, risks: own, ground })
    }

    /// What Python is to hold of a map of the crates: one copy of it, which can be made without Python's lock.
    pub fn copied(map: &traversability::RiskMap) -> Copied {
        Copied::of(&map.view())
    }

    /// Does `work` with the map as the controller reads it.
    pub fn with_view<R>(&self, py: Python<'_>, work: impl FnOnce(RiskMapView<'_>) -> R) -> PyResult<R> {
        let risks = self.risks.bind(py).try_readonly()?;
        let risks = bytemuck::cast_slice(values("risks", &risks)?);
        let view = RiskMapView::new(self.geometry, self.n_yaws, risks, &self.ground);
        view.map(work).map_err(refused_value)
    }

    fn cells<T: Scalar>(&self, py: Python<'_>, of: impl Fn(&Ground) -> T) -> PyResult<Array<T, Ix2>> {
        let GridGeometry { n_rows, n_cols, .. } = self.geometry;
        owned(py, self.ground.iter().map(of).collect(), [n_rows, n_cols])
    }
}

/// A copy of a risk map on its way to Python.
pub struct Copied {
    geometry: GridGeometry,
    n_yaws: usize,
    risks: Vec<f32>,
    ground: Vec<Ground>,
}

impl Copied {
    /// A copy of a view.
    pub fn of(view: &RiskMapView<'_>) -> Self {
        Self {
            geometry: view.geometry,
            n_yaws: view.n_yaws,
            risks: bytemuck::cast_slice(view.risks).to_vec(),
            ground: view.ground.to_vec(),
        }
    }

    /// The map over the memory of the copy.
    pub fn into_python(self, py: Python<'_>) -> PyResult<RiskMap> {
        let Self { geometry, n_yaws, risks, ground } = self;
        let risks = owned(py, risks, [geometry.n_rows, geometry.n_cols, n_yaws, N_PARAMETERS])?;
        Ok(RiskMap { geometry, n_yaws, risks: risks.0, ground })
    }
}

/// The ground under a map as it comes from Python.
struct Layers<'a, 'py> {
    gradient: Option<&'a Bound<'py, PyAny>>,
    terrain_class: Option<&'a Bound<'py, PyAny>>,
    flags: Option<&'a Bound<'py, PyAny>>,
}

impl Layers<'_, '_> {
    fn ground(&self, shape: [usize; 2]) -> PyResult<Vec<Ground>> {
        let n_cols = shape[1];
        let mut ground = vec![Ground::default(); shape[0] * n_cols];
        if let Some(gradients) = pairs("gradient", self.gradient, shape)? {
            check_each(&gradients, n_cols, "gradient", "two finite numbers", |gradient| {
                gradient.iter().all(|slope| slope.is_finite())
            })?;
            ground.iter_mut().zip(gradients).for_each(|(ground, gradient)| ground.gradient = gradient);
        }
        if let Some(classes) = layer::<u8>("terrain_class", self.terrain_class, shape)? {
            require_classes(&classes, n_cols)?;
            ground.iter_mut().zip(classes).for_each(|(ground, class)| ground.class = class);
        }
        if let Some(flags) = layer::<u8>("flags", self.flags, shape)? {
            let all = GroundFlags::OBSTACLE.with(GroundFlags::UNKNOWN).with(GroundFlags::OUT_OF_DISTRIBUTION);
            check_each(&flags, n_cols, "flags", "a sum of 1, 2 and 4", |flags| {
                all.contains(GroundFlags(*flags))
            })?;
            ground.iter_mut().zip(flags).for_each(|(ground, flags)| ground.flags = GroundFlags(flags));
        }
        Ok(ground)
    }
}

/// Refuses the first value of a grid that cannot be.
fn check_each<T: std::fmt::Debug>(
    values: &[T],
    n_cols: usize,
    name: &str,
    expected: &str,
    may_be: impl Fn(&T) -> bool,
) -> PyResult<()> {
    match values.iter().position(|value| !may_be(value)) {
        Some(index) => {
            let place = format!("{name}[{}, {}]", index / n_cols, index % n_cols);
            Err(refused(&place, expected, format!("{:?}", values[index])))
        }
        None => Ok(()),
    }
}

/// Refuses the first risk that cannot be.
fn check(risks: &[Risk], geometry: GridGeometry, n_yaws: usize) -> PyResult<()> {
    let share = ("a number from 0 to 1", 0.0..=1.0);
    let angle = ("a finite number >= 0", 0.0..=f32::MAX);
    let limits = [&share, &share, &angle, &angle];
    let found = |risk: &Risk| [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad];
    let fits = |risk: &Risk| found(risk).iter().zip(limits).all(|(value, (_, range))| range.contains(value));
    let Some(index) = risks.iter().position(|risk| !fits(risk)) else { return Ok(()) };
    let found = found(&risks[index]);
    let wrong = found.iter().zip(limits).position(|(value, (_, range))| !range.contains(value)).unwrap_or(0);
    let Cell { row, col } = geometry.cell(index / n_yaws);
    let place = format!("risks[{row}, {col}, {}, {wrong}]", index % n_yaws);
    Err(refused(&place, limits[wrong].0, found[wrong]))
}

/// Whether nothing moves on the outermost ring.
fn is_closed(risks: &[Risk], geometry: GridGeometry, n_yaws: usize) -> bool {
    let GridGeometry { n_rows, n_cols, .. } = geometry;
    risks.chunks_exact(n_yaws).enumerate().all(|(index, yaws)| {
        let Cell { row, col } = geometry.cell(index);
        let is_inside = row > 0 && row + 1 < n_rows && col > 0 && col + 1 < n_cols;
        is_inside || yaws.iter().all(|risk| *risk == Risk::OUTSIDE)
    })
}
