//! From stretches of a drive to networks that are better there, and to the decision whether to use them.

use std::collections::VecDeque;
use std::sync::Arc;

use bicycle::{DriveLog, DriveLogError, DriveRow, Geometry, Limits};
use evidential::{
    Assessment, Checkpoint, CheckpointError, Dataset, DatasetOrigin, Example, LabelConfig, LabelError,
    Refined, Refinement, Surveyor, SurveyorError, TrainError, assess, estimate_responses, labels, refine,
};

use super::memory::{Memory, Part};
use super::notebook::Stretch;

/// Error on the original validation data that new networks may have, as a multiple of the original networks'.
pub const FORGETTING_MAX: f64 = 1.02;
/// Shares of the way from the original networks to what was learned that are tried, the boldest first.
const SHARES: [f64; 10] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1];
/// Stretches before the first label: it takes a while of driving to tell how commands become motion.
const LEAD_STRETCHES: usize = 4;
/// Stretches that tell how commands become motion.
const LOG_STRETCHES: usize = 10;
/// New examples that make a round worth while.
const ROUND_EXAMPLES: usize = 40;
/// Least held-out examples, and turns of the way that they must lie on, for a judgement.
const HELD_OUT_MIN: (usize, usize) = (30, 2);

/// What learns, from what, and by what it is judged.
#[derive(Clone, Debug)]
pub struct LearnerSetup {
    /// The machine.
    pub geometry: Geometry,
    /// Its limits, by which commands count as small.
    pub limits: Limits,
    /// Edge of a cell of the surfaces to come [m].
    pub resolution_m: f64,
    /// The networks as they were trained.
    pub original: Arc<Checkpoint>,
    /// Data that these were chosen by and never trained on.
    pub validation: Dataset,
    /// Some of the data that they were trained on, to be learned beside the new; without, they forget sooner.
    pub familiar: Option<Dataset>,
    /// Decides the order of examples.
    pub seed: u64,
}

/// Why nothing can be learned.
#[derive(Debug, thiserror::Error)]
pub enum OnlineError {
    /// The original networks cannot be judged by the validation data.
    #[error("learning while driving, validation data: {0}")]
    Validation(TrainError),
    /// The networks cannot learn from the familiar data, or from what was driven.
    #[error("learning while driving: {0}")]
    Training(#[from] TrainError),
    /// The ground cannot be looked at.
    #[error("learning while driving: {0}")]
    Surveyor(#[from] SurveyorError),
    /// The drive makes no labels.
    #[error("learning while driving: {0}")]
    Labels(#[from] LabelError),
    /// The drive makes no log.
    #[error("learning while driving: {0}")]
    Log(#[from] DriveLogError),
    /// The networks are none.
    #[error("learning while driving: {0}")]
    Checkpoint(#[from] CheckpointError),
}

/// What a round of learning came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Better on held-out recent data by more than its standard error, and not worse on the original validation data
    /// than [`FORGETTING_MAX`] allows: to be used from now on.
    Accepted,
    /// Not better on held-out recent data by more than its standard error: what was used is used on.
    NotBetter,
    /// Too much worse on the original validation data, however little of the way was gone.
    Forgets,
    /// What was used proved worse than the original networks on what has been driven since: these are used again.
    RolledBack,
}

impl Decision {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::NotBetter => "refused, not better",
            Self::Forgets => "refused, forgets",
            Self::RolledBack => "rolled back",
        }
    }
}

/// A round of learning in numbers. Errors are EMD2 summed over the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// From 1.
    pub number: u64,
    /// Examples learned from, and judged by.
    pub n_examples: [usize; 2],
    /// On held-out recent data: what was best so far, and what the round proposes.
    pub recent: [f64; 2],
    /// Standard error of their difference.
    pub recent_standard_error: f64,
    /// On the original validation data: the original networks, and what the round proposes.
    pub original: [f64; 2],
    /// How much of the way from the original networks to what was learned the proposal goes.
    pub share: f64,
    /// What became of it.
    pub decision: Decision,
}

/// Learns from stretches of a drive. The same stretches and seed give the same networks, bit for bit.
pub struct Learner {
    setup: LearnerSetup,
    surveyor: Surveyor,
    labelling: LabelConfig,
    /// Stretches that wait for the first labels.
    pending: Vec<Stretch>,
    /// Rows of the newest stretches.
    log: VecDeque<Vec<DriveRow>>,
    memory: Memory,
    in_use: Arc<Checkpoint>,
    /// Error of the original networks on the validation data.
    original_error: f64,
    n_rounds: u64,
    n_fresh: usize,
    n_refused: u64,
}

impl Learner {
    /// Refuses data that do not fit the networks.
    pub fn new(setup: LearnerSetup) -> Result<Self, OnlineError> {
        let original_error =
            assess(&setup.original, &setup.validation).map_err(OnlineError::Validation)?.total();
        if let Some(familiar) = &setup.familiar {
            assess(&setup.original, familiar)?;
        }
        let sidecar = &setup.original.sidecar;
        let surveyor = Surveyor::new(&setup.geometry, sidecar.layout, sidecar.prior, setup.resolution_m)?;
        Ok(Self {
            surveyor,
            labelling: LabelConfig::for_vehicle(&setup.geometry, &setup.limits),
            pending: Vec::new(),
            log: VecDeque::new(),
            memory: Memory::new(&setup.geometry),
            in_use: Arc::clone(&setup.original),
            original_error,
            n_rounds: 0,
            n_fresh: 0,
            n_refused: 0,
            setup,
        })
    }

