//! A bag being written, as rosbag2 of ROS 2 Jazzy leaves it: a folder of one MCAP file and `metadata.yaml`.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use serde::Serialize;
use tempfile::TempDir;

use super::folder::METADATA;
use crate::write_bytes_atomic;

/// Version of `metadata.yaml`.
const VERSION: u32 = 9;
/// How messages are said, as both MCAP and rosbag2 call it.
const ENCODING: &str = "cdr";
/// Messages that are packed together: what is held in memory [bytes].
const CHUNK_BYTES: u64 = 1 << 20;

/// A bag that cannot be written. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum BagWriteError {
    /// There is something already.
    #[error("{}: expected a name that is free, found a file or folder", folder.display())]
    Exists {
        /// Folder as given.
        folder: PathBuf,
    },
    /// A write failed, e.g. because the disk is full; nothing is left.
    #[error("{}: expected a folder that can be written, found: {problem}", folder.display())]
    Write {
        /// Folder as given.
        folder: PathBuf,
        /// What the system said.
        problem: String,
    },
}

/// What all messages of a topic have in common.
#[derive(Clone, Copy, Debug)]
pub struct BagTopic<'a> {
    /// Its name, from the root.
    pub name: &'a str,
    /// The type of its messages, as `nav_msgs/msg/Odometry`.
    pub kind: &'a str,
    /// That type's definition, with those of the types that it is made of behind it.
    pub definition: &'a str,
    /// The hash of the type's description, as ROS tells it.
    pub type_hash: &'a str,
}

/// Writes a bag. It has its name once it is whole: one that is dropped before leaves nothing.
pub struct BagWriter {
    folder: PathBuf,
    unfinished: TempDir,
    file_name: String,
    file: Writer<BufWriter<File>>,
    topics: BTreeMap<String, (u16, Topic)>,
    times_ns: Option<[u64; 2]>,
}

impl BagWriter {
    /// Begins a bag that becomes this folder, which must not be there yet; its parents are made.
    ///
    /// # Errors
    /// See [`BagWriteError`].
    pub fn create(folder: &Path) -> Result<Self, BagWriteError> {
        let folder = folder.to_owned();
        if folder.symlink_metadata().is_ok() {
            return Err(BagWriteError::Exists { folder });
        }
        let failed = |problem: &dyn Display| refused(&folder, problem);
        let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent).map_err(|error| failed(&error))?;
        let unfinished = place_in(parent).map_err(|error| failed(&error))?;
        let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy();
        let file_name = format!("{name}_0.mcap");
        let file = File::create_new(unfinished.path().join(&file_name)).map_err(|error| failed(&error))?;
        let options = WriteOptions::new()
            .profile("ros2")
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES));
        let file = options.create(BufWriter::new(file)).map_err(|error| failed(&error))?;
        Ok(Self { folder, unfinished, file_name, file, topics: BTreeMap::new(), times_ns: None })
    }

    /// Writes a message in CDR, its four bytes of beginning included, that was heard at a time since 1970 [ns].
    ///
    /// # Errors
    /// [`BagWriteError::Write`].
    pub fn write(&mut self, topic: &BagTopic<'_>, at_ns: u64, data: &[u8]) -> Result<(), BagWriteError> {
        let channel_id = self.channel(topic).map_err(|error| refused(&self.folder, &error))?;
        let header = MessageHeader { channel_id, sequence: 0, log_time: at_ns, publish_time: at_ns };
        let written = self.file.write_to_known_channel(&header, data);
        written.map_err(|error| refused(&self.folder, &error))?;
        let [first_ns, last_ns] = self.times_ns.unwrap_or([at_ns; 2]);
        self.times_ns = Some([first_ns.min(at_ns), last_ns.max(at_ns)]);
        Ok(())
    }

    /// Completes the bag and gives it its name; returns how many messages each topic has.
    ///
    /// # Errors
    /// [`BagWriteError::Write`].
    pub fn finish(mut self) -> Result<BTreeMap<String, u64>, BagWriteError> {
        let failed = |problem: &dyn Display| refused(&self.folder, problem);
        self.file.finish().map_err(|error| failed(&error))?;
        let about = serde_saphyr::to_string(&self.document()).map_err(|error| failed(&error))?;
        let metadata = self.unfinished.path().join(METADATA);
        write_bytes_atomic(&metadata, about.as_bytes()).map_err(|error| failed(&error))?;
        std::fs::rename(self.unfinished.path(), &self.folder).map_err(|error| failed(&error))?;
        // It lies elsewhere now: there is nothing to be taken away.
        self.unfinished.disable_cleanup(true);
        Ok(self.topics.into_iter().map(|(name, (_, topic))| (name, topic.message_count)).collect())
    }

    /// The channel of a topic, one message more of which is counted.
    fn channel(&mut self, topic: &BagTopic<'_>) -> mcap::McapResult<u16> {
        if let Some((channel, known)) = self.topics.get_mut(topic.name) {
            known.message_count += 1;
            return Ok(*channel);
        }
        let schema = self.file.add_schema(topic.kind, "ros2msg", topic.definition.as_bytes())?;
        let about = [("offered_qos_profiles", ""), ("topic_type_hash", topic.type_hash)];
        let about = about.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let channel = self.file.add_channel(schema, topic.name, ENCODING, &BTreeMap::from(about))?;
        self.topics.insert(topic.name.to_owned(), (channel, Topic::of(topic)));
        Ok(channel)
    }

    fn document(&self) -> Document {
        let [first_ns, last_ns] = self.times_ns.unwrap_or_default();
        let starting_time = StartingTime { nanoseconds_since_epoch: first_ns };
        let duration = Duration { nanoseconds: last_ns - first_ns };
        let topics: Vec<Topic> = self.topics.values().map(|(_, topic)| topic.clone()).collect();
        let message_count = topics.iter().map(|topic| topic.message_count).sum();
        let path = self.file_name.clone();
        Document {
            rosbag2_bagfile_information: Information {
                version: VERSION,
                storage_identifier: "mcap",
                duration,
                starting_time,
                message_count,
                topics_with_message_count: topics,
                compression_format: "",
                compression_mode: "",
                relative_file_paths: vec![path.clone()],
                files: vec![Part { path, starting_time, duration, message_count }],
                custom_data: None,
                ros_distro: "jazzy",
            },
        }
    }
}

