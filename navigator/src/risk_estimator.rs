//! Who judges the ground: physics, or what was learned.

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use evidential::{BeliefMap, BeliefMapError, Learned};
use physics_prior::{Assumption, PriorMap};
use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::{Ground, RiskMap};

/// Makes a risk map of a surface and keeps it up to date, whoever judges the ground.
pub enum RiskEstimator {
    /// The physics prior, or none.
    Prior(Box<PriorMap>),
    /// Networks, fused with a prior.
    Networks(Box<BeliefMap>),
}

impl RiskEstimator {
    /// See [`PriorMap::new`].
    ///
    /// # Errors
    /// As there.
    pub fn prior(
        geometry: &Geometry,
        assumption: &Assumption,
        surface_resolution_m: f64,
        risk: GridGeometry,
        n_yaws: usize,
        instructions: Instructions,
    ) -> Result<Self, BeliefMapError> {
        let map = PriorMap::new(geometry, assumption, surface_resolution_m, risk, n_yaws, instructions)?;
        Ok(Self::Prior(Box::new(map)))
    }

    /// See [`BeliefMap::new`].
    ///
    /// # Errors
    /// As there.
    pub fn networks(
        geometry: &Geometry,
        learned: &Learned,
        surface_resolution_m: f64,
        risk: GridGeometry,
        n_yaws: usize,
        instructions: Instructions,
    ) -> Result<Self, BeliefMapError> {
        let map = BeliefMap::new(geometry, learned, surface_resolution_m, risk, n_yaws, instructions)?;
        Ok(Self::Networks(Box::new(map)))
    }

    /// The map as of the last update.
    pub fn risk_map(&self) -> &RiskMap {
        match self {
            Self::Prior(map) => map.risk_map(),
            Self::Networks(map) => map.risk_map(),
        }
    }

    /// What is told of the ground [row, col], to be changed in place; the next update may forget it.
    pub fn ground_mut(&mut self) -> &mut [Ground] {
        match self {
            Self::Prior(map) => map.ground_mut(),
            Self::Networks(map) => map.ground_mut(),
        }
    }

    /// Moves the window to another origin on the lattice of risk cells; the next update is a full one.
    pub fn place_at(&mut self, origin: [i64; 2]) {
        match self {
            Self::Prior(map) => map.place_at(origin),
            Self::Networks(map) => map.place_at(origin),
        }
    }

    /// Takes over the whole surface. What lies beyond its window is unknown.
    ///
    /// # Errors
    /// The surface has another resolution than the map was made for.
    pub fn update_all(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), BeliefMapError> {
        match self {
            Self::Prior(map) => Ok(map.update_all(surface)?),
            Self::Networks(map) => map.update_all(surface).map(drop),
        }
    }

    /// Takes over a surface and judges anew what changed since the last update: the result is that of a full one.
    ///
    /// # Errors
    /// The surface has another resolution than the map was made for.
    pub fn update(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), BeliefMapError> {
        match self {
            Self::Prior(map) => Ok(map.update(surface)?),
            Self::Networks(map) => map.update(surface).map(drop),
        }
    }
}
