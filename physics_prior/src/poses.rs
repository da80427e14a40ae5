//! All poses of a risk map over the ground below.

use bicycle::lanes::Instructions;
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::{Ground, GroundFlags, Risk};

use crate::PriorBelief;
use crate::ground::{Contact, ContactGround};
use crate::lattice::Ratio;
use crate::lengths::Lengths;
use crate::outcomes::Equations;
use crate::pose::Placed;
use crate::prior_field::PosePrior;
use crate::stencil::{Reach, Stencil};
use crate::tails::{Tails, distribution};

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
    pub evidence: f32,
}

/// The poses that cells and yaw bins stand for. Lattice indices are columns, rows on the global lattice.
#[derive(Clone, Debug)]
pub(crate) struct Poses {
    pub judgement: Judgement,
    pub ground: ContactGround,
    lengths: Lengths,
    ratio: Ratio,
    n_yaws: usize,
    /// Shape [row phase, column phase, yaw].
    stencils: Vec<Stencil>,
    reach: Reach,
    instructions: Instructions,
}

impl Poses {
    pub fn new(
        judgement: Judgement,
        lengths: Lengths,
        (ratio, surface_resolution_m): (Ratio, f64),
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
        let ground = ContactGround::unknown(window, &lengths);
        Self { judgement, ground, lengths, ratio, n_yaws, stencils, reach, instructions }
    }

    /// Makes room for another window of the risk map; the ground must be read anew.
    pub fn move_to(&mut self, risk: &GridGeometry) {
        let window = window(risk, self.ratio, self.reach, self.ground.window().resolution_m);
        self.ground = ContactGround::unknown(window, &self.lengths);
    }

    /// Whether the pose in the centre of a risk cell depends on any surface cell from `min` to `max`, per axis.
    pub fn reads(&self, axis: usize, risk_index: i64, min: i64, max: i64) -> bool {
        let base = self.ratio.base(risk_index);
        base + self.reach.min[axis] <= max && base + self.reach.max[axis] >= min
    }

    /// How the risk cells lie on those of the surface.
    pub fn ratio(&self) -> Ratio {
        self.ratio
    }

    /// Risks of one risk cell for every yaw bin.
    pub fn risks(&self, cell: [i64; 2], risks: &mut [Risk]) {
        let (stencils, base) = self.stencils_of(cell);
        self.instructions.run(Yaws { poses: self, stencils, base, risks });
    }

    /// What the prior says of one risk cell for every yaw bin; nothing for the nominal judgement.
    pub fn pose_priors(&self, cell: [i64; 2], priors: &mut [PosePrior]) {
        if let Judgement::Physics(physics) = &self.judgement {
            let (stencils, base) = self.stencils_of(cell);
            self.instructions.run(YawPriors { poses: self, physics, stencils, base, priors });
        }
    }

    fn stencils_of(&self, cell: [i64; 2]) -> (&[Stencil], [i64; 2]) {
        let [col_phase, row_phase] = cell.map(|index| self.ratio.phase_index(index));
        let first = (row_phase * self.ratio.n_phases() + col_phase) * self.n_yaws;
        (&self.stencils[first..first + self.n_yaws], cell.map(|index| self.ratio.base(index)))
    }

    #[inline(always)]
    fn pose_prior(&self, physics: &Physics, placed: &Placed) -> PosePrior {
        let counts = placed.counts();
        let pose = placed.pose_ground(counts, &self.lengths);
        PosePrior {
            moments: physics.tails.moments(&physics.equations.outcomes(&pose)),
            is_blocked: counts.obstacles > 0,
            is_unknown: physics.equations.is_unknown(&pose),
        }
    }

    #[inline(always)]
    fn risk(&self, placed: &Placed) -> Risk {
        let counts = placed.counts();
        let free = match &self.judgement {
            Judgement::Physics(physics) => {
                let pose = placed.pose_ground(counts, &self.lengths);
                physics.tails.risk(&physics.equations.outcomes(&pose))
            }
            Judgement::Nominal => Risk::NONE,
        };
        if counts.obstacles > 0 { free.blocked() } else { free }
    }

    /// Belief of any pose; `None` outside the ground's window and for the nominal judgement.
    pub fn belief(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Option<PriorBelief> {
        let Judgement::Physics(physics) = &self.judgement else { return None };
        let resolution_m = self.ground.window().resolution_m;
        let place = [x_m, y_m].map(|v| v / resolution_m);
        let base = place.map(|v| v.floor() as i64);
        let phase = place.map(|v| v - v.floor());
        let stencil = Stencil::new(&self.lengths, resolution_m, phase, yaw_rad);
        self.contains(base, stencil.reach()).then(|| {
            let placed = Placed { ground: &self.ground, stencil: &stencil, base };
            let pose = placed.pose_ground(placed.counts(), &self.lengths);
            let distribution = distribution(&physics.equations, &physics.equations.outcomes(&pose));
            PriorBelief::new(&distribution, physics.evidence, physics.equations.is_unknown(&pose))
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

/// The poses of one risk cell, in the registers of any instruction set. Every one of them gives the same bits, since
/// multiplications and additions stay apart.
struct Yaws<'a> {
    poses: &'a Poses,
    stencils: &'a [Stencil],
    base: [i64; 2],
    risks: &'a mut [Risk],
}

impl pulp::WithSimd for Yaws<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (poses, base) = (self.poses, self.base);
        for (stencil, risk) in self.stencils.iter().zip(self.risks) {
            *risk = poses.risk(&Placed { ground: &poses.ground, stencil, base });
        }
    }
}

/// The same for what the prior says of these poses.
struct YawPriors<'a> {
    poses: &'a Poses,
    physics: &'a Physics,
    stencils: &'a [Stencil],
    base: [i64; 2],
    priors: &'a mut [PosePrior],
}

impl pulp::WithSimd for YawPriors<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (poses, base) = (self.poses, self.base);
        for (stencil, prior) in self.stencils.iter().zip(self.priors) {
            *prior = poses.pose_prior(self.physics, &Placed { ground: &poses.ground, stencil, base });
        }
    }
}

