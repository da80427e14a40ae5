//! A range sensor over a height function, written apart from everything under test.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{Pose, RangePoint, Scan, TerrainClass};

/// 64 beams from +10 to -30 degrees, `n_azimuths` around; height of the sensor above the body frame.
pub struct Lidar {
    pub n_azimuths: usize,
    pub height_m: f64,
    pub range_m: f64,
    pub noise_m: f64,
    random: Xoshiro256PlusPlus,
}

impl Lidar {
    pub fn new(n_azimuths: usize, noise_m: f64) -> Self {
        let random = Xoshiro256PlusPlus::seed_from_u64(7);
        Self { n_azimuths, height_m: 1.5, range_m: 12.0, noise_m, random }
    }

    /// One sweep over `height_m(x, y)` from a pose without roll and pitch.
    pub fn scan(
        &mut self,
        pose: &Pose,
        valid_at_ns: u64,
        height_m: impl Fn(f64, f64) -> f64,
        class: impl Fn(f64, f64, f64) -> TerrainClass,
    ) -> Scan {
        assert_eq!((pose.roll_rad, pose.pitch_rad), (0.0, 0.0));
        let mut points = Vec::new();
        let noise = Normal::new(0.0, self.noise_m).unwrap();
        let turn = self.random.random_range(0.0..1.0);
        for azimuth in 0..self.n_azimuths {
            let yaw_rad = (azimuth as f64 + turn) * std::f64::consts::TAU / self.n_azimuths as f64;
            for beam in 0..64 {
                let down_rad = (30.0 - 40.0 * beam as f64 / 63.0_f64).to_radians();
                let ray = [
                    down_rad.cos() * (pose.yaw_rad + yaw_rad).cos(),
                    down_rad.cos() * (pose.yaw_rad + yaw_rad).sin(),
                    -down_rad.sin(),
                ];
                let start = [pose.x_m, pose.y_m, pose.z_m + self.height_m];
                let Some(range_m) = first_hit(&start, &ray, self.range_m, &height_m) else { continue };
                let hit = [0, 1, 2].map(|i| start[i] + range_m * ray[i]);
                let noisy_m = range_m + noise.sample(&mut self.random);
                let flat_m = noisy_m * down_rad.cos();
                points.push(RangePoint {
                    position_m: [
                        (flat_m * yaw_rad.cos()) as f32,
                        (flat_m * yaw_rad.sin()) as f32,
                        (self.height_m - noisy_m * down_rad.sin()) as f32,
                    ],
                    class: class(hit[0], hit[1], hit[2]),
                });
            }
        }
        Scan { valid_at_ns, origin_m: [0.0, 0.0, self.height_m as f32], points }
    }
}

/// Marches in steps of 4 cm, then halves the last one.
fn first_hit(
    start: &[f64; 3],
    ray: &[f64; 3],
    range_m: f64,
    height_m: &impl Fn(f64, f64) -> f64,
) -> Option<f64> {
    let above = |r: f64| start[2] + r * ray[2] - height_m(start[0] + r * ray[0], start[1] + r * ray[1]);
    let step_m = 0.04;
    let last = (range_m / step_m) as usize;
    let hit = (1..last).find(|&i| above(i as f64 * step_m) <= 0.0)?;
    let (mut near, mut far) = ((hit - 1) as f64 * step_m, hit as f64 * step_m);
    for _ in 0..20 {
        let middle = 0.5 * (near + far);
        if above(middle) > 0.0 { near = middle } else { far = middle }
    }
    Some(far)
}

/// A level pose whose body frame lies on the ground.
pub fn pose_at(x_m: f64, y_m: f64) -> Pose {
    Pose { x_m, y_m, ..Pose::default() }
}
