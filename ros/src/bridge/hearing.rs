//! The topics that are heard, and what becomes of each message.

use std::fmt::Display;

use bus::channel::{Bus, ChannelError, IMU, ODOMETRY, Outlet, SCAN};
use bus::clock::{self, SECOND_NS};
use bus::message::{ImuRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};
use formats::RosTopics;
use ros2_client::Gid;

use super::{Bridge, BridgeError, arrival};
use crate::actuation::Halt;
use crate::alarm::{Alarm, Turn};
use crate::complaints::Complaints;
use crate::intake::{IntakeError, TakenScan};
use crate::message::{
    Bool, Clock, GeoPoseStamped, Imu, NavSatFix, Odometry, Path, PointCloud2, PoseArray, PoseStamped,
    TfMessage,
};
use crate::node::{Ear, Hearing, Node};
use crate::orders::{FLOOD, Order};

/// Returns of a scan at the most.
const POINTS_MAX: usize = 1 << 16;
/// Inertial samples of a message at the most.
const SAMPLES_MAX: usize = 256;

/// What is listened to, and where it goes on the bus.
pub(super) struct Ears {
    movement: Option<Ear<Odometry>>,
    points: Vec<Ear<PointCloud2>>,
    imu: Option<Ear<Imu>>,
    moving: Option<Ear<TfMessage>>,
    fixed: Option<Ear<TfMessage>>,
    clock: Option<Ear<Clock>>,
    goal: Option<Ear<PoseStamped>>,
    goals: Option<Ear<PoseArray>>,
    goal_on_globe: Option<Ear<GeoPoseStamped>>,
    fix: Option<Ear<NavSatFix>>,
    path: Option<Ear<Path>>,
    emergency: Vec<Ear<Bool>>,
    alarm: Alarm<Gid>,
    pause: Option<Ear<Bool>>,
    outlets: Outlets,
    /// Where the vehicle was last, and when [ns].
    pub(super) odometry: Option<(u64, OdometryRecord)>,
    pub(super) scan_at_ns: Option<u64>,
    /// Messages so far.
    pub(super) n_heard: u64,
}

struct Outlets {
    odometry: Outlet<Stamp, OdometryRecord>,
    scans: Outlet<ScanHeader, PointRecord>,
    imu: Outlet<Stamp, ImuRecord>,
}

impl Ears {
    pub(super) fn new(bus: &Bus, node: &mut Node, topics: &RosTopics) -> Result<Self, BridgeError> {
        let outlets = Outlets {
            odometry: bus.outlet(&ODOMETRY, 1)?,
            scans: bus.outlet(&SCAN, POINTS_MAX)?,
            imu: bus.outlet(&IMU, SAMPLES_MAX)?,
        };
        let mut points = Vec::new();
        for topic in &topics.points {
            points.extend(node.listen(topic, Hearing::Loose(2))?);
        }
        let mut emergency = Vec::new();
        for hearing in [Hearing::Loose(8), Hearing::Sure(8)] {
            emergency.extend(node.listen(&topics.emergency_stop, hearing)?);
        }
        Ok(Self {
            movement: node.listen(&topics.odometry, Hearing::Loose(32))?,
            points,
            imu: node.listen(&topics.imu, Hearing::Loose(128))?,
            moving: node.listen(&topics.tf, Hearing::Loose(128))?,
            fixed: node.listen(&topics.tf_static, Hearing::Kept(128))?,
            clock: node.listen(&topics.clock, Hearing::Loose(8))?,
            goal: node.listen(&topics.goal, Hearing::Sure(8))?,
            goals: node.listen(&topics.goals, Hearing::Sure(8))?,
            goal_on_globe: node.listen(&topics.goal_on_globe, Hearing::Sure(8))?,
            fix: node.listen(&topics.fix, Hearing::Loose(8))?,
            path: node.listen(&topics.path, Hearing::Sure(8))?,
            emergency,
            alarm: Alarm::default(),
            pause: node.listen(&topics.pause, Hearing::Sure(8))?,
            outlets,
            odometry: None,
            scan_at_ns: None,
            n_heard: 0,
        })
    }
}

