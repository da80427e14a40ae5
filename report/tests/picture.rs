//! Whole pages of drives that never happened, on worlds that ship with the project. The files stay in the target
//! folder, to be looked at.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use std::collections::BTreeMap;
use std::path::Path;

use bench::closed_loop::Method;
use bench::navigation::{DriveResult, Plan, Report, Request};
use bench::route::{Attempt, End, ExpertReport, Pair};
use bicycle::Vehicle;
use navigator::Areas;
use report::drive::{DrivePicture, PathSample, RiskLayer};
use scenarios::{
    ARENA_GOAL_M, ARENA_START, ArenaConfig, LandscapeKind, Outcome, RockFieldConfig, RockMap, Split, World,
    arena, rock_field,
};
use terrain::GridMap;
use traversability::CvarLevel;

fn vehicle(name: &str) -> Vehicle {
    formats::read_vehicle(name).expect("the vehicle ships")
}

/// Keeps a page to be looked at. Returns its width and height, from the header of the PNG file.
fn kept(name: &str, png: &[u8]) -> [u32; 2] {
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), png).expect("a folder to write to");
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes"));
    [number(16), number(20)]
}

/// Every frame of a task has the same size, wherever the vehicle has been by then.
#[test]
fn frames_of_a_task_show_the_same_part_of_the_world() {
    let world = arena(&ArenaConfig::default()).expect("the hall can be built");
    let goal = ARENA_GOAL_M;
    let path = swinging_path(&world, [ARENA_START[0], ARENA_START[1]], goal, 1.5, 1.0);
    let vehicle = vehicle("rc_car");
    let framed = |driven: &[PathSample], name: &str| {
        let picture = DrivePicture {
            title: "",
            subtitles: &[],
            world: &world,
            risk: None,
            known: None,
            unfamiliar: None,
            driven,
            walked: &[],
            planned: &[],
            areas: None,
            start_m: [ARENA_START[0], ARENA_START[1]],
            goal_m: goal,
            goal_radius_m: 0.3,
            failure: None,
            vehicle: &vehicle,
        };
        kept(name, &report::drive::frame(&picture, 640).expect("it encodes"))
    };
    let [width, height] = framed(&path[..1], "frame_first.png");
    assert_eq!(framed(&path, "frame_last.png"), [width, height]);
    assert!(width <= 640 && height <= 640 && width.max(height) == 640, "{width} x {height}");
}

/// A way from `start` to `goal` that swings to both sides, with the attitude that the ground gives.
fn swinging_path(
    world: &World,
    start: [f64; 2],
    goal: [f64; 2],
    swing_m: f64,
    speed_mps: f64,
) -> Vec<PathSample> {
    let [dx, dy] = [goal[0] - start[0], goal[1] - start[1]];
    let length_m = dx.hypot(dy);
    let along = [dx / length_m, dy / length_m];
    let n = 400;
    let place = |share: f64| {
        let side_m = swing_m * (share * 9.0).sin() * (share * std::f64::consts::PI).sin();
        let ahead_m = share * length_m;
        [start[0] + along[0] * ahead_m - along[1] * side_m, start[1] + along[1] * ahead_m + along[0] * side_m]
    };
    let mut time_s = 0.0;
    (0..n)
        .map(|i| {
            let share = f64::from(i) / f64::from(n);
            let [x_m, y_m] = place(share);
            let [next_x_m, next_y_m] = place(share + 0.5 / f64::from(n));
            let yaw_rad = (next_y_m - y_m).atan2(next_x_m - x_m);
            let [east, north] = world.gradient(x_m, y_m);
            let speed_mps = speed_mps * (1.0 - 0.5 * (share * 20.0).sin().powi(2));
            time_s += length_m / f64::from(n) / speed_mps;
            let roll_rad = (north * yaw_rad.cos() - east * yaw_rad.sin()).atan();
            let pitch_rad = -(east * yaw_rad.cos() + north * yaw_rad.sin()).atan();
            PathSample { time_s, x_m, y_m, yaw_rad, speed_mps, roll_rad, pitch_rad }
        })
        .collect()
}

