//! Why simulator and robot disagree, over drives of Python's.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bicycle::{Column, Effect};
use formats::DriveLogFile;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use report::gap::Told;
use sim_to_real::{
    Answer, Baseline, Case, Diagnosed, Diagnosis, Drives, InSimulatorDiagnosis, InSimulatorError, Manoeuvre,
    PartUnknown, PoseSensor, PoseUnknown, Verification, WithoutSimulator, controller_model,
    decide_in_simulator, diagnose_without_simulator, own_runs, repaired, verify,
};

use crate::arrays::kind;
use crate::detached::{detached, interruptible};
use crate::drives::{column_names, drives, machine};
use crate::failure::{refused_type, refused_value};
use crate::frames::{frame, in_notebook};
use crate::model::Model;
use crate::own_simulator::OwnSimulator;
use crate::recording::log_columns;
use crate::settings::json_dict;
use crate::typed::{Fields, Intervals};
use crate::vehicle::Vehicle;

/// Where the designed commands stand, as the advice says it.
const MANOEUVRE: &str = "manoeuvre.csv";

/// Says why simulator and robot disagree: where, which effect, how far the gap shrinks, and what to drive next.
///
/// sim, real, heldout: lists of drives, each a data frame or a dict of arrays with the columns of a drive log (`t` [s] and a
/// command, `cmd_speed` [m/s] and `cmd_steer` [rad] or `steer_meas`, or `cmd_wz` [rad/s] of a skid-steered machine; used
/// where they are there: x, y [m], yaw [rad], vx, vy [m/s], wz [rad/s], roll, pitch, and `run`, in which `t` begins anew), a
/// `Recording`, or the path of a CSV file or a recording. sim holds drives of the simulator, at least two of them, or none,
/// and then a bare bicycle stands for it; heldout are used for nothing but to verify the answer. vehicle: a `Vehicle`, the
/// name of one that ships, the path of a vehicle's file, or a dict or a dataclass of it ("name", "wheelbase" [m], and where known
/// "max_steer" [rad], "max_speed" [m/s], "noise"). columns: a dict from our names to yours, {"vx": "wheel_speed"}.
/// simulator: a callable that drives commands as your simulator does and so decides; see docs/python.md. model: a `Model` or
/// a `Vehicle`, the controller's model to begin with, else the one that the simulator's drives calibrate; what is announced
/// is fitted beside its effects for `apply`, and does not depend on it. estimate: "time_offset" and "lever_arm" of the robot's
/// pose sensor are estimated from its drives first and taken out of them. name: for the report.
///
/// Returns a `GapReport`. Takes from seconds to minutes; Ctrl-C ends it. Raises `ValueError` for drives that would be
/// misread, with what gave them away, and what the callable raises.
#[pyfunction]
#[pyo3(signature = (
    sim: "Sequence[_Drive]",
    real: "Sequence[_Drive]",
    vehicle: "Vehicle | _Path | _Description",
    *,
    heldout: "Sequence[_Drive] | None" = None,
    columns: "dict[str, str] | None" = None,
    simulator: "Callable[[dict[str, Any]], Mapping[str, Any]] | None" = None,
    model: "Model | Vehicle | None" = None,
    estimate: "Sequence[str]" = Vec::new(),
    name=None,
))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn diagnose(
    py: Python<'_>,
    sim: &Bound<'_, PyAny>,
    real: &Bound<'_, PyAny>,
    vehicle: &Bound<'_, PyAny>,
    heldout: Option<&Bound<'_, PyAny>>,
    columns: Option<&Bound<'_, PyDict>>,
    simulator: Option<&Bound<'_, PyAny>>,
    model: Option<&Bound<'_, PyAny>>,
    estimate: Vec<String>,
    name: Option<&str>,
) -> PyResult<GapReport> {
    let unknowns = estimate.iter().map(|word| pose_unknown(word)).collect::<PyResult<Vec<_>>>()?;
    let own_effects = model.map(|model| Ok::<_, PyErr>(believed(model)?.effects)).transpose()?;
    let (names, mut doubts) = (column_names(columns)?, Vec::new());
    let (sim, real) = (drives("sim", sim, &names, &mut doubts)?, drives("real", real, &names, &mut doubts)?);
    let heldout = heldout.map(|heldout| drives("heldout", heldout, &names, &mut doubts)).transpose()?;
    let machine = machine(vehicle, &[&sim.logs[..], &real.logs[..]].concat())?;
    let pose_sensor = (!unknowns.is_empty())
        .then(|| PoseSensor::estimated(&real, machine.wheelbase_m, &unknowns).map_err(refused_value))
        .transpose()?;
    let without = |drives: Drives| match &pose_sensor {
        Some(found) => found.taken_out_of(drives),
        None => drives,
    };
    let (real, heldout) = (without(real), heldout.map(without));
    let screened = interruptible(py, move || {
        let case = Case::screened(machine, sim, real, &mut doubts);
        case.map(|case| (case, doubts))
    })?;
    let (case, doubts) = screened.map_err(refused_value)?;
    let mut work = Work { case: Arc::new(case), doubts, decided: None };
    let own = simulator.map(OwnSimulator::new).transpose()?;
    work.try_out(own.as_ref())?;
    let name = name.unwrap_or(&work.case.machine.name).to_owned();
    let found = work.diagnosed(py)?;
    let (mut answer, manoeuvre) = work.advised(py, &found, name, own_effects)?;
    answer.pose_sensor = pose_sensor;
    work.decide(own.as_ref(), &mut answer)?;
    let heldout = work.screened_heldout(py, heldout.unwrap_or_default())?;
    work.verified(py, own.as_ref(), Opened { found, answer, manoeuvre, heldout })
}

