//! Data gathered by driving: the same for any number of threads, true to the plant, and refused where it means nothing.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bench::closed_loop::MapSource;
use bench::collection::{
    Collection, CollectionError, Place, Recorded, Request, collect, collect_recorded, find_height_scale,
};
use bicycle::{Column, DriveLog, Vehicle};
use evidential::Example;
use scenarios::{OdometryConfig, Outcome, RockFieldConfig, Split, Truth, WorldLayers};
use terrain::{GridGeometry, GridMap};

fn vehicle() -> Vehicle {
    formats::read_vehicle("pietra_full_size").unwrap()
}

fn rocks(split: Split, test_height_scale: f64) -> Place {
    Place::Rocks { field: RockFieldConfig { test_height_scale, ..RockFieldConfig::default() }, split }
}

fn request(n_maps: u32, n_trials: u32) -> Request {
    let request = Request::new(vehicle(), rocks(Split::Train, 1.0), 3);
    Request { n_maps, n_trials, time_limit_s: 15.0, n_threads: 2, ..request }
}

fn run(request: &Request) -> Collection {
    collect(request, || ()).unwrap()
}

/// Equal although what is masked equals nothing.
fn bits(example: &Example) -> Vec<u32> {
    example.measured.iter().chain(&example.features).map(|value| value.to_bits()).collect()
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let one = run(&Request { n_threads: 1, time_limit_s: 6.0, ..request(2, 2) });
    let n_seen = AtomicUsize::new(0);
    let three = Request { n_threads: 3, time_limit_s: 6.0, ..request(2, 2) };
    let three = collect(&three, || {
        n_seen.fetch_add(1, Ordering::Relaxed);
    })
    .unwrap();
    assert_eq!(n_seen.into_inner(), 4);
    assert_eq!(one.dataset.to_bytes().unwrap(), three.dataset.to_bytes().unwrap());
    assert_eq!((one.trials, one.responses), (three.trials, three.responses));
    let other = run(&Request { seed: 4, time_limit_s: 6.0, ..request(2, 2) });
    assert_ne!(one.dataset.examples[0].pose, other.dataset.examples[0].pose);
    let validation = Request { place: rocks(Split::Validation, 1.0), time_limit_s: 6.0, ..request(2, 2) };
    assert_ne!(one.dataset.examples[0].pose, run(&validation).dataset.examples[0].pose);
}

/// Labels less what the plant's statics say at the same poses, on ground of at most this unevenness.
fn residuals(collection: &Collection, unevenness_max_m: f32) -> [Vec<f64>; 4] {
    let mut vehicle = vehicle();
    vehicle.limits.speed_max_mps = 2.0;
    let truths: Vec<Truth> =
        collection.worlds.iter().map(|world| Truth::new(&vehicle, Arc::clone(world))).collect();
    let mut residuals: [Vec<f64>; 4] = Default::default();
    let even = |example: &&Example| example.unevenness_m <= unevenness_max_m;
    for example in collection.dataset.examples.iter().filter(even) {
        let [x_m, y_m, yaw_rad] = example.pose;
        let map = collection.trials[example.drive as usize].map as usize;
        let there = truths[map].traversability(x_m, y_m, yaw_rad);
        let expected =
            [there.linear_traction, there.angular_traction, there.roll_rad.abs(), there.pitch_rad.abs()];
        for k in (0..4).filter(|&k| !example.measured[k].is_nan()) {
            residuals[k].push(f64::from(example.measured[k]) - expected[k]);
        }
    }
    residuals
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let mean_of = mean(values);
    mean(&values.iter().map(|value| (value - mean_of).powi(2)).collect::<Vec<_>>()).sqrt()
}

#[test]
fn labels_agree_with_the_statics_of_the_plant_and_their_scatter_is_the_plants_own() {
    let usual = request(2, 10);
    let perfect = Request { odometry: OdometryConfig::PERFECT, ..usual.clone() };
    let [measured, exact] = [usual, perfect].map(|request| residuals(&run(&request), 0.04));
    // The truth drives straight on, these drives weave by sines of 0.33 to 1 of the lock of 0.524 rad, 0.066 rad2 in the
    // mean square d2. The front wheels go 1 / cos d as far as the rear axle, and the speed controller holds the mean of
    // all: the rear axle falls behind by d2 / 4 = 0.0165.
    let weaving = -0.0165;
    // Beside that, mean and deviation at most: traction 1 and 2 %, scattering by what rocks do to a vehicle at 2 m/s;
    // angles 0.1 and 0.7 degrees.
    let most = [[0.01, 0.05], [0.025, 0.12], [0.002, 0.012], [0.002, 0.012]];
    for k in 0..4 {
        let expected = if k < 2 { weaving } else { 0.0 };
        let (off, deviation) = (mean(&measured[k]) - expected, deviation(&measured[k]));
        assert!(measured[k].len() > 300, "{k}: {}", measured[k].len());
        assert!(off.abs() < most[k][0] && deviation < most[k][1], "{k}: {off} {deviation}");
    }
    // Odometry that knows everything scatters little less.
    for k in 0..2 {
        let [noisy, clean] = [&measured, &exact].map(|residuals| deviation(&residuals[k]));
        assert!((noisy - clean) / clean < 0.15, "{k}: {noisy} {clean}");
    }
}

