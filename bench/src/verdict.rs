//! Rules that were fixed before anything was driven or trained.

use serde::Serialize;

/// One rule, and whether it holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// What shall hold.
    pub rule: String,
    /// What was found.
    pub found: String,
    /// Whether it holds. What was not measured does not.
    pub is_passed: bool,
}
