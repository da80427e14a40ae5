//! What a repaired model is worth to the controller: plants with a gap, driven with the nominal model, with the model
//! that the diagnosis repaired from recorded drives of the plant, and with the true one.
//!
//! A gap is made by the plant's own parts. Its recorded drives are those of an excited driver on the machine's hills,
//! another one than the controller. All speeds, courses and sizes of gaps are constants, chosen so that the plant
//! without a gap is driven well.

mod belief;
mod course;
mod drive;
mod gap;
mod rocks;
mod row;
mod track;

use std::collections::BTreeMap;

use bicycle::{Effect, Model};
use mppi::Isa;
use scenarios::{Deviation, TestMachine};
use serde::Serialize;
use sim_to_real::{ControllerModel, Verdict};

use crate::closed_loop::DriveError;
use crate::sweep::in_turns;
pub use belief::Belief;
use belief::Simulator;
pub use drive::{DriveResult, End, Ground, Job};
pub use gap::Gap;
use rocks::Rocks;
pub use row::{Differences, Row};
use track::Track;

/// Vehicles around which machines are drawn.
pub const VEHICLES: [&str; 3] = ["pietra_full_size", "sedan", "buggy_fifth"];
/// Seed of the machine, its hills and the simulator's drives.
const MACHINE_SEED: u64 = 1;
/// Lateral acceleration that plans on the course may ask for, over the grip of firm ground [-].
const LATERAL_SHARE: f64 = 0.75;
/// Steps of a plan after which the vehicle is looked for where the plan put it: half a second.
const PLAN_AHEAD: usize = 5;

/// Which drives to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Name of the vehicle around which the machine is drawn, one of [`VEHICLES`].
    pub vehicle: &'static str,
    /// Where to drive.
    pub grounds: Vec<Ground>,
    /// What the plant does and its simulator does not.
    pub gaps: Vec<Gap>,
    /// Seeds 1 to this; each has recorded drives and a diagnosis of its own.
    pub n_seeds: u64,
    /// Drives at a time.
    pub n_threads: usize,
    /// Instruction set of the controller.
    pub isa: Isa,
}

impl Request {
    /// How many drives that are.
    pub fn n_drives(&self) -> usize {
        jobs(self).len()
    }
}

/// What was found in the recorded drives of one plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// What the plant does and its simulator does not.
    pub gap: Gap,
    /// Of the recorded drives.
    pub seed: u64,
    /// What the diagnosis says.
    pub verdict: Verdict,
    /// The effects that it announces, as they fit the model that it is made with.
    pub found: Vec<Effect>,
    /// What the controller's model is to hold.
    pub controller_model: ControllerModel,
    /// The effect that the gap amounts to.
    pub truth: Option<Effect>,
}

