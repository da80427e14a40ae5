//! `surefoot gap seal`: a case set in one place, its labels in another.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use formats::{DriveLogFile, GapCase, GapGround, GapKind, GapLabel, GapNoise, GapVehicle};
use scenarios::{Amount, Deviation, DrawnCase, Style, TestDriveError, TestMachine, seed_of, test_drive};
use terrain::TerrainClass;

use super::workers::{Bar, work};
use crate::arguments::GapSealArguments;
use crate::{UsageError, WorkFailed};

/// Kinds of machines that others are drawn around.
const BASES: [&str; 4] = ["rc_car", "pietra_full_size", "buggy_fifth", "sedan"];
/// Names of the plant in labels: with a speed controller that has an integral, and without.
const PLANTS: [&str; 2] = ["surefoot", "surefoot_droop"];
/// Cases for each machine, about.
const CASES_PER_MACHINE: usize = 10;
/// Machines and faults with which nobody stays on the wheels are drawn again, at most so often.
const ATTEMPTS: u64 = 20;
/// Bytes that a case takes at most, its share of a machine included.
const CASE_BYTES: u64 = 1 << 20;

const SIM_STYLES: [Style; 4] = [Style::Rich, Style::Rich, Style::Rich, Style::Track];

pub(super) fn run(arguments: &GapSealArguments) -> anyhow::Result<()> {
    let places = Places::prepare(arguments)?;
    let n_machines = arguments.cases.div_ceil(CASES_PER_MACHINE);
    let bar = Bar::new(n_machines + arguments.cases, "machines and cases");
    let machines = work(n_machines, arguments.threads.count(), |index| {
        let machine = places.make_machine(arguments.seed, index)?;
        bar.step("");
        Ok(machine)
    })?;
    let labels = Mutex::new(BTreeMap::new());
    work(arguments.cases, arguments.threads.count(), |index| {
        let machine = &machines[seed_of(arguments.seed, &[CASE, index as u64]) as usize % n_machines];
        let (name, label) = places.make_case(arguments.seed, index, machine)?;
        labels.lock().map_err(|_| WorkFailed("another drive has failed".to_owned()))?.insert(name, label);
        bar.step("");
        Ok(())
    })?;
    bar.finish();
    let labels = labels.into_inner().map_err(|_| WorkFailed("a drive has failed".to_owned()))?;
    let seal = formats::write_gap_labels(&places.labels, &labels)?;
    formats::write_gap_seal(&places.partial, &seal)?;
    std::fs::rename(&places.partial, &places.set)?;
    println!("  {} cases on {n_machines} machines in {}", arguments.cases, places.set.display());
    println!("  labels in {}, SHA-256 {}", places.labels.display(), seal.labels_sha256);
    Ok(())
}

/// Words that keep the seeds of machines, cases and drives apart.
const MACHINE: u64 = 1;
const CASE: u64 = 2;
const DRIVE: u64 = 3;

/// Where everything goes.
struct Places {
    set: PathBuf,
    /// Becomes the set when all is there.
    partial: PathBuf,
    labels: PathBuf,
}

impl Places {
    /// Errors: a place that is taken, labels inside the set, a folder that cannot be made or has no room.
    fn prepare(arguments: &GapSealArguments) -> anyhow::Result<Self> {
        let set = std::path::absolute(&arguments.out)?;
        let labels = std::path::absolute(&arguments.labels)?;
        refuse_taken(&set, &labels)?;
        let Some(name) = set.file_name() else {
            return Err(UsageError(format!("--out: expected a folder, found {}", set.display())).into());
        };
        let partial = set.with_file_name(format!(".{}.partial", name.to_string_lossy()));
        if partial.exists() {
            std::fs::remove_dir_all(&partial)?;
        }
        let room = CASE_BYTES * arguments.cases as u64;
        formats::prepare_out_dir(&partial, room).map_err(UsageError::from_input)?;
        if let Some(folder) = labels.parent() {
            formats::prepare_out_dir(folder, 1 << 16)
                .map_err(|error| UsageError(format!("--labels: {}", UsageError::from_input(error))))?;
        }
        refuse_inside(&set, &labels)?;
        Ok(Self { set, partial, labels })
    }

    /// Draws a machine, writes it and its nominal drives.
    fn make_machine(&self, seed: u64, index: usize) -> anyhow::Result<TestMachine> {
        let base = formats::read_vehicle(BASES[index % BASES.len()])?;
        let name = format!("veh_{:02}", index + 1);
        let folder = self.partial.join("vehicles").join(&name);
        for attempt in 0..ATTEMPTS {
            let seed = seed_of(seed, &[MACHINE, index as u64, attempt]);
            let machine = TestMachine::draw(&base, &name, seed)?;
            let drives =
                |k: usize| test_drive(&machine, &[], SIM_STYLES[k], seed_of(seed, &[DRIVE, k as u64]));
            let Some(logs) = driven((0..SIM_STYLES.len()).map(drives))? else { continue };
            std::fs::create_dir_all(&folder)?;
            formats::write_gap_vehicle(&folder, &described(&machine))?;
            for (k, log) in logs.into_iter().enumerate() {
                write_drive(&folder.join(format!("sim_{}.csv", k + 1)), log)?;
            }
            return Ok(machine);
        }
        Err(WorkFailed(format!("{name}: expected a machine that stays on its wheels, found none")).into())
    }

