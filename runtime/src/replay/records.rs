//! The messages of a recording, each under its name.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytemuck::AnyBitPattern;
use evidential::Checkpoint;
use navigator::{MissionMessage, TracksMessage};

use crate::convert::{mission_message, tracks_message};
use crate::recorder::topic;
use crate::setup::RecordedSetup;
use bus::channel::Header;
use bus::message::{
    CheckpointHeader, DecisionRecord, ImuRecord, LAYOUT_VERSION, MissionRecord, OdometryRecord, PointRecord,
    RiskHeader, ScanHeader, Source, Stamp, StuckRecord, SurfaceHeader, TrackRecord, TracksHeader,
};

/// A message, by its publisher's life and its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key {
    /// When its publisher began [ns].
    pub epoch_ns: u64,
    /// Its number.
    pub sequence: u64,
}

impl From<Source> for Key {
    fn from(Source { epoch_ns, sequence }: Source) -> Self {
        Self { epoch_ns, sequence }
    }
}

/// The messages that decisions are made from.
#[derive(Clone, Debug, Default)]
pub struct Records {
    /// What was run.
    pub setup: Option<RecordedSetup>,
    /// Odometry.
    pub odometry: BTreeMap<Key, (Stamp, OdometryRecord)>,
    /// What the inertial measurement unit measured.
    pub imu: BTreeMap<Key, Vec<ImuRecord>>,
    /// Scans.
    pub scans: BTreeMap<Key, (ScanHeader, Vec<PointRecord>)>,
    /// Headers of the maps of the ground.
    pub surfaces: BTreeMap<Key, SurfaceHeader>,
    /// What moved.
    pub tracks: BTreeMap<Key, (TracksHeader, Vec<TrackRecord>)>,
    /// Headers of the risk maps: learned, physics.
    pub risks: [BTreeMap<Key, RiskHeader>; 2],
    /// Stuck poses.
    pub stuck: BTreeMap<Key, (Stamp, StuckRecord)>,
    /// What was said of where to go.
    pub missions: BTreeMap<Key, (Stamp, MissionRecord)>,
    /// Decisions.
    pub decisions: BTreeMap<Key, DecisionRecord>,
    /// Networks that were learned while driving, by [`RiskHeader::checkpoint`].
    pub checkpoints: BTreeMap<u64, Arc<Checkpoint>>,
    /// Why reading ended early, if it did.
    pub ended_early: Option<String>,
}

/// A recording that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be opened.
    #[error("{file}: expected a readable file, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It was made by another version of the program, whose numbers mean something else.
    #[error(
        "{file}: expected {what} of version {expected}, found version {found}; replay it with the program that made it"
    )]
    Version {
        /// Path as given.
        file: String,
        /// What is of another version: the recording, or the messages of a topic.
        what: String,
        /// The version that this program reads.
        expected: u32,
        /// The version that is there.
        found: u32,
    },
    /// Its setup is none.
    #[error("{file}: expected the setup of a recording, found: {problem}")]
    Setup {
        /// Path as given.
        file: String,
        /// What the reader said.
        problem: String,
    },
    /// It is of another run than the files before it.
    #[error("{file}: expected a file of the same run as those before it, found another setup")]
    OtherRun {
        /// Path as given.
        file: String,
    },
}

/// Why a message is not taken.
#[derive(Debug, PartialEq)]
enum Untaken {
    /// It is none: the recording breaks off here.
    Broken,
    /// It is of another version.
    Version { what: String, expected: u32, found: u32 },
    /// It is a setup that this program does not know.
    Setup(String),
    /// It is the setup of another run.
    OtherRun,
}

impl Untaken {
    /// As the error of a file; `None` for what is only its end.
    fn into_error(self, file: &str) -> Option<ReadError> {
        let file = file.to_owned();
        match self {
            Self::Broken => None,
            Self::Version { what, expected, found } => {
                Some(ReadError::Version { file, what, expected, found })
            }
            Self::Setup(problem) => Some(ReadError::Setup { file, problem }),
            Self::OtherRun => Some(ReadError::OtherRun { file }),
        }
    }
}

impl Records {
    /// Reads files that follow one another. One that breaks off gives what stands before that place, and it is said.
    pub fn read(files: &[PathBuf]) -> Result<Self, ReadError> {
        let mut records = Self::default();
        for path in files {
            records.read_file(path)?;
        }
        Ok(records)
    }

    /// What a decision knew of where to go, if anything; says which message is missing.
    pub fn mission(&self, source: Source) -> Result<Option<MissionMessage>, String> {
        if source == Source::default() {
            return Ok(None);
        }
        let known = self.missions.get(&source.into());
        let (stamp, record) = known.ok_or_else(|| format!("mission {}", source.sequence))?;
        Ok(Some(mission_message(stamp, record)))
    }

    /// What a decision knew of what moves, if anything; says which message is missing.
    pub fn tracks(&self, source: Source) -> Result<Option<TracksMessage>, String> {
        if source == Source::default() {
            return Ok(None);
        }
        let known = self.tracks.get(&source.into());
        let (header, tracks) = known.ok_or_else(|| format!("tracks {}", source.sequence))?;
        Ok(Some(tracks_message(header, tracks)))
    }

