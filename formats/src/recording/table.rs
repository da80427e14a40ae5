//! The messages of a topic as a table: one row for each, with what its fields are called.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde_json::Value;

use super::{RecordedMessage, open_recording};

/// A field of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordedCell {
    /// A number, in the unit that its name ends in.
    Number(f64),
    /// A count or a time in nanoseconds, to the last digit.
    Count(u64),
    /// A word.
    Text(String),
}

/// The values of a field, one for each row.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordedColumn {
    /// Numbers; NaN where a message has none, or none that is finite.
    Numbers(Vec<f64>),
    /// Counts.
    Counts(Vec<u64>),
    /// Words; empty where a message has none.
    Text(Vec<String>),
}

/// The messages of a topic, as far as the recording goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedTable {
    /// When each row was recorded [ns].
    pub time_ns: Vec<u64>,
    /// Fields by name, in the order in which they came.
    pub columns: Vec<(String, RecordedColumn)>,
    /// Where and why the recording breaks off; `None` when it is whole.
    pub ended_early: Option<String>,
}

/// Reads the table of a topic; `rows` says which rows a message makes, each as its fields in their order.
///
/// A recording that breaks off gives the rows before that place. Errors: the file cannot be opened.
pub fn read_recorded_table(
    path: &Path,
    topic: &str,
    mut rows: impl FnMut(&RecordedMessage) -> Result<Vec<Vec<(String, RecordedCell)>>, String>,
) -> io::Result<RecordedTable> {
    let mut table = Growing::default();
    let ended_early = open_recording(path)?.take_all(|message| {
        if message.channel.topic == topic {
            for row in rows(&message).map_err(|problem| format!("a message on {topic}: {problem}"))? {
                table.push(message.log_time_ns, row);
            }
        }
        Ok(())
    });
    Ok(table.finished(ended_early))
}

/// The fields of a message in JSON: those of an object within under both names, joined by a dot, those of a list under the
/// name and their number. What is null is left out.
///
/// Errors: the message is no object in JSON.
pub fn json_row(message: &RecordedMessage) -> Result<Vec<(String, RecordedCell)>, String> {
    match serde_json::from_slice(&message.data) {
        Ok(Value::Object(fields)) => {
            let mut row = Vec::new();
            fields.iter().for_each(|(name, value)| flatten(name, value, &mut row));
            Ok(row)
        }
        Ok(_) => Err("expected an object in JSON, found another value".to_owned()),
        Err(error) => Err(format!("expected JSON, found: {error}")),
    }
}

fn flatten(name: &str, value: &Value, row: &mut Vec<(String, RecordedCell)>) {
    match value {
        Value::Null => {}
        Value::Bool(truth) => row.push((name.to_owned(), RecordedCell::Number(f64::from(*truth)))),
        Value::Number(number) => {
            row.push((name.to_owned(), RecordedCell::Number(number.as_f64().unwrap_or(f64::NAN))));
        }
        Value::String(text) => row.push((name.to_owned(), RecordedCell::Text(text.clone()))),
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(place, item)| flatten(&format!("{name}_{place}"), item, row));
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(own, item)| flatten(&format!("{name}.{own}"), item, row));
        }
    }
}

/// A table that rows are put to.
#[derive(Default)]
struct Growing {
    time_ns: Vec<u64>,
    columns: Vec<(String, RecordedColumn)>,
    places: BTreeMap<String, usize>,
}

impl Growing {
    fn push(&mut self, time_ns: u64, row: Vec<(String, RecordedCell)>) {
        for (name, cell) in row {
            let place = *self.places.entry(name.clone()).or_insert_with(|| {
                self.columns.push((name, RecordedColumn::of(&cell)));
                self.columns.len() - 1
            });
            let column = &mut self.columns[place].1;
            column.fill_up_to(self.time_ns.len());
            column.push(cell);
        }
        self.time_ns.push(time_ns);
    }

    fn finished(mut self, ended_early: Option<String>) -> RecordedTable {
        self.columns.iter_mut().for_each(|(_, column)| column.fill_up_to(self.time_ns.len()));
        RecordedTable { time_ns: self.time_ns, columns: self.columns, ended_early }
    }
}

impl RecordedColumn {
    fn of(cell: &RecordedCell) -> Self {
        match cell {
            RecordedCell::Number(_) => Self::Numbers(Vec::new()),
            RecordedCell::Count(_) => Self::Counts(Vec::new()),
            RecordedCell::Text(_) => Self::Text(Vec::new()),
        }
    }

    /// Rows whose message has not the field.
    fn fill_up_to(&mut self, n_rows: usize) {
        match self {
            Self::Numbers(values) => values.resize(n_rows, f64::NAN),
            Self::Counts(values) => values.resize(n_rows, 0),
            Self::Text(values) => values.resize(n_rows, String::new()),
        }
    }

    /// A word among numbers makes words of all.
    fn push(&mut self, cell: RecordedCell) {
        match (&mut *self, cell) {
            (Self::Numbers(values), RecordedCell::Number(value)) => values.push(value),
            (Self::Numbers(values), RecordedCell::Count(value)) => values.push(value as f64),
            (Self::Counts(values), RecordedCell::Count(value)) => values.push(value),
            (Self::Text(values), RecordedCell::Text(value)) => values.push(value),
            (Self::Text(values), RecordedCell::Number(value)) => values.push(value.to_string()),
            (Self::Text(values), RecordedCell::Count(value)) => values.push(value.to_string()),
            (_, cell) => {
                *self = Self::Text(self.words());
                self.push(cell);
            }
        }
    }

    fn words(&self) -> Vec<String> {
        match self {
            Self::Numbers(values) => values.iter().map(f64::to_string).collect(),
            Self::Counts(values) => values.iter().map(u64::to_string).collect(),
            Self::Text(values) => values.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn message(json: &str) -> RecordedMessage {
        RecordedMessage { channel: Arc::default(), log_time_ns: 0, data: json.as_bytes().to_vec() }
    }

    #[test]
    fn rows_with_other_fields_stand_under_one_another() {
        let mut table = Growing::default();
        for (time_ns, json) in [
            (1, r#"{"a": 1, "b": {"c": [2.5, null]}}"#),
            (2, r#"{"d": "hold", "a": null}"#),
            (3, r#"{"a": "none", "d": "drive"}"#),
        ] {
            table.push(time_ns, json_row(&message(json)).unwrap());
        }
        let RecordedTable { time_ns, columns, .. } = table.finished(None);
        assert_eq!(time_ns, [1, 2, 3]);
        let column = |name: &str| columns.iter().find(|(own, _)| own == name).unwrap().1.clone();
        let words = |words: [&str; 3]| RecordedColumn::Text(words.map(str::to_owned).to_vec());
        assert_eq!(column("a"), words(["1", "NaN", "none"]));
        assert_eq!(column("d"), words(["", "hold", "drive"]));
        let RecordedColumn::Numbers(values) = column("b.c_0") else { panic!("{columns:?}") };
        assert!(values[0] == 2.5 && values[1].is_nan() && values[2].is_nan());
        assert_eq!(columns.len(), 3, "what is null is left out");
    }

    #[test]
    fn what_is_no_object_is_refused() {
        for (json, part) in [("[1]", "expected an object"), ("{", "expected JSON")] {
            let told = json_row(&message(json)).unwrap_err();
            assert!(told.contains(part), "{told}");
        }
    }
}
