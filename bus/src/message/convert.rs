//! Between the messages and what the pipeline is made of.

use bicycle::{
    Applied, AppliedBy, Column, Command, Decision, DriveRow, HoldReason, ImuSample, Odometry, StopReason,
};
use terrain::{GridGeometry, LATTICE_MAX, Mount, RangePoint, Scan, TerrainClass};

use super::{CommandRecord, Grid, ImuRecord, OdometryRecord, PointRecord, ScanHeader, Source, Stamp};

/// Reasons to stop; the first has the number 1.
pub const STOP_REASONS: [StopReason; 13] = [
    StopReason::StaleOdometry,
    StopReason::StaleScan,
    StopReason::NonFiniteInput,
    StopReason::NoFeasibleRollout,
    StopReason::NonFiniteResult,
    StopReason::OutsideMap,
    StopReason::StaleCommand,
    StopReason::StaleMission,
    StopReason::InputOutOfRange,
    StopReason::InputOutOfOrder,
    StopReason::InputFromFuture,
    StopReason::EmergencyStop,
    StopReason::MovingObstacle,
];
/// Reasons to hold; the first has the number 1.
pub const HOLD_REASONS: [HoldReason; 5] =
    [HoldReason::NoMap, HoldReason::AtGoal, HoldReason::NoMission, HoldReason::Paused, HoldReason::Manual];

/// Numbers of [`CommandRecord::decision`].
const DRIVE: u32 = 1;
const HOLD: u32 = 2;
const STOP: u32 = 3;

/// Longest edge of a grid that is believed.
const CELLS_MAX: u64 = 1 << 14;

impl Stamp {
    /// Names the message.
    pub fn source(&self) -> Source {
        Source { epoch_ns: self.epoch_ns, sequence: self.sequence }
    }
}

impl From<&GridGeometry> for Grid {
    fn from(geometry: &GridGeometry) -> Self {
        let GridGeometry { resolution_m, origin, n_rows, n_cols } = *geometry;
        Self { resolution_m, origin, n_rows: n_rows as u64, n_cols: n_cols as u64 }
    }
}

impl Grid {
    /// The geometry, if it is one.
    pub fn geometry(&self) -> Option<GridGeometry> {
        let Self { resolution_m, origin, n_rows, n_cols } = *self;
        let is_place = resolution_m.is_finite()
            && resolution_m > 0.0
            && origin.iter().all(|index| index.unsigned_abs() <= LATTICE_MAX.unsigned_abs());
        let is_size = |n: u64| (1..=CELLS_MAX).contains(&n);
        (is_place && is_size(n_rows) && is_size(n_cols)).then_some(GridGeometry {
            resolution_m,
            origin,
            n_rows: n_rows as usize,
            n_cols: n_cols as usize,
        })
    }
}

/// A row of a drive log: odometry, and the command of its time [m/s], [rad].
pub fn drive_row(time_s: f64, odometry: &Odometry, [speed_mps, steering_rad]: [f64; 2]) -> DriveRow {
    DriveRow::new(time_s)
        .with_odometry(odometry)
        .with(Column::CmdSpeed, speed_mps)
        .with(Column::CmdSteer, steering_rad)
}

impl From<&Odometry> for OdometryRecord {
    fn from(odometry: &Odometry) -> Self {
        let Odometry {
            valid_at_ns: _,
            position_m,
            attitude_rad,
            velocity_mps,
            yaw_rate_radps,
            wheel_speed_mps,
            steering_rad,
        } = *odometry;
        Self {
            position_m,
            attitude_rad,
            velocity_mps,
            yaw_rate_radps,
            wheel_speed_mps,
            steering_rad,
            ..Self::default()
        }
    }
}

impl OdometryRecord {
    /// With what the actuators were told last.
    pub fn with_applied(self, applied: &Applied) -> Self {
        let Applied { command: Command { speed_mps, steering_rad }, since_ns, by } = *applied;
        Self {
            applied_speed_mps: speed_mps,
            applied_steering_rad: steering_rad,
            applied_since_ns: since_ns,
            applied_by: match by {
                AppliedBy::Command => 0,
                AppliedBy::Vehicle => 1,
            },
            ..self
        }
    }

