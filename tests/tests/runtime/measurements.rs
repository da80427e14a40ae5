//! What the localisation, the sensors and their clock may do to the vehicle.

use std::sync::atomic::{AtomicBool, Ordering};

use bicycle::{Decision, StopReason};
use bus::channel::{Bus, ODOMETRY, SURFACE};
use bus::clock::now_ns;
use bus::message::{Stamp, StatusRecord, SurfaceHeader};
use bus::payload::numbers_cell;
use navigator::{Belief, Jump};
use runtime::mapping::JUMPED;
use runtime::replay::{self, Knowledge};
use rustix::process::Signal;
use terrain::Cell;

use crate::driver::{Driver, Misbehaviour};
use crate::fixture::{Run, eventually, machine, plant_setup};
use crate::witness::Witness;
use bus::status::Role;

const PLANNERS: [Role; 3] = [Role::Mapping, Role::Learning, Role::Control];

/// A machine under load may be too slow to decide on the map of before; then it is asked again.
const ATTEMPTS: usize = 6;

#[test]
fn measurements_that_cannot_be_trusted_stop_the_vehicle_until_they_can() {
    let mut run = Run::new();
    run.start_all(&PLANNERS);
    let driver = Driver::start(&run.name);
    let mut witness = Witness::new(&run);
    witness.until_driving("all is well");
    let well = Misbehaviour::default();
    let second_ns = 1_000_000_000;
    let cases = [
        (
            "odometry is not finite",
            Misbehaviour { is_not_a_number: true, ..well },
            StopReason::NonFiniteInput,
        ),
        ("odometry repeats itself", Misbehaviour { is_frozen: true, ..well }, StopReason::StaleOdometry),
        ("its clock is ahead", Misbehaviour { ahead_ns: second_ns, ..well }, StopReason::StaleOdometry),
        (
            "its clock jumps back",
            Misbehaviour { ahead_ns: -2 * second_ns, ..well },
            StopReason::StaleOdometry,
        ),
    ];
    for (fault, behaviour, reason) in cases {
        driver.behave(behaviour);
        let took_ms = witness.until_decided(fault, Decision::Stop(reason));
        println!("{fault:36} {took_ms:7.0} ms");
        // It does not creep on in between: for as long as the fault lasts, nothing is driven.
        witness.decided.clear();
        witness.until(fault, |witness| witness.decided.len() >= 5);
        let drives = |record: &&_| matches!(command_of(record), Some(Decision::Drive(_)));
        assert_eq!(witness.decided.iter().find(drives), None, "{fault}");
        driver.behave(well);
        witness.until_driving(fault);
    }
    // Clocks of two machines are never the same to the millisecond.
    driver.behave(Misbehaviour { ahead_ns: 10_000_000, ..well });
    witness.decided.clear();
    witness.until("a clock a little ahead is no fault", |witness| {
        let driven =
            witness.decided.iter().filter(|record| matches!(command_of(record), Some(Decision::Drive(_))));
        driven.count() >= 10
    });
}

fn command_of(record: &bus::message::DecisionRecord) -> Option<Decision> {
    record.command.decision()
}

/// How many cells of a surface message are known, and the middle of these, east and north [m].
fn known(header: &SurfaceHeader, cells: &[[f32; 8]]) -> (usize, [f64; 2]) {
    let grid = header.grid.geometry().unwrap();
    let is_known = |(_, numbers): &(usize, &[f32; 8])| numbers_cell(numbers).unwrap().is_known();
    let place_m = |index: usize| {
        let Cell { row, col } = grid.cell(index);
        [(grid.origin[0], col), (grid.origin[1], row)]
            .map(|(first, k)| grid.resolution_m * (first + k as i64) as f64)
    };
    let places: Vec<[f64; 2]> = cells.iter().enumerate().filter(is_known).map(|(k, _)| place_m(k)).collect();
    let mean = |axis: usize| places.iter().map(|place_m| place_m[axis]).sum::<f64>() / places.len() as f64;
    (places.len(), [mean(0), mean(1)])
}

