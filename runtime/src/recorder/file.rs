//! Files that follow one another: none grows without end, and a crash costs little.

use std::collections::BTreeMap;
use std::path::PathBuf;

use formats::{DriveRecorder, RecordError};

use super::RecorderSetup;
use crate::clock::{self, SECOND_NS};

/// Longest stretch that a crash may cost, less what flushing itself takes [ns].
const FLUSH_NS: u64 = SECOND_NS * 4 / 10;

/// A recording in files `drive-000.mcap`, `drive-001.mcap`, ...
pub(super) struct RotatingFile {
    setup: RecorderSetup,
    recorder: DriveRecorder,
    path: PathBuf,
    began_ns: u64,
    flushed_at_ns: u64,
    bytes_before: u64,
    bytes_now: u64,
}

impl RotatingFile {
    /// Begins the first file whose name is free: what an earlier process recorded stays.
    pub fn create(setup: RecorderSetup, now_ns: u64) -> Result<Self, RecordError> {
        let (recorder, path) = begin(&setup, now_ns)?;
        Ok(Self {
            setup,
            recorder,
            path,
            began_ns: now_ns,
            flushed_at_ns: now_ns,
            bytes_before: 0,
            bytes_now: 0,
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

    /// Flushes, and goes on to the next file, when it is time.
    pub fn tend(&mut self, now_ns: u64) -> Result<(), RecordError> {
        if now_ns.saturating_sub(self.flushed_at_ns) < FLUSH_NS {
            return Ok(());
        }
        self.flushed_at_ns = now_ns;
        self.recorder.flush()?;
        self.bytes_now = std::fs::metadata(&self.path).map_or(self.bytes_now, |file| file.len());
        let is_full = self.bytes_now >= self.setup.file_bytes_max
            || clock::age_s(now_ns, self.began_ns) >= self.setup.file_time_max_s;
        if is_full {
            let (next, path) = begin(&self.setup, now_ns)?;
            let last = std::mem::replace(&mut self.recorder, next);
            self.bytes_before += std::mem::take(&mut self.bytes_now);
            (self.path, self.began_ns) = (path, now_ns);
            last.finish()?;
        }
        Ok(())
    }

    /// Completes the last file.
    pub fn finish(self) -> Result<(), RecordError> {
        self.recorder.finish()
    }
}

fn begin(setup: &RecorderSetup, now_ns: u64) -> Result<(DriveRecorder, PathBuf), RecordError> {
    let path = |number: u32| setup.folder.join(format!("drive-{number:03}.mcap"));
    let free = (0..u32::MAX).map(path).find(|path| !path.exists());
    let path = free.unwrap_or_else(|| path(u32::MAX));
    let about = BTreeMap::from([("vehicle".to_owned(), setup.setup.vehicle_name.clone())]);
    let mut recorder = DriveRecorder::create(&path, about)?;
    recorder.setup(now_ns, &setup.setup)?;
    recorder.flush()?;
    Ok((recorder, path))
}
