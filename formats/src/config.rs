//! Configuration in TOML: what is refused is named by file, line and field, with what was expected and what was found.

use std::fmt::Display;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::ops::Range;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What a configuration file may hold, some ten times what the longest does.
const LENGTH_MAX_BYTES: u64 = 1 << 18;

/// A configuration file that cannot be used. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file could not be read.
    #[error("{file}: expected a readable text file, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is longer than any configuration: parsed, a text may take hundreds of times its own memory.
    #[error("{file}: expected at most {LENGTH_MAX_BYTES} bytes of configuration, found more")]
    TooLong {
        /// Path as given.
        file: String,
    },
    /// The text is no TOML.
    #[error("{file}:{line}: expected TOML, found: {problem}")]
    Syntax {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What the parser said.
        problem: String,
    },
    /// A key or its value is wrong.
    #[error("{file}:{line}: {field}: expected {expected}, found {found}")]
    Field {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Dotted path of the key.
        field: String,
        /// What would do.
        expected: String,
        /// What stands there.
        found: String,
    },
}

/// The text of a configuration file with its name, so that refusals can point into it.
#[derive(Clone, Debug)]
pub struct ConfigText {
    file: String,
    text: String,
}

impl ConfigText {
    /// Reads a file. Errors: [`ConfigError::Unreadable`] and [`ConfigError::TooLong`].
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let file = path.display().to_string();
        match read_bounded(path) {
            Ok(Some(text)) => Ok(Self { file, text }),
            Ok(None) => Err(ConfigError::TooLong { file }),
            Err(source) => Err(ConfigError::Unreadable { file, source }),
        }
    }

    /// Wraps a text that came from elsewhere; `file` is the name used in messages.
    pub fn new(file: impl Into<String>, text: impl Into<String>) -> Self {
        Self { file: file.into(), text: text.into() }
    }

    /// What it says.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The values of the file. `T` should deny unknown fields. Errors: [`ConfigError::Syntax`] and
    /// [`ConfigError::Field`] for an unknown or missing key or a value of the wrong type.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        // Where a value stands is made out only once it is refused: two documents at a time hold twice the memory.
        toml::from_str(&self.text).map_err(|error| match DeTable::parse(&self.text) {
            Ok(document) => self.refused_value(&error, document.get_ref()),
            Err(error) => ConfigError::Syntax {
                file: self.file.clone(),
                line: self.line(&error.span().unwrap_or_default()),
                problem: one_line(error.message()),
            },
        })
    }

    fn refused_value(&self, error: &toml::de::Error, document: &DeTable<'_>) -> ConfigError {
        let span = error.span().unwrap_or_default();
        let refusal = Refusal::from_message(error.message());
        let place = path_of(document, &span);
        let path = match refusal.key {
            Some(key) if place.is_empty() => key,
            Some(key) if place != key && !place.ends_with(&format!(".{key}")) => format!("{place}.{key}"),
            _ => place,
        };
        self.field_error(&span, path, refusal.expected, refusal.found)
    }

    /// Whether the text is TOML with this key at its top level, to tell kinds of files apart.
    pub fn has_key(&self, key: &str) -> bool {
        DeTable::parse(&self.text).is_ok_and(|document| document.get_ref().contains_key(key))
    }

    /// The error for a value that parsed but cannot be, at the line of `field` (a dotted path).
    pub fn refuse(&self, field: &str, expected: impl Display, found: impl Display) -> ConfigError {
        let document = DeTable::parse(&self.text).ok();
        let span = document.map(|d| span_of(d.get_ref(), field)).unwrap_or_default();
        self.field_error(&span, field.to_owned(), expected.to_string(), found.to_string())
    }

    fn field_error(
        &self,
        span: &Range<usize>,
        field: String,
        expected: String,
        found: String,
    ) -> ConfigError {
        ConfigError::Field { file: self.file.clone(), line: self.line(span), field, expected, found }
    }

    fn line(&self, span: &Range<usize>) -> usize {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        1 + before.iter().filter(|byte| **byte == b'\n').count()
    }
}

/// The text of a file; nothing if there is more than a configuration may hold.
fn read_bounded(path: &Path) -> std::io::Result<Option<String>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LENGTH_MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LENGTH_MAX_BYTES {
        return Ok(None);
    }
    String::from_utf8(bytes).map(Some).map_err(|error| std::io::Error::new(ErrorKind::InvalidData, error))
}

/// What serde's message says, taken apart.
struct Refusal {
    /// The key, when the message names it.
    key: Option<String>,
    expected: String,
    found: String,
}

impl Refusal {
    fn from_message(message: &str) -> Self {
        let quoted = |text: &str| text.split('`').nth(1).map(str::to_owned);
        let expected = message.split_once(", expected ").map(|(_, expected)| expected.replace('`', ""));
        if message.starts_with("unknown field") {
            let expected = expected.unwrap_or_else(|| "no key".into());
            return Self { key: quoted(message), expected, found: "an unknown key".into() };
        }
        if message.starts_with("missing field") {
            return Self { key: quoted(message), expected: "a value".into(), found: "no such key".into() };
        }
        let found = message.split(", expected ").next().unwrap_or(message);
        let found = found.trim_start_matches("invalid type: ").trim_start_matches("invalid value: ");
        let expected = expected.unwrap_or_else(|| "a valid value".into());
        Self { key: None, expected: one_line(&expected), found: one_line(found) }
    }
}

fn covers(span: &Range<usize>, place: &Range<usize>) -> bool {
    !place.is_empty() && span.start <= place.start && place.end <= span.end
}

