//! Recordings of drives as MCAP under Foxglove's own schemas, and the drive log back out of them.

mod drive_row;
mod ending;
mod grids;
mod json;
mod messages;
mod raw;
mod read;
mod recorded;
mod scene;
mod syncer;
mod table;
mod topics;
mod watched_file;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use bicycle::{Command, Decision, DriveRow};
use foxglove::messages::Timestamp;
use foxglove::{Context, FoxgloveError, McapCompression, McapWriteOptions, McapWriterHandle};
use serde::Serialize;
use terrain::{GridMap, Pose, Scan, SurfaceCell};
use traversability::RiskMapView;

use raw::RawChannels;
use syncer::Syncer;
use watched_file::{Fault, WatchedFile};

pub use drive_row::Fields as DriveLogFields;
pub use messages::{RecordedChannel, RecordedMessage, RecordingError, RecordingMessages, open_recording};
pub use recorded::{
    RecordedRisk, read_recorded_maps, recorded_best_rollout, recorded_elevation, recorded_risk, recorded_scan,
};
pub use table::{RecordedCell, RecordedColumn, RecordedTable, json_row, read_recorded_table};
pub use topics::DriveTopics;

pub use read::{McapDriveLog, McapReadError, read_drive_log_mcap};

/// Frame of maps, poses and rollouts: x east, y north, z up.
const MAP_FRAME: &str = "map";
/// Frame of scans: the rear axle's centre, forward-left-up.
const BODY_FRAME: &str = "body";
/// Longest stretch of a drive that a crash may cost.
const FLUSH_INTERVAL_NS: u64 = 1_000_000_000;

/// A recording that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file could not be created or its first bytes not be written.
    #[error("{}: expected a place to record to, found: {problem}", path.display())]
    Create {
        /// Path as given.
        path: PathBuf,
        /// What the system said.
        problem: String,
    },
    /// There is a file already, and it was not to be written over.
    #[error("{}: expected a name that is free, found a file", path.display())]
    Exists {
        /// Path as given.
        path: PathBuf,
    },
    /// A later write failed, e.g. because the disk is full; what was written before stays readable.
    #[error("{}: the recording ends here, a write failed: {problem}", path.display())]
    Write {
        /// Path as given.
        path: PathBuf,
        /// What the system said.
        problem: String,
    },
    /// A diagnostic value has no form in JSON.
    #[error("topic {topic}: expected values that JSON can hold, found: {problem}")]
    NoJson {
        /// Topic.
        topic: &'static str,
        /// What the serialiser said.
        problem: String,
    },
}

/// Writes a drive into an MCAP file that opens in Foxglove.
///
/// It writes into the file that it is given, chunk by chunk, and flushes once per second of the drive: a process that
/// is killed leaves all but its last second, readable. Finishing, or dropping, adds the index. Times are the
/// caller's, monotonic [ns].
pub struct DriveRecorder {
    path: PathBuf,
    writer: McapWriterHandle<WatchedFile>,
    fault: Fault,
    syncer: Syncer,
    flushed_at_ns: Option<u64>,
    topics: DriveTopics,
    raw: RawChannels,
}

impl DriveRecorder {
    /// Creates the file, or empties it, and writes its head; `about` is kept in the file (seed, vehicle, revision).
    ///
    /// Errors: [`RecordError::Create`], also when the disk is full already.
    pub fn create(path: &Path, about: BTreeMap<String, String>) -> Result<Self, RecordError> {
        Self::into_file(path, File::create(path), about)
    }

