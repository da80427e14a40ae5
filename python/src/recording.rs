//! Recordings as tables, maps and clouds.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use bicycle::{Column, DriveLog};
use formats::{
    McapDriveLog, RecordedMessage, RecordingMessages, json_row, open_recording, read_drive_log_mcap,
    read_recorded_table, recorded_elevation, recorded_risk, recorded_scan,
};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use runtime::recorder::topic;
use runtime::replay::{Row, recorded_odometry, recorded_rows};
use terrain::Scan;
use traversability::Ground;

use crate::arrays::owned;
use crate::detached::{Interrupts, detached};
use crate::failure::{refused, refused_file, refused_value};
use crate::frames::{frame, recorded, words};
use crate::ground::Surface;
use crate::settings::json_dict;
use crate::typed::Fields;

const DRIVE_LOG: &str = "/drive_log";
const DECISION: &str = "/decision";
const CONTROLLER: &str = "/controller";

/// A recording of a drive, made by `surefoot drive` or `surefoot up`.
///
/// Made by `surefoot.open`. The file is read through once for what is in it, and again by every method, message by message,
/// so that no more of it is in memory than what is asked for. One that breaks off, because the recorder was killed or the
/// disk was full, gives what is whole; `ended_early` says where. Tables are `pandas.DataFrame`s where pandas is installed
/// (`pip install surefoot[frames]`), else dicts of arrays; `time_ns` is when a row was recorded, on the clock of the drive.
#[pyclass(frozen, module = "surefoot")]
pub struct Recording {
    path: PathBuf,
    topics: BTreeMap<String, Topic>,
    span_ns: Option<[u64; 2]>,
    setup: Option<Vec<u8>>,
    ended_early: Option<String>,
}

#[derive(Default)]
struct Topic {
    n_messages: u64,
    encoding: String,
}

/// Opens a recording (MCAP).
///
/// Raises `FileNotFoundError` and other `OSError`s, and `ValueError` where not one message can be read.
#[pyfunction(name = "open")]
pub fn open_python(py: Python<'_>, path: PathBuf) -> PyResult<Recording> {
    detached(py, || Recording::scanned(path))?
}

impl Recording {
    fn scanned(path: PathBuf) -> PyResult<Self> {
        let messages = open_recording(&path).map_err(|error| refused_file(&path, &error))?;
        let mut own = Self { path, topics: BTreeMap::new(), span_ns: None, setup: None, ended_early: None };
        let mut interrupts = Interrupts::default();
        own.ended_early = messages.take_all(|message| {
            interrupts.look()?;
            own.count(message);
            Ok(())
        });
        interrupts.raise()?;
        if own.topics.is_empty() {
            let found = own.ended_early.unwrap_or_else(|| "no message in it".to_owned());
            return Err(refused(&own.path.display().to_string(), "a recording in MCAP", found));
        }
        Ok(own)
    }

    fn count(&mut self, message: RecordedMessage) {
        let [first, last] = self.span_ns.unwrap_or([message.log_time_ns; 2]);
        self.span_ns = Some([first.min(message.log_time_ns), last.max(message.log_time_ns)]);
        let channel = &message.channel;
        let topic = self.topics.entry(channel.topic.clone()).or_default();
        topic.n_messages += 1;
        if topic.encoding.is_empty() {
            topic.encoding.clone_from(&channel.encoding);
        }
        if channel.topic == topic::SETUP {
            self.setup = Some(message.data);
        }
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn file(&self) -> String {
        self.path.display().to_string()
    }

    fn require(&self, name: &str) -> PyResult<&Topic> {
        self.topics.get(name).ok_or_else(|| {
            let names: Vec<&str> = self.topics.keys().map(String::as_str).collect();
            refused(&self.file(), format!("messages on topic {name}"), format!("only {}", names.join(", ")))
        })
    }

    /// The table of a topic, of whose messages `rows` makes rows.
    fn rows_of<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        mut rows: impl FnMut(&RecordedMessage) -> Result<Vec<Row>, String> + Send,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.require(name)?;
        let mut interrupts = Interrupts::default();
        let mut refusal = None;
        let table = detached(py, || {
            read_recorded_table(&self.path, name, |message| {
                interrupts.look()?;
                rows(message).inspect_err(|problem| refusal = Some(problem.clone()))
            })
        })?;
        interrupts.raise()?;
        if let Some(problem) = refusal {
            return Err(refused_value(format!("{}: a message on {name}: {problem}", self.file())));
        }
        let table = table.map_err(|error| refused_file(&self.path, &error))?;
        frame(py, recorded(py, table)?)
    }

    fn log(&self, py: Python<'_>) -> PyResult<McapDriveLog> {
        self.require(DRIVE_LOG)?;
        let read = detached(py, || read_drive_log_mcap(&self.path))?;
        read.map_err(refused_value)
    }

