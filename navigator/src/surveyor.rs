//! The first part of the pipeline: measurements become a map of the ground.

use std::collections::BTreeMap;

use bicycle::{Geometry, Odometry, SensorModel, StopReason};
use terrain::{
    AssumedGround, CellRegion, ElevationConfig, ElevationMap, Footprint, FuseError, FuseReport, GridMap,
    Pose, Scan, SurfaceCell,
};

use crate::guard::{Admitted, Guard, GuardConfig};
use crate::jump::Jump;
use crate::track::{Track, Whereabouts};
use crate::{NavigatorError, Surface};

/// Standard deviation of the ground height assumed below a vehicle that has seen nothing yet [m].
const ASSUMED_HEIGHT_STD_M: f64 = 0.05;

/// What became of the scans and their points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanTally {
    /// Scans that held something to map.
    pub fused: u64,
    /// Scans without a usable point, or without a place from which their rays start: a sensor that sees nothing.
    pub blind: u64,
    /// Scans from a time at which nobody knows where the vehicle was.
    pub unplaced: u64,
    /// Points that were mapped.
    pub points_mapped: u64,
    /// Points with a coordinate that is no finite number.
    pub points_not_finite: u64,
    /// Points on the vehicle itself.
    pub points_on_own_body: u64,
    /// Points outside the window of the map.
    pub points_out_of_window: u64,
}

impl ScanTally {
    /// Counts a scan that was looked at, and returns whether anything of it was mapped.
    fn count(&mut self, report: &FuseReport) -> bool {
        let is_usable = report.n_mapped() > 0;
        if is_usable {
            self.fused += 1
        } else {
            self.blind += 1
        }
        self.points_mapped += report.n_mapped() as u64;
        self.points_not_finite += report.n_rejected_non_finite as u64;
        self.points_on_own_body += report.n_own_body as u64;
        self.points_out_of_window += report.n_out_of_window as u64;
        is_usable
    }
}

/// Keeps the map of the ground up to date and in the frame of the localisation.
pub struct Surveyor {
    guard: Guard,
    track: Track,
    sensors: SensorModel,
    elevation: ElevationMap,
    given: Option<GridMap<SurfaceCell>>,
    assumed: AssumedGround,
    has_ground: bool,
    shift: Jump,
    n_jumps: u64,
    tally: ScanTally,
}

impl Surveyor {
    /// A map of nothing.
    pub fn new(
        vehicle: &impl AsRef<Geometry>,
        elevation: ElevationConfig,
        guard: GuardConfig,
        surface: Surface,
    ) -> Result<Self, NavigatorError> {
        Ok(Self {
            guard: Guard::new(guard),
            track: Track::new(&guard),
            sensors: SensorModel::NEUTRAL,
            elevation: ElevationMap::new(elevation)?,
            given: match surface {
                Surface::Sensed => None,
                Surface::Given(surface) => Some(surface),
            },
            assumed: assumed_ground(vehicle.as_ref()),
            has_ground: false,
            shift: Jump::NONE,
            n_jumps: 0,
            tally: ScanTally::default(),
        })
    }

    /// The same for odometry that these sensors misstate: all that comes in is corrected first.
    pub fn with_sensors(self, sensors: SensorModel) -> Self {
        Self { sensors, ..self }
    }

    /// Takes in where the vehicle is; returns the jump of the localisation that it made out, which
    /// [`Surveyor::follow_jump`] then follows. Odometry that cannot be used has its reason.
    pub fn admit(&mut self, odometry: &Odometry) -> Result<Option<Jump>, StopReason> {
        let admitted = self.guard.admit_odometry(&self.sensors.corrected(odometry))?;
        let jump = match admitted {
            Admitted::Onward => None,
            Admitted::Again => return Ok(None),
            Admitted::Jumped(jump) => {
                // The sensors' errors are the vehicle's own: they turn and move with it.
                self.track.follow(&jump);
                Some(jump)
            }
            Admitted::ClockSetBack => {
                self.track.forget();
                self.elevation.forget_time();
                None
            }
        };
        self.track.note(odometry);
        Ok(jump)
    }

    /// Where the vehicle was when a scan was taken, as its odometry tells. A scan that is older than the last usable
    /// one, or ahead of the odometry, has its reason.
    pub fn place(&mut self, scan_at_ns: u64) -> Result<Whereabouts, StopReason> {
        self.guard.admit_scan(scan_at_ns)?;
        Ok(self.track.at(scan_at_ns))
    }

