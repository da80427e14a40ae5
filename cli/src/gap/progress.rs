//! How far a diagnosis has come, for a person at a terminal; silence for everyone else.

use std::time::Duration;

use indicatif::ProgressBar;

use crate::progress;

/// A bar counts whole numbers.
const FULL: u64 = 1000;

/// A bar on standard error.
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Of the calibration on nominal drives.
    pub(super) fn calibration() -> Self {
        Self::new("calibrating on the nominal drives, once per vehicle")
    }

    /// Of the search for the cause, whose length is not known.
    pub(super) fn search() -> Self {
        Self::new("looking for the cause")
    }

    /// Of the user's own simulator, whose number of runs is not known.
    pub(super) fn simulator() -> Self {
        Self::new("starting the simulator")
    }

    fn new(message: &'static str) -> Self {
        let bar = progress::bar(FULL, "{spinner} {msg}");
        bar.set_message(message);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    /// Shows a share from 0 to 1.
    pub(super) fn reached(&self, share: f64) {
        self.bar.set_position((share.clamp(0.0, 1.0) * FULL as f64) as u64);
    }

    /// Says what is being done.
    pub(super) fn told(&self, message: String) {
        self.bar.set_message(message);
    }

    /// Takes the bar away.
    pub(super) fn finish(self) {
        self.bar.finish_and_clear();
    }
}
