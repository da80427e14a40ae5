//! People who walk about: upright cylinders that go where they want, whatever the vehicle does.

use std::f64::consts::TAU;

use bicycle::Geometry;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::Pose;

use crate::Task;
use crate::random::stream;

/// How fast a walker's velocity changes [m/s2].
const ACCELERATION_MPS2: f64 = 2.0;
/// Slowest and fastest walk [m/s].
const SPEED_MPS: [f64; 2] = [0.5, 2.0];
/// From where a crossing begins to the vehicle's way [m].
const APPROACH_M: [f64; 2] = [5.0, 9.0];
/// How much earlier and later than the vehicle a walker may come to its way [s].
const EARLY_S: f64 = 3.0;
/// Share of its top speed that the vehicle is expected to make.
const PACE: f64 = 0.85;
/// No walk leads farther beyond the vehicle's way than this [m].
const BEYOND_M: f64 = 9.0;

/// A part of a walk: a velocity for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stride {
    /// How long [s].
    pub duration_s: f64,
    /// East, north [m/s]; zero = stands.
    pub velocity_mps: [f64; 2],
}

/// A person on the way: an upright cylinder on the ground. Velocity changes by 2 m/s2; after the last stride it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Walker {
    position_m: [f64; 2],
    velocity_mps: [f64; 2],
    strides: Vec<Stride>,
    /// Stride under way, and how much of it is left [s].
    stride: usize,
    left_s: f64,
    /// -1 for who has turned round.
    sense: f64,
}

impl Walker {
    /// Of the cylinder [m].
    pub const RADIUS_M: f64 = 0.3;
    /// Of the cylinder [m].
    pub const HEIGHT_M: f64 = 1.7;

    /// Stands at a place, east, north [m], and is about to walk.
    pub fn new(position_m: [f64; 2], strides: Vec<Stride>) -> Self {
        let left_s = strides.first().map_or(0.0, |stride| stride.duration_s);
        Self { position_m, velocity_mps: [0.0; 2], strides, stride: 0, left_s, sense: 1.0 }
    }

    /// East, north of the centre [m].
    pub fn position_m(&self) -> [f64; 2] {
        self.position_m
    }

    /// East, north [m/s].
    pub fn velocity_mps(&self) -> [f64; 2] {
        self.velocity_mps
    }

    /// Lets time pass.
    pub fn advance(&mut self, time_s: f64) {
        let wanted_mps = self.wanted_mps();
        let change_mps = [0, 1].map(|axis| wanted_mps[axis] - self.velocity_mps[axis]);
        let step_mps = ACCELERATION_MPS2 * time_s;
        let share = (step_mps / change_mps[0].hypot(change_mps[1]).max(step_mps)).min(1.0);
        for (velocity_mps, change_mps) in self.velocity_mps.iter_mut().zip(change_mps) {
            *velocity_mps += share * change_mps;
        }
        self.position_m = [0, 1].map(|axis| self.position_m[axis] + time_s * self.velocity_mps[axis]);
        self.left_s -= time_s;
        while self.left_s <= 0.0 && self.stride < self.strides.len() {
            self.stride += 1;
            self.left_s += self.strides.get(self.stride).map_or(0.0, |stride| stride.duration_s);
        }
    }

    /// Turns on the spot and goes the other way from now on, as who comes up against something does.
    pub fn turn_round(&mut self) {
        self.sense = -self.sense;
        self.velocity_mps = [0.0; 2];
    }

    /// From the cylinder's side to a vehicle's body at a pose [m]; negative where they overlap. Both as seen from above.
    pub fn clearance_m(&self, geometry: &Geometry, pose: &Pose) -> f64 {
        clearance_m(geometry, [pose.x_m, pose.y_m, pose.yaw_rad], self.position_m)
    }

