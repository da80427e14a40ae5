//! A run of processes that is under way: what it says, and orders to it.

use std::sync::Arc;

use bus::channel::{
    Bus, COMMAND, Channel, ChannelError, Element, Header, Inlet, MISSION, ODOMETRY, RISK, RISK_PHYSICS,
    RunName, SCAN, SURFACE,
};
use bus::clock;
use bus::message::{
    CommandRecord, MissionRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Stamp, SurfaceHeader,
};
use bus::payload;
use navigator::{Order, Route};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use runtime::operator;
use traversability::CvarLevel;

use crate::arrays::Reals;
use crate::failure::{refused, refused_value};
use crate::ground::Surface;
use crate::keeper::Keeper;
use crate::recording::scan_dict;
use crate::risk_map::{Copied, RiskMap};
use crate::typed::Fields;

/// Where an order leaves the tolerance to the run, its own is checked with any that would do.
const ANY_TOLERANCE_M: f64 = 1.0;

/// The bus of a process and what it listens to, each channel from when it was asked for first.
pub struct Ears {
    pub bus: Bus,
    odometry: Option<Inlet<Stamp, OdometryRecord>>,
    scans: Option<Inlet<ScanHeader, PointRecord>>,
    surfaces: Option<Inlet<SurfaceHeader, [f32; 8]>>,
    risks: [Option<Inlet<RiskHeader, [f32; 4]>>; 2],
    commands: Option<Inlet<Stamp, CommandRecord>>,
    missions: Option<Inlet<Stamp, MissionRecord>>,
}

impl Ears {
    /// A process that has heard nothing yet.
    pub fn new(bus: Bus) -> Self {
        Self {
            bus,
            odometry: None,
            scans: None,
            surfaces: None,
            risks: [None, None],
            commands: None,
            missions: None,
        }
    }

    /// The newest record that came since the last look, with the time when it was true [ns].
    fn newest<T: Element + Copy>(
        bus: &Bus,
        channel: &Channel<Stamp, T>,
        inlet: &mut Option<Inlet<Stamp, T>>,
    ) -> Result<Option<(u64, T)>, ChannelError> {
        let mut newest = None;
        opened(bus, channel, inlet)?.poll(|stamp, records| {
            newest = records.first().map(|record| (stamp.valid_at_ns, *record)).or(newest);
        });
        Ok(newest)
    }
}

fn opened<'a, H: Header, T: Element>(
    bus: &Bus,
    channel: &Channel<H, T>,
    inlet: &'a mut Option<Inlet<H, T>>,
) -> Result<&'a mut Inlet<H, T>, ChannelError> {
    let open = match inlet.take() {
        Some(open) => open,
        None => bus.inlet(channel)?,
    };
    Ok(inlet.insert(open))
}

/// A run of `surefoot up` that is under way, to be listened to and directed; any number of processes may.
///
/// Made by `surefoot.attach`. What reads gives the newest message that came since the last call, as a pair of when it was
/// true on the machine's monotonic clock (`time.monotonic_ns()`) and what it says, or `None`; the first call begins to
/// listen. Messages of another layout, out of order, from the future or with numbers that cannot be are not given, as
/// nowhere in Surefoot. Orders return what the vehicle is told to do from then on, as a dict, and raise `RuntimeError` with
/// the reason where they are refused or nobody answers within five seconds.
#[pyclass(frozen, module = "surefoot")]
pub struct Run {
    name: String,
    ears: Arc<Keeper<Ears>>,
}

/// A run that is under way.
///
/// run: its name; without one there must be a single run. Raises `ValueError` for a name that none can have, `RuntimeError`
/// where there is no such run.
#[pyfunction]
#[pyo3(signature = (run=None))]
pub fn attach(py: Python<'_>, run: Option<&str>) -> PyResult<Run> {
    let name = chosen(run)?;
    let own = name.clone();
    let ears = Keeper::start(py, "attach", move || Bus::visit(&own).map(Ears::new), refused_channel)?;
    Ok(Run { name: name.to_string(), ears: Arc::new(ears) })
}

