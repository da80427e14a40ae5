//! Results of long work as they come: a file of JSON lines that outlives a kill, and from which the work goes on.
//!
//! The first line says what the work is; every further line is one result. A last line that was torn off, by a kill or
//! a full disk, is left out.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::OutputError;

/// A journal that is open for more.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

/// Why a journal cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The file could not be read.
    #[error("{}: expected a readable journal, found: {source}", path.display())]
    Unreadable {
        /// Path as given.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A line that was written to its end is no such value.
    #[error("{}:{line}: expected {expected}, found: {source}", path.display())]
    Line {
        /// Path as given.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What stands in such a line.
        expected: &'static str,
        /// What the parser said.
        source: serde_json::Error,
    },
}

/// What a journal holds.
#[derive(Clone, Debug, PartialEq)]
pub struct JournalContent<H, T> {
    /// What the work is.
    pub header: H,
    /// What came of it, in the order in which it came.
    pub results: Vec<T>,
    /// Up to here all lines are whole [bytes].
    n_whole_bytes: u64,
}

impl Journal {
    /// Begins a journal; what stood there before is replaced.
    ///
    /// # Errors
    /// The file cannot be written, or the header has no form in JSON.
    pub fn create(path: &Path, header: &impl Serialize) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(|source| unwritable(path, source))?;
        let mut journal = Self { path: path.to_owned(), file };
        journal.append(header)?;
        Ok(journal)
    }

    /// Goes on with a journal that was read; a torn last line is cut off.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn resume<H, T>(path: &Path, content: &JournalContent<H, T>) -> Result<Self, OutputError> {
        let open = || {
            let file = OpenOptions::new().append(true).open(path)?;
            file.set_len(content.n_whole_bytes)?;
            Ok(file)
        };
        let file = open().map_err(|source| unwritable(path, source))?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Adds one result, and gives it to the system before it returns: a kill loses nothing that was added.
    ///
    /// # Errors
    /// The file cannot be written, or the result has no form in JSON.
    pub fn append(&mut self, result: &impl Serialize) -> Result<(), OutputError> {
        let mut line = serde_json::to_vec(result)
            .map_err(|source| OutputError::NoJson { path: self.path.clone(), source })?;
        line.push(b'\n');
        self.file.write_all(&line).map_err(|source| unwritable(&self.path, source))
    }
}

fn unwritable(path: &Path, source: io::Error) -> OutputError {
    OutputError::File { path: path.to_owned(), source }
}

/// Reads a journal; `None` where there is no file, or one that was torn within its first line.
///
/// # Errors
/// The file cannot be read, or a whole line of it is no header or no result.
pub fn read_journal<H: DeserializeOwned, T: DeserializeOwned>(
    path: &Path,
) -> Result<Option<JournalContent<H, T>>, JournalError> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(absent) if absent.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(JournalError::Unreadable { path: path.to_owned(), source }),
    };
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    let mut lines = whole.lines().zip(1..);
    let Some((first, _)) = lines.next() else { return Ok(None) };
    let header = parse(path, 1, first, "what the work is")?;
    let results = lines.map(|(line, number)| parse(path, number, line, "a result"));
    Ok(Some(JournalContent {
        header,
        results: results.collect::<Result<_, _>>()?,
        n_whole_bytes: whole.len() as u64,
    }))
}

fn parse<T: DeserializeOwned>(
    path: &Path,
    line: usize,
    text: &str,
    expected: &'static str,
) -> Result<T, JournalError> {
    serde_json::from_str(text).map_err(|source| JournalError::Line {
        path: path.to_owned(),
        line,
        expected,
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    type Content = JournalContent<String, Vec<f64>>;

    fn read(path: &Path) -> Option<Content> {
        read_journal(path).unwrap()
    }

    #[test]
    fn work_goes_on_where_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        assert_eq!(read(&path), None);
        let mut journal = Journal::create(&path, &"plan").unwrap();
        for k in 0..3 {
            journal.append(&[f64::from(k), 0.1]).unwrap();
        }
        drop(journal);
        let bytes = std::fs::read(&path).unwrap();
        // Wherever a kill tears the file, all whole lines are there, and what comes next starts a line of its own.
        for n_bytes in 0..=bytes.len() {
            std::fs::write(&path, &bytes[..n_bytes]).unwrap();
            let Some(content) = read(&path) else {
                assert!(n_bytes <= "\"plan\"".len(), "{n_bytes}");
                continue;
            };
            let n_lines = bytes[..n_bytes].iter().filter(|&&byte| byte == b'\n').count();
            assert_eq!(content.results.len(), n_lines - 1);
            Journal::resume(&path, &content).unwrap().append(&[9.0]).unwrap();
            let more = read(&path).unwrap();
            assert_eq!(more.header, "plan");
            assert_eq!(more.results[..n_lines - 1], content.results);
            assert_eq!(more.results[n_lines - 1], [9.0]);
        }
    }

    #[test]
    fn a_line_that_is_no_result_is_told_with_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        for (text, part) in [
            ("\"plan\"\n[1.0]\n[nan]\n", "a.jsonl:3: expected a result, found: "),
            ("{}\n", "a.jsonl:1: expected what the work is, found: "),
        ] {
            std::fs::write(&path, text).unwrap();
            let told = read_journal::<String, Vec<f64>>(&path).unwrap_err().to_string();
            assert!(told.contains(part) && told.lines().count() == 1, "{told}");
        }
        std::fs::write(&path, [0xff, b'\n']).unwrap();
        assert!(read_journal::<String, Vec<f64>>(&path).is_err());
        assert!(Journal::create(folder.path(), &"plan").is_err(), "a folder stands there");
    }
}
