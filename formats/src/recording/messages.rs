//! The messages of a recording, whoever wrote them.

use std::fs::File;
use std::io::{BufReader, Result};
use std::path::Path;

use mcap::io::MessageReader;
use mcap::sans_io::LinearReaderOptions;

/// Longest record or chunk that is believed: far above what recorders write.
const RECORD_BYTES_MAX: u64 = 1 << 28;
/// LZ4, by which recordings are packed, never unpacks to more than this many times its input.
const UNPACKED_MAX: u64 = 255;

/// The messages of a recording from its beginning on. Each chunk is checked before its messages are given; what claims
/// to be longer than a file of this size can be, packed or not, is an error and takes no memory.
///
/// Errors: the file cannot be opened.
pub fn open_recording(path: &Path) -> Result<MessageReader<BufReader<File>>> {
    let file = File::open(path)?;
    let longest = file.metadata()?.len().saturating_mul(UNPACKED_MAX).min(RECORD_BYTES_MAX);
    let options = LinearReaderOptions::default()
        .with_record_length_limit(longest as usize)
        .with_prevalidate_chunk_crcs(true);
    Ok(MessageReader::new_with_options(BufReader::new(file), options))
}
