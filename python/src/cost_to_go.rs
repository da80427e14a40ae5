//! The least time to the goal over a map.

use mppi::CostToGoConfig;
use numpy::ndarray::{Ix2, Ix3};
use pyo3::prelude::*;

use crate::any_model::AnyModel;
use crate::arrays::{numbers, owned};
use crate::detached::Turns;
use crate::failure::refused_value;
use crate::ground::grid;
use crate::risk_map::RiskMap;
use crate::settings::Source;
use crate::typed::Array;

/// The field of least time to the goal over the known map, which tells the controller what lies beyond its horizon, with
/// what a turning circle adds to it from every place and heading.
///
/// CostToGo(model, n_rows, n_cols, settings=None) for risk maps of that many rows and columns. settings: a dict, TOML text or
/// a path with what differs from the defaults, as the part "cost_to_go" of `settings_for(vehicle)`.
#[pyclass(frozen, module = "surefoot")]
pub struct CostToGo {
    pub field: Turns<mppi::CostToGo>,
    shape: [usize; 2],
}

#[pymethods]
impl CostToGo {
    #[new]
    #[pyo3(signature = (model, n_rows, n_cols, settings: "_Settings | None" = None))]
    fn new(
        model: AnyModel,
        n_rows: usize,
        n_cols: usize,
        settings: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let config: CostToGoConfig = match settings {
            Some(settings) => Source::new("settings", settings)?.parse(formats::ConfigText::parse)?,
            None => CostToGoConfig::default(),
        };
        grid([n_rows, n_cols], 1.0, (0, 0))?;
        let field = mppi::CostToGo::new(config, model.limits(), n_rows, n_cols).map_err(refused_value)?;
        Ok(Self { field: Turns::new(field), shape: [n_rows, n_cols] })
    }

    /// Solves for the times over the map to the goal, two numbers, x_m, y_m, which may lie beyond it; within the tolerance of
    /// it the straight line counts. Raises `ValueError` for a map of another shape or a goal that is no place; the field is
    /// then as it was.
    #[pyo3(signature = (risk_map, goal_m: "_Floats", tolerance_m=0.0))]
    fn update(
        &self,
        py: Python<'_>,
        risk_map: &Bound<'_, RiskMap>,
        goal_m: &Bound<'_, PyAny>,
        tolerance_m: f64,
    ) -> PyResult<()> {
        let goal_m = numbers("goal_m", goal_m, ["x_m", "y_m"])?;
        let updated = risk_map
            .get()
            .with_view(py, |map| self.field.take(py, |field| field.update(map, goal_m, tolerance_m)))?;
        updated?.map_err(refused_value)
    }

    /// Least time from each cell to the goal [s]: float32 (row, col), zero before the first update, a copy.
    #[getter]
    fn seconds(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        let seconds = self.field.take(py, |field| field.view().seconds.to_vec())?;
        owned(py, seconds, self.shape)
    }

    /// What keeping to the turning circle takes beyond that [s]: float32 (heading, row, col), a copy; no heading for a vehicle
    /// that turns on the spot or before the first update, else 16: to the 8 adjacent cells and to the 8 a knight's move away,
    /// counter-clockwise from east.
    #[getter]
    fn turning_s(&self, py: Python<'_>) -> PyResult<Array<f32, Ix3>> {
        let turning_s = self.field.take(py, |field| field.view().turning_s.to_vec())?;
        let [n_rows, n_cols] = self.shape;
        let n_headings = turning_s.len() / (n_rows * n_cols);
        owned(py, turning_s, [n_headings, n_rows, n_cols])
    }

    fn __repr__(&self) -> String {
        let [n_rows, n_cols] = self.shape;
        format!("<surefoot.CostToGo of {n_rows} x {n_cols} cells>")
    }
}
