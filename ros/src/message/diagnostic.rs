//! `diagnostic_msgs`.

use serde::{Deserialize, Serialize};

use super::{Header, named};

/// `diagnostic_msgs/KeyValue`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// What.
    pub key: String,
    /// How much.
    pub value: String,
}

/// `diagnostic_msgs/DiagnosticStatus`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// 0 well, 1 warning, 2 error, 3 silent.
    pub level: u8,
    /// What is told of.
    pub name: String,
    /// In one line.
    pub message: String,
    /// Which machine.
    pub hardware_id: String,
    /// The numbers.
    pub values: Vec<KeyValue>,
}

/// `diagnostic_msgs/DiagnosticArray`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// Of when.
    pub header: Header,
    /// One for every part.
    pub status: Vec<DiagnosticStatus>,
}

named! {
    DiagnosticArray = "diagnostic_msgs" / "DiagnosticArray";
}