fn refused(folder: &Path, problem: &dyn Display) -> BagWriteError {
    BagWriteError::Write { folder: folder.to_owned(), problem: problem.to_string() }
}

/// A folder beside the one that is to be, with the rights that folders have.
fn place_in(parent: &Path) -> std::io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o777));
    }
    builder.prefix(".surefoot-bag-").tempdir_in(parent)
}

/// `metadata.yaml`, field by field as rosbag2 names them.
#[derive(Serialize)]
struct Document {
    rosbag2_bagfile_information: Information,
}

#[derive(Serialize)]
struct Information {
    version: u32,
    storage_identifier: &'static str,
    duration: Duration,
    starting_time: StartingTime,
    message_count: u64,
    topics_with_message_count: Vec<Topic>,
    compression_format: &'static str,
    compression_mode: &'static str,
    relative_file_paths: Vec<String>,
    files: Vec<Part>,
    custom_data: Option<()>,
    ros_distro: &'static str,
}

#[derive(Clone, Copy, Serialize)]
struct Duration {
    nanoseconds: u64,
}

#[derive(Clone, Copy, Serialize)]
struct StartingTime {
    nanoseconds_since_epoch: u64,
}

#[derive(Clone, Serialize)]
struct Topic {
    topic_metadata: About,
    message_count: u64,
}

#[derive(Clone, Serialize)]
struct About {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    serialization_format: &'static str,
    /// None was heard: whoever plays the bag takes its own.
    offered_qos_profiles: [(); 0],
    type_description_hash: String,
}

#[derive(Serialize)]
struct Part {
    path: String,
    starting_time: StartingTime,
    duration: Duration,
    message_count: u64,
}

impl Topic {
    /// With its first message.
    fn of(topic: &BagTopic<'_>) -> Self {
        let topic_metadata = About {
            name: topic.name.to_owned(),
            kind: topic.kind.to_owned(),
            serialization_format: ENCODING,
            offered_qos_profiles: [],
            type_description_hash: topic.type_hash.to_owned(),
        };
        Self { topic_metadata, message_count: 1 }
    }
}
