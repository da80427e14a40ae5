//! Settings of the elevation map.

use serde::{Deserialize, Serialize};

use crate::{BodyBox, SettingError};

/// Slope of the steepest ground that is still ground: the tangent of 70 degrees.
const STEEPEST_GROUND: f64 = 2.747;

/// Most cells of a window: beyond all that a vehicle looks over, and still in memory.
const CELLS_MAX: usize = 1 << 22;

/// How points become ground. Every length is in metres, every default is meant for a vehicle of 1 to 4 m
/// with a spinning range sensor of 64 beams.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ElevationConfig {
    /// Edge of a cell [m], > 0.
    pub resolution_m: f64,
    /// Rows of the window, > 0.
    pub n_rows: usize,
    /// Columns of the window, > 0; at most 4,194,304 cells in all.
    pub n_cols: usize,
    /// The window follows the vehicle once it is this far from the centre along x or y [m]; infinite = never.
    pub recentre_m: f64,
    /// Standard deviation of a point's height close to the sensor, independent between points [m], > 0.
    pub noise_floor_m: f64,
    /// Growth of that standard deviation with range [m/m].
    pub noise_per_range: f64,
    /// Standard deviation of the height error that all points of a scan share (pose error) [m].
    pub scan_noise_m: f64,
    /// Standard deviation of the tilt that all points of a scan share (attitude error) [rad].
    pub scan_tilt_rad: f64,
    /// Growth of a height's variance while nothing is seen of it [m2/s]; published as every change of a variance is.
    pub fading_m2ps: f64,
    /// Points a class's evidence is remembered for: older ones fade beyond it, > 0.
    pub evidence_cap: f32,
    /// Points of open ground that a cell counts as having shown before its first: with one, a single point
    /// named wrongly makes no obstacle.
    pub open_prior: f32,
    /// Points closer to the ray origin than this are the vehicle itself [m]; 0 = the sensor sees none of it.
    pub own_body_m: f64,
    /// Points that hang higher than this above the ground do not touch the vehicle [m], > 0.
    pub clearance_m: f32,
    /// Rigid points of one cell that span more than this, and more than ground of 70 degrees would across the
    /// cell's diagonal, are a wall or a trunk [m], > 0.
    pub wall_span_m: f32,
    /// Standard deviation of the ground below vegetation when only plants were seen far and wide [m], > 0.
    pub hidden_ground_std_m: f32,
    /// Gaps are filled only when something was seen within this distance along x and y in all four
    /// quadrants around the cell [m]; ground below plants and obstacles is inferred from twice as far. 0 = never.
    pub gap_radius_m: f64,
    /// A ray must pass this far below a height to contradict it [m], > 0, on top of three standard deviations.
    pub visibility_margin_m: f32,
    /// Scans that must contradict a height, none confirming it, before it is forgotten, > 0.
    pub ghost_scans: u8,
    /// A change of a height below this, or below half of the standard deviation that was told with it, is not published
    /// [m], nor are changes of a variance by less than a fifth or of a probability by less than a twentieth; 0 = every
    /// change is.
    pub publish_step_m: f32,
    /// Everything that changed is published with every so many scans, > 0; 1 = with each. With the others only what is
    /// urgent, within `publish_near_m` of the vehicle: what is known for the first time or no more, another likeliest
    /// class, a probability that moves by a fifth or more, and a height that leaves two of the standard deviations that
    /// were told with it or moves by more than `visibility_margin_m` (a tenth of it where the ground was filled in).
    pub publish_period_scans: u8,
    /// How far from the vehicle what is urgent does not wait [m].
    pub publish_near_m: f64,
    /// The box that the vehicle takes up, with a margin: points inside are the vehicle itself. Empty = the sensor sees
    /// nothing of it.
    pub own_body: BodyBox,
}

impl Default for ElevationConfig {
    fn default() -> Self {
        Self {
            resolution_m: 0.2,
            n_rows: 200,
            n_cols: 200,
            recentre_m: 1.0,
            noise_floor_m: 0.02,
            noise_per_range: 0.002,
            scan_noise_m: 0.005,
            scan_tilt_rad: 0.002,
            fading_m2ps: 1e-5,
            evidence_cap: 30.0,
            open_prior: 1.0,
            own_body_m: 0.0,
            own_body: BodyBox::EMPTY,
            clearance_m: 2.5,
            wall_span_m: 0.8,
            hidden_ground_std_m: 0.15,
            gap_radius_m: 0.5,
            visibility_margin_m: 0.1,
            ghost_scans: 2,
            publish_step_m: 0.003,
            publish_period_scans: 1,
            publish_near_m: 4.0,
        }
    }
}