    /// Draws what is wrong, writes the robot's drives and gives the label.
    fn make_case(
        &self,
        seed: u64,
        index: usize,
        machine: &TestMachine,
    ) -> anyhow::Result<(String, GapLabel)> {
        let name = format!("case_{:03}", index + 1);
        let folder = self.partial.join("cases").join(&name);
        for attempt in 0..ATTEMPTS {
            let seed = seed_of(seed, &[CASE, index as u64, attempt]);
            let case = DrawnCase::draw(machine, seed);
            let styles = [case.style, case.style, case.heldout_style];
            let drives = |k: usize| {
                test_drive(machine, &case.deviations, styles[k], seed_of(seed, &[DRIVE, k as u64]))
            };
            let Some(logs) = driven((0..styles.len()).map(drives))? else { continue };
            std::fs::create_dir_all(&folder)?;
            for (file, log) in DRIVE_FILES.iter().zip(logs) {
                write_drive(&folder.join(file), log)?;
            }
            formats::write_gap_case(&folder, &filed(&name, &machine.vehicle.name))?;
            return Ok((name, labelled(&case, machine)));
        }
        Err(WorkFailed(format!("{name}: expected a fault that can be driven with, found none")).into())
    }
}

const DRIVE_FILES: [&str; 3] = ["real_train_1.csv", "real_train_2.csv", "real_heldout.csv"];