    fn read_file(&mut self, path: &Path) -> Result<(), ReadError> {
        let file = path.display().to_string();
        let unreadable = |source| ReadError::Unreadable { file: file.clone(), source };
        let messages = formats::open_recording(path).map_err(unreadable)?;
        let mut untaken = None;
        let problem = messages.take_all(|message| {
            let topic = &message.channel.topic;
            self.take(topic, &message.data).map_err(|refused| {
                untaken = Some(refused);
                format!("a message on {topic} that is none")
            })
        });
        if let Some(problem) = problem {
            self.ended_early = Some(format!("{file}: {problem}"));
        }
        untaken.and_then(|untaken| untaken.into_error(&file)).map_or(Ok(()), Err)
    }

    fn take(&mut self, name: &str, bytes: &[u8]) -> Result<(), Untaken> {
        if name == topic::SETUP {
            return self.take_setup(bytes);
        }
        if !name.starts_with(topic::CHANNELS) {
            return Ok(());
        }
        let stamp = recorded_stamp(bytes).ok_or(Untaken::Broken)?;
        require_version(|| format!("messages on {name}"), LAYOUT_VERSION, stamp.layout_version)?;
        self.take_message(name, bytes).ok_or(Untaken::Broken)
    }

    /// It comes first in a file, before anything that is of its version.
    fn take_setup(&mut self, bytes: &[u8]) -> Result<(), Untaken> {
        let found = RecordedSetup::format_of(bytes).ok_or(Untaken::Broken)?;
        require_version(|| "a recording".to_owned(), RecordedSetup::FORMAT, found)?;
        let setup: RecordedSetup =
            serde_json::from_slice(bytes).map_err(|error| Untaken::Setup(error.to_string()))?;
        if self.setup.as_ref().is_some_and(|before| !before.is_of_same_run(&setup)) {
            return Err(Untaken::OtherRun);
        }
        self.setup.get_or_insert(setup);
        Ok(())
    }

    /// `None` for bytes that are no message of the topic.
    fn take_message(&mut self, name: &str, bytes: &[u8]) -> Option<()> {
        match name {
            topic::ODOMETRY => put(&mut self.odometry, one(bytes)?),
            topic::STUCK => put(&mut self.stuck, one(bytes)?),
            topic::MISSION => put(&mut self.missions, one(bytes)?),
            topic::DECISION => {
                let (stamp, decision): (Stamp, DecisionRecord) = one(bytes)?;
                self.decisions.insert(stamp.source().into(), decision);
            }
            topic::IMU => {
                let (stamp, samples): (Stamp, Vec<ImuRecord>) = recorded_message(bytes)?;
                self.imu.insert(stamp.source().into(), samples);
            }
            topic::SCAN => {
                let (header, points): (ScanHeader, Vec<PointRecord>) = recorded_message(bytes)?;
                self.scans.insert(header.stamp.source().into(), (header, points));
            }
            topic::TRACKS => {
                let (header, tracks): (TracksHeader, Vec<TrackRecord>) = recorded_message(bytes)?;
                self.tracks.insert(header.stamp.source().into(), (header, tracks));
            }
            topic::SURFACE => {
                let (header, _): (SurfaceHeader, Vec<u8>) = recorded_message(bytes)?;
                self.surfaces.insert(header.stamp.source().into(), header);
            }
            topic::CHECKPOINT => {
                let (header, bytes): (CheckpointHeader, Vec<u8>) = recorded_message(bytes)?;
                if let Entry::Vacant(place) = self.checkpoints.entry(header.checkpoint) {
                    let (weights, sidecar) = bytes.split_at_checked(header.n_weight_bytes as usize)?;
                    let checkpoint = Checkpoint::from_bytes(weights, sidecar).ok()?;
                    // What it calls itself must be what it is.
                    if checkpoint.digest().ok()?.short() != header.checkpoint {
                        return None;
                    }
                    place.insert(Arc::new(checkpoint));
                }
            }
            topic::RISK | topic::RISK_PHYSICS => {
                let (header, _): (RiskHeader, Vec<u8>) = recorded_message(bytes)?;
                let place = usize::from(name == topic::RISK_PHYSICS);
                self.risks[place].insert(header.stamp.source().into(), header);
            }
            _ => {}
        }
        Some(())
    }
}

/// Refuses what is of another version.
fn require_version(what: impl FnOnce() -> String, expected: u32, found: u32) -> Result<(), Untaken> {
    if expected == found { Ok(()) } else { Err(Untaken::Version { what: what(), expected, found }) }
}

fn put<T>(records: &mut BTreeMap<Key, (Stamp, T)>, (stamp, record): (Stamp, T)) {
    records.insert(stamp.source().into(), (stamp, record));
}

/// A decision as it stands in a recording under [`topic::DECISION`]; `None` for other bytes.
pub fn recorded_decision(bytes: &[u8]) -> Option<(Stamp, DecisionRecord)> {
    one(bytes)
}

