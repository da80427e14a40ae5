//! The messages of a bag in SQLite.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, Row};

use crate::{RecordedChannel, RecordedMessage};

/// Longest message that is believed: far above what sensors tell.
const MESSAGE_BYTES_MAX: i32 = 1 << 28;

type Topics = BTreeMap<i64, Arc<RecordedChannel>>;

/// Hands every message to `take`, by the order of their rows, which is that of recording; returns why it ended early.
pub(super) fn take_all(
    path: &Path,
    take: &mut dyn FnMut(RecordedMessage) -> Result<(), String>,
) -> Option<String> {
    match open(path).and_then(|connection| read(&connection, take)) {
        Ok(refusal) => refusal,
        Err(error) => Some(told(&error)),
    }
}

/// A database that is shorter than it says, as one that was cut off, is opened all the same: what is whole is read.
fn open(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(path, flags)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MESSAGE_BYTES_MAX)?;
    // A schema that may be written is one that is read although the file is shorter than it says; nothing is written.
    connection.execute_batch(
        "PRAGMA writable_schema = ON; PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON;",
    )?;
    Ok(connection)
}

fn read(
    connection: &Connection,
    take: &mut dyn FnMut(RecordedMessage) -> Result<(), String>,
) -> rusqlite::Result<Option<String>> {
    if let Some(name) = view(connection)? {
        return Ok(Some(format!("expected a table {name}, found a view")));
    }
    let topics = topics(connection)?;
    let mut query = connection.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY id")?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        if let Err(refusal) = message(row, &topics)?.and_then(&mut *take) {
            return Ok(Some(refusal));
        }
    }
    Ok(None)
}

/// One of the tables that are read which is a view: what it holds may never end.
fn view(connection: &Connection) -> rusqlite::Result<Option<String>> {
    let mut query = connection
        .prepare("SELECT name FROM sqlite_schema WHERE type = 'view' AND name IN ('topics', 'messages')")?;
    let mut names = query.query_map([], |row| row.get(0))?;
    names.next().transpose()
}

fn topics(connection: &Connection) -> rusqlite::Result<Topics> {
    let mut query = connection.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let topic = |row: &Row<'_>| {
        let channel = RecordedChannel {
            topic: row.get(1)?,
            schema: row.get(2)?,
            schema_data: Vec::new(),
            encoding: row.get(3)?,
        };
        Ok((row.get(0)?, Arc::new(channel)))
    };
    query.query_map([], topic)?.collect()
}

fn message(row: &Row<'_>, topics: &Topics) -> rusqlite::Result<Result<RecordedMessage, String>> {
    let topic: i64 = row.get(0)?;
    let (time_ns, data): (i64, Vec<u8>) = (row.get(1)?, row.get(2)?);
    let Some(channel) = topics.get(&topic) else {
        return Ok(Err(format!("expected a message on a known topic, found one on topic number {topic}")));
    };
    let Ok(log_time_ns) = u64::try_from(time_ns) else {
        return Ok(Err(format!("expected a time since 1970, found {time_ns} ns")));
    };
    Ok(Ok(RecordedMessage { channel: Arc::clone(channel), log_time_ns, data }))
}

fn told(error: &rusqlite::Error) -> String {
    let text = error.to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
