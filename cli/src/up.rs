//! `surefoot up`: one process of the machine, or all of them.

mod learn;
mod live;
mod log;
pub(crate) mod robot;
pub(crate) mod roles;
mod ros;

use std::ffi::OsString;
use std::path::Path;

use bus::channel::ChannelError;
use bus::message::mission::REACHED;
use bus::status::Role;
use runtime::RuntimeError;
use runtime::supervisor::{RestartPolicy, RunEnd, RunReport, Start, Supervisor};

use crate::arguments::{MapSource, Method, Pace, UpArguments, UpRole};
use crate::{Program, UsageError, WorkFailed, failure, interrupt};

pub(crate) fn run(arguments: &UpArguments) -> anyhow::Result<()> {
    refuse_what_has_no_meaning(arguments)?;
    let arguments = &robot::described(arguments)?;
    log::begin(arguments)?;
    interrupt::catch_interrupts()?;
    match arguments.role.role() {
        Some(role) => {
            tell_panics_in_one_line();
            roles::run(arguments, role).map_err(refused)
        }
        None if arguments.role == UpRole::Live => live::run(arguments),
        None => supervise(arguments),
    }
}

/// What would be ignored is refused instead.
fn refuse_what_has_no_meaning(arguments: &UpArguments) -> Result<(), UsageError> {
    arguments.drive.bush_height_m()?;
    refuse_what_needs_one_process(arguments)?;
    refuse_what_concerns_another_role(arguments)?;
    match arguments.drive.kernels.threads.threads {
        Some(n @ 2..) if arguments.realtime => Err(UsageError(format!(
            "--threads: expected 1 with --realtime, where control has one core of its own, found {n}"
        ))),
        _ => Ok(()),
    }
}

/// Who knows the truth must sit in the plant's process; who follows a file of commands needs no processes; time that
/// passes for several processes is that of the clock.
fn refuse_what_needs_one_process(arguments: &UpArguments) -> Result<(), UsageError> {
    let refused = match (&arguments.drive.method, arguments.drive.map_source()) {
        (Some(Method::Truth), _) => "--method truth",
        (_, MapSource::Oracle) => "--oracle-map",
        _ if arguments.drive.commands.is_some() => "--commands",
        _ if arguments.drive.route.is_some() => "--route",
        _ if arguments.drive.keep.is_some() => "--keep",
        _ if arguments.drive.pace == Some(Pace::Fast) => "--pace fast",
        _ => return Ok(()),
    };
    Err(UsageError(format!("{refused}: expected only with surefoot drive, found with surefoot up")))
}

/// Words that ask one role for something more. Processes that `--role all` starts are given them all.
fn refuse_what_concerns_another_role(arguments: &UpArguments) -> Result<(), UsageError> {
    let UpArguments { role, supervised, standby, live, learn, validation, realtime, drive, .. } = arguments;
    let asked = [
        ("--live", live.is_some(), &[UpRole::Live][..]),
        ("--standby", *standby, &[UpRole::Plant, UpRole::Mission]),
        ("--learn", *learn, &[UpRole::Learning]),
        ("--validation", validation.is_some(), &[UpRole::Learning]),
        ("--json", drive.results.copy.json.is_some(), &[UpRole::Plant]),
        (
            "--realtime",
            *realtime,
            &[
                UpRole::Plant,
                UpRole::Mapping,
                UpRole::Learning,
                UpRole::Control,
                UpRole::Recorder,
                UpRole::Mission,
                UpRole::Ros,
            ],
        ),
    ];
    let is_ignored = |roles: &[UpRole]| !supervised && *role != UpRole::All && !roles.contains(role);
    let Some((word, _, roles)) =
        asked.into_iter().find(|(_, is_asked, roles)| *is_asked && is_ignored(roles))
    else {
        return Ok(());
    };
    let names: Vec<&str> = roles.iter().map(|role| role.name()).collect();
    Err(UsageError(format!(
        "{word}: expected only with --role all or {}, found with --role {}",
        names.join(", "),
        role.name()
    )))
}

/// Whatever happens to a process, it says so in one line that names it.
fn tell_panics_in_one_line() {
    std::panic::set_hook(Box::new(move |panic| {
        crate::report(&panic.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
    }));
}

/// Too little shared memory, or a folder that others may write into, is no fault that a restart would cure.
fn refused(error: anyhow::Error) -> anyhow::Error {
    let is_lasting =
        |error: &ChannelError| matches!(error, ChannelError::Memory { .. } | ChannelError::Folder { .. });
    let is_refusal = |cause: &(dyn std::error::Error + 'static)| match cause.downcast_ref() {
        Some(RuntimeError::Channel(error)) => is_lasting(error),
        _ => cause.downcast_ref().is_some_and(is_lasting),
    };
    if error.chain().any(is_refusal) { UsageError(failure::one_line(&error)).into() } else { error }
}

fn supervise(arguments: &UpArguments) -> anyhow::Result<()> {
    // What cannot be is said once, before six processes say it.
    let words_of_route = roles::prepare(arguments)?;
    let roles = robot::roles(arguments)?;
    let program = Program::current()?;
    let words = own_words(program.words.iter().cloned());
    let command = |role: Role, start: Start| {
        let mut command = program.again();
        command.args(&words).args(["--role", role.name(), "--supervised"]);
        if role == Role::Mission {
            command.args(&words_of_route).args(Some("--again").filter(|_| start == Start::Again));
        }
        command.stdout(std::process::Stdio::null());
        command
    };
    let _live = arguments.live.map(|_| live::Viewer::start(program, &words)).transpose()?;
    let bus = roles::join(arguments)?;
    let mut supervisor = Supervisor::new(&bus, &roles, RestartPolicy::default(), &command)?;
    if arguments.described.is_some() && !arguments.standby {
        supervisor = supervisor.until_the_mission_is_over();
    }
    let mut telling = log::Telling::new(arguments.log_level);
    let end = supervisor.run(&interrupt::interrupted, &mut |told| telling.tell(told));
    supervisor.unended().iter().for_each(|why| crate::report(why));
    keep(&supervisor.report(), &arguments.drive.results.out)?;
    match end {
        RunEnd::Plant(0) => {
            let time_s = supervisor.mission().map_or(0.0, |mission| mission.time_s);
            println!("goal reached after {time_s:.1} s");
            Ok(())
        }
        RunEnd::MissionOver(REACHED) => {
            println!("goal reached");
            Ok(())
        }
        RunEnd::MissionOver(_) => {
            Err(WorkFailed("goal not reached: the mission was cancelled".into()).into())
        }
        RunEnd::Plant(_) => Err(WorkFailed("goal not reached; the vehicle's process says why".into()).into()),
        RunEnd::Interrupted if arguments.standby => Ok(()),
        RunEnd::Interrupted => Err(WorkFailed("goal not reached: interrupted by the user".into()).into()),
        RunEnd::GaveUp { role, why } => Err(WorkFailed(format!("{}: {why}", role.name())).into()),
    }
}

/// Shows how the run went, and leaves it as `runtime.json`.
fn keep(report: &RunReport, out: &Path) -> anyhow::Result<()> {
    if let Some(control) = &report.control {
        println!("{control}");
    }
    report.processes.iter().for_each(|process| println!("{process}"));
    std::fs::create_dir_all(out)?;
    Ok(formats::write_json_atomic(&out.join("runtime.json"), report)?)
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
