//! The risk map that the controller drives on, from whatever is believed of the ground.

use std::sync::Arc;

use bicycle::Geometry;
use physics_prior::{Assumption, PriorConfig, PriorMap, PriorMapError};
use rayon::prelude::*;
use terrain::{CellRegion, GridGeometry, GridMap, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMap, RiskMapView};

/// Risk of a pose of the body frame, from x [m], y [m] and yaw [rad].
pub type RiskOracle = Arc<dyn Fn(f64, f64, f64) -> Risk + Send + Sync>;

/// What is believed of the ground.
#[derive(Clone)]
pub enum Belief {
    /// The physics prior.
    Physics,
    /// No slip, full traction, level everywhere.
    Nominal,
    /// What somebody who knows says; obstacles still come from the map.
    Given(RiskOracle),
}

/// A risk map and what it is made with.
pub(crate) struct RiskLayer {
    prior: PriorMap,
    given: Option<(RiskOracle, RiskMap)>,
    recentre_cells: i64,
    is_filled: bool,
}

impl RiskLayer {
    pub fn new(
        belief: &Belief,
        prior: &PriorConfig,
        level: CvarLevel,
        geometry: &Geometry,
        config: &crate::Config,
    ) -> Result<Self, PriorMapError> {
        let assumption = match belief {
            Belief::Physics => Assumption::Physics { prior: *prior, level },
            Belief::Nominal | Belief::Given(_) => {
                Assumption::Nominal { obstacle_margin_m: prior.obstacle_margin_m }
            }
        };
        let window = &config.risk_map;
        let resolution_m = config.risk_resolution_m();
        let grid = GridGeometry::centred(resolution_m, window.n_rows, window.n_cols, 0.0, 0.0);
        let given = match belief {
            Belief::Given(oracle) => {
                Some((Arc::clone(oracle), RiskMap::constant(grid, window.n_yaws, Risk::OUTSIDE)))
            }
            Belief::Physics | Belief::Nominal => None,
        };
        Ok(Self {
            prior: PriorMap::new(geometry, &assumption, config.elevation.resolution_m, grid, window.n_yaws)?,
            given,
            recentre_cells: (window.recentre_m / resolution_m).ceil() as i64,
            is_filled: false,
        })
    }

    /// The map, once there was an update.
    pub fn view(&self) -> Option<RiskMapView<'_>> {
        let map = self.given.as_ref().map_or(self.prior.risk_map(), |(_, map)| map);
        self.is_filled.then(|| map.view())
    }

    /// Follows the vehicle and takes over what changed of the surface.
    pub fn update(
        &mut self,
        position_m: [f64; 2],
        surface: &GridMap<SurfaceCell>,
        changed: &CellRegion,
    ) -> Result<(), PriorMapError> {
        self.follow(position_m);
        if self.is_filled {
            self.prior.update_dirty(surface, changed)?;
        } else {
            self.prior.update_all(surface)?;
        }
        if let Some((oracle, map)) = &mut self.given {
            ask(oracle, self.prior.risk_map().view(), map);
        }
        self.is_filled = true;
        Ok(())
    }

    fn follow(&mut self, position_m: [f64; 2]) {
        let now = *self.prior.risk_map().geometry();
        let [x_m, y_m] = position_m;
        let wanted = GridGeometry::centred(now.resolution_m, now.n_rows, now.n_cols, x_m, y_m);
        let is_far = |axis: usize| (wanted.origin[axis] - now.origin[axis]).abs() >= self.recentre_cells;
        if !self.is_filled || is_far(0) || is_far(1) {
            self.prior.place_at(wanted.origin);
            if let Some((_, map)) = &mut self.given {
                map.place_at(wanted.origin);
            }
        }
    }
}

/// Fills `map` with what the oracle says, except where `known` is blocked or outside.
fn ask(oracle: &RiskOracle, known: RiskMapView<'_>, map: &mut RiskMap) {
    let (risks, ground) = map.arrays_mut();
    ground.copy_from_slice(known.ground);
    let per_row = known.geometry.n_cols * known.n_yaws;
    let rows = risks.par_chunks_mut(per_row).zip(known.risks.par_chunks(per_row)).enumerate();
    rows.for_each(|(row, (risks, known_risks))| {
        for (place, (risk, known_risk)) in risks.iter_mut().zip(known_risks).enumerate() {
            let cell = traversability::Cell { row, col: place / known.n_yaws };
            let [x_m, y_m] = known.geometry.centre_m(cell);
            *risk = if *known_risk == Risk::NONE {
                oracle(x_m, y_m, known.yaw_rad(place % known.n_yaws))
            } else {
                *known_risk
            };
        }
    });
}
