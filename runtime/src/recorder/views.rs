//! What a person wants to see of a run, beside the messages themselves: poses, the drive log, now and then a map.

use bicycle::{Decision, DriveRow};
use formats::{DriveRecorder, RecordError};
use terrain::{Mount, Pose};

use bus::clock::SECOND_NS;
use bus::message::{
    CommandRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Stamp, SurfaceHeader, drive_row,
};
use bus::payload;

/// Time between two maps, and between two scans, that are shown [ns].
const MAP_NS: u64 = SECOND_NS;

/// Remembers what was shown last.
#[derive(Default)]
pub(super) struct Views {
    mounts: Vec<Mount>,
    odometry: Option<OdometryRecord>,
    scan_at_ns: u64,
    surface_at_ns: u64,
    risk_at_ns: u64,
    began_ns: Option<u64>,
}

impl Views {
    pub fn new(mounts: Vec<Mount>) -> Self {
        Self { mounts, ..Self::default() }
    }

    pub fn odometry(
        &mut self,
        recorder: &mut DriveRecorder,
        stamp: &Stamp,
        records: &[OdometryRecord],
    ) -> Result<(), RecordError> {
        self.odometry = records.first().copied().or(self.odometry);
        self.began_ns.get_or_insert(stamp.valid_at_ns);
        match &self.odometry {
            // Fifty a second are more than an eye sees.
            Some(odometry) if stamp.sequence.is_multiple_of(5) => {
                recorder.pose(stamp.valid_at_ns, &pose(odometry))
            }
            _ => Ok(()),
        }
    }

    /// A row of the drive log: what was commanded, and the last measurement.
    pub fn command(
        &mut self,
        recorder: &mut DriveRecorder,
        stamp: &Stamp,
        records: &[CommandRecord],
    ) -> Result<(), RecordError> {
        let (Some(odometry), Some(began_ns)) = (&self.odometry, self.began_ns) else { return Ok(()) };
        let Some(decision) = records.first().and_then(CommandRecord::decision) else { return Ok(()) };
        recorder.decision(stamp.valid_at_ns, &decision)?;
        let time_s = stamp.valid_at_ns.saturating_sub(began_ns) as f64 * 1e-9;
        recorder.drive_row(stamp.valid_at_ns, "1", &row(time_s, odometry, &decision))
    }

    pub fn scan(
        &mut self,
        recorder: &mut DriveRecorder,
        header: &ScanHeader,
        points: &[PointRecord],
    ) -> Result<(), RecordError> {
        if !is_due(&mut self.scan_at_ns, header.stamp.published_at_ns) {
            return Ok(());
        }
        let scan = header.scan(points, &self.mounts);
        scan.map_or(Ok(()), |scan| recorder.scan(header.stamp.valid_at_ns, &scan))
    }

    pub fn surface(
        &mut self,
        recorder: &mut DriveRecorder,
        header: &SurfaceHeader,
        cells: &[[f32; 8]],
    ) -> Result<(), RecordError> {
        if is_due(&mut self.surface_at_ns, header.stamp.published_at_ns)
            && let Some(map) = payload::surface_map(header, cells)
        {
            recorder.elevation(header.stamp.valid_at_ns, &map)?;
        }
        Ok(())
    }

    pub fn risk(
        &mut self,
        recorder: &mut DriveRecorder,
        header: &RiskHeader,
        elements: &[[f32; 4]],
    ) -> Result<(), RecordError> {
        if is_due(&mut self.risk_at_ns, header.stamp.published_at_ns)
            && let Some((map, _)) = payload::risk_views(header, elements)
        {
            let yaw_rad = self.odometry.map_or(0.0, |odometry| odometry.attitude_rad[2]);
            recorder.risk(header.stamp.valid_at_ns, &map, yaw_rad)?;
        }
        Ok(())
    }
}

fn is_due(last_ns: &mut u64, now_ns: u64) -> bool {
    let is_due = now_ns.saturating_sub(*last_ns) >= MAP_NS;
    if is_due {
        *last_ns = now_ns;
    }
    is_due
}

fn pose(odometry: &OdometryRecord) -> Pose {
    let [x_m, y_m, z_m] = odometry.position_m;
    let [roll_rad, pitch_rad, yaw_rad] = odometry.attitude_rad;
    Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
}

fn row(time_s: f64, record: &OdometryRecord, decision: &Decision) -> DriveRow {
    let command = match decision {
        Decision::Drive(command) => [f64::from(command.speed_mps), f64::from(command.steering_rad)],
        // The wheels stay as they are while it stops.
        Decision::Hold(_) | Decision::Stop(_) => [0.0, record.steering_rad],
    };
    drive_row(time_s, &record.odometry(0), command)
}