/// Hands over what has come on a topic that is listened to, without what cannot be read.
fn heard<M: serde::de::DeserializeOwned + 'static>(
    ear: &mut Option<Ear<M>>,
    refused: &mut Refused<'_>,
) -> Vec<M> {
    ear.as_mut().map(|ear| heard_by(ear, refused)).unwrap_or_default()
}

fn heard_by<M: serde::de::DeserializeOwned + 'static>(ear: &mut Ear<M>, refused: &mut Refused<'_>) -> Vec<M> {
    let mut messages = Vec::new();
    ear.take(|topic, message| match message {
        Ok((message, _)) => messages.push(message),
        Err(problem) => refused.note(topic, &problem),
    });
    messages
}

/// Where what is wrong is counted and told.
pub(super) struct Refused<'a> {
    pub(super) complaints: &'a mut Complaints,
    pub(super) tell: &'a mut dyn FnMut(&str),
}

impl Refused<'_> {
    pub(super) fn note(&mut self, topic: &str, why: &dyn Display) {
        if let Some(line) = self.complaints.note(topic, why, clock::now_ns()) {
            (self.tell)(&line);
        }
    }

    fn kept<T>(&mut self, topic: &str, taken: Result<T, IntakeError>) -> Option<T> {
        taken.map_err(|why| self.note(topic, &why)).ok()
    }
}

impl Bridge {
    /// Takes in what has come: what stops the vehicle first, then what other messages are told by.
    pub(super) fn hear(&mut self, tell: &mut dyn FnMut(&str)) -> Result<(), BridgeError> {
        let mut complaints = std::mem::take(&mut self.complaints);
        let mut refused = Refused { complaints: &mut complaints, tell };
        for (topic, mismatch) in self.node.mismatches() {
            refused.note(&topic, &mismatch);
        }
        self.heed_namesakes(&mut refused);
        self.hear_emergency(&mut refused);
        self.hear_frames(&mut refused);
        let heard = self.hear_measurements(&mut refused);
        self.hear_orders(&mut refused);
        self.complaints = complaints;
        Ok(heard?)
    }

    /// Stands while another node has the name of this one, which is looked for once a second.
    fn heed_namesakes(&mut self, refused: &mut Refused<'_>) {
        let now_ns = clock::now_ns();
        if now_ns.saturating_sub(self.heeded_at_ns) < SECOND_NS {
            return;
        }
        self.heeded_at_ns = now_ns;
        let found = self.node.n_namesakes();
        if found == 0 {
            return self.actuation.release(Halt::Namesake);
        }
        self.actuation.stop(Halt::Namesake);
        let why = format!(
            "expected no other node of this name, found {found}; the vehicle stands until there is none"
        );
        refused.note(&format!("node {}", self.node.full_name()), &why);
    }

    fn hear_emergency(&mut self, refused: &mut Refused<'_>) {
        let mut said = Vec::new();
        for ear in &mut self.ears.emergency {
            ear.take(|topic, message| match message {
                Ok(message) => said.push(message),
                Err(problem) => refused.note(topic, &problem),
            });
        }
        for (Bool { data: is_emergency }, origin) in said {
            // The vehicle stands before anybody has answered.
            match self.ears.alarm.hear(origin.publisher, origin.sequence, is_emergency) {
                Some(Turn::On) => {
                    self.actuation.stop(Halt::Emergency);
                    self.order(Order::EmergencyStop, refused);
                }
                Some(Turn::Off) => {
                    self.actuation.release(Halt::Emergency);
                    self.order(Order::Reset, refused);
                }
                None => {}
            }
        }
    }

