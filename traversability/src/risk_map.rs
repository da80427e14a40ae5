//! The risk map: worst expected traversability for every cell and yaw, and the ground under it.

use crate::speed_limit::SpeedLimit;
use std::ops::Deref;
use terrain::{Cell, GridGeometry, TerrainClass};

/// Worst expected traversability of one pose: left-tail CVaR of traction, right-tail CVaR of attitude
/// (PIETRA, equation 6). Laid out as four adjacent f32, so that one lookup is one 16-byte load.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Risk {
    /// Achieved over commanded speed, in [0, 1].
    pub linear_traction: f32,
    /// Achieved over commanded yaw rate, in [0, 1].
    pub angular_traction: f32,
    /// |roll| [rad].
    pub roll_rad: f32,
    /// |pitch| [rad].
    pub pitch_rad: f32,
}

impl Risk {
    /// Level ground with full traction.
    pub const NONE: Self =
        Self { linear_traction: 1.0, angular_traction: 1.0, roll_rad: 0.0, pitch_rad: 0.0 };
    /// Beyond the map: nothing is expected to move here.
    pub const OUTSIDE: Self =
        Self { linear_traction: 0.0, angular_traction: 0.0, roll_rad: 0.0, pitch_rad: 0.0 };
    /// Linear traction below which a vehicle counts as stuck [-].
    pub const STUCK_TRACTION: f32 = 0.1;
    /// What is added to the attitude of a blocked pose [rad].
    pub const BLOCKED_RAD: f32 = std::f32::consts::PI;

    /// A pose whose footprint touches an obstacle: half a turn on top of its attitude, beyond every limit, so that the
    /// attitude constraint forbids it; traction stays, so that a vehicle that finds itself here can leave.
    pub fn blocked(self) -> Self {
        if self.is_blocked() {
            return self;
        }
        let [roll_rad, pitch_rad] =
            [self.roll_rad, self.pitch_rad].map(|angle_rad| angle_rad + Self::BLOCKED_RAD);
        Self { roll_rad, pitch_rad, ..self }
    }

    /// A pose that touches an obstacle at its very heading, where a blocked one touches it at some heading that it
    /// stands for: a whole turn on top of its attitude, so that a vehicle may leave a blocked pose and not through this.
    pub fn touching(self) -> Self {
        let Self { roll_rad, pitch_rad, .. } = self.blocked();
        Self { roll_rad: roll_rad + Self::BLOCKED_RAD, pitch_rad: pitch_rad + Self::BLOCKED_RAD, ..self }
    }

    /// Whether this is the risk of a pose that is blocked or touches an obstacle.
    pub fn is_blocked(self) -> bool {
        self.roll_rad >= Self::BLOCKED_RAD
    }

    /// |roll| and |pitch| that who leaves a blocked pose has to answer for [rad]: those of the ground, whether the pose
    /// is blocked or not, and half a turn more where it touches an obstacle.
    pub fn lean_rad(self) -> [f32; 2] {
        let added_rad = if self.is_blocked() { Self::BLOCKED_RAD } else { 0.0 };
        [self.roll_rad - added_rad, self.pitch_rad - added_rad]
    }
}

/// Bits that say what a cell is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct GroundFlags(pub u8);

impl GroundFlags {
    /// Must not be touched.
    pub const OBSTACLE: Self = Self(1);
    /// Never measured, neither interpolated.
    pub const UNKNOWN: Self = Self(2);
    /// Unlike anything the learned model has seen.
    pub const OUT_OF_DISTRIBUTION: Self = Self(4);

    /// Whether all bits of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// With the bits of `other` set too.
    pub fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Friction that tyres can count on, in hundredths of their load; zero where nobody has said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct FrictionLimit(u8);

impl FrictionLimit {
    /// Nobody has said.
    pub const UNTOLD: Self = Self(0);
    /// What counts where nobody has said: more than any tyre finds [-].
    pub const UNLIMITED: f32 = 10.0;

    /// The friction, rounded down to hundredths, from 0.01 to 2.55 [-]; a number that is none is untold.
    pub fn new(friction: f32) -> Self {
        // A hair more, so that 0.29 is 29 hundredths and not 28.
        let hundredths = (100.0 * friction + 1e-3).floor();
        if hundredths.is_nan() { Self::UNTOLD } else { Self(hundredths.clamp(1.0, 255.0) as u8) }
    }