    fn wanted_mps(&self) -> [f64; 2] {
        let velocity_mps = self.strides.get(self.stride).map_or([0.0; 2], |stride| stride.velocity_mps);
        velocity_mps.map(|value_mps| self.sense * value_mps)
    }
}

/// From a walker at a place to a body at a pose, east, north [m], yaw [rad].
pub(crate) fn clearance_m(geometry: &Geometry, [x_m, y_m, yaw_rad]: [f64; 3], at_m: [f64; 2]) -> f64 {
    let (sin, cos) = yaw_rad.sin_cos();
    let [east_m, north_m] = [at_m[0] - x_m, at_m[1] - y_m];
    let (ahead_m, left_m) = (cos * east_m + sin * north_m, cos * north_m - sin * east_m);
    let half_m = [0.5 * geometry.length_m, 0.5 * geometry.width_m];
    let middle_m = half_m[0] - geometry.rear_overhang_m;
    let [beyond_m, beside_m] = [(ahead_m - middle_m).abs() - half_m[0], left_m.abs() - half_m[1]];
    let outside_m = beyond_m.max(0.0).hypot(beside_m.max(0.0));
    outside_m + beyond_m.max(beside_m).min(0.0) - Walker::RADIUS_M
}

impl Task {
    /// People who cross the straight way to the goal at about the time when a vehicle of this top speed comes by. The same
    /// seed gives the same people. One in three goes straight across, one stops on the way and goes on, one turns.
    pub fn crossing_walkers(&self, n: usize, speed_max_mps: f64, seed: u64) -> Vec<Walker> {
        (0..n as u64)
            .map(|number| self.crossing(speed_max_mps, &mut stream(seed, &[0x3A1C, number])))
            .collect()
    }

    fn crossing(&self, speed_max_mps: f64, random: &mut Xoshiro256PlusPlus) -> Walker {
        let [x_m, y_m, _] = self.start;
        let distance_m = self.distance_to_goal_m(x_m, y_m);
        let ahead = [0, 1].map(|axis| (self.goal_m[axis] - self.start[axis]) / distance_m.max(1e-9));
        let along_m = distance_m * random.random_range(0.2..0.85);
        let met_s = (along_m / (PACE * speed_max_mps) + random.random_range(-EARLY_S..EARLY_S)).max(0.0);
        let speed_mps = random.random_range(SPEED_MPS[0]..SPEED_MPS[1]);
        let approach_m = random.random_range(APPROACH_M[0]..APPROACH_M[1]);
        let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        // Across the way, give or take 30 degrees.
        let slant_rad = random.random_range(-TAU / 12.0..TAU / 12.0);
        let across = turned([ahead[1] * side, -ahead[0] * side], slant_rad);
        let meets_m = [x_m + along_m * ahead[0], y_m + along_m * ahead[1]];
        let from_m = [0, 1].map(|axis| meets_m[axis] - approach_m * across[axis]);
        let waits_s = (met_s - approach_m / speed_mps).max(0.0);
        let walk = across.map(|value| speed_mps * value);
        let mut strides = vec![Stride { duration_s: waits_s, velocity_mps: [0.0; 2] }];
        strides.extend(Self::manner(walk, (approach_m + BEYOND_M) / speed_mps, random));
        Walker::new(from_m, strides)
    }

    /// How somebody crosses who would take `whole_s` to do so straight.
    fn manner(walk_mps: [f64; 2], whole_s: f64, random: &mut Xoshiro256PlusPlus) -> Vec<Stride> {
        let first_s = whole_s * random.random_range(0.15..0.6);
        let straight = |duration_s| Stride { duration_s, velocity_mps: walk_mps };
        match random.random_range(0..3) {
            0 => vec![straight(whole_s)],
            1 => {
                let pause_s = random.random_range(1.0..4.0);
                let pause = Stride { duration_s: pause_s, velocity_mps: [0.0; 2] };
                vec![straight(first_s), pause, straight(whole_s - first_s)]
            }
            _ => {
                let turn_rad = random.random_range(-TAU / 4.0..TAU / 4.0);
                let velocity_mps = turned(walk_mps, turn_rad);
                vec![straight(first_s), Stride { duration_s: whole_s - first_s, velocity_mps }]
            }
        }
    }
}

