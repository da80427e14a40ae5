//! Where a belief about the ground and drives part, over recordings of Python's.

use std::path::{Path, PathBuf};

use bench::ground_drives::GroundBelief;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use sim_to_real::{GroundCause, judge_ground};

use crate::belief::Evidential;
use crate::detached::detached;
use crate::failure::refused_value;
use crate::frames::in_notebook;
use crate::settings::json_dict;
use crate::typed::Fields;
use crate::vehicle::Vehicle;

/// Holds what was foretold of the ground against what recorded drives met on it.
///
/// drives, reference: lists of paths of recordings (.mcap) that hold maps, as `surefoot drive` and `Simulation.record` write
/// them; those of reference are of a time when all was right, and what has changed since is named. vehicle: the `Vehicle`
/// that drove. evidential: the networks that judge the ground; without, physics alone does. Returns a `GroundReport`. Raises
/// `ValueError` for what is no drive or has no maps.
#[pyfunction]
#[pyo3(signature = (
    drives: "Sequence[_Path]",
    vehicle,
    *,
    reference: "Sequence[_Path]" = Vec::new(),
    evidential=None,
))]
pub fn ground(
    py: Python<'_>,
    drives: Vec<PathBuf>,
    vehicle: &Vehicle,
    reference: Vec<PathBuf>,
    evidential: Option<&Evidential>,
) -> PyResult<GroundReport> {
    let checkpoint = evidential.map(Evidential::checkpoint);
    let belief = GroundBelief { vehicle: &vehicle.0, checkpoint, elevation: None };
    let judged = detached(py, || {
        let mut doubts = Vec::new();
        let (met, n_drives) = belief.met(&drives, &mut doubts).map_err(|error| error.to_string())?;
        let (before, _) = belief.met(&reference, &mut doubts).map_err(|error| error.to_string())?;
        let report = judge_ground(&met, &before, n_drives).map_err(|error| error.to_string())?;
        let told = format!("{}, {n_drives} drives, {} of reference", vehicle.0.name, reference.len());
        Ok::<_, String>(GroundReport { report, drives: told, doubts })
    })?;
    judged.map_err(refused_value)
}

/// Where a belief about the ground and drives part, and what has changed; made by `ground`. In a notebook it shows itself.
#[pyclass(frozen, module = "surefoot.gap")]
pub struct GroundReport {
    report: sim_to_real::GroundReport,
    drives: String,
    doubts: Vec<String>,
}

impl GroundReport {
    fn page(&self) -> Result<(report::Picture, String), String> {
        let picture =
            report::ground::picture(&self.report, &self.drives).map_err(|error| error.to_string())?;
        let page = report::ground::page(&self.report, &self.drives, &picture);
        Ok((picture, page))
    }

    fn written_to(&self, folder: &Path) -> Result<(), String> {
        let (picture, page) = self.page()?;
        let problem = |error: formats::OutputError| error.to_string();
        formats::prepare_out_dir(folder, 0).map_err(problem)?;
        formats::write_bytes_atomic(&folder.join(picture.file), &picture.png).map_err(problem)?;
        formats::write_json_atomic(&folder.join("ground.json"), &self.report).map_err(problem)?;
        formats::write_bytes_atomic(&folder.join("ground.html"), page.as_bytes()).map_err(problem)
    }
}

#[pymethods]
impl GroundReport {
    /// All numbers as a dict: that of `ground.json`, whose layout has the version `schema_version`.
    #[getter]
    fn numbers<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        json_dict(py, &serde_json::to_vec(&self.report).map_err(refused_value)?)
    }

    /// Id of what has changed since the reference drives; `None` where nothing has, or nothing known explains it.
    #[getter]
    fn named(&self) -> Option<String> {
        self.report.change.as_ref()?.named.map(GroundCause::id)
    }

    /// Whether something has changed that no known cause explains.
    #[getter]
    fn is_unknown(&self) -> bool {
        self.report.change.as_ref().is_some_and(|change| change.is_unknown)
    }

    /// What is doubtful about the drives, in sentences.
    #[getter]
    fn doubts(&self) -> Vec<&str> {
        self.doubts.iter().map(String::as_str).collect()
    }

    /// The page as HTML that needs nothing else, with its picture.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || self.page())?.map(|(_, page)| page).map_err(refused_value)
    }

    /// Writes ground.html, ground.json and ground.png into a folder, which is made if it is missing.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        detached(py, || self.written_to(&folder))?.map_err(PyOSError::new_err)
    }

    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        Ok(in_notebook(&self.html(py)?))
    }

    fn __str__(&self) -> String {
        report::ground::text(&self.report)
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.gap.GroundReport of {}: {:?}>", self.drives, self.named())
    }
}
