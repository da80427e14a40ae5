//! The course: a slalom whose speed changes from stretch to stretch, as hard as the undeviating plant can follow well.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use scenarios::TestMachine;

use super::gap::friction;

const GRAVITY_MPS2: f64 = 9.81;
/// Speeds of slow and fast stretches over the machine's fastest command [-].
const SPEED_SHARES: [f64; 2] = [0.45, 0.75];
/// Lateral acceleration at the bends' sharpest points in the fast stretches, over the ground's grip [-].
const GRIP_SHARE: f64 = 0.45;
/// Lengths in wheelbases: of a wave, of the course, of a stretch, between corners of the polyline.
const WAVE: f64 = 10.0;
const COURSE: f64 = 40.0;
const STRETCH: f64 = 8.0;
const SPACING: f64 = 0.1;
/// Distance from the course beyond which it is lost, in vehicle lengths.
const CORRIDOR: f64 = 0.75;

/// A way to follow.
#[derive(Clone, Debug)]
pub(super) struct Course {
    pub points_m: Vec<[f64; 2]>,
    /// Along the polyline to each corner [m].
    passed_m: Vec<f64>,
    /// Of slow and fast stretches [m/s].
    speeds_mps: [f64; 2],
    stretch_m: f64,
    /// Half of its width [m].
    pub corridor_m: f64,
    /// Distance from the end that counts as there [m].
    pub tolerance_m: f64,
}

impl Course {
    /// Through the middle of the machine's hills; heading and side of the first bend belong to the seed.
    pub fn draw(machine: &TestMachine, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let wheelbase_m = machine.vehicle.geometry.wheelbase_m;
        let [wave_m, length_m] = [WAVE, COURSE].map(|lengths| lengths * wheelbase_m);
        let heading_rad = rng.random_range(0.0..TAU);
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let speeds_mps = SPEED_SHARES.map(|share| share * machine.speeds_mps[1]);
        let curvature_per_m = GRIP_SHARE * friction(machine) * GRAVITY_MPS2 / (speeds_mps[1] * speeds_mps[1]);
        let amplitude_m = side * curvature_per_m * (wave_m / TAU).powi(2);
        let (sine, cosine) = heading_rad.sin_cos();
        let n = (length_m / (SPACING * wheelbase_m)).ceil() as usize;
        let point = |k: usize| {
            let ahead_m = k as f64 * SPACING * wheelbase_m;
            // The first wave grows, so that the course begins straight on.
            let grown = (ahead_m / wave_m).min(1.0);
            let left_m = grown * amplitude_m * (TAU * ahead_m / wave_m).sin();
            let from_middle_m = ahead_m - 0.5 * length_m;
            [from_middle_m * cosine - left_m * sine, from_middle_m * sine + left_m * cosine]
        };
        let points_m: Vec<[f64; 2]> = (0..=n).map(point).collect();
        let passed_m = passed_m(&points_m);
        Self {
            points_m,
            passed_m,
            speeds_mps,
            stretch_m: STRETCH * wheelbase_m,
            corridor_m: CORRIDOR * machine.vehicle.geometry.length_m,
            tolerance_m: wheelbase_m,
        }
    }

    /// First point and heading.
    pub fn start(&self) -> [f64; 3] {
        let [[x_m, y_m], [next_x_m, next_y_m]] = [self.points_m[0], self.points_m[1]];
        [x_m, y_m, (next_y_m - y_m).atan2(next_x_m - x_m)]
    }

    /// Length of the way [m].
    pub fn length_m(&self) -> f64 {
        self.passed_m[self.passed_m.len() - 1]
    }

    /// Speed to hold this far along the way [m/s].
    pub fn speed_mps(&self, along_m: f64) -> f64 {
        let stretch = (along_m / self.stretch_m).max(0.0) as usize;
        // Slow first: the start is no test of speed.
        self.speeds_mps[stretch % 2]
    }

    /// Seconds that the way takes at the speeds to hold.
    pub fn duration_s(&self) -> f64 {
        let pieces = self.passed_m.windows(2);
        pieces.map(|ends| (ends[1] - ends[0]) / self.speed_mps(0.5 * (ends[0] + ends[1]))).sum()
    }

