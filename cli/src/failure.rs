//! The ways a command fails, and the line and exit code that tell them apart.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// The user asked for something that cannot be: bad arguments, a bad file, a place that cannot be written.
/// Ends in exit code 2. The message says what was expected and what was found, in one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UsageError(pub String);

/// The request was sound and the work did not succeed. Ends in exit code 1. The message says why, in one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct WorkFailed(pub String);

/// The work succeeded and what it found is more than the user allows. Ends in exit code 3. The message says by how much.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LimitExceeded(pub String);

impl UsageError {
    /// Bad input as another crate's error tells it, with its causes.
    pub fn from_input(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self(one_line(&anyhow::Error::from(error)))
    }

    /// What the argument parser has to say, as option, expected and found where it knows them.
    pub(crate) fn from_parser(error: &clap::Error) -> Self {
        Self(match error.kind() {
            ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand | ErrorKind::MissingSubcommand => {
                "expected a command, found none; --help lists the commands".to_owned()
            }
            ErrorKind::ValueValidation => told_validation(error).unwrap_or_else(|| told_text(error)),
            ErrorKind::InvalidValue => told_choice(error).unwrap_or_else(|| told_text(error)),
            _ => told_text(error),
        })
    }
}

fn told_validation(error: &clap::Error) -> Option<String> {
    Some(format!("{}: {}", option_of(error)?, std::error::Error::source(error)?))
}

fn told_choice(error: &clap::Error) -> Option<String> {
    let ContextValue::Strings(choices) = error.get(ContextKind::ValidValue)? else { return None };
    let found = match error.get(ContextKind::InvalidValue)? {
        ContextValue::String(found) if !found.is_empty() => format!("{found:?}"),
        _ => "none".to_owned(),
    };
    let choices = if choices.is_empty() { "a value".to_owned() } else { choices.join(", ") };
    Some(format!("{}: expected {choices}, found {found}", option_of(error)?))
}

/// `--alpha` of `--alpha <LEVEL>`.
fn option_of(error: &clap::Error) -> Option<&str> {
    match error.get(ContextKind::InvalidArg)? {
        ContextValue::String(argument) => argument.split_whitespace().next(),
        _ => None,
    }
}

/// The parser's own words without its usage lines.
fn told_text(error: &clap::Error) -> String {
    let text = error.to_string();
    let told = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect::<Vec<_>>()
        .join("; ");
    told.strip_prefix("error: ").unwrap_or(&told).to_owned()
}

/// An error and its causes in one line.
pub(crate) fn one_line(error: &anyhow::Error) -> String {
    let mut told = error.to_string();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        // Some errors repeat their cause in their own message.
        if !told.contains(&cause) {
            told = format!("{told}: {cause}");
        }
    }
    told.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// 2 for bad usage or input anywhere in the chain, 3 for a limit that is exceeded, else 1.
pub(crate) fn exit_code(error: &anyhow::Error) -> u8 {
    if error.chain().any(|cause| cause.is::<UsageError>()) || error.is::<UsageError>() {
        2
    } else if error.is::<LimitExceeded>() {
        3
    } else {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn usage_error_below_context_still_exits_with_two() {
        let refused: anyhow::Result<()> = Err(UsageError("alpha: expected".into()).into());
        let error = refused.context("world.npz").unwrap_err();
        assert_eq!(exit_code(&error), 2);
        assert_eq!(one_line(&error), "world.npz: alpha: expected");
    }

    #[test]
    fn failed_work_exits_with_one() {
        let error = anyhow::Error::from(WorkFailed("stuck\nat (1, 2)".into()));
        assert_eq!(exit_code(&error), 1);
        assert_eq!(one_line(&error), "stuck at (1, 2)");
    }

    #[test]
    fn cause_already_told_is_not_repeated() {
        #[derive(Debug, thiserror::Error)]
        #[error("file.toml: {source}")]
        struct Outer {
            source: UsageError,
        }
        let error = UsageError::from_input(Outer { source: UsageError("line 3".into()) });
        assert_eq!(error.to_string(), "file.toml: line 3");
    }
}