fn turned([x, y]: [f64; 2], by_rad: f64) -> [f64; 2] {
    let (sin, cos) = by_rad.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_leads_where_its_strides_say_and_ends_standing() {
        let east = Stride { duration_s: 2.0, velocity_mps: [1.0, 0.0] };
        let pause = Stride { duration_s: 1.0, velocity_mps: [0.0; 2] };
        let north = Stride { duration_s: 3.0, velocity_mps: [0.0, 0.5] };
        let mut walker = Walker::new([1.0, 2.0], vec![pause, east, pause, north]);
        let mut places_m = Vec::new();
        for step in 0..2000 {
            if step % 200 == 0 {
                places_m.push(walker.position_m());
            }
            walker.advance(0.005);
        }
        assert_eq!(places_m[1], [1.0, 2.0], "waits a second");
        // Half a second to get going and half to stop: the way is that of the stride.
        assert!((places_m[4][0] - 3.0).abs() < 0.02, "{places_m:?}");
        assert!((places_m[9][1] - 3.5).abs() < 0.02 && places_m[9][0] == places_m[8][0], "{places_m:?}");
        assert_eq!(walker.velocity_mps(), [0.0; 2]);
    }

    #[test]
    fn who_turns_round_goes_back_the_way_he_came() {
        let mut walker = Walker::new([0.0; 2], vec![Stride { duration_s: 10.0, velocity_mps: [1.0, 0.5] }]);
        (0..400).for_each(|_| walker.advance(0.005));
        let there_m = walker.position_m();
        walker.turn_round();
        assert_eq!(walker.velocity_mps(), [0.0; 2]);
        (0..400).for_each(|_| walker.advance(0.005));
        assert!(walker.position_m()[0].abs() < 1e-9 && there_m[0] > 1.4, "{walker:?}");
    }

    /// Against a fine outline of points around the body.
    #[test]
    fn clearance_is_the_way_to_the_nearest_point_of_the_outline() {
        let geometry = Geometry {
            wheelbase_m: 2.5,
            track_m: 1.5,
            length_m: 3.4,
            width_m: 1.8,
            rear_overhang_m: 0.5,
            ground_clearance_m: 0.4,
            wheel_radius_m: 0.4,
        };
        let pose = Pose { x_m: 2.0, y_m: -1.0, yaw_rad: 0.7, ..Pose::default() };
        let motion = pose.isometry();
        let mut outline = Vec::new();
        for k in 0..=2000 {
            let share = f64::from(k) / 2000.0;
            let (ahead_m, left_m) = (-0.5 + 3.4 * share, -0.9 + 1.8 * share);
            outline.extend([[ahead_m, 0.9], [ahead_m, -0.9], [-0.5, left_m], [2.9, left_m]]);
        }
        let outline = outline.iter().map(|[a, b]| motion * nalgebra::Point3::new(*a, *b, 0.0));
        let outline: Vec<_> = outline.collect();
        for at_m in [[6.0, 3.0], [2.0, 3.0], [-1.0, -4.0], [4.5, -1.5], [1.0, -1.2]] {
            let distance_m = |p: &nalgebra::Point3<f64>| (p.x - at_m[0]).hypot(p.y - at_m[1]);
            let nearest_m = outline.iter().map(distance_m).fold(f64::INFINITY, f64::min);
            let walker = Walker::new(at_m, Vec::new());
            assert!((walker.clearance_m(&geometry, &pose) - (nearest_m - 0.3)).abs() < 2e-3, "{at_m:?}");
        }
        let inside = Walker::new([3.0, 0.0], Vec::new());
        assert!(inside.clearance_m(&geometry, &pose) < -0.3);
    }
}