    /// The networks that are to be used.
    pub fn in_use(&self) -> &Arc<Checkpoint> {
        &self.in_use
    }

    /// What is remembered.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// The networks as they were trained.
    pub fn original(&self) -> &Arc<Checkpoint> {
        &self.setup.original
    }

    /// Examples that were none: features or measurements that are not finite.
    pub fn n_refused(&self) -> u64 {
        self.n_refused
    }

    /// Labels a stretch and remembers what was learned of it.
    pub fn take(&mut self, stretch: Stretch) -> Result<(), OnlineError> {
        if self.log.len() == LOG_STRETCHES {
            self.log.pop_front();
        }
        self.log.push_back(stretch.rows.clone());
        self.pending.push(stretch);
        if self.log.len() < LEAD_STRETCHES {
            return Ok(());
        }
        let log = drive_log(self.log.iter().map(Vec::as_slice))?;
        let responses = estimate_responses(&log, &self.setup.geometry, &self.labelling)?;
        for stretch in std::mem::take(&mut self.pending) {
            let log = drive_log([stretch.rows.as_slice()].into_iter())?;
            for run in log.runs() {
                for label in labels(&run, &self.setup.geometry, &responses, &self.labelling)? {
                    let Some(mut example) = self.surveyor.example(&stretch.surface, &label, 0)? else {
                        continue;
                    };
                    // Where it was before the localisation ever jumped.
                    example.pose = stretch.shift.inverse().pose(example.pose);
                    self.remember(example);
                }
            }
        }
        Ok(())
    }

    /// Remembers an example; refuses one that holds numbers that are none.
    pub fn remember(&mut self, example: Example) {
        let is_whole = self.dataset(vec![Example { drive: 0, ..example.clone() }]).validate().is_ok();
        if !is_whole || example.measured.iter().all(|value| value.is_nan()) {
            self.n_refused += 1;
        } else if self.memory.take(example) == Some(Part::Learned) {
            self.n_fresh += 1;
        }
    }

    /// Whether there is enough that is new, and enough to judge by.
    pub fn is_ready(&self) -> bool {
        let (n, n_turns) = HELD_OUT_MIN;
        self.n_fresh >= ROUND_EXAMPLES
            && self.memory.n(Part::HeldOut) >= n
            && self.memory.n_turns(Part::HeldOut) >= n_turns
    }

