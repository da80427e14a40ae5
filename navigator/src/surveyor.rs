//! The first part of the pipeline: measurements become a map of the ground.

use std::collections::{BTreeMap, VecDeque};

use bicycle::{Geometry, MotionCommand, Odometry, SensorModel, StopReason};
use terrain::{
    AssumedGround, BodyBox, ElevationConfig, ElevationMap, Footprint, FuseError, FuseReport, GridMap, Mount,
    Pose, Scan, SurfaceCell,
};
use tracking::Tracker;

use crate::guard::{Admitted, GuardConfig};
use crate::input_ledger::InputLedger;
use crate::jump::Jump;
use crate::message::TIMELESS_NS;
use crate::track::Whereabouts;
use crate::{
    MessageId, MovingConfig, NavigatorError, OdometryMessage, ScanMessage, Surface, SurfaceHeader,
    TracksMessage,
};

/// Scans that wait for the odometry after them; of more, the oldest is given up.
const WAITING_MAX: usize = 4;
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
    config: GuardConfig,
    ledger: InputLedger,
    mounts: Vec<Mount>,
    own_body: BodyBox,
    tracker: Option<Tracker>,
    waiting: VecDeque<Waiting>,
    elevation: ElevationMap,
    given: Option<GridMap<SurfaceCell>>,
    assumed: AssumedGround,
    has_ground: bool,
    /// Whether the surface that was given has been told of.
    has_told: bool,
    /// The scan that was fused last, and when it was taken [ns].
    last_scan: Option<(MessageId, u64)>,
    shift: Jump,
    n_jumps: u64,
    n_unmapped: u64,
    tally: ScanTally,
}