    /// Rows of the drive log, with those columns that are asked for.
    fn log_columns<'py>(
        &self,
        py: Python<'py>,
        is_asked: impl Fn(Column) -> bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let McapDriveLog { log, time_ns, .. } = self.log(py)?;
        let mut columns = vec![("time_ns".to_owned(), time_ns.into_pyarray(py).into_any())];
        columns.extend(log_columns(py, &log, is_asked)?);
        frame(py, columns)
    }

    fn messages(&self, name: &'static str, kind: Kind) -> PyResult<RecordedMessages> {
        self.require(name)?;
        let messages = open_recording(&self.path).map_err(|error| refused_file(&self.path, &error))?;
        Ok(RecordedMessages { kind, name, file: self.file(), messages: Mutex::new(messages) })
    }
}

/// The columns of a drive log: `t`, `run` where there are several, and those that are asked for.
pub fn log_columns<'py>(
    py: Python<'py>,
    log: &DriveLog,
    is_asked: impl Fn(Column) -> bool,
) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let time_s: Vec<f64> = log.runs().flat_map(|run| run.time_s().to_vec()).collect();
    let mut columns = vec![("t".to_owned(), time_s.into_pyarray(py).into_any())];
    let runs = log.runs().flat_map(|run| vec![run.name().to_owned(); run.time_s().len()]);
    if log.runs().any(|run| !run.name().is_empty()) {
        columns.push(("run".to_owned(), words(py, runs.collect())?));
    }
    for column in log.columns().filter(|column| is_asked(*column)) {
        let values: Vec<f64> =
            log.runs().flat_map(|run| run.column(column).unwrap_or_default().to_vec()).collect();
        columns.push((column.name().to_owned(), values.into_pyarray(py).into_any()));
    }
    Ok(columns)
}

fn is_command(column: Column) -> bool {
    column.name().starts_with("cmd_")
}

#[pymethods]
impl Recording {
    /// Number of messages of every topic.
    #[getter]
    fn topics(&self) -> BTreeMap<&str, u64> {
        self.topics.iter().map(|(name, topic)| (name.as_str(), topic.n_messages)).collect()
    }

    /// Where and why the recording breaks off; `None` of one that is whole.
    #[getter]
    fn ended_early(&self) -> Option<&str> {
        self.ended_early.as_deref()
    }

    /// Time between the first and the last message [s].
    #[getter]
    fn duration_s(&self) -> f64 {
        self.span_ns.map_or(0.0, |[first, last]| (last - first) as f64 * 1e-9)
    }

    /// What is needed to repeat the run, as a dict; `None` where it was not recorded.
    #[getter]
    fn setup<'py>(&self, py: Python<'py>) -> PyResult<Option<Fields<'py>>> {
        self.setup.as_ref().map(|text| json_dict(py, text)).transpose()
    }

    /// The drive log: `time_ns`, `t` [s], `run`, and what was measured and commanded, x, y, yaw, vx, wz, cmd_speed,
    /// cmd_steer and so on, in metres, radians and seconds; NaN where nothing was measured.
    ///
    /// Raises `ValueError` where the recording has none.
    #[pyo3(signature = () -> "pd.DataFrame")]
    fn drive_log<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.log_columns(py, |_| true)
    }

    /// Where the vehicle was and how it moved, under the names of the drive log: every message of the odometry where these
    /// were recorded (`surefoot up`), else the rows of the drive log.
    #[pyo3(signature = () -> "pd.DataFrame")]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if !self.topics.contains_key(topic::ODOMETRY) {
            return self.log_columns(py, |column| !is_command(column));
        }
        let mut began_ns = None;
        self.rows_of(py, topic::ODOMETRY, |message| recorded_odometry(&message.data, &mut began_ns))
    }

    /// What the vehicle was told: `time_ns`, `t`, and the columns of the drive log that begin with cmd_.
    #[pyo3(signature = () -> "pd.DataFrame")]
    fn commands<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.log_columns(py, is_command)
    }

    /// What was decided in each cycle: `decision` is drive, hold or stop, `reason` says why it is not drive.
    #[pyo3(signature = () -> "pd.DataFrame")]
    fn decisions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows_of(py, DECISION, |message| Ok(vec![json_row(message)?]))
    }

    /// Figures of the controller in each cycle, of recordings of `surefoot drive`.
    #[pyo3(signature = () -> "pd.DataFrame")]
    fn controller<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows_of(py, CONTROLLER, |message| Ok(vec![json_row(message)?]))
    }

    /// The messages of any topic of numbers: those in JSON, and those under /channel/, of which there is one row for each
    /// record (of scans and maps the headers). Names are those of the fields.
    ///
    /// Raises `ValueError` for a topic that is not there or holds something else.
    #[pyo3(signature = (topic) -> "pd.DataFrame")]
    fn table<'py>(&self, py: Python<'py>, topic: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.require(topic)?;
        if topic == DRIVE_LOG {
            return self.drive_log(py);
        }
        if topic.starts_with(topic::CHANNELS) {
            return self.rows_of(py, topic, |message| recorded_rows(topic, &message.data));
        }
        if found.encoding == "json" {
            return self.rows_of(py, topic, |message| Ok(vec![json_row(message)?]));
        }
        let expected = "a topic of numbers, in JSON or under /channel/";
        Err(refused(topic, expected, format!("messages in {}", found.encoding)))
    }

    /// The maps of the ground, one after the other: an iterator over pairs of `time_ns` and a `Surface`. The likeliest class
    /// of each cell is recorded, as if it were certain.
    fn elevation_maps(&self) -> PyResult<RecordedMessages> {
        self.messages("/elevation", Kind::Elevation)
    }

    /// The risk maps at the heading of the vehicle, one after the other: an iterator over pairs of `time_ns` and a dict with
    /// "risks", float32 (row, col, 4) as in a `RiskMap`, "terrain_class" and "flags", uint8 (row, col), "resolution_m" [m]
    /// and "origin", the lattice index (col, row) of the south-west cell.
    fn risk_maps(&self) -> PyResult<RecordedMessages> {
        self.messages("/risk", Kind::Risk)
    }

    /// The sweeps of the range sensor in the body frame, one after the other: an iterator over pairs of `time_ns` and a dict
    /// with "points", float32 (point, 3) [m], and "terrain_class", uint8 (point,).
    fn scans(&self) -> PyResult<RecordedMessages> {
        self.messages("/scan", Kind::Scan)
    }

    fn __repr__(&self) -> String {
        let end = if self.ended_early.is_some() { ", breaks off" } else { "" };
        let (file, n_topics) = (self.file(), self.topics.len());
        format!("<surefoot.Recording {file}: {:.1} s, {n_topics} topics{end}>", self.duration_s())
    }
}

