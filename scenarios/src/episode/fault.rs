//! Faults of the sensors, to be injected into an episode.

use bicycle::Odometry;
use terrain::Scan;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// Every third point of the scans has a coordinate that is no number.
    NonFinitePoints,
    /// Scans come without a point.
    EmptyScan,
    /// No scan comes.
    MissingScan,
    /// The localisation corrects itself: from now on the position is off by this [m].
    PoseJump([f64; 2]),
    /// The localisation corrects its heading: from now on what it tells is turned about this place of the map [m] by
    /// this angle [rad].
    PoseTurn([f64; 2], f64),
    /// Every return comes from this place in the body frame [m]: a cover over the sensor, or nothing but the sky's edge.
    ReturnsFrom([f32; 3]),
    /// Pose and velocity stay what they were; the stamp, the wheels' speed and the steering go on.
    FrozenOdometry,
    /// The last message is repeated with its old stamp.
    SilentOdometry,
    /// The yaw is no number.
    NonFiniteOdometry,
}

/// A fault and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What goes wrong.
    pub sensor: SensorFault,
    /// From when on [s].
    pub from_s: f64,
    /// Until when; infinite = for good [s].
    pub until_s: f64,
}

impl Fault {
    /// Whether the fault is there at a time.
    pub(super) fn is_on(&self, time_s: f64) -> bool {
        self.from_s <= time_s && time_s < self.until_s
    }

    /// What becomes of a scan; nothing when it does not come.
    pub(super) fn on_scan(&self, mut scan: Scan) -> Option<Scan> {
        match self.sensor {
            SensorFault::MissingScan => return None,
            SensorFault::EmptyScan => scan.points.clear(),
            SensorFault::NonFinitePoints => {
                for (k, point) in scan.points.iter_mut().enumerate().step_by(3) {
                    point.position_m[k / 3 % 3] = if k % 2 == 0 { f32::NAN } else { f32::INFINITY };
                }
            }
            SensorFault::ReturnsFrom(place_m) => {
                scan.points.iter_mut().for_each(|point| point.position_m = place_m);
            }
            SensorFault::PoseJump(_)
            | SensorFault::PoseTurn(..)
            | SensorFault::FrozenOdometry
            | SensorFault::SilentOdometry
            | SensorFault::NonFiniteOdometry => {}
        }
        Some(scan)
    }

    /// What becomes of a localisation, `last` being the one of the cycle before.
    pub(super) fn on_odometry(&self, mut odometry: Odometry, last: &Odometry) -> Odometry {
        match self.sensor {
            SensorFault::PoseJump([east_m, north_m]) => {
                odometry.position_m[0] += east_m;
                odometry.position_m[1] += north_m;
            }
            SensorFault::PoseTurn([x_m, y_m], yaw_rad) => {
                let [east_m, north_m, _] = odometry.position_m;
                let ([dx_m, dy_m], (sin, cos)) = ([east_m - x_m, north_m - y_m], yaw_rad.sin_cos());
                odometry.position_m[0] = x_m + cos * dx_m - sin * dy_m;
                odometry.position_m[1] = y_m + sin * dx_m + cos * dy_m;
                odometry.attitude_rad[2] += yaw_rad;
            }
            SensorFault::FrozenOdometry => {
                let Odometry { valid_at_ns, wheel_speed_mps, steering_rad, .. } = odometry;
                odometry = Odometry { valid_at_ns, wheel_speed_mps, steering_rad, ..*last };
            }
            SensorFault::SilentOdometry => odometry = *last,
            SensorFault::NonFiniteOdometry => odometry.attitude_rad[2] = f64::NAN,
            SensorFault::NonFinitePoints
            | SensorFault::EmptyScan
            | SensorFault::MissingScan
            | SensorFault::ReturnsFrom(_) => {}
        }
        odometry
    }
}
