//! What a vehicle's actuators are told in the end, which may be something else than was decided.

use crate::Command;

/// What the actuators were told last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied<C = Command> {
    /// What they were told; of a vehicle that steers its front wheels, speed and their angle.
    pub command: C,
    /// When they were first told so, on the clock of the measurements [ns].
    pub since_ns: u64,
    /// Who decided it.
    pub by: AppliedBy,
}

/// Who decides what actuators are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AppliedBy {
    /// Whoever commands the vehicle: it is the last command that came.
    Command,
    /// The vehicle itself, be it its watchdog or an operator, whatever is commanded.
    Vehicle,
}