#[test]
fn the_robots_own_map_shows_nearly_the_true_ground() {
    let oracle = run(&request(1, 2));
    let sensed = run(&Request { map_source: MapSource::Sensed, ..request(1, 2) });
    assert_eq!(oracle.log, sensed.log, "the drive does not depend on who looks");
    assert_eq!(oracle.dataset.examples.len(), sensed.dataset.examples.len());
    let n_heights = oracle.dataset.origin.layout.height_patch.n_samples();
    let mut errors_m = Vec::new();
    for (seen, there) in sensed.dataset.examples.iter().zip(&oracle.dataset.examples) {
        assert_eq!(bits(seen)[..4], bits(there)[..4]);
        assert_eq!((seen.pose, seen.unevenness_m), (there.pose, there.unevenness_m));
        let heights = seen.features.iter().zip(&there.features).take(n_heights);
        errors_m.extend(heights.map(|(seen, there)| 0.45 * (seen - there).abs()));
    }
    errors_m.sort_by(f32::total_cmp);
    // Millimetres, yet not the same: the map was fused from noisy ranges.
    let [median_m, most_m] = [errors_m[errors_m.len() / 2], errors_m[errors_m.len() * 9 / 10]];
    assert!((1e-4..0.006).contains(&median_m) && most_m < 0.02, "{median_m} {most_m}");
}

#[test]
fn trials_on_high_rocks_end_by_rolling_over_or_getting_stuck_and_never_by_tilt_alone() {
    let collection = run(&Request { place: rocks(Split::Test, 4.0), time_limit_s: 30.0, ..request(2, 10) });
    let n =
        |outcome: Outcome| collection.trials.iter().filter(|trial| trial.outcome == Some(outcome)).count();
    assert!(n(Outcome::RolledOver) > 0 && n(Outcome::Stuck) > 0 && n(Outcome::AttitudeLimit) == 0);
    let steepest_rad =
        collection.dataset.examples.iter().map(|example| example.measured[2]).fold(0.0, f32::max);
    assert!(steepest_rad > 0.6, "beyond the limit of 30 degrees: {steepest_rad}");
    // A vehicle that is stuck has no traction, and that is labelled.
    let n_stuck = collection.dataset.examples.iter().filter(|example| example.measured[0] < 0.05).count();
    assert!(n_stuck > 5, "{n_stuck}");
}

#[test]
fn the_height_scale_makes_the_wanted_share_more_uneven_than_half_of_the_training() {
    let training = run(&request(2, 3)).dataset;
    let test = Request { place: rocks(Split::Test, 1.0), ..request(2, 3) };
    let found = find_height_scale(&training, &test, [0.9, 0.03], 6).unwrap();
    assert!((found.share - 0.9).abs() <= 0.03 && found.scale > 1.1, "{found:?}");
    assert!(found.rounds.len() > 1 && found.rounds[0].scale == 1.0, "{found:?}");
    // The share is that of a collection at this scale.
    let again = run(&Request { place: rocks(Split::Test, found.scale), ..test }).dataset;
    let median_m = training.unevenness_quantile_m(0.5);
    let n_above = again.examples.iter().filter(|example| example.unevenness_m > median_m).count();
    assert_eq!(found.share, n_above as f64 / again.examples.len() as f64);
}

#[test]
fn the_hall_teaches_plants() {
    let car = formats::read_vehicle("rc_car").unwrap();
    let hall = Request::new(car, Place::Arena { split: Split::Train }, 1);
    let collection = run(&Request { n_maps: 3, n_trials: 4, time_limit_s: 10.0, n_threads: 2, ..hall });
    let layout = collection.dataset.origin.layout;
    let plants = |example: &&Example| {
        example.features[layout.height_patch.n_samples()..].chunks(4).any(|sample| sample[0] > 0.1)
    };
    let n_plants = collection.dataset.examples.iter().filter(plants).count();
    assert!(n_plants > 10, "{n_plants} of {}", collection.dataset.examples.len());
    let heights: Vec<f32> = collection
        .worlds
        .iter()
        .map(|world| world.patches.values().iter().map(|patch| patch.vegetation_height_m).fold(0.0, f32::max))
        .collect();
    assert!(heights[0] != heights[1] && heights[1] != heights[2], "{heights:?}");
}

/// The ground of a collection's first world as a file would hold it.
fn layers(collection: &Collection) -> WorldLayers {
    WorldLayers {
        elevation_m: collection.worlds[0].heights.clone(),
        canopy_height_m: None,
        low_vegetation_fraction: None,
        water: None,
        ground_gap_m: None,
    }
}

