//! How fast ground may be driven over: what is quasi-static at a walk throws a vehicle that is fast.

use std::f32::consts::SQRT_2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use crate::risk_map::{Risk, RiskMapView};
use terrain::{Cell, GridGeometry};

/// Standard gravity [m/s2].
const GRAVITY_MPS2: f32 = 9.806_65;

/// Fastest that a cell is to be driven over with, in tenths of a metre per second; zero where nothing limits it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct SpeedLimit(u8);

impl SpeedLimit {
    /// Nothing limits it.
    pub const NONE: Self = Self(0);
    /// What counts where nothing limits it: faster than anything drives [m/s].
    pub const UNLIMITED_MPS: f32 = 1e3;

    /// The speed, rounded down to tenths and at least 0.1 m/s; beyond 25.5 m/s, and for a number that is none, no limit.
    pub fn new(mps: f32) -> Self {
        // A hair more, so that 0.3 is three tenths and not two.
        let tenths = (10.0 * mps + 1e-3).floor();
        if tenths <= 255.0 { Self(tenths.max(1.0) as u8) } else { Self::NONE }
    }

    /// The speed, [`Self::UNLIMITED_MPS`] where nothing limits it [m/s].
    #[inline(always)]
    pub fn mps(self) -> f32 {
        if self.0 == 0 { Self::UNLIMITED_MPS } else { f32::from(self.0) * 0.1 }
    }

    /// As a byte of a message.
    pub fn tenths(self) -> u8 {
        self.0
    }
}

/// How fast a vehicle may be where the ground turns its body.
///
/// Over ground on which |roll| changes by r along the way [rad/m], a body at the speed v turns with v r. If the wheels
/// leave the ground on one side, weight alone turns the body back, with the angular acceleration a about those that stay:
/// it turns further by (v r)^2 / 2a. So that this stays within what is left of the limit, m, v is at most sqrt(2 a m) / r;
/// the same for pitch. Beside that the vehicle follows the ground only as long as its weight can bend its way: a change of
/// pitch of r along the way takes the acceleration v^2 r, of which there is at most that of gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLaw {
    /// Angular acceleration with which weight alone turns the body back, about its length and across it [rad/s2].
    pub righting_radps2: [f32; 2],
    /// Largest |roll| and |pitch| [rad].
    pub most_rad: [f32; 2],
    /// What is no slower than this is driven over as if it stood [m/s].
    pub least_mps: f32,
    /// Fastest that the vehicle drives: what is faster limits nothing [m/s].
    pub most_mps: f32,
    /// How far around a place its limit holds [m].
    pub reach_m: f64,
}

/// The headings along which the ground is looked at, since the way back over it is the same: east and north in cells,
/// angle [rad], length [cells].
const STEPS: [([isize; 2], f64, f32); 4] = [
    ([1, 0], 0.0, 1.0),
    ([1, 1], FRAC_PI_4, SQRT_2),
    ([0, 1], FRAC_PI_2, 1.0),
    ([-1, 1], 3.0 * FRAC_PI_4, SQRT_2),
];

impl SpeedLaw {
    /// The limit of every cell of a map [m/s], shape [row, col], by its `risks` or by another's of its shape; infinite
    /// where there is none: on the border, and where no speed is slow enough.
    pub fn limits(&self, map: &RiskMapView<'_>, risks: &[Risk], limits_mps: &mut Vec<f32>) {
        let GridGeometry { n_rows, n_cols, resolution_m, .. } = map.geometry;
        limits_mps.clear();
        limits_mps.resize(n_rows * n_cols, f32::INFINITY);
        let bins = STEPS.map(|(_, yaw_rad, _)| map.yaw_bin(yaw_rad));
        let per_m = STEPS.map(|(.., length_cells)| 0.5 / (length_cells * resolution_m as f32));
        for row in 1..n_rows.saturating_sub(1) {
            for col in 1..n_cols.saturating_sub(1) {
                let index = map.geometry.index(Cell { row, col });
                let along = |k: usize| {
                    let ([east, north], ..) = STEPS[k];
                    let step = north * n_cols as isize + east;
                    let risk = |index: usize| risks[index * map.n_yaws + bins[k]];
                    let [behind, ahead] = [-step, step].map(|step| index.wrapping_add_signed(step));
                    self.along([risk(behind), risk(index), risk(ahead)], per_m[k])
                };
                limits_mps[index] = along(0).min(along(1)).min(along(2)).min(along(3));
            }
        }
        self.spread(n_cols, (self.reach_m / resolution_m).round() as usize, limits_mps);
    }

