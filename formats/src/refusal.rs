//! What is wrong with a part of a file.

use std::path::Path;

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

/// A file of arrays that cannot be used. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum ArrayFileError {
    /// The file could not be read.
    #[error("{file}: expected a readable file, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A part of the file is wrong.
    #[error("{file}: {field}: expected {expected}, found {found}")]
    Field {
        /// Path as given.
        file: String,
        /// The array.
        field: String,
        /// What would do.
        expected: String,
        /// What was there.
        found: String,
    },
}

impl ArrayFileError {
    /// The bytes of a file and its name for messages.
    pub(crate) fn read(path: &Path) -> Result<(String, Vec<u8>), Self> {
        let file = path.display().to_string();
        match std::fs::read(path) {
            Ok(bytes) => Ok((file, bytes)),
            Err(source) => Err(Self::Unreadable { file, source }),
        }
    }

    /// What is wrong, with the name of the file.
    pub(crate) fn refused(file: &str, Refusal { field, expected, found }: Refusal) -> Self {
        Self::Field { file: file.to_owned(), field, expected, found }
    }
}
