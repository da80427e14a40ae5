//! Drive logs as CSV: a header row, `t` and whatever columns exist, in any order.

use std::io::Write;
use std::path::Path;

use bicycle::{Column, DriveLog, DriveLogError, DriveRow};
use csv::{ErrorKind, StringRecord};

use crate::results::write_atomic;
use crate::{ColumnNames, OutputError};

/// A drive log with the columns that have no meaning for Surefoot, so that writing it again loses nothing.
#[derive(Clone, Debug, Default)]
pub struct DriveLogFile {
    /// The columns that have a meaning.
    pub log: DriveLog,
    /// The others, in the file's order.
    pub other_columns: Vec<OtherColumn>,
}

/// A column without a meaning for Surefoot.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherColumn {
    /// Name in the header.
    pub name: String,
    /// One cell per row of the log, as text.
    pub cells: Vec<String>,
}

/// A drive log that cannot be read. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum DriveLogFileError {
    /// The file could not be read.
    #[error("{file}: expected a readable text file, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A cell, or the header, is wrong.
    #[error("{file}:{line}: {column}: expected {expected}, found {found}")]
    Cell {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Name of the column, or `row` and `header` for the whole line.
        column: String,
        /// What would do.
        expected: String,
        /// What stands there.
        found: String,
    },
}

/// Reads a drive log. An empty cell, or `nan`, is a value that was not measured; `t` may not be missing.
///
/// Errors: unreadable file, no `t`, a column named twice, rows of another length than the header, a cell that is no
/// finite number, `t` that does not grow strictly within a run, a run whose rows do not stand together, no row.
pub fn read_drive_log_csv(path: &Path) -> Result<DriveLogFile, DriveLogFileError> {
    read_drive_log_csv_named(path, &ColumnNames::default())
}

/// Reads a drive log whose columns have names of their own.
///
/// Errors: those of [`read_drive_log_csv`]; neither a column that stands for one of ours nor that itself.
pub fn read_drive_log_csv_named(path: &Path, names: &ColumnNames) -> Result<DriveLogFile, DriveLogFileError> {
    let file = path.display().to_string();
    match std::fs::read(path) {
        Ok(text) => read(&text, names).map_err(|problem| problem.of(file, &text)),
        Err(source) => Err(DriveLogFileError::Unreadable { file, source }),
    }
}

/// Writes a drive log, whole or not at all. Numbers come back bit by bit. Errors: [`OutputError::File`].
pub fn write_drive_log_csv(path: &Path, file: &DriveLogFile) -> Result<(), OutputError> {
    write_atomic(path, |sink| {
        let mut writer = csv::Writer::from_writer(std::io::BufWriter::new(sink));
        write_rows(&mut writer, file).map_err(std::io::Error::other)?;
        writer.flush()
    })
}

/// What is wrong, before the file's name and the line are known.
struct Problem {
    /// Where the row begins [bytes], perhaps before empty lines.
    at: u64,
    column: String,
    expected: String,
    found: String,
}

impl Problem {
    fn new(at: u64, column: &str, expected: &str, found: impl ToString) -> Self {
        let found = found.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        Self { at, column: column.to_owned(), expected: expected.to_owned(), found }
    }

    fn of(self, file: String, text: &[u8]) -> DriveLogFileError {
        let Self { at, column, expected, found } = self;
        let before = usize::try_from(at).unwrap_or(usize::MAX).min(text.len());
        let empty = text[before..].iter().take_while(|byte| b"\r\n".contains(byte)).count();
        let line = 1 + text[..before + empty].iter().filter(|byte| **byte == b'\n').count();
        DriveLogFileError::Cell { file, line, column, expected, found }
    }
}

impl From<csv::Error> for Problem {
    fn from(error: csv::Error) -> Self {
        let at = error.position().map_or(0, csv::Position::byte);
        match error.into_kind() {
            ErrorKind::UnequalLengths { expected_len, len, .. } => {
                Self::new(at, "row", &format!("{expected_len} cells as in the header"), len)
            }
            ErrorKind::Utf8 { .. } => Self::new(at, "row", "UTF-8 text", "other bytes"),
            _ => Self::new(at, "row", "CSV", "something else"),
        }
    }
}

/// What a column of the file means.
enum Meaning {
    Run,
    Time,
    Known(Column),
    /// Index into the other columns.
    Other(usize),
}

