//! From the known surface to a risk map, whole or where something changed.

use std::ops::Range;

use bicycle::Geometry;
use rayon::prelude::*;
use terrain::{CellRegion, GridGeometry, GridMap, SurfaceCell};
use traversability::{CvarLevel, Risk, RiskMap};

use crate::lattice::Ratio;
use crate::lengths::Lengths;
use crate::outcomes::Equations;
use crate::poses::{Judgement, Physics, Poses};
use crate::tails::Tails;
use crate::{PriorBelief, PriorConfig, PriorConfigError};

/// What a [`PriorMap`] takes the ground for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Assumption {
    /// The physics prior, judged at a CVaR level.
    Physics {
        /// Its parameters.
        prior: PriorConfig,
        /// Share of the worst outcomes that counts.
        level: CvarLevel,
    },
    /// Full traction and level ground everywhere; obstacles stay obstacles. The comparison that shows what a
    /// prior buys.
    Nominal {
        /// Widens the footprint that must not touch an obstacle, as in [`PriorConfig::obstacle_margin_m`] [m].
        obstacle_margin_m: f64,
    },
}

/// Why no map can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PriorMapError {
    /// A parameter of the prior makes no sense.
    #[error("physics prior, {0}")]
    Config(#[from] PriorConfigError),
    /// The cells of the two maps never line up.
    #[error(
        "resolution of the risk map: expected n/d times the surface's {surface_m} m with d up to 16, found {risk_m} m"
    )]
    Resolution {
        /// Of the surface [m].
        surface_m: f64,
        /// Of the risk map [m].
        risk_m: f64,
    },
    /// A surface of another resolution than the map was made for.
    #[error("resolution of the surface: expected {expected_m} m, found {found_m} m")]
    SurfaceResolution {
        /// What the map was made for [m].
        expected_m: f64,
        /// What came [m].
        found_m: f64,
    },
    /// A map without yaws.
    #[error("number of yaw bins: expected at least 1, found 0")]
    NoYaws,
}

/// A risk map made from what is known of the ground, by physics alone.
///
/// Poses are those of [`RiskMap`]: the rear axle's centre in the centre of a cell, the yaw in the centre of its
/// bin. A pose whose footprint touches an obstacle is [`Risk::blocked`]. Runs in the rayon pool of the caller;
/// the result does not depend on the number of threads.
#[derive(Clone, Debug)]
pub struct PriorMap {
    poses: Poses,
    map: RiskMap,
    /// The surface's window that the map was filled from; `None` while the map is out of date.
    filled_from: Option<GridGeometry>,
}

impl PriorMap {
    /// A map in the window `risk` for surfaces of the given resolution; [`Risk::OUTSIDE`] until it is updated.
    ///
    /// `geometry` comes from a vehicle that passed [`bicycle::Vehicle::validate`].
    pub fn new(
        geometry: &Geometry,
        assumption: &Assumption,
        surface_resolution_m: f64,
        risk: GridGeometry,
        n_yaws: usize,
    ) -> Result<Self, PriorMapError> {
        if n_yaws == 0 {
            return Err(PriorMapError::NoYaws);
        }
        let ratio = Ratio::new(risk.resolution_m, surface_resolution_m).ok_or(PriorMapError::Resolution {
            surface_m: surface_resolution_m,
            risk_m: risk.resolution_m,
        })?;
        let (lengths, judgement) = judged(geometry, assumption)?;
        Ok(Self {
            poses: Poses::new(judgement, lengths, ratio, surface_resolution_m, &risk, n_yaws),
            map: RiskMap::constant(risk, n_yaws, Risk::OUTSIDE),
            filled_from: None,
        })
    }

    /// The map as of the last update.
    pub fn risk_map(&self) -> &RiskMap {
        &self.map
    }

    /// Moves the window to another origin on the lattice of risk cells; the next update is a full one.
    pub fn place_at(&mut self, origin: [i64; 2]) {
        if origin != self.map.geometry().origin {
            self.map.place_at(origin);
            self.poses.move_to(self.map.geometry());
            self.filled_from = None;
        }
    }

    /// Judges at another level from the next update on, which is a full one. The nominal assumption has none.
    pub fn set_level(&mut self, level: CvarLevel) {
        if let Judgement::Physics(physics) = &mut self.poses.judgement {
            physics.tails = Tails::new(&physics.equations, level);
            self.filled_from = None;
        }
    }

