//! A drive log out of a bag: one row for each odometry, with the command and the inertial sample of its time.

mod reader;

use bicycle::{DriveLog, Vehicle};
use formats::{Bag, RobotRos};

use super::LogTopics;
use crate::cloud::LabelsError;
use reader::Reader;

/// The robot that a bag is of, where its file is there.
#[derive(Clone, Copy, Debug)]
pub struct Robot<'a> {
    /// Frames and clocks.
    pub ros: &'a RobotRos,
    /// The machine: its wheelbase makes steering angles of yaw rates.
    pub vehicle: &'a Vehicle,
}

/// A drive out of a bag.
#[derive(Clone, Debug)]
pub struct BagDrive {
    /// The drive. Time counts from its first odometry.
    pub log: DriveLog,
    /// Where and why the bag breaks off; `None` when it is whole.
    pub ended_early: Option<String>,
    /// What was left out of it, line by line.
    pub notes: Vec<String>,
}

/// A bag without a drive. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum BagDriveError {
    /// Nothing says where the vehicle was.
    #[error("expected messages of nav_msgs/msg/Odometry on {topic}, found {found}")]
    NoOdometry {
        /// Which topic.
        topic: String,
        /// What there is instead.
        found: String,
    },
    /// Of several topics nobody has said which one counts.
    #[error("expected one topic for the {kind}, found {first} and {other}; say which with {kind}=TOPIC")]
    Several {
        /// What they tell.
        kind: &'static str,
        /// One of them.
        first: String,
        /// Another one.
        other: String,
    },
    /// A topic that was asked for is not there.
    #[error("expected messages on {topic}, found only {found}")]
    Absent {
        /// The topic.
        topic: String,
        /// The topics that there are, with their types.
        found: String,
    },
    /// A topic that was asked for is of another type.
    #[error("{topic}: expected messages of {expected}, found {found}")]
    Type {
        /// The topic.
        topic: String,
        /// What would do.
        expected: &'static str,
        /// What they are.
        found: String,
    },
    /// What labels mean.
    #[error(transparent)]
    Labels(#[from] LabelsError),
}

/// The drive log of a bag. Rows lie at the stamps of the odometry, told on the clock that the bag was recorded by; each
/// has the last command that was recorded before that.
///
/// With a robot, everything is carried to its map and to the centre of its rear axle; without, the odometry is taken as
/// that of the rear axle, in its own frame. What cannot be used is left out, and noted.
///
/// # Errors
/// No odometry that could be used, or topics that are not there, of another type, or not one alone.
pub fn drive_log(bag: &Bag, topics: &LogTopics, robot: Option<Robot<'_>>) -> Result<BagDrive, BagDriveError> {
    let mut reader = Reader::new(topics, robot)?;
    let mut refusal = None;
    let ended_early =
        bag.take_all(|message| reader.take(&message).map_err(|error| refusal.insert(error).to_string()));
    refusal.map_or_else(|| reader.finish(ended_early), Err)
}

#[cfg(test)]
mod tests;