/// All drives, or none where one of them could not be driven.
fn driven(
    drives: impl Iterator<Item = Result<bicycle::DriveLog, TestDriveError>>,
) -> anyhow::Result<Option<Vec<bicycle::DriveLog>>> {
    match drives.collect::<Result<Vec<_>, _>>() {
        Ok(logs) => Ok(Some(logs)),
        Err(TestDriveError::NoDrive) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn refuse_taken(set: &Path, labels: &Path) -> Result<(), UsageError> {
    let is_taken = set.is_file() || std::fs::read_dir(set).is_ok_and(|mut entries| entries.next().is_some());
    if is_taken {
        let found = format!("{} with something in it", set.display());
        return Err(UsageError(format!(
            "--out: expected a folder that does not exist or is empty, found {found}"
        )));
    }
    if labels.exists() {
        let found = labels.display();
        return Err(UsageError(format!("--labels: expected a file that does not exist yet, found {found}")));
    }
    refuse_inside(set, labels)
}

/// Whoever has the set must not have the labels. Links are followed as far as folders exist.
fn refuse_inside(set: &Path, labels: &Path) -> Result<(), UsageError> {
    let resolved = |path: &Path| -> PathBuf {
        let known = path.ancestors().find_map(|folder| Some((folder, folder.canonicalize().ok()?)));
        known.map_or_else(
            || path.to_owned(),
            |(folder, real)| path.strip_prefix(folder).map_or_else(|_| real.clone(), |rest| real.join(rest)),
        )
    };
    if resolved(labels).starts_with(resolved(set)) {
        let (labels, set) = (labels.display(), set.display());
        return Err(UsageError(format!("--labels: expected a file outside of {set}, found {labels}")));
    }
    Ok(())
}

fn write_drive(path: &Path, log: bicycle::DriveLog) -> anyhow::Result<()> {
    let file = DriveLogFile { log, other_columns: Vec::new() };
    Ok(formats::write_drive_log_csv(path, &file)?)
}

/// What the owner of the simulator would say of the machine.
fn described(machine: &TestMachine) -> GapVehicle {
    let sensors = &machine.sensors;
    let geometry = *machine.world.geometry();
    let [n_east, n_north] = [geometry.n_cols, geometry.n_rows];
    let nodes = || (0..n_east).flat_map(move |i| (0..n_north).map(move |j| j * n_east + i));
    let south_west_m = geometry.centre_m(geometry.cell(0));
    GapVehicle {
        name: machine.vehicle.name.clone(),
        wheelbase_m: machine.vehicle.geometry.wheelbase_m,
        steering_max_rad: Some(machine.steering_max_rad),
        speed_max_mps: Some(machine.speeds_mps[1]),
        noise: GapNoise {
            x: Some(sensors.position_noise_m),
            y: Some(sensors.position_noise_m),
            yaw: Some(sensors.attitude_noise_rad),
            vx: Some(sensors.velocity_noise_mps),
            wz: Some(sensors.yaw_rate_noise_radps),
        },
        ground: Some(GapGround {
            origin_m: south_west_m,
            resolution_m: geometry.resolution_m,
            n_nodes: [n_east, n_north],
            height_m: nodes().map(|index| machine.world.heights.values()[index]).collect(),
            class: nodes().map(|index| class(machine.world.patches.values()[index].class)).collect(),
        }),
    }
}

fn class(class: TerrainClass) -> u8 {
    match class {
        TerrainClass::Open | TerrainClass::Obstacle => 0,
        TerrainClass::Loose => 1,
        TerrainClass::Vegetation => 2,
    }
}

/// Paths as seen from the case's folder.
fn filed(name: &str, vehicle: &str) -> GapCase {
    let folder = Path::new("../../vehicles").join(vehicle);
    GapCase {
        name: name.to_owned(),
        vehicle: folder.join("vehicle.toml"),
        sim: (1..=SIM_STYLES.len()).map(|k| folder.join(format!("sim_{k}.csv"))).collect(),
        real: DRIVE_FILES[..2].iter().map(PathBuf::from).collect(),
        heldout: vec![DRIVE_FILES[2].into()],
    }
}

fn labelled(case: &DrawnCase, machine: &TestMachine) -> GapLabel {
    let droops = machine.peculiarities.contains(&Deviation::MotorDroop);
    GapLabel {
        vehicle: machine.vehicle.name.clone(),
        plant: PLANTS[usize::from(droops)].to_owned(),
        kind: match case.amount {
            Amount::None => GapKind::None,
            Amount::Single => GapKind::Single,
            Amount::Pair => GapKind::Pair,
            Amount::Unknown => GapKind::Unknown,
        },
        effects: case.effects.iter().map(|id| (*id).to_owned()).collect(),
        magnitude: case.magnitude.map_or("-", |magnitude| magnitude.letter()).to_owned(),
        style: case.style.name().to_owned(),
        injection: injection(case),
    }
}

/// Numbers by key; the two of the wind stand in one list.
fn injection(case: &DrawnCase) -> BTreeMap<String, serde_json::Value> {
    let numbers = &case.injection;
    let wind = numbers.get("wind_east").zip(numbers.get("wind_north")).map(|(east, north)| [*east, *north]);
    let others = numbers.iter().filter(|(key, _)| !key.starts_with("wind_"));
    let others = others.map(|(key, value)| ((*key).to_owned(), (*value).into()));
    others.chain(wind.map(|wind| ("wind".to_owned(), wind.to_vec().into()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::ThreadArguments;

    fn arguments(out: &Path, labels: &Path) -> GapSealArguments {
        let (out, labels) = (out.to_owned(), labels.to_owned());
        GapSealArguments { cases: 1, seed: 1, out, labels, threads: ThreadArguments { threads: Some(1) } }
    }

    #[test]
    fn labels_inside_the_set_are_refused_whatever_the_path_looks_like() {
        let folder = tempfile::tempdir().unwrap();
        let set = folder.path().join("set");
        for labels in ["set/labels.json", "set/../set/a/l.json", "set"] {
            let told =
                Places::prepare(&arguments(&set, &folder.path().join(labels))).err().unwrap().to_string();
            assert!(told.starts_with("--labels: expected a file outside of"), "{told}");
        }
        std::fs::create_dir(&set).unwrap();
        std::os::unix::fs::symlink(&set, folder.path().join("link")).unwrap();
        let told =
            Places::prepare(&arguments(&set, &folder.path().join("link/l.json"))).err().unwrap().to_string();
        assert!(told.starts_with("--labels: expected a file outside of"), "{told}");
        // A name that begins like the set's is another folder.
        assert!(Places::prepare(&arguments(&set, &folder.path().join("set_labels/l.json"))).is_ok());
    }

    #[test]
    fn places_that_are_taken_are_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (set, labels) = (folder.path().join("set"), folder.path().join("l.json"));
        std::fs::create_dir(&set).unwrap();
        std::fs::write(set.join("mine"), "kept").unwrap();
        let told = Places::prepare(&arguments(&set, &labels)).err().unwrap().to_string();
        assert!(told.starts_with("--out: expected a folder that does not exist or is empty"), "{told}");
        std::fs::remove_file(set.join("mine")).unwrap();
        std::fs::write(&labels, "old").unwrap();
        let told = Places::prepare(&arguments(&set, &labels)).err().unwrap().to_string();
        assert!(told.starts_with("--labels: expected a file that does not exist yet"), "{told}");
        assert_eq!(std::fs::read_to_string(&labels).unwrap(), "old");
    }

    #[test]
    fn a_node_of_the_map_is_where_the_world_has_it() {
        let base = formats::read_vehicle("rc_car").unwrap();
        let machine = TestMachine::draw(&base, "v", 3).unwrap();
        let ground = described(&machine).ground.unwrap();
        for (i, j) in [(0, 0), (5, 90), (120, 7), (175, 175)] {
            let [x_m, y_m] = [i, j].map(|k| k as f64 * ground.resolution_m);
            let [x_m, y_m] = [ground.origin_m[0] + x_m, ground.origin_m[1] + y_m];
            let index = i * ground.n_nodes[1] + j;
            assert!((f64::from(ground.height_m[index]) - machine.world.height_m(x_m, y_m)).abs() < 1e-5);
            assert_eq!(ground.class[index], class(machine.world.patch(x_m, y_m).class));
        }
    }
}