    /// One round: learns from what is remembered, beginning with the original networks, and decides what is used from
    /// now on. `None` when `goes_on` says no.
    ///
    /// # Errors
    /// A loss that is not finite; what is in use stays.
    pub fn round(&mut self, goes_on: &dyn Fn() -> bool) -> Result<Option<Round>, OnlineError> {
        self.n_fresh = 0;
        let [learned, held_out] = [Part::Learned, Part::HeldOut].map(|part| self.data(part));
        let settings = Refinement::new(self.setup.seed);
        let refined =
            refine(&self.setup.original, &learned, self.setup.familiar.as_ref(), &settings, goes_on)?;
        let Some(proposal) = refined.map(|refined| self.proposal(&refined)).transpose()? else {
            return Ok(None);
        };
        let incumbent = self.incumbent(&held_out)?;
        let proposed = assess(&proposal.checkpoint, &held_out)?;
        let (above, recent_standard_error) = proposed.above(&incumbent.assessment);
        let is_better = above + recent_standard_error < 0.0;
        let decision = if proposal.is_allowed && is_better {
            Decision::Accepted
        } else if incumbent.is_rolled_back {
            Decision::RolledBack
        } else if proposal.is_allowed {
            Decision::NotBetter
        } else {
            Decision::Forgets
        };
        match decision {
            Decision::Accepted => self.in_use = Arc::new(proposal.checkpoint),
            Decision::RolledBack => self.in_use = Arc::clone(&self.setup.original),
            Decision::NotBetter | Decision::Forgets => {}
        }
        self.n_rounds += 1;
        Ok(Some(Round {
            number: self.n_rounds,
            n_examples: [learned.examples.len(), held_out.examples.len()],
            recent: [incumbent.assessment.total(), proposed.total()],
            recent_standard_error,
            original: [self.original_error, proposal.original_error],
            share: proposal.share,
            decision,
        }))
    }

    /// The boldest step towards what was learned that does not forget too much; the smallest when all do.
    fn proposal(&self, refined: &Refined) -> Result<Proposal, OnlineError> {
        let limit = FORGETTING_MAX * self.original_error;
        let mut share = SHARES[0];
        let mut checkpoint = refined.at(share)?;
        let mut original_error = assess(&checkpoint, &self.setup.validation)?.total();
        for smaller in &SHARES[1..] {
            if original_error <= limit {
                break;
            }
            share = *smaller;
            checkpoint = refined.at(share)?;
            original_error = assess(&checkpoint, &self.setup.validation)?.total();
        }
        let n = self.memory.n(Part::Learned);
        let revision = &self.setup.original.sidecar.git_revision;
        checkpoint.sidecar.git_revision = format!("{revision}, and {n} footprints driven on");
        Ok(Proposal { checkpoint, share, original_error, is_allowed: original_error <= limit })
    }

    /// What a proposal must be better than: the networks in use, or the original ones where these are better on what
    /// has been driven since.
    fn incumbent(&self, held_out: &Dataset) -> Result<Incumbent, OnlineError> {
        let in_use = assess(&self.in_use, held_out)?;
        let original = assess(&self.setup.original, held_out)?;
        let (above, standard_error) = in_use.above(&original);
        let is_rolled_back = above > standard_error;
        Ok(Incumbent { assessment: if is_rolled_back { original } else { in_use }, is_rolled_back })
    }

    /// What is remembered for a purpose, as a dataset; every turn of the way is a drive.
    pub fn data(&self, part: Part) -> Dataset {
        self.dataset(self.memory.examples(part))
    }

    fn dataset(&self, examples: Vec<Example>) -> Dataset {
        let sidecar = &self.setup.original.sidecar;
        let n_turns = examples.iter().map(|example| example.drive + 1).max().unwrap_or(0);
        let origin = DatasetOrigin {
            vehicle: sidecar.vehicle.clone(),
            layout: sidecar.layout,
            prior: sidecar.prior,
            drives: (0..n_turns).map(|turn| format!("turn {turn}")).collect(),
            provenance: "learned while driving".to_owned(),
        };
        Dataset { origin, examples }
    }
}

/// What a round would use from now on.
struct Proposal {
    checkpoint: Checkpoint,
    share: f64,
    original_error: f64,
    is_allowed: bool,
}

/// What a proposal is held against.
struct Incumbent {
    assessment: Assessment,
    /// Whether what is in use proved worse than the original networks.
    is_rolled_back: bool,
}

/// Stretches as the runs of a log, each from its own time zero on.
fn drive_log<'a>(stretches: impl Iterator<Item = &'a [DriveRow]>) -> Result<DriveLog, DriveLogError> {
    let mut log = DriveLog::default();
    for (number, rows) in stretches.enumerate() {
        let began_s = rows.first().map_or(0.0, |row| row.time_s);
        for row in rows {
            let mut row = *row;
            row.time_s -= began_s;
            log.push(&number.to_string(), &row)?;
        }
    }
    Ok(log)
}

#[cfg(test)]
mod tests;
