//! All poses of a risk map over the ground below.

use bicycle::lanes::{Block, Instructions, Lanes, OnLanes, Real, SPAN, Scalar};
use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::{Bins, CvarLevel, Ground, N_BINS};

use crate::PriorBelief;
use crate::block_prior::{BlockPrior, PoseLine};
use crate::ground::ContactGround;
use crate::ground_changes::{Felt, GroundChanges};
use crate::lattice::ResolutionRatio;
use crate::lengths::Lengths;
use crate::outcomes::Equations;
use crate::pose::Placed;
use crate::stencil::{Reach, Stencil};
use crate::tails::{Tails, distribution};
use crate::tally::Tally;

/// How the ground under a pose becomes a risk.
#[derive(Clone, Debug)]
pub(crate) enum Judgement {
    Physics(Box<Physics>),
    Nominal,
}

/// The physics prior at a level.
#[derive(Clone, Debug)]
pub(crate) struct Physics {
    pub equations: Equations,
    pub tails: Tails,
    pub level: CvarLevel,
    pub evidence: f32,
}

/// The poses that cells and yaw bins stand for. Lattice indices are columns, rows on the global lattice.
#[derive(Clone, Debug)]
pub(crate) struct Poses {
    pub judgement: Judgement,
    pub ground: ContactGround,
    lengths: Lengths,
    ratio: ResolutionRatio,
    n_yaws: usize,
    /// Shape [row phase, column phase, yaw].
    stencils: Vec<Stencil>,
    reach: Reach,
    instructions: Instructions,
    changes: GroundChanges,
}

impl Poses {
    pub fn new(
        judgement: Judgement,
        lengths: Lengths,
        (ratio, surface_resolution_m): (ResolutionRatio, f64),
        risk: &GridGeometry,
        n_yaws: usize,
        instructions: Instructions,
    ) -> Self {
        let stencils = stencils(&lengths, ratio, surface_resolution_m, n_yaws);
        let own_cell = ratio.covered(0).end + 1;
        let around = Reach { min: [-own_cell; 2], max: [own_cell; 2] };
        let reach = stencils.iter().map(Stencil::reach).fold(around, Reach::union);
        let reach = reach.grown(ContactGround::reach_of(&lengths, surface_resolution_m));
        let window = window(risk, ratio, reach, surface_resolution_m);
        let ground = ContactGround::unknown(window, ratio, &lengths);
        let changes = GroundChanges::new(ground.lanes().planes(), &felt(&stencils));
        let mut poses =
            Self { judgement, ground, lengths, ratio, n_yaws, stencils, reach, instructions, changes };
        poses.lay_stencils(risk);
        poses
    }

    /// Makes room for another window of the risk map; the ground must be read anew.
    pub fn move_to(&mut self, risk: &GridGeometry) {
        let window = window(risk, self.ratio, self.reach, self.ground.window().resolution_m);
        self.ground = ContactGround::unknown(window, self.ratio, &self.lengths);
        self.changes.move_to(self.ground.lanes().planes(), &felt(&self.stencils));
        self.lay_stencils(risk);
    }

    /// Takes over the surface's lattice rectangle from `min` to `max`, both inclusive; outside of it nothing changed.
    pub fn read_ground(&mut self, surface: &GridMap<SurfaceCell>, min: [i64; 2], max: [i64; 2]) {
        let area = self.ground.read(surface, min, max);
        self.changes.note(area.rows, area.cols, |row, col| self.ground.cell_read(surface, row, col));
    }

    /// Nothing changed.
    pub fn keep_ground(&mut self) {
        self.changes.note_none();
    }

    /// Of the poses of a line, one bit each, those that read a cell which the last reading changed. The bits after the last
    /// pose mean nothing.
    pub fn changed(&self, line: &PoseLine) -> u64 {
        let (stencil, first) = self.stencil(line);
        self.changes.felt_by(&stencil.felt, first)
    }

    /// How a line's poses read the ground, and the position of its first base cell in the layers.
    fn stencil(&self, line: &PoseLine) -> (&Stencil, usize) {
        let [col_phase, row_phase] = line.cell.map(|index| self.ratio.phase_index(index));
        let stencil = (row_phase * self.ratio.n_phases() + col_phase) * self.n_yaws + line.yaw;
        let base = line.cell.map(|index| self.ratio.base(index));
        (&self.stencils[stencil], self.ground.lanes().planes().index(base))
    }

