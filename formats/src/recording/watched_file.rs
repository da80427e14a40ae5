//! A file that remembers its first failure: recording channels report none, and a full disk must not pass unseen.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Result, Seek, SeekFrom, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// The first failure of a file, if any, and how much of it is whole; shared with whoever asks.
#[derive(Clone, Default)]
pub(super) struct Fault(Arc<Known>);

#[derive(Default)]
struct Known {
    problem: OnceLock<String>,
    whole_bytes: AtomicU64,
}

impl Fault {
    pub(super) fn text(&self) -> Option<String> {
        self.0.problem.get().cloned()
    }

    /// Bytes that the system has taken over when it was last asked to, before anything failed: an end of whole records.
    pub(super) fn whole_bytes(&self) -> u64 {
        self.0.whole_bytes.load(Ordering::Relaxed)
    }

    /// What came of putting the file onto its disk.
    pub(super) fn note_sync(&self, result: Result<()>) {
        if let Err(error) = result {
            self.0.problem.get_or_init(|| format!("onto the disk: {error}"));
        }
    }

    fn note<T>(&self, result: Result<T>) -> Result<T> {
        if let Err(error) = &result
            && error.kind() != ErrorKind::Interrupted
        {
            self.0.problem.get_or_init(|| error.to_string());
        }
        result
    }
}

pub(super) struct WatchedFile {
    file: BufWriter<File>,
    /// Bytes written so far.
    position: u64,
    fault: Fault,
}

impl WatchedFile {
    pub(super) fn new(file: File) -> Self {
        Self { file: BufWriter::new(file), position: 0, fault: Fault::default() }
    }

    pub(super) fn fault(&self) -> Fault {
        self.fault.clone()
    }
}

impl Write for WatchedFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let n_bytes = self.fault.note(self.file.write(bytes))?;
        self.position += n_bytes as u64;
        Ok(n_bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.fault.note(self.file.flush())?;
        if self.fault.text().is_none() {
            self.fault.0.whole_bytes.store(self.position, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// Recorders ask where they are and never go elsewhere.
impl Seek for WatchedFile {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        if to == SeekFrom::Current(0) { Ok(self.position) } else { Err(ErrorKind::Unsupported.into()) }
    }
}
