//! The messages of a recording, whoever wrote them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// Longest record or chunk that is believed: far above what recorders write.
const RECORD_BYTES_MAX: u64 = 1 << 28;
/// LZ4 never unpacks to more than this many times its input, and measurements packed with Zstandard do not either.
const UNPACKED_MAX: u64 = 255;

/// What the messages of a topic have in common.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordedChannel {
    /// Name of the topic.
    pub topic: String,
    /// Name of the schema; empty without one.
    pub schema: String,
    /// The schema itself, in its own encoding; empty without one.
    pub schema_data: Vec<u8>,
    /// How messages are encoded.
    pub encoding: String,
}

/// A message of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedMessage {
    /// Its channel.
    pub channel: Arc<RecordedChannel>,
    /// When it was recorded [ns].
    pub log_time_ns: u64,
    /// The message itself.
    pub data: Vec<u8>,
}

/// Why a recording cannot be read on. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read on.
    #[error(transparent)]
    File(#[from] io::Error),
    /// The records do not follow one another as records do.
    #[error(transparent)]
    Records(#[from] McapError),
    /// The content of a record.
    #[error("a record of kind {kind}: expected {expected}, found {n_bytes} bytes that are none")]
    Content {
        /// Its operation code.
        kind: u8,
        /// What it should be.
        expected: &'static str,
        /// Its length.
        n_bytes: usize,
    },
}

/// The messages of a recording from its beginning on; see [`open_recording`].
pub struct RecordingMessages {
    source: BufReader<File>,
    reader: LinearReader,
    catalogue: Catalogue,
    is_over: bool,
}

/// Opens a recording. Each chunk is checked before its messages are given; what claims to be longer than a file of this
/// size can be, packed or not, is an error and takes no memory.
///
/// Errors: the file cannot be opened.
pub fn open_recording(path: &Path) -> io::Result<RecordingMessages> {
    let file = File::open(path)?;
    let longest = file.metadata()?.len().saturating_mul(UNPACKED_MAX).min(RECORD_BYTES_MAX);
    let options = LinearReaderOptions::default()
        .with_record_length_limit(longest as usize)
        .with_prevalidate_chunk_crcs(true);
    Ok(RecordingMessages {
        source: BufReader::new(file),
        reader: LinearReader::new_with_options(options),
        catalogue: Catalogue::default(),
        is_over: false,
    })
}

impl RecordingMessages {
    fn read_on(&mut self) -> Result<Option<RecordedMessage>, RecordingError> {
        while let Some(event) = self.reader.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(n_bytes) => {
                    match self.source.read(self.reader.insert(n_bytes)) {
                        Ok(n_read) => self.reader.notify_read(n_read),
                        Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                        Err(error) => return Err(error.into()),
                    }
                }
                LinearReadEvent::Record { data, opcode } => {
                    if let Some(message) = self.catalogue.take(opcode, data)? {
                        return Ok(Some(message));
                    }
                }
            }
        }
        Ok(None)
    }
}

impl RecordingMessages {
    /// Hands every message to `take`, up to where the recording breaks off or `take` refuses one. Returns why it ended
    /// there; `None` of a recording that is whole.
    pub fn take_all(self, mut take: impl FnMut(RecordedMessage) -> Result<(), String>) -> Option<String> {
        let mut taken = self.map(|message| take(message.map_err(|error| error.to_string())?));
        taken.find_map(Result::err)
    }
}

impl Iterator for RecordingMessages {
    type Item = Result<RecordedMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let read = self.read_on().transpose();
        self.is_over = !matches!(read, Some(Ok(_)));
        read
    }
}

#[derive(Clone, Default)]
struct Schema {
    name: String,
    data: Vec<u8>,
}

/// The schemas and channels that were told of so far.
#[derive(Default)]
struct Catalogue {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Arc<RecordedChannel>>,
}

impl Catalogue {
    /// Takes in a record; gives the message if it is one. Lengths within a record are believed as far as it goes.
    fn take(&mut self, kind: u8, content: &[u8]) -> Result<Option<RecordedMessage>, RecordingError> {
        let refused = |expected| RecordingError::Content { kind, expected, n_bytes: content.len() };
        let mut fields = Fields(content);
        match kind {
            op::SCHEMA => {
                let (number, schema) = fields.schema().ok_or_else(|| refused("a schema"))?;
                self.schemas.insert(number, schema);
            }
            op::CHANNEL => {
                let (number, channel) = fields.channel(&self.schemas).ok_or_else(|| refused("a channel"))?;
                self.channels.insert(number, Arc::new(channel));
            }
            op::MESSAGE => {
                let message = fields.message(&self.channels);
                return message.map(Some).ok_or_else(|| refused("a message on a known channel"));
            }
            _ => {}
        }
        Ok(None)
    }
}

/// The fields of a record, one after the other.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        self.bytes(2)?.try_into().ok().map(u16::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.bytes(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// Bytes behind their number.
    fn counted(&mut self) -> Option<Vec<u8>> {
        let n_bytes = self.bytes(4)?.try_into().ok().map(u32::from_le_bytes)?;
        self.bytes(n_bytes as usize).map(<[u8]>::to_vec)
    }

    fn text(&mut self) -> Option<String> {
        String::from_utf8(self.counted()?).ok()
    }

    fn schema(&mut self) -> Option<(u16, Schema)> {
        let (number, name) = (self.u16()?, self.text()?);
        // How the schema is written.
        self.text()?;
        Some((number, Schema { name, data: self.counted()? }))
    }

    fn channel(&mut self, schemas: &BTreeMap<u16, Schema>) -> Option<(u16, RecordedChannel)> {
        let (number, schema) = (self.u16()?, self.u16()?);
        let Schema { name: schema, data: schema_data } = schemas.get(&schema).cloned().unwrap_or_default();
        let (topic, encoding) = (self.text()?, self.text()?);
        Some((number, RecordedChannel { topic, schema, schema_data, encoding }))
    }

    fn message(&mut self, channels: &BTreeMap<u16, Arc<RecordedChannel>>) -> Option<RecordedMessage> {
        let channel = Arc::clone(channels.get(&self.u16()?)?);
        // The sequence number of its writer.
        self.bytes(4)?;
        let log_time_ns = self.u64()?;
        // When it was published.
        self.u64()?;
        Some(RecordedMessage { channel, log_time_ns, data: self.0.to_vec() })
    }
}
