//! The prior over every pose of a window, kept up to date with the surface. Whoever makes a risk map asks it.

use std::ops::Range;

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use terrain::{CellRegion, GridGeometry, GridMap, SettingError, SurfaceCell};
use traversability::{CvarLevel, Ground, Risk};

use crate::block_prior::{BlockPrior, PoseLine};
use crate::lattice::ResolutionRatio;
use crate::lengths::Lengths;
use crate::outcomes::Equations;
use crate::poses::{BlockCvar, Judgement, Physics, Poses};
use crate::tails::Tails;
use crate::{Assumption, PriorBelief, PriorConfig, PriorMapError};

/// Cells across a footprint beyond which nothing is judged in time.
const FOOTPRINT_CELLS_MAX: f64 = 500.0;

/// The poses of a risk map over the ground that they stand on: the rear axle's centre in the centre of a cell of
/// the window, the yaw in the centre of its bin. Cells are given by lattice indices: columns, rows.
#[derive(Clone, Debug)]
pub struct PriorField {
    poses: Poses,
    window: GridGeometry,
    /// The surface's window that was read; `None` while all of it must be read anew.
    read_from: Option<GridGeometry>,
}

impl PriorField {
    /// A field over the window `risk` for surfaces of the given resolution, all unknown until one is read.
    ///
    /// `geometry` comes from a vehicle that passed [`bicycle::Vehicle::validate`]. Every instruction set gives the same bits.
    ///
    /// # Errors
    /// A parameter of the prior makes no sense, the cells of the two grids never line up, or there is no yaw.
    pub fn new(
        geometry: &Geometry,
        assumption: &Assumption,
        surface_resolution_m: f64,
        risk: GridGeometry,
        n_yaws: usize,
        instructions: Instructions,
    ) -> Result<Self, PriorMapError> {
        if n_yaws == 0 {
            return Err(PriorMapError::NoYaws);
        }
        let ratio = ResolutionRatio::new(risk.resolution_m, surface_resolution_m).ok_or(
            PriorMapError::Resolution { surface_m: surface_resolution_m, risk_m: risk.resolution_m },
        )?;
        let (lengths, judgement) = judged(geometry, assumption)?;
        let found = 2.0 * lengths.reach_m() / surface_resolution_m;
        if found.is_nan() || found > FOOTPRINT_CELLS_MAX {
            let (most, surface_m) = (FOOTPRINT_CELLS_MAX, surface_resolution_m);
            return Err(PriorMapError::Footprint { most, surface_m, found });
        }
        let poses =
            Poses::new(judgement, lengths, (ratio, surface_resolution_m), &risk, n_yaws, instructions);
        Ok(Self { poses, window: risk, read_from: None })
    }

    /// Where the poses lie.
    pub fn window(&self) -> &GridGeometry {
        &self.window
    }

    /// How the cells of the window lie on those of the surface.
    pub fn ratio(&self) -> ResolutionRatio {
        self.poses.ratio()
    }

    /// Moves the window to another origin on its lattice; returns whether that is another place. All of the
    /// surface is read anew then.
    pub fn place_at(&mut self, origin: [i64; 2]) -> bool {
        let moves = origin != self.window.origin;
        if moves {
            self.window.origin = origin;
            self.poses.move_to(&self.window);
            self.read_from = None;
        }
        moves
    }

    /// Judges at another level; everything is judged anew. The nominal assumption has none.
    pub fn set_level(&mut self, level: CvarLevel) {
        if let Judgement::Physics(physics) = &mut self.poses.judgement {
            physics.level = level;
            self.read_from = None;
        }
    }

    /// Whether the next reading is of the whole surface, whatever part of it changed.
    pub fn is_outdated(&self, surface: &GridMap<SurfaceCell>) -> bool {
        self.read_from != Some(*surface.geometry())
    }

    /// Takes over the whole surface; what lies beyond its window is unknown. Returns the cells to judge: all.
    ///
    /// # Errors
    /// The surface has another resolution than the field was made for.
    pub fn read_all(&mut self, surface: &GridMap<SurfaceCell>) -> Result<CellRegion, PriorMapError> {
        self.check_resolution(surface)?;
        let window = *self.poses.ground.window();
        let last = [window.origin[0] + window.n_cols as i64 - 1, window.origin[1] + window.n_rows as i64 - 1];
        self.poses.ground.read(surface, window.origin, last);
        self.read_from = Some(*surface.geometry());
        Ok(CellRegion::whole(&self.window))
    }