    /// Whether somebody has said.
    pub fn is_told(self) -> bool {
        self != Self::UNTOLD
    }

    /// The friction, [`Self::UNLIMITED`] where nobody has said [-].
    #[inline(always)]
    pub fn friction(self) -> f32 {
        if self.0 == 0 { Self::UNLIMITED } else { f32::from(self.0) * 0.01 }
    }

    /// As a byte of a message.
    pub fn hundredths(self) -> u8 {
        self.0
    }
}

/// The ground of one cell, whatever the yaw.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Ground {
    /// Height change per metre east and north, signed [-].
    pub gradient: [f32; 2],
    /// What covers it, as the number of a [`TerrainClass`].
    pub class: u8,
    /// Obstacle, unknown, out of distribution.
    pub flags: GroundFlags,
    /// How much it holds.
    pub friction: FrictionLimit,
    /// How fast it may be driven over.
    pub speed: SpeedLimit,
}

impl Default for Ground {
    fn default() -> Self {
        Self {
            gradient: [0.0; 2],
            class: TerrainClass::Open as u8,
            flags: GroundFlags::default(),
            friction: FrictionLimit::UNTOLD,
            speed: SpeedLimit::NONE,
        }
    }
}

/// A risk map that owns its arrays, their shape and its border. The pose that a cell and a yaw bin stand for is that of the
/// body frame: the rear axle's centre in the cell's centre, the yaw in the bin's centre.
///
/// The outermost ring of cells is [`Risk::OUTSIDE`], whatever is filled in.
#[derive(Clone, Debug, PartialEq)]
pub struct RiskMap {
    geometry: GridGeometry,
    n_yaws: usize,
    risks: Vec<Risk>,
    ground: Vec<Ground>,
}

/// A borrowed risk map: what the controller reads, wherever the arrays lie. Their shape is that of the geometry; what it
/// is made of can be read as fields and not changed, see [`RiskMapParts`].
#[derive(Clone, Copy, Debug)]
pub struct RiskMapView<'a>(RiskMapParts<'a>);

/// What a [`RiskMapView`] is made of.
#[derive(Clone, Copy, Debug)]
pub struct RiskMapParts<'a> {
    /// Where the cells lie; row-major, row 0 = south.
    pub geometry: GridGeometry,
    /// Number of yaw bins; bin k is centred at (k + 1/2) 2 pi / n_yaws.
    pub n_yaws: usize,
    /// Shape [row, col, yaw].
    pub risks: &'a [Risk],
    /// Shape [row, col].
    pub ground: &'a [Ground],
}

/// Arrays that are no risk map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{array} of a risk map of {n_rows} x {n_cols} cells and {n_yaws} yaws: expected {expected} values, found {found}"
)]
pub struct RiskMapError {
    /// Which array.
    pub array: &'static str,
    /// Rows of the geometry.
    pub n_rows: usize,
    /// Columns of the geometry.
    pub n_cols: usize,
    /// Yaw bins.
    pub n_yaws: usize,
    /// Length that the array should have.
    pub expected: usize,
    /// Length that it has.
    pub found: usize,
}

impl RiskMap {
    /// A map of the same risk everywhere inside its border, on flat open ground.
    pub fn constant(geometry: GridGeometry, n_yaws: usize, risk: Risk) -> Self {
        let mut map = Self {
            geometry,
            n_yaws,
            risks: vec![risk; geometry.n_cells() * n_yaws],
            ground: vec![Ground::default(); geometry.n_cells()],
        };
        map.close_border();
        map
    }

    /// Lets risks [row, col, yaw] and ground [row, col] be filled in place. What is written to the risks of the border
    /// does not stay.
    pub fn fill<T>(&mut self, write: impl FnOnce(&mut [Risk], &mut [Ground]) -> T) -> T {
        let result = write(&mut self.risks, &mut self.ground);
        self.close_border();
        result
    }

    /// What is told of the ground [row, col], to be changed in place.
    pub fn ground_mut(&mut self) -> &mut [Ground] {
        &mut self.ground
    }

    fn close_border(&mut self) {
        let (n_rows, n_cols, n_yaws) = (self.geometry.n_rows, self.geometry.n_cols, self.n_yaws);
        for row in 0..n_rows {
            let whole_row = row == 0 || row + 1 == n_rows;
            for col in 0..n_cols {
                if whole_row || col == 0 || col + 1 == n_cols {
                    let start = (row * n_cols + col) * n_yaws;
                    self.risks[start..start + n_yaws].fill(Risk::OUTSIDE);
                }
            }
        }
    }