fn pose_unknown(word: &str) -> PyResult<PoseUnknown> {
    match word {
        "time_offset" => Ok(PoseUnknown::TimeOffset),
        "lever_arm" => Ok(PoseUnknown::LeverArm),
        other => {
            let told = format!("estimate: expected \"time_offset\" and \"lever_arm\", found \"{other}\"");
            Err(refused_value(told))
        }
    }
}

/// What the real drives have shown, and against what.
type Found = Arc<(Baseline, Diagnosis)>;

/// A diagnosis under way.
struct Work {
    case: Arc<Case>,
    doubts: Vec<String>,
    decided: Option<InSimulatorDiagnosis>,
}

/// A diagnosis that cannot change any more, and the drives that it is to be verified on.
struct Opened {
    found: Found,
    answer: Answer,
    manoeuvre: Option<Manoeuvre>,
    heldout: Drives,
}

impl Work {
    /// Sends a simulator's own drives through it, so that one that does not run is told before anything is calibrated.
    fn try_out(&self, own: Option<&OwnSimulator<'_>>) -> PyResult<()> {
        let (Some(own), Case { machine, sim, .. }) = (own, &*self.case) else { return Ok(()) };
        if sim.logs.is_empty() {
            let told =
                "simulator: expected nominal drives, which tell how well it repeats itself, found none";
            return Err(refused_value(told));
        }
        own.run(&own_runs(&own.description, machine, &sim.logs).map_err(told)?)?;
        Ok(())
    }

    fn diagnosed(&self, py: Python<'_>) -> PyResult<Found> {
        let case = Arc::clone(&self.case);
        let found = interruptible(py, move || {
            let Case { machine, sim, real } = &*case;
            if sim.logs.is_empty() {
                let found = diagnose_without_simulator(machine, &real.logs);
                return found.map(|WithoutSimulator { baseline, diagnosis }| (baseline, diagnosis));
            }
            let baseline = Baseline::calibrate(machine, &sim.logs, &|_| ())?;
            let diagnosis = sim_to_real::diagnose(&baseline, machine, &real.logs)?;
            Ok((baseline, diagnosis))
        })?;
        Ok(Arc::new(found.map_err(refused_value)?))
    }

    fn advised(
        &self,
        py: Python<'_>,
        found: &Found,
        name: String,
        own_effects: Option<Vec<Effect>>,
    ) -> PyResult<(Answer, Option<Manoeuvre>)> {
        let (case, found) = (Arc::clone(&self.case), Arc::clone(found));
        let advised = interruptible(py, move || {
            let (baseline, diagnosis) = &*found;
            let mut answer = diagnosis.answer(&name);
            let Case { machine, real, .. } = &*case;
            let model = controller_model((baseline, diagnosis), machine, &real.logs, own_effects.as_deref())?;
            answer.controller_model = Some(model);
            let diagnosed = Diagnosed { case: &case, baseline, diagnosis };
            diagnosed.advise(&mut answer, MANOEUVRE).map(|manoeuvre| (answer, manoeuvre))
        })?;
        advised.map_err(refused_value)
    }

    fn decide(&mut self, own: Option<&OwnSimulator<'_>>, answer: &mut Answer) -> PyResult<()> {
        let (Some(own), Case { machine, sim, real }) = (own, &*self.case) else { return Ok(()) };
        let run = |runs: &[_]| own.run(runs);
        let drives = (&sim.logs[..], &real.logs[..]);
        let decided = decide_in_simulator(&own.description, machine, answer, drives, &run);
        self.decided = Some(decided.map_err(told)?);
        Ok(())
    }

