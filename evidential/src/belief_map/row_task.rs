//! The footprints of a few rows of cells, from the layers of the ground to their risks.

use std::ops::Range;

use physics_prior::PosePrior;
use terrain::{GridMap, SurfaceCell};
use traversability::{Ground, GroundFlags, N_BINS, PartialMoments, Risk};

use super::extraction::{Extract, Features, Line};
use super::posterior::{BlockMoments, Mixture, learned_share};
use super::{BeliefLayers, Fusion};
use crate::Prior;
use crate::predictor::{BlockPrediction, Lanes, N_LANES, Workspace};

/// Cells to judge, and where their results go.
pub(super) struct RowTask<'a> {
    /// Lattice rows, from south to north.
    pub rows: Range<i64>,
    /// Lattice columns.
    pub cols: Range<i64>,
    /// Lattice index of the first column in the slices.
    pub west: i64,
    /// Whole rows, shape [row, col, yaw].
    pub risks: &'a mut [Risk],
    /// Whole rows, shape [row, col].
    pub ground: &'a mut [Ground],
}

/// Buffers of one thread, kept from update to update.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    features: Features,
    workspace: Workspace,
    /// Of the prior that the networks are weighed against, shape [parameter, bin, lane].
    moments: Vec<f32>,
    n_lanes_max: usize,
    blocked: Vec<bool>,
    /// Judged as unknown ground.
    unknown: Vec<bool>,
    /// Known under every wheel and sample.
    known: Vec<bool>,
    out_of_distribution: Vec<bool>,
    risks: Vec<Risk>,
    priors: Vec<PosePrior>,
}

/// Footprints of one row and yaw whose cells leave the same remainder over the phases: one lane each.
struct CellLine {
    row: i64,
    yaw: usize,
    first_col: i64,
    n_lanes: usize,
    first_lane: usize,
}

impl Scratch {
    pub fn new(workspace: Workspace, n_yaws: usize) -> Self {
        let nothing = PosePrior { moments: PartialMoments::uniform(), is_blocked: false, is_unknown: true };
        Self {
            features: Features::default(),
            workspace,
            moments: Vec::new(),
            n_lanes_max: 0,
            blocked: Vec::new(),
            unknown: Vec::new(),
            known: Vec::new(),
            out_of_distribution: Vec::new(),
            risks: Vec::new(),
            priors: vec![nothing; n_yaws],
        }
    }

    /// Bytes of the buffers.
    pub fn n_bytes(&self) -> usize {
        let flags = 4 * self.blocked.len();
        self.features.n_bytes()
            + size_of_val(&*self.workspace.input)
            + size_of_val(&*self.moments)
            + flags
            + size_of_val(&*self.risks)
            + size_of_val(&*self.priors)
    }

    fn reserve(&mut self, n_features: usize, n_lanes: usize) {
        self.features.reserve(n_features, n_lanes);
        // As for the features, not a multiple of a page.
        self.n_lanes_max = n_lanes.next_multiple_of(N_LANES) + N_LANES / 2;
        self.moments.resize(4 * N_BINS * self.n_lanes_max, 0.0);
        let flags = [&mut self.blocked, &mut self.unknown, &mut self.known, &mut self.out_of_distribution];
        for flags in flags {
            flags.clear();
            flags.resize(self.n_lanes_max, false);
        }
        self.risks.resize(self.n_lanes_max, Risk::NONE);
    }
}

