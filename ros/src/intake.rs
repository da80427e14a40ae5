//! What comes from the robot, as the bus says it: frames found, stamps told on the bus's clock, everything checked.

mod globe;
mod pace;

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use bus::ages::Periods;
use bus::clock;
use bus::message::{ImuRecord, OdometryRecord};

use crate::cloud::{self, LayoutError, Meaning, Sweep, Twist};
use crate::globe::{Georeference, GlobeError};
use crate::goals::{self, GoalError};
use crate::message::{Imu, Odometry, Path, PointCloud2, PoseArray, PoseStamped, TfMessage};
use crate::odometry::{self, Agreement, Disagreement, Frames, OdometryError};
use crate::rigid::{self, PoseError};
use crate::stamps::{Arrival, StampClock, StampError};
use crate::transforms::{TransformError, Transforms};
use pace::Pace;
pub use pace::TooOften;

/// Why a message is not taken over. Every message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntakeError {
    /// When it was measured cannot be told.
    #[error(transparent)]
    Stamp(#[from] StampError),
    /// It is no odometry of the vehicle.
    #[error(transparent)]
    Odometry(#[from] OdometryError),
    /// Its velocity is of another frame.
    #[error(transparent)]
    Disagreement(#[from] Disagreement),
    /// It is no cloud.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// Where it was measured cannot be told.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// It is no transform of a frame.
    #[error("frame {frame:?}: {source}")]
    Frame {
        /// The frame that it tells of.
        frame: String,
        /// Why.
        source: PoseError,
    },
    /// Its numbers are none.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// It is nowhere to go to.
    #[error(transparent)]
    Goal(#[from] GoalError),
    /// It tells nothing of where the map lies on the globe.
    #[error(transparent)]
    Globe(#[from] GlobeError),
    /// Of a cloud, no point could be used.
    #[error("data: expected returns of the sensor, found {found} points, none of which is a place")]
    NoReturn {
        /// Points of the cloud.
        found: usize,
    },
    /// There is more of it than the robot file states.
    #[error(transparent)]
    TooOften(#[from] TooOften),
    /// It is older than one that came before.
    #[error("stamp: expected one after that of the message before, found one {by_s:.3} s before it")]
    OutOfOrder {
        /// By how much [s].
        by_s: f64,
    },
}

/// A scan for the bus.
#[derive(Clone, Debug, PartialEq)]
pub struct TakenScan {
    /// When it was measured [ns].
    pub at_ns: u64,
    /// Where its rays start, in the frame of the points [m].
    pub origin_m: [f32; 3],
    /// Whose frame that is: 0 = the vehicle's body, else the sensor of this number.
    pub sensor: u32,
    /// The points.
    pub sweep: Sweep,
}

/// What clouds are, and where the sensors sit that the robot file mounts.
#[derive(Clone, Debug)]
pub struct Clouds {
    /// What their fields mean.
    pub meaning: Meaning,
    /// Frames of the sensors, numbered from 1, with what takes their places to the vehicle's frame.
    pub sensors: Vec<(String, Isometry3<f64>)>,
}

/// Odometry that is farther from a cloud or fix in time than this says nothing of how the vehicle moved meanwhile [ns].
const MOTION_AGE_MAX_NS: u64 = 300_000_000;

/// What is known of the robot's frames and clocks.
#[derive(Clone, Debug)]
pub struct Intake {
    frames: Frames,
    clouds: Clouds,
    clock: StampClock,
    transforms: Transforms,
    agreement: Agreement,
    /// The newest cloud, and that of each frame [ns].
    scanned_at_ns: u64,
    seen_at_ns: BTreeMap<String, u64>,
    felt_at_ns: u64,
    /// Where the vehicle is and how it moves, and the time that was told of [ns].
    told: Option<(u64, OdometryRecord)>,
    georeference: Georeference,
    paces: Option<Paces>,
}

/// What odometry, and the clouds of each frame, are kept to.
#[derive(Clone, Debug)]
struct Paces {
    odometry: Pace,
    scan: Pace,
    clouds: BTreeMap<String, Pace>,
}

impl Intake {
    /// Nothing has come yet.
    pub fn new(frames: Frames, clouds: Clouds, clock: StampClock, transforms: Transforms) -> Self {
        let agreement = Agreement::default();
        Self {
            frames,
            clouds,
            clock,
            transforms,
            agreement,
            scanned_at_ns: 0,
            seen_at_ns: BTreeMap::new(),
            felt_at_ns: 0,
            told: None,
            georeference: Georeference::default(),
            paces: None,
        }
    }

    /// Where odometry or the clouds of a frame come more than three times as often, they are kept to these periods.
    pub fn kept_to(self, periods: &Periods) -> Self {
        let pace = |period_s: f64| Pace::new(clock::nanoseconds(period_s));
        let [odometry, scan] = [pace(periods.odometry_s), pace(periods.scan_s)];
        Self { paces: Some(Paces { odometry, scan, clouds: BTreeMap::new() }), ..self }
    }

    /// The clock of the robot's stamps.
    pub fn clock(&self) -> &StampClock {
        &self.clock
    }

    /// The frame that everything is carried to.
    pub fn map_frame(&self) -> &str {
        &self.frames.map
    }

    /// Where the vehicle is, and when it was there [ns].
    ///
    /// # Errors
    /// See [`IntakeError`].
    pub fn odometry(
        &mut self,
        odometry: &Odometry,
        arrival: Arrival,
    ) -> Result<(u64, OdometryRecord), IntakeError> {
        let at_ns = self.at_ns(odometry.header.stamp.nanoseconds(), arrival)?;
        let record = odometry::odometry_record(odometry, &self.transforms, &self.frames)?;
        if let Some(paces) = &mut self.paces {
            paces.odometry.check(at_ns)?;
        }
        self.agreement.check(&record, at_ns)?;
        self.told = Some((at_ns, record));
        Ok((at_ns, record))
    }

    /// A sweep of a sensor: in its own frame where the robot file mounts one of the name of the cloud's frame, else in
    /// that of the vehicle; of at most `n_max` points. Where points have times, each is told as if it had been measured at
    /// the stamp: what the vehicle moves meanwhile, as its last odometry says, is taken out.
    ///
    /// One of several sensors may come later than another's newer cloud: it is told in the same way, as if it had been
    /// measured when that was, since the bus takes scans in their order.
    ///
    /// # Errors
    /// See [`IntakeError`].
    pub fn cloud(
        &mut self,
        cloud: &PointCloud2,
        arrival: Arrival,
        n_max: usize,
    ) -> Result<TakenScan, IntakeError> {
        let stamp_ns = cloud.header.stamp.nanoseconds();
        let at_ns = self.at_ns(stamp_ns, arrival)?;
        let frame = &cloud.header.frame_id;
        let twist = self.told_near(at_ns).map(|(_, record)| twist_of(&record));
        let late_s = self.late_s(frame, at_ns, twist.is_some())?;
        let Clouds { meaning, sensors } = &self.clouds;
        let (sensor, mounting, motion) = match sensors.iter().position(|(sensor, _)| sensor == frame) {
            Some(place) => (place as u32 + 1, sensors[place].1, Isometry3::identity()),
            None => {
                let motion = self.transforms.between(frame, &self.frames.vehicle, stamp_ns)?;
                (0, motion, motion)
            }
        };
        if let Some(Paces { scan, clouds, .. }) = &mut self.paces {
            // Frames that nobody knows were refused: there are as many as the robot has.
            clouds.entry(frame.clone()).or_insert_with(|| scan.clone()).check(at_ns)?;
        }
        let told = |after_s: f64| match twist {
            // From the sensor to the vehicle then, to the vehicle at the time that is told, and to the frame that is told.
            Some(twist) if after_s != late_s => {
                motion * mounting.inverse() * twist.over(after_s - late_s) * mounting
            }
            _ => motion,
        };
        // Points are told in the sensor's frame or in the vehicle's, which stands upright.
        let to_upright = mounting * motion.inverse();
        let sweep = cloud::sweep(cloud, meaning, n_max, &to_upright, told)?;
        if sweep.points.is_empty() {
            return Err(IntakeError::NoReturn { found: sweep.n_without_place });
        }
        self.seen_at_ns.insert(frame.clone(), at_ns);
        self.scanned_at_ns = self.scanned_at_ns.max(at_ns);
        let origin_m = told(0.0).translation.vector.map(|axis_m| axis_m as f32).into();
        Ok(TakenScan { at_ns: self.scanned_at_ns, origin_m, sensor, sweep })
    }

    /// The newest odometry, if it was told of about this time.
    fn told_near(&self, at_ns: u64) -> Option<(u64, OdometryRecord)> {
        self.told.filter(|(told_at_ns, _)| told_at_ns.abs_diff(at_ns) <= MOTION_AGE_MAX_NS)
    }

    /// How much older a cloud is than the newest of another sensor [s]. What lies so far back that nobody knows how the
    /// vehicle moved since, or before one of the same frame, is out of order.
    fn late_s(&self, frame: &str, at_ns: u64, is_motion_known: bool) -> Result<f64, IntakeError> {
        let out_of_order = |newest_ns: u64| {
            Err(IntakeError::OutOfOrder { by_s: newest_ns.saturating_sub(at_ns) as f64 * 1e-9 })
        };
        match self.seen_at_ns.get(frame) {
            Some(&seen_at_ns) if at_ns < seen_at_ns => return out_of_order(seen_at_ns),
            _ => {}
        }
        match self.scanned_at_ns.saturating_sub(at_ns) {
            0 => Ok(0.0),
            late_ns if is_motion_known && late_ns <= MOTION_AGE_MAX_NS => Ok(late_ns as f64 * 1e-9),
            _ => out_of_order(self.scanned_at_ns),
        }
    }

    /// What the inertial unit feels, in the vehicle's frame. What a lever arm adds is left in: units sit near the middle.
    ///
    /// # Errors
    /// See [`IntakeError`].
    pub fn imu(&mut self, imu: &Imu, arrival: Arrival) -> Result<ImuRecord, IntakeError> {
        let stamp_ns = imu.header.stamp.nanoseconds();
        let at_ns = self.at_ns(stamp_ns, arrival)?;
        if at_ns <= self.felt_at_ns {
            return Err(IntakeError::OutOfOrder { by_s: (self.felt_at_ns - at_ns) as f64 * 1e-9 });
        }
        let motion = self.transforms.between(&imu.header.frame_id, &self.frames.vehicle, stamp_ns)?;
        let acceleration = rigid::axes("linear_acceleration", imu.linear_acceleration)?;
        let rate = rigid::axes("angular_velocity", imu.angular_velocity)?;
        self.felt_at_ns = at_ns;
        let [acceleration, rate] = [acceleration, rate].map(|vector| motion.rotation * vector);
        Ok(ImuRecord {
            valid_at_ns: at_ns,
            acceleration_mps2: acceleration.map(|axis| axis as f32).into(),
            angular_rate_radps: rate.map(|axis| axis as f32).into(),
        })
    }

    /// Where frames stay for good.
    ///
    /// # Errors
    /// [`IntakeError::Frame`] of the last one that is none; the others are taken over.
    pub fn fixed_frames(&mut self, told: &TfMessage) -> Result<(), IntakeError> {
        self.frames_told(told, |tree, parent, child, _, motion| tree.fix(parent, child, motion))
    }

    /// Where frames are now. Errors: as [`Intake::fixed_frames`].
    ///
    /// # Errors
    /// As [`Intake::fixed_frames`].
    pub fn moving_frames(&mut self, told: &TfMessage) -> Result<(), IntakeError> {
        self.frames_told(told, |tree, parent, child, at_ns, motion| tree.place(parent, child, at_ns, motion))
    }

    fn frames_told(
        &mut self,
        told: &TfMessage,
        take: impl Fn(&mut Transforms, &str, &str, i64, Isometry3<f64>),
    ) -> Result<(), IntakeError> {
        let mut refused = Ok(());
        for stamped in &told.transforms {
            let (header, child) = (&stamped.header, &stamped.child_frame_id);
            match rigid::motion_of_transform(&stamped.transform) {
                Ok(motion) => {
                    let at_ns = header.stamp.nanoseconds();
                    take(&mut self.transforms, &header.frame_id, child, at_ns, motion);
                }
                Err(source) => refused = Err(IntakeError::Frame { frame: child.clone(), source }),
            }
        }
        refused
    }

    /// The simulator's time.
    ///
    /// # Errors
    /// It has jumped.
    pub fn simulated_time(&mut self, clock_ns: i64, arrival: Arrival) -> Result<(), IntakeError> {
        let ticked = self.clock.tick(clock_ns, arrival);
        self.after_jump(ticked)
    }

    /// A goal in the map [m].
    ///
    /// # Errors
    /// See [`GoalError`].
    pub fn goal(&self, goal: &PoseStamped) -> Result<Vec<[f64; 2]>, IntakeError> {
        Ok(goals::of_pose(goal, &self.transforms, &self.frames.map)?)
    }

    /// Goals in the map, in their order [m].
    ///
    /// # Errors
    /// See [`GoalError`].
    pub fn goals(&self, goals: &PoseArray) -> Result<Vec<[f64; 2]>, IntakeError> {
        Ok(goals::of_array(goals, &self.transforms, &self.frames.map)?)
    }

    /// The corners of a path in the map [m].
    ///
    /// # Errors
    /// See [`GoalError`].
    pub fn path(&self, path: &Path) -> Result<Vec<[f64; 2]>, IntakeError> {
        Ok(goals::of_path(path, &self.transforms, &self.frames.map)?)
    }

    fn at_ns(&mut self, stamp_ns: i64, arrival: Arrival) -> Result<u64, IntakeError> {
        let at_ns = self.clock.at_ns(stamp_ns, arrival);
        self.after_jump(at_ns)
    }

    /// Of a clock that has jumped, the frames of before are of another time.
    fn after_jump<T>(&mut self, told: Result<T, StampError>) -> Result<T, IntakeError> {
        if let Err(StampError::Jumped { .. }) = told {
            self.transforms.forget_moving();
        }
        Ok(told?)
    }
}

/// How the vehicle moves, in its own frame.
fn twist_of(record: &OdometryRecord) -> Twist {
    let [forward_mps, left_mps] = record.velocity_mps;
    let velocity_mps = Vector3::new(forward_mps, left_mps, 0.0);
    Twist { velocity_mps, rate_radps: Vector3::z() * record.yaw_rate_radps }
}

#[cfg(test)]
mod tests;
