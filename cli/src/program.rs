//! Which program this process is: what it was told, what starts it again, and which file holds it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

static PROGRAM: OnceLock<Program> = OnceLock::new();

/// A program that runs the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Program {
    /// Its file: what an older one has kept is not trusted by a newer.
    pub file: PathBuf,
    /// What starts it: its file, or an interpreter and the words that come before the program's own.
    pub start: Vec<OsString>,
    /// The words that it was told.
    pub words: Vec<OsString>,
}

impl Program {
    /// An executable of its own, as the system started it.
    ///
    /// # Errors
    /// The system does not say which file it is.
    pub fn of_this_process() -> std::io::Result<Self> {
        let file = std::env::current_exe()?;
        let start = vec![file.clone().into_os_string()];
        Ok(Self { file, start, words: std::env::args_os().skip(1).collect() })
    }

    /// From here on this process is this program; whoever says so first decides.
    pub(crate) fn claim(self) -> &'static Self {
        PROGRAM.get_or_init(|| self)
    }

    /// What this process is; where nobody has said it, an executable of its own.
    pub(crate) fn current() -> std::io::Result<&'static Self> {
        match PROGRAM.get() {
            Some(program) => Ok(program),
            None => Self::of_this_process().map(Self::claim),
        }
    }

    /// The program once more, with words to come.
    pub(crate) fn again(&self) -> Command {
        let (first, rest) = self
            .start
            .split_first()
            .map_or((self.file.as_os_str(), &[][..]), |(first, rest)| (first.as_os_str(), rest));
        let mut command = Command::new(first);
        command.args(rest);
        command
    }

    /// Its file.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interpreter_is_started_again_with_the_words_before_the_programs_own() {
        let start = ["python3", "-P", "-m", "surefoot"].map(OsString::from).to_vec();
        let program = Program { file: "native.so".into(), start, words: vec!["up".into()] };
        let command = program.again();
        assert_eq!(command.get_program(), "python3");
        assert_eq!(command.get_args().collect::<Vec<_>>(), ["-P", "-m", "surefoot"]);
    }
}