/// Steepness as risk, known within `reach_m` of the path.
fn risk_near(world: &World, path: &[PathSample], reach_m: f64) -> (GridMap<f32>, GridMap<bool>) {
    let geometry = *world.geometry();
    let mut known = GridMap::filled(geometry, false);
    let mut risk = GridMap::filled(geometry, f32::NAN);
    for index in 0..geometry.n_cells() {
        let cell = geometry.cell(index);
        let [x_m, y_m] = geometry.centre_m(cell);
        if path.iter().step_by(8).any(|sample| (sample.x_m - x_m).hypot(sample.y_m - y_m) < reach_m) {
            let [east, north] = world.gradient(x_m, y_m);
            known[cell] = true;
            risk[cell] = (1.0 - east.hypot(north)).max(0.0) as f32;
        }
    }
    (risk, known)
}

#[test]
fn rock_field_with_everything_on_it() {
    let (start_m, goal_m) = ([5.0, 22.0], [45.0, 27.0]);
    let map = RockMap { seed: 1, split: Split::Test, index: 0 };
    let world = rock_field(&RockFieldConfig::default(), map, &[start_m, goal_m]).expect("a field");
    let vehicle = vehicle("pietra_full_size");
    let driven = swinging_path(&world, start_m, goal_m, 4.0, 1.0);
    let (risk, known) = risk_near(&world, &driven, 9.0);
    let areas = Areas {
        keep_out_m: vec![vec![[20.0, 12.0], [30.0, 12.0], [26.0, 18.0]]],
        geofence_m: vec![[2.0, 4.0], [48.0, 4.0], [48.0, 46.0], [2.0, 46.0]],
    };
    let picture = DrivePicture {
        title: "Goal reached in 52.4 s",
        subtitles: &["rocks, seed 1 · pietra_full_size · physics, alpha 0.6 · 44.1 m driven".to_owned()],
        world: &world,
        risk: Some(RiskLayer { values: &risk, label: "worst traction [-]", harmless: 1.0, worst: 0.0 }),
        known: Some(&known),
        unfamiliar: None,
        driven: &driven,
        planned: &[start_m, goal_m],
        walked: &[],
        areas: Some(&areas),
        start_m,
        goal_m,
        goal_radius_m: 1.0,
        failure: None,
        vehicle: &vehicle,
    };
    let size = kept("rock_field.png", &report::drive::picture(&picture).expect("a page"));
    let [width, height] = size;
    assert_eq!(width, 1600);
    assert!((900..1700).contains(&height), "{height}");
}

#[test]
fn arena_with_a_failure() {
    let world = arena(&ArenaConfig { bush_height_m: 0.3, ..ArenaConfig::default() }).expect("a hall");
    let vehicle = vehicle("rc_car");
    let start_m = [ARENA_START[0], ARENA_START[1]];
    let mut driven = swinging_path(&world, start_m, ARENA_GOAL_M, 1.0, 0.7);
    driven.truncate(230);
    let (risk, known) = risk_near(&world, &driven, 2.0);
    let picture = DrivePicture {
        title: "Stuck after 9.1 s, 4.0 m left",
        subtitles: &[
            "arena with bushes of 0.3 m · rc_car · nominal".to_owned(),
            "under 0.1 m in 5 s".to_owned(),
        ],
        world: &world,
        risk: Some(RiskLayer { values: &risk, label: "worst traction [-]", harmless: 1.0, worst: 0.0 }),
        known: Some(&known),
        unfamiliar: None,
        driven: &driven,
        planned: &[],
        walked: &[],
        areas: None,
        start_m,
        goal_m: ARENA_GOAL_M,
        goal_radius_m: 0.3,
        failure: Some("stuck"),
        vehicle: &vehicle,
    };
    let size = kept("arena.png", &report::drive::picture(&picture).expect("a page"));
    assert_eq!(size[0], 1600);
}

#[test]
fn drive_that_never_moved_still_has_a_map() {
    let world = arena(&ArenaConfig::default()).expect("a hall");
    let picture = DrivePicture {
        title: "Stopped before the start",
        subtitles: &[],
        world: &world,
        risk: None,
        known: None,
        unfamiliar: None,
        driven: &[],
        planned: &[],
        walked: &[],
        areas: None,
        start_m: [ARENA_START[0], ARENA_START[1]],
        goal_m: ARENA_GOAL_M,
        goal_radius_m: 0.3,
        failure: Some("stopped"),
        vehicle: &vehicle("rc_car"),
    };
    let size = kept("never_moved.png", &report::drive::picture(&picture).expect("a page"));
    assert_eq!(size[0], 1600);
}