    /// Along the way to the nearest point of it, and how far that is [m]. Only the stretch around `along_m` is looked
    /// at, so that progress never leaps.
    pub fn nearest(&self, at_m: [f64; 2], along_m: f64) -> (f64, f64) {
        let reach_m = self.stretch_m;
        let near = |k: &usize| (self.passed_m[*k] - along_m).abs() < reach_m;
        let foot = |k: usize| {
            let ([ax, ay], [bx, by]) = (self.points_m[k], self.points_m[k + 1]);
            let length_m = self.passed_m[k + 1] - self.passed_m[k];
            let (ux, uy) = ((bx - ax) / length_m, (by - ay) / length_m);
            let foot_m = ((at_m[0] - ax) * ux + (at_m[1] - ay) * uy).clamp(0.0, length_m);
            let away_m = (at_m[0] - ax - foot_m * ux).hypot(at_m[1] - ay - foot_m * uy);
            (self.passed_m[k] + foot_m, away_m)
        };
        let feet = (0..self.points_m.len() - 1).filter(near).map(foot);
        feet.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((along_m, f64::INFINITY))
    }
}

fn passed_m(points_m: &[[f64; 2]]) -> Vec<f64> {
    let mut passed_m = 0.0;
    let mut all = vec![0.0];
    for ends in points_m.windows(2) {
        passed_m += (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
        all.push(passed_m);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course() -> (TestMachine, Course) {
        let base = formats::read_vehicle("pietra_full_size").unwrap();
        let machine = TestMachine::draw(&base, "v", 1).unwrap();
        let course = Course::draw(&machine, 5);
        (machine, course)
    }

    #[test]
    fn bends_ask_for_the_stated_share_of_the_grip() {
        let (machine, course) = course();
        let most_per_m = course
            .points_m
            .windows(3)
            .map(|three| {
                // Menger curvature: four times the area over the product of the sides.
                let [[ax, ay], [bx, by], [cx, cy]] = [three[0], three[1], three[2]];
                let twice_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
                let sides = (bx - ax).hypot(by - ay) * (cx - bx).hypot(cy - by) * (cx - ax).hypot(cy - ay);
                2.0 * twice_area.abs() / sides
            })
            .fold(0.0, f64::max);
        let asked_mps2 = most_per_m * course.speeds_mps[1].powi(2);
        let expected_mps2 = 0.45 * friction(&machine) * 9.81;
        assert!((asked_mps2 / expected_mps2 - 1.0).abs() < 0.05, "{asked_mps2} {expected_mps2}");
    }

    #[test]
    fn progress_and_distance_are_those_of_a_shifted_point() {
        let (_, course) = course();
        let k = 150;
        let ([ax, ay], [bx, by]) = (course.points_m[k], course.points_m[k + 1]);
        let (dx, dy) = ((bx - ax) / (bx - ax).hypot(by - ay), (by - ay) / (bx - ax).hypot(by - ay));
        let middle = [0.5 * (ax + bx) - 0.3 * dy, 0.5 * (ay + by) + 0.3 * dx];
        let expected_m = 0.5 * (course.passed_m[k] + course.passed_m[k + 1]);
        let (along_m, away_m) = course.nearest(middle, expected_m - 1.0);
        assert!((along_m - expected_m).abs() < 0.1 && (away_m - 0.3).abs() < 0.01, "{along_m} {away_m}");
    }

    #[test]
    fn it_stays_on_the_hills_and_takes_as_long_as_its_stretches() {
        let (machine, course) = course();
        let half_m = machine.half_side_m();
        assert!(course.points_m.iter().flatten().all(|value| value.abs() < 0.9 * half_m));
        let [slow_mps, fast_mps] = course.speeds_mps;
        let (least_s, most_s) = (course.length_m() / fast_mps, course.length_m() / slow_mps);
        assert!((least_s..most_s).contains(&course.duration_s()));
        assert_eq!(course.speed_mps(-1.0), slow_mps);
        assert_eq!(course.speed_mps(1.5 * course.stretch_m), fast_mps);
    }
}