    /// Takes over the whole surface. What lies beyond its window is unknown.
    pub fn update_all(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        self.check_resolution(surface)?;
        let window = *self.poses.ground.window();
        let last = [window.origin[0] + window.n_cols as i64 - 1, window.origin[1] + window.n_rows as i64 - 1];
        self.poses.ground.read(surface, window.origin, last);
        let geometry = *self.map.geometry();
        self.fill(surface, 0..geometry.n_rows, 0..geometry.n_cols);
        self.filled_from = Some(*surface.geometry());
        Ok(())
    }

    /// Takes over the cells of the surface that changed since the last update, and judges anew only the poses
    /// that they reach; the result is that of [`PriorMap::update_all`], bit by bit. It is a full update when one
    /// of the windows or the level changed.
    pub fn update_dirty(
        &mut self,
        surface: &GridMap<SurfaceCell>,
        changed: &CellRegion,
    ) -> Result<(), PriorMapError> {
        if self.filled_from != Some(*surface.geometry()) {
            return self.update_all(surface);
        }
        if changed.n_cells() == 0 {
            return Ok(());
        }
        let origin = surface.geometry().origin;
        let bounds = |axis: usize, range: &Range<usize>| {
            [origin[axis] + range.start as i64, origin[axis] + range.end as i64 - 1]
        };
        let ([west, east], [south, north]) = (bounds(0, &changed.cols), bounds(1, &changed.rows));
        self.poses.ground.read(surface, [west, south], [east, north]);
        let geometry = *self.map.geometry();
        let rows = self.readers(1, geometry.n_rows, south, north);
        let cols = self.readers(0, geometry.n_cols, west, east);
        self.fill(surface, rows, cols);
        Ok(())
    }

    /// What the prior believes of any pose of the body frame, whose footprint must lie over the ground of the
    /// risk map; `None` elsewhere, and for the nominal assumption, which has no distribution. Obstacles play no
    /// part.
    pub fn belief(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Option<PriorBelief> {
        let (distribution, evidence) = self.poses.distribution(x_m, y_m, yaw_rad)?;
        Some(PriorBelief::new(&distribution, evidence))
    }

    fn check_resolution(&self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        let expected_m = self.poses.ground.window().resolution_m;
        let found_m = surface.geometry().resolution_m;
        if (found_m - expected_m).abs() > 1e-9 * expected_m {
            return Err(PriorMapError::SurfaceResolution { expected_m, found_m });
        }
        Ok(())
    }

    /// Rows or columns of the risk map whose poses read surface cells from `min` to `max`.
    fn readers(&self, axis: usize, n: usize, min: i64, max: i64) -> Range<usize> {
        let origin = self.map.geometry().origin[axis];
        let reads = |index: &usize| self.poses.reads(axis, origin + *index as i64, min, max);
        let start = (0..n).find(reads).unwrap_or(n);
        start..(start..n).rev().find(reads).map_or(start, |last| last + 1)
    }

    fn fill(&mut self, surface: &GridMap<SurfaceCell>, rows: Range<usize>, cols: Range<usize>) {
        let poses = &self.poses;
        let geometry = *self.map.geometry();
        let n_yaws = self.map.view().n_yaws;
        let (risks, ground) = self.map.arrays_mut();
        let cells = rows.start * geometry.n_cols..rows.end * geometry.n_cols;
        let risk_rows =
            risks[cells.start * n_yaws..cells.end * n_yaws].par_chunks_mut(geometry.n_cols * n_yaws);
        let lines = risk_rows.zip(ground[cells].par_chunks_mut(geometry.n_cols));
        lines.enumerate().for_each(|(line, (risks, ground))| {
            let lattice_row = geometry.origin[1] + (rows.start + line) as i64;
            for col in cols.clone() {
                let cell = [geometry.origin[0] + col as i64, lattice_row];
                poses.risks(cell, &mut risks[col * n_yaws..(col + 1) * n_yaws]);
                ground[col] = poses.ground_in(cell, surface);
            }
        });
        self.map.close_border();
    }
}

fn judged(geometry: &Geometry, assumption: &Assumption) -> Result<(Lengths, Judgement), PriorConfigError> {
    match assumption {
        Assumption::Physics { prior, level } => {
            prior.validate()?;
            let lengths = Lengths::new(geometry, prior);
            let equations = Equations::new(prior, &lengths);
            let tails = Tails::new(&equations, *level);
            let physics = Physics { equations, tails, evidence: prior.evidence as f32 };
            Ok((lengths, Judgement::Physics(Box::new(physics))))
        }
        Assumption::Nominal { obstacle_margin_m } => {
            let prior = PriorConfig { obstacle_margin_m: *obstacle_margin_m, ..PriorConfig::default() };
            prior.validate()?;
            Ok((Lengths::new(geometry, &prior), Judgement::Nominal))
        }
    }
}
