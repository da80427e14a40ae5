//! What a bag holds: its messages read and written, and the drive in it as a log. No network is needed for it.
//!
//! Messages are read as the ones of [`crate::message`], by the name of their type: the definitions that a bag brings
//! along, or leaves out, are not needed.

mod drive;
mod topics;
mod writer;

use std::fmt::Display;

use bicycle::Vehicle;
use bus::clock;
use byteorder::{BigEndian, LittleEndian};
use cdr_encoding::from_bytes;
use formats::{RecordedMessage, RobotRos, RobotSensor};
use serde::de::DeserializeOwned;

pub use drive::{BagDrive, BagDriveError, Robot, drive_log};
pub use topics::{LogTopics, LogTopicsError};
pub use writer::{MessageWriteError, MessageWriter};

use crate::bridge;
use crate::cloud::LabelsError;
use crate::intake::Intake;
use crate::message::Named;
use crate::node;
use crate::odometry::Frames;
use crate::stamps::{Arrival, StampClock};
use crate::transforms::Transforms;

/// A message that cannot be read. Every message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// It is of another type.
    #[error("{topic}: expected messages of {expected}, found {found}")]
    Type {
        /// Its topic.
        topic: String,
        /// What it should be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// It is not said in CDR.
    #[error("{topic}: expected messages in CDR, found {found}")]
    Encoding {
        /// Its topic.
        topic: String,
        /// How it is said, or begins.
        found: String,
    },
    /// Its bytes are none of its type.
    #[error("{topic}: expected a message of {expected}, found {n_bytes} bytes that are none: {problem}")]
    Bytes {
        /// Its topic.
        topic: String,
        /// What it should be.
        expected: String,
        /// Its length.
        n_bytes: usize,
        /// What is wrong with them.
        problem: String,
    },
}

/// The name of a message's type as bags say it.
pub fn type_name<M: Named>() -> String {
    format!("{}/msg/{}", M::PACKAGE, M::TYPE)
}

/// Whether a message is of a type.
pub fn is_of<M: Named>(message: &RecordedMessage) -> bool {
    message.channel.schema == type_name::<M>()
}

/// Reads a message of a bag.
///
/// # Errors
/// See [`ReadError`].
pub fn read<M: Named + DeserializeOwned>(message: &RecordedMessage) -> Result<M, ReadError> {
    let topic = || message.channel.topic.clone();
    if !is_of::<M>(message) {
        let found = message.channel.schema.clone();
        return Err(ReadError::Type { topic: topic(), expected: type_name::<M>(), found });
    }
    if message.channel.encoding != "cdr" {
        return Err(ReadError::Encoding { topic: topic(), found: message.channel.encoding.clone() });
    }
    // Four bytes say in which order the bytes of numbers are, of plain CDR.
    let (read, n_bytes) = (message.data.split_at_checked(4), message.data.len());
    let told = match read {
        Some(([0, 1, _, _], content)) => from_bytes::<M, LittleEndian>(content),
        Some(([0, 0, _, _], content)) => from_bytes::<M, BigEndian>(content),
        Some(([0x28, 0xb5, 0x2f, 0xfd], _)) => {
            let found =
                "messages packed one by one with Zstandard; unpack them with ros2 bag convert".to_owned();
            return Err(ReadError::Encoding { topic: topic(), found });
        }
        found => {
            let found = found.map_or(&message.data[..], |(beginning, _)| beginning);
            return Err(ReadError::Encoding {
                topic: topic(),
                found: format!("one that begins with {found:?}"),
            });
        }
    };
    told.map(|(read, _)| read).map_err(|error| ReadError::Bytes {
        topic: topic(),
        expected: type_name::<M>(),
        n_bytes,
        problem: one_line(&error),
    })
}

/// When a message was recorded: the clock that it came by is the only one that a bag knows.
pub fn arrival(message: &RecordedMessage) -> Arrival {
    Arrival { monotonic_ns: message.log_time_ns, utc_ns: message.log_time_ns }
}

/// What takes over the messages of a robot, as the bridge does; sensors are those that the robot file mounts.
///
/// # Errors
/// Labels that mean nothing.
pub fn intake(ros: &RobotRos, vehicle: &Vehicle, sensors: &[RobotSensor]) -> Result<Intake, LabelsError> {
    let frames = Frames { map: ros.frame(&ros.map_frame), vehicle: ros.frame(&ros.vehicle_frame) };
    let transforms = Transforms::new(clock::nanoseconds(ros.transform_age_max_s));
    let stamps = StampClock::new(bridge::source_of(ros.clock));
    Ok(Intake::new(frames, bridge::clouds(ros, vehicle, sensors)?, stamps, transforms))
}

/// A topic of the robot file as bags name it, from the root; none of an empty one.
pub fn topic_name(ros: &RobotRos, topic: &str) -> Option<String> {
    (!topic.is_empty()).then(|| node::absolute(&ros.namespace, topic))
}

fn one_line(error: &dyn Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
