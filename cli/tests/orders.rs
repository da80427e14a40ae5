//! `surefoot goal`, `pause`, `estop` and the others as a user meets them, beside a run in another terminal.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::disallowed_methods, reason = "processes are waited for")]

use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use bus::channel::{Bus, RunName};
use rustix::process::{Pid, Signal, kill_process};

fn surefoot(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.args(words).stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn run_name(what: &str) -> String {
    format!("orders-{what}-{}", std::process::id())
}

/// Exit code and one line on standard error that holds every given part.
fn assert_refused(code: i32, words: &[&str], parts: &[&str]) {
    let output = surefoot(words).output().unwrap();
    let told = text(&output.stderr);
    assert_eq!((output.status.code(), told.lines().count()), (Some(code), 1), "{words:?}: {told}");
    assert!(output.stdout.is_empty(), "{words:?}");
    for part in parts {
        assert!(told.contains(part), "{words:?}: {part:?} is missing in {told:?}");
    }
}

#[test]
fn what_is_no_order_is_refused_before_anybody_hears_of_it() {
    assert_refused(2, &["goal"], &["X,Y"]);
    assert_refused(2, &["goal", "1,nan"], &["finite numbers", "1,nan"]);
    assert_refused(2, &["goal", "-1,-2", "--tolerance", "0"], &["--tolerance", "above 0"]);
    assert_refused(2, &["path", "1,2", "3,4"], &["--speed"]);
    assert_refused(2, &["path", "1,2", "3,4", "--speed", "0"], &["--speed", "above 0"]);
    assert_refused(2, &["path", "1,2", "--speed", "1"], &["X,Y"]);
    assert_refused(2, &["alpha", "0"], &["above 0 and at most 1"]);
    let run = run_name("nobody");
    assert_refused(2, &["pause", "--run", &run], &[&run, "expected a run"]);
    assert_refused(2, &["estop", "--run", "a b"], &["--run", "1 to 32 letters"]);
}

#[test]
fn of_several_runs_one_must_be_named() {
    let names = [run_name("one"), run_name("two")];
    let _runs = names.clone().map(|name| Bus::join(&name.parse::<RunName>().unwrap()).unwrap());
    assert_refused(
        2,
        &["resume"],
        &["--run", "expected one of the runs that are there", &names[0], &names[1]],
    );
    // It is there, and nobody in it takes orders.
    assert_refused(
        1,
        &["resume", "--run", &names[0]],
        &[&names[0], "channel mission: expected a process", "found none"],
    );
}

/// A run that waits for orders; it ends with this.
struct Standby {
    up: Child,
    name: String,
    folder: tempfile::TempDir,
}

impl Standby {
    fn start() -> Self {
        let (name, folder) = (run_name("standby"), tempfile::tempdir().unwrap());
        let words = ["up", "--standby", "--world", "arena", "--start", "1.6,1.2,1.57", "--method", "physics"];
        let mut up = surefoot(&words);
        up.args(["--threads", "1", "--time-limit", "600", "--run", &name, "--out"]).arg(folder.path());
        up.arg("--log").arg(folder.path().join("log"));
        Self { up: up.stdout(Stdio::null()).spawn().unwrap(), name, folder }
    }

    fn say(&self, words: &[&str]) -> Output {
        surefoot(words).args(["--run", &self.name]).output().unwrap()
    }

    /// Says it again until this is answered.
    fn until(&self, words: &[&str], part: &str) -> String {
        let began = Instant::now();
        loop {
            let output = self.say(words);
            let told = text(&output.stdout) + &text(&output.stderr);
            if told.contains(part) {
                return told;
            }
            assert!(began.elapsed() < Duration::from_secs(60), "{words:?}: {told}");
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    fn takes(&self, words: &[&str], part: &str) {
        let output = self.say(words);
        let told = text(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", text(&output.stderr));
        assert!(told.contains(part) && told.lines().count() == 1, "{words:?}: {told}");
    }

    fn refuses(&self, words: &[&str], part: &str) {
        let output = self.say(words);
        let told = text(&output.stderr);
        assert_eq!((output.status.code(), told.lines().count()), (Some(1), 1), "{words:?}: {told}");
        assert!(told.contains(part), "{words:?}: {told}");
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log/supervisor.log")).unwrap()
    }

    /// Waits until the log of the run has a line. What lasts for less than a decision is in none.
    fn logs(&self, line: &str) {
        let began = Instant::now();
        while !self.log().contains(line) {
            assert!(began.elapsed() < Duration::from_secs(10), "{line:?} is missing in {}", self.log());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn kill_control(&self) {
        let words = format!("--run {} .*--role control", self.name);
        let killed = Command::new("pkill").args(["-KILL", "-f", "--", &words]).status().unwrap();
        assert!(killed.success(), "expected a process of control");
    }

    /// As with Ctrl-C.
    fn end(&mut self) -> Option<i32> {
        let up = Pid::from_raw(self.up.id().try_into().unwrap()).unwrap();
        kill_process(up, Signal::INT).unwrap();
        self.up.wait().unwrap().code()
    }
}

impl Drop for Standby {
    fn drop(&mut self) {
        drop(self.up.kill());
        drop(self.up.wait());
    }
}

#[test]
fn a_run_that_waits_is_sent_about_stopped_and_sent_again() {
    let mut run = Standby::start();
    run.until(&["cancel"], "there is no mission under way");
    run.takes(&["goal", "1.6,6.6", "1.6,2.0"], "driving to (1.6, 6.6) m, goal 1 of 2");
    run.takes(&["alpha", "0.3"], "driving to");
    run.logs(" INFO driving");
    run.takes(&["pause"], "paused on the way to (1.6, 6.6) m, goal 1 of 2");
    run.logs(" INFO waiting: the mission is paused");
    run.takes(&["resume"], "driving to (1.6, 6.6) m");
    run.takes(&["estop"], "emergency stop");
    run.logs(" WARN stopped: emergency stop");
    run.refuses(&["goal", "1.6,3.0"], "the emergency stop is latched; `reset` ends it");
    run.takes(&["reset"], "paused on the way");
    run.refuses(&["reset"], "there is no emergency stop to reset");
    run.takes(&["manual"], "an operator has the wheel");
    run.logs(" INFO waiting: an operator has the wheel");
    run.refuses(&["goal", "1.6,3.0"], "an operator has the wheel");
    run.takes(&["resume"], "driving to (1.6, 6.6) m");
    run.takes(&["path", "1.6,1.2", "1.6,4.0", "--speed", "0.5"], "driving along a path, corner 2 of 2");
    run.takes(&["cancel"], "mission cancelled");
    run.takes(&["goal", "1.6,2.6"], "driving to (1.6, 2.6) m");
    // It arrives, and waits for the next.
    run.until(&["alpha", "0.3"], "goal reached");
    run.refuses(&["pause"], "there is no mission under way");
    assert_eq!(run.up.try_wait().unwrap(), None, "it stays");
    run.logs(" INFO waiting: the goal is reached");
    run.kill_control();
    run.logs(" WARN control ended by signal: 9 (SIGKILL); it is started again in 0.2 s");
    assert_eq!(run.end(), Some(0));
    let log = run.log();
    assert!(log.lines().all(|line| line.starts_with("20") && line.contains("Z ")), "without a time: {log}");
}
