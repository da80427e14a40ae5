//! What is wrong with a part of a file.

/// What is wrong with a file, before its name is known.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub field: String,
    pub expected: String,
    pub found: String,
}

impl Refusal {
    pub fn new(field: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self { field: field.to_string(), expected: expected.to_string(), found: found.to_string() }
    }
}