    fn screened_heldout(&mut self, py: Python<'_>, heldout: Drives) -> PyResult<Drives> {
        let (case, doubts) = (&*self.case, &mut self.doubts);
        detached(py, || case.heldout(heldout, doubts))?.map_err(refused_value)
    }

    fn verified(
        mut self,
        py: Python<'_>,
        own: Option<&OwnSimulator<'_>>,
        opened: Opened,
    ) -> PyResult<GapReport> {
        let Opened { found, mut answer, manoeuvre, heldout } = opened;
        if let (Some(own), Some(decided)) = (own, &self.decided)
            && !heldout.logs.is_empty()
        {
            let run = |runs: &[_]| own.run(runs);
            let verified = decided.verify(&self.case.machine, &heldout.logs, &run);
            answer.in_simulator = Some(verified.map_err(told)?);
        }
        let (case, doubts) = (Arc::clone(&self.case), std::mem::take(&mut self.doubts));
        let report = interruptible(py, move || {
            let (baseline, diagnosis) = &*found;
            let mut verification = None;
            if !heldout.logs.is_empty() {
                let verified = verify(baseline, &case.machine, diagnosis, &heldout.logs);
                let verified = verified.map_err(|error| error.to_string())?;
                answer = verified.complete(answer);
                let bound = Diagnosed { case: &case, baseline, diagnosis }.bound(&mut answer, &heldout.logs);
                bound.map_err(|error| error.to_string())?;
                verification = Some(verified);
            }
            answer.advice.extend(doubts.iter().map(|doubt| format!("check {doubt}")));
            Ok::<_, String>(GapReport {
                found: Arc::clone(&found),
                case,
                heldout,
                verification,
                answer,
                manoeuvre,
                doubts,
            })
        })?;
        report.map_err(refused_value)
    }
}

/// What a simulator raised as it was raised, all else as what is wrong with the drives.
fn told(error: InSimulatorError<PyErr>) -> PyErr {
    match error {
        InSimulatorError::Run(error) => error,
        other => refused_value(other),
    }
}

/// What separates a robot from its simulator, as `surefoot gap diagnose` tells it.
///
/// Made by `surefoot.gap.diagnose`. In a notebook it shows itself as a page; `print` tells it in words.
#[pyclass(frozen, module = "surefoot.gap")]
pub struct GapReport {
    found: Found,
    case: Arc<Case>,
    heldout: Drives,
    verification: Option<Verification>,
    answer: Answer,
    manoeuvre: Option<Manoeuvre>,
    doubts: Vec<String>,
}

impl GapReport {
    fn told(&self) -> Told<'_> {
        Told {
            case: &self.case,
            heldout: &self.heldout,
            verification: self.verification.as_ref(),
            diagnosis: &self.found.1,
            answer: &self.answer,
            doubts: &self.doubts,
        }
    }

    fn page(&self) -> Result<(Vec<report::Picture>, String), String> {
        let told = self.told();
        let pictures = told.pictures().map_err(|error| error.to_string())?;
        let page = told.page(&pictures, &cli::summary::program());
        Ok((pictures, page))
    }

    fn written_to(&self, folder: &Path) -> Result<(), String> {
        let (pictures, page) = self.page()?;
        let problem = |error: formats::OutputError| error.to_string();
        formats::prepare_out_dir(folder, 0).map_err(problem)?;
        let bytes = |name: &str, bytes: &[u8]| {
            formats::write_bytes_atomic(&folder.join(name), bytes).map_err(problem)
        };
        for picture in &pictures {
            bytes(picture.file, &picture.png)?;
        }
        formats::write_json_atomic(&folder.join("answer.json"), &self.answer).map_err(problem)?;
        if let Some(csv) = self.told().predictions_csv() {
            bytes("predictions.csv", csv.as_bytes())?;
        }
        if let Some(manoeuvre) = &self.manoeuvre {
            let log = DriveLogFile { log: manoeuvre.commands_log(), ..DriveLogFile::default() };
            formats::write_drive_log_csv(&folder.join(MANOEUVRE), &log).map_err(problem)?;
        }
        bytes("report.html", page.as_bytes())
    }
}

