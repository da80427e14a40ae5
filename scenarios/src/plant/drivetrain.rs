//! Speed servo, motor, differentials and brakes.

use bicycle::{Differential, Vehicle};

use super::rest::{Rest, Stance};
use crate::Deviation;

/// Torque between a wheel and the mean of the driven wheels, per difference of circumferential speed, over the
/// wheel's load: how tight limited-slip differentials are [s/m].
pub(crate) const LIMITED_SLIP_S_PER_M: f64 = 0.25;
/// Time the servo adds to the motor's response [s].
const SERVO_TIME_S: f64 = 0.08;
/// The integral's time over the servo's [-].
const INTEGRAL_RATIO: f64 = 4.0;
/// Below this commanded speed the parking brake is set when the wheels stand still [m/s].
const PARKING_SPEED_MPS: f64 = 1e-3;
/// Wheel speed below which the parking brake is set [m/s].
const STANDSTILL_MPS: f64 = 0.05;
/// Wheels below this share of the fastest one's speed count as locking while the brakes are on; in a turn as tight as
/// they come the inner rear wheel rolls at a little less [-].
const LOCKING_SHARE: f64 = 0.7;
/// A battery gives at least this share of its voltage [-].
const VOLTAGE_MIN: f64 = 0.2;

/// Torques on one wheel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WheelTorque {
    /// Along the rolling direction [N m].
    pub drive_nm: f64,
    /// Largest magnitude against the wheel's turning relative to the body [N m].
    pub brake_nm: f64,
}

/// Holds the commanded speed.
pub(crate) struct Drivetrain {
    mass_kg: f64,
    radius_m: f64,
    drive_max_nm: f64,
    brake_max_nm: f64,
    power_max_w: f64,
    acceleration_max_mps2: f64,
    response_s: f64,
    /// Share of the drive torque on each wheel.
    drive_share: [f64; 4],
    /// Share of the brake torque on each wheel.
    brake_share: [f64; 4],
    /// Torque between a driven wheel and their mean per difference of turning; infinite where they are locked [N m s].
    differential_nms: f64,
    /// The commanded speed, ramped.
    reference_mps: f64,
    /// The reference as the motor's response lets the vehicle follow it.
    expected_mps: f64,
    integral_n: f64,
    drive_nm: f64,
    brake_nm: f64,
    /// Growth of the integral over what the servo is tuned to [-].
    integral_share: f64,
    dead_band_mps: f64,
    smoothing_s: f64,
    /// The command behind the smoothing.
    smoothed_mps: f64,
    sag_per_s: f64,
    /// Voltage of the battery over that at the start [-].
    voltage: f64,
}

impl Drivetrain {
    /// For a vehicle at rest as its description has it: that is what the servo is tuned to.
    pub(crate) fn new(vehicle: &Vehicle, rest: &Rest, stance: &Stance) -> Self {
        let rear = vehicle.drivetrain.rear_share;
        let brake_rear = rest.load_n[2] / (rest.load_n[0] + rest.load_n[2]);
        let pairs = |rear: f64| [0.5 * (1.0 - rear), 0.5 * (1.0 - rear), 0.5 * rear, 0.5 * rear];
        let radius_m = stance.rolling_radius_m;
        let mean_load_n = 0.25 * rest.mass_kg * super::GRAVITY_MPS2;
        Self {
            mass_kg: rest.mass_kg,
            radius_m,
            drive_max_nm: vehicle.drivetrain.drive_torque_max_nm,
            brake_max_nm: vehicle.drivetrain.brake_torque_max_nm,
            power_max_w: vehicle.drivetrain.power_max_w,
            acceleration_max_mps2: vehicle.limits.acceleration_max_mps2,
            response_s: vehicle.drivetrain.response_s,
            drive_share: pairs(rear),
            brake_share: pairs(brake_rear),
            differential_nms: match vehicle.drivetrain.differential {
                Differential::Open => 0.0,
                Differential::LimitedSlip => LIMITED_SLIP_S_PER_M * mean_load_n * radius_m * radius_m,
                Differential::Locked => f64::INFINITY,
            },
            reference_mps: 0.0,
            expected_mps: 0.0,
            integral_n: 0.0,
            drive_nm: 0.0,
            brake_nm: 0.0,
            integral_share: 1.0,
            dead_band_mps: 0.0,
            smoothing_s: 0.0,
            smoothed_mps: 0.0,
            sag_per_s: 0.0,
            voltage: 1.0,
        }
    }