/// Path of the deepest key whose key or value covers a place; empty for the document itself.
fn path_of(table: &DeTable<'_>, place: &Range<usize>) -> String {
    let mut best = String::new();
    for (key, value) in table {
        let inner = path_in(value, place);
        if inner.is_some() || covers(&key.span(), place) || covers(&value.span(), place) {
            best = format!("{}{}", key.get_ref(), inner.unwrap_or_default());
        }
    }
    best
}

/// What follows a key in the path to a place within its value: `.key` or `[index]` and so on.
fn path_in(value: &Spanned<DeValue<'_>>, place: &Range<usize>) -> Option<String> {
    match value.get_ref() {
        DeValue::Table(inner) => {
            Some(path_of(inner, place)).filter(|path| !path.is_empty()).map(|path| format!(".{path}"))
        }
        DeValue::Array(items) => items.iter().enumerate().find_map(|(index, item)| {
            let inner = path_in(item, place);
            (inner.is_some() || covers(&item.span(), place))
                .then(|| format!("[{index}]{}", inner.unwrap_or_default()))
        }),
        _ => None,
    }
}

/// Where the deepest existing part of a dotted path with indices stands.
fn span_of(table: &DeTable<'_>, field: &str) -> Range<usize> {
    let (first, rest) = field.split_once('.').unwrap_or((field, ""));
    let mut parts = first.split(['[', ']']).filter(|part| !part.is_empty());
    let name = parts.next().unwrap_or_default();
    let Some((key, mut value)) = table.iter().find(|(key, _)| key.get_ref() == name) else {
        return 0..0;
    };
    let mut span = key.span();
    for index in parts {
        let DeValue::Array(items) = value.get_ref() else { return span };
        let Some(item) = index.parse::<usize>().ok().and_then(|index| items.get(index)) else { return span };
        (value, span) = (item, item.span());
    }
    let inner = value.get_ref().as_table().map(|inner| span_of(inner, rest));
    inner.filter(|inner| *inner != (0..0)).unwrap_or(span)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only its parsing is of interest")]
    struct Outer {
        name: String,
        inner: Inner,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only its parsing is of interest")]
    struct Inner {
        length_m: f64,
        mode: Mode,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Mode {
        Slow,
        Fast,
    }

    fn refusal(text: &str) -> String {
        ConfigText::new("a.toml", text).parse::<Outer>().unwrap_err().to_string()
    }

    #[test]
    fn every_refusal_names_file_line_field_expected_and_found_in_one_line() {
        let cases = [
            (
                "name = \"a\"\n[inner]\nlength_m = \"x\"\nmode = \"slow\"",
                "a.toml:3: inner.length_m: expected f64, found string \"x\"",
            ),
            (
                "name = \"a\"\n\n[inner]\nlength_m = 1\nmode = \"slow\"\nwidth_m = 2",
                "a.toml:6: inner.width_m: expected length_m or mode, found an unknown key",
            ),
            (
                "name = \"a\"\n[inner]\nmode = \"slow\"",
                "a.toml:2: inner.length_m: expected a value, found no such key",
            ),
            ("[inner]\nlength_m = 1\nmode = \"slow\"", "a.toml:1: name: expected a value, found no such key"),
            (
                "name = \"a\"\n[inner]\nlength_m = 1\nmode = \"walk\"",
                "a.toml:4: inner.mode: expected slow or fast, found unknown variant `walk`",
            ),
            (
                "name = \"a\"\ninner = { length_m = [1], mode = \"slow\" }",
                "a.toml:2: inner.length_m: expected f64, found sequence",
            ),
            (
                "name = \"a\"\ninner.length_m = true\ninner.mode = \"slow\"",
                "a.toml:2: inner.length_m: expected f64, found boolean `true`",
            ),
        ];
        for (text, message) in cases {
            assert_eq!(refusal(text), message, "{text}");
        }
    }

    #[test]
    fn broken_toml_is_a_syntax_error_with_its_line() {
        let message = refusal("name = \"a\"\n[inner\nlength_m = 1");
        assert!(message.starts_with("a.toml:2: expected TOML, found: "), "{message}");
        assert_eq!(message.lines().count(), 1);
        assert!(refusal("name = \"a\"\nname = \"b\"").starts_with("a.toml:2: "));
    }

    #[test]
    fn a_refused_value_points_to_its_line() {
        let text = ConfigText::new("a.toml", "name = \"a\"\n[inner]\n# note\nlength_m = -1\nlist = [1, 2]");
        let message = text.refuse("inner.length_m", "a number > 0", -1.0).to_string();
        assert_eq!(message, "a.toml:4: inner.length_m: expected a number > 0, found -1");
        assert!(text.refuse("inner.list[1]", "x", "y").to_string().starts_with("a.toml:5: inner.list[1]:"));
        assert!(text.refuse("inner.absent", "x", "y").to_string().starts_with("a.toml:2: inner.absent:"));
    }

    #[test]
    fn a_file_that_is_no_configuration_by_its_length_is_refused_before_it_is_parsed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.toml");
        let comment = |length: u64| "#".repeat(length as usize);
        std::fs::write(&path, comment(LENGTH_MAX_BYTES)).unwrap();
        ConfigText::read(&path).unwrap();
        std::fs::write(&path, comment(LENGTH_MAX_BYTES + 1)).unwrap();
        let message = ConfigText::read(&path).unwrap_err().to_string();
        assert!(
            message.ends_with("long.toml: expected at most 262144 bytes of configuration, found more"),
            "{message}"
        );
    }

    #[test]
    fn a_missing_file_is_named() {
        let message = ConfigText::read(Path::new("/nowhere/v.toml")).unwrap_err().to_string();
        assert!(message.starts_with("/nowhere/v.toml: expected a readable text file, found: "), "{message}");
    }
}
