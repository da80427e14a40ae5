//! Who judges the ground: physics, or what was learned.

use std::sync::Arc;

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use evidential::{BeliefMapError, Checkpoint, Learned, Method, Unfamiliar, shipped};
use formats::overlay;
use navigator::{Config, RiskEstimator};
use physics_prior::Assumption;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::{PyTypeInfo, type_hint_union};
use terrain::{DistantPosition, GridGeometry, GridMap, SurfaceCell};
use traversability::CvarLevel;

use crate::arrays::{kind, numbers};
use crate::detached::{Turns, pool};
use crate::elevation::ElevationMap;
use crate::failure::{refused, refused_type, refused_value};
use crate::ground::Surface;
use crate::risk_map::{Copied, RiskMap};
use crate::settings::Source;
use crate::vehicle::AnyVehicle;

/// The physics prior: what shape and cover of the ground do to a vehicle before anything was learned (PIETRA, equations 15
/// to 18).
///
/// PhysicsPrior(vehicle, settings=None, *, cvar_level=0.6). settings: a dict, TOML text or a path with what differs from
/// those that fit the vehicle, as `settings_for(vehicle)`, of which "prior", "risk_map" and the instruction set of
/// "controller" count. cvar_level: share of the worst outcomes that counts, in (0, 1].
#[pyclass(frozen, module = "surefoot")]
pub struct PhysicsPrior(Judge);

#[pymethods]
impl PhysicsPrior {
    #[new]
    #[pyo3(signature = (vehicle, settings: "_Settings | None" = None, *, cvar_level=0.6))]
    fn new(vehicle: AnyVehicle<'_>, settings: Option<&Bound<'_, PyAny>>, cvar_level: f64) -> PyResult<Self> {
        let level = CvarLevel::new(cvar_level).map_err(refused_value)?;
        let config = config(&vehicle, settings)?;
        let belief = Belief::Physics(Assumption::Physics { prior: config.prior, level });
        Ok(Self(Judge::new(&vehicle, config, belief)?))
    }

    /// The risk map of the ground.
    ///
    /// ground: `Surface` or `ElevationMap`. centre_m: two numbers, x_m, y_m, around which the window of
    /// `settings["risk_map"]` lies; without them the map covers all of the ground. Maps are made from scratch, on all cores
    /// and without Python's lock. Raises `ValueError` where cells of map and ground cannot line up.
    #[pyo3(signature = (ground, *, centre_m: "_Floats | None" = None))]
    fn judge(
        &self,
        py: Python<'_>,
        ground: AnyGround<'_>,
        centre_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<RiskMap> {
        self.0.judge(py, &ground, centre_m)
    }

    fn __repr__(&self) -> &'static str {
        "<surefoot.PhysicsPrior>"
    }
}

/// What driving taught, fused with the physics prior by evidence (PIETRA, equations 9 to 14).
///
/// Made by `Evidential.load`, of the networks that come with surefoot, and by `Evidential.from_bytes`.
#[pyclass(frozen, module = "surefoot")]
pub struct Evidential {
    judge: Judge,
    checkpoint: Arc<Checkpoint>,
}

