//! The prior on a field of boulders, against the plant of `scenarios`, which stands where its tyres find no hold.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod surfaces;

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::{Command, Vehicle};
use physics_prior::{Assumption, PriorConfig, SlopeLaw};
use scenarios::{Plant, RockFieldConfig, RockMap, Split, Truth, World, rock_field};
use surfaces::{full_size, level, open, prior_map, surface};
use terrain::GridGeometry;

const N_DRIVES: usize = 30;
const SPEED_MPS: f32 = 1.0;

/// Poses of the plant, each in the middle of a second.
#[derive(Default)]
struct Driven {
    /// Where it stood, though it was told to drive.
    stood: Vec<[f64; 3]>,
    /// Where it came on with four fifths of its speed at least.
    rolled: Vec<[f64; 3]>,
}

/// Poses all over a map of 50 x 50 m from which the vehicle can set off, after Roberts' quasirandom sequence.
fn starts(truth: &Truth) -> impl Iterator<Item = [f64; 3]> {
    let poses = (1..).map(|k| {
        let [x, y, yaw] = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|share| (f64::from(k) * share).fract());
        [4.0 + 42.0 * x, 4.0 + 42.0 * y, TAU * yaw]
    });
    poses.filter(|&[x_m, y_m, yaw_rad]| {
        let there = truth.traversability(x_m, y_m, yaw_rad);
        there.linear_traction > 0.8 && there.roll_rad.abs().max(there.pitch_rad.abs()) < 0.15
    })
}

/// Straight on until it stands, leans too far, leaves the map or has driven 20 s.
fn drive(vehicle: &Vehicle, world: &Arc<World>, start: [f64; 3], driven: &mut Driven) {
    let mut plant = Plant::new(vehicle, Arc::clone(world), start).unwrap();
    plant.set_command(Command { speed_mps: SPEED_MPS, steering_rad: 0.0 }).unwrap();
    plant.advance(2.0);
    for _ in 0..18 {
        let before = plant.pose();
        plant.advance(0.5);
        let pose = plant.pose();
        plant.advance(0.5);
        let after = plant.pose();
        if plant.left_world() || after.roll_rad.abs().max(after.pitch_rad.abs()) > 0.5 {
            return;
        }
        let way_m = (after.x_m - before.x_m).hypot(after.y_m - before.y_m);
        let pose = [pose.x_m, pose.y_m, pose.yaw_rad];
        if way_m < 0.03 {
            return driven.stood.push(pose);
        }
        if way_m > 0.8 * f64::from(SPEED_MPS) {
            driven.rolled.push(pose);
        }
    }
}

/// Shares of the places where the plant stood, and of those where it rolled, of which the worst 0.6 expects less than a
/// tenth of the speed.
#[test]
fn where_the_plant_stands_next_to_nothing_is_expected() {
    let vehicle = full_size();
    let cells = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 250, n_cols: 250 };
    let (mut n_places, mut n_nothing) = ([0; 2], [[0; 2]; 2]);
    for index in 0..2 {
        let map = RockMap { seed: 2001, split: Split::Test, index };
        let world = Arc::new(rock_field(&RockFieldConfig::navigation(), map, &[]).unwrap());
        let truth = Truth::new(&vehicle, Arc::clone(&world));
        let mut driven = Driven::default();
        for start in starts(&truth).take(N_DRIVES) {
            drive(&vehicle, &world, start, &mut driven);
        }
        let ground = surface(cells, |x_m, y_m| open(world.height_m(x_m, y_m)));
        let kinds = [&driven.stood, &driven.rolled];
        for (kind, poses) in kinds.into_iter().enumerate() {
            n_places[kind] += poses.len();
        }
        for (law, slope_law) in [SlopeLaw::Linear {}, SlopeLaw::of(&vehicle)].into_iter().enumerate() {
            let prior = PriorConfig { slope_law, ..PriorConfig::for_vehicle(&vehicle.geometry) };
            let map =
                prior_map(&vehicle.geometry, &Assumption::Physics { prior, level: level(0.6) }, &ground, 1);
            let is_nothing = |[x_m, y_m, yaw_rad]: &[f64; 3]| {
                let belief = map.belief(*x_m, *y_m, *yaw_rad);
                belief.is_some_and(|belief| belief.risk(level(0.6)).linear_traction < 0.1)
            };
            for (kind, poses) in kinds.into_iter().enumerate() {
                n_nothing[law][kind] += poses.iter().filter(|pose| is_nothing(pose)).count();
            }
        }
    }
    assert!(n_places[0] > 20 && n_places[1] > 300, "{n_places:?}");
    for (law, [stood, rolled]) in n_nothing.into_iter().enumerate() {
        let told = format!("law {law}: {stood} of {} stood, {rolled} of {} rolled", n_places[0], n_places[1]);
        println!("{told}");
        assert!(10 * stood > 7 * n_places[0], "{told}");
        assert!(100 * rolled < 2 * n_places[1], "{told}");
    }
}
