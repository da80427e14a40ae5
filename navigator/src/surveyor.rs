//! The first part of the pipeline: measurements become a map of the ground.

use bicycle::{Odometry, SensorModel, StopReason, Vehicle};
use terrain::{
    AssumedGround, CellRegion, ElevationConfig, ElevationMap, Footprint, GridMap, Pose, Scan, SurfaceCell,
};

use crate::guard::{Guard, GuardConfig, Jump};
use crate::{NavigatorError, Surface};

/// Standard deviation of the ground height assumed below a vehicle that has seen nothing yet [m].
const ASSUMED_HEIGHT_STD_M: f64 = 0.05;

/// Keeps the map of the ground up to date and in the frame of the localisation.
pub struct Surveyor {
    guard: Guard,
    sensors: SensorModel,
    elevation: ElevationMap,
    given: Option<GridMap<SurfaceCell>>,
    assumed: AssumedGround,
    has_ground: bool,
    shift_m: [f64; 3],
    n_jumps: u64,
}

impl Surveyor {
    /// A map of nothing.
    pub fn new(
        vehicle: &Vehicle,
        elevation: ElevationConfig,
        guard: GuardConfig,
        surface: Surface,
    ) -> Result<Self, NavigatorError> {
        Ok(Self {
            guard: Guard::new(guard),
            sensors: SensorModel::NEUTRAL,
            elevation: ElevationMap::new(elevation)?,
            given: match surface {
                Surface::Sensed => None,
                Surface::Given(surface) => Some(surface),
            },
            assumed: assumed_ground(vehicle),
            has_ground: false,
            shift_m: [0.0; 3],
            n_jumps: 0,
        })
    }

    /// The same for odometry that these sensors misstate: all that comes in is corrected first.
    pub fn with_sensors(self, sensors: SensorModel) -> Self {
        Self { sensors, ..self }
    }

    /// Takes in where the vehicle is; returns the jump of the localisation that it made out, which
    /// [`Surveyor::follow_jump`] then follows. Odometry that cannot be used has its reason.
    pub fn admit(&mut self, odometry: &Odometry) -> Result<Option<Jump>, StopReason> {
        self.guard.admit_odometry(&self.sensors.corrected(odometry))
    }

    /// Notes what the vehicle was told, so that standing still on purpose is not taken for frozen odometry.
    pub fn note_command(&mut self, speed_mps: f32) {
        self.guard.note_command(speed_mps);
    }

    /// Fuses a scan that was taken at this odometry; returns whether there was anything usable in it.
    pub fn fuse(&mut self, odometry: &Odometry, scan: &Scan) -> Result<bool, NavigatorError> {
        if self.given.is_none() {
            // A scan whose origin is no place holds nothing to fuse.
            let Ok(report) = self.elevation.fuse(scan, &self.pose(odometry)) else { return Ok(false) };
            if report.n_points == report.n_rejected_non_finite {
                return Ok(false);
            }
        }
        self.assume_ground(odometry)?;
        Ok(true)
    }

    /// The localisation moved, the vehicle did not: what was mapped moves along.
    pub fn follow_jump(&mut self, odometry: &Odometry, jump: &Jump) -> Result<(), NavigatorError> {
        self.n_jumps += 1;
        self.shift_m = [0, 1, 2].map(|axis| self.shift_m[axis] + jump.step_m[axis]);
        let after = self.pose(odometry);
        let [x_m, y_m, z_m] = jump.step_m;
        let before = Pose { x_m: after.x_m - x_m, y_m: after.y_m - y_m, z_m: after.z_m - z_m, ..after };
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

    /// All jumps together, east, north, up [m].
    pub fn shift_m(&self) -> [f64; 3] {
        self.shift_m
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

fn assumed_ground(vehicle: &Vehicle) -> AssumedGround {
    let geometry = &vehicle.geometry;
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
