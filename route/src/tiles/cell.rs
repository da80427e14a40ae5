//! A cell as tiles hold it, in twelve bytes.

use super::MergeReport;
use crate::{FrictionCurve, GroundCell};

/// A cell as a robot or another source measured it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredCell {
    /// The ground.
    pub ground: GroundCell,
    /// Standard deviation of its height [m].
    pub deviation_m: f32,
}

impl MeasuredCell {
    /// Nothing was measured.
    pub const UNKNOWN: Self = Self { ground: GroundCell::UNKNOWN, deviation_m: f32::INFINITY };
}

/// Heights to 1 mm, friction coefficients to 0.01, viscous ones to 1 ms/m, Stribeck speeds to 0.1 m/s, roughness to
/// 1 mm, deviations to 1 cm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packed {
    height_mm: i32,
    roughness_mm: u16,
    static_per_cent: u8,
    sliding_per_cent: u8,
    viscous_ms_per_m: u8,
    stribeck_dmps: u8,
    deviation_cm: u8,
    is_obstacle: u8,
}

/// Deviations by which heights may differ and still be of one ground.
const AGREEING: f32 = 3.0;

impl Packed {
    pub const UNKNOWN: Self = Self {
        height_mm: i32::MIN,
        roughness_mm: 0,
        static_per_cent: 0,
        sliding_per_cent: 0,
        viscous_ms_per_m: 0,
        stribeck_dmps: 0,
        deviation_cm: 0,
        is_obstacle: 0,
    };

    pub const BYTES: usize = 12;

    fn is_known(&self) -> bool {
        self.height_mm != i32::MIN
    }

    fn new(cell: &MeasuredCell) -> Self {
        let GroundCell { height_m, friction, roughness_m, is_obstacle } = cell.ground;
        // Casts of floats saturate.
        Self {
            height_mm: ((f64::from(height_m) * 1000.0).round() as i32).max(i32::MIN + 1),
            roughness_mm: (roughness_m * 1000.0).round() as u16,
            static_per_cent: (friction.static_friction * 100.0).round().max(1.0) as u8,
            sliding_per_cent: (friction.sliding_friction * 100.0).round().max(1.0) as u8,
            viscous_ms_per_m: (friction.viscous_friction * 1000.0).round() as u8,
            stribeck_dmps: (friction.stribeck_speed_mps * 10.0).round().max(1.0) as u8,
            deviation_cm: (cell.deviation_m * 100.0).round().max(1.0) as u8,
            is_obstacle: u8::from(is_obstacle),
        }
    }

    pub fn ground(&self) -> GroundCell {
        if !self.is_known() {
            return GroundCell::UNKNOWN;
        }
        GroundCell {
            height_m: (f64::from(self.height_mm) / 1000.0) as f32,
            friction: FrictionCurve {
                static_friction: f32::from(self.static_per_cent) / 100.0,
                sliding_friction: f32::from(self.sliding_per_cent) / 100.0,
                viscous_friction: f32::from(self.viscous_ms_per_m) / 1000.0,
                stribeck_speed_mps: f32::from(self.stribeck_dmps) / 10.0,
            },
            roughness_m: f32::from(self.roughness_mm) / 1000.0,
            is_obstacle: self.is_obstacle != 0,
        }
    }

    /// As it was measured; `None` where it was not.
    pub fn measured(&self) -> Option<MeasuredCell> {
        self.is_known().then(|| MeasuredCell { ground: self.ground(), deviation_m: self.deviation_m() })
    }

    fn height_m(&self) -> f64 {
        f64::from(self.height_mm) / 1000.0
    }

    fn deviation_m(&self) -> f32 {
        f32::from(self.deviation_cm) / 100.0
    }

    /// Takes over what was measured of the cell.
    pub fn merge(&mut self, measured: &MeasuredCell, report: &mut MergeReport) {
        let new = Self::new(measured);
        if !self.is_known() {
            report.n_new += 1;
            *self = new;
            return;
        }
        let apart_m = (self.height_m() - new.height_m()).abs() as f32;
        let (old_m, new_m) = (self.deviation_m(), new.deviation_m());
        if apart_m > AGREEING * old_m.hypot(new_m) {
            report.n_contradicting += 1;
            report.largest_contradiction_m = report.largest_contradiction_m.max(apart_m);
            if new_m <= old_m {
                *self = new;
            }
            return;
        }
        report.n_agreeing += 1;
        let (old_weight, new_weight) = (f64::from(old_m).powi(-2), f64::from(new_m).powi(-2));
        let sum = old_weight + new_weight;
        let height_m = (old_weight * self.height_m() + new_weight * new.height_m()) / sum;
        let deviation_cm = (100.0 * sum.powf(-0.5)).round().max(1.0) as u8;
        *self = Self { height_mm: (height_m * 1000.0).round() as i32, deviation_cm, ..new };
    }

    /// The cell that stands for four: their mean, as rough as they are and as they deviate from a plane; an obstacle
    /// where half of the known ones are.
    pub fn of_four(four: &[Self; 4]) -> Self {
        let known: Vec<&Self> = four.iter().filter(|cell| cell.is_known()).collect();
        if known.is_empty() {
            return Self::UNKNOWN;
        }
        let n = known.len() as f64;
        let mean = |value: &dyn Fn(&Self) -> f64| known.iter().map(|cell| value(cell)).sum::<f64>() / n;
        // Four heights deviate from their plane by the same amount, up and down in turn.
        let twist_mm = match four {
            [a, b, c, d] if known.len() == 4 => {
                let [a, b, c, d] = [a, b, c, d].map(|cell| f64::from(cell.height_mm));
                0.25 * (a - b - c + d)
            }
            _ => 0.0,
        };
        let rough_mm = mean(&|cell| f64::from(cell.roughness_mm).powi(2)).sqrt();
        let rounded = |value: f64| value.round() as u8;
        Self {
            height_mm: mean(&|cell| f64::from(cell.height_mm)).round() as i32,
            roughness_mm: rough_mm.hypot(twist_mm).round() as u16,
            static_per_cent: rounded(mean(&|cell| f64::from(cell.static_per_cent))),
            sliding_per_cent: rounded(mean(&|cell| f64::from(cell.sliding_per_cent))),
            viscous_ms_per_m: rounded(mean(&|cell| f64::from(cell.viscous_ms_per_m))),
            stribeck_dmps: rounded(mean(&|cell| f64::from(cell.stribeck_dmps))),
            deviation_cm: rounded(mean(&|cell| f64::from(cell.deviation_cm))),
            is_obstacle: u8::from(mean(&|cell| f64::from(cell.is_obstacle)) >= 0.5),
        }
    }

    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let ([a, b, c, d], [e, f]) = (self.height_mm.to_le_bytes(), self.roughness_mm.to_le_bytes());
        let rest = [
            self.static_per_cent,
            self.sliding_per_cent,
            self.viscous_ms_per_m,
            self.stribeck_dmps,
            self.deviation_cm,
            self.is_obstacle,
        ];
        let [g, h, i, j, k, l] = rest;
        [a, b, c, d, e, f, g, h, i, j, k, l]
    }

    pub fn from_bytes([a, b, c, d, e, f, g, h, i, j, k, l]: [u8; Self::BYTES]) -> Self {
        Self {
            height_mm: i32::from_le_bytes([a, b, c, d]),
            roughness_mm: u16::from_le_bytes([e, f]),
            static_per_cent: g,
            sliding_per_cent: h,
            viscous_ms_per_m: i,
            stribeck_dmps: j,
            deviation_cm: k,
            is_obstacle: l,
        }
    }
}
