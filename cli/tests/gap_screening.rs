//! Drives that are sound must not be suspected: every labelled drive and five real vehicles.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};

use bicycle::DriveLog;
use serde_json::Value;
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
        found.extend(screen_sets(&[], std::slice::from_ref(&log)));
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

/// Whatever effect a robot's drives hold and however gently it was driven, they are in order; a position that is off by
/// 8 to 20 standard deviations leaps there and back.
#[test]
#[ignore = "needs the shared data"]
fn labelled_drives_are_not_suspected() {
    for (set, n_cases) in [("open", 34), ("open3", 152)] {
        let root = Path::new(SHARED).join("gap").join(set);
        let labels: Value =
            serde_json::from_slice(&std::fs::read(root.join("labels.json")).unwrap()).unwrap();
        let folders = root.join("cases").read_dir().unwrap();
        let folders: Vec<PathBuf> = folders.map(|entry| entry.unwrap().path()).collect();
        assert_eq!(folders.len(), n_cases, "{set}");
        for folder in folders {
            let has_outliers = labels[folder.file_name().unwrap().to_str().unwrap()]["outliers"] == true;
            let found = suspicions(&folder);
            let unfounded =
                found.iter().filter(|own| !(has_outliers && matches!(own, Suspicion::Leap { .. })));
            assert_eq!(unfounded.count(), 0, "{}: {found:#?}", folder.display());
        }
    }
}

fn suspicions(folder: &Path) -> Vec<Suspicion> {
    let case = formats::read_gap_case(folder).unwrap();
    let machine = case_machine(&case.vehicle);
    let [sim, real, heldout] = [&case.sim, &case.real, &case.heldout]
        .map(|paths| paths.iter().map(|path| read(path)).collect::<Vec<_>>());
    let drives = sim.iter().chain(&real).chain(&heldout);
    drives.flat_map(|log| screen(&machine, log)).chain(screen_sets(&sim, &real)).collect()
}