/// A name of a run.
///
/// # Errors
/// `ValueError` for a word that names none.
pub fn run_name(word: &str) -> PyResult<RunName> {
    word.parse().map_err(|error| refused_value(format!("run: {error}")))
}

fn chosen(word: Option<&str>) -> PyResult<RunName> {
    let alive = RunName::alive().map_err(refused_channel)?;
    let told = |expected: &str| {
        let names = alive.iter().map(RunName::to_string).collect::<Vec<_>>().join(", ");
        let found = if names.is_empty() { "none".to_owned() } else { names };
        PyRuntimeError::new_err(format!("run: expected {expected}, found {found}"))
    };
    match (word, &alive[..]) {
        (Some(word), _) => {
            let name = run_name(word)?;
            if alive.contains(&name) { Ok(name) } else { Err(told(&format!("run {name} to be there"))) }
        }
        (None, [only]) => Ok(only.clone()),
        (None, _) => Err(told("its name where there is not one run alone")),
    }
}

/// A channel that cannot be used.
pub fn refused_channel(error: ChannelError) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

impl Run {
    /// Another way to the processes of a run.
    pub fn over(name: &RunName, ears: Arc<Keeper<Ears>>) -> Self {
        Self { name: name.to_string(), ears }
    }

    /// What a look gives; of a channel that no process of the run has opened yet, nothing.
    fn heard<R: Send + 'static>(
        &self,
        py: Python<'_>,
        look: impl FnOnce(&mut Ears) -> Result<Option<R>, ChannelError> + Send + 'static,
    ) -> PyResult<Option<R>> {
        match self.ears.ask(py, look)? {
            Err(ChannelError::Absent { .. }) => Ok(None),
            found => found.map_err(refused_channel),
        }
    }

    fn tell<'py>(&self, py: Python<'py>, order: Order) -> PyResult<Fields<'py>> {
        let answered = self.ears.ask(py, move |ears| operator::tell(&ears.bus, &order))?;
        let record =
            answered.map_err(|error| PyRuntimeError::new_err(format!("run {}: {error}", self.name)))?;
        mission_dict(py, &record)
    }

    fn drive<'py>(&self, py: Python<'py>, route: Route, tolerance_m: Option<f64>) -> PyResult<Fields<'py>> {
        let route = if tolerance_m.is_some() { route } else { route.without_tolerance() };
        self.tell(py, Order::Drive(route))
    }
}

#[pymethods]
impl Run {
    /// Name of the run.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Where the vehicle is: a dict with "position_m" (x, y, z), "attitude_rad" (roll, pitch, yaw), "velocity_mps" (forward,
    /// leftward), "yaw_rate_radps", "wheel_speed_mps", "steering_rad", and what the actuators were told last,
    /// "applied_speed_mps", "applied_steering_rad".
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Option<(u64, Fields<'py>)>> {
        let found = self.heard(py, |ears| Ears::newest(&ears.bus, &ODOMETRY, &mut ears.odometry))?;
        found.map(|(at_ns, record)| Ok((at_ns, odometry_dict(py, &record)?))).transpose()
    }

