//! What a bag of ROS 2 tells of the robot that it was recorded on.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use bus::message::{ImuRecord, OdometryRecord, ScanHeader, Stamp};
use formats::{Bag, RecordedMessage, RobotRos, read_vehicle};
use ros::bag::{self, arrival, read};
use ros::intake::Intake;
use ros::message::{Clock, Imu, Named, Odometry, PointCloud2, TfMessage};
use runtime::doctor::{Expected, Finding, Observed, Source, Verdict};
use serde::de::DeserializeOwned;

use crate::arguments::UpArguments;
use crate::up::robot;
use crate::{UsageError, WorkFailed, interrupt};

/// Returns of a scan at the most, as on the bus.
const POINTS_MAX: usize = 1 << 16;
/// Share of messages that may be left out at a beginning, before frames and clock are known.
const FINE_SHARE: f64 = 0.05;

/// What a topic tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Topic {
    Odometry,
    Points,
    Imu,
    Moving,
    Fixed,
    Clock,
}

/// What became of a topic's messages.
#[derive(Default)]
struct Count {
    all: u64,
    left_out: u64,
    /// Why the first of these was.
    why: String,
}

struct Examiner {
    topics: BTreeMap<String, Topic>,
    intake: Intake,
    observed: Observed,
    counts: BTreeMap<String, Count>,
    times_ns: Option<[u64; 2]>,
}

/// Reads a bag as the robot's bridge would hear it, and says what its sensors are like.
pub(super) fn look(
    path: &Path,
    up: &UpArguments,
    ros: &RobotRos,
    expected: &Expected,
) -> anyhow::Result<Vec<Finding>> {
    let bag = Bag::open(path).map_err(UsageError::from_input)?;
    let mut examiner = Examiner::new(up, ros)?;
    interrupt::catch_interrupts()?;
    let ended_early = bag.take_all(|message| {
        if interrupt::interrupted() {
            return Err("interrupted by the user".to_owned());
        }
        examiner.take(&message);
        Ok(())
    });
    if interrupt::interrupted() {
        return Err(WorkFailed(format!("{}: interrupted before its end", path.display())).into());
    }
    let mut findings = examiner.findings(expected);
    findings.extend(
        ended_early
            .map(|problem| Finding::new("bag", Verdict::Doubtful, format!("it ends early, {problem}"))),
    );
    Ok(findings)
}

fn topics(ros: &RobotRos) -> BTreeMap<String, Topic> {
    let names = &ros.topics;
    let single = [
        (&names.odometry, Topic::Odometry),
        (&names.imu, Topic::Imu),
        (&names.tf, Topic::Moving),
        (&names.tf_static, Topic::Fixed),
        (&names.clock, Topic::Clock),
    ];
    robot::topics(ros, &single, Topic::Points)
}

impl Examiner {
    fn new(up: &UpArguments, ros: &RobotRos) -> Result<Self, UsageError> {
        let vehicle = read_vehicle(up.drive.vehicle_name_or_path()).map_err(UsageError::from_input)?;
        let sensors = up.described.as_ref().map_or(&[][..], |robot| &robot.sensors);
        Ok(Self {
            topics: topics(ros),
            intake: bag::intake(ros, &vehicle, sensors).map_err(UsageError::from_input)?,
            observed: Observed::default(),
            counts: BTreeMap::new(),
            times_ns: None,
        })
    }

    fn take(&mut self, message: &RecordedMessage) {
        let now_ns = message.log_time_ns;
        let [first_ns, last_ns] = self.times_ns.unwrap_or([now_ns; 2]);
        self.times_ns = Some([first_ns.min(now_ns), last_ns.max(now_ns)]);
        let Some(topic) = self.topics.get(&message.channel.topic) else { return };
        let taken = match topic {
            Topic::Odometry => self.odometry(message),
            Topic::Points => self.points(message),
            Topic::Imu => self.imu(message),
            Topic::Moving => self.with(message, |intake, told: TfMessage| intake.moving_frames(&told)),
            Topic::Fixed => self.with(message, |intake, told: TfMessage| intake.fixed_frames(&told)),
            Topic::Clock => self.with(message, |intake, Clock { clock }| {
                intake.simulated_time(clock.nanoseconds(), arrival(message))
            }),
        };
        let count = self.counts.entry(message.channel.topic.clone()).or_default();
        count.all += 1;
        if let Err(why) = taken {
            count.left_out += 1;
            if count.left_out == 1 {
                count.why = why;
            }
        }
    }

