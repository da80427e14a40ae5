//! How far drives and trainings have come: a bar on a terminal, a line where there is none.
#![allow(clippy::disallowed_methods, reason = "people are told how long the benchmark takes")]

use std::sync::OnceLock;
use std::time::Instant;

use ::bench::learning::{Request, Stage, Trained};
use ::report::learning::duration;
use indicatif::ProgressBar;

/// One kind of work.
pub(super) struct Progress {
    bar: ProgressBar,
    began: Instant,
    n_steps: usize,
    n_threads: usize,
    /// What all steps were expected to take after the first [s].
    estimated_s: OnceLock<f64>,
}

impl Progress {
    /// Counts the drives of one part after the other.
    pub fn drives(n_drives: u32) -> Self {
        Self::new(n_drives as usize, 1, "{pos}/{len} drives   {msg}")
    }

    /// Counts trainings that are done `n_threads` at a time.
    pub fn trainings(n_trainings: usize, n_threads: usize) -> Self {
        let beside = "{pos}/{len} trainings, {eta} left   {msg}";
        Self::new(n_trainings, n_threads.min(n_trainings), beside)
    }

    fn new(n_steps: usize, n_threads: usize, beside: &str) -> Self {
        let bar = crate::progress::bar(n_steps as u64, beside);
        Self { bar, began: Instant::now(), n_steps, n_threads, estimated_s: OnceLock::new() }
    }

    /// A part of the drives begins.
    pub fn stage(&self, stage: Stage, request: &Request) {
        self.bar.set_position(0);
        let told = format!("{} maps, {} trials each", request.n_maps, request.n_trials);
        self.bar.set_message(format!("{}: {told}", stage.name()));
        if self.bar.is_hidden() {
            println!("  driving for {}: {told}", stage.name());
        }
    }

    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// A training is done; after the first it can be told how long all will take.
    pub fn trained(&self, trained: &Trained) {
        self.bar.inc(1);
        self.bar.set_message(trained.planned.name());
        let rounds = self.n_steps.div_ceil(self.n_threads) as f64;
        let elapsed_s = self.began.elapsed().as_secs_f64();
        if self.estimated_s.set(rounds * elapsed_s).is_ok() {
            let told = format!(
                "  {} trainings, {} at a time: about {}",
                self.n_steps,
                self.n_threads,
                duration(rounds * elapsed_s)
            );
            self.bar.suspend(|| println!("{told}"));
        }
    }

    /// Takes the bar away; what all steps were expected to take [s].
    pub fn finish(&self) -> f64 {
        self.bar.finish_and_clear();
        self.estimated_s.get().copied().unwrap_or_default()
    }
}
