//! A process among the others of its run.

mod folder;

use std::os::unix::fs::MetadataExt;
use std::str::FromStr;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder, NodeState, NodeView};
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::prelude::{
    CallbackProgression, FileName, LogLevel, Path, PortFactory as _, SemanticString, SignalHandlingMode, ipc,
    set_log_level,
};
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::failures::Failures;
use super::{Channel, ChannelError, Element, Header, Inlet, Outlet, THIRD_PARTIES};
use crate::clock::{self, Clock, SECOND_NS};

/// Where shared memory lies.
const SHARED_MEMORY: &str = "/dev/shm";

/// How long a publisher waits for the place of one that has just died [ns].
const HAND_OVER_NS: u64 = SECOND_NS;
/// Time between two looks whether that place is free [ns].
const POLL_NS: u64 = SECOND_NS / 50;

/// Name of a run: its processes find one another by it, and no others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunName(String);

/// A word that names no run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected 1 to 32 letters, digits, - or _, found {found:?}")]
pub struct RunNameError {
    /// The word.
    pub found: String,
}

impl FromStr for RunName {
    type Err = RunNameError;

    fn from_str(word: &str) -> Result<Self, RunNameError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if (1..=32).contains(&word.len()) && word.chars().all(allowed) {
            Ok(Self(word.to_owned()))
        } else {
            Err(RunNameError { found: word.to_owned() })
        }
    }
}

impl std::fmt::Display for RunName {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl RunName {
    /// Start of the names of its files in shared memory.
    pub fn prefix(&self) -> String {
        format!("{}{}_{}_", Self::prefix_of_all(), folder::user(), self.0)
    }

    const fn prefix_of_all() -> &'static str {
        "surefoot_"
    }

    /// The runs of this user that have a process which is alive, in the order of their names.
    ///
    /// # Errors
    /// The user's folder is not his alone.
    pub fn alive() -> Result<Vec<Self>, ChannelError> {
        set_log_level(LogLevel::Fatal);
        folder::claim(std::path::Path::new(&folder::root()), folder::user())?;
        let folders = std::fs::read_dir(folder::root()).into_iter().flatten().flatten();
        let names = folders.filter_map(|folder| folder.file_name().to_str()?.parse::<Self>().ok());
        let mut alive: Vec<Self> = names.filter(Self::is_alive).collect();
        alive.sort_by(|one, other| one.0.cmp(&other.0));
        Ok(alive)
    }

    /// Whether it has a process that is alive.
    fn is_alive(&self) -> bool {
        let Ok(config) = config(self) else { return false };
        let mut is_alive = false;
        // Who cannot be listed cannot be talked to.
        Node::<ipc::Service>::list(&config, |state| {
            is_alive |= matches!(state, NodeState::Alive(_));
            if is_alive { CallbackProgression::Stop } else { CallbackProgression::Continue }
        })
        .ok();
        is_alive
    }

    /// Folder of the files by which its processes find one another, in the one that its user has alone.
    pub fn folder(&self) -> String {
        format!("{}/{}", folder::root(), self.0)
    }
}

/// The process's way to its channels.
pub struct Bus {
    node: Node<ipc::Service>,
    manner: Manner,
    clock: Clock,
}

/// What a process is among the others of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Manner {
    /// It makes the channels that are not there yet, with room for so many readers beside the run's own.
    Member { n_third_parties: usize },
    /// It takes the channels as they are: whoever opens one first decides what it is like.
    Visitor,
}

/// Of how many dead processes what they left behind was cleared away, and of how many it could not be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cleared {
    /// Cleared away.
    pub n_cleared: u64,
    /// Still there.
    pub n_failed: u64,
}

type Service<H, T> = PortFactory<ipc::Service, [T], H>;

impl Bus {
    /// Joins the processes of a run; clears away what dead ones have left behind.
    ///
    /// # Errors
    /// The user's folder is not his alone, or the folder of the run or the shared memory cannot be used.
    pub fn join(run: &RunName) -> Result<Self, ChannelError> {
        Self::join_with_room(run, THIRD_PARTIES)
    }

    /// The same for a run whose channels have so many places for readers beside its own. Whoever opens a channel first
    /// decides, so all processes of a run are given the same number. A publisher reserves memory for every place: one
    /// more costs each channel of maps 2 x depth + 1 maps.
    pub fn join_with_room(run: &RunName, n_third_parties: usize) -> Result<Self, ChannelError> {
        Self::begin(run, Manner::Member { n_third_parties })
    }

