//! Which topics of a bag a drive log is made of.

use formats::RobotRos;

use super::topic_name;

/// Topics by name; where none is said, the only one of a fitting type.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogTopics {
    /// `nav_msgs/Odometry`.
    pub odometry: Option<String>,
    /// `ackermann_msgs/AckermannDriveStamped`, `geometry_msgs/TwistStamped` or `geometry_msgs/Twist`.
    pub command: Option<String>,
    /// `sensor_msgs/Imu`.
    pub imu: Option<String>,
}

/// Words that name no topics.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LogTopicsError {
    /// A kind of topic is named twice.
    #[error("expected each of odometry, command, imu once, found '{found}' twice")]
    Twice {
        /// Which.
        found: String,
    },
}

impl LogTopics {
    /// The topics that a robot file names.
    pub fn of_robot(ros: &RobotRos) -> Self {
        let name = |topic| topic_name(ros, topic);
        let topics = &ros.topics;
        Self { odometry: name(&topics.odometry), command: name(&topics.command), imu: name(&topics.imu) }
    }

    /// Takes the words of the form `odometry=/topic`, `command=/topic` and `imu=/topic` out of a mapping, and returns the
    /// others: those are of columns.
    ///
    /// # Errors
    /// One is named twice.
    pub fn take_out<'a>(
        &mut self,
        words: impl IntoIterator<Item = &'a str>,
    ) -> Result<Vec<&'a str>, LogTopicsError> {
        let (mut said, mut others) = (Self::default(), Vec::new());
        for word in words {
            let (kind, topic) = word.split_once('=').unwrap_or((word, ""));
            let (kind, topic) = (kind.trim(), topic.trim());
            let place = match kind {
                _ if topic.is_empty() => None,
                "odometry" => Some(&mut said.odometry),
                "command" => Some(&mut said.command),
                "imu" => Some(&mut said.imu),
                _ => None,
            };
            match place {
                None => others.push(word),
                Some(Some(_)) => return Err(LogTopicsError::Twice { found: kind.to_owned() }),
                Some(place) => *place = Some(absolute(topic)),
            }
        }
        let Self { odometry, command, imu } = said;
        self.odometry = odometry.or(self.odometry.take());
        self.command = command.or(self.command.take());
        self.imu = imu.or(self.imu.take());
        Ok(others)
    }
}

/// Bags name topics from the root.
fn absolute(topic: &str) -> String {
    if topic.starts_with('/') { topic.to_owned() } else { format!("/{topic}") }
}
