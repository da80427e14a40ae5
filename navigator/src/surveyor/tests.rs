//! When a scan becomes a map.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::Config;
use bicycle::{Applied, AppliedBy, Command};
use terrain::{RangePoint, TerrainClass};

const MILLISECOND_NS: u64 = 1_000_000;

fn surveyor(surface: Surface) -> Surveyor {
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let config = Config::for_vehicle(&vehicle);
    let mount = Mount { position_m: [0.5, 0.0, 0.0], ..Mount::default() };
    Surveyor::new(&vehicle, config.elevation, config.guard, surface).unwrap().with_mounts(vec![mount])
}

/// 1 m/s eastwards.
fn odometry(at_ms: u64) -> OdometryMessage {
    let odometry = Odometry {
        valid_at_ns: at_ms * MILLISECOND_NS,
        position_m: [1e-3 * at_ms as f64, 0.0, 0.0],
        velocity_mps: [1.0, 0.0],
        ..Odometry::default()
    };
    let applied = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command };
    OdometryMessage { id: MessageId { epoch_ns: 1, sequence: at_ms }, odometry, applied }
}

fn scan(at_ms: u64, sensor: u32) -> ScanMessage {
    let point = |k: u16| RangePoint {
        position_m: [1.0 + 0.01 * f32::from(k % 20), 0.01 * f32::from(k / 20), -0.1],
        class: TerrainClass::Open,
    };
    let points = (0..200).map(point).collect();
    let scan = Scan { valid_at_ns: at_ms * MILLISECOND_NS, origin_m: [0.0, 0.0, 0.3], points };
    ScanMessage { id: MessageId { epoch_ns: 2, sequence: at_ms }, sensor, scan }
}

fn map_at(surveyor: &mut Surveyor, now_ms: u64) -> Option<SurfaceHeader> {
    surveyor.next_surface(now_ms * MILLISECOND_NS).unwrap()
}

#[test]
fn a_scan_waits_for_the_odometry_after_it() {
    let mut surveyor = surveyor(Surface::Sensed);
    surveyor.hear_odometry(&odometry(1000)).unwrap();
    surveyor.hear_scan(scan(1010, 0), 1011 * MILLISECOND_NS);
    assert_eq!(map_at(&mut surveyor, 1012), None);
    surveyor.hear_odometry(&odometry(1020)).unwrap();
    let header = map_at(&mut surveyor, 1021).unwrap();
    // Between the two: a hundredth of a second on from the first.
    assert!((header.odometry.position_m[0] - 1.01).abs() < 1e-9, "{header:?}");
    assert_eq!((header.valid_at_ns, header.frame_at_ns), (1010 * MILLISECOND_NS, 1020 * MILLISECOND_NS));
    assert_eq!((header.scan.sequence, header.last_odometry.sequence, header.n_odometry), (1010, 1020, 2));
    assert_eq!(map_at(&mut surveyor, 1022), None, "once");
}

#[test]
fn a_scan_waits_no_longer_than_it_may() {
    let mut surveyor = surveyor(Surface::Sensed);
    surveyor.hear_odometry(&odometry(1000)).unwrap();
    surveyor.hear_scan(scan(1010, 0), 1011 * MILLISECOND_NS);
    // It may wait for a tenth of a second since it came.
    assert_eq!(map_at(&mut surveyor, 1110), None);
    let header = map_at(&mut surveyor, 1111).unwrap();
    assert!((header.odometry.position_m[0] - 1.01).abs() < 1e-9, "reckoned on: {header:?}");
    // Farther ahead than anybody reckons.
    surveyor.hear_scan(scan(1200, 0), 1201 * MILLISECOND_NS);
    assert_eq!(map_at(&mut surveyor, 1400), None);
    assert_eq!((surveyor.tally().unplaced, surveyor.n_unmapped()), (1, 1));
}

#[test]
fn of_too_many_scans_the_oldest_is_given_up_and_those_of_unknown_sensors_are_none() {
    let mut surveyor = surveyor(Surface::Sensed);
    surveyor.hear_odometry(&odometry(1000)).unwrap();
    (1..=5).for_each(|k| surveyor.hear_scan(scan(1000 + k, 0), 1010 * MILLISECOND_NS));
    surveyor.hear_scan(scan(1006, 2), 1010 * MILLISECOND_NS);
    assert_eq!(surveyor.n_unmapped(), 2);
    surveyor.hear_odometry(&odometry(1020)).unwrap();
    let mapped: Vec<u64> =
        std::iter::from_fn(|| map_at(&mut surveyor, 1021)).map(|header| header.scan.sequence).collect();
    assert_eq!(mapped, [1002, 1003, 1004, 1005]);
}

#[test]
fn a_scan_lies_where_its_sensor_sits() {
    let known_m = |sensor: u32| {
        let mut surveyor = surveyor(Surface::Sensed);
        surveyor.hear_odometry(&odometry(1000)).unwrap();
        surveyor.hear_scan(scan(1000, sensor), 1000 * MILLISECOND_NS);
        assert!(map_at(&mut surveyor, 1000).is_some());
        let surface = surveyor.surface();
        let measured = |(_, cell): &(usize, &SurfaceCell)| cell.knowledge == terrain::Knowledge::Measured;
        let cells = surface.values().iter().enumerate().filter(measured);
        cells
            .map(|(index, _)| surface.geometry().centre_m(surface.geometry().cell(index))[0])
            .fold(f64::MIN, f64::max)
    };
    // The sensor sits half a metre ahead; a cell is some centimetres.
    assert!((known_m(1) - known_m(0) - 0.5).abs() < 0.06, "{} {}", known_m(0), known_m(1));
}

#[test]
fn a_jump_makes_a_map_at_once_and_a_surface_that_was_given_is_told_of_once() {
    let jumped = OdometryMessage {
        odometry: Odometry { position_m: [9.0, 0.0, 0.0], ..odometry(1020).odometry },
        ..odometry(1020)
    };
    let mut sensed = surveyor(Surface::Sensed);
    assert_eq!(sensed.hear_odometry(&odometry(1000)).unwrap(), None);
    let header = sensed.hear_odometry(&jumped).unwrap().unwrap();
    let step_m = header.jump.unwrap().step_m[0];
    assert!((step_m - (9.0 - 1.02)).abs() < 1e-9 && header.shift == header.jump.unwrap(), "{header:?}");
    assert_eq!(header.frame_at_ns, 1020 * MILLISECOND_NS);
    let flat = surveyor(Surface::Sensed).surface().clone();
    let mut given = surveyor(Surface::Given(flat));
    let header = given.hear_odometry(&odometry(1000)).unwrap().unwrap();
    assert_eq!((header.valid_at_ns, header.frame_at_ns), (TIMELESS_NS, TIMELESS_NS));
    assert_eq!(given.hear_odometry(&jumped).unwrap(), None);
}
