//! One running simulator: lines go in, lines come out in time, or it is ended.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use sim_to_real::{Machine, Motion, SimulatorDescription};

use super::protocol::{self, Reply};
use crate::WorkFailed;

/// The longest line that a simulator may say [bytes].
const LONGEST_LINE: u64 = 256 << 20;
/// A simulator that has said its last is given so many tenths of a second to end.
const N_WAITS: usize = 10;

/// A simulator's process. It ends with this, and whatever it started ends with it.
pub(super) struct Instance {
    child: Child,
    command: String,
    timeout: Duration,
    to_simulator: Sender<String>,
    from_simulator: Receiver<String>,
    last_words: Arc<Mutex<String>>,
    n_asked: u64,
}

impl Instance {
    /// Starts a simulator and hears what it says of itself.
    pub(super) fn start(
        command: &str,
        timeout: Duration,
        machine: &Machine,
    ) -> Result<(Self, SimulatorDescription), WorkFailed> {
        let refused = |told: String| WorkFailed(format!("--simulator '{command}': {told}"));
        let mut child = Command::new("sh")
            .args(["-c", command])
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| refused(format!("expected a command that starts, found: {error}")))?;
        let last_words = Arc::new(Mutex::new(String::new()));
        let (to_simulator, from_simulator) = threads(&mut child, &last_words);
        let (command, n_asked) = (command.to_owned(), 0);
        let mut instance =
            Self { child, command, timeout, to_simulator, from_simulator, last_words, n_asked };
        let description = instance.introduced(machine).map_err(|told| instance.failed(&told))?;
        Ok((instance, description))
    }

    fn introduced(&mut self, machine: &Machine) -> Result<SimulatorDescription, String> {
        let hello = protocol::hello(machine).map_err(|error| error.to_string())?;
        match self.asked(hello, "its hello")? {
            Reply::Hello { protocol, .. } if protocol != protocol::VERSION => {
                Err(format!("expected protocol {}, found {protocol}", protocol::VERSION))
            }
            Reply::Hello { description, .. } => {
                description.validate().map_err(|error| error.to_string())?;
                Ok(description)
            }
            Reply::Error { message } => Err(format!("expected its hello, found the error '{message}'")),
            Reply::Motion { .. } => Err("expected its hello, found a motion".to_owned()),
        }
    }

    /// The motion of one run.
    pub(super) fn run(&mut self, body: &str, n_rows: usize) -> Result<Motion, WorkFailed> {
        self.n_asked += 1;
        let id = self.n_asked;
        self.moved(id, body, n_rows).map_err(|told| self.failed(&format!("run {id}: {told}")))
    }

    fn moved(&mut self, asked: u64, body: &str, n_rows: usize) -> Result<Motion, String> {
        match self.asked(protocol::run(asked, body), "a motion")? {
            Reply::Motion { id, .. } if id != asked => {
                Err(format!("expected the motion of this run, found that of run {id}"))
            }
            Reply::Motion { motion, .. } => motion.checked(n_rows),
            Reply::Error { message } => Err(format!("expected a motion, found the error '{message}'")),
            Reply::Hello { .. } => Err("expected a motion, found another hello".to_owned()),
        }
    }

    /// Says a line and waits for the answer.
    fn asked(&mut self, line: String, expected: &str) -> Result<Reply, String> {
        // Where nobody listens any more, nobody answers either, and that is told below.
        drop(self.to_simulator.send(line));
        match self.from_simulator.recv_timeout(self.timeout) {
            Ok(line) => protocol::reply(&line),
            Err(RecvTimeoutError::Timeout) => {
                let waited_s = self.timeout.as_secs_f64();
                Err(format!("expected {expected} within {waited_s} s, found none"))
            }
            Err(RecvTimeoutError::Disconnected) => {
                Err(format!("expected {expected}, found that it ended{}", self.ending()))
            }
        }
    }

    /// How it ended, and the last that it said to a person.
    fn ending(&mut self) -> String {
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

    fn failed(&self, told: &str) -> WorkFailed {
        WorkFailed(format!("--simulator '{}': {told}", self.command))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(group) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            // It may have ended by itself.
            kill_process_group(group, Signal::KILL).unwrap_or_default();
        }
        drop(self.child.wait());
    }
}

/// Threads of their own write and read, so that a simulator that does neither is waited for no longer than any other.
fn threads(child: &mut Child, last_words: &Arc<Mutex<String>>) -> (Sender<String>, Receiver<String>) {
    let (to_simulator, lines) = channel();
    if let Some(stdin) = child.stdin.take() {
        thread::spawn(move || write_lines(stdin, &lines));
    }
    let (said, from_simulator) = channel();
    if let Some(stdout) = child.stdout.take() {
        thread::spawn(move || read_lines(stdout, |line| said.send(line).is_ok()));
    }
    if let Some(stderr) = child.stderr.take() {
        let last_words = Arc::clone(last_words);
        thread::spawn(move || read_lines(stderr, |line| keep(&last_words, &line)));
    }
    (to_simulator, from_simulator)
}

fn write_lines(mut stdin: ChildStdin, lines: &Receiver<String>) {
    while let Ok(line) = lines.recv() {
        if writeln!(stdin, "{line}").and_then(|()| stdin.flush()).is_err() {
            return;
        }
    }
}

/// Hands on every line until nobody wants one; bytes that are no text become replacement characters.
fn read_lines(stream: impl Read, mut hand_on: impl FnMut(String) -> bool) {
    let mut stream = BufReader::new(stream);
    loop {
        let mut line = Vec::new();
        match stream.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(n) if n > 0 && hand_on(String::from_utf8_lossy(&line).into_owned()) => {}
            _ => return,
        }
    }
}

fn keep(last_words: &Mutex<String>, line: &str) -> bool {
    let line = line.trim();
    if let Ok(mut words) = last_words.lock()
        && !line.is_empty()
    {
        line.clone_into(&mut words);
    }
    true
}