    /// A sweep of the range sensor: a dict with "points", float32 (point, 3) [m], "terrain_class", uint8 (point,), and
    /// "sensor", whose frame the points are of: 0 the vehicle's body, else the sensor of this number.
    fn scan<'py>(&self, py: Python<'py>) -> PyResult<Option<(u64, Fields<'py>)>> {
        let found = self.heard(py, |ears| {
            let mut newest = None;
            opened(&ears.bus, &SCAN, &mut ears.scans)?.poll(|header, points| {
                newest = Some((header.stamp.valid_at_ns, header.sensor, header.sensor_scan(points)));
            });
            Ok(newest)
        })?;
        let told = |(at_ns, sensor, scan): (u64, u32, terrain::Scan)| -> PyResult<_> {
            let dict = scan_dict(py, &scan)?;
            dict.set_item("sensor", sensor)?;
            Ok((at_ns, Fields(dict)))
        };
        found.map(told).transpose()
    }

    /// The map of the ground, a `Surface`.
    fn elevation_map(&self, py: Python<'_>) -> PyResult<Option<(u64, Surface)>> {
        let found = self.heard(py, |ears| {
            let newest = opened(&ears.bus, &SURFACE, &mut ears.surfaces)?.newest();
            Ok(newest.and_then(|message| {
                let map = payload::surface_map(message.header(), message.payload())?;
                Some((message.header().stamp.valid_at_ns, map))
            }))
        })?;
        Ok(found.map(|(at_ns, map)| (at_ns, Surface(map))))
    }

    /// The risk map, a `RiskMap`, and the same by way of a copy: that of what was learned, or where learning says nothing, of
    /// physics alone.
    fn risk_map(&self, py: Python<'_>) -> PyResult<Option<(u64, RiskMap)>> {
        let found = self.heard(py, |ears| {
            for (channel, inlet) in [&RISK, &RISK_PHYSICS].into_iter().zip(&mut ears.risks) {
                let newest = opened(&ears.bus, channel, inlet)?.newest();
                let copied = newest.and_then(|message| {
                    let (map, _) = payload::risk_views(message.header(), message.payload())?;
                    Some((message.header().stamp.valid_at_ns, Copied::of(&map)))
                });
                if copied.is_some() {
                    return Ok(copied);
                }
            }
            Ok(None)
        })?;
        let told = |(at_ns, map): (u64, Copied)| -> PyResult<_> { Ok((at_ns, map.into_python(py)?)) };
        found.map(told).transpose()
    }

    /// What the vehicle shall do: a dict with "decision" (drive, hold or stop), "speed_mps" and "steering_rad", which count
    /// only when driving, and "odometry_at_ns" and "scan_at_ns", of when that was which it was decided on.
    fn command<'py>(&self, py: Python<'py>) -> PyResult<Option<(u64, Fields<'py>)>> {
        let found = self.heard(py, |ears| Ears::newest(&ears.bus, &COMMAND, &mut ears.commands))?;
        let told = |(at_ns, record): (u64, CommandRecord)| -> PyResult<_> {
            let decision = match record.decision() {
                Some(bicycle::Decision::Drive(_)) => "drive",
                Some(bicycle::Decision::Hold(_)) => "hold",
                Some(bicycle::Decision::Stop(_)) | None => "stop",
            };
            let dict = PyDict::new(py);
            dict.set_item("decision", decision)?;
            dict.set_item("speed_mps", record.speed_mps)?;
            dict.set_item("steering_rad", record.steering_rad)?;
            dict.set_item("odometry_at_ns", record.odometry_at_ns)?;
            dict.set_item("scan_at_ns", record.scan_at_ns)?;
            Ok((at_ns, Fields(dict)))
        };
        found.map(told).transpose()
    }

    /// What the vehicle is told to do: a dict with "goal_m", "tolerance_m", "state" (0 drive, 1 no mission, 2 paused, 3
    /// manual, 4 emergency stop), "outcome" (0 under way, 1 goal reached, see docs/runtime.md), "time_s", "leg", "n_legs",
    /// "alpha" and "told", all that in words.
    fn mission<'py>(&self, py: Python<'py>) -> PyResult<Option<(u64, Fields<'py>)>> {
        let found = self.heard(py, |ears| Ears::newest(&ears.bus, &MISSION, &mut ears.missions))?;
        found.map(|(at_ns, record)| Ok((at_ns, mission_dict(py, &record)?))).transpose()
    }

    /// Drive to these places, one after the other: goals is a list of (x, y) in the map frame [m]. tolerance_m: how near
    /// counts as there; without it as the run was started.
    #[pyo3(signature = (goals: "Sequence[tuple[float, float]]", *, tolerance_m=None))]
    fn goal<'py>(
        &self,
        py: Python<'py>,
        goals: Vec<Reals<f64, 2>>,
        tolerance_m: Option<f64>,
    ) -> PyResult<Fields<'py>> {
        let goals = goals.into_iter().map(|Reals(goal_m)| goal_m).collect();
        let route = Route::goals(goals, tolerance_m.unwrap_or(ANY_TOLERANCE_M)).map_err(refused_value)?;
        self.drive(py, route, tolerance_m)
    }

    /// Drive along these corners [m] at a speed [m/s].
    #[pyo3(signature = (corners: "Sequence[tuple[float, float]]", speed_mps, *, tolerance_m=None))]
    fn path<'py>(
        &self,
        py: Python<'py>,
        corners: Vec<Reals<f64, 2>>,
        speed_mps: f64,
        tolerance_m: Option<f64>,
    ) -> PyResult<Fields<'py>> {
        let corners = corners.into_iter().map(|Reals(corner_m)| corner_m).collect();
        let route = Route::path(corners, speed_mps, tolerance_m.unwrap_or(ANY_TOLERANCE_M));
        self.drive(py, route.map_err(refused_value)?, tolerance_m)
    }

    /// Stand until told to go on.
    fn pause<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        self.tell(py, Order::Pause)
    }

    /// Go on; also when an operator gives the wheel back.
    fn resume<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        self.tell(py, Order::Resume)
    }

    /// Stand; the mission is over.
    fn cancel<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        self.tell(py, Order::Cancel)
    }

    /// An operator takes the wheel.
    fn manual<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        self.tell(py, Order::TakeOver)
    }

    /// Stop, until reset.
    fn estop<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        self.tell(py, Order::EmergencyStop)
    }

    /// The emergency is over; what was under way is paused.
    fn reset<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        self.tell(py, Order::Reset)
    }

    /// Plan for this share of the worst outcomes, in (0, 1].
    fn alpha<'py>(&self, py: Python<'py>, level: f64) -> PyResult<Fields<'py>> {
        let level = CvarLevel::new(level).map_err(|error| refused_value(format!("level: {error}")))?;
        self.tell(py, Order::Tolerate(level))
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.Run {}>", self.name)
    }
}

