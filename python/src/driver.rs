//! A vehicle of the user's own among the processes of a run.

use std::sync::Arc;

use bicycle::{AppliedBy, Decision};
use bus::ages::Periods;
use bus::channel::{Bus, COMMAND, ChannelError, IMU, Inlet, MISSION, ODOMETRY, Outlet, SCAN};
use bus::clock;
use bus::message::{CommandRecord, ImuRecord, MissionRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};
use bus::watchdog::Watchdog;
use navigator::GuardConfig;
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix1, Ix2};
use pyo3::prelude::*;
use runtime::ages::{self, AskedAges};
use terrain::TerrainClass;

use crate::arrays::{Reals, array, numbers, require_shape, values};
use crate::failure::{refused, refused_value};
use crate::keeper::Keeper;
use crate::running::{Ears, Run, now_ns, refused_channel, require_time, run_name};
use crate::vehicle::Vehicle;

/// Points of a sweep at the most, and samples of the inertial unit in a message, unless somebody asks for other numbers.
const POINTS_MAX: usize = 1 << 15;
const SAMPLES_MAX: usize = 64;

/// The vehicle's ways into its channels.
struct Voice {
    odometry: Outlet<Stamp, OdometryRecord>,
    imu: Outlet<Stamp, ImuRecord>,
    scans: Outlet<ScanHeader, PointRecord>,
    missions: Option<Outlet<Stamp, MissionRecord>>,
    own_commands: Option<Outlet<Stamp, CommandRecord>>,
    commands: Inlet<Stamp, CommandRecord>,
    watchdog: Watchdog,
    n_commands: u64,
    bus: Bus,
}

/// The driver of a vehicle: tells a run where the vehicle is and what it sees, and says what its actuators are to do.
///
/// Driver(run, vehicle): joins the processes of that name, in whatever order they start, as the one that has the vehicle. A
/// channel has one publisher: `RuntimeError` while another process has it. command_age_s: how old the odometry of a command
/// may be that is followed, as the run was started with [s]. The last word before the actuators is Surefoot's own watchdog:
/// what `carry_out` says is to be done, at once. Times are of `time.monotonic_ns()`.
#[pyclass(frozen, module = "surefoot")]
pub struct Driver {
    run: Py<Run>,
    voice: Keeper<Voice>,
}

impl Voice {
    fn join(run: &bus::channel::RunName, watchdog: Watchdog) -> Result<Self, ChannelError> {
        let bus = Bus::join(run)?;
        Ok(Self {
            odometry: bus.outlet(&ODOMETRY, 1)?,
            imu: bus.outlet(&IMU, SAMPLES_MAX)?,
            scans: bus.outlet(&SCAN, POINTS_MAX)?,
            missions: None,
            own_commands: None,
            commands: bus.inlet(&COMMAND)?,
            watchdog,
            n_commands: 0,
            bus,
        })
    }

    fn carry_out(&mut self) -> (f32, f32, &'static str) {
        let Self { commands, watchdog, n_commands, .. } = self;
        commands.poll(|stamp, records| {
            for record in records {
                watchdog.admit(record, stamp.published_at_ns);
                *n_commands += 1;
            }
        });
        let decision = match watchdog.carry_out(clock::now_ns()) {
            Decision::Drive(_) => "drive",
            Decision::Hold(_) => "hold",
            Decision::Stop(_) => "stop",
        };
        let command = watchdog.applied().command;
        (command.speed_mps, command.steering_rad, decision)
    }
}

#[pymethods]
impl Driver {
    #[new]
    #[pyo3(signature = (run, vehicle, *, command_age_s=None))]
    fn new(py: Python<'_>, run: &str, vehicle: &Vehicle, command_age_s: Option<f64>) -> PyResult<Self> {
        let name = run_name(run)?;
        if let Some(age_s) = command_age_s.filter(|age_s| !(age_s.is_finite() && *age_s > 0.0)) {
            return Err(refused("command_age_s", "a finite number > 0", age_s));
        }
        let asked = AskedAges::of_command(command_age_s);
        let limits = ages::limits(&Periods::default(), &GuardConfig::default(), &asked);
        let watchdog = Watchdog::new(vehicle.0.limits, limits.map_err(refused_value)?);
        let own = name.clone();
        let voice = Keeper::start(py, "driver", move || Voice::join(&own, watchdog), refused_channel)?;
        let own = name.clone();
        let ears = Keeper::start(py, "driver", move || Bus::join(&own).map(Ears::new), refused_channel)?;
        Ok(Self { run: Py::new(py, Run::over(&name, Arc::new(ears)))?, voice })
    }

    /// The same run, to be listened to.
    #[getter]
    fn run(&self, py: Python<'_>) -> Py<Run> {
        self.run.clone_ref(py)
    }

    /// Commands that have come so far.
    #[getter]
    fn n_commands(&self, py: Python<'_>) -> PyResult<u64> {
        self.voice.ask(py, |voice| voice.n_commands)
    }

