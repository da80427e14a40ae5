//! The action `nav2_msgs/NavigateToPose`, part by part.
//!
//! The result is that of Kilted. Those of Jazzy and Iron end before its text and that of Humble is empty: whoever expects
//! one of them reads what comes first and leaves the rest.

use ros2_client::Message;
use serde::{Deserialize, Serialize};

use super::{Duration, PoseStamped};

/// The goal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NavigateToPoseGoal {
    /// Where to go.
    pub pose: PoseStamped,
    /// Of other planners: what to do on the way.
    pub behavior_tree: String,
}

/// How it ended.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NavigateToPoseResult {
    /// [`NavigateToPoseResult::NONE`] or [`NavigateToPoseResult::UNKNOWN`].
    pub error_code: u16,
    /// Why it was not reached, in one line; empty where it was.
    pub error_msg: String,
}

impl NavigateToPoseResult {
    /// It was reached.
    pub const NONE: u16 = 0;
    /// It was not.
    pub const UNKNOWN: u16 = 9000;
}

/// How far it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NavigateToPoseFeedback {
    /// Where the vehicle is.
    pub current_pose: PoseStamped,
    /// Since the goal was accepted.
    pub navigation_time: Duration,
    /// Until it is reached; 0 = not known.
    pub estimated_time_remaining: Duration,
    /// How often something else had to be tried first.
    pub number_of_recoveries: i16,
    /// From the vehicle to the goal [m].
    pub distance_remaining: f32,
}

impl Message for NavigateToPoseGoal {}
impl Message for NavigateToPoseResult {}
impl Message for NavigateToPoseFeedback {}