/// What the messages of a topic are.
#[derive(Clone, Copy)]
enum Kind {
    Elevation,
    Risk,
    Scan,
}

/// An iterator over maps or sweeps of a recording: pairs of `time_ns` and what was recorded. It ends where the recording
/// breaks off.
#[pyclass(frozen, module = "surefoot")]
pub struct RecordedMessages {
    kind: Kind,
    name: &'static str,
    file: String,
    messages: Mutex<RecordingMessages>,
}

#[pymethods]
impl RecordedMessages {
    fn __iter__(own: Py<Self>) -> Py<Self> {
        own
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<(u64, Bound<'py, PyAny>)>> {
        let mut interrupts = Interrupts::default();
        let message = detached(py, || {
            let mut messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
            let is_meant = |found: &RecordedMessage| found.channel.topic == self.name;
            messages
                .by_ref()
                .map_while(Result::ok)
                .find(|found| interrupts.look().is_err() || is_meant(found))
        })?;
        interrupts.raise()?;
        let Some(message) = message else { return Ok(None) };
        let told =
            |problem: String| refused_value(format!("{}: a message on {}: {problem}", self.file, self.name));
        let content = match self.kind {
            Kind::Elevation => {
                Bound::new(py, Surface(recorded_elevation(&message).map_err(told)?))?.into_any()
            }
            Kind::Risk => risk_dict(py, recorded_risk(&message).map_err(told)?)?.into_any(),
            Kind::Scan => scan_dict(py, &recorded_scan(&message).map_err(told)?)?.into_any(),
        };
        Ok(Some((message.log_time_ns, content)))
    }
}

fn risk_dict(py: Python<'_>, risk: formats::RecordedRisk) -> PyResult<Bound<'_, PyDict>> {
    let terrain::GridGeometry { n_rows, n_cols, resolution_m, origin } = risk.geometry;
    let layer = |of: fn(&Ground) -> u8| owned(py, risk.ground.iter().map(of).collect(), [n_rows, n_cols]);
    let dict = PyDict::new(py);
    dict.set_item("risks", owned(py, risk.risks.as_flattened().to_vec(), [n_rows, n_cols, 4])?)?;
    dict.set_item("terrain_class", layer(|ground| ground.class)?)?;
    dict.set_item("flags", layer(|ground| ground.flags.0)?)?;
    dict.set_item("resolution_m", resolution_m)?;
    dict.set_item("origin", (origin[0], origin[1]))?;
    Ok(dict)
}

/// A sweep as arrays.
pub fn scan_dict<'py>(py: Python<'py>, scan: &Scan) -> PyResult<Bound<'py, PyDict>> {
    let positions_m: Vec<f32> = scan.points.iter().flat_map(|point| point.position_m).collect();
    let classes: Vec<u8> = scan.points.iter().map(|point| point.class as u8).collect();
    let dict = PyDict::new(py);
    dict.set_item("points", owned(py, positions_m, [scan.points.len(), 3])?)?;
    dict.set_item("terrain_class", classes.into_pyarray(py))?;
    Ok(dict)
}
