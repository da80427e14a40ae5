//! What is to be driven: a world, a start and a goal.

use std::path::PathBuf;

use bench::closed_loop::layers_of;
use formats::{overlay, read_elevation};
use numpy::ndarray::Ix2;
use pyo3::prelude::*;
use scenarios::{ArenaConfig, PairWish, RockFieldConfig, RockMap, Split, WorldLayers};
use terrain::{GridGeometry, GridMap};

use crate::arrays::{kind, numbers, owned};
use crate::detached::{detached, pool};
use crate::failure::{refused_elevation, refused_type, refused_value};
use crate::ground::Surface;
use crate::settings::Source;
use crate::typed::Array;
use crate::vehicle::Vehicle;

/// A drive to be done: a world, a start, a goal.
///
/// Made by `Task.rock_field`, `Task.navigation`, `Task.arena` and `Task.terrain`. The same arguments give the same world, bit
/// for bit. A task can be driven any number of times, by any number of simulations at once, which share its world.
#[pyclass(frozen, module = "surefoot")]
pub struct Task(pub scenarios::Task);

#[pymethods]
impl Task {
    /// 40 m through a rock field that belongs to the seed.
    ///
    /// settings: a dict, TOML text or a path with what differs from the default field: side_m, resolution_m, rolling_std_m,
    /// test_height_scale, and for "small", "medium", "boulders" and "ridges" density_per_m2, height_m, height_to_radius,
    /// elongation and gap_m. Raises `ValueError` for a setting out of range.
    #[staticmethod]
    #[pyo3(signature = (seed, settings: "_Settings | None" = None))]
    fn rock_field(py: Python<'_>, seed: u64, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let config = changed(RockFieldConfig::default(), settings)?;
        detached(py, || scenarios::Task::rock_field(&config, seed))?.map(Self).map_err(refused_value)
    }

    /// A drive of `surefoot bench navigation`: 40 m between two cleared pads of a map.
    ///
    /// map and pair, from 0, and the seed of the maps, as the benchmark counts them; settings as of `rock_field`, for what
    /// differs from the benchmark's field. Raises `ValueError` for a setting out of range, or that leaves no room for 40 m.
    #[staticmethod]
    #[pyo3(signature = (map, pair, *, seed=1, settings: "_Settings | None" = None))]
    fn navigation(
        py: Python<'_>,
        map: u32,
        pair: u32,
        seed: u64,
        settings: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let config = changed(RockFieldConfig::navigation(), settings)?;
        let map = RockMap { seed, split: Split::Test, index: map };
        detached(py, || scenarios::Task::on_rock_map(&config, map, pair))?.map(Self).map_err(refused_value)
    }

    /// A hall of 9.6 x 8 m with bushes and a ramp, for a car of 33 cm.
    ///
    /// settings: bush_height_m, ramp_height_m, ramp_slope_length_m. Raises `ValueError` for a setting out of range.
    #[staticmethod]
    #[pyo3(signature = (settings: "_Settings | None" = None))]
    fn arena(py: Python<'_>, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let config = changed(ArenaConfig::default(), settings)?;
        detached(py, || scenarios::Task::arena(&config))?.map(Self).map_err(refused_value)
    }

