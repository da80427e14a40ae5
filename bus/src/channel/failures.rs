//! What goes wrong in the transport itself: it would only write it into its log.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::port::{DegradationAction, DegradationCause, DegradationInfo};

/// Counts failures of one end of a channel; clones count together.
#[derive(Clone, Debug, Default)]
pub(super) struct Failures(Arc<AtomicU64>);

impl Failures {
    /// Failures so far.
    pub fn n(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Counts some more.
    pub fn note(&self, n: u64) {
        self.0.fetch_add(n, Ordering::Relaxed);
    }

    /// Counts, and lets everything else go on: that one peer cannot be reached must not silence the others.
    pub fn handler(
        &self,
    ) -> impl Fn(DegradationCause, &DegradationInfo) -> DegradationAction + Send + 'static {
        let failures = self.clone();
        move |_, _| {
            failures.note(1);
            DegradationAction::Ignore
        }
    }
}
