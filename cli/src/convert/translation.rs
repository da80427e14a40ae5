//! Messages of a recording as those of ROS 2.

use std::collections::BTreeMap;

use bicycle::{Column, Command, Decision, DriveRow, Limits};
use bus::channel::Header as ChannelHeader;
use bus::message::{
    CommandRecord, ImuRecord, LAYOUT_VERSION, OdometryRecord, PointRecord, ScanHeader, Stamp,
};
use formats::{DriveLogFields, RecordedMessage, recorded_best_rollout, recorded_risk, recorded_scan};
use ros::bag::MessageWriter;
use ros::message::{Defined, Header, Time};
use ros::telling;
use runtime::recorder::topic;
use runtime::replay::{recorded_message, recorded_stamp};
use runtime::setup::{MachineSetup, RecordedSetup};
use serde::Serialize;
use terrain::{Mount, Pose, Scan};
use traversability::{Risk, RiskMapView};

use crate::UsageError;

/// The frames, as a robot file has them when it says nothing else; topics, too, are those of such a file.
const MAP_FRAME: &str = "map";
const VEHICLE_FRAME: &str = "base_link";
const ODOMETRY: &str = "/odom";
const TRANSFORMS: &str = "/tf";
const IMU: &str = "/imu";
const POINTS: &str = "/points";
const COMMAND: &str = "/command";
const PLAN: &str = "/plan";
const RISK: &str = "/risk";

/// Writes what is recorded into a bag.
pub(super) struct Translation {
    bag: MessageWriter,
    limits: Option<Limits>,
    /// Of a run of processes, whose messages are recorded as they went over its channels.
    run: Option<Run>,
    fields: Option<DriveLogFields>,
    steering_rad: f64,
    n_written: u64,
    left_out: BTreeMap<&'static str, u64>,
}

/// What a run says of itself.
struct Run {
    setup: RecordedSetup,
    mounts: Vec<Mount>,
    /// How far the time of day is ahead of the recording's clock [ns].
    lead_ns: i64,
}

impl Translation {
    /// Into a bag that is empty yet; the limits are for recordings that do not say of which vehicle they are.
    pub fn new(bag: MessageWriter, limits: Option<Limits>) -> Self {
        let (run, fields, left_out) = (None, None, BTreeMap::new());
        Self { bag, limits, run, fields, steering_rad: 0.0, n_written: 0, left_out }
    }

    /// Whether nothing was written.
    pub fn is_empty(&self) -> bool {
        self.n_written == 0
    }

    /// What was left out, and why.
    pub fn notes(&self) -> Vec<String> {
        let told = |(why, n): (&&str, &u64)| format!("{n} messages left out: {why}");
        self.left_out.iter().map(told).collect()
    }

    /// Completes the bag; returns the messages of each topic.
    pub fn finish(self) -> anyhow::Result<BTreeMap<String, u64>> {
        Ok(self.bag.finish()?)
    }

    /// Takes over a message. Errors: it is none of its topic, which is a [`UsageError`], or cannot be written.
    pub fn take(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let name = message.channel.topic.as_str();
        if name.starts_with(topic::CHANNELS) {
            let version = recorded_stamp(&message.data).map(|stamp| stamp.layout_version);
            if version != Some(LAYOUT_VERSION) {
                let found = version.map_or_else(|| "none".to_owned(), |version| version.to_string());
                return Err(refused(name, &format!("a message of layout {LAYOUT_VERSION}, found {found}")));
            }
        }
        match (name, self.run.is_some()) {
            (topic::SETUP, _) => self.setup(&message.data),
            (topic::ODOMETRY, _) => self.odometry_of_channel(&message.data),
            (topic::IMU, _) => self.imu(&message.data),
            (topic::SCAN, _) => self.scan_of_channel(&message.data),
            (topic::COMMAND, _) => self.command_of_channel(&message.data),
            ("/risk", _) => self.risk(message),
            // Beside the channels of a run these show the same again.
            ("/drive_log", false) => self.drive_row(message),
            ("/scan", false) => {
                let scan = recorded_scan(message).map_err(|problem| refused(name, &problem))?;
                self.scan(scan.valid_at_ns, &scan)
            }
            ("/command", false) => self.command(message),
            ("/rollouts", false) => self.plan(message),
            _ => Ok(()),
        }
    }

