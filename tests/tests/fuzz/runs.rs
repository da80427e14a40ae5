//! Recordings of `surefoot up`: what is recorded is broken message by message, and replayed.

use std::path::PathBuf;
use std::sync::LazyLock;

use bus::ages::Periods;
use bus::layout::Scalar;
use bus::message::{CheckpointHeader, MissionRecord, OdometryRecord, StuckRecord};
use formats::ConfigText;
use navigator::{Assessor, Belief, Pilot, RiskMapConfig, Surface, Surveyor};
use rand::RngExt;
use runtime::ages::{self, AskedAges};
use runtime::recorder::topic;
use runtime::replay::{self, Knowledge};
use runtime::setup::{ClockAnchor, RecordedSetup};
use traversability::CvarLevel;

use crate::files::{folder, text};
use crate::harness::{Fate, Reader, Rng};
use crate::machine::{ALPHA, Drive, MACHINE, SEED, goal, stamped, whole_command};
use crate::messages::places;
use crate::mutate::{self, once_in};
use crate::networks;
use crate::recording::{self, Told};

fn setup() -> RecordedSetup {
    let [vehicle_toml, model_toml, config_toml] = MACHINE.texts().unwrap();
    RecordedSetup {
        format: RecordedSetup::FORMAT,
        clock: ClockAnchor { monotonic_ns: "1".to_owned(), utc_ns: "2".to_owned() },
        ages: ages::limits(&Periods::default(), &MACHINE.config.guard, &AskedAges::default()).unwrap(),
        vehicle_name: MACHINE.vehicle.name.clone(),
        vehicle_toml,
        model_toml,
        config_toml,
        method: "physics".to_owned(),
        checkpoint_sha256: String::new(),
        corrector_sha256: String::new(),
        alpha: ALPHA,
        seed: SEED.to_string(),
        revision: String::new(),
    }
}

fn told(topic: &str, header: &impl bytemuck::NoUninit, payload: &[impl bytemuck::NoUninit]) -> Told {
    Told::new(topic, &[bytemuck::bytes_of(header), bytemuck::cast_slice(payload)].concat())
}

/// Everything that was recorded of the drive.
static RUN: LazyLock<Vec<Told>> = LazyLock::new(|| {
    let drive = Drive::get();
    let nothing: [u8; 0] = [];
    let odometry = |cycle: u64| OdometryRecord::from(&Drive::odometry(cycle));
    let stuck = StuckRecord { position_m: [2.0, 2.0], yaw_rad: 0.3 };
    let mission = MissionRecord { goal_m: goal().goal_m, ..MissionRecord::default() };
    let (n_weight_bytes, weights) = networks::message_payload();
    let learned = CheckpointHeader { stamp: stamped(0), n_weight_bytes, ..CheckpointHeader::default() };
    let mut messages = vec![
        Told::new(topic::SETUP, &serde_json::to_vec(&setup()).unwrap()),
        told(topic::ODOMETRY, &stamped(1), &[odometry(1)]),
        told(topic::ODOMETRY, &stamped(2), &[odometry(2)]),
        told(topic::SCAN, &drive.scan.0, &drive.scan.1),
        told(topic::SURFACE, &drive.surface.0, &nothing),
        told(topic::RISK_PHYSICS, &drive.risk.0, &nothing),
        told(topic::STUCK, &stamped(3), &[stuck]),
        told(topic::MISSION, &stamped(0), &[mission]),
        told(topic::COMMAND, &stamped(0), &[whole_command()]),
    ];
    messages.extend(drive.decisions.iter().map(|(stamp, record)| told(topic::DECISION, stamp, &[*record])));
    messages.push(told(topic::CHECKPOINT, &learned, &weights));
    messages
});

/// Where the numbers of a topic's messages lie, and which.
fn places_of(name: &str) -> Vec<(usize, Scalar)> {
    let after_stamp = |record: &str| {
        let rest = places(record).into_iter().map(|(at, scalar)| (at + 40, scalar));
        places("Stamp").into_iter().chain(rest).collect()
    };
    match name {
        topic::ODOMETRY => after_stamp("OdometryRecord"),
        topic::STUCK => after_stamp("StuckRecord"),
        topic::MISSION => after_stamp("MissionRecord"),
        topic::COMMAND => after_stamp("CommandRecord"),
        topic::DECISION => after_stamp("DecisionRecord"),
        topic::SCAN => places("ScanHeader"),
        topic::SURFACE => places("SurfaceHeader"),
        topic::RISK | topic::RISK_PHYSICS => places("RiskHeader"),
        topic::CHECKPOINT => places("CheckpointHeader"),
        _ => Vec::new(),
    }
}

static PLACES: LazyLock<Vec<Vec<(usize, Scalar)>>> =
    LazyLock::new(|| RUN.iter().map(|told| places_of(&told.topic)).collect());

fn change(rng: &mut Rng, told: &mut Told) {
    if told.topic == topic::SETUP {
        return change_setup(rng, told);
    }
    let known = RUN.iter().position(|whole| whole.topic == told.topic);
    let fitting = known
        .map(|place| &PLACES[place])
        .filter(|places| places.last().is_some_and(|(at, _)| at + 8 <= told.data.len()));
    match fitting {
        Some(places) if !once_in(rng, 6) => mutate::scalars(rng, &mut told.data, places),
        _ => mutate::bytes(rng, &mut told.data),
    }
}