    /// What the actuators were told last.
    pub fn applied(&self) -> Applied {
        Applied {
            command: Command { speed_mps: self.applied_speed_mps, steering_rad: self.applied_steering_rad },
            since_ns: self.applied_since_ns,
            by: if self.applied_by == 0 { AppliedBy::Command } else { AppliedBy::Vehicle },
        }
    }

    /// As the pipeline takes it.
    pub fn odometry(&self, valid_at_ns: u64) -> Odometry {
        let Self {
            position_m,
            attitude_rad,
            velocity_mps,
            yaw_rate_radps,
            wheel_speed_mps,
            steering_rad,
            ..
        } = *self;
        Odometry {
            valid_at_ns,
            position_m,
            attitude_rad,
            velocity_mps,
            yaw_rate_radps,
            wheel_speed_mps,
            steering_rad,
        }
    }
}

impl From<&ImuSample> for ImuRecord {
    fn from(sample: &ImuSample) -> Self {
        let ImuSample { valid_at_ns, acceleration_mps2, angular_rate_radps } = *sample;
        Self { valid_at_ns, acceleration_mps2, angular_rate_radps }
    }
}

impl From<&ImuRecord> for ImuSample {
    fn from(record: &ImuRecord) -> Self {
        let ImuRecord { valid_at_ns, acceleration_mps2, angular_rate_radps } = *record;
        Self { valid_at_ns, acceleration_mps2, angular_rate_radps }
    }
}

impl From<&RangePoint> for PointRecord {
    fn from(point: &RangePoint) -> Self {
        Self { position_m: point.position_m, class_number: point.class as u32 }
    }
}

impl PointRecord {
    /// As the pipeline takes it; `None` for a class that there is not.
    pub fn point(&self) -> Option<RangePoint> {
        let class = *TerrainClass::ALL.get(self.class_number as usize)?;
        Some(RangePoint { position_m: self.position_m, class })
    }
}

impl ScanHeader {
    /// The scan in the frame of its sensor, of the returns that are of a known class.
    pub fn sensor_scan(&self, points: &[PointRecord]) -> Scan {
        Scan {
            valid_at_ns: self.stamp.valid_at_ns,
            origin_m: self.origin_m,
            points: points.iter().filter_map(PointRecord::point).collect(),
        }
    }

    /// The scan in the body frame, of the returns that are of a known class; `None` of a sensor that is not among
    /// `mounts`.
    pub fn scan(&self, points: &[PointRecord], mounts: &[Mount]) -> Option<Scan> {
        let scan = self.sensor_scan(points);
        match (self.sensor as usize).checked_sub(1) {
            None => Some(scan),
            Some(place) => mounts.get(place).map(|mount| mount.in_body_frame(&scan)),
        }
    }
}

impl From<&Decision> for CommandRecord {
    fn from(decision: &Decision) -> Self {
        let standing = |decision, reason: Option<usize>| Self {
            decision,
            reason: reason.map_or(0, |place| place as u32 + 1),
            ..Self::default()
        };
        match decision {
            Decision::Drive(Command { speed_mps, steering_rad }) => Self {
                speed_mps: *speed_mps,
                steering_rad: *steering_rad,
                decision: DRIVE,
                ..Self::default()
            },
            Decision::Hold(reason) => standing(HOLD, HOLD_REASONS.iter().position(|known| known == reason)),
            Decision::Stop(reason) => standing(STOP, STOP_REASONS.iter().position(|known| known == reason)),
        }
    }
}

impl CommandRecord {
    /// With the times of what was decided on; see the fields.
    pub fn decided_on(self, odometry_at_ns: u64, scan_at_ns: u64) -> Self {
        Self { odometry_at_ns, scan_at_ns, ..self }
    }