#[pymethods]
impl GapReport {
    /// The whole answer as a dict: that of `answer.json`, whose layout has the version `schema_version`.
    #[getter]
    fn answer<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        json_dict(py, &serde_json::to_vec(&self.answer).map_err(refused_value)?)
    }

    /// The conclusion: "none", "effects", "effects_and_unknown" or "unknown".
    #[getter]
    fn verdict(&self, py: Python<'_>) -> PyResult<String> {
        self.answer(py)?.0.as_any().get_item("verdict")?.extract()
    }

    /// Ids of the announced effects, strongest first.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.answer.effects.iter().map(|effect| effect.id.as_str()).collect()
    }

    /// Best value and the ends of the 90 % interval of every parameter: {effect: {parameter: (value, low, high)}}, in the
    /// unit that the parameter's name ends in.
    #[getter]
    fn intervals<'py>(&self, py: Python<'py>) -> PyResult<Intervals<'py>> {
        let effects = PyDict::new(py);
        for effect in &self.answer.effects {
            let parameters = PyDict::new(py);
            for (name, estimate) in &effect.parameters {
                parameters.set_item(name, (estimate.value, estimate.low, estimate.high))?;
            }
            effects.set_item(&effect.id, parameters)?;
        }
        Ok(Intervals(effects))
    }

    /// What is doubtful about the drives, in sentences.
    #[getter]
    fn doubts(&self) -> Vec<&str> {
        self.doubts.iter().map(String::as_str).collect()
    }

    /// The page as HTML that needs nothing else, with its pictures.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || self.page())?.map(|(_, page)| page).map_err(refused_value)
    }

    /// Writes report.html, answer.json, the pictures, and where there are any predictions.csv and manoeuvre.csv into a
    /// folder, which is made if it is missing.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let written = detached(py, || self.written_to(&folder))?;
        written.map_err(pyo3::exceptions::PyOSError::new_err)
    }

    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        Ok(in_notebook(&self.html(py)?))
    }

    fn __str__(&self) -> String {
        self.told().text()
    }

    fn __repr__(&self) -> String {
        let names =
            self.answer.effects.iter().map(|effect| effect.id.as_str()).collect::<Vec<_>>().join(", ");
        format!("<surefoot.gap.GapReport of {}: {:?} [{names}]>", self.answer.case, self.answer.verdict)
    }
}

/// The drive that would tell apart what a diagnosis leaves open: a table with t [s], cmd_speed [m/s] and cmd_steer [rad],
/// 50 Hz, for level ground; `None` where no drive would help.
#[pyfunction]
#[pyo3(signature = (report) -> "pd.DataFrame | None")]
pub fn manoeuvre<'py>(py: Python<'py>, report: &GapReport) -> PyResult<Option<Bound<'py, PyAny>>> {
    let Some(manoeuvre) = &report.manoeuvre else { return Ok(None) };
    let columns =
        log_columns(py, &manoeuvre.commands_log(), |column: Column| column.name().starts_with("cmd_"))?;
    frame(py, columns).map(Some)
}

/// A controller's model with what a diagnosis measured for it: what was calibrated, and what was announced as it fits there.
///
/// diagnosis: a `GapReport`, its answer as a dict, or the path of an answer.json. model: a `Model` or a `Vehicle`. force:
/// whether to apply what is named where a part of the gap stays unknown, for which it may stand. Returns a `Model`; raises
/// `ValueError` for an answer that names no effect, or none that a model can hold.
#[pyfunction]
#[pyo3(signature = (diagnosis: "GapReport | dict[str, Any] | _Path", model: "Model | Vehicle", *, force=false))]
pub fn apply(diagnosis: &Bound<'_, PyAny>, model: &Bound<'_, PyAny>, force: bool) -> PyResult<Model> {
    let part_unknown = if force { PartUnknown::Applied } else { PartUnknown::Refused };
    let (model, _) = repaired(&believed(model)?, &answer(diagnosis)?, part_unknown)
        .map_err(|error| refused_value(format!("diagnosis: {error}")))?;
    Ok(Model(model))
}

fn believed(model: &Bound<'_, PyAny>) -> PyResult<bicycle::Model> {
    if let Ok(vehicle) = model.cast::<Vehicle>() {
        return Ok(bicycle::Model::of(&vehicle.get().0));
    }
    let model =
        model.cast::<Model>().map_err(|_| refused_type("model", "a Model or a Vehicle", kind(model)))?;
    Ok(model.get().0.clone())
}

fn answer(found: &Bound<'_, PyAny>) -> PyResult<Answer> {
    let py = found.py();
    if let Ok(report) = found.cast::<GapReport>() {
        return Ok(report.get().answer.clone());
    }
    let text = if found.is_instance_of::<PyDict>() {
        py.import("json")?.call_method1("dumps", (found,))?
    } else if found.extract::<PathBuf>().is_ok() {
        py.import("pathlib")?.getattr("Path")?.call1((found,))?.call_method0("read_text")?
    } else {
        let expected = "a GapReport, its answer as a dict, or the path of an answer.json";
        return Err(refused_type("diagnosis", expected, kind(found)));
    };
    let text = text.cast::<PyString>()?.to_cow()?.into_owned();
    serde_json::from_str(&text).map_err(|error| {
        refused_value(format!("diagnosis: expected the answer of gap diagnose, found: {error}"))
    })
}
