//! What the sensors said, wherever it came from, and what that tells of them.

use bus::ages::Periods;
use bus::message::{ImuRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};

use super::inertial::Inertial;
use super::motion::Motion;
use super::regularity::Regularity;
use super::scans::Scans;
use super::yaw::Yaws;
use super::{Expected, Finding};

/// What says something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Where the vehicle is.
    Odometry,
    /// Range sensors.
    Scans,
    /// The inertial unit.
    Imu,
}

/// The messages of a robot's sensors, as far as they are looked at.
#[derive(Debug, Default)]
pub struct Observed {
    times: Regularity,
    motion: Motion,
    scans: Scans,
    yaws: Yaws,
    inertial: Inertial,
}

impl Observed {
    /// Takes in where the vehicle is.
    pub fn odometry(&mut self, stamp: &Stamp, records: &[OdometryRecord]) {
        self.times.note(stamp);
        for record in records {
            self.motion.note(stamp.valid_at_ns, record);
            self.yaws.note_odometry(stamp.valid_at_ns, record);
        }
    }

    /// Takes in a sweep of a range sensor.
    pub fn scan(&mut self, header: &ScanHeader, points: &[PointRecord]) {
        self.scans.note(header, points);
        self.yaws.note_scan(header, points);
    }

    /// Takes in samples of the inertial unit.
    pub fn imu(&mut self, stamp: &Stamp, samples: &[ImuRecord]) {
        self.inertial.note(stamp, samples);
    }

    /// What was found in so much time [s]; behind what each source said stands what of it nobody would take.
    pub fn findings(
        &self,
        expected: &Expected,
        watched_s: f64,
        refused: impl Fn(Source) -> Option<Finding>,
    ) -> Vec<Finding> {
        let Expected { periods, mounts, wheel_and_length_m } = expected;
        let hz = |period_s: fn(&Periods) -> f64| periods.as_ref().map(|periods| period_s(periods).recip());
        let mut findings = vec![self.times.finding("odometry", hz(|periods| periods.odometry_s), watched_s)];
        findings.extend(refused(Source::Odometry));
        findings.extend(self.motion.findings());
        let scan_hz = hz(|periods| periods.scan_s);
        findings.extend(self.scans.findings(scan_hz, mounts, *wheel_and_length_m, watched_s));
        findings.extend(self.yaws.findings(mounts));
        findings.extend(refused(Source::Scans));
        findings.extend(self.inertial.findings(&self.motion, watched_s));
        findings.extend(refused(Source::Imu));
        findings
    }
}
