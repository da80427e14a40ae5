//! Drives that are sound must not be suspected: every labelled drive and five real vehicles.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};

use bicycle::DriveLog;
use sim_to_real::{Gravity, GroundMap, Machine, Suspicion, screen, screen_sets};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/");

fn machine(name: &str, wheelbase_m: f64) -> Machine {
    Machine {
        name: name.to_owned(),
        wheelbase_m,
        steering_max_rad: 0.6,
        speed_max_mps: 30.0,
        noise: None,
        ground: None,
    }
}

fn read(path: &Path) -> DriveLog {
    formats::read_drive(path).unwrap().log
}

#[test]
#[ignore = "needs the shared data"]
fn five_real_vehicles_are_not_refused() {
    let vehicles = [
        ("drive_warthog", 1.08),
        ("f1tenth_steps", 0.33),
        ("genesis_cpg_slow_lap", 3.02),
        ("ikd_f110", 0.324),
        ("rav4_comma2k19", 2.65),
    ];
    for (name, wheelbase_m) in vehicles {
        let log = read(&Path::new(SHARED).join("data/logs").join(format!("{name}.csv")));
        let machine = machine(name, wheelbase_m);
        let mut found = screen(&machine, &log);
        found.extend(screen_sets(&machine, &[], std::slice::from_ref(&log)));
        let refused: Vec<_> = found.iter().filter(|found| found.gravity() == Gravity::Refused).collect();
        assert!(refused.is_empty(), "{name}: {refused:?}");
        println!("{name}: {found:#?}");
    }
}

fn case_machine(path: &Path) -> Machine {
    let vehicle = formats::read_gap_vehicle(path).unwrap();
    let ground = vehicle.ground.map(|ground| GroundMap {
        origin_m: ground.origin_m,
        resolution_m: ground.resolution_m,
        n_nodes: ground.n_nodes,
        height_m: ground.height_m,
        class: ground.class,
    });
    Machine {
        steering_max_rad: vehicle.steering_max_rad.unwrap(),
        speed_max_mps: vehicle.speed_max_mps.unwrap(),
        ground,
        ..machine(&vehicle.name, vehicle.wheelbase_m)
    }
}

#[test]
#[ignore = "needs the shared data"]
fn labelled_drives_are_not_suspected() {
    let mut folders: Vec<PathBuf> = Path::new(SHARED)
        .join("gap/open/cases")
        .read_dir()
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    folders.sort();
    let (mut suspicions, mut n_swapped_found) = (Vec::new(), 0);
    for folder in &folders {
        let case = formats::read_gap_case(folder).unwrap();
        let machine = case_machine(&case.vehicle);
        let [sim, real, heldout] = [&case.sim, &case.real, &case.heldout]
            .map(|paths| paths.iter().map(|path| read(path)).collect::<Vec<_>>());
        let drives = sim.iter().chain(&real).chain(&heldout);
        let found = drives.flat_map(|log| screen(&machine, log)).chain(screen_sets(&machine, &sim, &real));
        suspicions.extend(found.map(|suspicion| (case.name.clone(), suspicion)));
        let swapped = screen_sets(&machine, &real, &sim);
        n_swapped_found +=
            usize::from(swapped.iter().any(|found| matches!(found, Suspicion::Swapped { .. })));
    }
    println!("of {} swapped cases {n_swapped_found} are told by the drives alone", folders.len());
    assert!(suspicions.is_empty(), "{suspicions:#?}");
    assert!(folders.len() >= 30 && n_swapped_found >= 8, "{n_swapped_found} of {}", folders.len());
}
