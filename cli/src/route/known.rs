//! What is known of the ground: how much it holds, and what routes are searched on.

use std::path::Path;

use ::route::{ClassFriction, FrictionCurve, GroundCell, GroundLayers};
use formats::{ConfigText, ElevationFile, MapReference, read_elevation};
use friction::FrictionTable;
use navigator::FrictionConfig;
use terrain::GridMap;

use super::tiles::Tiles;
use crate::UsageError;
use crate::arguments::{BareGround, GroundKinds, RouteGround};

/// Ground that routes are searched on.
pub(super) struct Known {
    pub ground: GridMap<GroundCell>,
    /// Where it lies on the globe, if its file tells.
    pub reference: Option<MapReference>,
}

/// The ground of an elevation file, or of a map in tiles what lies around start and goal.
pub(super) fn known(world: &Path, asked: &RouteGround, ends_m: [[f64; 2]; 2]) -> Result<Known, UsageError> {
    if world.is_dir() { Tiles::open(world, asked)?.known(ends_m) } else { of_file(world, asked) }
}

/// The ground of an elevation file.
pub(super) fn of_file(world: &Path, asked: &RouteGround) -> Result<Known, UsageError> {
    let file = read_elevation(world).map_err(UsageError::from_input)?;
    let cell_m = asked.cell.unwrap_or_else(|| file.elevation.geometry().resolution_m.clamp(0.5, 2.0));
    let ground = ground_of(&file, &class_friction(&asked.kinds)?, cell_m)?;
    Ok(Known { ground, reference: file.reference() })
}

/// The ground of an elevation file in cells of a size [m].
pub(crate) fn ground_of(
    file: &ElevationFile,
    friction: &ClassFriction,
    cell_m: f64,
) -> Result<GridMap<GroundCell>, UsageError> {
    let layers = GroundLayers {
        elevation_m: &file.elevation,
        low_vegetation_fraction: file.layers.low_vegetation_fraction.as_ref(),
        water: file.layers.water.as_ref(),
        ground_gap_m: file.layers.ground_gap_m.as_ref(),
        bare: friction.open,
        grass: friction.vegetation,
    };
    layers.ground(cell_m).map_err(UsageError::from_input)
}

/// How much ground of each class holds.
pub(crate) fn class_friction(kinds: &GroundKinds) -> Result<ClassFriction, UsageError> {
    let learned = learned(kinds.friction.as_deref())?;
    let curve = |ground: BareGround| {
        let (name, published) = ground.published();
        learned.as_ref().map_or(published, |table| table.curve_or(name, published))
    };
    Ok(ClassFriction {
        open: curve(kinds.bare.unwrap_or_default()),
        loose: curve(BareGround::Sand),
        vegetation: curve(BareGround::Grass),
    })
}

impl BareGround {
    fn published(self) -> (&'static str, FrictionCurve) {
        FrictionCurve::PUBLISHED[self as usize]
    }
}

/// Sliding speed at which the controller is told of friction [m/s].
const TOLD_AT_MPS: f32 = 1.0;

/// What the controller is told of friction, if a file was named.
pub(crate) fn known_friction(kinds: &GroundKinds) -> Result<Option<FrictionConfig>, UsageError> {
    if kinds.friction.is_none() {
        return Ok(None);
    }
    let at = |curve: FrictionCurve| Some(f64::from(curve.at(TOLD_AT_MPS)));
    let ClassFriction { open, loose, vegetation } = class_friction(kinds)?;
    Ok(Some(FrictionConfig { open: at(open), loose: at(loose), vegetation: at(vegetation) }))
}

/// The friction that drives showed, if a file was named.
fn learned(path: Option<&Path>) -> Result<Option<FrictionTable>, UsageError> {
    let Some(path) = path else { return Ok(None) };
    let text = ConfigText::read(path).map_err(UsageError::from_input)?;
    let table: FrictionTable = text.parse().map_err(UsageError::from_input)?;
    match table.validate() {
        Ok(()) => Ok(Some(table)),
        Err(error) => Err(UsageError::from_input(text.refuse(&error.field, error.expected, error.found))),
    }
}