    fn lay_stencils(&mut self, risk: &GridGeometry) {
        let n_phases = self.ratio.n_phases();
        let planes = self.ground.lanes().planes();
        for (index, stencil) in self.stencils.iter_mut().enumerate() {
            let col = self.ratio.like(index / self.n_yaws % n_phases, risk.origin[0]);
            stencil.lay_on(planes, [col, risk.origin[1]].map(|index| self.ratio.base(index)));
        }
    }

    /// Bytes of the ground and of what was read of it.
    pub fn n_bytes(&self) -> usize {
        self.ground.n_bytes() + self.changes.n_bytes()
    }

    /// How the risk cells lie on those of the surface.
    pub fn ratio(&self) -> ResolutionRatio {
        self.ratio
    }

    /// What the kernels run on.
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// What the prior says of the poses of a line, from a lane of the block on. Whole spans are written: lines must
    /// come in the order of their lanes. The nominal judgement knows obstacles alone.
    pub fn read(&self, line: &PoseLine, first_lane: usize, block: &mut BlockPrior) {
        let (stencil, first) = self.stencil(line);
        self.instructions.run_on_lanes(ReadLine { poses: self, stencil, first, line, first_lane, block });
    }

    /// Belief of any pose; `None` outside the ground's window and for the nominal judgement.
    pub fn belief(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Option<PriorBelief> {
        let Judgement::Physics(physics) = &self.judgement else { return None };
        let resolution_m = self.ground.window().resolution_m;
        let place = [x_m, y_m].map(|v| v / resolution_m);
        let base = place.map(|v| v.floor() as i64);
        let phase = place.map(|v| v - v.floor());
        let mut stencil = Stencil::new(&self.lengths, resolution_m, phase, (yaw_rad, 0.0));
        self.contains(base, stencil.reach()).then(|| {
            let ground = self.ground.lanes();
            stencil.lay_on(ground.planes(), base);
            let first = ground.planes().index(base);
            let placed = Placed { lanes: Scalar, ground, stencil: &stencil, first, offset: 0 };
            let pose = placed.pose_ground(&self.lengths);
            let equations = &physics.equations;
            let distribution = distribution(equations, &equations.outcomes(Scalar, &pose));
            PriorBelief::new(&distribution, physics.evidence, equations.is_unknown(Scalar, &pose))
        })
    }

    fn contains(&self, base: [i64; 2], reach: Reach) -> bool {
        let window = self.ground.window();
        let inside = |axis: usize, n: usize| {
            let start = base[axis] - window.origin[axis];
            start + reach.min[axis] >= 0 && start + reach.max[axis] < n as i64
        };
        inside(0, window.n_cols) && inside(1, window.n_rows)
    }

    /// The ground in one risk cell: mean gradient of the known surface cells in it, likeliest class, an obstacle
    /// if any of them is one, unknown if less than half of them are known.
    pub fn ground_in(&self, cell: [i64; 2], surface: &GridMap<SurfaceCell>) -> Ground {
        let [cols, rows] = cell.map(|index| self.ratio.covered(index));
        let mut tally = Tally::default();
        for row in rows {
            for col in cols.clone() {
                let contact = &self.ground.contacts()[self.ground.index([col, row])];
                tally.add(contact, surface.at_lattice([col, row]));
            }
        }
        tally.ground()
    }
}

/// The poses of a line, in packs of any instruction set. Every one of them gives the same bits, since multiplications
/// and additions stay apart.
struct ReadLine<'a> {
    poses: &'a Poses,
    stencil: &'a Stencil,
    /// Position of the first base cell in the layers.
    first: usize,
    line: &'a PoseLine,
    first_lane: usize,
    block: &'a mut BlockPrior,
}

impl OnLanes for ReadLine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        for start in (0..self.line.n_lanes).step_by(SPAN) {
            for offset in (0..SPAN).step_by(L::WIDTH) {
                self.read(lanes, start, offset);
            }
        }
    }
}

