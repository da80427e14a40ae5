//! The semantic elevation map: a rolling window of cells fused from range scans.

mod cell;
mod config;
mod gaps;
mod sorting;
mod stands;
mod statistics;
mod surfacing;
mod visibility;

pub use config::ElevationConfig;

use crate::region::LatticeBounds;
use crate::{
    CellRegion, DistantPosition, Footprint, GridGeometry, GridMap, Pose, Scan, SettingError, SurfaceCell,
    TerrainClass,
};
use cell::{CellState, Ground};
use nalgebra::{Point3, Vector3};
use sorting::SortedPoints;
use surfacing::Due;

/// What became of one scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FuseReport {
    /// Points that the scan held.
    pub n_points: usize,
    /// Points dropped because a coordinate was NaN or infinite.
    pub n_rejected_non_finite: usize,
    /// Points dropped because they lie on the vehicle itself.
    pub n_own_body: usize,
    /// Points dropped because they lie outside the window, or farther above or below the ray origin than the
    /// window is wide.
    pub n_out_of_window: usize,
    /// Cells whose surface was published anew by this scan, as one bounding rectangle of the window.
    pub changed: Option<CellRegion>,
}

impl FuseReport {
    /// Points that were mapped.
    pub fn n_mapped(&self) -> usize {
        self.n_points - self.n_rejected_non_finite - self.n_own_body - self.n_out_of_window
    }
}

/// What the map refuses to take in; it is then left as it was.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FuseError {
    /// The pose is not a pose.
    #[error("expected a pose of finite numbers, found {0:?}")]
    NonFinitePose(Pose),
    /// The pose is farther away than cells can be counted.
    #[error(transparent)]
    Distant(#[from] DistantPosition),
    /// The place from which the rays start is not a place.
    #[error("expected a ray origin of finite numbers, found {0:?}")]
    NonFiniteOrigin([f32; 3]),
    /// The assumption about the ground gives no heights.
    #[error("assumed ground: {field}: expected {expected}, found {found}")]
    Assumption {
        /// What cannot be.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
}

/// What is taken for granted of the ground under a vehicle that has seen nothing yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssumedGround {
    /// The rectangle about the rear axle that is known to carry the vehicle.
    pub footprint: Footprint,
    /// From the ground up to the body frame's origin; the wheel radius [m].
    pub axle_height_m: f64,
    /// Standard deviation of the assumed height [m].
    pub height_std_m: f64,
}

impl AssumedGround {
    /// Refuses numbers that give no heights, and a body whose z axis rises by less than a tenth of its length.
    fn check(&self, rise: f64) -> Result<(), FuseError> {
        let refuse = |field, expected, found| Err(FuseError::Assumption { field, expected, found });
        if !self.axle_height_m.is_finite() {
            return refuse("axle_height_m", "a finite number", self.axle_height_m);
        }
        if !(self.height_std_m.is_finite() && self.height_std_m > 0.0) {
            return refuse("height_std_m", "a finite number > 0", self.height_std_m);
        }
        if rise < 0.1 {
            return refuse("cosine of the body's tilt", "at least 0.1", rise);
        }
        Ok(())
    }
}

/// The semantic elevation map, fused online from scans and poses.
///
/// Frames: the map frame of the poses; the window follows the vehicle by whole cells.
#[derive(Clone, Debug)]
pub struct ElevationMap {
    config: ElevationConfig,
    states: GridMap<CellState>,
    surface: GridMap<SurfaceCell>,
    /// Bounds of what was published since the last `take_changed`.
    changed: LatticeBounds,
    is_placed: bool,
    fused_at_ns: Option<u64>,
    /// Scans fused so far.
    n_fused: u64,
    points: SortedPoints,
    rays: visibility::RayFloor,
    surfacing: surfacing::Scratch,
}

impl ElevationMap {
    /// An empty map. Its window is centred on the first pose.
    pub fn new(config: ElevationConfig) -> Result<Self, SettingError> {
        config.validate()?;
        let geometry = GridGeometry::centred(config.resolution_m, config.n_rows, config.n_cols, 0.0, 0.0);
        Ok(Self {
            config,
            states: GridMap::filled(geometry, CellState::NEW),
            surface: GridMap::filled(geometry, SurfaceCell::UNKNOWN),
            changed: LatticeBounds::EMPTY,
            is_placed: false,
            fused_at_ns: None,
            n_fused: 0,
            points: SortedPoints::default(),
            rays: visibility::RayFloor::default(),
            surfacing: surfacing::Scratch::default(),
        })
    }

    /// The ground as it is known.
    pub fn surface(&self) -> &GridMap<SurfaceCell> {
        &self.surface
    }

