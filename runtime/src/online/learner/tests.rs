//! Drives over ground that answers in another way than the ground that the shipped networks know.

use std::sync::{Arc, LazyLock};

use bicycle::{Command, Vehicle};
use evidential::{Method, shipped, shipped_data};
use scenarios::{
    Deviation, Episode, EpisodeConfig, RockFieldConfig, RockMap, Split, Task, World, rock_field,
};
use terrain::{GridGeometry, GridMap, SurfaceCell};

use super::*;
use crate::online::Notebook;

/// How far the driver looks ahead, and how large its circles are [m].
const AHEAD_M: f64 = 4.0;
const RADIUS_M: [f64; 2] = [9.0, 17.0];
const SPEED_MPS: f32 = 2.0;

fn vehicle() -> Vehicle {
    let mut vehicle = formats::read_vehicle("pietra_full_size").unwrap();
    vehicle.limits.speed_max_mps = f64::from(SPEED_MPS);
    (vehicle.limits.roll_max_rad, vehicle.limits.pitch_max_rad) = (1.5, 1.5);
    vehicle
}

/// Edge of a cell of the map [m].
const RESOLUTION_M: f64 = 0.25;

/// The ground as a perfect map shows it.
fn surface_of(world: &World) -> GridMap<SurfaceCell> {
    let n = (world.bounds().north_east_m[0] / RESOLUTION_M) as usize;
    let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [0, 0], n_rows: n, n_cols: n };
    let mut surface = GridMap::filled(geometry, SurfaceCell::UNKNOWN);
    for (index, cell) in surface.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let patch = world.patch(x_m, y_m);
        *cell = SurfaceCell::certain(world.height_m(x_m, y_m) as f32, patch.class, patch.vegetation_height_m);
    }
    surface
}

/// A drive in growing circles over a field of rocks, as stretches.
fn drive(deviations: &[Deviation], seed: u64, time_s: f64) -> Vec<Stretch> {
    let vehicle = vehicle();
    let field = RockFieldConfig::testbed();
    let centre_m = [0.5 * field.side_m; 2];
    let start = [centre_m[0] + RADIUS_M[0], centre_m[1], std::f64::consts::FRAC_PI_2];
    let map = RockMap { seed, split: Split::Validation, index: 20 };
    let world = Arc::new(rock_field(&field, map, &[[start[0], start[1]]]).unwrap());
    let surface = surface_of(&world);
    let task = Task::in_world(world, start, [1e3, 1e3], 0.1);
    let mut episode = EpisodeConfig::for_vehicle(&vehicle);
    episode.range_sensor = None;
    (episode.rules.time_limit_s, episode.rules.immobile_s) = (time_s, 1e3);
    episode.deviations = deviations.to_vec();
    let mut episode = Episode::new(task, &vehicle, episode, seed).unwrap();
    let (mut notebook, mut stretches) = (Notebook::default(), Vec::new());
    while episode.outcome().is_none() {
        let odometry = episode.observe().odometry;
        let command = steer(&vehicle, &odometry, centre_m, episode.time_s() / time_s);
        notebook.note_command(odometry.valid_at_ns, &bicycle::Decision::Drive(command));
        notebook.note_odometry(&odometry);
        if notebook.is_full() {
            stretches.push(notebook.take(surface.clone(), navigator::Jump::NONE));
        }
        episode.apply(&bicycle::Decision::Drive(command)).unwrap();
    }
    stretches
}

/// Towards a point ahead on a circle that grows.
fn steer(vehicle: &Vehicle, odometry: &bicycle::Odometry, centre_m: [f64; 2], share: f64) -> Command {
    let radius_m = RADIUS_M[0] + share * (RADIUS_M[1] - RADIUS_M[0]);
    let [x_m, y_m, _] = odometry.position_m;
    let bearing_rad = (y_m - centre_m[1]).atan2(x_m - centre_m[0]) + AHEAD_M / radius_m;
    let aim_m = [centre_m[0] + radius_m * bearing_rad.cos(), centre_m[1] + radius_m * bearing_rad.sin()];
    let turn_rad = (aim_m[1] - y_m).atan2(aim_m[0] - x_m) - odometry.attitude_rad[2];
    let curvature = 2.0 * turn_rad.sin() / AHEAD_M;
    let steering_rad = (vehicle.geometry.wheelbase_m * curvature).atan();
    let lock_rad = vehicle.limits.steering_max_rad;
    Command { speed_mps: SPEED_MPS, steering_rad: steering_rad.clamp(-lock_rad, lock_rad) as f32 }
}

/// A motor that gives way under load, on soft tyres.
const TIRED: [Deviation; 2] = [Deviation::MotorDroop, Deviation::RollingResistance { added: 0.1 }];

static DRIVE: LazyLock<Vec<Stretch>> = LazyLock::new(|| drive(&TIRED, 5, 140.0));
/// The machine as the networks know it.
static USUAL: LazyLock<Vec<Stretch>> = LazyLock::new(|| drive(&[], 6, 110.0));

fn learner() -> Learner {
    let vehicle = vehicle();
    let original = Arc::new(shipped(Method::Pietra, &vehicle.geometry).unwrap());
    let data = shipped_data(&original).unwrap().unwrap();
    Learner::new(LearnerSetup {
        geometry: vehicle.geometry,
        limits: vehicle.limits,
        resolution_m: RESOLUTION_M,
        original,
        validation: data.validation,
        familiar: Some(data.familiar),
        seed: 7,
    })
    .unwrap()
}

/// Takes in stretches as the thread does; the rounds.
fn learn(learner: &mut Learner, stretches: &[Stretch]) -> Vec<Round> {
    let mut rounds = Vec::new();
    for stretch in stretches {
        learner.take(stretch.clone()).unwrap();
        if learner.is_ready() {
            rounds.extend(learner.round(&|| true).unwrap());
        }
    }
    rounds
}

