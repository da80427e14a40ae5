//! One test drive: a driver on the plant, and what the sensors saw.

use std::sync::Arc;

use bicycle::{Column, Command, DriveLog, DriveLogError, DriveRow, Odometry};

use super::driver::{Driver, Style};
use super::fleet::TestMachine;
use crate::random::seed_of;
use crate::{CommandError, Deviation, OdometrySensor, Plant, PlantError};

/// Rows of a log per second [Hz].
pub const LOG_HZ: f64 = 50.0;
/// Length of a log [s].
pub const LOG_S: f64 = 40.0;
/// Driving before the first row [s].
const RUN_UP_S: f64 = 3.0;
/// Rolled over, stuck against something, off the map: such a drive is driven again from elsewhere, at most so often.
const ATTEMPTS: u64 = 25;

/// Why there is no drive.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TestDriveError {
    /// The machine cannot be put on its ground.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A command is no number.
    #[error(transparent)]
    Command(#[from] CommandError),
    /// A row is none.
    #[error(transparent)]
    Log(#[from] DriveLogError),
    /// However it starts, the machine does not stay on its wheels and on the map.
    #[error("expected a drive of {LOG_S} s on wheels and on the map, found none in {ATTEMPTS} attempts")]
    NoDrive,
}

/// Drives a machine that departs by `deviations` from the simulator's.
///
/// # Errors
/// The machine cannot stand there, or does not stay on its wheels however it starts.
pub fn test_drive(
    machine: &TestMachine,
    deviations: &[Deviation],
    style: Style,
    seed: u64,
) -> Result<DriveLog, TestDriveError> {
    let all = [&machine.peculiarities[..], deviations].concat();
    let grip = deviations.iter().any(|deviation| matches!(deviation, Deviation::TyreGrip { .. }));
    let harder = if grip { 1.25 } else { 1.0 };
    for attempt in 0..ATTEMPTS {
        let attempt_seed = seed_of(seed, &[0xA77E, attempt]);
        let mut driver = Driver::new(machine, style, harder, attempt_seed);
        if let Some(log) = drive(machine, &all, &mut driver, attempt_seed)? {
            return Ok(log);
        }
    }
    Err(TestDriveError::NoDrive)
}

/// `None` where the machine did not stay on its wheels and on the map.
fn drive(
    machine: &TestMachine,
    deviations: &[Deviation],
    driver: &mut Driver,
    seed: u64,
) -> Result<Option<DriveLog>, TestDriveError> {
    let start = driver.start();
    let mut plant = Plant::deviating(&machine.vehicle, deviations, Arc::clone(&machine.world), start)?;
    let mut sensor = OdometrySensor::deviating(machine.sensors, deviations, seed);
    let mut log = DriveLog::default();
    let period_s = 1.0 / LOG_HZ;
    let [n_before, n_rows] = [RUN_UP_S, LOG_S].map(|duration_s| (duration_s * LOG_HZ).round() as u64);
    for cycle in 0..n_before + n_rows {
        let time_s = cycle as f64 * period_s;
        let command = driver.command(time_s, &plant.pose());
        let measured = sensor.measure(&plant.motion(), (time_s * 1e9).round() as u64);
        if let Some(row) = cycle.checked_sub(n_before) {
            log.push("", &logged(row as f64 * period_s, &measured, command))?;
        }
        plant.set_command(command)?;
        plant.advance(period_s);
        if plant.rolled_over() || plant.left_world() || !plant.is_finite() {
            return Ok(None);
        }
    }
    Ok(Some(log))
}

/// A row with as many decimals as the sensors' noise is worth.
fn logged(time_s: f64, measured: &Odometry, command: Command) -> DriveRow {
    let rounded = |value: f64, per_unit: f64| (value * per_unit).round() / per_unit;
    let [x_m, y_m, z_m] = measured.position_m.map(|value| rounded(value, 1e4));
    let [roll_rad, pitch_rad, yaw_rad] = measured.attitude_rad;
    let [vx_mps, vy_mps] = measured.velocity_mps.map(|value| rounded(value, 1e4));
    DriveRow::new(rounded(time_s, 1e3))
        .with(Column::X, x_m)
        .with(Column::Y, y_m)
        .with(Column::Z, z_m)
        .with(Column::Roll, rounded(roll_rad, 1e4))
        .with(Column::Pitch, rounded(pitch_rad, 1e4))
        .with(Column::Yaw, rounded(yaw_rad.sin().atan2(yaw_rad.cos()), 1e4))
        .with(Column::Vx, vx_mps)
        .with(Column::Vy, vy_mps)
        .with(Column::Wz, rounded(measured.yaw_rate_radps, 1e4))
        .with(Column::CmdSpeed, rounded(f64::from(command.speed_mps), 1e4))
        .with(Column::CmdSteer, rounded(f64::from(command.steering_rad), 1e4))
}
