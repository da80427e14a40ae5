//! What turns a machine, and what an effect on the steering therefore means.

use crate::evidence::Evidence;
use crate::machine::Machine;
use bicycle::DriveLog;
use serde::{Deserialize, Serialize};

/// The second input of a machine: decides what effects on the steering mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Steering {
    /// Wheels are turned: `cmd_steer` or `steer_meas` [rad].
    #[default]
    Angle,
    /// Skid-steered: `cmd_wz` or `wheel_wz` [rad/s].
    YawRate,
}

impl Steering {
    /// Whether wheels are turned.
    pub fn is_angle(&self) -> bool {
        *self == Self::Angle
    }

    /// What turns the machine of a drive; `None` where its runs differ or nothing tells.
    pub fn of(machine: &Machine, log: &DriveLog) -> Option<Self> {
        let mut all = log.runs().map(|run| Evidence::of(&run, machine).ok());
        let first = all.next()??;
        let is_same = |other: Option<Evidence>| {
            other.is_some_and(|other| other.is_skid_steered() == first.is_skid_steered())
        };
        all.all(is_same).then(|| first.steering())
    }
}

impl Evidence {
    pub(crate) fn steering(&self) -> Steering {
        if self.is_skid_steered() { Steering::YawRate } else { Steering::Angle }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::drive::testing::{log, machine};
    use bicycle::Column::{CmdSpeed, CmdSteer, CmdWz, SteerMeas, Vx, WheelWz};

    #[test]
    fn what_turns_a_machine_is_told_by_its_columns() {
        let of = |columns: &[bicycle::Column]| Steering::of(&machine(), &log(columns, 2, 0.1, |_, _| 1.0));
        assert_eq!(of(&[CmdSpeed, CmdSteer, Vx]), Some(Steering::Angle));
        assert_eq!(of(&[CmdSpeed, SteerMeas, CmdWz, Vx]), Some(Steering::Angle));
        assert_eq!(of(&[CmdSpeed, CmdWz, Vx]), Some(Steering::YawRate));
        assert_eq!(of(&[CmdSpeed, WheelWz, Vx]), Some(Steering::YawRate));
        assert_eq!(of(&[CmdSpeed, Vx]), None);
    }
}
