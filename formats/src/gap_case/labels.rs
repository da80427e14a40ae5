//! The labels of a set of cases: what was added to each.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::ConfigError;

/// What was added to a case's plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GapKind {
    /// Nothing.
    None,
    /// One effect of the catalogue.
    Single,
    /// Two effects of the catalogue.
    Pair,
    /// Something that the catalogue may be unable to express.
    Unknown,
}

/// The label of one case. Keys that are not known are passed over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapLabel {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the plant.
    pub plant: String,
    /// How much was added.
    pub kind: GapKind,
    /// Ids of what was added.
    pub effects: Vec<String>,
    /// Size: s, m, l or -.
    pub magnitude: String,
    /// Style of driving.
    pub style: String,
    /// Settings of the plant's parts that differ from the nominal ones.
    #[serde(default)]
    pub injection: BTreeMap<String, serde_json::Value>,
}

/// Reads the labels of a set, by name of the case.
///
/// Errors: the file cannot be read, is no JSON, lacks or mistypes a key; line and what was expected are told.
pub fn read_gap_labels(path: &Path) -> Result<BTreeMap<String, GapLabel>, ConfigError> {
    let file = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => parse_gap_labels(&file, &text),
        Err(source) => Err(ConfigError::Unreadable { file, source }),
    }
}

/// Labels from a text already read; `file` is the name used in messages. Errors as [`read_gap_labels`].
pub fn parse_gap_labels(file: &str, text: &str) -> Result<BTreeMap<String, GapLabel>, ConfigError> {
    serde_json::from_str(text).map_err(|error| ConfigError::Field {
        file: file.to_owned(),
        line: error.line(),
        field: "labels".to_owned(),
        expected: "an object from case name to label".to_owned(),
        found: error.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABELS: &str = r#"{ "a": { "vehicle": "v", "plant": "p", "kind": "pair", "effects": ["wind", "mass"],
        "magnitude": "l", "style": "rich", "injection": { "wind": [1, 2], "on": true }, "later": 3 } }"#;

    #[test]
    fn labels_are_read_by_case_and_new_keys_are_passed_over() {
        let labels = parse_gap_labels("l.json", LABELS).unwrap();
        assert_eq!((labels["a"].kind, labels["a"].effects.len()), (GapKind::Pair, 2));
        assert_eq!(labels["a"].injection["wind"][1], 2);
    }

    #[test]
    fn a_label_without_a_kind_is_refused_with_its_line() {
        let told = parse_gap_labels("l.json", &LABELS.replace("pair", "triple")).unwrap_err().to_string();
        assert!(told.starts_with("l.json:1: labels: expected") && told.contains("triple"), "{told}");
        assert!(parse_gap_labels("l.json", "[]").is_err());
    }
}
