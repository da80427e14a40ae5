//! Networks, prior and posterior over a whole surface, as a risk map.

mod extraction;
mod patch_ground;
mod patch_stencil;
mod pose_belief;
mod posterior;
mod row_task;

use std::sync::{Arc, Mutex, PoisonError};

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use physics_prior::{ASKED, Assumption, PoseLine, PriorConfig, PriorField, PriorMapError};
use rayon::prelude::*;
use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::{CvarLevel, Ground, PartialMoments, Risk, RiskMap};

use crate::predictor::{Predictor, PredictorError};
use crate::{Checkpoint, FeatureLayout, Prior, VehicleMismatch};
use patch_ground::PatchGround;
use patch_stencil::PatchStencil;
pub use pose_belief::PoseBelief;
use row_task::{RowTask, Scratch};

/// What becomes of ground that is unlike the training data: its density lies below that of every training footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfamiliar {
    /// It is driven on as the posterior says, in which the prior outweighs the networks.
    Fuse,
    /// The same, and every metre of it costs the time of [`AVOIDED_METRES`] metres: EVORA and PIETRA avoid it by a cost,
    /// so that a goal behind it can still be reached.
    Avoid,
}

/// Familiar metres for which unfamiliar ground that is to be avoided is worth one detour of. The map carries this as a
/// linear traction that is smaller by as much: whoever plans by time to the goal goes around.
pub const AVOIDED_METRES: f32 = 3.0;
/// What a [`BeliefMap`] believes.
#[derive(Clone, Debug)]
pub struct Learned {
    /// Networks, and the prior and the features that they were trained with.
    pub checkpoint: Arc<Checkpoint>,
    /// What becomes of ground that is unlike the training data.
    pub unfamiliar: Unfamiliar,
    /// Widens the footprint that must not touch an obstacle, as in [`PriorConfig::obstacle_margin_m`] [m].
    pub obstacle_margin_m: f64,
    /// Share of the worst outcomes that counts.
    pub level: CvarLevel,
}

