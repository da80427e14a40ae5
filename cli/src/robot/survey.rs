//! What a bag tells of the robot that recorded it: topics, types, rates, frames, clock.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use formats::{Bag, RecordedMessage, RosClock};
use ros::bag::{is_of, read};
use ros::message::{
    AckermannDriveStamped, Clock, Header, Imu, Odometry, PointCloud2, TfMessage, TwistStamped,
};

use crate::UsageError;

/// How far stamps may lie behind the time of recording on a clock that shows the time of day, and ahead of it [ns].
const BEHIND_MAX_NS: i64 = 3_600_000_000_000;
const AHEAD_MAX_NS: i64 = 100_000_000;

/// What messages of a topic are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Odometry,
    Points,
    Imu,
    Frames,
    Clock,
    Ackermann,
    Twist,
}

/// A topic that is of use.
#[derive(Clone, Debug)]
pub(super) struct Topic {
    pub kind: Kind,
    pub n_messages: u64,
    times_ns: [u64; 2],
    /// Frames of its messages.
    pub frames: BTreeSet<String>,
}

impl Topic {
    /// Messages per second [Hz]; none of a topic with a single time.
    pub fn rate_hz(&self) -> Option<f64> {
        let [first_ns, last_ns] = self.times_ns;
        let span_s = last_ns.saturating_sub(first_ns) as f64 * 1e-9;
        (span_s > 0.0).then(|| (self.n_messages - 1) as f64 / span_s)
    }
}

/// What the bag tells.
#[derive(Debug, Default)]
pub(super) struct Survey {
    pub topics: BTreeMap<String, Topic>,
    /// The child frame of the odometry.
    pub child_frame: Option<String>,
    /// Every frame that a transform names.
    pub frames: BTreeSet<String>,
    /// How far the first odometry's stamp is ahead of the time of its recording [ns].
    ahead_ns: Option<i64>,
    /// Where the bag breaks off.
    pub ended_early: Option<String>,
}

impl Survey {
    pub fn of(path: &Path) -> Result<Self, UsageError> {
        let bag = Bag::open(path).map_err(UsageError::from_input)?;
        let mut survey = Self::default();
        survey.ended_early = bag.take_all(|message| {
            survey.take(&message);
            Ok(())
        });
        Ok(survey)
    }

    /// Topics of a kind, by name.
    pub fn of_kind(&self, kind: Kind) -> Vec<(&str, &Topic)> {
        let topics = self.topics.iter().filter(|(_, topic)| topic.kind == kind);
        topics.map(|(name, topic)| (name.as_str(), topic)).collect()
    }

    /// Which clock the odometry's stamps are of.
    pub fn clock(&self) -> RosClock {
        let is_of_day =
            self.ahead_ns.is_none_or(|ahead_ns| (-BEHIND_MAX_NS..=AHEAD_MAX_NS).contains(&ahead_ns));
        match (is_of_day, self.of_kind(Kind::Clock).is_empty()) {
            (true, _) => RosClock::TimeOfDay,
            (false, false) => RosClock::Simulated,
            (false, true) => RosClock::OfItsOwn,
        }
    }

    /// A message that cannot be read is one of its topic all the same.
    fn take(&mut self, message: &RecordedMessage) {
        let Some(kind) = kind(message) else { return };
        let now_ns = message.log_time_ns;
        let fresh = || Topic { kind, n_messages: 0, times_ns: [now_ns; 2], frames: BTreeSet::new() };
        let topic = self.topics.entry(message.channel.topic.clone()).or_insert_with(fresh);
        topic.n_messages += 1;
        topic.times_ns = [topic.times_ns[0].min(now_ns), topic.times_ns[1].max(now_ns)];
        topic.frames.extend(header(message, kind).map(|header| header.frame_id));
        match kind {
            Kind::Odometry if self.ahead_ns.is_none() => self.odometry(message),
            Kind::Frames => self.frames(message),
            _ => {}
        }
    }

    fn odometry(&mut self, message: &RecordedMessage) {
        let Ok(odometry) = read::<Odometry>(message) else { return };
        self.ahead_ns =
            Some(odometry.header.stamp.nanoseconds().saturating_sub_unsigned(message.log_time_ns));
        self.child_frame = Some(odometry.child_frame_id);
    }

    fn frames(&mut self, message: &RecordedMessage) {
        let transforms = read::<TfMessage>(message).map(|told| told.transforms).unwrap_or_default();
        for transform in transforms {
            self.frames.extend([transform.header.frame_id, transform.child_frame_id]);
        }
    }
}

fn kind(message: &RecordedMessage) -> Option<Kind> {
    let kinds = [
        (is_of::<Odometry>(message), Kind::Odometry),
        (is_of::<PointCloud2>(message), Kind::Points),
        (is_of::<Imu>(message), Kind::Imu),
        (is_of::<TfMessage>(message), Kind::Frames),
        (is_of::<Clock>(message), Kind::Clock),
        (is_of::<AckermannDriveStamped>(message), Kind::Ackermann),
        (is_of::<TwistStamped>(message), Kind::Twist),
    ];
    kinds.into_iter().find(|(is_so, _)| *is_so).map(|(_, kind)| kind)
}

/// The header of what measures.
fn header(message: &RecordedMessage, kind: Kind) -> Option<Header> {
    match kind {
        Kind::Odometry => read::<Odometry>(message).ok().map(|said| said.header),
        Kind::Points => read::<PointCloud2>(message).ok().map(|said| said.header),
        Kind::Imu => read::<Imu>(message).ok().map(|said| said.header),
        Kind::Frames | Kind::Clock | Kind::Ackermann | Kind::Twist => None,
    }
}
