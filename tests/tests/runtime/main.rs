//! The pipeline as processes: channels, faults from outside, recordings.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::expect_used, reason = "a panic is how a test fails")]
#![allow(clippy::disallowed_methods, reason = "processes are waited for")]

mod channels;
mod corrector;
mod driver;
mod faults;
mod fixture;
mod hostile;
mod layouts;
mod localisation;
mod measurements;
mod missions;
mod onlookers;
mod pipeline;
mod recordings;
mod rewritten;
mod supervision;
mod tracks;
mod witness;

/// Not a test of its own: what the processes of the others begin with.
#[test]
fn process_of_its_own() {
    fixture::begin_as_told();
}