    /// A drive over ground of your own.
    ///
    /// ground: a `Surface`, of which the heights count and lie where they lie in the map frame, or the path of an elevation
    /// file (.npz, GeoTIFF, 16-bit PNG), whose south-west corner is the origin. vehicle: `Vehicle` that has to get there.
    /// start: (x_m, y_m, yaw_rad); goal_m: (x_m, y_m); what is left open is picked by the seed, distance_m apart, where the
    /// vehicle can stand and a way is between. Raises `ValueError` for ground without such a pair, `OSError` for a file that
    /// cannot be read.
    #[staticmethod]
    #[pyo3(signature = (
        ground: "Surface | _Path",
        vehicle,
        *,
        start: "_Floats | None" = None,
        goal_m: "_Floats | None" = None,
        distance_m=None,
        seed=1,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn terrain(
        py: Python<'_>,
        ground: &Bound<'_, PyAny>,
        vehicle: &Bound<'_, Vehicle>,
        start: Option<&Bound<'_, PyAny>>,
        goal_m: Option<&Bound<'_, PyAny>>,
        distance_m: Option<f64>,
        seed: u64,
    ) -> PyResult<Self> {
        let start = start.map(|start| numbers("start", start, ["x_m", "y_m", "yaw_rad"])).transpose()?;
        let goal_m = goal_m.map(|goal_m| numbers("goal_m", goal_m, ["x_m", "y_m"])).transpose()?;
        let (name, layers) = layers(ground)?;
        let vehicle = &vehicle.get().0;
        let distance_m = distance_m.unwrap_or_else(|| layers.drive_distance_m());
        let wish = PairWish { start, goal_m, distance_m };
        let pool = pool()?;
        let made = detached(py, || {
            pool.install(|| scenarios::Task::in_layers(&name, &layers, vehicle, &wish, seed))
        })?;
        made.map(Self).map_err(refused_value)
    }

    /// What the world is called.
    #[getter]
    fn name(&self) -> &str {
        &self.0.world.name
    }

    /// Rear axle's centre and heading at the start: x_m, y_m, yaw_rad.
    #[getter]
    fn start(&self) -> (f64, f64, f64) {
        self.0.start.into()
    }

    /// Where the rear axle's centre is to come: x_m, y_m.
    #[getter]
    fn goal_m(&self) -> (f64, f64) {
        self.0.goal_m.into()
    }

    /// How near the goal counts as there [m].
    #[getter]
    fn tolerance_m(&self) -> f64 {
        self.0.goal_tolerance_m
    }

    /// What must not be left: west, south, east, north [m].
    #[getter]
    fn bounds_m(&self) -> (f64, f64, f64, f64) {
        let [[west_m, south_m], [east_m, north_m]] = [self.0.bounds.south_west_m, self.0.bounds.north_east_m];
        (west_m, south_m, east_m, north_m)
    }

    /// Edge of a cell of the world [m]; its south-west corner is that of `bounds_m`.
    #[getter]
    fn resolution_m(&self) -> f64 {
        self.0.world.geometry().resolution_m
    }

    /// The true height of the ground [m]: float32 (row, col), a copy.
    #[getter]
    fn height_m(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        let GridGeometry { n_rows, n_cols, .. } = *self.0.world.geometry();
        owned(py, self.0.world.heights.values().to_vec(), [n_rows, n_cols])
    }

    fn __repr__(&self) -> String {
        let [x_m, y_m, _] = self.0.start;
        let distance_m = self.0.distance_to_goal_m(x_m, y_m);
        format!("<surefoot.Task of {distance_m:.1} m, {}>", self.0.world.name)
    }
}

/// Settings with what differs from them.
pub fn changed<T>(usual: T, changes: Option<&Bound<'_, PyAny>>) -> PyResult<T>
where
    T: serde::Serialize + serde::de::DeserializeOwned,
{
    match changes {
        Some(changes) => Source::new("settings", changes)?.parse(|text| overlay(text, &usual)),
        None => Ok(usual),
    }
}

/// Ground of the user's own, and what to call it.
pub fn layers(ground: &Bound<'_, PyAny>) -> PyResult<(String, WorldLayers)> {
    if let Ok(surface) = ground.cast::<Surface>() {
        let surface = &surface.get().0;
        let heights_m = surface.values().iter().map(|cell| cell.height_m).collect();
        let heights_m = GridMap::from_values(*surface.geometry(), heights_m);
        let heights_m = heights_m.ok_or_else(|| refused_value("ground: expected a height for every cell"))?;
        return Ok(("a surface from Python".to_owned(), WorldLayers::bare(heights_m)));
    }
    let Ok(path) = ground.extract::<PathBuf>() else {
        return Err(refused_type("ground", "a Surface or a path", kind(ground)));
    };
    let file = read_elevation(&path).map_err(refused_elevation)?;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Ok((name, layers_of(file)))
}

impl Task {
    /// The same for a simulation.
    pub fn share(&self) -> scenarios::Task {
        self.0.clone()
    }
}
