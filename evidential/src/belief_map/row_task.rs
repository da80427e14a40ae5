//! The footprints of a few rows of cells, from the layers of the ground to their risks.

use std::ops::Range;

use bicycle::lanes::{BLOCK, Block};
use physics_prior::{ASKED, BlockPrior, PoseLine, stretches};
use terrain::{GridMap, SurfaceCell};
use traversability::{Ground, GroundFlags, Risk};

use super::extraction::{Extract, Grounding, Line};
use super::posterior::{Mixture, learned_share};
use super::{BeliefLayers, Fusion};
use crate::Prior;
use crate::predictor::{BlockPrediction, Workspace};

/// Whole rows of cells, and where what is judged of them goes.
pub(super) struct RowTask<'a> {
    /// Lattice rows, from south to north.
    pub rows: Range<i64>,
    /// Lattice columns.
    pub cols: Range<i64>,
    /// Shape [row, col, yaw].
    pub risks: &'a mut [Risk],
    /// Whether a pose is unlike the training data, shape [row, col, yaw].
    pub is_unfamiliar: &'a mut [bool],
    /// Shape [row, col].
    pub ground: &'a mut [Ground],
}

/// Buffers of one thread, kept from update to update.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    block: BlockScratch,
    /// Poses of the block, whole lines and parts of lines.
    parts: Vec<Part>,
}

/// What is known of the poses of a block.
#[derive(Clone, Debug)]
struct BlockScratch {
    workspace: Workspace,
    prior: BlockPrior,
    grounding: Grounding,
    risks: [Risk; BLOCK],
    is_unfamiliar: [bool; BLOCK],
}

/// Neighbouring poses in a block.
#[derive(Clone, Copy, Debug)]
struct Part {
    line: PoseLine,
    first_lane: usize,
}

impl Scratch {
    pub fn new(workspace: Workspace) -> Self {
        let block = BlockScratch {
            workspace,
            prior: BlockPrior::default(),
            grounding: Grounding::default(),
            risks: [Risk::NONE; BLOCK],
            is_unfamiliar: [false; BLOCK],
        };
        Self { block, parts: Vec::new() }
    }

    /// Bytes of the buffers.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&self.block) + self.block.workspace.n_bytes() + size_of_val(&*self.parts)
    }
}

impl RowTask<'_> {
    /// Judges every footprint that changed; returns how many.
    pub fn run(
        mut self,
        layers: &BeliefLayers,
        surface: &GridMap<SurfaceCell>,
        scratch: &mut Scratch,
    ) -> usize {
        let n_phases = layers.field.ratio().n_phases();
        let mut n_judged = 0;
        for row in self.rows.clone() {
            for first_col in self.cols.clone().take(n_phases) {
                for yaw in 0..layers.n_yaws {
                    n_judged += self.judge_line([first_col, row], yaw, layers, scratch);
                }
            }
        }
        self.judge_block(layers, scratch);
        for (row, col) in self.rows.clone().flat_map(|row| self.cols.clone().map(move |col| (row, col))) {
            let index = self.index([col, row]);
            let mut ground = layers.field.ground_in([col, row], surface);
            let yaws = &self.is_unfamiliar[index * layers.n_yaws..][..layers.n_yaws];
            if 2 * yaws.iter().map(|&is_unfamiliar| usize::from(is_unfamiliar)).sum::<usize>() > layers.n_yaws
            {
                ground.flags = ground.flags.with(GroundFlags::OUT_OF_DISTRIBUTION);
            }
            self.ground[index] = ground;
        }
        n_judged
    }

    /// Position of a cell in the slices.
    fn index(&self, [col, row]: [i64; 2]) -> usize {
        let n_cols = (self.cols.end - self.cols.start) as usize;
        (row - self.rows.start) as usize * n_cols + (col - self.cols.start) as usize
    }

    /// Puts the poses of a row that changed into blocks, from a cell on every so many as there are phases, and judges
    /// blocks that are full. Returns how many poses that are.
    fn judge_line(
        &mut self,
        [first_col, row]: [i64; 2],
        yaw: usize,
        layers: &BeliefLayers,
        scratch: &mut Scratch,
    ) -> usize {
        let n_phases = layers.field.ratio().n_phases() as i64;
        let n_in_row = (self.cols.end - first_col + n_phases - 1) / n_phases;
        let mut n_judged = 0;
        for start in (0..n_in_row).step_by(ASKED) {
            let line = |lanes: Range<usize>| {
                let col = first_col + (start + lanes.start as i64) * n_phases;
                PoseLine { cell: [col, row], yaw, n_lanes: lanes.len() }
            };
            let n_lanes = (n_in_row - start).min(ASKED as i64) as usize;
            for mut lanes in stretches(layers.changed(&line(0..n_lanes))) {
                n_judged += lanes.len();
                while !lanes.is_empty() {
                    let end = lanes.end.min(lanes.start + BLOCK - scratch.n_lanes());
                    scratch.push(line(lanes.start..end));
                    lanes.start = end;
                    if scratch.n_lanes() == BLOCK {
                        self.judge_block(layers, scratch);
                    }
                }
            }
        }
        n_judged
    }

    /// Judges the poses of the block and empties it.
    fn judge_block(&mut self, layers: &BeliefLayers, scratch: &mut Scratch) {
        layers.judge(&scratch.parts, &mut scratch.block);
        let n_phases = layers.field.ratio().n_phases();
        for Part { line, first_lane } in scratch.parts.drain(..) {
            let first = self.index(line.cell);
            for step in 0..line.n_lanes {
                let pose = (first + step * n_phases) * layers.n_yaws + line.yaw;
                self.risks[pose] = scratch.block.risks[first_lane + step];
                self.is_unfamiliar[pose] = scratch.block.is_unfamiliar[first_lane + step];
            }
        }
    }
}

