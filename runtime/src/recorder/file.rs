//! Files that follow one another: none grows without end, all together neither, and a crash costs little.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use formats::{DriveRecorder, RecordError};

use super::RecorderSetup;
use crate::RuntimeError;
use crate::setup::ClockAnchor;
use bus::clock::{self, SECOND_NS};

/// Longest stretch that a crash of the recorder may cost, less what flushing itself takes [ns].
const FLUSH_NS: u64 = SECOND_NS * 4 / 10;

/// A recording in files `drive-000.mcap`, `drive-001.mcap`, ...
pub(super) struct RotatingFile {
    setup: RecorderSetup,
    recorder: DriveRecorder,
    path: PathBuf,
    number: u32,
    began_ns: u64,
    flushed_at_ns: u64,
    synced_at_ns: u64,
    /// Of recordings that were there before.
    bytes_found: u64,
    bytes_before: u64,
    bytes_now: u64,
    /// The file before this one, until it is on the disk.
    closing: Option<JoinHandle<Result<(), RecordError>>>,
}

impl RotatingFile {
    /// Begins the first file whose name is free: what an earlier process recorded stays.
    ///
    /// # Errors
    /// [`RuntimeError::Quota`] when that is as much already as all may be.
    pub fn create(setup: RecorderSetup, now_ns: u64) -> Result<Self, RuntimeError> {
        let bytes_found = recorded_bytes(&setup.folder);
        check_quota(&setup, bytes_found)?;
        let (recorder, path, number) = begin(&setup, now_ns, 0)?;
        Ok(Self {
            setup,
            recorder,
            path,
            number,
            began_ns: now_ns,
            flushed_at_ns: now_ns,
            synced_at_ns: now_ns,
            bytes_found,
            bytes_before: 0,
            bytes_now: 0,
            closing: None,
        })
    }

    /// The recorder of the present file.
    pub fn recorder(&mut self) -> &mut DriveRecorder {
        &mut self.recorder
    }

    /// Bytes written so far.
    pub fn bytes(&self) -> u64 {
        self.bytes_before + self.bytes_now
    }

    /// Flushes, asks for the disk, and goes on to the next file, when it is time.
    ///
    /// # Errors
    /// Something could not be written, or the quota is reached.
    pub fn tend(&mut self, now_ns: u64) -> Result<(), RuntimeError> {
        if now_ns.saturating_sub(self.flushed_at_ns) < FLUSH_NS {
            return Ok(());
        }
        self.flushed_at_ns = now_ns;
        if clock::age_s(now_ns, self.synced_at_ns) >= self.setup.sync_interval_s {
            self.synced_at_ns = now_ns;
            self.recorder.sync()?;
        } else {
            self.recorder.flush()?;
        }
        if self.closing.as_ref().is_some_and(JoinHandle::is_finished) {
            self.wait_for_last()?;
        }
        self.bytes_now = std::fs::metadata(&self.path).map_or(self.bytes_now, |file| file.len());
        check_quota(&self.setup, self.bytes_found + self.bytes())?;
        let is_full = self.bytes_now >= self.setup.file_bytes_max
            || clock::age_s(now_ns, self.began_ns) >= self.setup.file_time_max_s;
        if is_full { self.go_on(now_ns) } else { Ok(()) }
    }

    /// Completes the last file.
    pub fn finish(mut self) -> Result<(), RuntimeError> {
        self.wait_for_last()?;
        Ok(self.recorder.finish()?)
    }

    /// Begins the next file. The last one is completed on a thread of its own: the channels do not wait for a disk.
    fn go_on(&mut self, now_ns: u64) -> Result<(), RuntimeError> {
        let (next, path, number) = begin(&self.setup, now_ns, self.number + 1)?;
        let last = std::mem::replace(&mut self.recorder, next);
        self.bytes_before += std::mem::take(&mut self.bytes_now);
        (self.path, self.number, self.began_ns) = (path, number, now_ns);
        self.wait_for_last()?;
        self.closing = Some(std::thread::spawn(move || last.finish()));
        Ok(())
    }

    fn wait_for_last(&mut self) -> Result<(), RuntimeError> {
        let ended = self.closing.take().map(JoinHandle::join);
        // A panic on that thread was told by it; what it leaves is a file without an end.
        ended.map_or(Ok(()), |ended| ended.unwrap_or(Ok(()))).map_err(RuntimeError::from)
    }
}

/// The next file whose name is free, from this number on.
fn begin(
    setup: &RecorderSetup,
    now_ns: u64,
    first: u32,
) -> Result<(DriveRecorder, PathBuf, u32), RuntimeError> {
    let clock = ClockAnchor::now();
    let about = BTreeMap::from([
        ("vehicle".to_owned(), setup.setup.vehicle_name.clone()),
        ("clock_monotonic_ns".to_owned(), clock.monotonic_ns.clone()),
        ("clock_utc_ns".to_owned(), clock.utc_ns.clone()),
    ]);
    let mut number = first;
    let (mut recorder, path) = loop {
        let path = setup.folder.join(format!("drive-{number:03}.mcap"));
        match DriveRecorder::create_new(&path, about.clone()) {
            Err(RecordError::Exists { .. }) if number < u32::MAX => number += 1,
            made => break (made?, path),
        }
    };
    recorder.setup(now_ns, &crate::setup::RecordedSetup { clock, ..setup.setup.clone() })?;
    recorder.flush()?;
    Ok((recorder, path, number))
}

/// Bytes of all recordings of a folder.
fn recorded_bytes(folder: &Path) -> u64 {
    let bytes = |file: std::fs::DirEntry| {
        let name = file.file_name();
        let is_ours = name.to_string_lossy().starts_with("drive-")
            && Path::new(&name).extension().is_some_and(|end| end == "mcap");
        file.metadata().ok().filter(|_| is_ours).map_or(0, |about| about.len())
    };
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(bytes).sum()
}

fn check_quota(setup: &RecorderSetup, found_bytes: u64) -> Result<(), RuntimeError> {
    if found_bytes < setup.quota_bytes {
        return Ok(());
    }
    Err(RuntimeError::Quota {
        folder: setup.folder.display().to_string(),
        quota_mb: setup.quota_bytes as f64 * 1e-6,
        found_mb: found_bytes as f64 * 1e-6,
    })
}
