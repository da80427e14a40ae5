//! Message by message to rows.

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Display;

use bicycle::{Column, DriveLog, DriveRow};
use bus::message::ImuRecord;
use formats::RecordedMessage;
use serde::de::DeserializeOwned;

use super::{BagDrive, BagDriveError, Robot};
use crate::bag::{LogTopics, arrival, intake, is_of, read, topic_name};
use crate::cloud::{Classes, GeometryClasses, Meaning};
use crate::intake::{Clouds, Intake, IntakeError};
use crate::message::{AckermannDriveStamped, Clock, Imu, Named, Odometry, TfMessage, Twist, TwistStamped};
use crate::odometry::Frames;
use crate::stamps::{StampClock, StampSource};
use crate::transforms::Transforms;

/// Speed below which a yaw rate tells no steering angle [m/s].
const SPEED_MIN_MPS: f64 = 0.05;
/// Commands that are kept to find the one of a row's time.
const COMMANDS_MAX: usize = 4096;
/// How far in time transforms count, where no robot file says it [ns].
const TRANSFORM_AGE_MAX_NS: u64 = 1_000_000_000;
/// Messages of frames that are kept until it is known whose frames count: a second of `/tf` and more.
const EARLY_MAX: usize = 4096;
/// The types of commands.
const COMMANDS: &str =
    "ackermann_msgs/msg/AckermannDriveStamped, geometry_msgs/msg/TwistStamped or geometry_msgs/msg/Twist";

/// What a row takes from a command.
#[derive(Clone, Copy)]
struct Commanded {
    at_ns: u64,
    columns: [(Column, f64); 2],
}

/// Where frames lay before anybody had said whose count.
struct Early {
    topic: String,
    at_ns: u64,
    is_fixed: bool,
    told: TfMessage,
}

