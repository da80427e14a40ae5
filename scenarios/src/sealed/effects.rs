//! Effects that have a name, each made by the machine's own parts, in three sizes.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::fleet::TestMachine;
use super::{Made, Magnitude};
use crate::Deviation;
use crate::plant::{AIR_KGPM3, GRAVITY_MPS2, LIMITED_SLIP_S_PER_M};

/// Their ids, which are the catalogue's.
pub const EFFECTS: [&str; 24] = [
    "steer_lag",
    "steer_rate",
    "steer_delay",
    "steer_bias",
    "steer_gain",
    "backlash",
    "understeer",
    "friction",
    "speed_lag",
    "speed_delay",
    "accel_limit",
    "speed_scale",
    "motor_deadband",
    "rolling_drag",
    "quad_drag",
    "veg_drag",
    "slope_gravity",
    "cross_slope",
    "wind",
    "mass",
    "pose_latency",
    "odom_scale",
    "gyro_bias",
    "yaw_misalign",
];
/// Where the groups of [`EFFECTS`] end: steering, tyres, motor, forces, sensors.
const GROUP_ENDS: [usize; 5] = [6, 8, 13, 20, 24];
/// Sizes are spread by this share either way.
const SPREAD: f64 = 0.12;

/// The part of the machine in which an effect arises.
pub(super) fn group(id: &str) -> usize {
    let index = EFFECTS.iter().position(|effect| *effect == id).unwrap_or(0);
    GROUP_ENDS.iter().position(|end| index < *end).unwrap_or(0)
}

/// Numbers and departures of an effect of a size on a machine.
pub(super) fn make(
    id: &str,
    magnitude: Magnitude,
    machine: &TestMachine,
    rng: &mut Xoshiro256PlusPlus,
) -> Made {
    let spread = rng.random_range(1.0 - SPREAD..1.0 + SPREAD);
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let of = |sizes: [f64; 3]| sizes[magnitude as usize] * spread;
    match group(id) {
        0 => steering(id, of, sign, machine),
        1 => tyres(id, of, sign, machine),
        2 => motor(id, of, sign, machine),
        3 => forces(id, of, machine, rng),
        _ => sensors(id, of, sign),
    }
}

fn steering(id: &str, of: impl Fn([f64; 3]) -> f64, sign: f64, machine: &TestMachine) -> Made {
    match id {
        "steer_lag" => {
            let added_s = of([0.1, 0.2, 0.35]);
            Made::new("st_lag", added_s, Deviation::SteeringResponse { added_s })
        }
        "steer_rate" => {
            let own_radps = machine.vehicle.limits.steering_rate_max_radps;
            let rate_radps = of([0.7, 0.45, 0.3]) * (own_radps / 0.8).min(1.0);
            Made::new("st_rate", rate_radps, Deviation::SteeringRate { rate_radps })
        }
        "steer_delay" => {
            let added_s = of([0.08, 0.14, 0.22]);
            Made::new("st_delay", added_s, Deviation::SteeringDelay { added_s })
        }
        "steer_bias" => {
            let angle_rad = sign * of([0.018, 0.035, 0.06]);
            Made::new("st_bias", angle_rad, Deviation::SteeringTrim { angle_rad })
        }
        "steer_gain" => {
            let ratio = 1.0 + sign * of([0.08, 0.12, 0.2]);
            Made::new("st_gain", ratio, Deviation::SteeringRatio { left: ratio, right: ratio })
        }
        _ => {
            let half_width_rad = of([0.02, 0.035, 0.055]);
            Made::new("st_backlash", half_width_rad, Deviation::SteeringPlay { half_width_rad })
        }
    }
}

fn tyres(id: &str, of: impl Fn([f64; 3]) -> f64, sign: f64, machine: &TestMachine) -> Made {
    if id == "friction" {
        let factor = of([0.62, 0.5, 0.4]);
        return Made::new("mu", factor * machine.friction(), Deviation::TyreGrip { factor });
    }
    let fast_mps = machine.speeds_mps[1];
    let gradient_s2_per_m2 = of([0.2, 0.35, 0.6]) / (fast_mps * fast_mps);
    let wheelbase_m = machine.vehicle.geometry.wheelbase_m;
    let stiffness = machine.vehicle.tyre.slip_stiffness;
    if sign > 0.0 {
        // The axle gives way under m v^2 kappa and under the moment that the differentials, which yield in series with
        // the tyres, put on the front axle.
        let usual_mps = 0.6 * fast_mps;
        let coupling_s_per_m = 1.0 / (1.0 / LIMITED_SLIP_S_PER_M + usual_mps / stiffness);
        let half_track_m = 0.5 * machine.vehicle.geometry.track_m;
        let differentials_kg = coupling_s_per_m * machine.mass_kg() * GRAVITY_MPS2 * half_track_m.powi(2)
            / (wheelbase_m * usual_mps);
        let rad_per_n = gradient_s2_per_m2 * wheelbase_m / (machine.front_kg() + differentials_kg);
        Made::new("st_uspeed", gradient_s2_per_m2, Deviation::SteeringCompliance { rad_per_n })
    } else {
        // kappa v^2 / (g C) (1 / f - 1) is lost to the slip angle of the front tyres.
        let lost = gradient_s2_per_m2 * wheelbase_m * GRAVITY_MPS2 * stiffness;
        let front = 1.0 / (1.0 + lost);
        Made::new("front_tyre_stiffness", front, Deviation::TyreStiffness { front, rear: 1.0 })
    }
}