    /// Where the cells lie.
    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// Moves the window without touching the values; the caller refills them.
    pub fn place_at(&mut self, origin: [i64; 2]) {
        self.geometry.origin = origin;
    }

    /// Moves the window; the values stay where they lie, and cells that enter are [`Risk::OUTSIDE`] on flat open ground.
    /// The border closes where it comes to lie: what it held before is lost.
    pub fn roll_to(&mut self, origin: [i64; 2]) {
        self.geometry.roll(&mut self.ground, origin, Ground::default());
        self.geometry.roll(&mut self.risks, origin, Risk::OUTSIDE);
        self.geometry.origin = origin;
        self.close_border();
    }

    /// The map as the controller reads it.
    pub fn view(&self) -> RiskMapView<'_> {
        let Self { geometry, n_yaws, risks, ground } = self;
        RiskMapView(RiskMapParts { geometry: *geometry, n_yaws: *n_yaws, risks, ground })
    }
}

impl<'a> RiskMapView<'a> {
    /// Arrays that lie elsewhere as a risk map: risks [row, col, yaw] and ground [row, col]. Whoever filled them answers
    /// for the border, which is [`Risk::OUTSIDE`] in every map of a [`RiskMap`].
    ///
    /// # Errors
    /// An array of another length than the geometry says.
    pub fn new(
        geometry: GridGeometry,
        n_yaws: usize,
        risks: &'a [Risk],
        ground: &'a [Ground],
    ) -> Result<Self, RiskMapError> {
        let GridGeometry { n_rows, n_cols, .. } = geometry;
        let n_cells = n_rows.saturating_mul(n_cols);
        let n_risks = n_cells.saturating_mul(n_yaws);
        for (array, expected, found) in [("risks", n_risks, risks.len()), ("ground", n_cells, ground.len())] {
            if expected != found {
                return Err(RiskMapError { array, n_rows, n_cols, n_yaws, expected, found });
            }
        }
        Ok(Self(RiskMapParts { geometry, n_yaws, risks, ground }))
    }
}

/// Read-only.
impl<'a> Deref for RiskMapView<'a> {
    type Target = RiskMapParts<'a>;
    fn deref(&self) -> &RiskMapParts<'a> {
        &self.0
    }
}