#[test]
fn what_is_accepted_is_better_on_held_out_ground_and_the_same_drive_gives_the_same_networks() {
    let mut learner = learner();
    let rounds = learn(&mut learner, &DRIVE);
    let accepted: Vec<&Round> = rounds.iter().filter(|round| round.decision == Decision::Accepted).collect();
    assert!(!accepted.is_empty(), "{rounds:?}");
    for Round { recent, original, recent_standard_error, .. } in accepted {
        assert!(recent[1] + recent_standard_error < recent[0] && original[1] <= FORGETTING_MAX * original[0]);
    }
    let held_out = learner.data(Part::HeldOut);
    let [before, after] =
        [learner.original(), learner.in_use()].map(|n| assess(n, &held_out).unwrap().total());
    assert!(after < before, "{after} {before}");

    let mut again = super::tests::learner();
    assert_eq!(learn(&mut again, &DRIVE), rounds);
    assert_eq!(again.in_use().weights_bytes().unwrap(), learner.in_use().weights_bytes().unwrap());
    assert_ne!(again.in_use().tensors, again.original().tensors);
}

/// Examples of a usual drive, laid along a straight way, with whatever is said to have been measured on what is learned
/// from and on what is held out.
fn along(learner: &mut Learner, mut measure: impl FnMut(usize, Part, [f32; 4]) -> [f32; 4]) {
    let mut source = super::tests::learner();
    USUAL.iter().for_each(|stretch| source.take(stretch.clone()).unwrap());
    let mut scratch = Memory::new(&vehicle().geometry);
    let examples = [Part::Learned, Part::HeldOut].map(|part| source.memory.examples(part)).concat();
    for (k, example) in examples.into_iter().enumerate() {
        let example = Example { pose: [0.25 * k as f64, 0.0, 0.0], ..example };
        let Some(part) = scratch.take(example.clone()) else {
            learner.remember(example);
            continue;
        };
        let measured = measure(k, part, example.measured);
        learner.remember(Example { measured, ..example });
    }
}

/// What a sensor that has gone mad would say.
fn random(k: usize) -> [f32; 4] {
    [0, 1, 2, 3].map(|head: u64| {
        let word = (k as u64 * 4 + head).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (word >> 40) as f32 / (1u64 << 24) as f32
    })
}

#[test]
fn poisoned_labels_are_refused_and_what_they_made_is_rolled_back() {
    let mut learner = learner();
    along(&mut learner, |k, part, measured| if part == Part::Learned { random(k) } else { measured });
    assert!(learner.is_ready());
    let round = learner.round(&|| true).unwrap().unwrap();
    assert!(matches!(round.decision, Decision::NotBetter | Decision::Forgets), "{round:?}");
    assert!(Arc::ptr_eq(learner.in_use(), learner.original()));

    // Had it been accepted all the same, the next round would have ended it.
    let [learned, familiar] = [Some(learner.data(Part::Learned)), learner.setup.familiar.clone()];
    let settings = Refinement::new(3);
    let poisoned = refine(learner.original(), &learned.unwrap(), familiar.as_ref(), &settings, &|| true);
    learner.in_use = Arc::new(poisoned.unwrap().unwrap().at(1.0).unwrap());
    let round = learner.round(&|| true).unwrap().unwrap();
    assert_eq!(round.decision, Decision::RolledBack, "{round:?}");
    assert!(Arc::ptr_eq(learner.in_use(), learner.original()));
}

#[test]
fn where_held_out_labels_are_poisoned_too_the_original_data_bound_the_harm() {
    let mut learner = learner();
    along(&mut learner, |k, _, _| random(k));
    learner.round(&|| true).unwrap().unwrap();
    let error = assess(learner.in_use(), &learner.setup.validation).unwrap().total();
    assert!(error <= FORGETTING_MAX * learner.original_error, "{error}");
}

#[test]
fn numbers_that_are_none_are_not_remembered() {
    let mut learner = learner();
    along(&mut learner, |k, _, measured| match k % 3 {
        0 => [f32::INFINITY, 0.5, 0.1, 0.1],
        1 => [f32::NAN; 4],
        _ => measured,
    });
    let all = [Part::Learned, Part::HeldOut].map(|part| learner.memory().examples(part)).concat();
    assert!(learner.n_refused() > 100);
    assert!(all.iter().flat_map(|example| example.measured).all(|value| !value.is_infinite()));
    let example = Example { features: vec![f32::NAN; 144], ..all[0].clone() };
    let n = learner.n_refused();
    learner.remember(example);
    learner.remember(Example { features: vec![0.0; 3], ..all[0].clone() });
    assert_eq!(learner.n_refused(), n + 2);
}

#[test]
fn nothing_is_learned_before_there_is_enough_and_a_round_can_be_broken_off() {
    let mut learner = learner();
    learner.take(DRIVE[0].clone()).unwrap();
    assert!(!learner.is_ready() && learner.memory().n(Part::Learned) == 0);
    along(&mut learner, |_, _, measured| measured);
    assert_eq!(learner.round(&|| false).unwrap(), None);
    assert!(Arc::ptr_eq(learner.in_use(), learner.original()));
}

#[test]
fn data_of_another_vehicle_are_refused() {
    let setup = learner().setup;
    let mut other = setup.validation.clone();
    other.origin.vehicle = "another".to_owned();
    let told = |setup| Learner::new(setup).map(drop).unwrap_err().to_string();
    assert!(told(LearnerSetup { validation: other.clone(), ..setup.clone() }).contains("validation"));
    assert!(told(LearnerSetup { familiar: Some(other), ..setup }).contains("vehicle"));
}
