//! Everything that went over the channels into a file, so that each decision can be made again.

mod file;
mod views;

use std::path::PathBuf;

use bytemuck::NoUninit;
use terrain::Mount;

use crate::RuntimeError;
use crate::setup::RecordedSetup;
use bus::channel::{
    Bus, CHECKPOINT, COMMAND, DECISION, EMERGENCY_STOP, Element, Header, IMU, Inlet, MISSION, ODOMETRY,
    ORDER, RISK, RISK_PHYSICS, SCAN, STUCK, SURFACE, TRACKS,
};
use bus::clock::{self, SECOND_NS};
use bus::message::{
    CheckpointHeader, CommandRecord, DecisionRecord, ImuRecord, MissionRecord, OdometryRecord, OrderHeader,
    PointRecord, RiskHeader, ScanHeader, Stamp, StuckRecord, SurfaceHeader, TrackRecord, TracksHeader,
};
use bus::status::{Health, Meter, Role};
use file::RotatingFile;
use views::Views;

/// Time between two looks at the channels [ns].
const POLL_NS: u64 = SECOND_NS / 200;

/// Topics of the messages as they went over the channels, by channel.
pub mod topic {
    /// What all of them begin with.
    pub const CHANNELS: &str = "/channel/";
    /// [`bus::channel::ODOMETRY`].
    pub const ODOMETRY: &str = "/channel/odometry";
    /// [`bus::channel::IMU`].
    pub const IMU: &str = "/channel/imu";
    /// [`bus::channel::SCAN`].
    pub const SCAN: &str = "/channel/scan";
    /// Headers of [`bus::channel::SURFACE`].
    pub const SURFACE: &str = "/channel/surface";
    /// [`bus::channel::TRACKS`].
    pub const TRACKS: &str = "/channel/tracks";
    /// Headers of [`bus::channel::RISK`].
    pub const RISK: &str = "/channel/risk";
    /// Headers of [`bus::channel::RISK_PHYSICS`].
    pub const RISK_PHYSICS: &str = "/channel/risk_physics";
    /// [`bus::channel::COMMAND`].
    pub const COMMAND: &str = "/channel/command";
    /// [`bus::channel::DECISION`].
    pub const DECISION: &str = "/channel/decision";
    /// [`bus::channel::STUCK`].
    pub const STUCK: &str = "/channel/stuck";
    /// [`bus::channel::MISSION`].
    pub const MISSION: &str = "/channel/mission";
    /// [`bus::channel::ORDER`].
    pub const ORDER: &str = "/channel/order";
    /// [`bus::channel::EMERGENCY_STOP`].
    pub const EMERGENCY_STOP: &str = "/channel/emergency_stop";
    /// [`bus::channel::CHECKPOINT`].
    pub const CHECKPOINT: &str = "/channel/checkpoint";
    /// What is needed to repeat the run, as JSON.
    pub const SETUP: &str = "/setup";
}

/// What records.
pub struct RecorderSetup {
    /// Folder of the files.
    pub folder: PathBuf,
    /// What is needed to repeat the run.
    pub setup: RecordedSetup,
    /// Size from which on the next file is begun [bytes].
    pub file_bytes_max: u64,
    /// Time after which the next file is begun [s].
    pub file_time_max_s: f64,
    /// Size that all recordings of the folder together may reach, those of before included [bytes].
    pub quota_bytes: u64,
    /// Sensors that scans may be of.
    pub mounts: Vec<Mount>,
    /// Time after which what was recorded is put onto the disk, so that a failure of the power costs no more [s].
    pub sync_interval_s: f64,
}