    /// The settings the map was built from.
    pub fn config(&self) -> &ElevationConfig {
        &self.config
    }

    /// The bounding rectangle of all cells published since the last call, in the present window; the strips
    /// that entered by rolling are part of it. `None` when nothing changed.
    pub fn take_changed(&mut self) -> Option<CellRegion> {
        let changed = std::mem::replace(&mut self.changed, LatticeBounds::EMPTY);
        changed.within(self.surface.geometry())
    }

    /// Fuses one scan that was taken at `pose`. Non-finite points are dropped and counted.
    pub fn fuse(&mut self, scan: &Scan, pose: &Pose) -> Result<FuseReport, FuseError> {
        self.check_pose(pose)?;
        if !scan.origin_m.iter().all(|v| v.is_finite()) {
            return Err(FuseError::NonFiniteOrigin(scan.origin_m));
        }
        let before = std::mem::replace(&mut self.changed, LatticeBounds::EMPTY);
        self.follow(pose);
        self.fade(scan.valid_at_ns);
        self.points.sort(scan, pose, self.states.geometry(), &self.config);
        self.fuse_points();
        self.publish(Due::after_scan(self.n_fused, pose, &self.config));
        self.n_fused += 1;
        let report = FuseReport {
            n_points: scan.points.len(),
            n_rejected_non_finite: self.points.n_rejected_non_finite,
            n_own_body: self.points.n_own_body,
            n_out_of_window: self.points.n_out_of_window,
            changed: self.changed.within(self.surface.geometry()),
        };
        self.changed.include_bounds(&before);
        Ok(report)
    }

    /// Forgets when the last scan was, because the clock was set: the next one fades nothing.
    pub fn forget_time(&mut self) {
        self.fused_at_ns = None;
    }

    /// Takes for granted, where nothing was seen, that the ground carries the wheels of a vehicle at `pose`:
    /// a sensor cannot see below its own vehicle. The cells count as interpolated until they are seen.
    pub fn assume_ground(&mut self, pose: &Pose, assumed: &AssumedGround) -> Result<(), FuseError> {
        self.check_pose(pose)?;
        let motion = pose.isometry();
        let normal = motion.rotation * Vector3::z();
        assumed.check(normal.z)?;
        self.follow(pose);
        let (sin, cos) = libm::sincos(pose.yaw_rad);
        let contact = motion * Point3::new(0.0, 0.0, -assumed.axle_height_m);
        let geometry = *self.states.geometry();
        for (index, state) in self.states.values_mut().iter_mut().enumerate() {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
            let (dx_m, dy_m) = (x_m - pose.x_m, y_m - pose.y_m);
            let covered = assumed.footprint.contains(cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m);
            if covered && state.ground == Ground::Unseen {
                // The plane through the contact point, square to the body's z axis.
                let rise_m = (normal.x * (x_m - contact.x) + normal.y * (y_m - contact.y)) / normal.z;
                state.ground = Ground::Assumed;
                state.evidence[TerrainClass::Open as usize] += 1.0;
                state.ground_m = (contact.z - rise_m) as f32;
                state.variance_m2 = (assumed.height_std_m * assumed.height_std_m) as f32;
            }
        }
        self.publish(Due::All);
        Ok(())
    }

    /// Moves what is stored with a correction of the localisation: the vehicle believed to be at `before` and
    /// is now known to have been at `after`, so everything seen from there moves the same way.
    ///
    /// Whole-cell translations are exact. Otherwise each cell takes over the nearest stored cell, so that
    /// places are off by at most half a cell's diagonal.
    pub fn reanchor(&mut self, before: &Pose, after: &Pose) -> Result<(), FuseError> {
        self.check_pose(before)?;
        self.check_pose(after)?;
        let [dx_m, dy_m] = [after.x_m - before.x_m, after.y_m - before.y_m];
        let mut geometry = *self.states.geometry();
        geometry.origin[0] += (dx_m / geometry.resolution_m).round() as i64;
        geometry.origin[1] += (dy_m / geometry.resolution_m).round() as i64;
        self.changed.include_window(&geometry);
        self.states = moved_states(&self.states, geometry, before, after);
        self.surface = GridMap::filled(geometry, SurfaceCell::UNKNOWN);
        self.publish(Due::All);
        Ok(())
    }

    fn check_pose(&self, pose: &Pose) -> Result<(), FuseError> {
        if !pose.is_finite() {
            return Err(FuseError::NonFinitePose(*pose));
        }
        Ok(DistantPosition::check([pose.x_m, pose.y_m], self.config.resolution_m)?)
    }

