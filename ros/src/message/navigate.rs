//! The action `nav2_msgs/NavigateToPose`, part by part.
//!
//! The result has a text since Kilted. A client of Jazzy on Fast DDS takes no more bytes than its own result can have.

use ros2_client::Message;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

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
    /// Why it was not reached, in one line; empty where it was. Before Kilted there is none.
    #[serde(
        skip_serializing_if = "Option::is_none",
        serialize_with = "tell_text",
        deserialize_with = "read_text"
    )]
    pub error_msg: Option<String>,
}

/// As if it could not be left out, which nothing on the wire says.
fn tell_text<S: Serializer>(text: &Option<String>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(text.as_deref().unwrap_or_default())
}

fn read_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    String::deserialize(deserializer).map(Some)
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
