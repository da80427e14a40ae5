//! `surefoot up`: one process of the machine, or all of them.

mod roles;

use std::ffi::OsString;
use std::process::Command;

use runtime::channel::Bus;
use runtime::status::Role;
use runtime::supervisor::{RunEnd, Supervisor};

use crate::arguments::{MapSource, Method, UpArguments};
use crate::{UsageError, WorkFailed, interrupt};

pub(crate) fn run(arguments: &UpArguments) -> anyhow::Result<()> {
    refuse_what_needs_one_process(arguments)?;
    interrupt::catch_interrupts()?;
    match arguments.role.role() {
        Some(role) => roles::run(arguments, role),
        None => supervise(arguments),
    }
}

/// Who knows the truth must sit in the plant's process.
fn refuse_what_needs_one_process(arguments: &UpArguments) -> Result<(), UsageError> {
    let refused = match (&arguments.drive.method, arguments.drive.map_source()) {
        (Some(Method::Truth), _) => "--method truth",
        (_, MapSource::Oracle) => "--oracle-map",
        _ => return Ok(()),
    };
    Err(UsageError(format!("{refused}: expected only with surefoot drive, found with surefoot up")))
}

fn supervise(arguments: &UpArguments) -> anyhow::Result<()> {
    // What cannot be is said once, before five processes say it.
    roles::prepare(arguments)?;
    let program = std::env::current_exe()?;
    let words = own_words(std::env::args_os().skip(1));
    let command = |role: Role| {
        let mut command = Command::new(&program);
        command.args(&words).args(["--role", role.name(), "--supervised"]);
        command.stdout(std::process::Stdio::null());
        command
    };
    let bus = Bus::join(&arguments.run)?;
    let mut supervisor = Supervisor::new(&bus, &Role::ALL, &command)?;
    let end = supervisor.run(&interrupt::interrupted, &mut |lines, mission| {
        if let Some(mission) = mission {
            println!("{:.1} s", mission.time_s);
        }
        lines.iter().for_each(|line| println!("  {line}"));
    });
    match end {
        RunEnd::Plant(0) => {
            let time_s = supervisor.mission().map_or(0.0, |mission| mission.time_s);
            println!("goal reached after {time_s:.1} s");
            Ok(())
        }
        RunEnd::Plant(_) => Err(WorkFailed("goal not reached; the vehicle's process says why".into()).into()),
        RunEnd::Interrupted => Err(WorkFailed("goal not reached: interrupted by the user".into()).into()),
        RunEnd::GaveUp { role, why } => Err(WorkFailed(format!("{}: {why}", role.name())).into()),
    }
}

/// The words of the command line without those that say which process to be.
fn own_words(words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut skips_next = false;
    for word in words {
        let is_role = word == "--role";
        let is_whole = word.to_str().is_some_and(|word| word.starts_with("--role="));
        if !(is_role || is_whole || skips_next) {
            kept.push(word);
        }
        skips_next = is_role;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_get_every_word_but_the_role() {
        let words = ["up", "--role", "all", "--seed", "3", "--role=all", "--run", "x"].map(OsString::from);
        let kept = own_words(words.into_iter());
        assert_eq!(kept, ["up", "--seed", "3", "--run", "x"].map(OsString::from));
    }
}