    /// Takes over the cells of the surface that changed since it was last read. Returns the cells of the window
    /// whose poses they reach: all when one of the windows or the level changed.
    ///
    /// # Errors
    /// The surface has another resolution than the field was made for.
    pub fn read_changed(
        &mut self,
        surface: &GridMap<SurfaceCell>,
        changed: &CellRegion,
    ) -> Result<CellRegion, PriorMapError> {
        if self.is_outdated(surface) {
            return self.read_all(surface);
        }
        if changed.n_cells() == 0 {
            return Ok(CellRegion { rows: 0..0, cols: 0..0 });
        }
        let origin = surface.geometry().origin;
        let bounds = |axis: usize, range: &Range<usize>| {
            [origin[axis] + range.start as i64, origin[axis] + range.end as i64 - 1]
        };
        let ([west, east], [south, north]) = (bounds(0, &changed.cols), bounds(1, &changed.rows));
        self.poses.ground.read(surface, [west, south], [east, north]);
        Ok(CellRegion {
            rows: self.readers(1, self.window.n_rows, south, north),
            cols: self.readers(0, self.window.n_cols, west, east),
        })
    }

    /// What the prior says of the poses of a line, from a lane of the block on. Whole spans of
    /// [`bicycle::lanes::SPAN`] lanes are written, so lines must come in the order of their lanes. Under the nominal
    /// assumption, which has no distributions, obstacles alone are counted.
    pub fn read_line(&self, line: &PoseLine, first_lane: usize, block: &mut BlockPrior) {
        self.poses.read(line, first_lane, block);
    }

    /// Risks of the first `n` poses of a block.
    pub fn risks(&self, block: &BlockPrior, n: usize) -> impl Iterator<Item = Risk> {
        let free = match &self.poses.judgement {
            Judgement::Physics(physics) => {
                let cvar = BlockCvar { moments: &block.moments, level: physics.level };
                Some(self.poses.instructions().run_on_lanes(cvar))
            }
            Judgement::Nominal => None,
        };
        (0..n).map(move |lane| {
            let free = free.as_ref().map_or(Risk::NONE, |[linear, angular, roll, pitch]| Risk {
                linear_traction: linear.0[lane],
                angular_traction: angular.0[lane],
                roll_rad: roll.0[lane],
                pitch_rad: pitch.0[lane],
            });
            block.obstructed(lane, free)
        })
    }

    /// The ground in a cell.
    pub fn ground_in(&self, cell: [i64; 2], surface: &GridMap<SurfaceCell>) -> Ground {
        self.poses.ground_in(cell, surface)
    }

    /// What the prior believes of any pose of the body frame, see [`crate::PriorMap::belief`].
    pub fn belief(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Option<PriorBelief> {
        self.poses.belief(x_m, y_m, yaw_rad)
    }

    /// Bytes of the ground that it keeps.
    pub fn n_bytes(&self) -> usize {
        self.poses.ground.n_bytes()
    }

    fn check_resolution(&self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        let expected_m = self.poses.ground.window().resolution_m;
        let found_m = surface.geometry().resolution_m;
        if (found_m - expected_m).abs() > 1e-9 * expected_m {
            return Err(PriorMapError::SurfaceResolution { expected_m, found_m });
        }
        Ok(())
    }

    /// Rows or columns of the window whose poses read surface cells from `min` to `max`.
    fn readers(&self, axis: usize, n: usize, min: i64, max: i64) -> Range<usize> {
        let origin = self.window.origin[axis];
        let reads = |index: &usize| self.poses.reads(axis, origin + *index as i64, min, max);
        let start = (0..n).find(reads).unwrap_or(n);
        start..(start..n).rev().find(reads).map_or(start, |last| last + 1)
    }
}

fn judged(geometry: &Geometry, assumption: &Assumption) -> Result<(Lengths, Judgement), SettingError> {
    match assumption {
        Assumption::Physics { prior, level } => {
            prior.validate()?;
            let lengths = Lengths::new(geometry, prior);
            let equations = Equations::new(prior, &lengths);
            let tails = Tails::new(&equations);
            let physics = Physics { equations, tails, level: *level, evidence: prior.evidence as f32 };
            Ok((lengths, Judgement::Physics(Box::new(physics))))
        }
        Assumption::Nominal { obstacle_margin_m } => {
            let prior = PriorConfig { obstacle_margin_m: *obstacle_margin_m, ..PriorConfig::default() };
            prior.validate()?;
            Ok((Lengths::new(geometry, &prior), Judgement::Nominal))
        }
    }
}