/// A table in which every way to fail occurs, the more often the further down.
fn made_up_table(n_maps: u32) -> Report {
    let failures = [
        Outcome::Stuck,
        Outcome::Timeout,
        Outcome::AttitudeLimit,
        Outcome::Stopped,
        Outcome::RolledOver,
        Outcome::OutOfBounds,
    ];
    let rows = [
        (Method::Truth, None),
        (Method::Physics, Some(0.4)),
        (Method::Physics, Some(0.6)),
        (Method::Physics, Some(0.8)),
        (Method::Nominal, None),
    ];
    let drive = |row: usize, map: u32| {
        let draw = (map * 7 + row as u32 * 3) % 11;
        let outcome = if draw < 1 + 2 * row as u32 { failures[(draw % 6) as usize] } else { Outcome::Goal };
        DriveResult {
            method: rows[row].0.into(),
            alpha: rows[row].1,
            map,
            pair: 0,
            outcome,
            time_s: 41.0 + f64::from(draw),
            path_length_m: 44.0,
            distance_to_goal_m: 1.0,
            largest_roll_deg: 14.0,
            largest_pitch_deg: 15.0,
            longest_flight_s: 0.0,
            failed_at_m: (outcome != Outcome::Goal).then_some([20.0, 30.0]),
            stops: BTreeMap::new(),
            compute: None,
        }
    };
    let drives: Vec<_> = (0..5).flat_map(|row| (0..n_maps).map(move |map| drive(row, map))).collect();
    let request = Request {
        vehicle: "pietra_full_size".to_owned(),
        speed_mps: None,
        methods: vec![Method::Truth, Method::Physics, Method::Nominal],
        planners: Vec::new(),
        levels: [0.4, 0.6, 0.8].map(|level| CvarLevel::new(level).expect("a level")).into(),
        field: scenarios::RockFieldConfig::default(),
        seed: 1,
        n_maps,
        n_pairs: 1,
        time_limit_s: 120.0,
        isa: mppi::Isa::Portable,
        plant: scenarios::Engine::Rapier,
        settings: String::new(),
    };
    Plan::new(&request).expect("a plan").report(&drives)
}

#[test]
fn navigation_table_of_one_and_many_maps() {
    for n_maps in [1, 20, 200] {
        let png = report::navigation::picture(&made_up_table(n_maps)).expect("a page").png;
        let size = kept(&format!("navigation_{n_maps}.png"), &png);
        assert_eq!(size[0], 1600);
    }
}

#[test]
fn navigation_over_the_risk_tolerance_needs_two_of_them() {
    let mut table = made_up_table(20);
    let picture = report::navigation::picture_of_levels(&table).expect("a page").expect("three levels");
    assert_eq!(kept(picture.file, &picture.png)[0], 1600);
    table.rows.retain(|row| row.alpha.is_none_or(|alpha| alpha == 0.6));
    assert!(report::navigation::picture_of_levels(&table).expect("no page").is_none());
}

/// Ten tasks of each landscape, of which a drive of each kind ends early.
fn made_up_experts() -> ExpertReport {
    let attempt = |expected_s: f64, end: End| Attempt {
        planning_s: 0.1,
        length_m: 8.0 * expected_s,
        expected_s,
        end,
        time_s: if end == End::Goal { 1.07 * expected_s } else { 0.4 * expected_s },
    };
    let pair = |landscape: LandscapeKind, task: usize| {
        let ours_s = 20.0 + 3.0 * task as f64;
        let end = |n: usize| if task == n { End::Collision } else { End::Goal };
        let (ours, reference) = (attempt(ours_s, end(8)), attempt(0.92 * ours_s, end(3)));
        Pair { landscape, task, ours, reference }
    };
    let pairs = LandscapeKind::ALL.iter().flat_map(|kind| (0..10).map(|task| pair(*kind, task))).collect();
    ExpertReport { vehicle: "pietra_full_size".to_owned(), seed: 1, rows: Vec::new(), pairs }
}

#[test]
fn experts_with_and_without_tasks() {
    let full = made_up_experts();
    let empty = ExpertReport { pairs: Vec::new(), ..full.clone() };
    for (name, report) in [("experts.png", full), ("experts_empty.png", empty)] {
        let size = kept(name, &report::routes::experts_picture(&report).expect("a page"));
        assert_eq!(size[0], 1600);
    }
}