/// Records until `is_over` says to end. When the disk is full or the quota is reached it ends the file where that is
/// whole, says so, once, and goes on without a recording: the vehicle drives on. What is not recorded is counted, and
/// told as missed.
pub fn run(
    bus: &Bus,
    setup: RecorderSetup,
    is_over: &dyn Fn() -> bool,
    warn: &mut dyn FnMut(&str),
) -> Result<(), RuntimeError> {
    let mut tell = |error: RuntimeError| warn(&format!("{error}; driving on without a recording"));
    let mut recorder = Recorder::new(bus, setup.mounts.clone())?;
    recorder.file = match RotatingFile::create(setup, clock::now_ns()) {
        Err(error @ RuntimeError::Quota { .. }) => {
            tell(error);
            None
        }
        file => Some(file?),
    };
    while !is_over() {
        if let Err(error) = recorder.look() {
            tell(error);
            // It says again what has just been said.
            drop(recorder.file.take().map(RotatingFile::finish));
        }
        recorder.report()?;
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    recorder.file.map_or(Ok(()), RotatingFile::finish)
}

struct Recorder {
    inlets: Inlets,
    file: Option<RotatingFile>,
    views: Views,
    meter: Meter,
    n_unrecorded: u64,
}

struct Inlets {
    odometry: Inlet<Stamp, OdometryRecord>,
    imu: Inlet<Stamp, ImuRecord>,
    scans: Inlet<ScanHeader, PointRecord>,
    surfaces: Inlet<SurfaceHeader, [f32; 8]>,
    tracks: Inlet<TracksHeader, TrackRecord>,
    risks: [Inlet<RiskHeader, [f32; 4]>; 2],
    stuck: Inlet<Stamp, StuckRecord>,
    missions: Inlet<Stamp, MissionRecord>,
    orders: [Inlet<OrderHeader, [f64; 2]>; 2],
    commands: Inlet<Stamp, CommandRecord>,
    decisions: Inlet<Stamp, DecisionRecord>,
    checkpoints: Inlet<CheckpointHeader, u8>,
}

impl Recorder {
    fn new(bus: &Bus, mounts: Vec<Mount>) -> Result<Self, RuntimeError> {
        let inlets = Inlets {
            odometry: bus.inlet(&ODOMETRY)?,
            imu: bus.inlet(&IMU)?,
            scans: bus.inlet(&SCAN)?,
            surfaces: bus.inlet(&SURFACE)?,
            tracks: bus.inlet(&TRACKS)?,
            risks: [bus.inlet(&RISK)?, bus.inlet(&RISK_PHYSICS)?],
            stuck: bus.inlet(&STUCK)?,
            missions: bus.inlet(&MISSION)?,
            orders: [bus.inlet(&ORDER)?, bus.inlet(&EMERGENCY_STOP)?],
            commands: bus.inlet(&COMMAND)?,
            decisions: bus.inlet(&DECISION)?,
            checkpoints: bus.inlet(&CHECKPOINT)?,
        };
        let meter = Meter::new(bus, Role::Recorder)?;
        Ok(Self { inlets, file: None, views: Views::new(mounts), meter, n_unrecorded: 0 })
    }

    /// Takes everything from the channels, what others are made of first, and writes it.
    fn look(&mut self) -> Result<(), RuntimeError> {
        let Self { inlets, file: Some(file), views, meter, .. } = self else {
            self.n_unrecorded += self.inlets.pass_over();
            return Ok(());
        };
        let mut result = Ok(());
        let mut keep = |result: &mut Result<(), RuntimeError>, written: Result<(), formats::RecordError>| {
            meter.count(0);
            if let (Ok(()), Err(error)) = (&result, written) {
                *result = Err(error.into());
            }
        };
        inlets.odometry.poll(|header, records| {
            keep(&mut result, write(file, topic::ODOMETRY, header, records, OdometryRecord::layout));
            keep(&mut result, views.odometry(file.recorder(), header, records));
        });
        inlets.imu.poll(|header, samples| {
            keep(&mut result, write(file, topic::IMU, header, samples, ImuRecord::layout));
        });
        inlets.scans.poll(|header, points| {
            keep(&mut result, write(file, topic::SCAN, header, points, PointRecord::layout));
            keep(&mut result, views.scan(file.recorder(), header, points));
        });
        inlets.surfaces.poll(|header, cells| {
            keep(&mut result, write::<_, u8>(file, topic::SURFACE, header, &[], SurfaceHeader::layout));
            keep(&mut result, views.surface(file.recorder(), header, cells));
        });
        inlets.tracks.poll(|header, tracks| {
            keep(&mut result, write(file, topic::TRACKS, header, tracks, TrackRecord::layout));
        });
        for (inlet, name) in inlets.risks.iter_mut().zip([topic::RISK, topic::RISK_PHYSICS]) {
            inlet.poll(|header, payload| {
                keep(&mut result, write::<_, u8>(file, name, header, &[], RiskHeader::layout));
                keep(&mut result, views.risk(file.recorder(), header, payload));
            });
        }
        inlets.checkpoints.poll(|header, bytes| {
            keep(&mut result, write(file, topic::CHECKPOINT, header, bytes, CheckpointHeader::layout));
        });
        inlets.stuck.poll(|header, records| {
            keep(&mut result, write(file, topic::STUCK, header, records, StuckRecord::layout));
        });
        inlets.missions.poll(|header, records| {
            keep(&mut result, write(file, topic::MISSION, header, records, MissionRecord::layout));
        });
        for (inlet, name) in inlets.orders.iter_mut().zip([topic::ORDER, topic::EMERGENCY_STOP]) {
            inlet.poll(|header, points| {
                keep(&mut result, write(file, name, header, points, OrderHeader::layout));
            });
        }
        inlets.commands.poll(|header, records| {
            keep(&mut result, write(file, topic::COMMAND, header, records, CommandRecord::layout));
            keep(&mut result, views.command(file.recorder(), header, records));
        });
        inlets.decisions.poll(|header, records| {
            keep(&mut result, write(file, topic::DECISION, header, records, DecisionRecord::layout));
        });
        result?;
        file.tend(clock::now_ns())
    }

    fn report(&mut self) -> Result<(), RuntimeError> {
        let bytes = self.file.as_ref().map_or(-1.0, |file| file.bytes() as f64);
        let Inlets { odometry, imu, scans, surfaces, risks: [learned, physics], decisions, .. } =
            &self.inlets;
        Ok(self.meter.report(clock::now_ns(), || {
            Health { figure: bytes, n_missed: self.n_unrecorded, ..Health::default() }
                .with(odometry.counts())
                .with(imu.counts())
                .with(scans.counts())
                .with(surfaces.counts())
                .with(learned.counts())
                .with(physics.counts())
                .with(decisions.counts())
        })?)
    }
}

impl Inlets {
    /// Takes everything from the channels and keeps nothing; returns how many messages that were.
    fn pass_over(&mut self) -> u64 {
        fn all<H: Header, T: Element>(inlet: &mut Inlet<H, T>) -> u64 {
            let mut n = 0;
            inlet.poll(|_, _| n += 1);
            n
        }
        let ([learned, physics], [orders, emergency_stops]) = (&mut self.risks, &mut self.orders);
        all(&mut self.odometry)
            + all(&mut self.imu)
            + all(&mut self.scans)
            + all(&mut self.surfaces)
            + all(&mut self.tracks)
            + all(learned)
            + all(physics)
            + all(&mut self.stuck)
            + all(&mut self.missions)
            + all(orders)
            + all(emergency_stops)
            + all(&mut self.commands)
            + all(&mut self.decisions)
            + all(&mut self.checkpoints)
    }
}

/// Header and payload as they lie in memory, one after the other.
fn write<H: Header, T: NoUninit>(
    file: &mut RotatingFile,
    topic: &'static str,
    header: &H,
    payload: &[T],
    layout: fn() -> bus::layout::RecordLayout,
) -> Result<(), formats::RecordError> {
    let mut bytes = bytemuck::bytes_of(header).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(payload));
    let told = || bus::layout::c_header(&[layout()], bus::message::LAYOUT_VERSION);
    file.recorder().raw(topic, told, header.stamp().published_at_ns, &bytes)
}
