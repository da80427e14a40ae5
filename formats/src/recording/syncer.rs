//! Puts a file onto its disk beside whoever writes it: a disk may take a second for that.

use std::fs::File;
use std::io::Result;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use super::watched_file::Fault;

/// A thread that waits for the disk. Dropped, it does what it was asked to and ends.
pub(super) struct Syncer {
    requests: Option<SyncSender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Syncer {
    /// Starts the thread; what the disk says goes to `fault`.
    pub(super) fn start(file: File, fault: Fault) -> Result<Self> {
        let (requests, asked) = sync_channel(1);
        let sync = move || {
            while asked.recv().is_ok() {
                fault.note_sync(file.sync_data());
            }
        };
        let thread = Builder::new().name("surefoot-sync".to_owned()).spawn(sync)?;
        Ok(Self { requests: Some(requests), thread: Some(thread) })
    }

    /// Asks for all that was handed over to the system so far. Never waits; one request more than is at work is kept.
    pub(super) fn ask(&self) {
        if let Some(requests) = &self.requests {
            requests.try_send(()).ok();
        }
    }
}

impl Drop for Syncer {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // It does not panic; if it did, the file would be as good as without it.
            thread.join().ok();
        }
    }
}
