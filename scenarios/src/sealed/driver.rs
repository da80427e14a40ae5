//! Who drives: commands at the rate of the log, held inside the hills.

use std::f64::consts::{PI, TAU};

use bicycle::Command;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::Pose;

use super::fleet::TestMachine;
use crate::random::stream;

/// How somebody drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Steps, ramps and sines of both commands, small and large.
    Rich,
    /// One speed, long gentle bends.
    Poor,
    /// From mark to mark, as one drives a course.
    Track,
}

impl Style {
    /// Its name, as labels have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rich => "rich",
            Self::Poor => "poor",
            Self::Track => "track",
        }
    }
}

/// Steering per heading error where somebody steers for a place [-].
const HOMING_GAIN: f64 = 1.2;
/// Distance from the middle, over half the side, beyond which one turns back, and within which that ends.
const TURN_BACK_SHARE: f64 = 0.66;
const BACK_SHARE: f64 = 0.5;
/// How many wheelbases before a mark it counts as reached.
const REACHED_WHEELBASES: f64 = 3.0;

/// What steering does until the next change.
#[derive(Clone, Copy, Debug)]
enum Steering {
    /// From one angle to another, then there.
    Ramp { from_rad: f64, to_rad: f64, duration_s: f64 },
    /// To and fro about an angle.
    Sine { middle_rad: f64, amplitude_rad: f64, radps: f64 },
}

/// A driver on a machine.
pub(super) struct Driver {
    style: Style,
    rng: Xoshiro256PlusPlus,
    speeds_mps: [f64; 2],
    steering_max_rad: f64,
    lateral_mps2: f64,
    wheelbase_m: f64,
    half_side_m: f64,
    speed_mps: f64,
    speed_until_s: f64,
    steering: Steering,
    steering_from_s: f64,
    steering_until_s: f64,
    mark_m: [f64; 2],
    is_turning_back: bool,
    steering_rad: f64,
}

impl Driver {
    /// Of a seed. `harder` multiplies the lateral acceleration that it dares.
    pub(super) fn new(machine: &TestMachine, style: Style, harder: f64, seed: u64) -> Self {
        let mut rng = stream(seed, &[0xD21E]);
        let lateral_mps2 = harder * rng.random_range(0.4..0.6) * machine.grip_mps2();
        let mut driver = Self {
            style,
            rng,
            speeds_mps: machine.speeds_mps,
            steering_max_rad: machine.steering_max_rad,
            lateral_mps2,
            wheelbase_m: machine.vehicle.geometry.wheelbase_m,
            half_side_m: machine.half_side_m(),
            speed_mps: 0.0,
            speed_until_s: 0.0,
            steering: Steering::Ramp { from_rad: 0.0, to_rad: 0.0, duration_s: 1.0 },
            steering_from_s: 0.0,
            steering_until_s: 0.0,
            mark_m: [0.0; 2],
            is_turning_back: false,
            steering_rad: 0.0,
        };
        driver.speed_mps = driver.next_speed_mps();
        driver.mark_m = driver.next_mark_m();
        driver
    }

    /// Where the drive begins.
    pub(super) fn start(&mut self) -> [f64; 3] {
        let [x_m, y_m] = [(); 2].map(|()| 0.3 * self.half_side_m * self.rng.random_range(-1.0..1.0));
        [x_m, y_m, self.rng.random_range(-PI..PI)]
    }

    /// The command from `time_s` on.
    pub(super) fn command(&mut self, time_s: f64, pose: &Pose) -> Command {
        if time_s >= self.speed_until_s {
            self.change_speed(time_s);
        }
        let most_rad = self.most_rad();
        let distance_share = pose.x_m.hypot(pose.y_m) / self.half_side_m;
        self.is_turning_back =
            distance_share > if self.is_turning_back { BACK_SHARE } else { TURN_BACK_SHARE };
        let wanted_rad = if self.is_turning_back {
            homing_rad(pose, [0.0; 2])
        } else {
            match self.style {
                Style::Track => self.course_rad(pose),
                Style::Rich | Style::Poor => self.free_rad(time_s),
            }
        };
        self.steering_rad = rounded(wanted_rad.clamp(-most_rad, most_rad));
        Command { speed_mps: rounded(self.speed_mps) as f32, steering_rad: self.steering_rad as f32 }
    }