/// Whose a message of a recording is and of when, under any topic of a channel; `None` for other bytes.
pub fn recorded_stamp(bytes: &[u8]) -> Option<Stamp> {
    bytemuck::try_pod_read_unaligned(bytes.get(..size_of::<Stamp>())?).ok()
}

fn one<T: AnyBitPattern>(bytes: &[u8]) -> Option<(Stamp, T)> {
    let (stamp, rest) = bytes.split_at_checked(size_of::<Stamp>())?;
    let record = bytemuck::try_pod_read_unaligned(rest).ok()?;
    Some((bytemuck::try_pod_read_unaligned(stamp).ok()?, record))
}

/// Header and elements of a message of a recording, under any topic of a channel; `None` for other bytes.
pub fn recorded_message<H: Header, T: AnyBitPattern>(bytes: &[u8]) -> Option<(H, Vec<T>)> {
    let (header, rest) = bytes.split_at_checked(size_of::<H>())?;
    if !rest.len().is_multiple_of(size_of::<T>()) {
        return None;
    }
    let records = rest.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect();
    Some((bytemuck::try_pod_read_unaligned(header).ok()?, records))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ages::{self, AskedAges};
    use bus::ages::Periods;
    use navigator::GuardConfig;

    fn message(stamp: &Stamp, record: &OdometryRecord) -> Vec<u8> {
        [bytemuck::bytes_of(stamp), bytemuck::bytes_of(record)].concat()
    }

    #[test]
    fn messages_are_read_back_as_they_were_and_garbage_is_none() {
        let stamp = Stamp { layout_version: LAYOUT_VERSION, epoch_ns: 7, sequence: 3, ..Stamp::default() };
        let odometry = OdometryRecord { yaw_rate_radps: 0.5, ..OdometryRecord::default() };
        let bytes = message(&stamp, &odometry);
        let mut records = Records::default();
        assert_eq!(records.take(topic::ODOMETRY, &bytes), Ok(()));
        assert_eq!(records.odometry[&Key { epoch_ns: 7, sequence: 3 }], (stamp, odometry));
        assert_eq!(records.take(topic::ODOMETRY, &bytes[..bytes.len() - 1]), Err(Untaken::Broken));
        assert_eq!(records.take(topic::SCAN, &bytes[..9]), Err(Untaken::Broken));
        assert_eq!(records.take("/pose", b"anything"), Ok(()), "other topics are for people");
    }

    #[test]
    fn messages_of_another_layout_are_refused_with_both_versions() {
        for found in [0, LAYOUT_VERSION - 1, LAYOUT_VERSION + 1] {
            let stamp = Stamp { layout_version: found, sequence: 1, ..Stamp::default() };
            let mut records = Records::default();
            let untaken =
                records.take(topic::ODOMETRY, &message(&stamp, &OdometryRecord::default())).unwrap_err();
            let told = untaken.into_error("drive-000.mcap").unwrap().to_string();
            let expected = format!(
                "drive-000.mcap: expected messages on /channel/odometry of version {LAYOUT_VERSION}, found version \
                 {found}; replay it with the program that made it"
            );
            assert_eq!(told, expected);
            assert!(records.odometry.is_empty());
        }
    }

    #[test]
    fn setups_of_another_version_or_run_are_refused() {
        let setup = RecordedSetup {
            format: RecordedSetup::FORMAT,
            clock: crate::setup::ClockAnchor::now(),
            vehicle_name: "rc_car".to_owned(),
            vehicle_toml: String::new(),
            model_toml: String::new(),
            config_toml: String::new(),
            ages: ages::limits(&Periods::default(), &GuardConfig::default(), &AskedAges::default()).unwrap(),
            method: "physics".to_owned(),
            checkpoint_sha256: String::new(),
            corrector_sha256: String::new(),
            alpha: 0.6,
            seed: "1".to_owned(),
            revision: String::new(),
        };
        let mut records = Records::default();
        let mut json = serde_json::to_value(&setup).unwrap();
        let take = |records: &mut Records, json: &serde_json::Value| {
            records.take(topic::SETUP, &serde_json::to_vec(json).unwrap())
        };
        assert_eq!(take(&mut records, &json), Ok(()));
        json["clock"]["utc_ns"] = "1".into();
        assert_eq!(take(&mut records, &json), Ok(()), "every file has its own moment");
        json["alpha"] = 0.7.into();
        assert_eq!(take(&mut records, &json), Err(Untaken::OtherRun));
        // As it was before there were versions: without one, and without the clocks.
        let mut first = json.clone();
        let fields = first.as_object_mut().unwrap();
        fields.remove("format");
        fields.remove("clock");
        let told =
            take(&mut Records::default(), &first).unwrap_err().into_error("old.mcap").unwrap().to_string();
        let expected = format!("expected a recording of version {}, found version 1", RecordedSetup::FORMAT);
        assert!(told.starts_with("old.mcap: ") && told.contains(&expected), "{told}");
        json["surplus"] = 1.into();
        let told =
            take(&mut Records::default(), &json).unwrap_err().into_error("odd.mcap").unwrap().to_string();
        assert!(told.contains("surplus"), "{told}");
    }
}
