//! What the model knows of its sensors corrects the state that is decided on, and the map.

use bicycle::effect::{OdomScale, PoseLatency, YawMisalign};
use bicycle::{Applied, AppliedBy, Command, Effect, Model, Odometry, SensorModel, Vehicle};
use navigator::{Config, MessageId, OdometryMessage, Pilot, Surface, Surveyor};
use scenarios::Deviation;
use terrain::{RangePoint, Scan, TerrainClass};

use crate::course::Course;

const LATENCY_S: f64 = 0.2;
const MISALIGNED_RAD: f64 = 0.15;
const RATIO: f64 = 1.25;

fn vehicle() -> Vehicle {
    formats::read_vehicle("pietra_full_size").unwrap()
}

fn effects() -> Vec<Effect> {
    vec![
        Effect::PoseLatency(PoseLatency { age_s: LATENCY_S }),
        Effect::OdomScale(OdomScale { ratio: RATIO }),
        Effect::YawMisalign(YawMisalign { angle_rad: MISALIGNED_RAD }),
    ]
}

/// Along y at 2 m/s.
fn truth(cycle: u64) -> Odometry {
    Odometry {
        valid_at_ns: 100_000_000 * cycle,
        position_m: [1.0, 0.2 * cycle as f64, 0.45],
        attitude_rad: [0.0, 0.0, std::f64::consts::FRAC_PI_2],
        velocity_mps: [2.0, 0.0],
        wheel_speed_mps: 2.0,
        ..Odometry::default()
    }
}

/// What these sensors say of it: 0.4 m behind, turned, a quarter too fast.
fn misstated(cycle: u64) -> Odometry {
    let mut odometry = truth(cycle);
    odometry.position_m[1] -= 2.0 * LATENCY_S;
    odometry.attitude_rad[2] += MISALIGNED_RAD;
    odometry.velocity_mps[0] *= RATIO;
    odometry
}

#[test]
fn pilot_decides_on_the_corrected_state() {
    let vehicle = vehicle();
    let model = Model { effects: effects(), ..Model::of(&vehicle) };
    let mut pilot = Pilot::new(model, &Config::for_vehicle(&vehicle), 1).unwrap();
    let applied = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command };
    pilot.hear_odometry(&OdometryMessage { id: MessageId::default(), odometry: misstated(3), applied });
    let (found, expected) = (pilot.odometry().unwrap(), truth(3));
    for axis in 0..3 {
        assert!((found.position_m[axis] - expected.position_m[axis]).abs() < 1e-9, "{found:?}");
        assert!((found.attitude_rad[axis] - expected.attitude_rad[axis]).abs() < 1e-9, "{found:?}");
    }
    assert!((found.velocity_mps[0] - 2.0).abs() < 1e-9);
}

/// Points of a mound 5 m ahead of the vehicle.
fn scan(cycle: u64) -> Scan {
    let ahead_m = 5.0 - 0.2 * cycle as f32;
    let point = |k: u16| RangePoint {
        position_m: [ahead_m + 0.05 * f32::from(k % 20), 0.05 * f32::from(k / 20) - 0.5, 0.0],
        class: TerrainClass::Open,
    };
    Scan {
        valid_at_ns: truth(cycle).valid_at_ns,
        origin_m: [0.0, 0.0, 1.5],
        points: (0..400).map(point).collect(),
    }
}

#[test]
fn corrected_map_is_that_of_sensors_that_tell_the_truth() {
    let (vehicle, config) = (vehicle(), Config::for_vehicle(&vehicle()));
    let heights = |sensors: SensorModel, measured: fn(u64) -> Odometry| {
        let new = Surveyor::new(&vehicle, config.elevation, config.guard, Surface::Sensed).unwrap();
        let mut surveyor = new.with_sensors(sensors);
        for cycle in 0..4 {
            assert_eq!(surveyor.admit(&measured(cycle)), Ok(None), "no jump");
            assert!(surveyor.fuse(&measured(cycle), &scan(cycle)).unwrap());
        }
        let cells = surveyor.surface().values().iter();
        cells.map(|cell| cell.height_m.is_finite().then_some(cell.height_m)).collect::<Vec<_>>()
    };
    let expected = heights(SensorModel::NEUTRAL, truth);
    assert_eq!(heights(SensorModel::of(&effects()), misstated), expected);
    assert_ne!(heights(SensorModel::NEUTRAL, misstated), expected, "uncorrected the mound is elsewhere");
}

/// A heading sensor that is mounted askew leads the vehicle astray until the model knows of it: then it drives straight
/// on over flat ground.
#[test]
fn known_misalignment_is_driven_as_if_it_were_none() {
    let way_m = |effects: Vec<Effect>| {
        let mut course = Course::flat(12.0);
        course.episode.deviations = vec![Deviation::YawMisalignment { angle_rad: MISALIGNED_RAD }];
        let mut closed = course.begin_believing(effects);
        let mut aside_m: f64 = 0.0;
        while closed.episode.outcome().is_none() {
            closed.cycle().unwrap();
            aside_m = aside_m.max(closed.episode.motion().pose.y_m.abs());
        }
        aside_m
    };
    let known = vec![Effect::YawMisalign(YawMisalign { angle_rad: MISALIGNED_RAD })];
    let (repaired_m, nominal_m) = (way_m(known), way_m(Vec::new()));
    assert!(repaired_m < 0.35 && nominal_m > repaired_m + 0.2, "{repaired_m} m against {nominal_m} m");
}