    fn setup(&mut self, data: &[u8]) -> anyhow::Result<()> {
        let format = RecordedSetup::format_of(data);
        let expected = RecordedSetup::FORMAT;
        if format != Some(expected) {
            let found = format.map_or_else(|| "none".to_owned(), |format| format.to_string());
            return Err(refused(topic::SETUP, &format!("a recording of version {expected}, found {found}")));
        }
        let setup: RecordedSetup =
            serde_json::from_slice(data).map_err(|error| refused(topic::SETUP, &error.to_string()))?;
        if self.run.as_ref().is_some_and(|run| !run.setup.is_of_same_run(&setup)) {
            return Err(refused(topic::SETUP, "files of one run, found another setup than before"));
        }
        let machine = MachineSetup::read(&setup).map_err(UsageError::from_input)?;
        let number = |text: &str| {
            text.parse::<i64>()
                .map_err(|_| refused(topic::SETUP, &format!("a time in nanoseconds, found {text:?}")))
        };
        let lead_ns = number(&setup.clock.utc_ns)? - number(&setup.clock.monotonic_ns)?;
        self.limits = Some(machine.vehicle.limits);
        self.run = Some(Run { setup, mounts: machine.config.sensors, lead_ns });
        Ok(())
    }

    fn odometry_of_channel(&mut self, data: &[u8]) -> anyhow::Result<()> {
        let (stamp, records) = of_channel::<Stamp, OdometryRecord>(topic::ODOMETRY, data)?;
        for record in records {
            let [x_m, y_m, z_m] = record.position_m;
            let [roll_rad, pitch_rad, yaw_rad] = record.attitude_rad;
            let pose = Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad };
            self.steering_rad = record.steering_rad;
            self.odometry(stamp.valid_at_ns, &pose, record.velocity_mps, record.yaw_rate_radps)?;
        }
        Ok(())
    }

    /// What a simulated or played drive measured.
    fn drive_row(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let not_a_row = || refused("/drive_log", "a row of a drive log, found other bytes");
        if self.fields.is_none() {
            self.fields = DriveLogFields::of(&message.channel.schema_data);
        }
        let decoded = self.fields.as_ref().and_then(|fields| fields.decode(&message.data));
        let (_, row) = decoded.ok_or_else(not_a_row)?;
        let Some(pose) = pose(&row) else {
            *self.left_out.entry("rows of the drive log without a pose and a velocity").or_default() += 1;
            return Ok(());
        };
        let [vx, vy, wz] = [Column::Vx, Column::Vy, Column::Wz].map(|column| row.value(column));
        self.odometry(message.log_time_ns, &pose, [vx, vy], wz)
    }

    fn odometry(
        &mut self,
        at_ns: u64,
        pose: &Pose,
        velocity_mps: [f64; 2],
        yaw_rate_radps: f64,
    ) -> anyhow::Result<()> {
        let header = self.header(at_ns, MAP_FRAME);
        let told = telling::odometry(header, VEHICLE_FRAME, pose, velocity_mps, yaw_rate_radps);
        self.write(ODOMETRY, at_ns, &told)?;
        self.write(TRANSFORMS, at_ns, &telling::transforms(&told))
    }

    fn imu(&mut self, data: &[u8]) -> anyhow::Result<()> {
        let (_, samples) = of_channel::<Stamp, ImuRecord>(topic::IMU, data)?;
        for sample in samples {
            let at_ns = sample.valid_at_ns;
            self.write(IMU, at_ns, &telling::imu(self.header(at_ns, VEHICLE_FRAME), &sample))?;
        }
        Ok(())
    }

    fn scan_of_channel(&mut self, data: &[u8]) -> anyhow::Result<()> {
        let (header, points) = of_channel::<ScanHeader, PointRecord>(topic::SCAN, data)?;
        let mounts = self.run.as_ref().map_or(&[][..], |run| &run.mounts);
        let Some(scan) = header.scan(&points, mounts) else {
            *self.left_out.entry("scans of sensors that the recording does not describe").or_default() += 1;
            return Ok(());
        };
        self.scan(header.stamp.valid_at_ns, &scan)
    }

    fn scan(&mut self, at_ns: u64, scan: &Scan) -> anyhow::Result<()> {
        self.write(POINTS, at_ns, &telling::cloud(self.header(at_ns, VEHICLE_FRAME), scan))
    }

    /// Commands to stand leave the wheels as they are, as a bridge tells it.
    fn command_of_channel(&mut self, data: &[u8]) -> anyhow::Result<()> {
        let (stamp, records) = of_channel::<Stamp, CommandRecord>(topic::COMMAND, data)?;
        for decision in records.iter().filter_map(CommandRecord::decision) {
            let command = match decision {
                Decision::Drive(command) => command,
                Decision::Hold(_) | Decision::Stop(_) => {
                    Command { speed_mps: 0.0, steering_rad: self.steering_rad as f32 }
                }
            };
            self.told(stamp.valid_at_ns, command)?;
        }
        Ok(())
    }

    fn command(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let command = serde_json::from_slice(&message.data);
        let command = command.map_err(|error| refused("/command", &format!("a command, found: {error}")))?;
        self.told(message.log_time_ns, command)
    }

    fn told(&mut self, at_ns: u64, command: Command) -> anyhow::Result<()> {
        self.write(COMMAND, at_ns, &telling::ackermann(self.header(at_ns, VEHICLE_FRAME), command))
    }

    /// The best future; each of its poses looks to the next one.
    fn plan(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let points_m = recorded_best_rollout(message).map_err(|problem| refused("/rollouts", &problem))?;
        let mut yaw_rad = 0.0;
        let poses = points_m.iter().enumerate().map(|(place, &[x_m, y_m, _])| {
            if let Some([next_x_m, next_y_m, _]) = points_m.get(place + 1) {
                yaw_rad = f64::atan2(next_y_m - y_m, next_x_m - x_m);
            }
            [x_m, y_m, yaw_rad]
        });
        let path = telling::path(self.header(message.log_time_ns, MAP_FRAME), poses);
        self.write(PLAN, message.log_time_ns, &path)
    }

    fn risk(&mut self, message: &RecordedMessage) -> anyhow::Result<()> {
        let Some(limits) = &self.limits else {
            let why = "risks of a vehicle whose limits the recording does not tell; name it with --vehicle";
            *self.left_out.entry(why).or_default() += 1;
            return Ok(());
        };
        let recorded = recorded_risk(message).map_err(|problem| refused("/risk", &problem))?;
        let risk = |&[linear_traction, angular_traction, roll_rad, pitch_rad]: &[f32; 4]| Risk {
            linear_traction,
            angular_traction,
            roll_rad,
            pitch_rad,
        };
        let risks: Vec<Risk> = recorded.risks.iter().map(risk).collect();
        let map = RiskMapView::new(recorded.geometry, 1, &risks, &recorded.ground)?;
        let header = self.header(message.log_time_ns, MAP_FRAME);
        let grid = telling::occupancy(header, &map, limits);
        self.write(RISK, message.log_time_ns, &grid)
    }

    fn header(&self, at_ns: u64, frame: &str) -> Header {
        let stamp = Time::from_nanoseconds(self.day_ns(at_ns) as i64);
        Header { stamp, frame_id: frame.to_owned() }
    }

    /// A time of the recording, of day where it tells how its clock stood to that [ns].
    fn day_ns(&self, at_ns: u64) -> u64 {
        at_ns.saturating_add_signed(self.run.as_ref().map_or(0, |run| run.lead_ns))
    }

    fn write<M: Defined + Serialize>(&mut self, topic: &str, at_ns: u64, message: &M) -> anyhow::Result<()> {
        self.bag.write(topic, self.day_ns(at_ns), message)?;
        self.n_written += 1;
        Ok(())
    }
}

/// Where a row of a drive log has the vehicle; what no log on level ground tells is zero.
fn pose(row: &DriveRow) -> Option<Pose> {
    let known = |column| Some(row.value(column)).filter(|value| !value.is_nan());
    let or_level = |column| known(column).unwrap_or(0.0);
    known(Column::Vx).and(known(Column::Vy)).and(known(Column::Wz))?;
    Some(Pose {
        x_m: known(Column::X)?,
        y_m: known(Column::Y)?,
        z_m: or_level(Column::Z),
        roll_rad: or_level(Column::Roll),
        pitch_rad: or_level(Column::Pitch),
        yaw_rad: known(Column::Yaw)?,
    })
}

fn of_channel<H: ChannelHeader, T: bytemuck::AnyBitPattern>(
    name: &str,
    data: &[u8],
) -> anyhow::Result<(H, Vec<T>)> {
    recorded_message(data).ok_or_else(|| refused(name, "a message of the channel, found other bytes"))
}

fn refused(topic: &str, problem: &str) -> anyhow::Error {
    UsageError(format!("{topic}: expected {}", problem.trim_start_matches("expected "))).into()
}
