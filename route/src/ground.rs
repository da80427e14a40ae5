//! The map that a route is searched on.

use crate::FrictionCurve;
use terrain::{Cell, GridGeometry, GridMap};

/// What is known of one cell (AnyNav, section 4.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundCell {
    /// Height of the ground [m]; NaN where nothing is known.
    pub height_m: f32,
    /// How much it holds.
    pub friction: FrictionCurve,
    /// Standard deviation of the heights in the cell about their plane (the root of equation 36's mean) [m].
    pub roughness_m: f32,
    /// Whether something stands or lies there that nobody drives over: a tree, a wall, water.
    pub is_obstacle: bool,
}

impl GroundCell {
    /// Level ground of a friction.
    pub const fn level(friction: FrictionCurve) -> Self {
        Self { height_m: 0.0, friction, roughness_m: 0.0, is_obstacle: false }
    }

    /// Ground of which nothing is known.
    pub const UNKNOWN: Self = Self {
        height_m: f32::NAN,
        ..Self::level(FrictionCurve { static_friction: 0.0, ..FrictionCurve::ICE })
    };

    /// Whether its height is known.
    pub fn is_known(&self) -> bool {
        !self.height_m.is_nan()
    }
}

/// A cell that holds no usable numbers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("ground at ({:.1}, {:.1}) m: expected {expected}, found {found}", .at_m[0], .at_m[1])]
pub struct GroundError {
    /// Centre of the cell [m].
    pub at_m: [f64; 2],
    /// What would do.
    pub expected: &'static str,
    /// What was found.
    pub found: f32,
}

/// Whether every known cell holds numbers that a ground can have.
pub(crate) fn check(ground: &GridMap<GroundCell>) -> Result<(), GroundError> {
    let geometry = ground.geometry();
    let mut cells = ground.values().iter().enumerate();
    cells.try_for_each(|(index, cell)| check_cell(geometry, geometry.cell(index), cell))
}

/// The same for one cell.
pub(crate) fn check_cell(geometry: &GridGeometry, at: Cell, cell: &GroundCell) -> Result<(), GroundError> {
    match fault(cell).filter(|_| cell.is_known()) {
        Some((expected, found)) => Err(GroundError { at_m: geometry.centre_m(at), expected, found }),
        None => Ok(()),
    }
}

fn fault(cell: &GroundCell) -> Option<(&'static str, f32)> {
    if !cell.height_m.is_finite() {
        return Some(("a finite height or NaN for none", cell.height_m));
    }
    if !cell.friction.is_valid() {
        return Some((FrictionCurve::EXPECTED, cell.friction.static_friction));
    }
    let is_rough = (0.0..=100.0).contains(&cell.roughness_m);
    (!is_rough).then_some(("a roughness within 0 and 100 m", cell.roughness_m))
}

impl terrain::Height for GroundCell {
    fn height_m(&self) -> f32 {
        self.height_m
    }
}
