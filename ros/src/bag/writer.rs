//! Messages into a bag.

use std::collections::BTreeMap;
use std::path::Path;

use byteorder::LittleEndian;
use cdr_encoding::to_vec;
use formats::{BagTopic, BagWriteError, BagWriter};
use serde::Serialize;

use super::{one_line, type_name};
use crate::message::Defined;

/// What says that CDR follows, its numbers with their least byte first.
const CDR_LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// A message that cannot be written. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum MessageWriteError {
    /// The bag cannot be written.
    #[error(transparent)]
    Bag(#[from] BagWriteError),
    /// It has no form in CDR.
    #[error("{topic}: expected a message that CDR can hold, found: {problem}")]
    NoCdr {
        /// Its topic.
        topic: String,
        /// What the serialiser said.
        problem: String,
    },
}

/// Writes messages into a bag, each with its definition, so that no ROS is needed to read them.
pub struct MessageWriter(BagWriter);

impl MessageWriter {
    /// Begins a bag that becomes this folder, which must not be there yet.
    ///
    /// # Errors
    /// See [`BagWriteError`].
    pub fn create(folder: &Path) -> Result<Self, MessageWriteError> {
        Ok(Self(BagWriter::create(folder)?))
    }

    /// Writes a message that was heard at a time since 1970 [ns].
    ///
    /// # Errors
    /// See [`MessageWriteError`].
    pub fn write<M: Defined + Serialize>(
        &mut self,
        topic: &str,
        at_ns: u64,
        message: &M,
    ) -> Result<(), MessageWriteError> {
        let content = to_vec::<M, LittleEndian>(message).map_err(|error| MessageWriteError::NoCdr {
            topic: topic.to_owned(),
            problem: one_line(&error),
        })?;
        let kind = type_name::<M>();
        let of = BagTopic { name: topic, kind: &kind, definition: M::DEFINITION, type_hash: M::TYPE_HASH };
        Ok(self.0.write(&of, at_ns, &[&CDR_LITTLE_ENDIAN[..], &content].concat())?)
    }

    /// Completes the bag; returns how many messages each topic has.
    ///
    /// # Errors
    /// See [`BagWriteError`].
    pub fn finish(self) -> Result<BTreeMap<String, u64>, MessageWriteError> {
        Ok(self.0.finish()?)
    }
}