    /// Joins a run that is there, for a moment: makes no channel.
    ///
    /// # Errors
    /// Those of [`Bus::join`].
    pub fn visit(run: &RunName) -> Result<Self, ChannelError> {
        Self::begin(run, Manner::Visitor)
    }

    fn begin(run: &RunName, manner: Manner) -> Result<Self, ChannelError> {
        // Failures come back as values; what else it says is for its own developers.
        set_log_level(LogLevel::Fatal);
        let refused = |problem: String| ChannelError::Join { run: run.to_string(), problem };
        folder::claim(std::path::Path::new(&folder::root()), folder::user())?;
        let config = config(run).map_err(refused)?;
        let builder = NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
        let node = builder.create::<ipc::Service>().map_err(|error| refused(error.to_string()))?;
        Ok(Self { node, manner, clock: Clock::Monotonic })
    }

    /// The same by another clock, which all processes of the run go by.
    pub fn with_clock(self, clock: Clock) -> Self {
        Self { clock, ..self }
    }

    /// The clock by which messages are stamped and judged.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The way into a channel, for messages of up to `n_max` elements. There is one at a time, whatever process has it;
    /// the place of one that has just died is waited for.
    ///
    /// # Errors
    /// [`ChannelError::Taken`] while another process has it; too little memory; a channel of other types.
    pub fn outlet<H: Header, T: Element>(
        &self,
        channel: &Channel<H, T>,
        n_max: usize,
    ) -> Result<Outlet<H, T>, ChannelError> {
        let service = self.service(channel)?;
        self.await_place(channel.name, &service)?;
        let n_samples =
            service.static_config().max_subscribers() * (2 * channel.depth + 1) + channel.history + 2;
        check_memory((n_samples * n_max * size_of::<T>()) as f64)?;
        let failures = Failures::default();
        let publisher = service
            .publisher_builder()
            .initial_max_slice_len(n_max)
            .max_loaned_samples(1)
            .set_degradation_handler(failures.handler())
            .create()
            .map_err(|error| match error {
                PublisherCreateError::ExceedsMaxSupportedPublishers => taken(channel.name),
                error => open_error(channel.name, error),
            })?;
        // Later than that of every publisher before: the place was free only then.
        Ok(Outlet::new(channel.name, publisher, failures, n_max, self.clock.clone()))
    }

    /// Waits for the place of a publisher that may just have died. What is left of one that cannot be cleared away keeps
    /// its place, and that is said: no living process has it then.
    fn await_place<H: Header, T: Element>(
        &self,
        channel: &'static str,
        service: &Service<H, T>,
    ) -> Result<(), ChannelError> {
        let until_ns = clock::now_ns() + HAND_OVER_NS;
        while service.dynamic_config().number_of_publishers() > 0 {
            let Cleared { n_failed, .. } = self.clear_dead();
            if clock::now_ns() > until_ns {
                let left = ChannelError::Left { channel, n_failed };
                return Err(if n_failed > 0 { left } else { taken(channel) });
            }
            clock::sleep_until(clock::now_ns() + POLL_NS);
        }
        Ok(())
    }

    /// The way out of a channel.
    pub fn inlet<H: Header, T: Element>(&self, channel: &Channel<H, T>) -> Result<Inlet<H, T>, ChannelError> {
        let service = self.service(channel)?;
        let n_readers = service.static_config().max_subscribers();
        let failures = Failures::default();
        let subscriber =
            service.subscriber_builder().set_degradation_handler(failures.handler()).create().map_err(
                |error| match error {
                    SubscriberCreateError::ExceedsMaxSupportedSubscribers => {
                        ChannelError::Full { channel: channel.name, n_readers }
                    }
                    error => open_error(channel.name, error),
                },
            )?;
        Ok(Inlet::new(channel, service, subscriber, failures, self.clock.clone()))
    }

    /// Whether another process of the run is alive.
    pub fn has_company(&self) -> bool {
        let mut has_company = false;
        // Who cannot be listed cannot be talked to.
        Node::<ipc::Service>::list(self.node.config(), |state| {
            has_company |= matches!(&state, NodeState::Alive(other) if other.id() != self.node.id());
            if has_company { CallbackProgression::Stop } else { CallbackProgression::Continue }
        })
        .ok();
        has_company
    }