/// Where a vehicle is, as Python is told.
pub fn odometry_dict<'py>(py: Python<'py>, record: &OdometryRecord) -> PyResult<Fields<'py>> {
    let dict = PyDict::new(py);
    dict.set_item("position_m", record.position_m.to_vec())?;
    dict.set_item("attitude_rad", record.attitude_rad.to_vec())?;
    dict.set_item("velocity_mps", record.velocity_mps.to_vec())?;
    dict.set_item("yaw_rate_radps", record.yaw_rate_radps)?;
    dict.set_item("wheel_speed_mps", record.wheel_speed_mps)?;
    dict.set_item("steering_rad", record.steering_rad)?;
    dict.set_item("applied_speed_mps", record.applied_speed_mps)?;
    dict.set_item("applied_steering_rad", record.applied_steering_rad)?;
    Ok(Fields(dict))
}

fn mission_dict<'py>(py: Python<'py>, record: &MissionRecord) -> PyResult<Fields<'py>> {
    let dict = PyDict::new(py);
    dict.set_item("goal_m", (record.goal_m[0], record.goal_m[1]))?;
    dict.set_item("tolerance_m", record.tolerance_m)?;
    dict.set_item("state", record.state)?;
    dict.set_item("outcome", record.outcome)?;
    dict.set_item("time_s", record.time_s)?;
    dict.set_item("leg", record.leg)?;
    dict.set_item("n_legs", record.n_legs)?;
    dict.set_item("alpha", record.alpha)?;
    dict.set_item("told", record.to_string())?;
    Ok(Fields(dict))
}

/// The time now on the clock of all processes [ns]: that of `time.monotonic_ns()`.
pub fn now_ns() -> u64 {
    clock::now_ns()
}

/// Refuses a time that a message may not have.
pub fn require_time(argument: &str, at_ns: u64) -> PyResult<()> {
    if at_ns <= now_ns() {
        Ok(())
    } else {
        Err(refused(argument, "a time of the monotonic clock that has passed", at_ns))
    }
}
