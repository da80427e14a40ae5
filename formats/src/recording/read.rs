//! The drive log out of a recording, as far as the recording goes.

use std::collections::BTreeSet;
use std::path::Path;

use bicycle::DriveLog;

use super::drive_row::{self, Fields};
use super::open_recording;

/// A drive log from a recording.
#[derive(Clone, Debug)]
pub struct McapDriveLog {
    /// What could be read.
    pub log: DriveLog,
    /// When each row was recorded [ns].
    pub time_ns: Vec<u64>,
    /// Why reading ended early, e.g. because the recorder was killed; `None` when the recording is complete.
    pub ended_early: Option<String>,
}

/// A recording without a drive log. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum McapReadError {
    /// The file could not be opened.
    #[error("{file}: expected a readable file, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// No row of a drive log was found.
    #[error("{file}: expected messages on topic {topic}, found {found}")]
    NoRows {
        /// Path as given.
        file: String,
        /// The drive log's topic.
        topic: &'static str,
        /// What was there instead.
        found: String,
    },
}

/// Reads the drive log of a recording made by [`super::DriveRecorder`], of this version or another: its own schema says
/// which column is which, and columns that this program does not know are passed over.
///
/// A recording that breaks off or is damaged gives all rows before that place, and says so. Errors: the file cannot
/// be opened, or holds no row at all.
pub fn read_drive_log_mcap(path: &Path) -> Result<McapDriveLog, McapReadError> {
    let file = path.display().to_string();
    let messages = match open_recording(path) {
        Ok(messages) => messages,
        Err(source) => return Err(McapReadError::Unreadable { file, source }),
    };
    let mut topics = BTreeSet::new();
    let (mut log, mut time_ns) = (DriveLog::default(), Vec::new());
    let mut fields = None;
    let problem = messages.take_all(|message| {
        topics.insert(message.channel.topic.clone());
        if message.channel.topic != drive_row::TOPIC {
            return Ok(());
        }
        if fields.is_none() {
            let schema = Fields::of(&message.channel.schema_data);
            fields = Some(schema.ok_or("messages without a schema of a drive log")?);
        }
        fields.as_ref().map_or(Ok(()), |fields| add_row(fields, &mut log, &message.data))?;
        time_ns.push(message.log_time_ns);
        Ok(())
    });
    let ended_early = problem.map(|problem| format!("after {} rows: {problem}", log.n_rows()));
    if log.n_rows() > 0 {
        return Ok(McapDriveLog { log, time_ns, ended_early });
    }
    let topics = Vec::from_iter(topics).join(", ");
    let found = ended_early.unwrap_or_else(|| format!("only topics: {topics}"));
    Err(McapReadError::NoRows { file, topic: drive_row::TOPIC, found })
}

fn add_row(fields: &Fields, log: &mut DriveLog, bytes: &[u8]) -> Result<(), String> {
    let (run, row) = fields.decode(bytes).ok_or("a message that is no row of a drive log")?;
    log.push(&run, &row).map_err(|error| error.to_string())
}
