//! From labels on a surface to examples.

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use physics_prior::{Assumption, PriorConfig, PriorField, PriorMapError};
use terrain::{
    Footprint, GridGeometry, GridMap, SurfaceCell, WheelLayout, YawFootprint, footprint_unevenness,
};
use traversability::CvarLevel;

use super::Example;
use crate::{FeatureLayout, Label};

/// Looks at the ground under labelled poses: features, physics prior, unevenness.
#[derive(Clone, Debug)]
pub struct Surveyor {
    layout: FeatureLayout,
    wheels: WheelLayout,
    body: Footprint,
    prior: PriorField,
}

/// Why the ground cannot be looked at.
pub type SurveyorError = PriorMapError;

/// Yaws that decide how far around it the ground is read.
const N_YAWS: usize = 16;
/// Side of the window in which the prior is asked [cells]; odd, so that a pose can be in its middle.
const WINDOW_CELLS: usize = 3;

impl Surveyor {
    /// A surveyor for surfaces of one resolution.
    ///
    /// # Errors
    /// A parameter of the prior is out of range.
    pub fn new(
        geometry: &Geometry,
        layout: FeatureLayout,
        prior: PriorConfig,
        resolution_m: f64,
    ) -> Result<Self, SurveyorError> {
        let assumption = Assumption::Physics { prior, level: CvarLevel::MEAN };
        let window =
            GridGeometry { resolution_m, origin: [0, 0], n_rows: WINDOW_CELLS, n_cols: WINDOW_CELLS };
        Ok(Self {
            layout,
            wheels: WheelLayout { wheelbase_m: geometry.wheelbase_m, track_m: geometry.track_m },
            body: Footprint {
                front_m: geometry.length_m - geometry.rear_overhang_m,
                rear_m: geometry.rear_overhang_m,
                half_width_m: 0.5 * geometry.width_m,
            },
            prior: PriorField::new(
                geometry,
                &assumption,
                resolution_m,
                window,
                N_YAWS,
                Instructions::widest(),
            )?,
        })
    }

    /// The example of a label; `None` where no wheel stands on known ground, or less than the footprint needs is
    /// known.
    ///
    /// # Errors
    /// A surface of another resolution.
    pub fn example(
        &mut self,
        surface: &GridMap<SurfaceCell>,
        label: &Label,
        drive: u32,
    ) -> Result<Option<Example>, SurveyorError> {
        let [x_m, y_m, yaw_rad] = label.pose;
        let geometry = surface.geometry();
        let Some(cell) = geometry.cell_at(x_m, y_m) else { return Ok(None) };
        let Some(unevenness_m) = self.unevenness_m(surface, label.pose) else { return Ok(None) };
        let Some(features) = self.layout.features(surface, label.pose) else { return Ok(None) };
        let half = WINDOW_CELLS as i64 / 2;
        let middle = [cell.col as i64 + geometry.origin[0], cell.row as i64 + geometry.origin[1]];
        self.prior.place_at(middle.map(|index| index - half));
        self.prior.read_all(surface)?;
        let Some(belief) = self.prior.belief(x_m, y_m, yaw_rad) else { return Ok(None) };
        let prior = [belief.linear, belief.angular, belief.roll, belief.pitch];
        let prior = prior.map(|pmf| *pmf.probabilities());
        Ok(Some(Example { features, measured: label.measured, prior, unevenness_m, drive, pose: label.pose }))
    }

    /// Standard deviation of elevation under the footprint [m]; `None` where the footprint leaves the surface or less
    /// than two of its cells are known.
    pub fn unevenness_m(&self, surface: &GridMap<SurfaceCell>, [x_m, y_m, yaw_rad]: [f64; 3]) -> Option<f32> {
        let geometry = surface.geometry();
        let cell = geometry.cell_at(x_m, y_m)?;
        let turned = YawFootprint::new(&self.wheels, &self.body, geometry.resolution_m, yaw_rad);
        let unevenness_m = footprint_unevenness(surface, cell, &turned);
        (turned.is_inside(cell, geometry) && !unevenness_m.is_nan()).then_some(unevenness_m)
    }
}
