//! The messages of a recording, each under its name.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytemuck::AnyBitPattern;
use evidential::Checkpoint;

use crate::channel::Header;
use crate::message::{
    CheckpointHeader, DecisionRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Source, Stamp,
    StuckRecord, SurfaceHeader,
};
use crate::online::hash_of;
use crate::recorder::topic;
use crate::setup::RecordedSetup;

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
#[derive(Debug, Default)]
pub struct Records {
    /// What was run.
    pub setup: Option<RecordedSetup>,
    /// Odometry.
    pub odometry: BTreeMap<Key, (Stamp, OdometryRecord)>,
    /// Scans.
    pub scans: BTreeMap<Key, (ScanHeader, Vec<PointRecord>)>,
    /// Headers of the maps of the ground.
    pub surfaces: BTreeMap<Key, SurfaceHeader>,
    /// Headers of the risk maps: learned, physics.
    pub risks: [BTreeMap<Key, RiskHeader>; 2],
    /// Stuck poses.
    pub stuck: BTreeMap<Key, (Stamp, StuckRecord)>,
    /// Decisions.
    pub decisions: BTreeMap<Key, DecisionRecord>,
    /// Networks that were learned while driving, by [`RiskHeader::checkpoint`].
    pub checkpoints: BTreeMap<u64, Arc<Checkpoint>>,
    /// Why reading ended early, if it did.
    pub ended_early: Option<String>,
}

/// A recording that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{file}: expected a readable file, found: {source}")]
pub struct ReadError {
    /// Path as given.
    pub file: String,
    /// What the system said.
    pub source: std::io::Error,
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

    fn read_file(&mut self, path: &Path) -> Result<(), ReadError> {
        let file = path.display().to_string();
        let messages = formats::open_recording(path);
        for message in messages.map_err(|source| ReadError { file: file.clone(), source })? {
            match message {
                Ok(message) => {
                    if self.take(&message.channel.topic, &message.data).is_none() {
                        let topic = &message.channel.topic;
                        self.ended_early = Some(format!("{file}: a message on {topic} that is none"));
                        break;
                    }
                }
                Err(error) => {
                    self.ended_early = Some(format!("{file}: {error}"));
                    break;
                }
            }
        }
        Ok(())
    }

    /// `None` for bytes that are no message of the topic.
    fn take(&mut self, name: &str, bytes: &[u8]) -> Option<()> {
        match name {
            topic::SETUP => self.setup = serde_json::from_slice(bytes).ok(),
            topic::ODOMETRY => put(&mut self.odometry, one(bytes)?),
            topic::STUCK => put(&mut self.stuck, one(bytes)?),
            topic::DECISION => {
                let (stamp, decision): (Stamp, DecisionRecord) = one(bytes)?;
                self.decisions.insert(stamp.source().into(), decision);
            }
            topic::SCAN => {
                let (header, points): (ScanHeader, Vec<PointRecord>) = split(bytes)?;
                self.scans.insert(header.stamp.source().into(), (header, points));
            }
            topic::SURFACE => {
                let (header, _): (SurfaceHeader, Vec<u8>) = split(bytes)?;
                self.surfaces.insert(header.stamp.source().into(), header);
            }
            topic::CHECKPOINT => {
                let (header, bytes): (CheckpointHeader, Vec<u8>) = split(bytes)?;
                if let Entry::Vacant(place) = self.checkpoints.entry(header.checkpoint) {
                    let (weights, sidecar) = bytes.split_at_checked(header.n_weight_bytes as usize)?;
                    let checkpoint = Checkpoint::from_bytes(weights, sidecar).ok()?;
                    // What it calls itself must be what it is.
                    if hash_of(&checkpoint).ok()? != header.checkpoint {
                        return None;
                    }
                    place.insert(Arc::new(checkpoint));
                }
            }
            topic::RISK | topic::RISK_PHYSICS => {
                let (header, _): (RiskHeader, Vec<u8>) = split(bytes)?;
                let author = usize::from(name == topic::RISK_PHYSICS);
                self.risks[author].insert(header.stamp.source().into(), header);
            }
            _ => {}
        }
        Some(())
    }
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

fn split<H: Header, T: AnyBitPattern>(bytes: &[u8]) -> Option<(H, Vec<T>)> {
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

    #[test]
    fn messages_are_read_back_as_they_were_and_garbage_is_none() {
        let stamp = Stamp { epoch_ns: 7, sequence: 3, ..Stamp::default() };
        let odometry = OdometryRecord { yaw_rate_radps: 0.5, ..OdometryRecord::default() };
        let mut bytes = bytemuck::bytes_of(&stamp).to_vec();
        bytes.extend(bytemuck::bytes_of(&odometry));
        let mut records = Records::default();
        assert_eq!(records.take(topic::ODOMETRY, &bytes), Some(()));
        assert_eq!(records.odometry[&Key { epoch_ns: 7, sequence: 3 }], (stamp, odometry));
        assert_eq!(records.take(topic::ODOMETRY, &bytes[1..]), None);
        assert_eq!(records.take(topic::SCAN, &bytes[..9]), None);
        assert_eq!(records.take("/pose", b"anything"), Some(()), "other topics are for people");
    }
}