impl ElevationConfig {
    /// The defaults with every length that has to do with the machine scaled from a vehicle of 3.4 m to one of
    /// `length_m`; resolution and window stay.
    pub fn scaled_to(length_m: f64) -> Self {
        let default = Self::default();
        let scale = length_m / 3.4;
        let scaled = |default_m: f32| (f64::from(default_m) * scale) as f32;
        Self {
            recentre_m: default.recentre_m * scale,
            noise_floor_m: default.noise_floor_m * scale,
            scan_noise_m: default.scan_noise_m * scale,
            fading_m2ps: default.fading_m2ps * scale * scale,
            clearance_m: scaled(default.clearance_m),
            wall_span_m: scaled(default.wall_span_m),
            hidden_ground_std_m: scaled(default.hidden_ground_std_m),
            gap_radius_m: default.gap_radius_m * scale,
            visibility_margin_m: scaled(default.visibility_margin_m),
            publish_step_m: scaled(default.publish_step_m),
            publish_near_m: default.publish_near_m * scale,
            ..default
        }
    }

    /// Refuses settings no map can be built from.
    pub fn validate(&self) -> Result<(), SettingError> {
        let positive = [
            ("resolution_m", self.resolution_m),
            ("n_rows", self.n_rows as f64),
            ("n_cols", self.n_cols as f64),
            ("noise_floor_m", self.noise_floor_m),
            ("evidence_cap", f64::from(self.evidence_cap)),
            ("clearance_m", f64::from(self.clearance_m)),
            ("wall_span_m", f64::from(self.wall_span_m)),
            ("hidden_ground_std_m", f64::from(self.hidden_ground_std_m)),
            ("visibility_margin_m", f64::from(self.visibility_margin_m)),
            ("ghost_scans", f64::from(self.ghost_scans)),
            ("publish_period_scans", f64::from(self.publish_period_scans)),
        ];
        let not_negative = [
            ("noise_per_range", self.noise_per_range),
            ("open_prior", f64::from(self.open_prior)),
            ("own_body_m", self.own_body_m),
            ("scan_noise_m", self.scan_noise_m),
            ("scan_tilt_rad", self.scan_tilt_rad),
            ("fading_m2ps", self.fading_m2ps),
            ("gap_radius_m", self.gap_radius_m),
            ("publish_step_m", f64::from(self.publish_step_m)),
            ("publish_near_m", self.publish_near_m),
        ];
        SettingError::check(&positive, "a finite number > 0", |v| v.is_finite() && v > 0.0)?;
        let n_cells = self.n_rows.saturating_mul(self.n_cols);
        SettingError::check(&[("n_rows x n_cols", n_cells as f64)], "at most 4194304 cells", |n| {
            n <= CELLS_MAX as f64
        })?;
        SettingError::check(&not_negative, "a finite number >= 0", |v| v.is_finite() && v >= 0.0)?;
        let faces = self.own_body.min_m.map(|face| ("own_body.min_m", face));
        SettingError::check(&faces, "three finite numbers", f64::is_finite)?;
        let faces = self.own_body.max_m.map(|face| ("own_body.max_m", face));
        SettingError::check(&faces, "three finite numbers", f64::is_finite)?;
        SettingError::check(&[("recentre_m", self.recentre_m)], "a number > 0, infinity allowed", |v| v > 0.0)
    }

    /// Span of heights in a cell beyond which they belong to a wall [m].
    pub(super) fn steep_span_m(&self) -> f32 {
        let diagonal_m = std::f64::consts::SQRT_2 * self.resolution_m;
        self.wall_span_m.max((STEEPEST_GROUND * diagonal_m) as f32)
    }

    /// Gap radius in whole cells.
    pub(super) fn gap_radius_cells(&self) -> usize {
        (self.gap_radius_m / self.resolution_m) as usize
    }
}
