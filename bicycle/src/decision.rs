//! What a controller returns each cycle: a command or a reason not to give one.

use std::fmt;

use crate::{Command, MotionCommand};

/// The outcome of one control cycle. Degraded operation is a value, never a stale command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision<C = Command> {
    /// Follow the command.
    Drive(C),
    /// Stand still for now; driving may go on next cycle.
    Hold(HoldReason),
    /// Come to a controlled stop.
    Stop(StopReason),
}

impl<C: MotionCommand> Decision<C> {
    /// What the vehicle is told that was told `last` before: the command; to hold or to stop, to stand still, with the
    /// wheels as they were told to stand.
    pub fn command(&self, last: C) -> C {
        match *self {
            Self::Drive(command) => command,
            Self::Hold(_) | Self::Stop(_) => last.at_standstill(),
        }
    }
}

impl<C> fmt::Display for Decision<C> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drive(_) => formatter.write_str("driving"),
            Self::Hold(reason) => write!(formatter, "waiting: {reason}"),
            Self::Stop(reason) => write!(formatter, "stopped: {reason}"),
        }
    }
}

/// Why the vehicle waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HoldReason {
    /// Nothing of the ground is known yet.
    NoMap,
    /// The goal is reached.
    AtGoal,
    /// Nobody has said where to go, or whoever did has said that it is over.
    NoMission,
    /// The mission is paused.
    Paused,
    /// An operator has the wheel.
    Manual,
}

impl fmt::Display for HoldReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NoMap => "nothing of the ground is known yet",
            Self::AtGoal => "the goal is reached",
            Self::NoMission => "there is no mission",
            Self::Paused => "the mission is paused",
            Self::Manual => "an operator has the wheel",
        })
    }
}

/// Why the vehicle must stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// Odometry is older than its age limit or does not change while the wheels turn.
    StaleOdometry,
    /// The last scan is older than its age limit.
    StaleScan,
    /// A measurement is not a finite number.
    NonFiniteInput,
    /// Every sampled future breaks a limit.
    NoFeasibleRollout,
    /// The computation itself gave a number that is not finite.
    NonFiniteResult,
    /// The pose lies outside the map.
    OutsideMap,
    /// What the last command was decided on is older than whoever carries it out may follow.
    StaleCommand,
    /// Where to go has not been said again within its age limit.
    StaleMission,
    /// A measurement is finite and cannot be: farther, faster or turned more than any vehicle is.
    InputOutOfRange,
    /// Odometry is older than what has been taken in, or another of the same time.
    InputOutOfOrder,
    /// A measurement claims to be of a time that is still to come.
    InputFromFuture,
    /// Somebody has told it to, and nobody has reset that yet.
    EmergencyStop,
    /// Whatever is planned meets a moving obstacle where it is expected to be.
    MovingObstacle,
}

impl fmt::Display for StopReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::StaleOdometry => "stale odometry",
            Self::StaleScan => "stale scan",
            Self::NonFiniteInput => "non finite input",
            Self::NoFeasibleRollout => "no feasible rollout",
            Self::NonFiniteResult => "non finite result",
            Self::OutsideMap => "outside map",
            Self::StaleCommand => "stale command",
            Self::StaleMission => "stale mission",
            Self::InputOutOfRange => "input out of range",
            Self::InputOutOfOrder => "input out of order",
            Self::InputFromFuture => "input from future",
            Self::EmergencyStop => "emergency stop",
            Self::MovingObstacle => "moving obstacle",
        })
    }
}
