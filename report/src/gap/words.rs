//! Names and units on the pictures.

use sim_to_real::{Condition, Division, ResidualState};

/// What the real drives were held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The model that was calibrated on nominal drives.
    Simulator,
    /// The bare kinematic bicycle, for want of nominal drives.
    Bicycle,
}

impl Reference {
    /// The model without the announced effects.
    pub(super) fn model(self) -> &'static str {
        match self {
            Self::Simulator => "calibrated nominal model",
            Self::Bicycle => "kinematic bicycle",
        }
    }

    /// What is as large between drives without a gap.
    pub(super) fn floor(self) -> &'static str {
        match self {
            Self::Simulator => "nominal drives",
            Self::Bicycle => "noise of the measurements",
        }
    }

    /// What a residual is divided by.
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Simulator => "standard deviations on nominal drives",
            Self::Bicycle => "standard deviations of what a repaired model leaves",
        }
    }

    /// Below the page of places.
    pub(super) fn places(self) -> String {
        format!(
            "Where: how much of the residual each condition explains, less what it explains of the null ({}); where the \
             announced effects are all of the gap, by what each condition explains through them.",
            self.floor()
        )
    }
}

pub(super) const RANKING: &str =
    "Which effect: the probability of every effect of the catalogue to be a part of the cause.";
pub(super) const THROUGHOUT: &str =
    "Is it the same throughout: what each announced parameter would be in parts of the real drives alone.";
pub(super) const LEFT: &str =
    "What is left: by how much each quantity is still off, over the condition that it follows most.";
pub(super) const SWING: &str = "What swings: the spectrum of the yaw rate that the commands do not explain, in the real drives and in the nominal ones.";
pub(super) const RESIDUALS: &str =
    "How large: the residual of every predicted quantity, by how far ahead it is predicted.";
pub(super) const GROUND: &str =
    "Over the ground: the residual of every rollout where it began, before and after.";
pub(super) const HELDOUT: &str = "A held-out drive: what was measured and what both models had predicted.";

/// Name and unit of a condition.
pub(super) fn condition(condition: Condition) -> (&'static str, &'static str) {
    match condition {
        Condition::Speed => ("speed", "m/s"),
        Condition::Steering => ("steering", "rad"),
        Condition::SteeringChange => ("change of steering", "rad"),
        Condition::SpeedChange => ("change of speed", "m/s"),
        Condition::LateralAcceleration => ("lateral acceleration", "m/s²"),
        Condition::Pitch => ("pitch", "rad"),
        Condition::Roll => ("roll", "rad"),
        Condition::TerrainClass => ("terrain class", "number"),
        Condition::Heading => ("heading", "rad"),
        Condition::Constant => ("everywhere the same", "-"),
        Condition::Time => ("share of each drive", "-"),
    }
}

/// Name and unit of what drives are divided by.
pub(super) fn division(division: Division) -> &'static str {
    match division {
        Division::Time => "of each drive [%]",
        Division::Drive => "drive [number]",
        Division::Steering => "steering to the",
        Division::Speed => "speed [m/s]",
        Division::TerrainClass => "terrain class [number]",
    }
}

/// Name of a predicted quantity.
pub(super) fn state(state: ResidualState) -> &'static str {
    match state {
        ResidualState::Along => "displacement along",
        ResidualState::Across => "displacement across",
        ResidualState::Yaw => "yaw",
        ResidualState::ForwardSpeed => "forward speed",
        ResidualState::YawRate => "yaw rate",
        ResidualState::SideSpeed => "sideways speed",
    }
}