    /// Largest angle at the speed that is commanded, by the lateral acceleration that it leads to.
    fn most_rad(&self) -> f64 {
        let curvature_per_m = self.lateral_mps2 / (self.speed_mps * self.speed_mps);
        (curvature_per_m * self.wheelbase_m).atan().min(self.steering_max_rad)
    }

    fn next_speed_mps(&mut self) -> f64 {
        let [slow_mps, fast_mps] = self.speeds_mps;
        match self.style {
            Style::Poor => 0.62 * fast_mps,
            Style::Rich | Style::Track => self.rng.random_range(slow_mps..fast_mps),
        }
    }

    fn change_speed(&mut self, time_s: f64) {
        // Steps of every size: often a small one, now and then across the whole range.
        let next_mps = self.next_speed_mps();
        let share = if self.rng.random_bool(0.35) { 0.3 } else { 1.0 };
        self.speed_mps += share * (next_mps - self.speed_mps);
        self.speed_until_s = time_s + self.rng.random_range(1.5..4.5);
    }

    fn course_rad(&mut self, pose: &Pose) -> f64 {
        let [x_m, y_m] = self.mark_m;
        if (x_m - pose.x_m).hypot(y_m - pose.y_m) < REACHED_WHEELBASES * self.wheelbase_m {
            self.mark_m = self.next_mark_m();
        }
        homing_rad(pose, self.mark_m)
    }

    fn next_mark_m(&mut self) -> [f64; 2] {
        let angle_rad = self.rng.random_range(0.0..TAU);
        let distance_m = TURN_BACK_SHARE * self.half_side_m * self.rng.random_range(0.0..1.0f64).sqrt();
        [distance_m * angle_rad.cos(), distance_m * angle_rad.sin()]
    }

    fn free_rad(&mut self, time_s: f64) -> f64 {
        if time_s >= self.steering_until_s {
            self.change_steering(time_s);
        }
        let since_s = time_s - self.steering_from_s;
        match self.steering {
            Steering::Ramp { from_rad, to_rad, duration_s } => {
                from_rad + (to_rad - from_rad) * (since_s / duration_s).min(1.0)
            }
            Steering::Sine { middle_rad, amplitude_rad, radps } => {
                middle_rad + amplitude_rad * (radps * since_s).sin()
            }
        }
    }

    fn change_steering(&mut self, time_s: f64) {
        let most_rad = self.most_rad();
        let rng = &mut self.rng;
        let from_rad = self.steering_rad;
        let (steering, held_s) = if self.style == Style::Poor {
            let to_rad = 0.25 * most_rad * rng.random_range(-1.0..1.0);
            (Steering::Ramp { from_rad, to_rad, duration_s: 4.0 }, rng.random_range(4.0..8.0))
        } else {
            let to_rad = most_rad * rng.random_range(-1.0..1.0);
            match rng.random_range(0..4) {
                0 => (Steering::Ramp { from_rad, to_rad, duration_s: 0.02 }, rng.random_range(0.8..3.0)),
                1 => (
                    Steering::Ramp { from_rad, to_rad: 0.2 * to_rad, duration_s: 0.02 },
                    rng.random_range(0.6..1.5),
                ),
                2 => (
                    Steering::Ramp { from_rad, to_rad, duration_s: rng.random_range(0.4..1.5) },
                    rng.random_range(1.0..3.0),
                ),
                _ => {
                    let radps = TAU * rng.random_range(0.25..1.1);
                    let amplitude_rad = most_rad * rng.random_range(0.15..0.9);
                    (
                        Steering::Sine { middle_rad: 0.2 * to_rad, amplitude_rad, radps },
                        rng.random_range(1.5..4.0),
                    )
                }
            }
        };
        self.steering = steering;
        self.steering_from_s = time_s;
        self.steering_until_s = time_s + held_s;
    }
}

/// As the log has it, so that nobody reads another command than the one that was given.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn homing_rad(pose: &Pose, to_m: [f64; 2]) -> f64 {
    let bearing_rad = (to_m[1] - pose.y_m).atan2(to_m[0] - pose.x_m);
    let error_rad = (bearing_rad - pose.yaw_rad + PI).rem_euclid(TAU) - PI;
    HOMING_GAIN * error_rad
}