    /// Fastest over three poses one after the other, of which the outer ones are 1 / (2 `per_m`) apart [m/s].
    fn along(&self, [behind, here, ahead]: [Risk; 3], per_m: f32) -> f32 {
        let poses = [behind, here, ahead];
        if poses.iter().any(|risk| *risk == Risk::OUTSIDE || self.forbids(risk)) {
            return f32::INFINITY;
        }
        let [behind, here, ahead] = poses.map(Risk::lean_rad);
        let mut fastest_mps = f32::INFINITY;
        for axis in 0..2 {
            let rate_per_m = (ahead[axis] - behind[axis]).abs() * per_m;
            let left_rad = self.most_rad[axis] - here[axis];
            let upright_mps = (2.0 * self.righting_radps2[axis] * left_rad).sqrt() / rate_per_m;
            fastest_mps = fastest_mps.min(upright_mps);
            if axis == 1 {
                fastest_mps = fastest_mps.min((GRAVITY_MPS2 / rate_per_m).sqrt());
            }
        }
        fastest_mps
    }

    /// Whether no speed is slow enough here.
    fn forbids(&self, risk: &Risk) -> bool {
        risk.roll_rad > self.most_rad[0] || risk.pitch_rad > self.most_rad[1]
    }

    /// The least of the limits within a square of so many cells to every side, held to where they mean something.
    fn spread(&self, n_cols: usize, reach: usize, limits_mps: &mut [f32]) {
        let mut line = Vec::new();
        for row in limits_mps.chunks_exact_mut(n_cols) {
            line.clear();
            line.extend_from_slice(row);
            row.iter_mut().enumerate().for_each(|(place, limit)| *limit = least_around(&line, place, reach));
        }
        for col in 0..n_cols {
            line.clear();
            line.extend(limits_mps.iter().skip(col).step_by(n_cols));
            let column = limits_mps.iter_mut().skip(col).step_by(n_cols);
            column.enumerate().for_each(|(place, limit)| {
                let least_mps = least_around(&line, place, reach);
                *limit =
                    if least_mps < self.most_mps { least_mps.max(self.least_mps) } else { f32::INFINITY };
            });
        }
    }
}