    /// The same with a controller and a battery that depart from it.
    pub(crate) fn deviating(mut self, deviations: &[Deviation]) -> Self {
        for deviation in deviations {
            match *deviation {
                Deviation::MotorDroop => self.integral_share = 0.0,
                Deviation::MotorDeadBand { speed_mps } => self.dead_band_mps += speed_mps,
                Deviation::ThrottleSmoothing { time_s } => self.smoothing_s += time_s,
                Deviation::BatterySag { per_s } => self.sag_per_s += per_s,
                _ => {}
            }
        }
        self
    }

    /// Torques of motor and brakes for wheels that turn at `spin_radps` relative to the body.
    pub(crate) fn step(&mut self, commanded_mps: f64, spin_radps: [f64; 4], step_s: f64) -> [WheelTorque; 4] {
        let rolling_radps = self.rolling_radps(&spin_radps);
        let understood_mps = self.understood_mps(commanded_mps, step_s);
        let (drive_nm, brake_nm) = self.servo(understood_mps, rolling_radps, step_s);
        let share = step_s / (self.response_s + step_s);
        self.drive_nm += share * (drive_nm - self.drive_nm);
        // Brakes let go at once: else the motor starts against them.
        self.brake_nm += if brake_nm < self.brake_nm { 1.0 } else { share } * (brake_nm - self.brake_nm);
        std::array::from_fn(|i| WheelTorque {
            drive_nm: self.drive_nm * self.drive_share[i],
            brake_nm: self.brake_nm * self.brake_share[i],
        })
    }

    /// Torques of the differentials on wheels that turn at `spin_radps` and have these inertias; their sum is zero.
    ///
    /// Implicit: with J a wheel's inertia and k the differentials' torque per speed, the wheel ends the step at
    /// w' = w + k (m - w') dt / J, where m is the mean of all w'. Solved, m is the mean of w weighted by
    /// 1 / (1 / J + 1 / (k dt)), and the torque is that weight times (m - w) / dt: for locked wheels, whose k is
    /// infinite, too.
    pub(crate) fn coupling_nm(&self, spin_radps: [f64; 4], inertia_kgm2: [f64; 4], step_s: f64) -> [f64; 4] {
        if self.differential_nms == 0.0 {
            return [0.0; 4];
        }
        let slack = 1.0 / (self.differential_nms * step_s);
        let weight: [f64; 4] = std::array::from_fn(|i| match self.drive_share[i] > 0.0 {
            true => 1.0 / (1.0 / inertia_kgm2[i] + slack),
            false => 0.0,
        });
        let sum = |value: [f64; 4]| (0..4).map(|i| weight[i] * value[i]).sum::<f64>();
        let mean_radps = sum(spin_radps) / sum([1.0; 4]);
        std::array::from_fn(|i| weight[i] * (mean_radps - spin_radps[i]) / step_s)
    }

    /// What is left of a command behind smoothing and dead band and under the battery's voltage, which falls while
    /// driving.
    fn understood_mps(&mut self, commanded_mps: f64, step_s: f64) -> f64 {
        let change_mps = (commanded_mps - self.smoothed_mps) * step_s / (self.smoothing_s + step_s);
        self.smoothed_mps =
            if self.smoothing_s > 0.0 { self.smoothed_mps + change_mps } else { commanded_mps };
        let commanded_mps = self.smoothed_mps;
        if commanded_mps.abs() < self.dead_band_mps.max(PARKING_SPEED_MPS) {
            return 0.0;
        }
        self.voltage = (self.voltage - self.sag_per_s * step_s).max(VOLTAGE_MIN);
        commanded_mps * self.voltage
    }

