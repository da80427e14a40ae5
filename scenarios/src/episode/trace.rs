//! What really happened, cycle by cycle.

use bicycle::{Column, Command, Decision, DriveLog, DriveLogError, DriveRow, Odometry};

use crate::Motion;

/// The beginning of one control cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceRow {
    /// Time since the start [s].
    pub time_s: f64,
    /// True motion.
    pub motion: Motion,
    /// Command that the cycle drove with.
    pub command: Command,
    /// Decision that the command came from.
    pub decision: Decision,
}

/// The trace as a drive log of one run.
pub fn drive_log(trace: &[TraceRow], run: &str) -> Result<DriveLog, DriveLogError> {
    let mut log = DriveLog::default();
    for row in trace {
        log.push(run, &row.drive_row())?;
    }
    Ok(log)
}

impl TraceRow {
    /// The row of a drive log that it stands for.
    pub fn drive_row(&self) -> DriveRow {
        let Motion { pose, velocity_mps, angular_rate_radps, specific_force_mps2, .. } = self.motion;
        [
            (Column::X, pose.x_m),
            (Column::Y, pose.y_m),
            (Column::Z, pose.z_m),
            (Column::Roll, pose.roll_rad),
            (Column::Pitch, pose.pitch_rad),
            (Column::Yaw, pose.yaw_rad),
            (Column::Vx, velocity_mps[0]),
            (Column::Vy, velocity_mps[1]),
            (Column::Wz, angular_rate_radps[2]),
            (Column::Ax, specific_force_mps2[0]),
            (Column::Ay, specific_force_mps2[1]),
            (Column::Az, specific_force_mps2[2]),
            (Column::CmdSpeed, f64::from(self.command.speed_mps)),
            (Column::CmdSteer, f64::from(self.command.steering_rad)),
            (Column::WheelSpeed, self.motion.wheel_speed_mps),
            (Column::SteerMeas, self.motion.steering_rad),
        ]
        .into_iter()
        .fold(DriveRow::new(self.time_s), |row, (column, value)| row.with(column, value))
    }

    /// The same with what the sensors said in place of what is true, as a robot's log would have it, with all their
    /// faults. What the localisation does not measure, the specific force, is the true one.
    pub fn measured_row(&self, odometry: &Odometry) -> DriveRow {
        self.drive_row().with_odometry(odometry)
    }
}
