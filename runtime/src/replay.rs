//! Every decision of a recording, made again from what control said it used.

mod choice;
mod difference;
mod maps;
mod records;
mod survey;
mod tables;

use std::path::PathBuf;
use std::sync::Arc;

use bicycle::ImuSample;
use bicycle::lanes::{Instructions, IsaAbsent};
use evidential::Checkpoint;
use navigator::{Belief, MessageId, NavigatorError, Pilot, PilotAges, RiskMessages};
use traversability::CvarLevel;

use crate::convert::{decision_record, odometry_message, risk_message};
use crate::mapping::PHYSICS;
use crate::setup::{MachineSetup, SetupError};
use bus::message::{DecisionRecord, Source};
use choice::Choice;
use maps::{Maps, Unmade};
pub use records::{Key, ReadError, Records, recorded_decision, recorded_message, recorded_stamp};
pub use tables::{Row, recorded_odometry, recorded_rows};

/// What a replay came to.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ReplayReport {
    /// Decisions in the recording.
    pub n_decisions: u64,
    /// Of these, made again to the same bits.
    pub n_identical: u64,
    /// Decisions whose command somebody corrected for the ground, or would have; these, too, are made again.
    pub n_corrections: u64,
    /// Of the decisions, not made again because something that they need was not recorded.
    pub n_unmade: u64,
    /// Maps of the ground made again, with the recorded hash.
    pub n_surfaces: u64,
    /// Risk maps made again, with the recorded hash.
    pub n_risk_maps: u64,
    /// Maps of the ground whose localisation was made out again from the odometry, to the same bits: the jump that it
    /// shows, or where the scan was taken.
    pub n_localised: u64,
    /// Maps of the ground whose localisation could not be verified.
    pub n_unverified: u64,
    /// Why it could not, each reason once, with the first of the maps.
    pub unverified: Vec<String>,
    /// The first difference, if there is any.
    pub first_difference: Option<String>,
    /// Where the recording contradicts itself, whatever was decided on it: decisions on another map than there was to
    /// decide on, maps of the ground of another jump or place than the odometry shows.
    pub contradictions: Vec<String>,
    /// What the recording lacks, each once.
    pub missing: Vec<String>,
    /// Where the recording breaks off, if it does.
    pub ended_early: Option<String>,
}