/// Least of a line from `reach` before a place to `reach` behind it.
fn least_around(line: &[f32], place: usize, reach: usize) -> f32 {
    let end = (place + reach + 1).min(line.len());
    line[place.saturating_sub(reach)..end].iter().copied().fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RiskMap;

    const LAW: SpeedLaw = SpeedLaw {
        righting_radps2: [20.0, 10.0],
        most_rad: [0.5, 0.6],
        least_mps: 0.5,
        most_mps: 6.0,
        reach_m: 0.0,
    };
    /// A window of 9 x 11 cells of 0.2 m.
    const GEOMETRY: GridGeometry = GridGeometry { resolution_m: 0.2, origin: [-3, 4], n_rows: 9, n_cols: 11 };

    /// |roll| and |pitch| by column and row, the same for every heading.
    fn map(lean_rad: impl Fn(f32, f32) -> [f32; 2]) -> RiskMap {
        let mut map = RiskMap::constant(GEOMETRY, 16, Risk::NONE);
        map.fill(|risks, _| {
            for (index, risk) in risks.iter_mut().enumerate() {
                let cell = GEOMETRY.cell(index / 16);
                [risk.roll_rad, risk.pitch_rad] = lean_rad(cell.col as f32, cell.row as f32);
            }
        });
        map
    }

    fn limits(law: &SpeedLaw, map: &RiskMap) -> Vec<f32> {
        let mut limits_mps = vec![7.0; 3];
        law.limits(&map.view(), map.view().risks, &mut limits_mps);
        assert_eq!(limits_mps.len(), GEOMETRY.n_cells());
        limits_mps
    }

    fn at(limits_mps: &[f32], row: usize, col: usize) -> f32 {
        limits_mps[GEOMETRY.index(Cell { row, col })]
    }

    /// Cells whose neighbours are no border.
    fn inner() -> impl Iterator<Item = (usize, usize)> {
        (2..7).flat_map(|row| (2..9).map(move |col| (row, col)))
    }

    #[test]
    fn speeds_are_kept_in_tenths_and_never_as_more_than_they_are() {
        for tenths in 1..=255u8 {
            let mps = f32::from(tenths) / 10.0;
            assert_eq!(SpeedLimit::new(mps).tenths(), tenths);
            assert!((SpeedLimit::new(mps).mps() - mps).abs() < 1e-5);
        }
        assert_eq!([0.39, 0.0, -1.0, 25.59].map(|mps| SpeedLimit::new(mps).tenths()), [3, 1, 1, 255]);
        for mps in [25.7, f32::INFINITY, f32::NAN] {
            assert_eq!(SpeedLimit::new(mps), SpeedLimit::NONE);
        }
        assert_eq!(SpeedLimit::NONE.mps(), SpeedLimit::UNLIMITED_MPS);
    }

    /// Roll that grows by 1 rad/m to the east turns a body with as many rad/s as the speed has m/s. Its weight stops it
    /// within v^2 / (2 20 rad/s2): of 0.5 rad, 0.26 are left where it rolls by 0.24, which is 3.22 m/s.
    #[test]
    fn what_turns_the_body_leaves_room_to_turn_back() {
        let map = map(|col, _| [0.04 + 0.2 * (col - 2.0).clamp(0.0, 2.0), 0.0]);
        let limits_mps = limits(&LAW, &map);
        let left_rad = 0.5 - 0.24_f32;
        assert!((at(&limits_mps, 4, 3) - (40.0 * left_rad).sqrt()).abs() < 1e-4);
        // Where it is level on one side, half as much.
        let half = (40.0 * (0.5 - 0.04_f32)).sqrt() / 0.5;
        assert!(half > LAW.most_mps && at(&limits_mps, 4, 2).is_infinite());
        assert!(at(&limits_mps, 4, 7).is_infinite(), "leaning as much from here on");
    }

    /// Pitch that changes by 1 rad/m takes the whole weight at the speed whose square is 9.80665, northward and southward;
    /// on the diagonals it changes by less.
    #[test]
    fn what_the_ground_bends_away_from_lets_go() {
        let law = SpeedLaw { most_rad: [0.5, 2.0], ..LAW };
        let limits_mps = limits(&law, &map(|_, row| [0.0, 0.4 * (row - 4.0).abs().min(1.0)]));
        for row in [3, 5] {
            assert!((at(&limits_mps, row, 5) - 9.806_65_f32.sqrt()).abs() < 1e-4);
        }
        assert!(at(&limits_mps, 6, 5).is_infinite(), "the same pitch from here on");
    }

    #[test]
    fn level_ground_and_the_same_lean_everywhere_limit_nothing() {
        for lean_rad in [[0.0, 0.0], [0.3, 0.2]] {
            assert!(limits(&LAW, &map(|_, _| lean_rad)).iter().all(|limit| limit.is_infinite()));
        }
    }

    #[test]
    fn who_may_not_be_there_is_told_no_speed() {
        let mut map = map(|col, _| [0.4 * (1.0 - (col - 5.0).abs()).max(0.0), 0.0]);
        assert!(at(&limits(&LAW, &map), 4, 4) < LAW.most_mps);
        map.fill(|risks, _| {
            risks.iter_mut().filter(|risk| risk.roll_rad > 0.0).for_each(|risk| *risk = risk.blocked())
        });
        assert!(limits(&LAW, &map).iter().all(|limit| limit.is_infinite()));
        let broken = Risk { roll_rad: f32::NAN, ..Risk::NONE };
        map.fill(|risks, _| {
            risks.iter_mut().filter(|risk| risk.is_blocked()).for_each(|risk| *risk = broken)
        });
        assert!(
            limits(&LAW, &map).iter().all(|limit| limit.is_infinite()),
            "what is no number limits nothing"
        );
    }

    /// Within the reach, the least counts; what is slower than the least that means something is that.
    #[test]
    fn a_limit_holds_around_its_place() {
        let map = map(|col, row| [0.45 * (1.0 - (col - 5.0).abs() - (row - 4.0).abs()).max(0.0), 0.0]);
        let near = limits(&LAW, &map);
        let far = limits(&SpeedLaw { reach_m: 0.4, ..LAW }, &map);
        for (row, col) in inner() {
            let square = (row - 2..=row + 2).flat_map(|row| (col - 2..=col + 2).map(move |col| (row, col)));
            let least_mps = square.map(|(row, col)| at(&near, row, col)).fold(f32::INFINITY, f32::min);
            assert_eq!(at(&far, row, col).to_bits(), least_mps.to_bits(), "{row} {col}");
        }
        let slow = limits(&SpeedLaw { righting_radps2: [1e-3, 1e-3], ..LAW }, &map);
        assert_eq!(at(&slow, 4, 4).to_bits(), LAW.least_mps.to_bits());
    }
}