#[pymethods]
impl Evidential {
    /// The networks that come with surefoot, for a vehicle like the one that they were trained on.
    ///
    /// vehicle: `Vehicle("pietra_full_size")` or one of its wheelbase, track and wheels. method: "pietra", "evora",
    /// "physics-informed" or "vanilla". unfamiliar: "fuse", ground unlike the training data is driven on as the posterior
    /// says, or "avoid", it costs a detour as well. settings and cvar_level as for `PhysicsPrior`. Raises `ValueError` for
    /// another vehicle or method.
    #[staticmethod]
    #[pyo3(signature = (
        vehicle,
        method="pietra",
        settings: "_Settings | None" = None,
        *,
        cvar_level=0.6,
        unfamiliar="fuse",
    ))]
    fn load(
        vehicle: AnyVehicle<'_>,
        method: &str,
        settings: Option<&Bound<'_, PyAny>>,
        cvar_level: f64,
        unfamiliar: &str,
    ) -> PyResult<Self> {
        let found = Method::ALL.into_iter().find(|known| known.name() == method);
        let names = Method::ALL.map(Method::name).join(", ");
        let found =
            found.ok_or_else(|| refused("method", format!("one of {names}"), format!("{method:?}")))?;
        let checkpoint = shipped(found, vehicle.geometry()).map_err(refused_value)?;
        Self::of(&vehicle, checkpoint, settings, (cvar_level, unfamiliar))
    }

    /// Networks of your own: what `surefoot train` wrote as weights.safetensors and weights.json.
    #[staticmethod]
    #[pyo3(signature = (
        vehicle,
        weights,
        sidecar,
        settings: "_Settings | None" = None,
        *,
        cvar_level=0.6,
        unfamiliar="fuse",
    ))]
    fn from_bytes(
        vehicle: AnyVehicle<'_>,
        weights: &[u8],
        sidecar: &[u8],
        settings: Option<&Bound<'_, PyAny>>,
        cvar_level: f64,
        unfamiliar: &str,
    ) -> PyResult<Self> {
        let checkpoint = Checkpoint::from_bytes(weights, sidecar).map_err(refused_value)?;
        Self::of(&vehicle, checkpoint, settings, (cvar_level, unfamiliar))
    }

    /// How the networks were trained.
    #[getter]
    fn method(&self) -> &'static str {
        self.checkpoint.sidecar.method.name()
    }

    /// The risk map of the ground, as `PhysicsPrior.judge`. Cells unlike the training data have flag 4.
    #[pyo3(signature = (ground, *, centre_m: "_Floats | None" = None))]
    fn judge(
        &self,
        py: Python<'_>,
        ground: AnyGround<'_>,
        centre_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<RiskMap> {
        self.judge.judge(py, &ground, centre_m)
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.Evidential {}>", self.checkpoint.sidecar.method.name())
    }
}

impl Evidential {
    fn of(
        vehicle: &AnyVehicle<'_>,
        checkpoint: Checkpoint,
        settings: Option<&Bound<'_, PyAny>>,
        (cvar_level, unfamiliar): (f64, &str),
    ) -> PyResult<Self> {
        let level = CvarLevel::new(cvar_level).map_err(refused_value)?;
        let unfamiliar = match unfamiliar {
            "fuse" => Unfamiliar::Fuse,
            "avoid" => Unfamiliar::Avoid,
            other => return Err(refused("unfamiliar", "\"fuse\" or \"avoid\"", format!("{other:?}"))),
        };
        let config = config(vehicle, settings)?;
        let (checkpoint, obstacle_margin_m) = (Arc::new(checkpoint), config.prior.obstacle_margin_m);
        let learned = Learned { checkpoint: Arc::clone(&checkpoint), unfamiliar, obstacle_margin_m, level };
        let judge = Judge::new(vehicle, config, Belief::Learned(learned))?;
        Ok(Self { judge, checkpoint })
    }

    /// The networks.
    pub fn checkpoint(&self) -> &Checkpoint {
        &self.checkpoint
    }
}

/// Ground that can be judged.
pub enum AnyGround<'py> {
    /// Given, or as it was known once.
    Given(Bound<'py, Surface>),
    /// As it is known now.
    Measured(Bound<'py, ElevationMap>),
}

impl<'py> FromPyObject<'_, 'py> for AnyGround<'py> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_union!(Surface::TYPE_HINT, ElevationMap::TYPE_HINT);

    fn extract(found: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(surface) = found.cast::<Surface>() {
            return Ok(Self::Given(surface.to_owned()));
        }
        let map = found.cast::<ElevationMap>();
        let map = map.map_err(|_| refused_type("ground", "a Surface or an ElevationMap", kind(&found)))?;
        Ok(Self::Measured(map.to_owned()))
    }
}

/// What the ground is judged by.
enum Belief {
    Physics(Assumption),
    Learned(Learned),
}

/// Makes risk maps, by an estimator that is made once per window.
struct Judge {
    geometry: Geometry,
    config: Config,
    belief: Belief,
    instructions: Instructions,
    made: Turns<Option<Made>>,
}

/// An estimator, and what it was made for.
struct Made {
    surface_m: f64,
    window: GridGeometry,
    estimator: RiskEstimator,
}

