//! From the known surface to a risk map, whole or where something changed.

use bicycle::Geometry;
use bicycle::lanes::{BLOCK, Instructions};
use rayon::prelude::*;
use terrain::{GridGeometry, GridMap, SettingError, SurfaceCell};
use traversability::{CvarLevel, Ground, Risk, RiskMap};

use crate::{BlockPrior, PoseLine, PriorBelief, PriorConfig, PriorField, stretches};

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
    Config(#[from] SettingError),
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
    /// A vehicle that covers more cells than are judged in any time, or cells that are none for it.
    #[error("footprint: expected at most {most} cells of {surface_m} m across, found {found:.0}")]
    Footprint {
        /// What would do.
        most: f64,
        /// Resolution of the surface [m].
        surface_m: f64,
        /// What it is.
        found: f64,
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
    field: PriorField,
    map: RiskMap,
}

impl PriorMap {
    /// A map in the window `risk` for surfaces of the given resolution; [`Risk::OUTSIDE`] until it is updated.
    ///
    /// `geometry` comes from a vehicle that passed [`bicycle::Vehicle::validate`]. Every instruction set gives the same bits.
    pub fn new(
        geometry: &Geometry,
        assumption: &Assumption,
        surface_resolution_m: f64,
        risk: GridGeometry,
        n_yaws: usize,
        instructions: Instructions,
    ) -> Result<Self, PriorMapError> {
        Ok(Self {
            field: PriorField::new(geometry, assumption, surface_resolution_m, risk, n_yaws, instructions)?,
            map: RiskMap::constant(risk, n_yaws, Risk::OUTSIDE),
        })
    }

    /// The map as of the last update.
    pub fn risk_map(&self) -> &RiskMap {
        &self.map
    }

    /// What is told of the ground [row, col], to be changed in place; the next update may forget it.
    pub fn ground_mut(&mut self) -> &mut [Ground] {
        self.map.ground_mut()
    }

    /// Moves the window to another origin on the lattice of risk cells; the next update makes the map whole again.
    pub fn place_at(&mut self, origin: [i64; 2]) {
        if self.field.place_at(origin) {
            self.map.roll_to(origin);
        }
    }

    /// Judges at another level from the next update on. The nominal assumption has none.
    pub fn set_level(&mut self, level: CvarLevel) {
        self.field.set_level(level);
    }

    /// Takes over the whole surface and judges every pose. What lies beyond its window is unknown.
    pub fn update_all(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        self.field.read_all(surface)?;
        self.fill(surface);
        Ok(())
    }

    /// Takes over a surface and judges anew only the poses that read something which changed since the last update; the
    /// result is that of [`PriorMap::update_all`], bit by bit.
    pub fn update(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        self.field.read(surface)?;
        self.fill(surface);
        Ok(())
    }

    /// What the prior believes of any pose of the body frame, whose footprint must lie over the ground of the
    /// risk map; `None` elsewhere, and for the nominal assumption, which has no distribution. Obstacles play no
    /// part.
    pub fn belief(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Option<PriorBelief> {
        self.field.belief(x_m, y_m, yaw_rad)
    }

    fn fill(&mut self, surface: &GridMap<SurfaceCell>) {
        let field = &self.field;
        let geometry = *self.map.geometry();
        let n_yaws = self.map.view().n_yaws;
        self.map.fill(|risks, ground| {
            let rows = risks.par_chunks_mut(geometry.n_cols * n_yaws);
            let rows = rows.zip(ground.par_chunks_mut(geometry.n_cols));
            rows.enumerate().for_each_init(BlockPrior::default, |block, (row, (risks, ground))| {
                let west = [geometry.origin[0], geometry.origin[1] + row as i64];
                for yaw in 0..n_yaws {
                    judge_row(field, west, geometry.n_cols, (yaw, n_yaws), block, risks);
                }
                for (col, ground) in ground.iter_mut().enumerate() {
                    *ground = field.ground_in([west[0] + col as i64, west[1]], surface);
                }
            });
        });
        self.field.note_judged();
    }
}

/// Judges the poses of one yaw that changed in a row that begins in the lattice cell `west`.
fn judge_row(
    field: &PriorField,
    west: [i64; 2],
    n_cols: usize,
    (yaw, n_yaws): (usize, usize),
    block: &mut BlockPrior,
    risks: &mut [Risk],
) {
    let n_phases = field.ratio().n_phases();
    for first_col in 0..n_phases.min(n_cols) {
        for col in (first_col..n_cols).step_by(n_phases * BLOCK) {
            let line = |lanes: std::ops::Range<usize>| {
                let cell = [west[0] + (col + lanes.start * n_phases) as i64, west[1]];
                PoseLine { cell, yaw, n_lanes: lanes.len() }
            };
            let n_lanes = (n_cols - col).div_ceil(n_phases).min(BLOCK);
            for lanes in stretches(field.changed(&line(0..n_lanes))) {
                field.read_line(&line(lanes.clone()), 0, block);
                for (lane, risk) in lanes.clone().zip(field.risks(block, lanes.len())) {
                    risks[(col + lane * n_phases) * n_yaws + yaw] = risk;
                }
            }
        }
    }
}