/// Breaks one of the texts within the setup, or the setup around them.
fn change_setup(rng: &mut Rng, told: &mut Told) {
    let mut setup = setup();
    let broken = |rng: &mut Rng, text: &str| String::from_utf8_lossy(&mutate::text(rng, text)).into_owned();
    match rng.random_range(0..5) {
        0 => setup.vehicle_toml = broken(rng, &setup.vehicle_toml),
        1 => setup.model_toml = broken(rng, &setup.model_toml),
        2 => setup.config_toml = broken(rng, &setup.config_toml),
        3 => setup.seed = broken(rng, &setup.seed),
        _ => {
            told.data = mutate::text(rng, &serde_json::to_string(&setup).unwrap());
            return;
        }
    }
    told.data = serde_json::to_vec(&setup).unwrap();
}

pub fn recorded_run(rng: &mut Rng) -> Vec<u8> {
    recording::broken(rng, &RUN, change)
}

/// Reads a recording and makes its decisions again.
pub fn read_recorded_run() -> Reader {
    let folder = folder();
    let files = [folder.path().join("run.mcap")];
    let knowledge = Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None };
    let read = move |input: &[u8]| {
        std::fs::write(&files[0], input).unwrap();
        let _lives = &folder;
        replayed(&files, &knowledge)
    };
    Box::new(move |input| Fate::of(&read(input)))
}

fn replayed(files: &[PathBuf], knowledge: &Knowledge) -> Result<replay::ReplayReport, replay::ReplayError> {
    replay::replay(&replay::read(files)?, knowledge)
}

/// What is broken is a drive that is made again: without that, the fuzzing would not get past the first message.
#[test]
fn the_recording_that_is_broken_replays_when_it_is_whole() {
    let folder = folder();
    let file = folder.path().join("run.mcap");
    std::fs::write(&file, recording::whole(&RUN)).unwrap();
    let knowledge = Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None };
    let report = replayed(&[file], &knowledge).unwrap();
    assert_eq!((report.n_decisions, report.n_identical, report.n_surfaces), (2, 2, 1), "{report:?}");
    assert_eq!(report.n_risk_maps, 1, "{report:?}");
}

/// A vehicle and the settings that differ from those that fit it.
pub fn pipeline(rng: &mut Rng) -> Vec<u8> {
    let vehicle = toml::to_string(&MACHINE.vehicle).unwrap();
    let settings = toml::to_string(&MACHINE.config).unwrap();
    let parts = if once_in(rng, 2) {
        [mutate::text(rng, &vehicle), settings.into_bytes()]
    } else {
        [vehicle.into_bytes(), mutate::text(rng, &settings)]
    };
    parts.join(SEPARATOR)
}

/// A whole input but for the length of the vehicle's body [m].
pub fn with_body_length(length_m: &str) -> Vec<u8> {
    let vehicle = toml::to_string(&MACHINE.vehicle).unwrap();
    let own = format!("length_m = {:?}\n", MACHINE.vehicle.geometry.length_m);
    assert!(vehicle.contains(&own), "{own}");
    let vehicle = vehicle.replacen(&own, &format!("length_m = {length_m}\n"), 1);
    [vehicle.into_bytes(), toml::to_string(&MACHINE.config).unwrap().into_bytes()].join(SEPARATOR)
}

/// Between the two texts of an input: a comment that mutation cannot make.
const SEPARATOR: &[u8] = b"\n#-#-#\n";

/// Reads vehicle and settings, and makes of them what drives.
pub fn read_pipeline() -> Reader {
    let separator = str::from_utf8(SEPARATOR).unwrap();
    text(move |input| {
        let Some((vehicle, settings)) = input.split_once(separator) else { return Fate::Refused };
        Fate::of(&made(vehicle, settings))
    })
}

/// Cells, and poses of the risk map, up to which windows are tried.
const N_TRIED: usize = 1 << 18;

fn made(vehicle: &str, settings: &str) -> Result<(), String> {
    let vehicle =
        formats::parse_vehicle(&ConfigText::new("v.toml", vehicle)).map_err(|error| error.to_string())?;
    let defaults = navigator::Config::for_vehicle(&vehicle);
    let mut config = formats::overlay(&ConfigText::new("s.toml", settings), &defaults)
        .map_err(|error| error.to_string())?;
    let RiskMapConfig { n_rows, n_cols, n_yaws, .. } = config.risk_map;
    let n_cells = config.elevation.n_rows.saturating_mul(config.elevation.n_cols);
    if n_cells.max(n_rows.saturating_mul(n_cols).saturating_mul(n_yaws)) > N_TRIED {
        return Err("a window so large takes the memory that it asks for".to_owned());
    }
    // As many as the command line says, whatever the file does.
    config.controller.n_threads = 1;
    let model = bicycle::Model::of(&vehicle);
    let level = CvarLevel::new(ALPHA).unwrap();
    let told = |error: navigator::NavigatorError| error.to_string();
    Surveyor::new(&vehicle, config.elevation, config.guard, Surface::Sensed).map_err(told)?;
    Assessor::new(&vehicle, &model.limits, &config, &Belief::Physics, level).map_err(told)?;
    Pilot::new(model, &config, SEED).map_err(told)?;
    Ok(())
}