/// A scan that has come before the odometry of after it.
struct Waiting {
    since_ns: u64,
    id: MessageId,
    scan: Scan,
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
            config: guard,
            ledger: InputLedger::new(&guard, SensorModel::NEUTRAL),
            mounts: Vec::new(),
            own_body: elevation.own_body,
            tracker: None,
            waiting: VecDeque::with_capacity(WAITING_MAX),
            elevation: ElevationMap::new(elevation)?,
            given: match surface {
                Surface::Sensed => None,
                Surface::Given(surface) => Some(surface),
            },
            assumed: assumed_ground(vehicle.as_ref()),
            has_ground: false,
            has_told: false,
            last_scan: None,
            shift: Jump::NONE,
            n_jumps: 0,
            n_unmapped: 0,
            tally: ScanTally::default(),
        })
    }

    /// The same for odometry that these sensors misstate: all that comes in is corrected first.
    pub fn with_sensors(self, sensors: SensorModel) -> Self {
        Self { ledger: InputLedger::new(&self.config, sensors), ..self }
    }

    /// The same for scans that come in the frames of these sensors, numbered from 1.
    pub fn with_mounts(self, mounts: Vec<Mount>) -> Self {
        Self { mounts, ..self }
    }

    /// The same that tracks what moves, where somebody has said how.
    pub fn with_moving(self, config: Option<&MovingConfig>) -> Result<Self, NavigatorError> {
        let tracker = config.map(|config| Tracker::new(config.tracking, self.own_body)).transpose()?;
        Ok(Self { tracker, ..self })
    }

    /// Takes in where the vehicle is. A jump of the localisation moves what was mapped, and makes a map of its own.
    pub fn hear_odometry<C: MotionCommand>(
        &mut self,
        message: &OdometryMessage<C>,
    ) -> Result<Option<SurfaceHeader>, NavigatorError> {
        let OdometryMessage { odometry, .. } = message;
        let Ok(jump) = self.take(message) else { return Ok(None) };
        if let Some(jump) = jump {
            self.follow_jump(odometry, &jump)?;
        }
        if !self.is_given() {
            return Ok(jump.map(|jump| self.header(odometry, Some(jump))));
        }
        // What was given whole lies where it lies.
        let is_news = !std::mem::replace(&mut self.has_told, true);
        Ok(is_news.then(|| self.header(odometry, None)))
    }

    /// The same, without following the jump that it returns.
    pub fn take<C: MotionCommand>(
        &mut self,
        message: &OdometryMessage<C>,
    ) -> Result<Option<Jump>, StopReason> {
        let admitted = self.ledger.take(message)?;
        Ok(self.follow(admitted))
    }

    /// Takes in a scan, at this time; [`Surveyor::next_surface`] maps it once it is known where it was taken.
    pub fn hear_scan(&mut self, message: ScanMessage, now_ns: u64) {
        let ScanMessage { id, sensor, scan } = message;
        let mount = (sensor as usize).checked_sub(1).map(|place| self.mounts.get(place));
        let scan = match mount {
            None => scan,
            Some(Some(mount)) => mount.in_body_frame(&scan),
            Some(None) => {
                self.n_unmapped += 1;
                return;
            }
        };
        if self.waiting.len() == WAITING_MAX {
            self.waiting.pop_front();
            self.n_unmapped += 1;
        }
        self.waiting.push_back(Waiting { since_ns: now_ns, id, scan });
    }

    /// Maps the next scan of which it is known by now where it was taken, or of which nothing better will come to be known;
    /// `None` once there is none.
    pub fn next_surface(&mut self, now_ns: u64) -> Result<Option<SurfaceHeader>, NavigatorError> {
        while let Some(Waiting { since_ns, id, scan }) = self.waiting.pop_front() {
            let waited_s = now_ns.saturating_sub(since_ns) as f64 * 1e-9;
            let there = match self.whereabouts(scan.valid_at_ns) {
                Ok(Whereabouts::Ahead(_)) if waited_s < self.config.odometry_wait_max_s => {
                    self.waiting.push_front(Waiting { since_ns, id, scan });
                    return Ok(None);
                }
                Ok(Whereabouts::Between(there) | Whereabouts::Ahead(Some(there))) => Some(there),
                Ok(Whereabouts::Ahead(None) | Whereabouts::Unknown) => {
                    self.tally.unplaced += 1;
                    None
                }
                Err(_) => None,
            };
            match there {
                Some(there) if self.fuse(&there, &scan)? => {
                    self.last_scan = Some((id, scan.valid_at_ns));
                    return Ok(Some(self.header(&there, None)));
                }
                _ => self.n_unmapped += 1,
            }
        }
        Ok(None)
    }

    /// Where a surface that was given is looked at from, a scan says only when.
    fn whereabouts(&mut self, scan_at_ns: u64) -> Result<Whereabouts, StopReason> {
        match self.ledger.measured() {
            Some(measured) if self.given.is_some() => Ok(Whereabouts::Between(*measured)),
            _ => self.place(scan_at_ns),
        }
    }

    /// What the map as it is now says of itself, but for its name.
    pub fn header(&mut self, odometry: &Odometry, jump: Option<Jump>) -> SurfaceHeader {
        let (last_odometry, n_odometry) = self.ledger.take_count();
        let (scan, scan_at_ns) = self.last_scan.unwrap_or((MessageId::default(), odometry.valid_at_ns));
        let is_given = self.is_given();
        SurfaceHeader {
            id: MessageId::default(),
            valid_at_ns: if is_given { TIMELESS_NS } else { scan_at_ns },
            scan,
            odometry: *odometry,
            frame_at_ns: if is_given { TIMELESS_NS } else { self.ledger.frame_at_ns() },
            last_odometry,
            n_odometry,
            jump,
            // What was given lies where it lies, whatever the localisation says.
            shift: if is_given { Jump::NONE } else { self.shift },
        }
    }

    /// What moves by the scan that a map ends with, under the map's name; `None` where nothing is tracked, and of a map that
    /// follows a jump.
    pub fn tracks(&self, header: &SurfaceHeader) -> Option<TracksMessage> {
        let tracker = self.tracker.as_ref().filter(|_| header.jump.is_none())?;
        let frame_at_ns = self.ledger.frame_at_ns();
        Some(TracksMessage::new(header.id, self.last_scan?, frame_at_ns, tracker.moving()))
    }

    /// Who follows what moves, where somebody has said how.
    pub fn tracker(&self) -> Option<&Tracker> {
        self.tracker.as_ref()
    }

    /// Takes in where the vehicle is; returns the jump of the localisation that it made out, which
    /// [`Surveyor::follow_jump`] then follows. Odometry that cannot be used has its reason.
    pub fn admit(&mut self, odometry: &Odometry) -> Result<Option<Jump>, StopReason> {
        let admitted = self.ledger.admit(odometry)?;
        Ok(self.follow(admitted))
    }

    fn follow(&mut self, admitted: Admitted) -> Option<Jump> {
        match admitted {
            Admitted::Jumped(jump) => Some(jump),
            Admitted::ClockSetBack => {
                self.elevation.forget_time();
                self.tracker.iter_mut().for_each(Tracker::forget);
                None
            }
            Admitted::Onward | Admitted::Again => None,
        }
    }

    /// Where the vehicle was when a scan was taken, as its odometry tells. A scan that is older than the last usable
    /// one, or ahead of the odometry, has its reason.
    pub fn place(&mut self, scan_at_ns: u64) -> Result<Whereabouts, StopReason> {
        self.ledger.place(scan_at_ns)
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
        self.ledger.note_scan(scan.valid_at_ns);
        self.assume_ground(odometry)?;
        self.track(odometry, scan);
        Ok(true)
    }

    /// Follows what moves over the ground as it is known with the scan.
    fn track(&mut self, odometry: &Odometry, scan: &Scan) {
        let pose = self.pose(odometry);
        let surface = self.given.as_ref().unwrap_or(self.elevation.surface());
        if let Some(tracker) = &mut self.tracker {
            tracker.observe(scan, &pose, surface);
        }
    }

    /// The localisation moved, the vehicle did not: what was mapped moves along.
    pub fn follow_jump(&mut self, odometry: &Odometry, jump: &Jump) -> Result<(), NavigatorError> {
        self.n_jumps += 1;
        self.shift = self.shift.then(jump);
        self.tracker.iter_mut().for_each(|tracker| tracker.carry(|pose| jump.pose(pose)));
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

    /// How often the localisation corrected itself by a jump.
    pub fn n_jumps(&self) -> u64 {
        self.n_jumps
    }

    /// Scans that made no map, those of unknown sensors among them.
    pub fn n_unmapped(&self) -> u64 {
        self.n_unmapped
    }

    /// What became of the scans so far.
    pub fn tally(&self) -> &ScanTally {
        &self.tally
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        self.ledger.refused()
    }

    /// Once, as soon as the place is known: the ground carries the vehicle.
    fn assume_ground(&mut self, odometry: &Odometry) -> Result<(), NavigatorError> {
        if !std::mem::replace(&mut self.has_ground, true) {
            self.elevation.assume_ground(&self.pose(odometry), &self.assumed)?;
        }
        Ok(())
    }

    /// Where the vehicle is, once its sensors are corrected.
    fn pose(&self, odometry: &Odometry) -> Pose {
        let Odometry { position_m, attitude_rad, .. } = self.ledger.corrected(odometry);
        let ([x_m, y_m, z_m], [roll_rad, pitch_rad, yaw_rad]) = (position_m, attitude_rad);
        Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
    }
}

/// Level ground below a vehicle that has seen nothing yet.
pub fn assumed_ground(geometry: &Geometry) -> AssumedGround {
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

#[cfg(test)]
mod tests;
