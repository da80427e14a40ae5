//! What the processes of a run tell of what happens: lines on standard error, and in files that do not grow for ever.

use std::fmt;
use std::fs::OpenOptions;
use std::io::stderr;
use std::path::Path;
use std::sync::Mutex;

use bicycle::Decision;
use file_rotate::compression::Compression;
use file_rotate::suffix::AppendCount;
use file_rotate::{ContentLimit, FileRotate};
use runtime::supervisor::Told;
use tracing::level_filters::LevelFilter;
use tracing::{Event, Level, Subscriber, info, warn};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields, layer};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt;

use crate::UsageError;
use crate::arguments::{LogLevel, UpArguments, UpRole};

/// Size at which the next file is begun [bytes].
const FILE_BYTES: usize = 4 << 20;
/// Files of before that are kept.
const N_BEFORE: usize = 4;

/// Has this process tell what happens, from now on.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn begin(arguments: &UpArguments) -> Result<(), UsageError> {
    let level = match arguments.log_level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warning => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
    };
    let file = arguments.log.as_deref().map(|folder| file(folder, arguments.role)).transpose()?;
    let file = file.map(|file| layer().with_ansi(false).with_target(false).with_writer(Mutex::new(file)));
    let line = Line { role: arguments.role, is_to_journal: is_to_journal() };
    let lines = layer().event_format(line).with_writer(stderr);
    // Who runs the command line twice in one process, as a program of Python may, goes on with the first log.
    drop(tracing_subscriber::registry().with(level).with(lines).with(file).try_init());
    Ok(())
}

fn file(folder: &Path, role: UpRole) -> Result<FileRotate<AppendCount>, UsageError> {
    let name = if role == UpRole::All { "supervisor" } else { role.name() };
    let path = folder.join(name).with_extension("log");
    let refused = |error| {
        UsageError(format!("--log: expected a file that can be written, found {}: {error}", path.display()))
    };
    std::fs::create_dir_all(folder).map_err(refused)?;
    OpenOptions::new().append(true).create(true).open(&path).map_err(refused)?;
    let limit = ContentLimit::BytesSurpassed(FILE_BYTES);
    Ok(FileRotate::new(&path, AppendCount::new(N_BEFORE), limit, Compression::None, None))
}

/// Whether standard error is the stream that systemd says its journal reads: DEVICE:INODE.
fn is_to_journal() -> bool {
    let stream = std::env::var("JOURNAL_STREAM");
    let (Ok(stream), Ok(own)) = (stream, rustix::fs::fstat(stderr())) else { return false };
    stream == format!("{}:{}", own.st_dev, own.st_ino)
}

/// `surefoot control: what happened`, for the journal with its level before it.
struct Line {
    role: UpRole,
    is_to_journal: bool,
}

impl<S, N> FormatEvent<S, N> for Line
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        if self.is_to_journal {
            write!(writer, "<{}>", priority(*event.metadata().level()))?;
        }
        writer.write_str("surefoot")?;
        if self.role != UpRole::All {
            write!(writer, " {}", self.role.name())?;
        }
        writer.write_str(": ")?;
        context.field_format().format_fields(writer.by_ref(), event)?;
        writeln!(writer)
    }
}

/// Priority of a level in syslog (RFC 5424).
fn priority(level: Level) -> u8 {
    match level {
        Level::ERROR => 3,
        Level::WARN => 4,
        _ => 6,
    }
}

/// Tells what a supervisor has to tell.
pub(super) struct Telling {
    level: LogLevel,
    /// What was told last of the mission.
    mission: String,
}

impl Telling {
    pub fn new(level: LogLevel) -> Self {
        Self { level, mission: String::new() }
    }

    pub fn tell(&mut self, told: Told<'_>) {
        match told {
            Told::Statuses(lines, mission) => {
                if self.level == LogLevel::Info {
                    mission.iter().for_each(|mission| println!("{:.1} s, {mission}", mission.time_s));
                    lines.iter().for_each(|line| println!("  {line}"));
                }
                mission.iter().for_each(|mission| self.note_mission(mission.to_string()));
            }
            Told::Died { role, status, wait_ns } => {
                warn!(
                    "{} ended by {status}; it is started again in {:.1} s",
                    role.name(),
                    1e-9 * wait_ns as f64
                );
            }
            Told::Decided(decision @ Decision::Stop(_)) => warn!("{decision}"),
            Told::Decided(decision) => info!("{decision}"),
        }
    }

    fn note_mission(&mut self, mission: String) {
        if mission != self.mission {
            info!("mission: {mission}");
            self.mission = mission;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_full_file_makes_room_and_the_last_of_all_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let mut log = file(folder.path(), UpRole::Control).unwrap();
        // Eight files of five lines, each line a fifth of a file and a little.
        let line = vec![b'.'; FILE_BYTES / 5 + 1];
        for _ in 0..8 * 5 {
            log.write_all(&line).unwrap();
        }
        let sizes = |name: &str| std::fs::metadata(folder.path().join(name)).map(|file| file.len());
        for name in ["control.log.1", "control.log.2", "control.log.3", "control.log.4"] {
            assert_eq!(sizes(name).unwrap(), 5 * line.len() as u64, "{name}: whole lines");
        }
        assert!(sizes("control.log").unwrap() > 0);
        assert!(sizes("control.log.5").is_err());
    }

    #[test]
    fn the_next_process_of_a_role_writes_on() {
        let folder = tempfile::tempdir().unwrap();
        for line in ["one\n", "two\n"] {
            file(folder.path(), UpRole::All).unwrap().write_all(line.as_bytes()).unwrap();
        }
        let kept = std::fs::read_to_string(folder.path().join("supervisor.log")).unwrap();
        assert_eq!(kept, "one\ntwo\n");
    }

    #[test]
    fn a_folder_that_cannot_be_is_refused() {
        let found = file(Path::new("/proc/nowhere"), UpRole::All).map(drop).unwrap_err().to_string();
        assert!(
            found.starts_with("--log: expected a file that can be written, found /proc/nowhere"),
            "{found}"
        );
    }
}
