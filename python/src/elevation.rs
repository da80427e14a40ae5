//! The elevation map, fused from points.

use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix1, Ix2};
use pyo3::prelude::*;
use terrain::{ElevationConfig, Pose, RangePoint, Scan, TerrainClass};

use crate::arrays::{Reals, array, numbers, optional, require_shape, values};
use crate::detached::Turns;
use crate::failure::{refused, refused_value};
use crate::ground::Surface;
use crate::settings::{Source, dict};
use crate::typed::Fields;

/// The semantic elevation map: fused from scans and poses, its window follows the vehicle.
///
/// ElevationMap(settings=None): a dict, TOML text or a path with what differs from the defaults, as the part "elevation" of
/// `settings_for(vehicle)`.
#[pyclass(frozen, module = "surefoot")]
pub struct ElevationMap {
    pub map: Turns<terrain::ElevationMap>,
    config: ElevationConfig,
}

#[pymethods]
impl ElevationMap {
    #[new]
    #[pyo3(signature = (settings: "_Settings | None" = None))]
    fn new(settings: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let config: ElevationConfig = match settings {
            Some(settings) => Source::new("settings", settings)?.parse(formats::ConfigText::parse)?,
            None => ElevationConfig::default(),
        };
        let map = terrain::ElevationMap::new(config).map_err(refused_value)?;
        Ok(Self { map: Turns::new(map), config })
    }

    /// Fuses one scan.
    ///
    /// points: float32 (point, 3), forward, left, up in the body frame [m]. pose: six numbers, x_m, y_m, z_m, roll_rad,
    /// pitch_rad, yaw_rad of the body frame, at the rear axle's centre, in the map frame. terrain_class: uint8 (point,), all
    /// open where there is none. origin_m: where the rays start in the body frame [m]. valid_at_ns: when it was measured,
    /// on a clock that only goes on. Points and classes are interleaved, which copies them; points that are no numbers are
    /// dropped and counted. Raises `ValueError` for a pose or an origin that is no place; the map is then as it was.
    #[pyo3(signature = (
        points: "_Float32",
        pose: "_Floats",
        *,
        terrain_class: "_Uint8 | None" = None,
        origin_m: "Sequence[float]" = Reals([0.0; 3]),
        valid_at_ns=0,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn fuse(
        &self,
        py: Python<'_>,
        points: &Bound<'_, PyAny>,
        pose: &Bound<'_, PyAny>,
        terrain_class: Option<&Bound<'_, PyAny>>,
        origin_m: Reals<f32, 3>,
        valid_at_ns: u64,
    ) -> PyResult<FuseReport> {
        let [x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad] =
            numbers("pose", pose, ["x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad"])?;
        let pose = Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad };
        let scan = Scan { valid_at_ns, origin_m: origin_m.0, points: range_points(points, terrain_class)? };
        let report = self.map.take(py, |map| map.fuse(&scan, &pose))?.map_err(refused_value)?;
        Ok(FuseReport {
            n_points: report.n_points,
            n_mapped: report.n_mapped(),
            n_rejected_non_finite: report.n_rejected_non_finite,
            n_own_body: report.n_own_body,
            n_out_of_window: report.n_out_of_window,
        })
    }

    /// The ground as it is known now, a copy that later scans do not change.
    fn surface(&self, py: Python<'_>) -> PyResult<Surface> {
        self.map.take(py, |map| Surface(map.surface().clone()))
    }

    /// Its settings as a dict.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.config)
    }

    fn __repr__(&self) -> String {
        let ElevationConfig { n_rows, n_cols, resolution_m, .. } = self.config;
        format!("<surefoot.ElevationMap of {n_rows} x {n_cols} cells of {resolution_m} m>")
    }
}

/// What became of the points of one scan.
#[pyclass(frozen, get_all, module = "surefoot")]
pub struct FuseReport {
    /// Points that the scan held.
    n_points: usize,
    /// Points that were mapped.
    n_mapped: usize,
    /// Points dropped because a coordinate was NaN or infinite.
    n_rejected_non_finite: usize,
    /// Points dropped because they lie on the vehicle itself.
    n_own_body: usize,
    /// Points dropped because they lie outside the window.
    n_out_of_window: usize,
}

#[pymethods]
impl FuseReport {
    fn __repr__(&self) -> String {
        format!("<surefoot.FuseReport: {} of {} points mapped>", self.n_mapped, self.n_points)
    }
}

fn range_points(
    points: &Bound<'_, PyAny>,
    terrain_class: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<RangePoint>> {
    let points = array::<f32, Ix2>("points", points, "point, 3")?;
    let n_points = points.shape()[0];
    require_shape("points", points.shape(), &[n_points, 3])?;
    let classes = optional::<u8, Ix1>("terrain_class", terrain_class, "point")?;
    let classes = match &classes {
        Some(classes) => {
            require_shape("terrain_class", classes.shape(), &[n_points])?;
            Some(values("terrain_class", classes)?)
        }
        None => None,
    };
    let positions_m = values("points", &points)?.as_chunks().0.iter();
    let point = |(index, &position_m): (usize, &[f32; 3])| {
        let number = classes.map_or(TerrainClass::Open as u8, |classes| classes[index]);
        let class = TerrainClass::ALL.get(usize::from(number)).copied();
        let refuse = || refused(&format!("terrain_class[{index}]"), "a class from 0 to 3", number);
        Ok(RangePoint { position_m, class: class.ok_or_else(refuse)? })
    };
    positions_m.enumerate().map(point).collect()
}