fn motor(id: &str, of: impl Fn([f64; 3]) -> f64, sign: f64, machine: &TestMachine) -> Made {
    let fast_mps = machine.speeds_mps[1];
    match id {
        "speed_lag" => {
            // A slower motor without an integral also yields more to every force, as a heavier machine does: there the
            // throttle is smoothed instead.
            let added_s = of([0.25, 0.5, 0.9]);
            let slower = match machine.peculiarities.contains(&Deviation::MotorDroop) {
                true => Deviation::ThrottleSmoothing { time_s: added_s },
                false => Deviation::MotorResponse { added_s },
            };
            Made::new("v_lag", added_s, slower)
        }
        "speed_delay" => {
            let added_s = of([0.14, 0.25, 0.4]);
            Made::new("v_delay", added_s, Deviation::MotorDelay { added_s })
        }
        "accel_limit" => {
            let acceleration_mps2 = machine.vehicle.limits.acceleration_max_mps2 * of([0.45, 0.3, 0.18]);
            Made::new("v_acc", acceleration_mps2, Deviation::MotorRamp { acceleration_mps2 })
        }
        "speed_scale" => {
            let factor = 1.0 + sign * of([0.04, 0.08, 0.13]);
            Made::new("v_scale", factor, Deviation::WheelRadius { factor })
        }
        _ => {
            let speed_mps = of([0.38, 0.45, 0.52]) * fast_mps;
            Made::new("v_deadband", speed_mps, Deviation::MotorDeadBand { speed_mps })
        }
    }
}

fn forces(
    id: &str,
    of: impl Fn([f64; 3]) -> f64,
    machine: &TestMachine,
    rng: &mut Xoshiro256PlusPlus,
) -> Made {
    let (mass_kg, fast_mps) = (machine.mass_kg(), machine.speeds_mps[1]);
    match id {
        "rolling_drag" => {
            let drag_mps2 = of([0.6, 1.0, 1.6]);
            let added = drag_mps2 / GRAVITY_MPS2;
            Made::new("drag_c", drag_mps2, Deviation::RollingResistance { added })
        }
        "quad_drag" => {
            let per_m = of([1.0, 2.0, 3.0]) / (fast_mps * fast_mps);
            Made::new("drag_q", per_m, Deviation::DragArea { area_m2: 2.0 * mass_kg * per_m / AIR_KGPM3 })
        }
        "veg_drag" => {
            let drag_mps2 = of([0.8, 1.4, 2.2]);
            let factor = 1.0 + drag_mps2 / machine.vegetation_mps2();
            Made::new("patch_drag", drag_mps2, Deviation::DenseVegetation { factor })
        }
        "slope_gravity" => {
            let along = of([0.5, 0.8, 1.2]);
            Made::new("slope", along, Deviation::SlopePull { along, across: 0.0 })
        }
        "cross_slope" => {
            let across = of([0.6, 1.0, 1.4]);
            Made::new("cross", across, Deviation::SlopePull { along: 0.0, across })
        }
        "wind" => {
            let (push_mps2, heading_rad) = (of([0.5, 0.8, 1.2]), rng.random_range(0.0..TAU));
            let [east_mps2, north_mps2] = [push_mps2 * heading_rad.cos(), push_mps2 * heading_rad.sin()];
            let force_n = [east_mps2 * mass_kg, north_mps2 * mass_kg];
            Made::new("wind_east", east_mps2, Deviation::Wind { force_n }).with("wind_north", north_mps2)
        }
        _ => {
            let factor = 1.0 + of([0.35, 0.6, 0.9]);
            Made::new("mass", factor, Deviation::Mass { factor })
        }
    }
}

fn sensors(id: &str, of: impl Fn([f64; 3]) -> f64, sign: f64) -> Made {
    match id {
        "pose_latency" => {
            let delay_s = of([0.06, 0.12, 0.2]);
            Made::new("pose_latency", delay_s, Deviation::PoseLatency { delay_s })
        }
        "odom_scale" => {
            let factor = 1.0 + sign * of([0.03, 0.05, 0.1]);
            Made::new("odom_scale", factor, Deviation::OdometryScale { factor })
        }
        "gyro_bias" => {
            let rate_radps = sign * of([0.012, 0.025, 0.04]);
            Made::new("gyro_bias", rate_radps, Deviation::GyroBias { rate_radps })
        }
        _ => {
            let angle_rad = sign * of([0.02, 0.04, 0.07]);
            Made::new("yaw_misalign", angle_rad, Deviation::YawMisalignment { angle_rad })
        }
    }
}