fn recorded(collection: &Collection, layers: &WorldLayers) -> Result<Collection, CollectionError> {
    let source = Recorded { log: "drive.csv".to_owned(), ground: "ground.npz".to_owned() };
    let mut vehicle = vehicle();
    vehicle.limits.speed_max_mps = 2.0;
    collect_recorded(&vehicle, collection.log.clone(), layers, &source)
}

#[test]
fn a_recording_of_the_same_drives_gives_the_same_labels() {
    let driven = run(&request(1, 2));
    let read = recorded(&driven, &layers(&driven)).unwrap();
    assert_eq!((read.responses, read.labelling), (driven.responses, driven.labelling));
    assert_eq!(read.dataset.examples.len(), driven.dataset.examples.len());
    assert_eq!(read.dataset.origin.provenance, "recorded drive drive.csv on ground.npz");
    let mut errors = Vec::new();
    for (read, driven) in read.dataset.examples.iter().zip(&driven.dataset.examples) {
        assert_eq!(bits(read)[..4], bits(driven)[..4]);
        assert_eq!((read.pose, read.drive), (driven.pose, driven.drive));
        errors.extend(read.features.iter().zip(&driven.features).map(|(read, driven)| (read - driven).abs()));
    }
    errors.sort_by(f32::total_cmp);
    // A spline through the heights and triangles between them differ at the edges of rocks, by centimetres.
    assert!(errors[errors.len() * 98 / 100] < 0.05, "{}", errors[errors.len() * 98 / 100]);
}

#[test]
fn ground_that_lies_elsewhere_or_is_not_known_is_refused() {
    let driven = run(&Request { time_limit_s: 6.0, ..request(1, 2) });
    let there = layers(&driven);
    let GridGeometry { resolution_m, n_rows, n_cols, .. } = *there.elevation_m.geometry();
    let far = GridGeometry { resolution_m, origin: [5000, 0], n_rows, n_cols };
    let elevation_m = GridMap::from_values(far, there.elevation_m.values().to_vec()).unwrap();
    let told = recorded(&driven, &WorldLayers { elevation_m, ..there.clone() }).err().unwrap().to_string();
    assert!(told.starts_with("elevation: ") && told.contains("overlaps"), "{told}");

    // Known in one corner only.
    let mut holes = there.clone();
    for (index, height_m) in holes.elevation_m.values_mut().iter_mut().enumerate() {
        *height_m = if index < 10 { *height_m } else { f32::NAN };
    }
    let told = recorded(&driven, &holes).err().unwrap().to_string();
    let n = driven.dataset.examples.len();
    assert!(
        told.starts_with(&format!("elevation: expected ground under at least half of the {n} ")),
        "{told}"
    );
    assert!(told.contains("found it under 0; it covers x 0.0 to 50.0, y 0.0 to 50.0 m"), "{told}");
}

#[test]
fn logs_that_say_nothing_are_refused() {
    let driven = run(&Request { time_limit_s: 6.0, ..request(1, 1) });
    let with = |log: DriveLog| {
        recorded(
            &Collection { log, ..run(&Request { time_limit_s: 6.0, ..request(1, 1) }) },
            &layers(&driven),
        )
    };
    let mut placeless = DriveLog::default();
    let mut uncommanded = DriveLog::default();
    for row in driven.log.runs().next().unwrap().drive_rows() {
        placeless.push("", &row.with(Column::X, if row.time_s > 0.0 { f64::NAN } else { 0.0 })).unwrap();
        uncommanded.push("", &row.with(Column::CmdSpeed, f64::NAN)).unwrap();
    }
    let told = with(placeless).err().unwrap().to_string();
    assert!(
        told.starts_with("log: expected a vehicle that moves or is told to, at finite poses, found none"),
        "{told}"
    );
    let told = with(uncommanded).err().unwrap().to_string();
    assert!(told.contains("expected the columns cmd_speed too, found only x, y"), "{told}");
}

#[test]
fn nothing_to_drive_is_refused() {
    let usual = request(1, 1);
    let wrong = [
        (Request { n_maps: 0, ..usual.clone() }, "maps: expected a finite number > 0, found 0"),
        (Request { n_trials: 0, ..usual.clone() }, "trials: expected a finite number > 0, found 0"),
        (
            Request { speed_mps: f64::NAN, ..usual.clone() },
            "speed_mps: expected a finite number > 0, found NaN",
        ),
        (Request { time_limit_s: -1.0, ..usual }, "time_limit_s: expected a finite number > 0, found -1"),
    ];
    for (request, message) in wrong {
        assert_eq!(collect(&request, || ()).err().unwrap().to_string(), message);
    }
    let mut level = request(1, 1);
    (level.vehicle.limits.roll_max_rad, level.vehicle.limits.pitch_max_rad) = (1e-7, 1e-7);
    let told = collect(&level, || ()).err().unwrap().to_string();
    assert_eq!(told, "map 0: expected a place where the vehicle can stand, found none in 1000 tries");
}
