//! Settings of which a file gives only what differs.

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::{ConfigError, ConfigText};

/// Version of the settings that this program reads. A file says of which it is by `format`; one that does not say is of
/// the first.
const FORMAT: i64 = 1;
const FORMAT_KEY: &str = "format";
const FIRST_FORMAT: i64 = 1;

/// The defaults with what the file says in place of theirs. A file of another version is refused. A key that the defaults do not have is refused, and so is
/// a value of another kind than theirs.
///
/// Errors: those of [`ConfigText::parse`].
pub fn overlay<T: Serialize + DeserializeOwned>(text: &ConfigText, defaults: &T) -> Result<T, ConfigError> {
    let mut given: Table = text.parse()?;
    let found = given.remove(FORMAT_KEY).unwrap_or(Value::Integer(FIRST_FORMAT));
    if found != Value::Integer(FORMAT) {
        return Err(text.refuse(
            FORMAT_KEY,
            format!("settings of version {FORMAT}"),
            format!("version {found}"),
        ));
    }
    let refuse = |problem: String| text.refuse("", "settings that can be written as TOML", problem);
    let mut merged = Table::try_from(defaults).map_err(|error| refuse(error.to_string()))?;
    merge(text, &mut merged, given, "")?;
    Value::Table(merged).try_into().map_err(|error: toml::de::Error| {
        let problem = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
        text.refuse("", "settings of the right kind", problem)
    })
}

fn merge(text: &ConfigText, into: &mut Table, from: Table, place: &str) -> Result<(), ConfigError> {
    for (key, value) in from {
        let path = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
        match (into.get_mut(&key), value) {
            (None, _) => {
                let known = into.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
                return Err(text.refuse(&path, format!("one of {known}"), "an unknown key"));
            }
            // A table with one key is a choice with its parameters, which another choice replaces whole.
            (Some(Value::Table(old)), Value::Table(new)) if !is_other_choice(old, &new) => {
                merge(text, old, new, &path)?;
            }
            (Some(old), new) => *old = matching(text, &path, old, new)?,
        }
    }
    Ok(())
}

fn is_other_choice(old: &Table, new: &Table) -> bool {
    old.len() == 1 && new.len() == 1 && old.keys().ne(new.keys())
}

/// A whole number does for a real one; everything else must be of the same kind.
fn matching(text: &ConfigText, path: &str, old: &Value, new: Value) -> Result<Value, ConfigError> {
    match (old, new) {
        (Value::Float(_), Value::Integer(whole)) => Ok(Value::Float(whole as f64)),
        (old, new) if old.same_type(&new) => Ok(new),
        (old, new) => Err(text.refuse(path, format!("a value of type {}", old.type_str()), new)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Choice {
        Fixed { value: f64 },
        Share { fraction: f64 },
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Inner {
        count: usize,
        length_m: f64,
        choice: Choice,
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Outer {
        name: String,
        inner: Inner,
    }

    fn defaults() -> Outer {
        let inner = Inner { count: 3, length_m: 1.5, choice: Choice::Fixed { value: 1.0 } };
        Outer { name: "default".into(), inner }
    }

    fn read(text: &str) -> Result<Outer, String> {
        overlay(&ConfigText::new("settings.toml", text), &defaults()).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_left_out_keeps_its_default() {
        assert_eq!(read(""), Ok(defaults()));
        let changed = read("[inner]\nlength_m = 2\n").unwrap();
        assert_eq!(changed.inner, Inner { length_m: 2.0, ..defaults().inner });
        assert_eq!(changed.name, "default");
    }

    #[test]
    fn another_choice_replaces_the_first_with_its_parameters() {
        let changed = read("[inner.choice.share]\nfraction = 0.1\n").unwrap();
        assert_eq!(changed.inner.choice, Choice::Share { fraction: 0.1 });
    }

    #[test]
    fn settings_of_another_version_are_refused_with_both_versions() {
        assert_eq!(read("format = 1\nname = \"x\"\n").unwrap().name, "x");
        for found in ["0", "2", "\"1\""] {
            let told = read(&format!("name = \"x\"\nformat = {found}\nlength = 1\n")).unwrap_err();
            let expected =
                format!("settings.toml:2: format: expected settings of version 1, found version {found}");
            assert_eq!(told, expected, "before any key that another version may have");
        }
    }

    #[test]
    fn an_unknown_key_is_named_with_file_and_line() {
        let error = read("name = \"x\"\n[inner]\nlenght_m = 2.0\n").unwrap_err();
        assert!(error.contains("settings.toml") && error.contains("inner.lenght_m"), "{error}");
        assert!(error.contains('3') && error.contains("length_m") && !error.contains('\n'), "{error}");
    }

    #[test]
    fn a_value_of_another_kind_is_refused() {
        let error = read("[inner]\ncount = \"many\"\n").unwrap_err();
        assert!(error.contains("inner.count") && error.contains("many"), "{error}");
        assert!(read("[inner]\ncount = -1\n").is_err());
        assert!(read("inner = 3\n").is_err());
    }
}