/// Why no belief map can be made.
#[derive(Debug, thiserror::Error)]
pub enum BeliefMapError {
    /// The networks cannot be used.
    #[error(transparent)]
    Predictor(#[from] PredictorError),
    /// The prior or the grids do not fit.
    #[error(transparent)]
    Prior(#[from] PriorMapError),
    /// The networks were trained on another vehicle.
    #[error("networks of method {method}: {mismatch}")]
    Vehicle {
        /// Name of the method.
        method: &'static str,
        /// What differs.
        mismatch: VehicleMismatch,
    },
    /// A method without a flow cannot tell what is unlike the training data.
    #[error("method {method}: expected one with a density to avoid unfamiliar ground by, found none")]
    NoDensity {
        /// Name of the method.
        method: &'static str,
    },
}

/// A risk map from what was learned, fused with a prior by evidence (PIETRA, equations 10 and 11).
///
/// Poses are those of [`RiskMap`]. The prior is that of the checkpoint's method: the physics prior, all bins alike, or
/// none. Whatever the method, unknown ground and obstacles are those of the physics prior: a footprint that touches an
/// obstacle is [`Risk::blocked`], one that is mostly unknown has nothing that networks could judge and is the physics
/// prior's alone, and where it is unknown in part the networks are weighed against that prior. A cell whose poses are
/// unlike the training data in most yaws has the flag [`traversability::GroundFlags::OUT_OF_DISTRIBUTION`]; a footprint
/// that is not wholly known never counts as such, or nobody who avoids the unfamiliar could approach the edge of what
/// was seen. Runs in the rayon pool of the caller; the result does not depend on the number of threads.
#[derive(Clone, Debug)]
pub struct BeliefMap {
    layers: BeliefLayers,
    map: RiskMap,
    /// Whether a pose is unlike the training data, shape [row, col, yaw].
    is_unfamiliar: Vec<bool>,
    scratches: Vec<Scratch>,
}

/// What the poses of a map are judged by.
#[derive(Clone, Debug)]
struct BeliefLayers {
    field: PriorField,
    ground: PatchGround,
    /// Shape [row phase, column phase, yaw].
    stencils: Vec<PatchStencil>,
    n_yaws: usize,
    /// Smallest and largest offset that a stencil reads, each columns, rows.
    reach: [[i64; 2]; 2],
    layout: FeatureLayout,
    predictor: Predictor,
    fusion: Fusion,
    instructions: Instructions,
}

/// How prediction and prior become a risk.
#[derive(Clone, Debug)]
struct Fusion {
    prior: Prior,
    prior_evidence: f32,
    unfamiliar: Unfamiliar,
    /// Log density below which ground is unlike the training data.
    log_density_min: f32,
    per_level: f32,
    uniform: PartialMoments,
}

impl Fusion {
    /// Risk of a footprint unlike the training data.
    fn unfamiliar(&self, risk: Risk) -> Risk {
        match self.unfamiliar {
            Unfamiliar::Fuse => risk,
            Unfamiliar::Avoid => {
                let traction = risk.linear_traction;
                // Being avoided makes nobody stuck who was not before.
                let left = (traction / AVOIDED_METRES).max(Risk::STUCK_TRACTION.min(traction));
                Risk { linear_traction: left, ..risk }
            }
        }
    }
}

/// Rows of cells that a thread takes at a time: so many that a last block, which may not be full, is cheap.
const TASK_ROWS: usize = 2;

impl BeliefMap {
    /// A map in the window `risk` for surfaces of the given resolution; [`Risk::OUTSIDE`] until it is updated.
    ///
    /// `geometry` comes from a vehicle that passed [`bicycle::Vehicle::validate`]. Instruction sets differ in the
    /// rounding of the networks' sums.
    ///
    /// # Errors
    /// The checkpoint is broken or of another vehicle, cannot do what is asked of it, or the grids do not line up.
    pub fn new(
        geometry: &Geometry,
        learned: &Learned,
        surface_resolution_m: f64,
        risk: GridGeometry,
        n_yaws: usize,
        instructions: Instructions,
    ) -> Result<Self, BeliefMapError> {
        let sidecar = &learned.checkpoint.sidecar;
        let method = sidecar.method.name();
        let fits = learned.checkpoint.check_vehicle(geometry);
        fits.map_err(|mismatch| BeliefMapError::Vehicle { method, mismatch })?;
        let predictor = Predictor::new(&learned.checkpoint, instructions)?;
        if learned.unfamiliar == Unfamiliar::Avoid && sidecar.density.is_none() {
            return Err(BeliefMapError::NoDensity { method });
        }
        let prior = PriorConfig { obstacle_margin_m: learned.obstacle_margin_m, ..sidecar.prior };
        let assumption = Assumption::Physics { prior, level: learned.level };
        let field = PriorField::new(geometry, &assumption, surface_resolution_m, risk, n_yaws, instructions)?;
        let fusion = Fusion {
            prior: sidecar.method.prior(),
            prior_evidence: prior.evidence as f32,
            unfamiliar: learned.unfamiliar,
            log_density_min: sidecar.density.map_or(f32::NEG_INFINITY, |density| density.min as f32),
            per_level: learned.level.reciprocal(),
            uniform: PartialMoments::uniform(),
        };
        let layers = BeliefLayers::new(
            field,
            predictor,
            fusion,
            (learned, surface_resolution_m, n_yaws),
            instructions,
        );
        Ok(Self {
            layers,
            map: RiskMap::constant(risk, n_yaws, Risk::OUTSIDE),
            is_unfamiliar: vec![false; risk.n_cells() * n_yaws],
            scratches: Vec::new(),
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
        if self.layers.field.place_at(origin) {
            self.map.geometry().roll(&mut self.is_unfamiliar, origin, false);
            self.map.roll_to(origin);
            self.layers.place_ground();
        }
    }

    /// Judges at another level from the next update on.
    pub fn set_level(&mut self, level: CvarLevel) {
        self.layers.field.set_level(level);
        self.layers.fusion.per_level = level.reciprocal();
    }

    /// Takes over the whole surface and judges every pose. What lies beyond the surface's window is unknown. Returns how
    /// many poses were judged.
    ///
    /// # Errors
    /// The surface has another resolution than the map was made for.
    pub fn update_all(&mut self, surface: &GridMap<SurfaceCell>) -> Result<usize, BeliefMapError> {
        self.layers.field.read_all(surface)?;
        self.layers.ground.read(surface);
        Ok(self.fill(surface))
    }

    /// Takes over a surface and judges anew only the poses that read something which changed since the last update; the
    /// result is that of [`BeliefMap::update_all`], bit by bit. Returns how many poses were judged, neighbours of those
    /// among them.
    ///
    /// # Errors
    /// The surface has another resolution than the map was made for.
    pub fn update(&mut self, surface: &GridMap<SurfaceCell>) -> Result<usize, BeliefMapError> {
        self.layers.field.read(surface)?;
        self.layers.ground.read(surface);
        Ok(self.fill(surface))
    }

    /// Bytes that the map takes while it is updated: ground, prior, networks, buffers and result.
    pub fn n_bytes(&self) -> usize {
        let view = self.map.view();
        let layers = &self.layers;
        size_of_val(view.risks)
            + size_of_val(view.ground)
            + layers.field.n_bytes()
            + layers.ground.n_bytes()
            + layers.predictor.n_bytes()
            + size_of_val(&*self.is_unfamiliar)
            + self.scratches.iter().map(Scratch::n_bytes).sum::<usize>()
    }

    /// Judges the poses that changed; returns how many.
    fn fill(&mut self, surface: &GridMap<SurfaceCell>) -> usize {
        let n_threads = rayon::current_num_threads();
        let (layers, workspace) = (&self.layers, self.layers.predictor.workspace());
        self.scratches.resize_with(n_threads, || Scratch::new(workspace.clone()));
        let (geometry, scratches) = (*self.map.geometry(), &mut self.scratches);
        let is_unfamiliar = &mut self.is_unfamiliar;
        let n_judged = self.map.fill(|risks, ground| {
            let tasks = tasks(&geometry, (risks, ground, is_unfamiliar), layers.n_yaws);
            let tasks = Mutex::new(tasks);
            let work = |scratch: &mut Scratch| {
                let next = || tasks.lock().unwrap_or_else(PoisonError::into_inner).next();
                std::iter::from_fn(next).map(|task| task.run(layers, surface, scratch)).sum::<usize>()
            };
            scratches.par_iter_mut().map(work).sum()
        });
        self.layers.field.note_judged();
        n_judged
    }
}

/// A map, a few rows at a time.
fn tasks<'a>(
    geometry: &GridGeometry,
    (risks, ground, is_unfamiliar): (&'a mut [Risk], &'a mut [Ground], &'a mut [bool]),
    n_yaws: usize,
) -> impl Iterator<Item = RowTask<'a>> {
    let GridGeometry { origin: [west, south], n_cols, .. } = *geometry;
    let n_cells = TASK_ROWS * n_cols;
    let poses = risks.chunks_mut(n_cells * n_yaws).zip(is_unfamiliar.chunks_mut(n_cells * n_yaws));
    let slices = poses.zip(ground.chunks_mut(n_cells)).enumerate();
    slices.map(move |(index, ((risks, is_unfamiliar), ground))| {
        let first = south + (index * TASK_ROWS) as i64;
        RowTask {
            rows: first..first + (ground.len() / n_cols) as i64,
            cols: west..west + n_cols as i64,
            risks,
            ground,
            is_unfamiliar,
        }
    })
}

impl BeliefLayers {
    fn new(
        field: PriorField,
        predictor: Predictor,
        fusion: Fusion,
        (learned, resolution_m, n_yaws): (&Learned, f64, usize),
        instructions: Instructions,
    ) -> Self {
        let layout = learned.checkpoint.sidecar.layout;
        let ratio = field.ratio();
        let mut stencils = Vec::new();
        for row in 0..ratio.n_phases() as i64 {
            for col in 0..ratio.n_phases() as i64 {
                for yaw in 0..n_yaws {
                    let yaw_rad = (yaw as f64 + 0.5) * std::f64::consts::TAU / n_yaws as f64;
                    let phase = [ratio.phase(col), ratio.phase(row)];
                    stencils.push(PatchStencil::new(&layout, resolution_m, phase, yaw_rad));
                }
            }
        }
        let mut reach = [[0; 2]; 2];
        for of_stencil in stencils.iter().map(PatchStencil::reach) {
            for axis in 0..2 {
                reach[0][axis] = reach[0][axis].min(of_stencil[0][axis]);
                reach[1][axis] = reach[1][axis].max(of_stencil[1][axis]);
            }
        }
        let window = GridGeometry { resolution_m, ..*field.window() };
        let felt = stencils.iter().flat_map(|stencil| &stencil.felt);
        let ground = PatchGround::unknown(window, ratio, layout.height_scale_m, felt);
        let mut layers =
            Self { field, ground, stencils, n_yaws, reach, layout, predictor, fusion, instructions };
        layers.place_ground();
        layers
    }

    /// Makes room for the ground under the present window; it must be read anew.
    fn place_ground(&mut self) {
        let (risk, ratio) = (*self.field.window(), self.field.ratio());
        let n = [risk.n_cols, risk.n_rows].map(|n| n as i64);
        let first = |axis: usize| ratio.base(risk.origin[axis]) + self.reach[0][axis];
        let last = |axis: usize| ratio.base(risk.origin[axis] + n[axis] - 1) + self.reach[1][axis];
        let count = |axis: usize| (last(axis) - first(axis) + 1) as usize;
        let resolution_m = self.ground.window().resolution_m;
        let window =
            GridGeometry { resolution_m, origin: [first(0), first(1)], n_rows: count(1), n_cols: count(0) };
        let felt = self.stencils.iter().flat_map(|stencil| &stencil.felt);
        self.ground = self.ground.moved_to(window, felt);
        for (index, stencil) in self.stencils.iter_mut().enumerate() {
            let col = ratio.like(index / self.n_yaws % ratio.n_phases(), risk.origin[0]);
            stencil.lay_on(self.ground.planes(), [ratio.base(col), ratio.base(risk.origin[1])]);
        }
    }

    fn stencil(&self, cell: [i64; 2], yaw: usize) -> &PatchStencil {
        let ratio = self.field.ratio();
        let [col_phase, row_phase] = cell.map(|index| ratio.phase_index(index));
        &self.stencils[(row_phase * ratio.n_phases() + col_phase) * self.n_yaws + yaw]
    }

    /// Of the poses of a line, one bit each: those that are to be judged.
    fn changed(&self, line: &PoseLine) -> u64 {
        let PoseLine { cell, yaw, n_lanes } = *line;
        let base = cell.map(|index| self.field.ratio().base(index));
        let by_networks = self.ground.changed(&self.stencil(cell, yaw).felt, base);
        self.field.changed(line) | (by_networks & (u64::MAX >> (ASKED - n_lanes)))
    }
}