fn read(text: &[u8], names: &ColumnNames) -> Result<DriveLogFile, Problem> {
    let mut reader = csv::Reader::from_reader(text);
    let header: Vec<String> = reader.headers()?.iter().map(|name| clean(name).to_owned()).collect();
    let renamed = names.renamed(&header);
    let header = renamed.map_err(|expected| Problem::new(0, "header", &expected, only(&header)))?;
    let mut file = DriveLogFile::default();
    let meanings = meanings(&header, &mut file.other_columns)?;
    let mut record = StringRecord::new();
    while reader.read_record(&mut record)? {
        let at = record.position().map_or(0, csv::Position::byte);
        let (run, row) = read_row(&record, at, &meanings, &mut file.other_columns)?;
        file.log.push(&run, &row).map_err(|error| refusal(at, &error))?;
    }
    if file.log.n_rows() == 0 {
        return Err(Problem::new(0, "row", "at least one row below the header", "none"));
    }
    Ok(file)
}

/// A header's name without blanks and byte-order mark.
fn clean(name: &str) -> &str {
    name.trim_start_matches('\u{feff}').trim()
}

fn only(header: &[String]) -> String {
    format!("only: {}", header.join(", "))
}

fn meanings(header: &[String], other_columns: &mut Vec<OtherColumn>) -> Result<Vec<Meaning>, Problem> {
    let repeated = header.iter().enumerate().find(|(index, name)| header[..*index].contains(name));
    if let Some((_, name)) = repeated {
        return Err(Problem::new(0, "header", "each column once", format!("'{name}' twice")));
    }
    if !header.iter().any(|name| name == "t") {
        return Err(Problem::new(0, "header", "a column 't'", only(header)));
    }
    let mut meaning = |name: &String| match name.as_str() {
        "run" => Meaning::Run,
        "t" => Meaning::Time,
        known => Column::from_name(known).map(Meaning::Known).unwrap_or_else(|| {
            other_columns.push(OtherColumn { name: name.clone(), cells: Vec::new() });
            Meaning::Other(other_columns.len() - 1)
        }),
    };
    Ok(header.iter().map(&mut meaning).collect())
}

fn read_row(
    record: &StringRecord,
    at: u64,
    meanings: &[Meaning],
    other_columns: &mut [OtherColumn],
) -> Result<(String, DriveRow), Problem> {
    let (mut run, mut row) = (String::new(), DriveRow::new(f64::NAN));
    for (cell, meaning) in record.iter().zip(meanings) {
        match meaning {
            Meaning::Run => cell.trim().clone_into(&mut run),
            Meaning::Time => row.time_s = number(cell, at, "t")?,
            Meaning::Known(column) => row = row.with(*column, number(cell, at, column.name())?),
            Meaning::Other(index) => other_columns[*index].cells.push(cell.to_owned()),
        }
    }
    Ok((run, row))
}

fn number(cell: &str, at: u64, column: &str) -> Result<f64, Problem> {
    match cell.trim() {
        "" => Ok(f64::NAN),
        text => text.parse().map_err(|_| {
            let found: String = text.chars().take(40).collect();
            Problem::new(at, column, "a number or nothing", format!("'{found}'"))
        }),
    }
}

fn refusal(at: u64, error: &DriveLogError) -> Problem {
    match error {
        DriveLogError::Time { run, before_s, found_s } if before_s.is_finite() => {
            let expected = format!("a time > {before_s} s, the row before it in run '{run}'");
            Problem::new(at, "t", &expected, found_s)
        }
        DriveLogError::Time { found_s, .. } => Problem::new(at, "t", "a finite time", found_s),
        DriveLogError::Infinite { column, found } => {
            Problem::new(at, column.name(), "a finite number or nothing", found)
        }
        DriveLogError::RunSplit { run } => {
            let found = format!("'{run}' again after another run");
            Problem::new(at, "run", "the rows of a run together", found)
        }
    }
}

fn write_rows(writer: &mut csv::Writer<impl Write>, file: &DriveLogFile) -> csv::Result<()> {
    let columns: Vec<_> = file.log.columns().collect();
    let has_runs = file.log.runs().any(|run| !run.name().is_empty());
    let header = has_runs.then_some("run").into_iter().chain(["t"]);
    let header = header.chain(columns.iter().map(|column| column.name()));
    writer.write_record(header.chain(file.other_columns.iter().map(|column| column.name.as_str())))?;
    let rows = file.log.runs().flat_map(|run| run.drive_rows().map(move |row| (run.name(), row)));
    for (index, (run, row)) in rows.enumerate() {
        let mut record = StringRecord::new();
        if has_runs {
            record.push_field(run);
        }
        record.push_field(&row.time_s.to_string());
        columns.iter().for_each(|column| record.push_field(&cell(row.value(*column))));
        let other = file.other_columns.iter();
        other.for_each(|column| record.push_field(column.cells.get(index).map_or("", String::as_str)));
        writer.write_record(&record)?;
    }
    Ok(())
}

/// The shortest text that reads back as the same number; nothing for a missing one.
fn cell(value: f64) -> String {
    if value.is_nan() { String::new() } else { value.to_string() }
}