    /// Clears away what dead processes of the run have left behind. What fails may be another process that does the same
    /// just now; what fails again and again is something that this user may not remove.
    pub fn clear_dead(&self) -> Cleared {
        let state = self.node.try_cleanup_dead_nodes();
        Cleared { n_cleared: state.cleanups, n_failed: state.failed_cleanups }
    }

    fn service<H: Header, T: Element>(&self, channel: &Channel<H, T>) -> Result<Service<H, T>, ChannelError> {
        let name = channel.name.try_into().map_err(|error| open_error(channel.name, error))?;
        // A reader may hold as many as can wait and one that it goes on using: so a look ends, whatever comes meanwhile.
        let builder = self
            .node
            .service_builder(&name)
            .publish_subscribe::<[T]>()
            .user_header::<H>()
            .max_publishers(1)
            .subscriber_max_buffer_size(channel.depth)
            .subscriber_max_borrowed_samples(channel.depth + 1)
            .history_size(channel.history)
            .enable_safe_overflow(true);
        let service = match self.manner {
            Manner::Member { n_third_parties } => builder
                .max_subscribers(channel.n_readers + n_third_parties)
                .open_or_create()
                .map_err(|error| open_error(channel.name, error))?,
            Manner::Visitor => builder.open().map_err(|error| match error {
                PublishSubscribeOpenError::DoesNotExist => ChannelError::Absent { channel: channel.name },
                error => open_error(channel.name, error),
            })?,
        };
        // Whoever made it may have meant it for several: then its readers need not agree on whom they hear.
        match service.static_config().max_publishers() {
            1 => Ok(service),
            n => Err(open_error(channel.name, format!("a channel of another program, for {n} publishers"))),
        }
    }
}

fn config(run: &RunName) -> Result<Config, String> {
    let problem = |error| format!("{error:?}");
    let mut config = Config::default();
    config.global.prefix = FileName::new(run.prefix().as_bytes()).map_err(problem)?;
    config.global.set_root_path(&Path::new(run.folder().as_bytes()).map_err(problem)?);
    Ok(config)
}

const fn taken(channel: &'static str) -> ChannelError {
    ChannelError::Taken { channel }
}

fn open_error(channel: &'static str, error: impl std::fmt::Display) -> ChannelError {
    ChannelError::Open { channel, problem: error.to_string() }
}

/// Writing into memory that is not there would end the process: better refuse before.
fn check_memory(needed_bytes: f64) -> Result<(), ChannelError> {
    // A system that will not say has no such limit.
    let Some(free_bytes) = free_shared_memory_bytes() else { return Ok(()) };
    if free_bytes >= needed_bytes {
        return Ok(());
    }
    Err(ChannelError::Memory {
        place: SHARED_MEMORY,
        needed_mb: needed_bytes * 1e-6,
        free_mb: free_bytes * 1e-6,
    })
}

/// Shared memory that no run has reserved [bytes]; `None` where the system will not say.
pub fn free_shared_memory_bytes() -> Option<f64> {
    let space = rustix::fs::statvfs(SHARED_MEMORY).ok()?;
    Some((space.f_bavail as f64 * space.f_frsize as f64 - reserved_bytes()).max(0.0))
}

/// What runs have reserved and not written to yet: it still counts as free.
fn reserved_bytes() -> f64 {
    let ours = RunName::prefix_of_all();
    let untouched_bytes = |file: std::fs::DirEntry| {
        let about = file.metadata().ok().filter(|_| file.file_name().to_string_lossy().starts_with(ours))?;
        Some(about.len().saturating_sub(512 * about.blocks()) as f64)
    };
    let files = std::fs::read_dir(SHARED_MEMORY).into_iter().flatten();
    files.filter_map(|file| untouched_bytes(file.ok()?)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_have_plain_names() {
        let run: RunName = "field-2_b".parse().unwrap();
        let user = folder::user();
        assert_eq!(run.prefix(), format!("surefoot_{user}_field-2_b_"));
        assert_eq!(run.folder(), format!("/tmp/surefoot-{user}/field-2_b"));
        let long = "x".repeat(33);
        for wrong in ["", "a b", "../up", "a/b", "\u{e4}", &long] {
            assert!(wrong.parse::<RunName>().unwrap_err().to_string().contains("found"), "{wrong}");
        }
    }

    #[test]
    fn more_shared_memory_than_there_is_is_refused_with_the_numbers() {
        let told = check_memory(1e18).unwrap_err().to_string();
        assert!(told.contains("expected 1000000000000 MB free") && told.contains("found"), "{told}");
    }
}