    /// Mean circumferential speed of the driven wheels, as the vehicle's own calibration has it [m/s].
    pub(crate) fn speed_mps(&self, spin_radps: &[f64; 4]) -> f64 {
        self.mean_spin_radps(spin_radps) * self.radius_m
    }

    /// Mean speed of the driven wheels [rad/s].
    fn mean_spin_radps(&self, spin_radps: &[f64; 4]) -> f64 {
        let driven = || (0..4).filter(|&i| self.drive_share[i] > 0.0);
        driven().map(|i| spin_radps[i]).sum::<f64>() / driven().count() as f64
    }

    /// The same of those that tell how fast the vehicle is: a wheel that its brake locks does not, and would have the
    /// servo let go of the others.
    fn rolling_radps(&self, spin_radps: &[f64; 4]) -> f64 {
        let forward = if self.reference_mps < 0.0 { -1.0 } else { 1.0 };
        let driven = || (0..4).filter(|&i| self.drive_share[i] > 0.0).map(|i| forward * spin_radps[i]);
        let least_radps = LOCKING_SHARE * driven().fold(0.0, f64::max);
        if self.brake_nm == 0.0 || least_radps == 0.0 {
            return self.mean_spin_radps(spin_radps);
        }
        let rolling = || driven().filter(|&spin_radps| spin_radps >= least_radps);
        forward * rolling().sum::<f64>() / rolling().count() as f64
    }

    /// Wanted drive and brake torque: proportional-integral control of the wheel speed with the acceleration of
    /// the ramped reference fed forward; the parking brake when asked to stand still.
    fn servo(&mut self, commanded_mps: f64, mean_radps: f64, step_s: f64) -> (f64, f64) {
        let speed_mps = mean_radps * self.radius_m;
        let acceleration_mps2 = self.ramp(commanded_mps, step_s);
        if commanded_mps.abs() < PARKING_SPEED_MPS
            && self.reference_mps.abs() < PARKING_SPEED_MPS
            && speed_mps.abs() < STANDSTILL_MPS
        {
            self.integral_n = 0.0;
            self.expected_mps = 0.0;
            return (0.0, self.brake_max_nm);
        }
        let servo_s = self.response_s + SERVO_TIME_S;
        let gain = self.mass_kg / servo_s;
        let error_mps = self.expected_mps - speed_mps;
        let wanted_n = self.mass_kg * acceleration_mps2 + gain * error_mps + self.integral_n;
        let forward = if self.reference_mps < 0.0 { -1.0 } else { 1.0 };
        let along_nm = forward * wanted_n * self.radius_m;
        let drive_max_nm = self.drive_max_nm.min(self.power_max_w / mean_radps.abs().max(1e-3));
        let limited_nm = along_nm.clamp(-self.brake_max_nm, drive_max_nm);
        // Integrates only while the actuators follow, or when that leads back to where they do.
        if limited_nm == along_nm || (wanted_n > 0.0) != (error_mps > 0.0) {
            self.integral_n += self.integral_share * gain * error_mps * step_s / (INTEGRAL_RATIO * servo_s);
        }
        if limited_nm > 0.0 { (forward * limited_nm, 0.0) } else { (0.0, -limited_nm) }
    }

    /// Moves the reference towards the command at the limit of acceleration and gives its acceleration [m/s2].
    fn ramp(&mut self, commanded_mps: f64, step_s: f64) -> f64 {
        let most_mps = self.acceleration_max_mps2 * step_s;
        let change_mps = (commanded_mps - self.reference_mps).clamp(-most_mps, most_mps);
        self.reference_mps += change_mps;
        let share = step_s / (self.response_s + step_s);
        self.expected_mps += share * (self.reference_mps - self.expected_mps);
        change_mps / step_s
    }
}