/// Surface cells of one risk cell, added up.
#[derive(Default)]
struct Tally {
    n_cells: u32,
    n_known: u32,
    gradient: [f32; 2],
    class_probability: [f32; TerrainClass::COUNT],
    obstacle: bool,
}

impl Tally {
    fn add(&mut self, contact: &Contact, cell: Option<&SurfaceCell>) {
        self.n_cells += 1;
        if !contact.is_unknown() {
            self.n_known += 1;
            self.gradient[0] += contact.values[Contact::GRADIENT_EAST];
            self.gradient[1] += contact.values[Contact::GRADIENT_NORTH];
        }
        if let Some(cell) = cell {
            let sums = self.class_probability.iter_mut().zip(&cell.class_probability);
            sums.for_each(|(sum, probability)| *sum += probability);
            self.obstacle |= cell.class() == TerrainClass::Obstacle;
        }
    }

    fn ground(&self) -> Ground {
        let class = TerrainClass::ALL.into_iter().fold(TerrainClass::Open, |best, class| {
            let likelier = self.class_probability[class as usize] > self.class_probability[best as usize];
            if likelier { class } else { best }
        });
        let mut flags = GroundFlags::default();
        if self.obstacle {
            flags = flags.with(GroundFlags::OBSTACLE);
        }
        if 2 * self.n_known < self.n_cells {
            flags = flags.with(GroundFlags::UNKNOWN);
        }
        let gradient = self.gradient.map(|sum| sum / self.n_known.max(1) as f32);
        Ground { gradient, class: class as u8, flags }
    }
}

fn stencils(lengths: &Lengths, ratio: Ratio, resolution_m: f64, n_yaws: usize) -> Vec<Stencil> {
    let phases = 0..ratio.n_phases() as i64;
    let mut stencils = Vec::with_capacity(ratio.n_phases().pow(2) * n_yaws);
    for row in phases.clone() {
        for col in phases.clone() {
            for yaw_bin in 0..n_yaws {
                let yaw_rad = (yaw_bin as f64 + 0.5) * std::f64::consts::TAU / n_yaws as f64;
                let phase = [ratio.phase(col), ratio.phase(row)];
                stencils.push(Stencil::new(lengths, resolution_m, phase, yaw_rad));
            }
        }
    }
    stencils
}

/// The surface cells that the poses of a risk map read.
fn window(risk: &GridGeometry, ratio: Ratio, reach: Reach, resolution_m: f64) -> GridGeometry {
    let n = [risk.n_cols, risk.n_rows].map(|n| n as i64);
    let first = |axis: usize| ratio.base(risk.origin[axis]) + reach.min[axis];
    let last = |axis: usize| ratio.base(risk.origin[axis] + n[axis] - 1) + reach.max[axis];
    let count = |axis: usize| (last(axis) - first(axis) + 1).max(0) as usize;
    GridGeometry { resolution_m, origin: [first(0), first(1)], n_rows: count(1), n_cols: count(0) }
}

#[cfg(test)]
mod tests {
    use bicycle::Geometry;
    use terrain::Cell;

    use super::*;
    use crate::PriorConfig;

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
        let window = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 24, n_cols: 24 };
        let prior = PriorConfig::default();
        let lengths = Lengths::new(&CAR, &prior);
        let equations = Equations::new(&prior, &lengths);
        let tails = Tails::new(&equations, traversability::CvarLevel::new(0.4).unwrap());
        let judgement = Judgement::Physics(Box::new(Physics { equations, tails, evidence: 12.0 }));
        let ratio = Ratio::new(0.1, 0.1).unwrap();
        let mut poses = Poses::new(judgement, lengths, (ratio, 0.1), &window, 13, Instructions::Portable);
        poses.ground.read(&bumpy(window), [-100; 2], [100; 2]);
        for cell in [[5, 5], [12, 11], [12, 12], [17, 4]] {
            let mut portable = [Risk::NONE; 13];
            poses.instructions = Instructions::Portable;
            poses.risks(cell, &mut portable);
            for instructions in Instructions::all() {
                let mut found = [Risk::NONE; 13];
                poses.instructions = instructions;
                poses.risks(cell, &mut found);
                assert_eq!(found, portable, "{instructions:?}");
            }
        }
    }
}