/// Why a recording cannot be replayed at all.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It does not say what was run.
    #[error("{file}: expected a recording of `surefoot up` with its setup, found none")]
    NoSetup {
        /// Path of the first file.
        file: String,
    },
    /// Its settings are none.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// It was made with other instructions.
    #[error("{0}; the recording was made with that one, and its decisions are those of no other")]
    Instructions(#[from] IsaAbsent),
    /// Its level or seed is none.
    #[error("recorded {what}: expected {expected}, found {found}")]
    Field {
        /// Name of the field.
        what: &'static str,
        /// What would do.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// The pipeline refused the recorded settings or maps.
    #[error(transparent)]
    Navigator(#[from] NavigatorError),
}

/// What a recorded method believes, with the networks that the recording names by their hash.
pub struct Knowledge {
    /// What learning believed.
    pub belief: Belief,
    /// First 8 bytes of the SHA-256 of the networks' weights; 0 = none.
    pub checkpoint: u64,
    /// What corrected commands for the ground, if anything did.
    pub corrector: Option<Arc<kinodynamics::Checkpoint>>,
}

impl Knowledge {
    /// Of networks.
    pub fn learned(checkpoint: Arc<Checkpoint>, unfamiliar: evidential::Unfamiliar, hash: u64) -> Self {
        Self { belief: Belief::Learned { checkpoint, unfamiliar }, checkpoint: hash, corrector: None }
    }

    /// What was believed by these networks: the original ones, or some that were learned while driving.
    fn of(&self, checkpoint: u64, records: &Records) -> Option<Belief> {
        match &self.belief {
            Belief::Learned { unfamiliar, .. } if checkpoint != self.checkpoint => {
                let checkpoint = Arc::clone(records.checkpoints.get(&checkpoint)?);
                Some(Belief::Learned { checkpoint, unfamiliar: *unfamiliar })
            }
            belief => (checkpoint == self.checkpoint).then(|| belief.clone()),
        }
    }
}

/// Reads recordings that follow one another.
pub fn read(files: &[PathBuf]) -> Result<Records, ReplayError> {
    let records = Records::read(files)?;
    if records.setup.is_none() {
        let file = files.first().map_or(String::new(), |file| file.display().to_string());
        return Err(ReplayError::NoSetup { file });
    }
    Ok(records)
}

/// Makes every decision again.
///
/// # Errors
/// What was recorded is not enough to begin. What is missing later on is part of the report.
pub fn replay(records: &Records, knowledge: &Knowledge) -> Result<ReplayReport, ReplayError> {
    let Some(setup) = &records.setup else { return Err(ReplayError::NoSetup { file: String::new() }) };
    let machine = MachineSetup::read(setup)?;
    Instructions::find(machine.config.controller.isa)?;
    let level = CvarLevel::new(setup.alpha).map_err(|_| ReplayError::Field {
        what: "alpha",
        expected: "a level in (0, 1]",
        found: setup.alpha.to_string(),
    })?;
    let seed = setup.seed.parse().map_err(|_| ReplayError::Field {
        what: "seed",
        expected: "a whole number",
        found: setup.seed.clone(),
    })?;
    let mut maps = Maps::new(records, &machine, knowledge, level)?;
    let mut report = ReplayReport { ended_early: records.ended_early.clone(), ..ReplayReport::default() };
    report.n_decisions = records.decisions.len() as u64;
    let mut life: Option<Life<'_>> = None;
    for (key, record) in &records.decisions {
        let goes_on = life.as_ref().is_some_and(|life| life.epoch_ns == key.epoch_ns);
        if !goes_on {
            let ages = PilotAges { learned_ns: setup.ages.learned_ns, mission_ns: setup.ages.mission_ns };
            let pilot = Pilot::new(machine.model.clone(), &machine.config, seed)?.with_ages(ages);
            life = Some(Life {
                epoch_ns: key.epoch_ns,
                pilot: match &knowledge.corrector {
                    Some(checkpoint) => pilot.with_corrector(checkpoint)?,
                    None => pilot,
                },
                choice: Choice::new(&records.risks, &records.tracks, setup.ages.learned_ns, key.epoch_ns),
                is_lost: false,
            });
        }
        let Some(life) = &mut life else { continue };
        life.decide(record, records, &mut maps, &mut report)?;
    }
    let (missing, localisation) = maps.finish()?;
    (report.n_surfaces, report.n_risk_maps) = maps.n_made();
    report.missing.extend(missing);
    report.contradictions.extend(localisation.contradictions);
    (report.n_localised, report.n_unverified) = (localisation.n_verified, localisation.n_unverified);
    report.unverified = localisation.unverified;
    Ok(report)
}

/// How a decision that was made again differs: in what went to the vehicle, or in how that was corrected.
fn difference_of(recorded: &DecisionRecord, made: &DecisionRecord) -> Option<String> {
    if bytemuck::bytes_of(&made.command) != bytemuck::bytes_of(&recorded.command) {
        return Some(format!("recorded {:?}, made again {:?}", recorded.command, made.command));
    }
    let correction = |record: &DecisionRecord| {
        let numbers = [record.correction_share, record.curvature_change_per_m, record.planned_steering_rad];
        (record.correction, numbers.map(f32::to_bits))
    };
    let told = |record: &DecisionRecord| {
        let DecisionRecord { correction, curvature_change_per_m, planned_steering_rad, .. } = *record;
        format!("{curvature_change_per_m} 1/m on {planned_steering_rad} rad, effect {correction}")
    };
    (correction(recorded) != correction(made))
        .then(|| format!("correction recorded as {}, made again as {}", told(recorded), told(made)))
}

/// One life of the control process.
struct Life<'a> {
    epoch_ns: u64,
    pilot: Pilot,
    choice: Choice<'a>,
    /// Something that a decision was made from is missing: what its memory holds from then on is not known.
    is_lost: bool,
}

impl Life<'_> {
    fn decide(
        &mut self,
        record: &DecisionRecord,
        records: &Records,
        maps: &mut Maps<'_>,
        report: &mut ReplayReport,
    ) -> Result<(), ReplayError> {
        if let Err(why) = self.choice.check(record) {
            report.contradictions.push(format!("decision {}: {why}", record.cycle));
        }
        for missing in [self.take_odometry(record, records), self.take_imu(record, records)] {
            missing.into_iter().for_each(|missing| self.lose(missing, report));
        }
        let map = if record.risk == Source::default() { None } else { Some(maps.risk(record)?) };
        let made = match &map {
            None => None,
            Some(Err(Unmade { what })) => {
                self.lose(what.clone(), report);
                None
            }
            Some(Ok(made)) => match made.as_ref() {
                Ok(made) => Some(made),
                Err(Unmade { what }) => {
                    self.lose(what.clone(), report);
                    None
                }
            },
        };
        match records.mission(record.mission) {
            Ok(mission) => mission.iter().for_each(|mission| self.pilot.hear_mission(mission)),
            Err(missing) => self.lose(missing, report),
        }
        match records.tracks(record.tracks) {
            Ok(tracks) => tracks.iter().for_each(|tracks| self.pilot.hear_tracks(tracks)),
            Err(missing) => self.lose(missing, report),
        }
        if self.is_lost {
            report.n_unmade += 1;
            return Ok(());
        }
        // The one that was used: which of the two it had to be is judged by the choice.
        let map = made.map(|made| risk_message(&made.header, &made.payload));
        let maps = match record.map_source {
            PHYSICS => RiskMessages { learned: None, physics: map },
            _ => RiskMessages { learned: map, physics: None },
        };
        self.pilot.use_rollouts(record.n_rollouts as usize);
        // A stuck pose was told to learning by a message of its own, which was recorded.
        let made = decision_record(&self.pilot.answer(record.decided_at_ns, &maps));
        report.n_corrections += u64::from(record.correction > 0);
        match difference_of(record, &made) {
            None => report.n_identical += 1,
            Some(difference) => {
                let told = || format!("decision {}: {difference}", record.cycle);
                report.first_difference.get_or_insert_with(told);
            }
        }
        Ok(())
    }

    /// Shows the corrector what control took in of the inertial measurement unit; says what of it is missing.
    fn take_imu(&mut self, record: &DecisionRecord, records: &Records) -> Option<String> {
        let Source { epoch_ns, sequence } = record.imu;
        for sequence in sequence.checked_add(1)?.saturating_sub(record.n_imu)..=sequence {
            let key = Key { epoch_ns, sequence };
            let Some(samples) = records.imu.get(&key) else {
                return Some(format!("message {sequence} of the IMU"));
            };
            let id = MessageId { epoch_ns, sequence };
            self.pilot.hear_imu(id, samples.iter().map(ImuSample::from));
        }
        None
    }

    /// Shows the pilot the odometry that control took in for a decision; says what of it is missing.
    fn take_odometry(&mut self, record: &DecisionRecord, records: &Records) -> Option<String> {
        if record.cycle != self.pilot.cycle() {
            return Some(format!("decisions {} to {}", self.pilot.cycle(), record.cycle));
        }
        let Source { epoch_ns, sequence } = record.odometry;
        let first = sequence.checked_add(1).and_then(|next| next.checked_sub(record.n_odometry));
        let Some(first) = first.filter(|&first| first > 0 || record.n_odometry == 0) else {
            return Some(format!("odometry of before {sequence}, of another life of its publisher"));
        };
        for sequence in first..=sequence {
            let Some((stamp, odometry)) = records.odometry.get(&Key { epoch_ns, sequence }) else {
                return Some(format!("odometry {sequence}"));
            };
            self.pilot.hear_odometry(&odometry_message(stamp, odometry));
        }
        None
    }

    fn lose(&mut self, missing: String, report: &mut ReplayReport) {
        if !std::mem::replace(&mut self.is_lost, true) {
            report.missing.push(missing);
        }
    }
}