pub(super) struct Reader<'a> {
    topics: LogTopics,
    robot: Option<Robot<'a>>,
    /// Without a robot file, from the first odometry on, whose frames count.
    intake: Option<Intake>,
    /// Frames that were told before, in their order.
    early: Vec<Early>,
    /// Kinds of topics that were not named, but chosen.
    chosen: Vec<&'static str>,
    commands: VecDeque<Commanded>,
    felt: Option<ImuRecord>,
    log: DriveLog,
    began_ns: Option<u64>,
    /// Every topic with its type.
    seen: BTreeMap<String, String>,
    /// How many messages of a topic were refused, and why the first was.
    refused: BTreeMap<String, (u64, String)>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(topics: &LogTopics, robot: Option<Robot<'a>>) -> Result<Self, BagDriveError> {
        let intake = robot.map(|Robot { ros, vehicle }| intake(ros, vehicle, &[])).transpose()?;
        Ok(Self {
            topics: topics.clone(),
            robot,
            intake,
            early: Vec::new(),
            chosen: Vec::new(),
            commands: VecDeque::new(),
            felt: None,
            log: DriveLog::default(),
            began_ns: None,
            seen: BTreeMap::new(),
            refused: BTreeMap::new(),
        })
    }

    pub(super) fn take(&mut self, message: &RecordedMessage) -> Result<(), BagDriveError> {
        let channel = &message.channel;
        if !self.seen.contains_key(&channel.topic) {
            self.seen.insert(channel.topic.clone(), channel.schema.clone());
            self.choose(message)?;
        }
        let topic = Some(&channel.topic);
        if topic == self.topics.odometry.as_ref() {
            self.odometry(message);
        } else if topic == self.topics.command.as_ref() {
            self.command(message);
        } else if topic == self.topics.imu.as_ref() {
            self.imu(message);
        } else if is_of::<TfMessage>(message) {
            self.frames(message);
        } else if is_of::<Clock>(message) {
            self.clock(message);
        }
        Ok(())
    }

    /// A topic that nobody has named counts where it is the only one of its kind.
    fn choose(&mut self, message: &RecordedMessage) -> Result<(), BagDriveError> {
        let is_command = is_of::<AckermannDriveStamped>(message)
            || is_of::<TwistStamped>(message)
            || is_of::<Twist>(message);
        let Self { topics: LogTopics { odometry, command, imu }, chosen, .. } = self;
        let kinds = [
            ("odometry", odometry, is_of::<Odometry>(message), "nav_msgs/msg/Odometry"),
            ("command", command, is_command, COMMANDS),
            ("imu", imu, is_of::<Imu>(message), "sensor_msgs/msg/Imu"),
        ];
        let (topic, found) = (&message.channel.topic, &message.channel.schema);
        for (kind, place, fits, expected) in kinds {
            match place {
                Some(named) if named == topic && !fits => {
                    return Err(BagDriveError::Type { topic: topic.clone(), expected, found: found.clone() });
                }
                Some(first) if fits && first != topic && chosen.contains(&kind) => {
                    return Err(BagDriveError::Several { kind, first: first.clone(), other: topic.clone() });
                }
                None if fits => {
                    *place = Some(topic.clone());
                    chosen.push(kind);
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn odometry(&mut self, message: &RecordedMessage) {
        let Some(odometry) = self.kept::<Odometry>(message) else { return };
        if self.intake.is_none() {
            self.begin(&odometry);
        }
        let Some(intake) = &mut self.intake else { return };
        let taken = intake.odometry(&odometry, arrival(message));
        let Some((at_ns, record)) = self.used(message, taken) else { return };
        let began_ns = *self.began_ns.get_or_insert(at_ns);
        // What the wheels do is not told by odometry.
        let row = DriveRow::new((i128::from(at_ns) - i128::from(began_ns)) as f64 * 1e-9)
            .with_odometry(&record.odometry(at_ns))
            .with(Column::WheelSpeed, f64::NAN)
            .with(Column::SteerMeas, f64::NAN);
        let row = self.completed(row, at_ns);
        let pushed = self.log.push("", &row);
        self.used(message, pushed);
    }

    /// With what was commanded and felt then.
    fn completed(&mut self, row: DriveRow, at_ns: u64) -> DriveRow {
        while self.commands.get(1).is_some_and(|next| next.at_ns <= at_ns) {
            self.commands.pop_front();
        }
        let command = self.commands.front().filter(|command| command.at_ns <= at_ns);
        let columns = command.map_or([].as_slice(), |command| &command.columns);
        let row = columns.iter().fold(row, |row, (column, value)| row.with(*column, *value));
        let Some(felt) = &self.felt else { return row };
        let felt = [Column::Ax, Column::Ay, Column::Az].into_iter().zip(felt.acceleration_mps2);
        felt.fold(row, |row, (column, value)| row.with(column, f64::from(value)))
    }

    fn command(&mut self, message: &RecordedMessage) {
        let columns = if is_of::<AckermannDriveStamped>(message) {
            self.kept::<AckermannDriveStamped>(message).map(|said| {
                let [speed_mps, steering_rad] = [said.drive.speed, said.drive.steering_angle].map(f64::from);
                [(Column::CmdSpeed, speed_mps), (Column::CmdSteer, steering_rad)]
            })
        } else if is_of::<TwistStamped>(message) {
            self.kept::<TwistStamped>(message).map(|said| self.of_twist(&said.twist))
        } else {
            self.kept::<Twist>(message).map(|said| self.of_twist(&said))
        };
        let Some(columns) = columns else { return };
        let wrong = columns.iter().find(|(_, value)| !value.is_finite());
        let checked = wrong.map_or(Ok(()), |(column, value)| {
            Err(format!("{}: expected a finite number, found {value}", column.name()))
        });
        if self.used(message, checked).is_some() {
            if self.commands.len() >= COMMANDS_MAX {
                self.commands.pop_front();
            }
            self.commands.push_back(Commanded { at_ns: message.log_time_ns, columns });
        }
    }

    /// Of a vehicle that steers, the angle that makes the yaw rate.
    fn of_twist(&self, said: &Twist) -> [(Column, f64); 2] {
        let (speed_mps, rate_radps) = (said.linear.x, said.angular.z);
        let turning = match self.robot {
            None => (Column::CmdWz, rate_radps),
            // What stands turns its wheels to no angle that the rate would tell: they stay.
            Some(_) if speed_mps.abs() < SPEED_MIN_MPS => {
                let before = self.commands.back().map_or(0.0, |command| command.columns[1].1);
                (Column::CmdSteer, before)
            }
            Some(Robot { vehicle, .. }) => {
                (Column::CmdSteer, (vehicle.geometry.wheelbase_m * rate_radps / speed_mps).atan())
            }
        };
        [(Column::CmdSpeed, speed_mps), turning]
    }

    fn imu(&mut self, message: &RecordedMessage) {
        let Some(imu) = self.kept::<Imu>(message) else { return };
        let Some(intake) = &mut self.intake else { return };
        let taken = intake.imu(&imu, arrival(message));
        self.felt = self.used(message, taken).or(self.felt);
    }

    fn frames(&mut self, message: &RecordedMessage) {
        let Some(told) = self.kept::<TfMessage>(message) else { return };
        let topic = &message.channel.topic;
        let is_fixed = match self.robot {
            Some(Robot { ros, .. }) => topic_name(ros, &ros.topics.tf_static).as_ref() == Some(topic),
            None => topic.ends_with("tf_static"),
        };
        let taken = match &mut self.intake {
            Some(intake) => placed(intake, is_fixed, &told).map_err(|problem| problem.to_string()),
            None => {
                self.keep_early(Early { topic: topic.clone(), at_ns: message.log_time_ns, is_fixed, told })
            }
        };
        self.used(message, taken);
    }

    /// Moving frames of so long ago that they will not count make room for others.
    fn keep_early(&mut self, early: Early) -> Result<(), String> {
        let oldest_ns = early.at_ns.saturating_sub(TRANSFORM_AGE_MAX_NS);
        self.early.retain(|before| before.is_fixed || before.at_ns >= oldest_ns);
        if self.early.len() >= EARLY_MAX {
            return Err(format!(
                "frames: expected odometry before {EARLY_MAX} messages of frames, found none"
            ));
        }
        self.early.push(early);
        Ok(())
    }

    /// Whose frames count is known by the first odometry: what was told of frames before is taken over.
    fn begin(&mut self, odometry: &Odometry) {
        let mut intake = intake_of(odometry);
        for Early { topic, is_fixed, told, .. } in std::mem::take(&mut self.early) {
            let taken = placed(&mut intake, is_fixed, &told);
            self.noted(&topic, taken);
        }
        self.intake = Some(intake);
    }

    fn clock(&mut self, message: &RecordedMessage) {
        let Some(Clock { clock }) = self.kept::<Clock>(message) else { return };
        let Some(intake) = &mut self.intake else { return };
        let taken = intake.simulated_time(clock.nanoseconds(), arrival(message));
        self.used(message, taken);
    }

    fn kept<M: Named + DeserializeOwned>(&mut self, message: &RecordedMessage) -> Option<M> {
        self.used(message, read::<M>(message))
    }

    /// What was made of a message, or a note of why nothing was.
    fn used<T, E: Display>(&mut self, message: &RecordedMessage, made: Result<T, E>) -> Option<T> {
        self.noted(&message.channel.topic, made)
    }

    fn noted<T, E: Display>(&mut self, topic: &str, made: Result<T, E>) -> Option<T> {
        let noted = made.map_err(|problem| {
            let note = || (0, problem.to_string());
            self.refused.entry(topic.to_owned()).or_insert_with(note).0 += 1;
        });
        noted.ok()
    }

    pub(super) fn finish(self, ended_early: Option<String>) -> Result<BagDrive, BagDriveError> {
        let found = self.seen.iter().map(|(topic, kind)| format!("{topic} ({kind})"));
        let found = found.collect::<Vec<_>>().join(", ");
        let notes = self.refused.iter();
        let notes =
            notes.map(|(topic, (n, why))| format!("{n} messages on {topic} left out, the first for {why}"));
        let notes: Vec<String> = notes.collect();
        if self.log.n_rows() == 0 {
            let topic = self.topics.odometry.unwrap_or_else(|| "some topic".to_owned());
            let only = if found.is_empty() { "no message".to_owned() } else { format!("only {found}") };
            let found = [only].into_iter().chain(notes).chain(ended_early).collect::<Vec<_>>().join("; ");
            return Err(BagDriveError::NoOdometry { topic, found });
        }
        // A robot file names topics that not every bag holds; and only a bag that is whole tells what is not in it.
        let is_absent = |topic: &&String| !self.seen.contains_key(*topic);
        let asked = [&self.topics.command, &self.topics.imu].into_iter().flatten().find(is_absent);
        match asked.filter(|_| ended_early.is_none() && self.robot.is_none()) {
            Some(topic) => Err(BagDriveError::Absent { topic: topic.clone(), found }),
            None => Ok(BagDrive { log: self.log, ended_early, notes }),
        }
    }
}

fn placed(intake: &mut Intake, is_fixed: bool, told: &TfMessage) -> Result<(), IntakeError> {
    if is_fixed { intake.fixed_frames(told) } else { intake.moving_frames(told) }
}

/// An intake for odometry that is of the vehicle already, on whatever clock.
fn intake_of(odometry: &Odometry) -> Intake {
    let frames = Frames { map: odometry.header.frame_id.clone(), vehicle: odometry.child_frame_id.clone() };
    let classes = Classes::Geometry(GeometryClasses { column_m: 1.0, step_m: 1.0, plants_max_m: 1.0 });
    let unused = Clouds { meaning: Meaning { classes, times: None }, sensors: Vec::new() };
    let clock = StampClock::new(StampSource::OfItsOwn);
    Intake::new(frames, unused, clock, Transforms::new(TRANSFORM_AGE_MAX_NS))
}