    /// The decision; `None` for a number that is none.
    pub fn decision(&self) -> Option<Decision> {
        let place = (self.reason as usize).wrapping_sub(1);
        match self.decision {
            DRIVE => {
                let Self { speed_mps, steering_rad, .. } = *self;
                Some(Decision::Drive(Command { speed_mps, steering_rad }))
            }
            HOLD => HOLD_REASONS.get(place).copied().map(Decision::Hold),
            STOP => STOP_REASONS.get(place).copied().map(Decision::Stop),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_decision_survives_the_way() {
        let drive = Decision::Drive(Command { speed_mps: -0.5, steering_rad: 0.1 });
        let all = STOP_REASONS
            .map(Decision::Stop)
            .into_iter()
            .chain(HOLD_REASONS.map(Decision::Hold))
            .chain([drive]);
        for decision in all {
            assert_eq!(CommandRecord::from(&decision).decision(), Some(decision));
        }
    }

    #[test]
    fn numbers_that_are_no_decision_are_none() {
        for (decision, reason) in [(0, 0), (4, 1), (2, 0), (2, 6), (3, 0), (3, 14), (u32::MAX, u32::MAX)] {
            let record = CommandRecord { decision, reason, ..CommandRecord::default() };
            assert_eq!(record.decision(), None, "{decision} {reason}");
        }
    }

    #[test]
    fn grids_that_cannot_be_are_none() {
        let grid = Grid { resolution_m: 0.2, origin: [-7, 9], n_rows: 3, n_cols: 4 };
        let geometry = grid.geometry().unwrap();
        assert_eq!(Grid::from(&geometry), grid);
        for broken in [
            Grid { resolution_m: 0.0, ..grid },
            Grid { resolution_m: f64::NAN, ..grid },
            Grid { resolution_m: f64::INFINITY, ..grid },
            Grid { n_rows: 0, ..grid },
            Grid { n_cols: u64::MAX, ..grid },
            Grid { origin: [i64::MIN, 0], ..grid },
        ] {
            assert_eq!(broken.geometry(), None, "{broken:?}");
        }
    }

    #[test]
    fn points_of_no_class_are_left_out() {
        let header = ScanHeader::default();
        let point = |class_number| PointRecord { position_m: [1.0, 2.0, 3.0], class_number };
        let scan = header.scan(&[point(0), point(4), point(3), point(u32::MAX)], &[]).unwrap();
        assert_eq!(scan.points.len(), 2);
        assert_eq!(scan.points[1].class, TerrainClass::Obstacle);
    }

    #[test]
    fn scans_of_a_sensor_lie_where_it_sits_and_those_of_an_unknown_one_nowhere() {
        let mount = Mount { position_m: [0.5, 0.0, 1.0], ..Mount::default() };
        let point = PointRecord { position_m: [2.0, 0.0, -1.0], class_number: 0 };
        let of = |sensor| {
            ScanHeader { sensor, ..ScanHeader::default() }.scan(&[point], std::slice::from_ref(&mount))
        };
        assert_eq!(of(0).unwrap().points[0].position_m, [2.0, 0.0, -1.0]);
        assert_eq!(of(1).unwrap().points[0].position_m, [2.5, 0.0, 0.0]);
        assert_eq!(of(1).unwrap().origin_m, [0.5, 0.0, 1.0]);
        assert_eq!([of(2), of(u32::MAX)], [None, None]);
    }

    #[test]
    fn odometry_survives_the_way() {
        let odometry = Odometry {
            valid_at_ns: 5,
            position_m: [1.0, 2.0, 3.0],
            attitude_rad: [0.1, 0.2, 0.3],
            velocity_mps: [1.5, -0.1],
            yaw_rate_radps: 0.4,
            wheel_speed_mps: 1.6,
            steering_rad: -0.2,
        };
        let command = Command { speed_mps: 1.25, steering_rad: -0.5 };
        for by in [AppliedBy::Command, AppliedBy::Vehicle] {
            let applied = Applied { command, since_ns: 3, by };
            let record = OdometryRecord::from(&odometry).with_applied(&applied);
            assert_eq!((record.odometry(5), record.applied()), (odometry, applied));
        }
    }
}