    /// What the actuators are to do now: speed [m/s], steering angle [rad], and "drive", "hold" or "stop". A command counts
    /// as long as what it was decided on; then the vehicle stops, with its wheels as they are. To be asked every cycle.
    fn carry_out(&self, py: Python<'_>) -> PyResult<(f32, f32, &'static str)> {
        self.voice.ask(py, Voice::carry_out)
    }

    /// Tells where the vehicle is, and what its actuators were told last by `carry_out`.
    ///
    /// position_m: rear axle's centre in the map frame, x, y, z. attitude_rad: roll, pitch, yaw. velocity_mps: forward and
    /// leftward, in the body frame. valid_at_ns: when that was; now, if not given. applied: what another than `carry_out` told
    /// the actuators, speed [m/s] and steering angle [rad].
    #[pyo3(signature = (
        position_m: "_Floats",
        attitude_rad: "_Floats",
        velocity_mps: "_Floats",
        yaw_rate_radps,
        *,
        wheel_speed_mps=None,
        steering_rad=0.0,
        valid_at_ns=None,
        applied: "tuple[float, float] | None" = None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn publish_odometry(
        &self,
        py: Python<'_>,
        position_m: &Bound<'_, PyAny>,
        attitude_rad: &Bound<'_, PyAny>,
        velocity_mps: &Bound<'_, PyAny>,
        yaw_rate_radps: f64,
        wheel_speed_mps: Option<f64>,
        steering_rad: f64,
        valid_at_ns: Option<u64>,
        applied: Option<Reals<f32, 2>>,
    ) -> PyResult<()> {
        let velocity_mps = numbers("velocity_mps", velocity_mps, ["forward", "leftward"])?;
        let record = OdometryRecord {
            position_m: numbers("position_m", position_m, ["x", "y", "z"])?,
            attitude_rad: numbers("attitude_rad", attitude_rad, ["roll", "pitch", "yaw"])?,
            velocity_mps,
            yaw_rate_radps,
            wheel_speed_mps: wheel_speed_mps.unwrap_or(velocity_mps[0]),
            steering_rad,
            ..OdometryRecord::default()
        };
        let at_ns = valid_at_ns.unwrap_or_else(now_ns);
        require_time("valid_at_ns", at_ns)?;
        if !record.odometry(at_ns).is_finite() {
            return Err(refused("odometry", "finite numbers", format!("{record:?}")));
        }
        require_sound((ODOMETRY.check)(&of_time(at_ns), &[record]), "odometry")?;
        let sent = self.voice.ask(py, move |voice| {
            let mut told = *voice.watchdog.applied();
            if let Some(Reals([speed_mps, steering_rad])) = applied {
                told.command = bicycle::Command { speed_mps, steering_rad };
                (told.since_ns, told.by) = (at_ns, AppliedBy::Vehicle);
            }
            voice.odometry.send_one(Stamp::default(), record.with_applied(&told), at_ns).map(drop)
        })?;
        sent.map_err(refused_channel)
    }

