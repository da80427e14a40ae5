//! The part of the learning process that listens to the drive and hears from the thread that learns.

use crate::convert::shift_of;
use std::sync::Arc;

use bicycle::SensorModel;
use evidential::{Checkpoint, Unfamiliar};
use navigator::Jump;

use super::background::{Background, Judge, News};
use super::learner::{Learner, LearnerSetup, Round};
use super::notebook::Notebook;
use crate::RuntimeError;
use bus::channel::{Bus, CHECKPOINT, COMMAND, Inlet, ODOMETRY, Outlet};
use bus::clock::{self, SECOND_NS};
use bus::message::{CheckpointHeader, CommandRecord, OdometryRecord, Stamp, SurfaceHeader};
use bus::payload;

/// Time between two tellings of the networks in use, so that a recorder that came late has them too [ns].
const REPEAT_NS: u64 = 5 * SECOND_NS;
/// Room for sidecars that grow by a few words [bytes].
const SLACK_BYTES: usize = 4096;

/// What learns while driving, and from what.
#[derive(Clone, Debug)]
pub struct SchoolSetup {
    /// Networks, data to judge by, machine.
    pub learner: LearnerSetup,
    /// What becomes of ground that is unlike the training data.
    pub unfamiliar: Unfamiliar,
    /// How the vehicle's sensors misstate its motion.
    pub sensors: SensorModel,
}

/// What there is to tell of learning.
pub enum Told<'a> {
    /// A round ended; networks when others are used from now on.
    Round(&'a Round, Option<&'a Checkpoint>),
    /// Learning goes on no more, and why; the drive does.
    Ended(&'a str),
}

/// Listens, hands on, and publishes what was learned.
pub struct School {
    notebook: Notebook,
    odometry: Inlet<Stamp, OdometryRecord>,
    commands: Inlet<Stamp, CommandRecord>,
    outlet: Outlet<CheckpointHeader, u8>,
    background: Background,
    sensors: SensorModel,
    /// Life of the mapping, and all jumps that it has made out.
    shift: Option<(u64, Jump)>,
    in_use: Option<(CheckpointHeader, Vec<u8>)>,
    told_at_ns: u64,
}

impl School {
    /// Starts the thread that learns.
    ///
    /// # Errors
    /// Data that do not fit the networks, a channel that cannot be used, no thread.
    pub fn new(bus: &Bus, setup: SchoolSetup, judge: Judge) -> Result<Self, RuntimeError> {
        let SchoolSetup { learner, sensors, .. } = setup;
        let n_max = learner.original.weights_bytes()?.len() + learner.original.sidecar_bytes()?.len();
        let learner = Learner::new(learner)?;
        Ok(Self {
            notebook: Notebook::default(),
            odometry: bus.inlet(&ODOMETRY)?,
            commands: bus.inlet(&COMMAND)?,
            outlet: bus.outlet(&CHECKPOINT, n_max + SLACK_BYTES)?,
            background: Background::start(learner, judge)?,
            sensors,
            shift: None,
            in_use: None,
            told_at_ns: 0,
        })
    }

    /// Notes what has been commanded and measured.
    pub fn listen(&mut self) {
        let Self { notebook, odometry, commands, sensors, .. } = self;
        commands.poll(|stamp, records| {
            if let Some(decision) = records.first().and_then(CommandRecord::decision) {
                notebook.note_command(stamp.published_at_ns, &decision);
            }
        });
        odometry.poll(|stamp, records| {
            if let Some(record) = records.first() {
                notebook.note_odometry(&sensors.corrected(&record.odometry(stamp.valid_at_ns)));
            }
        });
    }

    /// Looks at a map of the ground that was judged: when enough has been noted, it is handed on with that map.
    pub fn note_surface(&mut self, header: &SurfaceHeader, payload: &[[f32; 8]]) {
        let shift = Some((header.stamp.epoch_ns, shift_of(header)));
        if std::mem::replace(&mut self.shift, shift) != shift {
            self.notebook.break_off();
        }
        if self.notebook.is_full()
            && let Some(surface) = payload::surface_map(header, payload)
        {
            self.background.offer(self.notebook.take(surface, shift_of(header)));
        }
    }

    /// What has been learned meanwhile; never waits.
    pub fn news(&mut self) -> Option<Result<News, String>> {
        self.background.news()
    }

    /// Tells everybody which networks are used from now on.
    pub fn publish(&mut self, news: &News) -> Result<(), RuntimeError> {
        let Some((checkpoint, hash, _)) = &news.change else { return Ok(()) };
        self.in_use = Some(message(&news.round, checkpoint, *hash)?);
        self.told_at_ns = 0;
        self.repeat()
    }

    /// Tells it again, now and then.
    pub fn repeat(&mut self) -> Result<(), RuntimeError> {
        let now_ns = clock::now_ns();
        let Some((header, bytes)) = &self.in_use else { return Ok(()) };
        if now_ns.saturating_sub(self.told_at_ns) < REPEAT_NS || bytes.len() > self.outlet.n_max() {
            return Ok(());
        }
        self.told_at_ns = now_ns;
        let mut loan = self.outlet.write(bytes.len(), |place| bytes[place])?;
        *loan.header_mut() = *header;
        self.outlet.send(loan, now_ns)?;
        Ok(())
    }

    /// Stretches that were given up because learning was behind.
    pub fn n_given_up(&self) -> u64 {
        self.background.n_given_up()
    }
}

/// Weights, then sidecar, as the files that `surefoot train` writes.
fn message(
    round: &Round,
    checkpoint: &Arc<Checkpoint>,
    hash: u64,
) -> Result<(CheckpointHeader, Vec<u8>), RuntimeError> {
    let mut bytes = checkpoint.weights_bytes()?;
    let n_weight_bytes = bytes.len() as u64;
    bytes.extend(checkpoint.sidecar_bytes()?);
    let header = CheckpointHeader {
        checkpoint: hash,
        n_weight_bytes,
        n_examples: round.n_examples.map(|n| n as u64),
        recent_emd2: round.recent,
        original_emd2: round.original,
        ..CheckpointHeader::default()
    };
    Ok((header, bytes))
}