    /// The same for a name that must be free. Errors: also [`RecordError::Exists`].
    pub fn create_new(path: &Path, about: BTreeMap<String, String>) -> Result<Self, RecordError> {
        match File::create_new(path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                Err(RecordError::Exists { path: path.to_owned() })
            }
            file => Self::into_file(path, file, about),
        }
    }

    fn into_file(
        path: &Path,
        file: io::Result<File>,
        about: BTreeMap<String, String>,
    ) -> Result<Self, RecordError> {
        let refused =
            |error: io::Error| RecordError::Create { path: path.to_owned(), problem: error.to_string() };
        let file = file.map_err(refused)?;
        let for_syncer = file.try_clone().map_err(refused)?;
        let file = WatchedFile::new(file);
        let fault = file.fault();
        let syncer = Syncer::start(for_syncer, fault.clone()).map_err(refused)?;
        let problem = |error: FoxgloveError| {
            let problem = fault.text().unwrap_or_else(|| error.to_string());
            RecordError::Create { path: path.to_owned(), problem }
        };
        // Without seeking, a chunk goes out in one piece once it is complete.
        let options = McapWriteOptions::new().disable_seeking(true).compression(Some(McapCompression::Lz4));
        let context = Context::new();
        let writer = context.mcap_writer_with_options(options).create(file).map_err(problem)?;
        writer.write_metadata("surefoot", about).map_err(problem)?;
        writer.flush().map_err(problem)?;
        let (topics, raw) = (DriveTopics::new(&context), RawChannels::new(context));
        Ok(Self { path: path.to_owned(), writer, fault, syncer, flushed_at_ns: None, topics, raw })
    }

    /// Where the vehicle is. Errors, here and below: [`RecordError::Write`].
    pub fn pose(&mut self, at_ns: u64, pose: &Pose) -> Result<(), RecordError> {
        self.topics.pose(at_ns, pose);
        self.wrote(at_ns)
    }

    /// Where the vehicle should go.
    pub fn goal(&mut self, at_ns: u64, pose: &Pose) -> Result<(), RecordError> {
        self.topics.goal(at_ns, pose);
        self.wrote(at_ns)
    }

    /// Where the vehicle has been.
    pub fn path(&mut self, at_ns: u64, poses: &[Pose]) -> Result<(), RecordError> {
        self.topics.path(at_ns, poses);
        self.wrote(at_ns)
    }

    /// Rolled-out futures as points of the map frame [m], best first.
    pub fn rollouts(&mut self, at_ns: u64, best_first: &[Vec<[f64; 3]>]) -> Result<(), RecordError> {
        self.topics.rollouts(at_ns, best_first);
        self.wrote(at_ns)
    }

    /// What the vehicle knows of the ground.
    pub fn elevation(&mut self, at_ns: u64, map: &GridMap<SurfaceCell>) -> Result<(), RecordError> {
        self.topics.elevation(at_ns, map);
        self.wrote(at_ns)
    }

    /// The risk map at the yaw bin that holds `yaw_rad`, usually the vehicle's.
    pub fn risk(&mut self, at_ns: u64, map: &RiskMapView<'_>, yaw_rad: f64) -> Result<(), RecordError> {
        self.topics.risk(at_ns, map, yaw_rad);
        self.wrote(at_ns)
    }

    /// A sweep of the range sensor, in the body frame.
    pub fn scan(&mut self, at_ns: u64, scan: &Scan) -> Result<(), RecordError> {
        self.topics.scan(at_ns, scan);
        self.wrote(at_ns)
    }

    /// What was asked of the vehicle.
    pub fn command(&mut self, at_ns: u64, command: &Command) -> Result<(), RecordError> {
        self.json("/command", at_ns, command)
    }

    /// What the controller decided, with its reason.
    pub fn decision(&mut self, at_ns: u64, decision: &Decision) -> Result<(), RecordError> {
        self.json("/decision", at_ns, &json::DecisionRecord::from(decision))
    }

    /// Figures of one control cycle, whatever the controller reports: every number becomes plottable under its
    /// field's name. Errors: also [`RecordError::NoJson`].
    pub fn controller(&mut self, at_ns: u64, diagnostics: &impl Serialize) -> Result<(), RecordError> {
        self.json("/controller", at_ns, diagnostics)
    }

    /// One row of the drive log, which [`read_drive_log_mcap`] finds again bit by bit.
    pub fn drive_row(&mut self, at_ns: u64, run: &str, row: &DriveRow) -> Result<(), RecordError> {
        self.topics.drive_row(at_ns, run, row);
        self.wrote(at_ns)
    }

    /// A message as it lies in memory; `layout` is what C says of it, asked for once per topic.
    pub fn raw(
        &mut self,
        topic: &'static str,
        layout: impl FnOnce() -> String,
        at_ns: u64,
        bytes: &[u8],
    ) -> Result<(), RecordError> {
        let logged = self.raw.log(topic, layout, at_ns, bytes);
        logged.map_err(|problem| self.failed(problem))?;
        self.wrote(at_ns)
    }

    /// What is needed to repeat the recorded work. Errors: also [`RecordError::NoJson`].
    pub fn setup(&mut self, at_ns: u64, setup: &impl Serialize) -> Result<(), RecordError> {
        self.json("/setup", at_ns, setup)
    }

    /// Hands over to the system what was recorded so far; a crash of this process after this costs none of it.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        self.writer.flush().map_err(|error| self.failed(error.to_string()))?;
        self.fault.text().map_or(Ok(()), |problem| Err(self.failed(problem)))
    }

    /// Flushes, and lets the system put all that onto the disk, beside further recording: once that is done, a crash of
    /// the system costs none of it. A disk that is still at it from the last time is not asked again. What it says is
    /// the error of a later call.
    pub fn sync(&mut self) -> Result<(), RecordError> {
        self.flush()?;
        self.syncer.ask();
        Ok(())
    }

    /// Writes the index, waits until all is on the disk and closes the file. One whose last writes failed is cut back to what is whole and ended there,
    /// without an index, where that much can still be written. Errors: [`RecordError::Write`].
    pub fn finish(self) -> Result<(), RecordError> {
        let Self { path, writer, fault, syncer, .. } = self;
        let problem = |problem: String| RecordError::Write { path: path.clone(), problem };
        let closed = writer.close();
        if let Some(text) = fault.text() {
            // Best effort: without an end the file still gives all that stands before.
            drop(ending::end_at(&path, fault.whole_bytes()));
            return Err(problem(text));
        }
        let mut file = closed.map_err(|error| problem(error.to_string()))?;
        file.flush().map_err(|error| problem(error.to_string()))?;
        syncer.ask();
        drop(syncer);
        fault.text().map_or(Ok(()), |text| Err(problem(text)))
    }

    fn json(&mut self, topic: &'static str, at_ns: u64, value: &impl Serialize) -> Result<(), RecordError> {
        self.topics.json(topic, at_ns, value)?;
        self.wrote(at_ns)
    }

    /// Channels swallow errors, so the file is asked; flushes when it is time.
    fn wrote(&mut self, at_ns: u64) -> Result<(), RecordError> {
        let since_ns = self.flushed_at_ns.map(|flushed_at_ns| at_ns.saturating_sub(flushed_at_ns));
        if since_ns.is_none_or(|since_ns| since_ns >= FLUSH_INTERVAL_NS) {
            self.flushed_at_ns = Some(at_ns);
            self.writer.flush().map_err(|error| self.failed(error.to_string()))?;
        }
        self.fault.text().map_or(Ok(()), |problem| Err(self.failed(problem)))
    }

    fn failed(&self, problem: String) -> RecordError {
        let problem = self.fault.text().unwrap_or(problem);
        RecordError::Write { path: self.path.clone(), problem }
    }
}

