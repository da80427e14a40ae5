//! The prior over every pose of a window, kept up to date with the surface. Whoever makes a risk map asks it.

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use terrain::{GridGeometry, GridMap, SettingError, SurfaceCell};
use traversability::{CvarLevel, Ground, Risk};

use crate::block_prior::{BlockPrior, PoseLine};
use crate::cell_set::ASKED;
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
    /// What was read last; `None` while all of it must be read anew.
    surface: Option<GridMap<SurfaceCell>>,
    /// The poses that were judged by what was read before.
    judged: Rectangle,
    /// Whether those that the last reading changed were judged too.
    is_judged: bool,
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
        Ok(Self { poses, window: risk, surface: None, judged: Rectangle::NOTHING, is_judged: true })
    }

    /// Where the poses lie.
    pub fn window(&self) -> &GridGeometry {
        &self.window
    }

    /// How the cells of the window lie on those of the surface.
    pub fn ratio(&self) -> ResolutionRatio {
        self.poses.ratio()
    }

    /// Moves the window to another origin on its lattice; returns whether that is another place. What was judged stays
    /// judged but for the border, whose risks are closed.
    pub fn place_at(&mut self, origin: [i64; 2]) -> bool {
        let moves = origin != self.window.origin;
        if moves {
            self.judged = self.judged.within(&Rectangle::inside(&self.window));
            self.window.origin = origin;
            self.poses.move_to(&self.window);
            self.surface = None;
        }
        moves
    }

    /// Judges at another level; everything is judged anew. The nominal assumption has none.
    pub fn set_level(&mut self, level: CvarLevel) {
        if let Judgement::Physics(physics) = &mut self.poses.judgement {
            physics.level = level;
            self.judged = Rectangle::NOTHING;
        }
    }

    /// Reads the whole surface, and has every pose judged anew.
    ///
    /// # Errors
    /// The surface has another resolution than the field was made for.
    pub fn read_all(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        (self.surface, self.judged) = (None, Rectangle::NOTHING);
        self.read(surface)
    }

    /// Reads a surface; what lies beyond its window is unknown. Which poses it changes, [`PriorField::changed`] says.
    ///
    /// # Errors
    /// The surface has another resolution than the field was made for.
    pub fn read(&mut self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        self.check_resolution(surface)?;
        if !std::mem::replace(&mut self.is_judged, false) {
            self.judged = Rectangle::NOTHING;
        }
        let window = Rectangle::whole(self.poses.ground.window());
        let changed = self.surface.as_ref().map_or(Some(window), |last| window.changed(last, surface));
        match changed {
            Some(Rectangle { min, max }) => self.poses.read_ground(surface, min, max),
            None => self.poses.keep_ground(),
        }
        match &mut self.surface {
            Some(last) => last.clone_from(surface),
            last => *last = Some(surface.clone()),
        }
        Ok(())
    }

    /// Of the first [`crate::ASKED`] poses of a line, the first one in the lowest bit: those that were not judged yet,
    /// and those that read something which is not what it was before the last reading.
    pub fn changed(&self, line: &PoseLine) -> u64 {
        let n_lanes = line.n_lanes.min(ASKED);
        let outside = !self.judged.holds(line.cell, self.ratio().n_phases() as i64);
        (outside | self.poses.changed(line)) & lowest(n_lanes)
    }

    /// Every pose that [`PriorField::changed`] names was judged.
    pub fn note_judged(&mut self) {
        (self.judged, self.is_judged) = (Rectangle::whole(&self.window), true);
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
        let surface = self.surface.as_ref().map_or(0, |surface| size_of_val(surface.values()));
        self.poses.n_bytes() + surface
    }

    fn check_resolution(&self, surface: &GridMap<SurfaceCell>) -> Result<(), PriorMapError> {
        let expected_m = self.poses.ground.window().resolution_m;
        let found_m = surface.geometry().resolution_m;
        if (found_m - expected_m).abs() > 1e-9 * expected_m {
            return Err(PriorMapError::SurfaceResolution { expected_m, found_m });
        }
        Ok(())
    }
}

/// Cells of the lattice from `min` to `max`, columns and rows, both inclusive; nothing where one of them is larger.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rectangle {
    min: [i64; 2],
    max: [i64; 2],
}

impl Rectangle {
    const NOTHING: Self = Self { min: [i64::MAX; 2], max: [i64::MIN; 2] };

    fn whole(window: &GridGeometry) -> Self {
        let GridGeometry { origin: [west, south], n_rows, n_cols, .. } = *window;
        Self { min: window.origin, max: [west + n_cols as i64 - 1, south + n_rows as i64 - 1] }
    }

    /// All but the border.
    fn inside(window: &GridGeometry) -> Self {
        let Self { min, max } = Self::whole(window);
        Self { min: min.map(|index| index + 1), max: max.map(|index| index - 1) }
    }

    fn within(&self, other: &Self) -> Self {
        Self {
            min: [0, 1].map(|axis| self.min[axis].max(other.min[axis])),
            max: [0, 1].map(|axis| self.max[axis].min(other.max[axis])),
        }
    }

    /// Of cells of a row that lie so many columns apart, those within, the first one in the lowest bit.
    fn holds(&self, [col, row]: [i64; 2], apart: i64) -> u64 {
        if !(self.min[1]..=self.max[1]).contains(&row) || self.min[0] > self.max[0] {
            return 0;
        }
        let n_before = |edge: i64| (edge - col).div_euclid(apart).clamp(0, ASKED as i64) as usize;
        lowest(n_before(self.max[0] + apart)) & !lowest(n_before(self.min[0] + apart - 1))
    }

    /// The least rectangle of all its cells in which two surfaces differ.
    fn changed(&self, last: &GridMap<SurfaceCell>, next: &GridMap<SurfaceCell>) -> Option<Self> {
        let mut changed = Self::NOTHING;
        for row in self.min[1]..=self.max[1] {
            let differs = |col: &i64| {
                let [last, next] = [last, next].map(|surface| surface.at_lattice([*col, row]));
                let [last, next] = [last, next].map(|cell| cell.unwrap_or(&SurfaceCell::UNKNOWN));
                !last.is_identical(next)
            };
            let mut cols = self.min[0]..=self.max[0];
            let Some(west) = cols.find(differs) else { continue };
            let east = cols.rev().find(differs).unwrap_or(west);
            changed.min = [changed.min[0].min(west), changed.min[1].min(row)];
            changed.max = [changed.max[0].max(east), row];
        }
        (changed.min[1] <= changed.max[1]).then_some(changed)
    }
}

/// So many bits from the lowest on.
fn lowest(n: usize) -> u64 {
    if n < ASKED { (1 << n) - 1 } else { u64::MAX }
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
