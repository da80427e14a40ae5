//! One running simulator: lines go in, lines come out in time, or it is ended.

use std::io::Write;
use std::process::ChildStdin;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use sim_to_real::{Machine, Motion, SimulatorDescription};

use super::protocol::{self, Reply};
use crate::WorkFailed;
use crate::own_process::{OwnProcess, read_lines};

/// A simulator's process. It ends with this, and whatever it started ends with it.
pub(super) struct Instance {
    process: OwnProcess,
    command: String,
    timeout: Duration,
    to_simulator: Sender<String>,
    from_simulator: Receiver<String>,
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
        let mut process = OwnProcess::start(command, &[])
            .map_err(|error| refused(format!("expected a command that starts, found: {error}")))?;
        let (to_simulator, from_simulator) = threads(&mut process);
        let (command, n_asked) = (command.to_owned(), 0);
        let mut instance = Self { process, command, timeout, to_simulator, from_simulator, n_asked };
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
                Err(format!("expected {expected}, found that it ended{}", self.process.ending()))
            }
        }
    }

    fn failed(&self, told: &str) -> WorkFailed {
        WorkFailed(format!("--simulator '{}': {told}", self.command))
    }
}

/// Threads of their own write and read, so that a simulator that does neither is waited for no longer than any other.
fn threads(process: &mut OwnProcess) -> (Sender<String>, Receiver<String>) {
    let (to_simulator, lines) = channel();
    if let Some(stdin) = process.stdin() {
        thread::spawn(move || write_lines(stdin, &lines));
    }
    let (said, from_simulator) = channel();
    if let Some(stdout) = process.stdout() {
        thread::spawn(move || read_lines(stdout, |line| said.send(line).is_ok()));
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