#[test]
fn a_localisation_that_jumps_moves_the_map_and_not_the_vehicle() {
    let mut run = Run::new();
    run.start_all(&PLANNERS);
    let driver = Driver::start(&run.name);
    let mut witness = Witness::new(&run);
    let bus = Bus::join(&run.name).unwrap();
    let mut surfaces = bus.inlet(&SURFACE).unwrap();
    witness.until_driving("all is well");

    // A jump tells all that mapping knows, other scans what is urgent alone: it stands until a scan in between has told all,
    // so that the last map before the jump is what the jump moves.
    let held = Misbehaviour { is_held: true, ..Misbehaviour::default() };
    driver.behave(held);
    witness.until_standing("an operator holds it");
    let mut before = (0, [0.0; 2]);
    let mut n_scans = 0;
    let told_whole = eventually(60.0, || {
        surfaces.poll(|header, cells| {
            n_scans += 1;
            before = known(header, cells);
        });
        (n_scans > 2 * u64::from(machine().1.elevation.publish_period_scans)).then_some(())
    });
    assert!(told_whole.is_some(), "{n_scans} scans mapped");

    // Mapping follows: what was known is known, elsewhere.
    let mut jumped = None;
    let (offset_m, turn_rad) = ([6.0, -9.0], 0.4);
    driver.behave(Misbehaviour { offset_m, turn_rad, ..held });
    eventually(60.0, || {
        surfaces.poll(|header, cells| match header.event {
            JUMPED => jumped = Some((*header, known(header, cells))),
            _ if jumped.is_none() => before = known(header, cells),
            _ => {}
        });
        jumped
    });
    driver.behave(Misbehaviour { offset_m, turn_rad, ..Misbehaviour::default() });
    let (header, after) = jumped.expect("mapping makes out the jump");
    assert!((header.jump_yaw_rad - turn_rad).abs() < 0.03, "{}", header.jump_yaw_rad);
    let expected = Jump { step_m: [offset_m[0], offset_m[1], 0.0], yaw_rad: turn_rad };
    let expected_m = expected.place_m([before.1[0], before.1[1], 0.0]);
    for axis in [0, 1] {
        // To whole cells of half a metre, and by the turn's own noise over the distance from the origin.
        assert!(
            (after.1[axis] - expected_m[axis]).abs() < 0.8,
            "{before:?} became {after:?}, not {expected_m:?}"
        );
    }
    // The corners of the window turn out of it.
    assert!(10 * after.0 > 8 * before.0, "of {} cells {} are left", before.0, after.0);
    drives_on_the_map_of_before(&run, &driver, &mut witness, offset_m, turn_rad);
}

/// Control drives on while mapping follows, on the map of before, laid where it belongs.
fn drives_on_the_map_of_before(
    run: &Run,
    driver: &Driver,
    witness: &mut Witness,
    mut offset_m: [f64; 2],
    turn_rad: f64,
) {
    let has_driven = (0..ATTEMPTS).any(|_| {
        witness.until_driving("after a jump");
        [Role::Mapping, Role::Learning].into_iter().for_each(|role| run.signal(role, Signal::STOP));
        offset_m = offset_m.map(|m| -m);
        // Farther than the map reaches: where the vehicle is said to be now, the old map holds nothing.
        let at_ns = bus::clock::now_ns();
        driver.behave(Misbehaviour {
            offset_m: offset_m.map(|m| 3.0 * m),
            turn_rad,
            ..Misbehaviour::default()
        });
        witness.decided.clear();
        witness.until("three decisions after the jump", |witness| {
            witness.decided.iter().filter(|record| record.decided_at_ns > at_ns + 100_000_000).count() >= 3
        });
        [Role::Mapping, Role::Learning].into_iter().for_each(|role| run.signal(role, Signal::CONT));
        let lost = Some(Decision::Stop(StopReason::OutsideMap));
        assert!(witness.decided.iter().all(|record| command_of(record) != lost), "the map stayed behind");
        let on_old = |record: &&bus::message::DecisionRecord| {
            record.decided_at_ns > at_ns + 100_000_000 && record.command.scan_at_ns < at_ns
        };
        let drives = |record| matches!(command_of(record), Some(Decision::Drive(_)));
        witness.decided.iter().filter(on_old).any(drives)
    });
    assert!(has_driven, "never drove on the map of before a jump");
}

