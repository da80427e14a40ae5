//! A process of the user's own, by its command line: whatever it started ends with this, and its last words are kept.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};

/// The longest line that a process may say [bytes].
const LONGEST_LINE: u64 = 256 << 20;
/// A process that has said its last is given so many tenths of a second to end.
const N_WAITS: usize = 10;

/// A process that is under way, in a group of its own.
pub(crate) struct OwnProcess {
    child: Child,
    last_words: Arc<Mutex<String>>,
}

impl OwnProcess {
    /// Starts a command line with these variables beside the present ones. Errors: the system has no shell for it.
    pub(crate) fn start(command: &str, variables: &[(&str, &str)]) -> std::io::Result<Self> {
        let mut child = Command::new("sh")
            .args(["-c", command])
            .envs(variables.iter().copied())
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let last_words = Arc::<Mutex<String>>::default();
        if let Some(stderr) = child.stderr.take() {
            keep_words(stderr, &last_words);
        }
        Ok(Self { child, last_words })
    }

    /// The way to its standard input, once.
    pub(crate) fn stdin(&mut self) -> Option<ChildStdin> {
        self.child.stdin.take()
    }

    /// The way from its standard output, once.
    pub(crate) fn stdout(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// From now on what it prints counts as its words, too.
    pub(crate) fn hear_stdout(&mut self) {
        if let Some(stdout) = self.stdout() {
            keep_words(stdout, &self.last_words);
        }
    }

    /// Whether it has ended.
    pub(crate) fn has_ended(&mut self) -> bool {
        // Who cannot be waited for has been waited for.
        self.child.try_wait().map_or(true, |status| status.is_some())
    }

    /// How it ended, and the last that it said to a person.
    pub(crate) fn ending(&mut self) -> String {
        let mut status = None;
        for _ in 0..N_WAITS {
            status = self.child.try_wait().ok().flatten();
            // The last words may come a moment after the end.
            thread::sleep(Duration::from_millis(if status.is_some() { 20 } else { 100 }));
            if status.is_some() {
                break;
            }
        }
        let status = status.map(|status| format!(", {status}")).unwrap_or_default();
        let words = self.last_words.lock().map(|words| words.clone()).unwrap_or_default();
        if words.is_empty() { status } else { format!("{status}: {words}") }
    }
}

impl Drop for OwnProcess {
    fn drop(&mut self) {
        if let Some(group) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            // It may have ended by itself.
            kill_process_group(group, Signal::KILL).unwrap_or_default();
        }
        drop(self.child.wait());
    }
}

/// Hands on every line until nobody wants one; bytes that are no text become replacement characters.
pub(crate) fn read_lines(stream: impl Read, mut hand_on: impl FnMut(String) -> bool) {
    let mut stream = BufReader::new(stream);
    loop {
        let mut line = Vec::new();
        match stream.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(n) if n > 0 && hand_on(String::from_utf8_lossy(&line).into_owned()) => {}
            _ => return,
        }
    }
}

/// A thread of its own keeps the last line that says anything.
fn keep_words(stream: impl Read + Send + 'static, last_words: &Arc<Mutex<String>>) {
    let last_words = Arc::clone(last_words);
    thread::spawn(move || {
        read_lines(stream, |line| {
            let line = line.trim();
            if let Ok(mut words) = last_words.lock()
                && !line.is_empty()
            {
                line.clone_into(&mut words);
            }
            true
        });
    });
}
