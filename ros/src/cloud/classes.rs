//! What the labels of a cloud mean.

use std::collections::BTreeMap;

use formats::RosLabels;
use terrain::TerrainClass;

/// Two classes claim one label. The message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("ros.labels: expected every number in one class, found {label} in two")]
pub struct LabelsError {
    /// The number.
    pub label: i64,
}

/// A field that says what points are of, and what its numbers mean.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClassLabels {
    /// Its name.
    pub field: String,
    classes: BTreeMap<i64, TerrainClass>,
}

impl ClassLabels {
    /// The labels of a robot file.
    ///
    /// # Errors
    /// A number that is in two classes.
    pub fn new(labels: &RosLabels) -> Result<Self, LabelsError> {
        let RosLabels { field, open, loose, vegetation, obstacle } = labels;
        let mut classes = BTreeMap::new();
        for (class, numbers) in TerrainClass::ALL.into_iter().zip([open, loose, vegetation, obstacle]) {
            for label in numbers {
                if classes.insert(*label, class).is_some() {
                    return Err(LabelsError { label: *label });
                }
            }
        }
        Ok(Self { field: field.clone(), classes })
    }

    /// What a label means, if anybody has said so.
    pub fn class(&self, label: i64) -> Option<TerrainClass> {
        self.classes.get(&label).copied()
    }
}