impl Scratch {
    /// Poses that are in the block so far.
    fn n_lanes(&self) -> usize {
        self.parts.last().map_or(0, |part| part.first_lane + part.line.n_lanes)
    }

    fn push(&mut self, line: PoseLine) {
        self.parts.push(Part { line, first_lane: self.n_lanes() });
    }
}

impl BeliefLayers {
    /// Prior, networks, posterior and CVaR of a block of footprints.
    fn judge(&self, parts: &[Part], block: &mut BlockScratch) {
        let Some(last) = parts.last() else { return };
        let n_lanes = last.first_lane + last.line.n_lanes;
        for part in parts {
            self.field.read_line(&part.line, part.first_lane, &mut block.prior);
        }
        // What is all unknown has nothing that networks could judge; they have no share in it below.
        let unknown = &block.prior.unknown.lanes()[..n_lanes];
        if unknown.contains(&0.0) {
            for part in parts {
                self.extract(part, block);
            }
            self.predictor.apply(&mut block.workspace);
        }
        self.instructions.run(Fuse { fusion: &self.fusion, n_lanes, block });
    }

    fn extract(&self, part: &Part, block: &mut BlockScratch) {
        let PoseLine { cell, yaw, n_lanes } = part.line;
        let base = cell.map(|index| self.field.ratio().base(index));
        self.instructions.run_on_lanes(Extract {
            ground: &self.ground,
            line: Line { stencil: self.stencil(cell, yaw), reach: self.reach, base, n_lanes },
            first_lane: part.first_lane,
            features: &mut block.workspace.input,
            grounding: &mut block.grounding,
        });
    }
}

/// Posterior and CVaR of one block.
struct Fuse<'a> {
    fusion: &'a Fusion,
    n_lanes: usize,
    block: &'a mut BlockScratch,
}

impl pulp::WithSimd for Fuse<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let BlockScratch { workspace, prior, grounding, .. } = &mut *self.block;
        // What nothing is known of has no features either.
        let unknown =
            merged(&prior.unknown, &grounding.ungrounded, |unknown, ungrounded| unknown + ungrounded);
        let missing = merged(&unknown, &grounding.partly_unknown, |unknown, partly| unknown + partly);
        if self.fusion.prior != Prior::Physics {
            // Physics alone knows of unknown ground.
            weigh_uniformly(self.fusion, &missing, prior);
        }
        let per_level = self.fusion.per_level;
        let mut cvars = [Block::ZERO; 4];
        for (parameter, cvar) in cvars.iter_mut().enumerate() {
            let prediction = &workspace.prediction;
            let mixture = Mixture {
                moments: &prior.moments[parameter],
                probabilities: &prediction.probabilities[parameter],
                share: &self.fusion.share(simd, &prediction.evidence[parameter], &unknown),
            };
            *cvar = match parameter {
                0 | 1 => mixture.traction_cvar(simd, per_level),
                _ => mixture.angle_cvar_rad(simd, per_level),
            };
        }
        self.keep(&cvars, &missing);
    }
}

#[inline(always)]
fn merged(a: &Block, b: &Block, of: impl Fn(f32, f32) -> f32) -> Block {
    let mut merged = Block::ZERO;
    for lane in 0..BLOCK {
        merged.0[lane] = of(a.0[lane], b.0[lane]);
    }
    merged
}

/// Puts the uniform distribution in the place of the prior where the ground is wholly known.
#[inline(always)]
fn weigh_uniformly(fusion: &Fusion, missing: &Block, prior: &mut BlockPrior) {
    let uniform = fusion.uniform.moments.as_flattened();
    for (block, uniform) in prior.moments.as_flattened_mut().iter_mut().zip(uniform) {
        for lane in 0..BLOCK {
            block.0[lane] = if missing.0[lane] > 0.0 { block.0[lane] } else { *uniform };
        }
    }
}

impl Fusion {
    /// How much of the networks' distribution counts.
    #[inline(always)]
    fn share<S: pulp::Simd>(&self, simd: S, evidence: &Block, unknown: &Block) -> Block {
        let share = match self.prior {
            Prior::None => Block::filled(1.0),
            Prior::Physics | Prior::Uniform => learned_share(simd, evidence, self.prior_evidence),
        };
        merged(&share, unknown, |share, unknown| if unknown > 0.0 { 0.0 } else { share })
    }
}

impl Fuse<'_> {
    #[inline(always)]
    fn keep(self, cvars: &[Block; 4], missing: &Block) {
        let BlockScratch { workspace, prior, risks, is_unfamiliar, .. } = self.block;
        let BlockPrediction { log_density, .. } = &workspace.prediction;
        for lane in 0..self.n_lanes {
            let is_out = log_density.0[lane] < self.fusion.log_density_min && missing.0[lane] == 0.0;
            is_unfamiliar[lane] = is_out;
            let free = Risk {
                linear_traction: cvars[0].0[lane],
                angular_traction: cvars[1].0[lane],
                roll_rad: cvars[2].0[lane],
                pitch_rad: cvars[3].0[lane],
            };
            let free = if is_out { self.fusion.unfamiliar(free) } else { free };
            risks[lane] = prior.obstructed(lane, free);
        }
    }
}