    /// Rolls the window when the vehicle left its middle.
    fn follow(&mut self, pose: &Pose) {
        let old = *self.states.geometry();
        let new = GridGeometry::centred(old.resolution_m, old.n_rows, old.n_cols, pose.x_m, pose.y_m);
        let away = new.origin.iter().zip(&old.origin).map(|(new, old)| (new - old).abs()).max().unwrap_or(0);
        let is_away = away as f64 * old.resolution_m > self.config.recentre_m;
        if self.is_placed && !is_away {
            return;
        }
        self.is_placed = true;
        self.states.roll_to(new.origin, CellState::NEW);
        self.surface.roll_to(new.origin, SurfaceCell::UNKNOWN);
        self.changed.include_entered(&old, &new);
    }

    /// Lets what was seen grow uncertain with time. A scan older than the last one fades nothing. The surface follows
    /// when it is published: whoever brings a map up to date with what changed must not read what did not.
    fn fade(&mut self, now_ns: u64) {
        let elapsed_ns = self.fused_at_ns.map_or(0, |then_ns| now_ns.saturating_sub(then_ns));
        self.fused_at_ns = self.fused_at_ns.max(Some(now_ns));
        let by_m2 = (self.config.fading_m2ps * elapsed_ns as f64 * 1e-9) as f32;
        if by_m2 > 0.0 {
            for state in self.states.values_mut() {
                state.variance_m2 += by_m2;
            }
        }
    }

    /// Lets the rays contradict what they passed, then the points tell what they hit.
    fn fuse_points(&mut self) {
        self.rays.cast(&self.points, self.states.geometry(), &self.config);
        for (cell, &floor_m) in self.rays.floors_m.iter().enumerate() {
            if floor_m < f32::INFINITY && !self.points.is_hit(cell) {
                self.states.values_mut()[cell].pass(floor_m, &self.config);
            }
        }
        for &cell in &self.points.hit_cells {
            let reference_m = self.surface.values()[cell as usize].height_m;
            let state = &mut self.states.values_mut()[cell as usize];
            state.fuse(self.points.in_cell(cell), reference_m, &self.config);
        }
    }
}

/// The states as they stand in `geometry` after the correction from `before` to `after`.
fn moved_states(
    old: &GridMap<CellState>,
    geometry: GridGeometry,
    before: &Pose,
    after: &Pose,
) -> GridMap<CellState> {
    let correction = after.isometry() * before.isometry().inverse();
    let (sin, cos) = libm::sincos(before.yaw_rad - after.yaw_rad);
    let mut new = GridMap::filled(geometry, CellState::NEW);
    for (index, state) in new.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let (dx_m, dy_m) = (x_m - after.x_m, y_m - after.y_m);
        let [old_x_m, old_y_m] = [before.x_m + cos * dx_m - sin * dy_m, before.y_m + sin * dx_m + cos * dy_m];
        if let Some(moved) = old.at(old_x_m, old_y_m) {
            let there = correction * Point3::new(old_x_m, old_y_m, before.z_m);
            *state = moved.lifted((there.z - before.z_m) as f32);
        }
    }
    new
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RangePoint;

    /// Where the map's buffers lie and how much they hold.
    fn buffers(map: &ElevationMap) -> Vec<(usize, usize)> {
        let place = |values: *const u8, capacity| (values as usize, capacity);
        let cells = [map.surface.values().as_ptr().cast(), map.states.values().as_ptr().cast()];
        let mut all: Vec<_> = cells.map(|values| place(values, 0)).to_vec();
        all.extend(map.points.buffers());
        all.extend(map.surfacing.buffers());
        all.push(place(map.rays.floors_m.as_ptr().cast(), map.rays.floors_m.capacity()));
        all
    }

    #[test]
    fn buffers_stay_where_they_are_once_the_largest_scan_was_seen() {
        let config =
            ElevationConfig { n_rows: 50, n_cols: 60, recentre_m: 0.4, ..ElevationConfig::default() };
        let mut map = ElevationMap::new(config).unwrap();
        let points = (0..4000_u32).map(|i| RangePoint {
            position_m: [(i % 61) as f32 * 0.1 - 3.0, (i / 61) as f32 * 0.1 - 3.0, 0.01 * (i % 7) as f32],
            class: TerrainClass::ALL[(i % 4) as usize],
        });
        let mut scan = Scan { valid_at_ns: 0, origin_m: [0.0, 0.0, 1.5], points: points.collect() };
        let drive = |map: &mut ElevationMap, scan: &Scan| {
            for i in 0..10 {
                map.fuse(scan, &Pose { x_m: 0.3 * f64::from(i), ..Pose::default() }).unwrap();
            }
        };
        drive(&mut map, &scan);
        let before = buffers(&map);
        drive(&mut map, &scan);
        scan.points.truncate(1500);
        drive(&mut map, &scan);
        assert_eq!(buffers(&map), before);
    }
}
