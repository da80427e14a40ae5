//! Bags of ROS 2, as rosbag2 writes them: MCAP files or SQLite databases, one or several in a folder.

mod database;
mod folder;
mod writer;

use std::io;
use std::path::{Path, PathBuf};

pub use folder::BagMetadata;
pub use writer::{BagTopic, BagWriteError, BagWriter};

use crate::{RecordedMessage, open_recording};

/// A bag that cannot be opened. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The file or folder could not be read.
    #[error("{file}: expected a readable bag, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// Neither a file of a bag nor a folder that holds one.
    #[error(
        "{file}: expected a bag of ROS 2, a file ending in .mcap or .db3 or a folder of such, found {found}"
    )]
    NoBag {
        /// Path as given.
        file: String,
        /// What is there.
        found: String,
    },
}

/// What holds messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Storage {
    Mcap,
    Sqlite,
}

impl Storage {
    fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "mcap" => Some(Self::Mcap),
            "db3" => Some(Self::Sqlite),
            _ => None,
        }
    }
}

/// No recorder's clock is later: the year 2116 [ns].
const TIME_MAX_NS: u64 = 1 << 62;

/// A bag: its files in their order.
#[derive(Clone, Debug)]
pub struct Bag {
    files: Vec<PathBuf>,
    metadata: Result<Option<BagMetadata>, String>,
}

impl Bag {
    /// Finds the files of a bag: the one that is given, or those of a folder in the order that its `metadata.yaml` says.
    /// Without such a file, or where it cannot be read, the numbers at the ends of the names tell the order.
    ///
    /// # Errors
    /// There is no bag. Whether its files are whole is told by [`Bag::take_all`].
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let file = path.display().to_string();
        let unreadable = |source| BagError::Unreadable { file: file.clone(), source };
        let kind = path.metadata().map_err(unreadable)?;
        let (files, metadata) = match (kind.is_dir(), Storage::of(path)) {
            (true, _) => folder::look(path).map_err(unreadable)?,
            (false, Some(_)) => (vec![path.to_owned()], Ok(None)),
            (false, None) => (Vec::new(), Ok(None)),
        };
        if files.is_empty() {
            let found = if kind.is_dir() { "a folder without any" } else { "another ending" };
            return Err(BagError::NoBag { file, found: found.to_owned() });
        }
        Ok(Self { files, metadata })
    }

    /// Whether a bag of ROS 2 is there, and no recording of our own: those are MCAP, too, but begin otherwise.
    pub fn is_at(path: &Path) -> bool {
        let Ok(bag) = Self::open(path) else { return false };
        match bag.files.first().map(|file| (file, Storage::of(file))) {
            Some((file, Some(Storage::Mcap))) if !matches!(bag.metadata, Ok(Some(_))) => is_of_ros(file),
            first => first.is_some(),
        }
    }

    /// Its files.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// What the bag says of itself, if it does; or why that cannot be read.
    pub fn metadata(&self) -> Result<Option<&BagMetadata>, &str> {
        self.metadata.as_ref().map(Option::as_ref).map_err(String::as_str)
    }

    /// Hands every message to `take` in the order in which they were recorded, one at a time, up to where the bag breaks
    /// off or `take` refuses one. Returns where and why it ended there; `None` of a bag that is whole.
    pub fn take_all(&self, mut take: impl FnMut(RecordedMessage) -> Result<(), String>) -> Option<String> {
        let mut n_taken = 0;
        for file in &self.files {
            let problem = messages_of(file, &mut |message| {
                if message.log_time_ns > TIME_MAX_NS {
                    return Err(format!("expected a time before 2116, found {} ns", message.log_time_ns));
                }
                take(message)?;
                n_taken += 1;
                Ok(())
            });
            if let Some(problem) = problem {
                let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
                return Some(format!("after {n_taken} messages, in {name}: {problem}"));
            }
        }
        let promised = self.metadata().ok().flatten().map(|metadata| metadata.n_messages);
        let is_short = promised.filter(|promised| n_taken < *promised);
        is_short.map(|promised| format!("after {n_taken} messages: metadata.yaml promises {promised}"))
    }
}

fn messages_of(file: &Path, take: &mut dyn FnMut(RecordedMessage) -> Result<(), String>) -> Option<String> {
    match Storage::of(file) {
        Some(Storage::Mcap) => match open_recording(file) {
            Ok(messages) => messages.take_all(take),
            Err(error) => Some(error.to_string()),
        },
        Some(Storage::Sqlite) => database::take_all(file, take),
        None => Some("expected a file ending in .mcap or .db3".to_owned()),
    }
}

/// ROS 2 says its messages in CDR.
fn is_of_ros(file: &Path) -> bool {
    let first = open_recording(file).ok().and_then(|mut messages| messages.next());
    first.and_then(Result::ok).is_some_and(|message| message.channel.encoding == "cdr")
}