    fn odometry(&mut self, message: &RecordedMessage) -> Result<(), String> {
        let odometry: Odometry = said(message)?;
        let (at_ns, record) = one_line(self.intake.odometry(&odometry, arrival(message)))?;
        let records: [OdometryRecord; 1] = [record];
        self.observed.odometry(&heard(message, at_ns), &records);
        Ok(())
    }

    fn points(&mut self, message: &RecordedMessage) -> Result<(), String> {
        let cloud: PointCloud2 = said(message)?;
        let taken = one_line(self.intake.cloud(&cloud, arrival(message), POINTS_MAX))?;
        let (origin_m, sensor) = (taken.origin_m, taken.sensor);
        let header = ScanHeader { stamp: heard(message, taken.at_ns), origin_m, sensor };
        self.observed.scan(&header, &taken.sweep.points);
        Ok(())
    }

    fn imu(&mut self, message: &RecordedMessage) -> Result<(), String> {
        let imu: Imu = said(message)?;
        let sample: ImuRecord = one_line(self.intake.imu(&imu, arrival(message)))?;
        self.observed.imu(&heard(message, sample.valid_at_ns), &[sample]);
        Ok(())
    }

    fn with<M: Named + DeserializeOwned, E: Display>(
        &mut self,
        message: &RecordedMessage,
        take: impl FnOnce(&mut Intake, M) -> Result<(), E>,
    ) -> Result<(), String> {
        one_line(take(&mut self.intake, said(message)?))
    }

    fn findings(&self, expected: &Expected) -> Vec<Finding> {
        let watched_s = self.times_ns.map_or(0.0, |[first, last]| (last - first) as f64 * 1e-9);
        let mut findings = self.observed.findings(expected, watched_s, |source| match source {
            Source::Odometry => self.left_out("odometry", &[Topic::Odometry]),
            Source::Scans => self.left_out("scans", &[Topic::Points]),
            Source::Imu => self.left_out("imu", &[Topic::Imu]),
        });
        findings.extend(self.left_out("frames", &[Topic::Moving, Topic::Fixed]));
        findings.extend(self.left_out("clock", &[Topic::Clock]));
        findings
    }

    /// Messages of some topics that the bridge would refuse, with the reason of the first.
    fn left_out(&self, what: &str, kinds: &[Topic]) -> Option<Finding> {
        let is_of = |name: &String| self.topics.get(name).is_some_and(|topic| kinds.contains(topic));
        let counts: Vec<(&String, &Count)> = self.counts.iter().filter(|(name, _)| is_of(name)).collect();
        let n = |of: fn(&Count) -> u64| counts.iter().map(|(_, count)| of(count)).sum::<u64>();
        let (all, left_out) = (n(|count| count.all), n(|count| count.left_out));
        let (topic, first) = counts.iter().find(|(_, count)| count.left_out > 0)?;
        let is_few = left_out as f64 <= FINE_SHARE * all as f64;
        let verdict = if is_few { Verdict::Doubtful } else { Verdict::Wrong };
        let found = format!("{left_out} of {all}, the first on {topic} for {}", first.why);
        Some(Finding::new(format!("{what} refused"), verdict, found))
    }
}

/// When a message was recorded is when it was heard.
fn heard(message: &RecordedMessage, valid_at_ns: u64) -> Stamp {
    Stamp { valid_at_ns, published_at_ns: message.log_time_ns, ..Stamp::default() }
}

fn said<M: Named + DeserializeOwned>(message: &RecordedMessage) -> Result<M, String> {
    one_line(read::<M>(message))
}

fn one_line<T, E: Display>(made: Result<T, E>) -> Result<T, String> {
    made.map_err(|error| error.to_string())
}