    /// Notes a scan that came from a time at which nobody knows where the vehicle was.
    pub fn note_unplaced(&mut self) {
        self.tally.unplaced += 1;
    }

    /// Notes what the vehicle was told, so that standing still on purpose is not taken for frozen odometry.
    pub fn note_command(&mut self, speed_mps: f32) {
        self.guard.note_command(speed_mps);
    }

    /// Fuses a scan that was taken at this odometry; returns whether there was anything usable in it. One that shows
    /// only the vehicle itself, places outside the window or no numbers does not make the map any younger.
    pub fn fuse(&mut self, odometry: &Odometry, scan: &Scan) -> Result<bool, NavigatorError> {
        if self.given.is_none() {
            match self.elevation.fuse(scan, &self.pose(odometry)) {
                Ok(report) if self.tally.count(&report) => {}
                Ok(_) => return Ok(false),
                // A scan whose origin is no place holds nothing to fuse.
                Err(FuseError::NonFiniteOrigin(_)) => {
                    self.tally.blind += 1;
                    return Ok(false);
                }
                Err(error) => return Err(error.into()),
            }
        }
        self.guard.note_scan(scan.valid_at_ns);
        self.assume_ground(odometry)?;
        Ok(true)
    }

    /// The localisation moved, the vehicle did not: what was mapped moves along.
    pub fn follow_jump(&mut self, odometry: &Odometry, jump: &Jump) -> Result<(), NavigatorError> {
        self.n_jumps += 1;
        self.shift = self.shift.then(jump);
        let after = self.pose(odometry);
        let [x_m, y_m, z_m] = jump.inverse().place_m([after.x_m, after.y_m, after.z_m]);
        let before = Pose { x_m, y_m, z_m, yaw_rad: after.yaw_rad - jump.yaw_rad, ..after };
        Ok(self.elevation.reanchor(&before, &after)?)
    }

    /// The ground as it is known.
    pub fn surface(&self) -> &GridMap<SurfaceCell> {
        self.given.as_ref().unwrap_or(self.elevation.surface())
    }

    /// Whether the surface was given whole, and never gets old.
    pub fn is_given(&self) -> bool {
        self.given.is_some()
    }

    /// What changed of the surface since the last call.
    pub fn take_changed(&mut self) -> CellRegion {
        let changed = if self.is_given() { None } else { self.elevation.take_changed() };
        changed.unwrap_or(CellRegion { rows: 0..0, cols: 0..0 })
    }

    /// How often the localisation corrected itself by a jump.
    pub fn n_jumps(&self) -> u64 {
        self.n_jumps
    }

    /// All jumps together: where a place of the first frame lies now.
    pub fn shift(&self) -> Jump {
        self.shift
    }

    /// What became of the scans so far.
    pub fn tally(&self) -> &ScanTally {
        &self.tally
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        self.guard.refused()
    }

    /// Once, as soon as the place is known: the ground carries the vehicle.
    pub(crate) fn assume_ground(&mut self, odometry: &Odometry) -> Result<(), NavigatorError> {
        if !std::mem::replace(&mut self.has_ground, true) {
            self.elevation.assume_ground(&self.pose(odometry), &self.assumed)?;
        }
        Ok(())
    }

    /// Where the vehicle is, once its sensors are corrected.
    fn pose(&self, odometry: &Odometry) -> Pose {
        let Odometry { position_m, attitude_rad, .. } = self.sensors.corrected(odometry);
        let ([x_m, y_m, z_m], [roll_rad, pitch_rad, yaw_rad]) = (position_m, attitude_rad);
        Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
    }
}

fn assumed_ground(geometry: &Geometry) -> AssumedGround {
    // A quarter of the length more on every side: the blind zone of a roof sensor reaches beyond the bumpers.
    let margin_m = 0.25 * geometry.length_m;
    AssumedGround {
        footprint: Footprint {
            front_m: geometry.length_m - geometry.rear_overhang_m + margin_m,
            rear_m: geometry.rear_overhang_m + margin_m,
            half_width_m: 0.5 * geometry.width_m + margin_m,
        },
        axle_height_m: geometry.wheel_radius_m,
        height_std_m: ASSUMED_HEIGHT_STD_M,
    }
}
