//! The one place of this crate that reads the clock.

use std::time::Instant;

/// Calls `work` and returns how long it took [ms], with its result.
pub(crate) fn timed_ms<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = now();
    let result = work();
    (milliseconds_since(start), result)
}

/// The present.
#[allow(clippy::disallowed_methods, reason = "a benchmark measures time")]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// Time since then [ms].
pub(crate) fn milliseconds_since(start: Instant) -> f64 {
    now().duration_since(start).as_secs_f64() * 1e3
}
