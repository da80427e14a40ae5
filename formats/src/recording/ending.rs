//! The end of a recording whose last writes failed.

use std::fs::OpenOptions;
use std::io::{Result, Seek, SeekFrom, Write};
use std::path::Path;

/// "Data End" without a checksum, "Footer" without a summary, magic bytes: what every MCAP file ends with.
const END: [u8; 50] = {
    let mut bytes = [0; 50];
    // Operation code and length of each record, little-endian; everything in them may be zero.
    (bytes[0], bytes[1]) = (0x0f, 4);
    (bytes[13], bytes[14]) = (0x02, 20);
    let magic = *b"\x89MCAP0\r\n";
    let mut k = 0;
    while k < magic.len() {
        bytes[42 + k] = magic[k];
        k += 1;
    }
    bytes
};

/// Cuts a file back to so many bytes of whole records and ends it there.
pub(super) fn end_at(path: &Path, whole_bytes: u64) -> Result<()> {
    let mut file = OpenOptions::new().write(true).open(path)?;
    file.set_len(whole_bytes)?;
    file.seek(SeekFrom::End(0))?;
    if let Err(error) = file.write_all(&END) {
        file.set_len(whole_bytes)?;
        return Err(error);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::DriveRecorder;
    use super::*;
    use mcap::MessageStream;
    use terrain::Pose;

    #[test]
    fn a_file_that_broke_off_is_whole_again_up_to_its_last_flush() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.mcap");
        let mut recorder = DriveRecorder::create(&path, Default::default()).unwrap();
        recorder.pose(1, &Pose::default()).unwrap();
        recorder.flush().unwrap();
        let whole_bytes = std::fs::metadata(&path).unwrap().len();
        recorder.pose(2, &Pose::default()).unwrap();
        recorder.finish().unwrap();
        // The disk was full in the middle of the next record.
        OpenOptions::new().write(true).open(&path).unwrap().set_len(whole_bytes + 7).unwrap();
        end_at(&path, whole_bytes).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let messages: Vec<_> = MessageStream::new(&bytes).unwrap().collect();
        assert!(messages.iter().all(|message| message.is_ok()) && !messages.is_empty());
        assert!(messages.into_iter().all(|message| message.unwrap().log_time == 1));
        let footer = mcap::read::footer(&bytes).unwrap();
        assert_eq!(footer.summary_start, 0, "no index");
    }
}