impl ReadLine<'_> {
    #[inline(always)]
    fn read<L: Lanes>(&mut self, lanes: L, start: usize, offset: usize) {
        let Self { poses, stencil, first, first_lane, .. } = *self;
        let placed = Placed { lanes, ground: poses.ground.lanes(), stencil, first: first + start, offset };
        let lane = first_lane + start;
        let write = |block: &mut Block, value: Real<L>| {
            if let Some(span) = block.span_mut(lane) {
                lanes.to_span(value.1, span, offset);
            }
        };
        let Judgement::Physics(physics) = &poses.judgement else {
            write(&mut self.block.obstruction, placed.obstruction());
            return;
        };
        let pose = placed.pose_ground(&poses.lengths);
        write(&mut self.block.obstruction, pose.obstruction);
        let is_unknown = physics.equations.is_unknown(lanes, &pose);
        write(&mut self.block.unknown, lanes.real(1.0).or_else(is_unknown, lanes.real(0.0)));
        let outcomes = physics.equations.outcomes(lanes, &pose);
        let [linear, angular] = physics.tails.shortfalls(lanes, &outcomes);
        for bin in 0..N_BINS {
            write(&mut self.block.moments[0][bin], linear[bin]);
            write(&mut self.block.moments[1][bin], angular[bin]);
        }
        for axis in 0..2 {
            let excesses_rad = physics.tails.excesses_rad(lanes, &outcomes, axis);
            for bin in 0..N_BINS {
                write(&mut self.block.moments[2 + axis][bin], excesses_rad[bin]);
            }
        }
    }
}

/// The CVaR of every parameter of the poses of a block, see [`traversability::PartialMoments`].
pub(crate) struct BlockCvar<'a> {
    pub moments: &'a [[Block; N_BINS]; 4],
    pub level: CvarLevel,
}

impl OnLanes for BlockCvar<'_> {
    type Output = [Block; 4];

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> [Block; 4] {
        let mut cvars = [Block::ZERO; 4];
        for (parameter, cvar) in cvars.iter_mut().enumerate() {
            for first_lane in (0..bicycle::lanes::BLOCK).step_by(SPAN) {
                for offset in (0..SPAN).step_by(L::WIDTH) {
                    let best = self.best(lanes, parameter, first_lane, offset);
                    if let Some(span) = cvar.span_mut(first_lane) {
                        lanes.to_span(best.1, span, offset);
                    }
                }
            }
        }
        cvars
    }
}

impl BlockCvar<'_> {
    /// The largest v - E[(v - Z)^+] / level for traction, the smallest v + E[(Z - v)^+] / level for angles.
    #[inline(always)]
    fn best<L: Lanes>(&self, lanes: L, parameter: usize, first_lane: usize, offset: usize) -> Real<L> {
        let per_level = lanes.real_single(self.level.reciprocal());
        let tail = |bin: usize| {
            let moment = &self.moments[parameter][bin];
            per_level * lanes.real_of_span(moment.span(first_lane), offset)
        };
        let is_traction = parameter < 2;
        let values = if is_traction { Bins::TRACTION.values() } else { Bins::ATTITUDE.values() };
        let value = |bin: usize| lanes.real_single(values[bin]);
        if is_traction {
            (1..N_BINS).fold(value(0) - tail(0), |best, bin| best.max(value(bin) - tail(bin)))
        } else {
            (1..N_BINS).fold(value(0) + tail(0), |best, bin| best.min(value(bin) + tail(bin)))
        }
    }
}

fn felt(stencils: &[Stencil]) -> Vec<&Felt> {
    stencils.iter().map(|stencil| &stencil.felt).collect()
}

fn stencils(lengths: &Lengths, ratio: ResolutionRatio, resolution_m: f64, n_yaws: usize) -> Vec<Stencil> {
    let phases = 0..ratio.n_phases() as i64;
    let mut stencils = Vec::with_capacity(ratio.n_phases().pow(2) * n_yaws);
    for row in phases.clone() {
        for col in phases.clone() {
            for yaw_bin in 0..n_yaws {
                let half_bin_rad = std::f64::consts::PI / n_yaws as f64;
                let yaw_rad = (2 * yaw_bin + 1) as f64 * half_bin_rad;
                let phase = [ratio.phase(col), ratio.phase(row)];
                stencils.push(Stencil::new(lengths, resolution_m, phase, (yaw_rad, half_bin_rad)));
            }
        }
    }
    stencils
}