    fn hear_frames(&mut self, refused: &mut Refused<'_>) {
        let Self { ears, intake, .. } = self;
        for Clock { clock } in heard(&mut ears.clock, refused) {
            refused.kept("clock", intake.simulated_time(clock.nanoseconds(), arrival()));
        }
        for told in heard(&mut ears.fixed, refused) {
            refused.kept("tf_static", intake.fixed_frames(&told));
        }
        for told in heard(&mut ears.moving, refused) {
            refused.kept("tf", intake.moving_frames(&told));
        }
    }

    fn hear_measurements(&mut self, refused: &mut Refused<'_>) -> Result<(), ChannelError> {
        let Self { ears, intake, actuation, .. } = self;
        for odometry in heard(&mut ears.movement, refused) {
            ears.n_heard += 1;
            if let Some((at_ns, record)) = refused.kept("odometry", intake.odometry(&odometry, arrival())) {
                let record = actuation.complete(record, clock::now_ns());
                ears.outlets.odometry.send_one(Stamp::default(), record, at_ns)?;
                ears.odometry = Some((at_ns, record));
            }
        }
        // After the odometry of about the same time.
        for fix in heard(&mut ears.fix, refused) {
            ears.n_heard += 1;
            refused.kept("fix", intake.fix(&fix, arrival()));
        }
        let mut samples = Vec::new();
        for imu in heard(&mut ears.imu, refused) {
            ears.n_heard += 1;
            samples.extend(refused.kept("imu", intake.imu(&imu, arrival())));
        }
        ears.outlets.feel(&samples)?;
        for ear in &mut ears.points {
            let topic = ear.topic.clone();
            for cloud in heard_by(ear, refused) {
                ears.n_heard += 1;
                if let Some(scan) = refused.kept(&topic, intake.cloud(&cloud, arrival(), POINTS_MAX)) {
                    ears.outlets.see(&scan)?;
                    ears.scan_at_ns = Some(scan.at_ns);
                }
            }
        }
        Ok(())
    }

    fn hear_orders(&mut self, refused: &mut Refused<'_>) {
        for goal in heard(&mut self.ears.goal, refused) {
            if let Some(places_m) = refused.kept("goal", self.intake.goal(&goal)) {
                self.order(Order::Goals(places_m), refused);
            }
        }
        for goals in heard(&mut self.ears.goals, refused) {
            if let Some(places_m) = refused.kept("goals", self.intake.goals(&goals)) {
                self.order(Order::Goals(places_m), refused);
            }
        }
        for goal in heard(&mut self.ears.goal_on_globe, refused) {
            if let Some(places_m) = refused.kept("goal on globe", self.intake.goal_on_globe(&goal)) {
                self.order(Order::Goals(places_m), refused);
            }
        }
        for path in heard(&mut self.ears.path, refused) {
            if let Some(corners_m) = refused.kept("path", self.intake.path(&path)) {
                let speed_mps = self.services.parameters.path_speed_mps;
                self.order(Order::Path { corners_m, speed_mps }, refused);
            }
        }
        for Bool { data } in heard(&mut self.ears.pause, refused) {
            self.order(if data { Order::Pause } else { Order::Resume }, refused);
        }
    }

    fn order(&mut self, order: Order, refused: &mut Refused<'_>) {
        if self.orders.say(order).is_none() {
            refused.note("orders", &FLOOD);
        }
    }
}

impl Outlets {
    fn feel(&mut self, samples: &[ImuRecord]) -> Result<(), ChannelError> {
        let samples = &samples[samples.len().saturating_sub(SAMPLES_MAX)..];
        let Some(last) = samples.last() else { return Ok(()) };
        let loan = self.imu.write(samples.len(), |place| samples[place])?;
        self.imu.send(loan, last.valid_at_ns).map(drop)
    }

    fn see(&mut self, scan: &TakenScan) -> Result<(), ChannelError> {
        let points = &scan.sweep.points;
        let mut loan = self.scans.write(points.len(), |place| points[place])?;
        let header = loan.header_mut();
        (header.origin_m, header.sensor) = (scan.origin_m, scan.sensor);
        self.scans.send(loan, scan.at_ns).map(drop)
    }
}