impl RowTask<'_> {
    /// Judges every footprint.
    pub fn run(mut self, layers: &BeliefLayers, surface: &GridMap<SurfaceCell>, scratch: &mut Scratch) {
        let lines = self.lines(layers);
        let n_lanes = lines.iter().map(|line| line.n_lanes).sum();
        scratch.reserve(layers.predictor.n_features(), n_lanes);
        layers.extract(&lines, scratch);
        for line in lines.iter().filter(|line| line.yaw == 0) {
            layers.ask_prior(line, scratch);
        }
        for first_lane in (0..n_lanes).step_by(N_LANES) {
            layers.judge(first_lane, scratch);
        }
        self.keep(layers, surface, &lines, scratch);
    }

    fn lines(&self, layers: &BeliefLayers) -> Vec<CellLine> {
        let n_phases = layers.field.ratio().n_phases() as i64;
        let (mut lines, mut first_lane) = (Vec::new(), 0);
        for row in self.rows.clone() {
            for first_col in self.cols.clone().take(n_phases as usize) {
                let n_lanes = ((self.cols.end - first_col + n_phases - 1) / n_phases) as usize;
                for yaw in 0..layers.n_yaws {
                    lines.push(CellLine { row, yaw, first_col, n_lanes, first_lane });
                    first_lane += n_lanes;
                }
            }
        }
        lines
    }

    fn keep(
        &mut self,
        layers: &BeliefLayers,
        surface: &GridMap<SurfaceCell>,
        lines: &[CellLine],
        scratch: &Scratch,
    ) {
        let n_cols = self.ground.len() / (self.rows.end - self.rows.start) as usize;
        let n_phases = layers.field.ratio().n_phases();
        for yaws in lines.chunks(layers.n_yaws) {
            let CellLine { row, first_col, n_lanes, first_lane, .. } = yaws[0];
            for step in 0..n_lanes {
                let col = first_col + (step * n_phases) as i64;
                let cell = (row - self.rows.start) as usize * n_cols + (col - self.west) as usize;
                let mut n_out_of_distribution = 0;
                for yaw in 0..layers.n_yaws {
                    let lane = first_lane + yaw * n_lanes + step;
                    self.risks[cell * layers.n_yaws + yaw] = scratch.risks[lane];
                    n_out_of_distribution += usize::from(scratch.out_of_distribution[lane]);
                }
                let mut ground = layers.field.ground_in([col, row], surface);
                if 2 * n_out_of_distribution > layers.n_yaws {
                    ground.flags = ground.flags.with(GroundFlags::OUT_OF_DISTRIBUTION);
                }
                self.ground[cell] = ground;
            }
        }
    }
}

impl BeliefLayers {
    fn extract(&self, lines: &[CellLine], scratch: &mut Scratch) {
        let ratio = self.field.ratio();
        for line in lines {
            let cell = [line.first_col, line.row];
            let stencil = self.stencil(cell, line.yaw);
            let base = cell.map(|index| ratio.base(index));
            self.instructions.run(Extract {
                ground: &self.ground,
                line: Line { stencil, base, n_lanes: line.n_lanes },
                first_lane: line.first_lane,
                features: &mut scratch.features,
            });
        }
    }

    /// Asks the prior about the cells of a line, for every yaw.
    fn ask_prior(&self, line: &CellLine, scratch: &mut Scratch) {
        let n_phases = self.field.ratio().n_phases();
        for step in 0..line.n_lanes {
            let cell = [line.first_col + (step * n_phases) as i64, line.row];
            self.field.pose_priors(cell, &mut scratch.priors);
            for (yaw, prior) in scratch.priors.iter().enumerate() {
                let lane = line.first_lane + yaw * line.n_lanes + step;
                // What nothing is known of has no features either.
                let is_unknown = prior.is_unknown || scratch.features.ungrounded[lane] > 0.0;
                let is_known = !is_unknown && scratch.features.partly_unknown[lane] == 0.0;
                scratch.blocked[lane] = prior.is_blocked;
                scratch.unknown[lane] = is_unknown;
                scratch.known[lane] = is_known;
                let weighed = self.fusion.weighed(&prior.moments, is_known);
                for (row, moment) in weighed.moments.as_flattened().iter().enumerate() {
                    scratch.moments[row * scratch.n_lanes_max + lane] = *moment;
                }
            }
        }
    }