impl Judge {
    fn new(vehicle: &AnyVehicle<'_>, config: Config, belief: Belief) -> PyResult<Self> {
        let instructions = Instructions::find(config.controller.isa).map_err(refused_value)?;
        let judge =
            Self { geometry: *vehicle.geometry(), config, belief, instructions, made: Turns::new(None) };
        // What no estimator can be made of is refused now and not with the first map.
        let smallest = GridGeometry::centred(judge.config.risk_resolution_m(), 3, 3, 0.0, 0.0);
        judge.estimator(judge.config.elevation.resolution_m, smallest).map_err(refused_value)?;
        Ok(judge)
    }

    fn judge(
        &self,
        py: Python<'_>,
        ground: &AnyGround<'_>,
        centre_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<RiskMap> {
        let centre_m = centre_m.map(|centre_m| numbers("centre_m", centre_m, ["x_m", "y_m"])).transpose()?;
        let pool = pool()?;
        let copied = match ground {
            AnyGround::Given(surface) => {
                let surface = &surface.get().0;
                self.made.take(py, |made| pool.install(|| self.map(made, surface, centre_m)))??
            }
            AnyGround::Measured(map) => {
                let map = &map.get().map;
                self.made.take(py, |made| {
                    map.with(|map| pool.install(|| self.map(made, map.surface(), centre_m)))
                })???
            }
        };
        copied.into_python(py)
    }

    fn map(
        &self,
        made: &mut Option<Made>,
        surface: &GridMap<SurfaceCell>,
        centre_m: Option<[f64; 2]>,
    ) -> PyResult<Copied> {
        let surface_m = surface.geometry().resolution_m;
        let window = self.window(surface.geometry(), centre_m)?;
        let fits = |made: &Made| {
            let same = GridGeometry { origin: window.origin, ..made.window };
            made.surface_m == surface_m && same == window
        };
        let mut latest = match made.take().filter(fits) {
            Some(made) => made,
            None => {
                let estimator = self.estimator(surface_m, window).map_err(refused_value)?;
                Made { surface_m, window, estimator }
            }
        };
        latest.estimator.place_at(window.origin);
        latest.estimator.update_all(surface).map_err(refused_value)?;
        let copied = RiskMap::copied(latest.estimator.risk_map());
        *made = Some(latest);
        Ok(copied)
    }

    /// The window of the settings around a point, or as many cells as the ground has.
    fn window(&self, ground: &GridGeometry, centre_m: Option<[f64; 2]>) -> PyResult<GridGeometry> {
        let n_cells = self.config.risk_map.elevation_cells;
        let mut risk_map = self.config.risk_map;
        let [west_m, south_m] = ground.south_west_m();
        let middle_m = |start_m: f64, n: usize| start_m + 0.5 * n as f64 * ground.resolution_m;
        let [x_m, y_m] = centre_m.unwrap_or_else(|| {
            (risk_map.n_rows, risk_map.n_cols) = (ground.n_rows / n_cells, ground.n_cols / n_cells);
            [middle_m(west_m, ground.n_cols), middle_m(south_m, ground.n_rows)]
        });
        let resolution_m = ground.resolution_m * n_cells as f64;
        DistantPosition::check([x_m, y_m], resolution_m)
            .map_err(|error| refused_value(format!("centre_m: {error}")))?;
        Config { risk_map, ..self.config.clone() }.validate().map_err(refused_value)?;
        Ok(GridGeometry::centred(resolution_m, risk_map.n_rows, risk_map.n_cols, x_m, y_m))
    }

    fn estimator(&self, surface_m: f64, window: GridGeometry) -> Result<RiskEstimator, BeliefMapError> {
        let (geometry, n_yaws, with) = (&self.geometry, self.config.risk_map.n_yaws, self.instructions);
        match &self.belief {
            Belief::Physics(assumption) => {
                RiskEstimator::prior(geometry, assumption, surface_m, window, n_yaws, with)
            }
            Belief::Learned(learned) => {
                RiskEstimator::networks(geometry, learned, surface_m, window, n_yaws, with)
            }
        }
    }
}

/// The settings that fit a vehicle, with what was given in place of theirs.
fn config(vehicle: &AnyVehicle<'_>, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Config> {
    let fitting = vehicle.config();
    let config = match settings {
        Some(settings) => Source::new("settings", settings)?.parse(|text| overlay(text, &fitting))?,
        None => fitting,
    };
    config.validate().map_err(refused_value)?;
    Ok(config)
}
