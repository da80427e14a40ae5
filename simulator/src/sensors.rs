//! What the simulated vehicle measures, on its way into the channels.

use bicycle::{Applied, ImuSample};
use bus::channel::{Bus, ChannelError, IMU, ODOMETRY, Outlet, SCAN};
use bus::message::{ImuRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};
use scenarios::Observation;

/// Returns of a sweep at the most.
pub const POINTS_MAX: usize = 1 << 16;
/// Inertial samples between two odometry messages at the most.
const SAMPLES_MAX: usize = 256;

/// The vehicle's ways into the channels of what it measures.
pub(crate) struct Sensors {
    odometry: Outlet<Stamp, OdometryRecord>,
    imu: Outlet<Stamp, ImuRecord>,
    scans: Outlet<ScanHeader, PointRecord>,
}

impl Sensors {
    pub(crate) fn open(bus: &Bus) -> Result<Self, ChannelError> {
        let (odometry, scans) = (bus.outlet(&ODOMETRY, 1)?, bus.outlet(&SCAN, POINTS_MAX)?);
        Ok(Self { odometry, imu: bus.outlet(&IMU, SAMPLES_MAX)?, scans })
    }

    /// Where the vehicle is, at `at_ns`, and what its actuators were told last.
    pub(crate) fn tell_odometry(
        &mut self,
        observation: &Observation,
        applied: &Applied,
        at_ns: u64,
    ) -> Result<(), ChannelError> {
        let record = OdometryRecord::from(&observation.odometry).with_applied(applied);
        self.odometry.send_one(Stamp::default(), record, at_ns).map(drop)
    }

    /// Inertial samples, if there are any, and the sweep, if one was finished. The episode's clock began at `began_ns`
    /// of the bus's.
    pub(crate) fn tell_surroundings(
        &mut self,
        observation: &Observation,
        began_ns: u64,
        at_ns: u64,
    ) -> Result<(), ChannelError> {
        let samples = &observation.imu[observation.imu.len().saturating_sub(SAMPLES_MAX)..];
        if !samples.is_empty() {
            let of = |sample: &ImuSample| ImuRecord {
                valid_at_ns: began_ns + sample.valid_at_ns,
                ..ImuRecord::from(sample)
            };
            let loan = self.imu.write(samples.len(), |place| of(&samples[place]))?;
            self.imu.send(loan, at_ns)?;
        }
        let Some(scan) = &observation.scan else { return Ok(()) };
        let n_points = scan.points.len().min(self.scans.n_max());
        let mut loan = self.scans.write(n_points, |place| PointRecord::from(&scan.points[place]))?;
        loan.header_mut().origin_m = scan.origin_m;
        self.scans.send(loan, at_ns).map(drop)
    }
}