    /// Networks, posterior and CVaR of a block of footprints.
    fn judge(&self, first_lane: usize, scratch: &mut Scratch) {
        for (feature, input) in scratch.workspace.input.iter_mut().enumerate() {
            if let Some(lanes) = scratch.features.lanes(feature, first_lane) {
                input.0 = *lanes;
            }
        }
        self.predictor.apply(&mut scratch.workspace);
        let stride = scratch.n_lanes_max;
        self.instructions.run(Fuse {
            fusion: &self.fusion,
            prediction: &scratch.workspace.prediction,
            moments: Moments { values: &scratch.moments, stride, first_lane },
            blocked: &scratch.blocked[first_lane..],
            unknown: &scratch.unknown[first_lane..],
            known: &scratch.known[first_lane..],
            out_of_distribution: &mut scratch.out_of_distribution[first_lane..],
            risks: &mut scratch.risks[first_lane..],
        });
    }
}

/// Partial moments of the prior, shape [parameter, bin, lane].
#[derive(Clone, Copy)]
struct Moments<'a> {
    values: &'a [f32],
    stride: usize,
    first_lane: usize,
}

impl<'a> Moments<'a> {
    #[inline(always)]
    fn of(&self, parameter: usize) -> BlockMoments<'a> {
        let mut moments = [&[0.0; N_LANES]; N_BINS];
        for (bin, moments) in moments.iter_mut().enumerate() {
            let first = (parameter * N_BINS + bin) * self.stride + self.first_lane;
            if let Some(lanes) = self.values[first..].first_chunk() {
                *moments = lanes;
            }
        }
        moments
    }
}

/// Posterior and CVaR of one block.
struct Fuse<'a> {
    fusion: &'a Fusion,
    prediction: &'a BlockPrediction,
    moments: Moments<'a>,
    blocked: &'a [bool],
    unknown: &'a [bool],
    known: &'a [bool],
    out_of_distribution: &'a mut [bool],
    risks: &'a mut [Risk],
}

impl pulp::WithSimd for Fuse<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let per_level = self.fusion.per_level;
        let mut cvars = [Lanes::ZERO; 4];
        for (parameter, cvar) in cvars.iter_mut().enumerate() {
            let mixture = Mixture {
                moments: self.moments.of(parameter),
                probabilities: &self.prediction.probabilities[parameter],
                share: &self.share(simd, parameter),
            };
            *cvar = match parameter {
                0 | 1 => mixture.traction_cvar(simd, per_level),
                _ => mixture.angle_cvar_rad(simd, per_level),
            };
        }
        self.keep(&cvars);
    }
}

impl Fuse<'_> {
    /// How much of the networks' distribution counts.
    #[inline(always)]
    fn share<S: pulp::Simd>(&self, simd: S, parameter: usize) -> Lanes {
        let mut share = match self.fusion.prior {
            Prior::None => Lanes([1.0; N_LANES]),
            Prior::Physics | Prior::Uniform => {
                learned_share(simd, &self.prediction.evidence[parameter], self.fusion.prior_evidence)
            }
        };
        for (share, is_unknown) in share.0.iter_mut().zip(self.unknown) {
            *share = if *is_unknown { 0.0 } else { *share };
        }
        share
    }

    #[inline(always)]
    fn keep(self, cvars: &[Lanes; 4]) {
        let log_density = &self.prediction.log_density;
        let n_lanes = N_LANES.min(self.blocked.len());
        for (lane, risk) in self.risks.iter_mut().enumerate().take(n_lanes) {
            let is_out = log_density.0[lane] < self.fusion.log_density_min && self.known[lane];
            self.out_of_distribution[lane] = is_out;
            let free = Risk {
                linear_traction: cvars[0].0[lane],
                angular_traction: cvars[1].0[lane],
                roll_rad: cvars[2].0[lane],
                pitch_rad: cvars[3].0[lane],
            };
            let free = if is_out { self.fusion.unfamiliar(free) } else { free };
            *risk = if self.blocked[lane] { free.blocked() } else { free };
        }
    }
}
