//! A hash of the odometry that mapping takes in: mapping itself and a replay go through here.

use xxhash_rust::xxh3::Xxh3;

use bus::message::{OdometryRecord, Stamp};

/// What was taken in since the last map.
#[derive(Default)]
pub(crate) struct Intake(Xxh3);

impl Intake {
    /// Notes what came next.
    pub fn note(&mut self, stamp: &Stamp, record: &OdometryRecord) {
        self.0.update(bytemuck::bytes_of(stamp));
        self.0.update(bytemuck::bytes_of(record));
    }

    /// [`bus::message::SurfaceHeader::odometry_hash`] of what was noted since this was asked before.
    pub fn take_hash(&mut self) -> u64 {
        let hash = self.0.digest();
        self.0.reset();
        hash
    }
}

/// The same of these.
pub(crate) fn hash_of<'a>(taken: impl Iterator<Item = &'a (Stamp, OdometryRecord)>) -> u64 {
    let mut intake = Intake::default();
    taken.for_each(|(stamp, record)| intake.note(stamp, record));
    intake.take_hash()
}
