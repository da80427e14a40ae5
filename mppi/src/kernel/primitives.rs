//! What [`super::workers`] is made of, in one place, so that a model checker can put its own in their stead: see `mppi/loom`.

pub(super) use std::hint::spin_loop;
pub(super) use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, Ordering};
pub(super) use std::thread::{Builder, JoinHandle, park, yield_now};

/// Looks at the work flag before a thread goes to sleep: some hundred microseconds.
pub(super) const WATCHFUL_LOOKS: u32 = 4000;
/// Looks at a chunk of another thread before it is taken over: some ten microseconds, a few chunks' work, because
/// moving a chunk from core to core costs as much as computing it.
pub(super) const PATIENT_LOOKS: u32 = 600;
