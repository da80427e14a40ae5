//! A planner of the user's own among the processes of a run.

use std::sync::Arc;

use bicycle::{Command, Decision, Odometry};
use bus::channel::{Bus, COMMAND, ChannelError, IMU, Inlet, MISSION, ODOMETRY, Outlet, SCAN};
use bus::clock::{self, SECOND_NS};
use bus::message::{CommandRecord, ImuRecord, MissionRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};
use navigator::{Config, NavigatorError, Surveyor};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use terrain::Scan;

use crate::arrays::owned;
use crate::failure::refused;
use crate::ground::Surface;
use crate::keeper::Keeper;
use crate::recording::scan_dict;
use crate::running::{odometry_dict, refused_channel, run_name};
use crate::typed::Fields;
use crate::vehicle::Vehicle;

/// The variable that names the run to a planner that was started for it.
const RUN: &str = "SUREFOOT_RUN";
/// Time between two looks at the channels [ns].
const LOOK_NS: u64 = SECOND_NS / 10_000;
/// Time after which a wait is broken off for a moment, so that Ctrl-C is heard [ns].
const TURN_NS: u64 = SECOND_NS / 10;
/// Turns between two looks whether anybody else is in the run.
const TURNS_ALONE: u64 = 10;

/// Why a planner hears nothing any more.
#[derive(Debug, thiserror::Error)]
enum SeatError {
    #[error(transparent)]
    Channel(#[from] ChannelError),
    #[error(transparent)]
    Navigator(#[from] NavigatorError),
    /// It was asked to command before there was anything to decide on.
    #[error("command: expected a cycle before it, found none")]
    Nothing,
}

/// What one cycle says.
struct Heard {
    at_ns: u64,
    odometry: OdometryRecord,
    imu: Vec<ImuRecord>,
    scan: Option<Arc<Scan>>,
    mission: MissionRecord,
    is_new_drive: bool,
}

/// The planner's ways into and out of its channels, and the ground as its scans showed it.
struct Seat {
    odometry: Inlet<Stamp, OdometryRecord>,
    imu: Inlet<Stamp, ImuRecord>,
    scans: Inlet<ScanHeader, PointRecord>,
    missions: Inlet<Stamp, MissionRecord>,
    commands: Outlet<Stamp, CommandRecord>,
    vehicle: bicycle::Vehicle,
    surveyor: Surveyor,
    mission: Option<MissionRecord>,
    n_drives: u64,
    odometry_at_ns: Option<u64>,
    scan_at_ns: u64,
    n_turns: u64,
    had_company: bool,
    bus: Bus,
}

impl Seat {
    fn take(run: &bus::channel::RunName, vehicle: bicycle::Vehicle) -> Result<Self, SeatError> {
        let bus = Bus::join(run)?;
        Ok(Self {
            odometry: bus.inlet(&ODOMETRY)?,
            imu: bus.inlet(&IMU)?,
            scans: bus.inlet(&SCAN)?,
            missions: bus.inlet(&MISSION)?,
            // Last: whoever waits for a planner sees it here, and what is said from then on is heard.
            commands: bus.outlet(&COMMAND, 1)?,
            surveyor: surveyor(&vehicle)?,
            vehicle,
            mission: None,
            n_drives: 0,
            odometry_at_ns: None,
            scan_at_ns: 0,
            n_turns: 0,
            had_company: false,
            bus,
        })
    }

    /// What the next cycle says, if one comes within a turn.
    fn wait(&mut self) -> Result<Option<Heard>, SeatError> {
        let until_ns = clock::now_ns() + TURN_NS;
        loop {
            let heard = self.look()?;
            if heard.is_some() || clock::now_ns() > until_ns {
                return Ok(heard);
            }
            clock::sleep_until(clock::now_ns() + LOOK_NS);
        }
    }

    /// The odometry is the last that a cycle says: the rest has come by then.
    fn look(&mut self) -> Result<Option<Heard>, SeatError> {
        let mut newest = None;
        self.odometry.poll(|stamp, records| {
            newest = records.first().map(|record| (stamp.valid_at_ns, *record)).or(newest);
        });
        let Some((at_ns, odometry)) = newest else { return Ok(None) };
        let (mut imu, mut scan) = (Vec::new(), None);
        self.imu.poll(|_, samples| imu.extend_from_slice(samples));
        self.scans.poll(|header, points| scan = header.scan(points, &[]).map(Arc::new).or(scan.take()));
        let mission = &mut self.mission;
        self.missions.poll(|_, records| *mission = records.first().copied().or(*mission));
        let Some(mission) = self.mission.filter(MissionRecord::is_driving) else { return Ok(None) };
        let is_new_drive = mission.number != self.n_drives;
        if is_new_drive {
            (self.n_drives, self.scan_at_ns) = (mission.number, 0);
            self.surveyor = surveyor(&self.vehicle)?;
        }
        self.fuse(&odometry.odometry(at_ns), scan.as_deref())?;
        self.odometry_at_ns = Some(at_ns);
        Ok(Some(Heard { at_ns, odometry, imu, scan, mission, is_new_drive }))
    }

    fn fuse(&mut self, odometry: &Odometry, scan: Option<&Scan>) -> Result<(), NavigatorError> {
        // What cannot be believed is for the guard of a vehicle; the map goes on without it.
        if let Ok(Some(jump)) = self.surveyor.admit(odometry) {
            self.surveyor.follow_jump(odometry, &jump)?;
        }
        if let Some(scan) = scan {
            self.surveyor.fuse(odometry, scan)?;
            self.scan_at_ns = scan.valid_at_ns;
        }
        Ok(())
    }

    fn command(&mut self, command: Command) -> Result<(), SeatError> {
        let at_ns = self.odometry_at_ns.ok_or(SeatError::Nothing)?;
        let record = CommandRecord::from(&Decision::Drive(command)).decided_on(at_ns, self.scan_at_ns);
        Ok(self.commands.send_one(Stamp::default(), record, at_ns).map(drop)?)
    }

    /// Whether everybody else has left the run: a planner does not outlive who started it.
    fn is_left_alone(&mut self) -> bool {
        self.n_turns += 1;
        if !self.n_turns.is_multiple_of(TURNS_ALONE) {
            return false;
        }
        let has_company = self.bus.has_company();
        self.had_company |= has_company;
        self.had_company && !has_company
    }
}

fn surveyor(vehicle: &bicycle::Vehicle) -> Result<Surveyor, NavigatorError> {
    let config = Config::for_vehicle(vehicle);
    Surveyor::new(&vehicle.geometry, config.elevation, config.guard, navigator::Surface::Sensed)
}

/// A planner's place in a run: it hears a vehicle cycle by cycle and commands it.
///
/// Pilot(vehicle, run=None): joins the processes of that name, without one those that `SUREFOOT_RUN` names, as it does where
/// `surefoot bench navigation --planner` has started the planner. Iterating over it gives a `Cycle` whenever the vehicle has
/// measured while its mission says to drive, and ends when everybody else has left the run. A drive in lock-step goes on
/// with `command`. Raises `RuntimeError` while another process commands the vehicle.
#[pyclass(frozen, module = "surefoot")]
pub struct Pilot {
    run: String,
    seat: Keeper<Seat>,
}

/// The run that whoever started the program names, by Python's own view of its variables.
fn named(py: Python<'_>) -> PyResult<Option<String>> {
    py.import("os")?.getattr("environ")?.call_method1("get", (RUN,))?.extract()
}

#[pymethods]
impl Pilot {
    #[new]
    #[pyo3(signature = (vehicle, run=None))]
    fn new(py: Python<'_>, vehicle: &Vehicle, run: Option<&str>) -> PyResult<Self> {
        let name = match (run, named(py)?) {
            (Some(run), _) => run_name(run)?,
            (None, Some(run)) => run_name(&run)?,
            (None, None) => return Err(refused("run", format!("a name, here or in {RUN}"), "none")),
        };
        let (own, vehicle) = (name.clone(), vehicle.0.clone());
        let seat = Keeper::start(py, "pilot", move || Seat::take(&own, vehicle), told)?;
        Ok(Self { run: name.to_string(), seat })
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Cycle>> {
        loop {
            if let Some(heard) = self.seat.ask(py, Seat::wait)?.map_err(told)? {
                return Ok(Some(Cycle(heard)));
            }
            if self.seat.ask(py, Seat::is_left_alone)? {
                return Ok(None);
            }
        }
    }

    /// Commands a speed [m/s], negative in reverse, and an angle of the front wheels [rad], left positive, decided on the
    /// last cycle. A benchmark goes on by the first command of a cycle. Raises `ValueError` for what is no number.
    fn command(&self, py: Python<'_>, speed_mps: f32, steering_rad: f32) -> PyResult<()> {
        if !(speed_mps.is_finite() && steering_rad.is_finite()) {
            return Err(refused("command", "finite numbers", format!("{speed_mps}, {steering_rad}")));
        }
        let command = Command { speed_mps, steering_rad };
        self.seat.ask(py, move |seat| seat.command(command))?.map_err(told)
    }

    /// The ground as the scans of this drive have shown it, fused as `surefoot drive` does it: a copy.
    fn surface(&self, py: Python<'_>) -> PyResult<Surface> {
        self.seat.ask(py, |seat| Surface(seat.surveyor.surface().clone()))
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.Pilot of {}>", self.run)
    }
}

/// What a vehicle says in one cycle, and where it is to go.
#[pyclass(frozen, module = "surefoot")]
pub struct Cycle(Heard);

#[pymethods]
impl Cycle {
    /// Whether a drive begins with this cycle, the first one too: what was learned of the ground before is of another place.
    #[getter]
    fn is_new_drive(&self) -> bool {
        self.0.is_new_drive
    }

    /// Simulated time of the drive [s].
    #[getter]
    fn time_s(&self) -> f64 {
        self.0.mission.time_s
    }

    /// Where to go, x and y in the map frame [m].
    #[getter]
    fn goal_m(&self) -> (f64, f64) {
        self.0.mission.goal_m.into()
    }

    /// How near to the goal counts as there [m].
    #[getter]
    fn tolerance_m(&self) -> f64 {
        self.0.mission.tolerance_m
    }

    /// The measured state as `Mppi.decide` takes it: x_m, y_m, yaw_rad, speed_mps, steering_rad.
    #[getter]
    fn state(&self) -> (f64, f64, f64, f64, f64) {
        let state = self.0.odometry.odometry(self.0.at_ns).state();
        (state.x_m, state.y_m, state.yaw_rad, state.speed_mps, state.steering_rad)
    }

    /// All that is measured of the motion: a dict as `Run.odometry` gives it.
    #[getter]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        odometry_dict(py, &self.0.odometry)
    }

    /// A sweep of the range sensor, where one was finished: a dict with "points", float32 (point, 3) [m] in the body frame,
    /// and "terrain_class", uint8 (point,).
    #[getter]
    fn scan<'py>(&self, py: Python<'py>) -> PyResult<Option<Fields<'py>>> {
        self.0.scan.as_deref().map(|scan| Ok(Fields(scan_dict(py, scan)?))).transpose()
    }

    /// What the inertial unit felt since the last cycle: a dict with "acceleration_mps2" and "angular_rate_radps", float32
    /// (sample, 3) in the body frame.
    #[getter]
    fn imu<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        let triples = |of: fn(&ImuRecord) -> [f32; 3]| {
            let values: Vec<f32> = self.0.imu.iter().flat_map(of).collect();
            owned(py, values, [self.0.imu.len(), 3])
        };
        let dict = PyDict::new(py);
        dict.set_item("acceleration_mps2", triples(|sample| sample.acceleration_mps2)?)?;
        dict.set_item("angular_rate_radps", triples(|sample| sample.angular_rate_radps)?)?;
        Ok(Fields(dict))
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.Cycle at {:.1} s>", self.0.mission.time_s)
    }
}

fn told(error: SeatError) -> PyErr {
    match error {
        SeatError::Channel(error) => refused_channel(error),
        error => PyRuntimeError::new_err(error.to_string()),
    }
}