    /// Tells what the inertial unit felt since the last message.
    ///
    /// times_ns: uint64 (sample,). acceleration_mps2, angular_rate_radps: float32 (sample, 3), body frame; (0, 0, +9.81) at
    /// rest on level ground.
    #[pyo3(signature = (
        times_ns: "NDArray[np.uint64]",
        acceleration_mps2: "_Float32",
        angular_rate_radps: "_Float32",
    ))]
    fn publish_imu(
        &self,
        py: Python<'_>,
        times_ns: &Bound<'_, PyAny>,
        acceleration_mps2: &Bound<'_, PyAny>,
        angular_rate_radps: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let times = array::<u64, Ix1>("times_ns", times_ns, "sample")?;
        let times_ns = values("times_ns", &times)?;
        let n = at_most("times_ns", times_ns.len(), SAMPLES_MAX)?;
        let acceleration = triples("acceleration_mps2", acceleration_mps2, n)?;
        let rate = triples("angular_rate_radps", angular_rate_radps, n)?;
        let samples = times_ns.iter().zip(acceleration.into_iter().zip(rate)).map(
            |(&valid_at_ns, (acceleration_mps2, angular_rate_radps))| ImuRecord {
                valid_at_ns,
                acceleration_mps2,
                angular_rate_radps,
            },
        );
        let samples: Vec<ImuRecord> = samples.collect();
        let Some(at_ns) = times_ns.last().copied() else {
            return Err(refused("times_ns", "at least one sample", 0));
        };
        require_time("times_ns", at_ns)?;
        require_sound((IMU.check)(&of_time(at_ns), &samples), "samples")?;
        let sent = self.voice.ask(py, move |voice| {
            let loan = voice.imu.write(samples.len(), |place| samples[place])?;
            voice.imu.send(loan, at_ns).map(drop)
        })?;
        sent.map_err(refused_channel)
    }

    /// Tells what the range sensor saw.
    ///
    /// points: float32 (point, 3) [m], in the frame of `sensor`: 0 the vehicle's body, else the robot file's sensor of this
    /// number. terrain_class: uint8 (point,), 0 open, 1 loose, 2 vegetation, 3 obstacle; all open, if not given. origin_m:
    /// where the rays start, in the frame of the points.
    #[pyo3(signature = (
        points: "_Float32",
        terrain_class: "_Uint8 | None" = None,
        *,
        sensor=0,
        origin_m: "Sequence[float]" = Reals([0.0; 3]),
        valid_at_ns=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn publish_scan(
        &self,
        py: Python<'_>,
        points: &Bound<'_, PyAny>,
        terrain_class: Option<&Bound<'_, PyAny>>,
        sensor: u32,
        origin_m: Reals<f32, 3>,
        valid_at_ns: Option<u64>,
    ) -> PyResult<()> {
        let found = array::<f32, Ix2>("points", points, "point, 3")?;
        let n = at_most("points", found.shape()[0], POINTS_MAX)?;
        require_shape("points", found.shape(), &[n, 3])?;
        let classes = match terrain_class {
            None => vec![TerrainClass::Open as u8; n],
            Some(classes) => {
                let classes = array::<u8, Ix1>("terrain_class", classes, "point")?;
                require_shape("terrain_class", classes.shape(), &[n])?;
                values("terrain_class", &classes)?.to_vec()
            }
        };
        crate::ground::require_classes(&classes, 1)?;
        let positions = values("points", &found)?.as_chunks::<3>().0;
        let records = positions.iter().zip(&classes).map(|(position_m, class)| PointRecord {
            position_m: *position_m,
            class_number: u32::from(*class),
        });
        let records: Vec<PointRecord> = records.collect();
        let at_ns = valid_at_ns.unwrap_or_else(now_ns);
        require_time("valid_at_ns", at_ns)?;
        let header = ScanHeader { stamp: of_time(at_ns), origin_m: origin_m.0, sensor };
        require_sound((SCAN.check)(&header, &records), "points")?;
        let sent = self.voice.ask(py, move |voice| {
            let mut loan = voice.scans.write(records.len(), |place| records[place])?;
            *loan.header_mut() = header;
            voice.scans.send(loan, at_ns).map(drop)
        })?;
        sent.map_err(refused_channel)
    }

    /// Says where to go, in place of the run's own mission process: to be repeated once a second. outcome: 0 under way, 1
    /// goal reached, 6 out of time; see docs/runtime.md.
    #[pyo3(signature = (goal_m: "Sequence[float]", tolerance_m, time_s, *, outcome=0))]
    fn publish_mission(
        &self,
        py: Python<'_>,
        goal_m: Reals<f64, 2>,
        tolerance_m: f64,
        time_s: f64,
        outcome: u64,
    ) -> PyResult<()> {
        let record =
            MissionRecord { goal_m: goal_m.0, tolerance_m, time_s, outcome, ..MissionRecord::default() };
        require_sound((MISSION.check)(&of_time(now_ns()), &[record]), "a mission")?;
        let sent = self.voice.ask(py, move |voice| {
            let mut outlet = match voice.missions.take() {
                Some(outlet) => outlet,
                None => voice.bus.outlet(&MISSION, 1)?,
            };
            let sent = outlet.send_one(Stamp::default(), record, now_ns()).map(drop);
            voice.missions = Some(outlet);
            sent
        })?;
        sent.map_err(refused_channel)
    }

    /// Tells a command of a recorded drive in place of the run's own control process, as whoever knew all of its time.
    fn publish_command(
        &self,
        py: Python<'_>,
        speed_mps: f32,
        steering_rad: f32,
        valid_at_ns: u64,
    ) -> PyResult<()> {
        let command = Decision::Drive(bicycle::Command { speed_mps, steering_rad });
        let record = CommandRecord::from(&command).decided_on(valid_at_ns, valid_at_ns);
        require_sound((COMMAND.check)(&of_time(valid_at_ns), &[record]), "a command")?;
        require_time("valid_at_ns", valid_at_ns)?;
        let sent = self.voice.ask(py, move |voice| {
            let mut outlet = match voice.own_commands.take() {
                Some(outlet) => outlet,
                None => voice.bus.outlet(&COMMAND, 1)?,
            };
            let sent = outlet.send_one(Stamp::default(), record, valid_at_ns).map(drop);
            voice.own_commands = Some(outlet);
            sent
        })?;
        sent.map_err(refused_channel)
    }
}

/// The stamp of a message that is about to be sent.
fn of_time(valid_at_ns: u64) -> Stamp {
    Stamp { valid_at_ns, published_at_ns: now_ns(), ..Stamp::default() }
}

/// What no reader would take is refused before it is sent.
fn require_sound(checked: Result<(), bus::channel::Refusal>, what: &str) -> PyResult<()> {
    checked.map_err(|refusal| refused(what, "numbers that a message may have", format!("{refusal:?}")))
}

fn at_most(argument: &str, found: usize, most: usize) -> PyResult<usize> {
    if found <= most { Ok(found) } else { Err(refused(argument, format!("at most {most}"), found)) }
}

fn triples(argument: &str, found: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<[f32; 3]>> {
    let rows = array::<f32, Ix2>(argument, found, "sample, 3")?;
    require_shape(argument, rows.shape(), &[n, 3])?;
    Ok(values(argument, &rows)?.as_chunks().0.to_vec())
}