/// All drives and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name of the vehicle around which the machine is drawn.
    pub vehicle: &'static str,
    /// Seeds were 1 to this.
    pub n_seeds: u64,
    /// Instruction set that the controller used.
    pub isa: Isa,
    /// The calibrated model's effects, which all models but the bare one share.
    pub calibrated: Vec<Effect>,
    /// What the diagnoses found.
    pub diagnoses: Vec<Found>,
    /// One row for each ground, gap and belief.
    pub rows: Vec<Row>,
    /// All drives, row by row, each row by ascending seed.
    pub drives: Vec<DriveResult>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum ClosedLoopError {
    /// Nothing to drive.
    #[error("expected at least one seed, one ground and one gap, found none")]
    NoDrives,
    /// The vehicle cannot be read.
    #[error(transparent)]
    Vehicle(#[from] formats::ConfigError),
    /// The machine's hills cannot be made.
    #[error(transparent)]
    World(#[from] scenarios::WorldError),
    /// There is no such rock field.
    #[error(transparent)]
    Field(#[from] scenarios::RockFieldError),
    /// No drive could be recorded.
    #[error(transparent)]
    TestDrive(#[from] scenarios::TestDriveError),
    /// The recorded drives cannot be diagnosed.
    #[error(transparent)]
    Gap(#[from] sim_to_real::GapError),
    /// The plant cannot be put on its ground.
    #[error(transparent)]
    Plant(#[from] scenarios::PlantError),
    /// A command was no number.
    #[error(transparent)]
    Command(#[from] scenarios::CommandError),
    /// The controller refused its settings.
    #[error(transparent)]
    Controller(#[from] mppi::ConfigError),
    /// There is no such risk tolerance.
    #[error(transparent)]
    Level(#[from] traversability::CvarLevelError),
    /// The closed loop gave up.
    #[error(transparent)]
    Loop(#[from] Box<DriveError>),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl From<DriveError> for ClosedLoopError {
    fn from(error: DriveError) -> Self {
        Self::Loop(Box::new(error))
    }
}

/// What happens while a table is made.
#[derive(Clone, Debug)]
pub enum Progress<'a> {
    /// A plant was diagnosed.
    Diagnosed(&'a Found),
    /// A drive has ended.
    Drove(&'a DriveResult),
}

/// Calibrates, diagnoses, and does all drives; `told` hears of each as it is done, in any order and on any thread.
///
/// # Errors
/// Nothing to drive, no threads to be had, or a drive that could not begin or go on.
pub fn measure(request: &Request, told: impl Fn(Progress<'_>) + Sync) -> Result<Report, ClosedLoopError> {
    let jobs = jobs(request);
    if jobs.is_empty() {
        return Err(ClosedLoopError::NoDrives);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let fleet = Fleet::prepare(request)?;
    let recorded: Vec<(Gap, u64)> =
        request.gaps.iter().flat_map(|&gap| (1..=request.n_seeds).map(move |seed| (gap, seed))).collect();
    let diagnoses = in_turns(&pool, recorded.len(), |index| {
        let found = fleet.diagnose(recorded[index])?;
        told(Progress::Diagnosed(&found));
        Ok::<_, ClosedLoopError>(found)
    })?;
    let repaired: BTreeMap<(Gap, u64), &ControllerModel> =
        diagnoses.iter().map(|found| ((found.gap, found.seed), &found.controller_model)).collect();
    let drives = in_turns(&pool, jobs.len(), |index| {
        let job = jobs[index];
        let drive = fleet.drive(job, repaired[&(job.gap, job.seed)])?;
        told(Progress::Drove(&drive));
        Ok::<_, ClosedLoopError>(drive)
    })?;
    Ok(Report {
        vehicle: request.vehicle,
        n_seeds: request.n_seeds,
        isa: request.isa,
        calibrated: fleet.simulator.calibrated().to_vec(),
        diagnoses,
        rows: rows(&drives),
        drives,
    })
}

/// Row by row, each row by ascending seed.
fn jobs(request: &Request) -> Vec<Job> {
    let mut jobs = Vec::new();
    for &ground in &request.grounds {
        for &gap in &request.gaps {
            for &belief in beliefs(ground, gap) {
                jobs.extend((1..=request.n_seeds).map(|seed| Job { ground, gap, belief, seed }));
            }
        }
    }
    jobs
}

/// Where there is no gap, the nominal model is the true one. Among the rocks nobody drives without calibration: that
/// comparison costs minutes and the course makes it.
fn beliefs(ground: Ground, gap: Gap) -> &'static [Belief] {
    let without_truth = &Belief::ALL[..3];
    match (ground, gap) {
        (Ground::Course, Gap::None) => without_truth,
        (Ground::Course, _) => &Belief::ALL,
        (Ground::Rocks, Gap::None) => &without_truth[1..],
        (Ground::Rocks, _) => &Belief::ALL[1..],
    }
}

fn rows(drives: &[DriveResult]) -> Vec<Row> {
    let mut cells: BTreeMap<(Ground, Gap, Belief), Vec<DriveResult>> = BTreeMap::new();
    for drive in drives {
        let Job { ground, gap, belief, .. } = drive.job;
        cells.entry((ground, gap, belief)).or_default().push(*drive);
    }
    let nominal = |ground, gap| cells.get(&(ground, gap, Belief::Nominal)).map_or(&[][..], Vec::as_slice);
    cells.iter().filter_map(|((ground, gap, _), drives)| Row::of(drives, nominal(*ground, *gap))).collect()
}

/// The machine, its simulator, and what it drives on.
struct Fleet {
    machine: TestMachine,
    simulator: Simulator,
    track: Track,
    rocks: Rocks,
}

impl Fleet {
    fn prepare(request: &Request) -> Result<Self, ClosedLoopError> {
        let base = formats::read_vehicle(request.vehicle)?;
        let machine = TestMachine::draw(&base, request.vehicle, MACHINE_SEED)?;
        Ok(Self {
            simulator: Simulator::calibrate(&machine, MACHINE_SEED)?,
            track: Track::new(&machine, request.isa),
            rocks: Rocks::new(&machine, request.isa)?,
            machine,
        })
    }

    fn diagnose(&self, (gap, seed): (Gap, u64)) -> Result<Found, ClosedLoopError> {
        let (verdict, found, controller_model) = self.simulator.diagnose(&self.machine, gap, seed)?;
        Ok(Found { gap, seed, verdict, found, controller_model, truth: gap.effect(&self.machine) })
    }

    fn drive(&self, job: Job, repaired: &ControllerModel) -> Result<DriveResult, ClosedLoopError> {
        let model: Model = self.simulator.model(&self.machine, job, repaired);
        let deviations: Vec<Deviation> = job.gap.deviation(&self.machine).into_iter().collect();
        match job.ground {
            Ground::Course => self.track.drive(&self.machine, job, (model, &deviations)),
            Ground::Rocks => self.rocks.drive(&self.machine, job, (model, &deviations)),
        }
    }
}

#[cfg(test)]
mod tests;