/// Mapping is played: what it says of jumps in its status is what the vehicle's process knows at the end of the drive.
#[test]
fn the_vehicle_knows_of_the_jumps_that_mapping_made_out() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut mapping = bus.outlet(&Role::Mapping.status(), 1).unwrap();
    let mut odometry = bus.inlet(&ODOMETRY).unwrap();
    let is_over = AtomicBool::new(false);
    let report = std::thread::scope(|scope| {
        let vehicle = scope.spawn(|| {
            let (vehicle, _) = machine();
            let is_over = || is_over.load(Ordering::Relaxed);
            simulator::run(&Bus::join(&run.name).unwrap(), plant_setup(&vehicle), &is_over)
        });
        let mut drive = |n_cycles: u64| {
            let mut n_heard = 0;
            let heard = eventually(60.0, || {
                odometry.poll(|_, _| n_heard += 1);
                (n_heard >= n_cycles).then_some(())
            });
            assert!(heard.is_some(), "the vehicle does not measure");
        };
        drive(3);
        let told = StatusRecord { figure: 3.0, ..StatusRecord::default() };
        mapping.send_one(Stamp::default(), told, now_ns()).unwrap();
        drive(5);
        is_over.store(true, Ordering::Relaxed);
        vehicle.join().unwrap().unwrap()
    });
    assert_eq!(report.n_jumps, 3);
}

#[test]
fn scans_between_two_words_of_the_localisation_are_mapped() {
    let mut run = Run::new();
    run.start_all(&PLANNERS);
    let driver = Driver::start(&run.name);
    // 40 ms after odometry and 60 ms before the next.
    driver.behave(Misbehaviour { is_sparse: true, ..Misbehaviour::default() });
    let mut witness = Witness::new(&run);
    witness.until_driving("odometry ten times a second");
    witness.decided.clear();
    witness.until("it goes on", |witness| witness.decided.len() >= 20);
    let stale = Some(Decision::Stop(StopReason::StaleScan));
    assert!(witness.decided.iter().all(|record| command_of(record) != stale), "scans were dropped");
}

/// Whoever holds the vehicle where it is, be it its watchdog or an operator, is known to control: it goes on from rest,
/// cycle by cycle, as far as the actuators get in one step, and does not take the vehicle for stuck.
#[test]
fn control_goes_on_from_what_was_really_applied() {
    let mut run = Run::new();
    run.start(Role::Recorder);
    run.start_all(&PLANNERS);
    let driver = Driver::start(&run.name);
    let mut witness = Witness::new(&run);
    witness.until_driving("all is well");
    driver.behave(Misbehaviour { is_held: true, ..Misbehaviour::default() });
    witness.until_standing("an operator holds it");
    witness.decided.clear();
    // Longer than the patience of somebody who is stuck.
    witness.until("it is held for a while", |witness| witness.decided.len() >= 40);
    let (vehicle, config) = machine();
    let step_mps = vehicle.limits.acceleration_max_mps2 * config.controller.step_s;
    assert!(f64::from(40) * 0.1 > 1.5 * config.controller.recovery.patience_s);
    // One for which no odometry came in time knows nothing yet of what became of the one before.
    let informed: Vec<_> = witness.decided.iter().filter(|record| record.n_odometry > 0).collect();
    assert!(informed.len() > 10, "{:?}", witness.decided);
    for record in informed {
        if let Some(Decision::Drive(command)) = command_of(record) {
            let speed_mps = f64::from(command.speed_mps);
            assert!((0.0..=1.001 * step_mps).contains(&speed_mps), "{record:?} after rest");
        }
    }
    driver.behave(Misbehaviour::default());
    witness.until_driving("nobody holds it any more");
    drop(driver);
    run.end();
    let knowledge = Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None };
    let records = replay::read(&run.recordings()).unwrap();
    assert!(records.stuck.is_empty(), "{:?}", records.stuck);
    let report = replay::replay(&records, &knowledge).unwrap();
    assert_eq!((report.first_difference.as_ref(), &report.contradictions), (None, &Vec::new()), "{report:?}");
    assert!(report.n_identical > 40, "{report:?}");
}