/// A caller's time as Foxglove keeps it.
fn timestamp(at_ns: u64) -> Timestamp {
    let seconds = u32::try_from(at_ns / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (at_ns % 1_000_000_000) as u32)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::fd::OwnedFd;
    use std::os::unix::net::UnixStream;

    use super::*;

    #[test]
    fn a_write_that_fails_during_the_drive_is_reported_and_stays_reported() {
        let (ours, theirs) = UnixStream::pair().unwrap();
        let file = File::from(OwnedFd::from(ours));
        let path = Path::new("drive.mcap");
        let mut recorder = DriveRecorder::into_file(path, Ok(file), BTreeMap::new()).unwrap();
        recorder.pose(0, &Pose::default()).unwrap();
        drop(theirs);
        // The next flush is due one second of the drive later.
        recorder.pose(999_999_999, &Pose::default()).unwrap();
        let message = recorder.pose(1_000_000_000, &Pose::default()).unwrap_err().to_string();
        assert!(message.starts_with("drive.mcap: the recording ends here, a write failed: Broken pipe"));
        assert!(recorder.pose(1_000_000_001, &Pose::default()).is_err());
        let message = recorder.finish().unwrap_err().to_string();
        assert!(message.contains("Broken pipe"), "the cause, not what followed from it: {message}");
    }

    /// A socket takes everything that is written and has no disk below: the system says so when it is asked to sync.
    #[test]
    #[cfg(target_os = "linux")]
    fn what_was_flushed_is_put_onto_the_disk_and_a_failure_of_that_is_reported() {
        let (ours, mut theirs) = UnixStream::pair().unwrap();
        let reader = std::thread::spawn(move || io::copy(&mut theirs, &mut io::sink()));
        let file = File::from(OwnedFd::from(ours));
        let mut recorder =
            DriveRecorder::into_file(Path::new("drive.mcap"), Ok(file), BTreeMap::new()).unwrap();
        recorder.pose(0, &Pose::default()).unwrap();
        recorder.flush().unwrap();
        recorder.sync().unwrap();
        let told = (1..10_000).find_map(|at_ns| {
            // Gives way to the thread that asks for it.
            std::thread::park_timeout(std::time::Duration::from_millis(1));
            recorder.pose(at_ns, &Pose::default()).err()
        });
        let told = told.unwrap().to_string();
        assert!(told.ends_with("a write failed: onto the disk: Invalid argument (os error 22)"), "{told}");
        drop(recorder);
        reader.join().unwrap().unwrap();
    }

    #[test]
    fn a_recording_that_is_there_is_not_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.mcap");
        DriveRecorder::create_new(&path, BTreeMap::new()).unwrap().finish().unwrap();
        let before = std::fs::read(&path).unwrap();
        let told = DriveRecorder::create_new(&path, BTreeMap::new()).err().unwrap().to_string();
        assert!(told.ends_with("drive.mcap: expected a name that is free, found a file"), "{told}");
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_said_before_the_drive() {
        let error = DriveRecorder::create(Path::new("/dev/full"), BTreeMap::new()).err().unwrap();
        let message = error.to_string();
        assert!(
            message.starts_with("/dev/full: expected a place to record to, found: No space left"),
            "{message}"
        );
    }
}
