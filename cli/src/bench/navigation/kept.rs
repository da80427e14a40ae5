//! Drives that are done already: of a run that was broken off, or of the parts of one.

use std::path::{Path, PathBuf};

use ::bench::navigation::{DriveResult, Plan};
use formats::{Journal, JournalContent, read_journal};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{UsageError, WorkFailed, summary};

/// File of the folder that every drive is written to as it ends.
pub(super) const JOURNAL: &str = "navigation.jsonl";

/// First line of the journal: drives of different programs or plans do not go together.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    revision: String,
    #[serde(flatten)]
    plan: Plan,
}

impl Header {
    pub(super) fn of(plan: &Plan) -> Self {
        Self { revision: summary::revision().to_owned(), plan: plan.clone() }
    }
}

/// The drives of a journal, which is open for more; of none there is, no drives.
pub(super) fn resumed(path: &Path, header: &Header) -> anyhow::Result<(Journal, Vec<DriveResult>)> {
    let Some(content) = read(path)? else { return Ok((Journal::create(path, header)?, Vec::new())) };
    if let Some(difference) = difference(header, &content.header)? {
        return Err(UsageError(format!("{}: {difference}", path.display())).into());
    }
    Ok((Journal::resume(path, &content)?, content.results))
}

/// All drives of the folders, each of which holds a part of the same plan.
pub(super) fn merged(folders: &[PathBuf]) -> anyhow::Result<(Plan, Vec<DriveResult>)> {
    let mut first: Option<Header> = None;
    let mut drives: Vec<DriveResult> = Vec::new();
    for folder in folders {
        let path = folder.join(JOURNAL);
        let told = |problem: String| format!("{}: {problem}", path.display());
        let Some(content) = read(&path)? else {
            return Err(UsageError(told("expected a journal of drives, found none".to_owned())).into());
        };
        match &first {
            Some(first) => {
                if let Some(difference) = difference(first, &content.header)? {
                    return Err(UsageError(told(difference)).into());
                }
            }
            None => first = Some(content.header),
        }
        for drive in content.results {
            match drives.iter().find(|known| of_same_job(known, &drive)) {
                None => drives.push(drive),
                Some(known) if known.ended_like(&drive) => {}
                Some(_) => {
                    let name = report::navigation::drive_text(&drive);
                    return Err(WorkFailed(told(format!("another folder has another end of {name}"))).into());
                }
            }
        }
    }
    let plan = first.map(|header| header.plan);
    let plan =
        plan.ok_or_else(|| UsageError("--merge: expected at least one folder, found none".to_owned()))?;
    Ok((plan, drives))
}

fn read(path: &Path) -> Result<Option<JournalContent<Header, DriveResult>>, UsageError> {
    read_journal(path).map_err(UsageError::from_input)
}

fn of_same_job(one: &DriveResult, other: &DriveResult) -> bool {
    (&one.method, one.alpha, one.map, one.pair) == (&other.method, other.alpha, other.map, other.pair)
}

/// What the first entry is in which drives were made under other terms.
fn difference(expected: &Header, found: &Header) -> Result<Option<String>, serde_json::Error> {
    let (expected, found) = (serde_json::to_value(expected)?, serde_json::to_value(found)?);
    let entries = expected.as_object().into_iter().flatten();
    let other = |key: &String| found.get(key).unwrap_or(&Value::Null);
    let mut differing = entries.filter(|(key, value)| *value != other(key));
    Ok(differing.next().map(|(key, value)| {
        format!("expected drives with {key} {value}, found {}; they do not go together", other(key))
    }))
}