impl RiskMapView<'_> {
    /// The yaw bin that holds an angle.
    pub fn yaw_bin(&self, yaw_rad: f64) -> usize {
        let turns = (yaw_rad / std::f64::consts::TAU).rem_euclid(1.0);
        ((turns * self.n_yaws as f64) as usize).min(self.n_yaws - 1)
    }

    /// The centre of a yaw bin [rad].
    pub fn yaw_rad(&self, bin: usize) -> f64 {
        (bin as f64 + 0.5) * std::f64::consts::TAU / self.n_yaws as f64
    }

    /// Risk of one cell and yaw bin.
    pub fn risk(&self, cell: Cell, yaw_bin: usize) -> Risk {
        self.risks[self.geometry.index(cell) * self.n_yaws + yaw_bin]
    }

    /// Risk of a pose; [`Risk::OUTSIDE`] beyond the map.
    pub fn risk_at(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Risk {
        let risk = |cell| self.risk(cell, self.yaw_bin(yaw_rad));
        self.geometry.cell_at(x_m, y_m).map_or(Risk::OUTSIDE, risk)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use proptest::prelude::*;

    use super::*;

    fn geometry() -> GridGeometry {
        GridGeometry { resolution_m: 0.5, origin: [-4, 2], n_rows: 5, n_cols: 8 }
    }

    /// A risk that names its place.
    fn marked(row: usize, col: usize, yaw: usize) -> Risk {
        Risk {
            linear_traction: row as f32,
            angular_traction: col as f32,
            roll_rad: yaw as f32,
            pitch_rad: 0.5,
        }
    }

    fn marked_map(n_yaws: usize) -> RiskMap {
        let mut map = RiskMap::constant(geometry(), n_yaws, Risk::NONE);
        map.fill(|risks, _| {
            for (i, risk) in risks.iter_mut().enumerate() {
                let cell = geometry().cell(i / n_yaws);
                *risk = marked(cell.row, cell.col, i % n_yaws);
            }
        });
        map
    }

    #[test]
    fn friction_is_kept_in_hundredths_and_never_as_more_than_it_is() {
        for hundredths in 1..=255u8 {
            let friction = f32::from(hundredths) / 100.0;
            assert_eq!(FrictionLimit::new(friction).hundredths(), hundredths);
            assert!((FrictionLimit::new(friction).friction() - friction).abs() < 1e-6);
        }
        // 0.399 is 39 hundredths; what is out of range is the nearest that can be said.
        let said =
            [0.399, 0.0, -1.0, 7.0, f32::INFINITY].map(|friction| FrictionLimit::new(friction).hundredths());
        assert_eq!(said, [39, 1, 1, 255, 255]);
        assert!(!FrictionLimit::new(f32::NAN).is_told() && !Ground::default().friction.is_told());
        assert_eq!(FrictionLimit::UNTOLD.friction(), FrictionLimit::UNLIMITED);
    }

    #[test]
    fn ground_takes_no_more_room_for_its_friction_and_speed() {
        assert_eq!(size_of::<Ground>(), 12);
    }

    #[test]
    fn one_risk_is_one_sixteen_byte_load() {
        assert_eq!(size_of::<Risk>(), 16);
        assert_eq!(std::mem::offset_of!(Risk, pitch_rad), 12);
    }

    #[test]
    fn the_border_traps_and_nothing_else_does() {
        let map = marked_map(3);
        for row in 0..5 {
            for col in 0..8 {
                for yaw in 0..3 {
                    let border = row == 0 || row == 4 || col == 0 || col == 7;
                    let expected = if border { Risk::OUTSIDE } else { marked(row, col, yaw) };
                    assert_eq!(map.view().risk(Cell { row, col }, yaw), expected);
                }
            }
        }
    }

    #[test]
    fn arrays_of_another_shape_are_no_map() {
        let map = marked_map(3);
        let RiskMapParts { geometry, n_yaws, risks, ground } = *map.view();
        let same = RiskMapView::new(geometry, n_yaws, risks, ground).map(|view| view.risks.len());
        assert_eq!(same, Ok(120));
        let told = |geometry, n_yaws, risks, ground| {
            RiskMapView::new(geometry, n_yaws, risks, ground)
                .map_or_else(|error| error.to_string(), |_| String::new())
        };
        assert_eq!(
            told(geometry, n_yaws, &risks[1..], ground),
            "risks of a risk map of 5 x 8 cells and 3 yaws: expected 120 values, found 119"
        );
        assert!(told(geometry, 4, risks, ground).starts_with("risks of"));
        assert!(told(geometry, n_yaws, risks, &ground[..39]).contains("expected 40 values, found 39"));
        let endless = GridGeometry { n_rows: usize::MAX, n_cols: usize::MAX, ..geometry };
        assert!(told(endless, n_yaws, risks, ground).contains("found 120"));
    }

    #[test]
    fn maps_too_small_for_an_inside_are_all_border() {
        for (n_rows, n_cols) in [(1, 1), (2, 9), (9, 2)] {
            let geometry = GridGeometry { n_rows, n_cols, ..geometry() };
            let map = RiskMap::constant(geometry, 4, Risk::NONE);
            assert!(map.view().risks.iter().all(|&risk| risk == Risk::OUTSIDE));
        }
    }

    #[test]
    fn a_pose_finds_the_cell_and_the_yaw_that_hold_it() {
        let map = marked_map(4);
        // Column 3 spans x in [-0.5, 0), row 2 spans y in [2, 2.5); yaw bin 1 of 4 spans [pi/2, pi).
        assert_eq!(map.view().risk_at(-0.25, 2.25, 0.75 * PI), marked(2, 3, 1));
        assert_eq!(map.view().risk_at(-0.5, 2.0, PI / 2.0 + 1e-9), marked(2, 3, 1));
        for (x_m, y_m) in [(-2.1, 2.25), (2.1, 2.25), (0.0, 0.9), (0.0, 3.6), (f64::NAN, 2.0)] {
            assert_eq!(map.view().risk_at(x_m, y_m, 0.0), Risk::OUTSIDE);
        }
    }

    #[test]
    fn moving_the_window_moves_the_values() {
        let mut map = marked_map(4);
        map.place_at([96, 2]);
        // 100 cells of 0.5 m east.
        assert_eq!(map.view().risk_at(49.75, 2.25, 0.75 * PI), marked(2, 3, 1));
        assert_eq!(map.view().risk_at(-0.25, 2.25, 0.75 * PI), Risk::OUTSIDE);
    }

    #[test]
    fn rolling_keeps_what_stays_inside_for_every_shift() {
        let GridGeometry { origin: [x, y], n_rows, n_cols, .. } = geometry();
        for (east, north) in (-9..=9).flat_map(|east| (-6..=6).map(move |north| (east, north))) {
            let mut map = marked_map(2);
            map.fill(|_, ground| ground.iter_mut().enumerate().for_each(|(i, cell)| cell.class = i as u8));
            map.roll_to([x + east, y + north]);
            assert_eq!(map.geometry().origin, [x + east, y + north]);
            for index in 0..n_rows * n_cols {
                let cell = geometry().cell(index);
                let [old_row, old_col] = [cell.row as i64 + north, cell.col as i64 + east];
                let within = |value: i64, n: usize, edge: i64| (edge..n as i64 - edge).contains(&value);
                let is_held = |edge: i64| within(old_row, n_rows, edge) && within(old_col, n_cols, edge);
                let is_inside = within(cell.row as i64, n_rows, 1) && within(cell.col as i64, n_cols, 1);
                let found = (map.view().risk(cell, 1), map.view().ground[index].class);
                let risk = marked(old_row.max(0) as usize, old_col.max(0) as usize, 1);
                let class = (old_row * n_cols as i64 + old_col) as u8;
                let expected = (
                    if is_inside && is_held(1) { risk } else { Risk::OUTSIDE },
                    if is_held(0) { class } else { Ground::default().class },
                );
                assert_eq!(found, expected, "{east} {north} {cell:?}");
            }
        }
    }

    #[test]
    fn blocked_forbids_the_attitude_and_keeps_the_traction() {
        let risk = Risk { linear_traction: 0.7, ..Risk::NONE };
        assert!(!risk.is_blocked() && !Risk::OUTSIDE.is_blocked());
        assert!(risk.blocked().is_blocked());
        assert_eq!(risk.blocked().linear_traction, 0.7);
        assert!(risk.blocked().pitch_rad > std::f32::consts::FRAC_PI_2);
        assert_eq!(risk.blocked().blocked(), risk.blocked());
    }

    /// pi and an angle below pi/2 are a sum in f32 that is off by at most 2.4e-7 rad, half the last bit of 4.
    #[test]
    fn blocked_keeps_how_the_ground_leans() {
        let risk = Risk { roll_rad: 0.1, pitch_rad: 0.3, ..Risk::NONE };
        assert_eq!(risk.lean_rad(), [0.1, 0.3]);
        let [roll_rad, pitch_rad] = risk.blocked().lean_rad();
        assert!((roll_rad - 0.1).abs() < 2.4e-7 && (pitch_rad - 0.3).abs() < 2.4e-7);
    }

    #[test]
    fn touching_an_obstacle_is_worse_to_leave_through_than_being_blocked() {
        let risk = Risk { roll_rad: 0.1, pitch_rad: 0.3, ..Risk::NONE };
        let [blocked_rad, touching_rad] = [risk.blocked(), risk.touching()].map(Risk::lean_rad);
        assert!(risk.touching().is_blocked());
        assert!((0..2).all(|k| (touching_rad[k] - blocked_rad[k] - Risk::BLOCKED_RAD).abs() < 1e-6));
    }

    #[test]
    fn flags_add_up() {
        let both = GroundFlags::OBSTACLE.with(GroundFlags::UNKNOWN);
        assert!(both.contains(GroundFlags::OBSTACLE) && both.contains(GroundFlags::UNKNOWN));
        assert!(!both.contains(GroundFlags::OUT_OF_DISTRIBUTION));
        assert!(!GroundFlags::OBSTACLE.contains(both));
        assert!(both.contains(GroundFlags::default()));
    }

    proptest! {
        #[test]
        fn a_yaw_lies_within_half_a_bin_of_its_centre(yaw_rad in -20.0..20.0f64, n_yaws in 1..32usize) {
            let map = RiskMap::constant(geometry(), n_yaws, Risk::NONE);
            let view = map.view();
            let bin = view.yaw_bin(yaw_rad);
            prop_assert!(bin < n_yaws);
            let off_rad = (yaw_rad - view.yaw_rad(bin) + PI).rem_euclid(TAU) - PI;
            prop_assert!(off_rad.abs() <= PI / n_yaws as f64 + 1e-9);
            prop_assert_eq!(view.yaw_bin(view.yaw_rad(bin)), bin);
        }
    }
}