/// The surface cells that the poses of a risk map read.
fn window(risk: &GridGeometry, ratio: ResolutionRatio, reach: Reach, resolution_m: f64) -> GridGeometry {
    let n = [risk.n_cols, risk.n_rows].map(|n| n as i64);
    let first = |axis: usize| ratio.base(risk.origin[axis]) + reach.min[axis];
    let last = |axis: usize| ratio.base(risk.origin[axis] + n[axis] - 1) + reach.max[axis];
    let count = |axis: usize| (last(axis) - first(axis) + 1).max(0) as usize;
    GridGeometry { resolution_m, origin: [first(0), first(1)], n_rows: count(1), n_cols: count(0) }
}

#[cfg(test)]
mod tests {
    use bicycle::{AxleDemand, Geometry};
    use terrain::{Cell, TerrainClass};

    use super::*;
    use crate::{PriorConfig, SlopeLaw};

    const CAR: Geometry = Geometry {
        wheelbase_m: 0.18,
        track_m: 0.19,
        length_m: 0.33,
        width_m: 0.25,
        rear_overhang_m: 0.075,
        ground_clearance_m: 0.05,
        wheel_radius_m: 0.075,
    };

    /// Bumpy, half green ground with noise and a hole.
    fn bumpy(window: GridGeometry) -> GridMap<SurfaceCell> {
        let cell = |index: usize| {
            let Cell { row, col } = window.cell(index);
            let height_m = 0.06 * ((1.3 * row as f32).sin() + (0.7 * col as f32).cos());
            let mut cell = SurfaceCell::certain(height_m, TerrainClass::Open, 0.01 * (index % 13) as f32);
            cell.class_probability = [0.5, 0.0, 0.5, 0.0];
            cell.height_variance_m2 = 1e-5 * (index % 7) as f32;
            if index == window.n_cells() / 2 { SurfaceCell::UNKNOWN } else { cell }
        };
        let values = (0..window.n_cells()).map(cell).collect();
        GridMap::from_values(window, values).unwrap()
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let axle = AxleDemand { share: 1.0, unloading: 0.6 };
        let by_friction = SlopeLaw::Friction { slip_stiffness: 12.0, axle };
        for slope_law in [SlopeLaw::Linear {}, by_friction] {
            same_bits_on_every_instruction_set(PriorConfig { slope_law, ..PriorConfig::default() });
        }
    }

    fn same_bits_on_every_instruction_set(prior: PriorConfig) {
        let window = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 24, n_cols: 24 };
        let lengths = Lengths::new(&CAR, &prior);
        let equations = Equations::new(&prior, &lengths);
        let level = CvarLevel::new(0.4).unwrap();
        let tails = Tails::new(&equations);
        let judgement = Judgement::Physics(Box::new(Physics { equations, tails, level, evidence: 12.0 }));
        let ratio = ResolutionRatio::new(0.1, 0.1).unwrap();
        let mut poses = Poses::new(judgement, lengths, (ratio, 0.1), &window, 13, Instructions::Portable);
        poses.ground.read(&bumpy(window), [-100; 2], [100; 2]);
        for (cell, yaw) in [([5, 5], 0), ([1, 11], 5), ([2, 12], 9), ([7, 4], 12)] {
            let line = PoseLine { cell, yaw, n_lanes: 17 };
            let mut risks = |instructions: Instructions| {
                poses.instructions = instructions;
                let mut block = BlockPrior::default();
                poses.read(&line, 3, &mut block);
                let cvars = instructions.run_on_lanes(BlockCvar { moments: &block.moments, level });
                cvars.map(|cvar| cvar.lanes()[3..20].to_vec())
            };
            let portable = risks(Instructions::Portable);
            for instructions in Instructions::all() {
                assert_eq!(risks(instructions), portable, "{instructions:?}");
            }
        }
    }
}
