//! Who drives in the table: the methods that come with the program, and planners of other people's.

use std::fmt;
use std::str::FromStr;

use serde::de::IntoDeserializer;
use serde::de::value::Error;
use serde::{Deserialize, Serialize};

use crate::closed_loop::Method;

/// Longest name of a planner [characters]: it stands in front of a row of the picture.
const LONGEST: usize = 24;

/// Who a row of the table is of; a plain string in files.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Entrant {
    /// The planner that comes with the program, by what it knows of the ground.
    Ours(Method),
    /// A planner of other people's, by the name that it was entered under.
    External(PlannerName),
}

/// Name of a planner of other people's: 1 to 24 letters, digits, - or _, and no method's.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PlannerName(String);

/// A word that names no planner.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlannerNameError {
    /// It would not do in a file or beside a row.
    #[error("expected 1 to {LONGEST} letters, digits, - or _, found {found:?}")]
    Word {
        /// The word.
        found: String,
    },
    /// Nobody could tell whose row it is.
    #[error("expected a name that no method has, found {found:?}")]
    Method {
        /// The word.
        found: String,
    },
}

impl Entrant {
    /// Name in tables and files.
    pub fn name(&self) -> &str {
        match self {
            Self::Ours(method) => method.name(),
            Self::External(name) => name.as_str(),
        }
    }

    /// The method, of the planner that comes with the program.
    pub const fn method(&self) -> Option<Method> {
        match self {
            Self::Ours(method) => Some(*method),
            Self::External(_) => None,
        }
    }
}

impl From<Method> for Entrant {
    fn from(method: Method) -> Self {
        Self::Ours(method)
    }
}

impl PartialEq<Method> for Entrant {
    fn eq(&self, method: &Method) -> bool {
        self.method() == Some(*method)
    }
}

impl PlannerName {
    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for PlannerName {
    type Err = PlannerNameError;

    fn from_str(word: &str) -> Result<Self, PlannerNameError> {
        let found = word.to_owned();
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if !(1..=LONGEST).contains(&word.len()) || !word.chars().all(allowed) {
            return Err(PlannerNameError::Word { found });
        }
        let method: Result<Method, Error> = Method::deserialize(word.into_deserializer());
        if method.is_ok() { Err(PlannerNameError::Method { found }) } else { Ok(Self(found)) }
    }
}

impl TryFrom<String> for PlannerName {
    type Error = PlannerNameError;

    fn try_from(word: String) -> Result<Self, PlannerNameError> {
        word.parse()
    }
}

impl From<PlannerName> for String {
    fn from(name: PlannerName) -> Self {
        name.0
    }
}

impl fmt::Display for PlannerName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entrants_are_plain_words_in_files() {
        let mine = Entrant::External("my_planner-2".parse().unwrap());
        for (entrant, text) in [(Method::PietraAvoid.into(), "\"pietra-avoid\""), (mine, "\"my_planner-2\"")]
        {
            assert_eq!(serde_json::to_string(&entrant).unwrap(), text);
            assert_eq!(serde_json::from_str::<Entrant>(text).unwrap(), entrant);
            assert_eq!(format!("\"{}\"", entrant.name()), text);
        }
        assert!(serde_json::from_str::<Entrant>("\"../up\"").is_err());
    }

    #[test]
    fn words_that_name_no_planner_are_refused() {
        let long = "x".repeat(LONGEST + 1);
        for word in ["", "a b", "../up", "a/b", "\u{e4}", "a=b", &long] {
            let told = word.parse::<PlannerName>().unwrap_err().to_string();
            assert_eq!(told, format!("expected 1 to 24 letters, digits, - or _, found {word:?}"));
        }
        let told = "physics-informed".parse::<PlannerName>().unwrap_err().to_string();
        assert_eq!(told, "expected a name that no method has, found \"physics-informed\"");
        assert!("Pietra".parse::<PlannerName>().is_ok(), "names are told apart letter by letter");
    }
}
