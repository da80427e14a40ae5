//! The odometry that mapping takes in, and what its maps say of it: mapping itself and a replay go through here.

use bicycle::{Odometry, StopReason};
use navigator::{Jump, Surveyor};
use xxhash_rust::xxh3::Xxh3;

use bus::message::{OdometryRecord, Source, Stamp, SurfaceHeader};

/// What was taken in since the last map.
#[derive(Default)]
pub(crate) struct Intake {
    last: Source,
    n: u64,
    hash: Xxh3,
    /// Of the newest odometry that could be used: jumps up to it are in the map [ns].
    frame_at_ns: u64,
}

impl Intake {
    /// Shows a surveyor what came next; returns the jump of the localisation that it makes out, which is still to be
    /// followed.
    pub fn show(
        &mut self,
        surveyor: &mut Surveyor,
        stamp: &Stamp,
        record: &OdometryRecord,
    ) -> Result<Option<Jump>, StopReason> {
        (self.last, self.n) = (stamp.source(), self.n + 1);
        update(&mut self.hash, stamp, record);
        surveyor.note_command(record.applied_speed_mps);
        let jump = surveyor.admit(&record.odometry(stamp.valid_at_ns))?;
        self.frame_at_ns = stamp.valid_at_ns;
        Ok(jump)
    }

    /// Writes into the header of the next map where the vehicle was, which jump that map follows, and from which odometry
    /// both were made out.
    pub fn tell(
        &mut self,
        surveyor: &Surveyor,
        odometry: &Odometry,
        jump: &Jump,
        header: &mut SurfaceHeader,
    ) {
        header.odometry = OdometryRecord::from(odometry);
        (header.odometry_at_ns, header.frame_at_ns) = (odometry.valid_at_ns, self.frame_at_ns);
        (header.last_odometry, header.n_odometry) = (self.last, self.n);
        header.odometry_hash = self.hash.digest();
        (header.jump_m, header.jump_yaw_rad) = (jump.step_m, jump.yaw_rad);
        let shift = surveyor.shift();
        (header.shift_m, header.shift_yaw_rad) = (shift.step_m, shift.yaw_rad);
        self.n = 0;
        self.hash.reset();
    }
}

/// The jump of the localisation that a map tells of.
pub(crate) fn jump_of(header: &SurfaceHeader) -> Jump {
    Jump { step_m: header.jump_m, yaw_rad: header.jump_yaw_rad }
}

/// All jumps so far together, as a map tells of them.
pub(crate) fn shift_of(header: &SurfaceHeader) -> Jump {
    Jump { step_m: header.shift_m, yaw_rad: header.shift_yaw_rad }
}

/// [`SurfaceHeader::odometry_hash`] of these.
pub(crate) fn hash_of<'a>(taken: impl Iterator<Item = &'a (Stamp, OdometryRecord)>) -> u64 {
    let mut hash = Xxh3::new();
    taken.for_each(|(stamp, record)| update(&mut hash, stamp, record));
    hash.digest()
}

fn update(hash: &mut Xxh3, stamp: &Stamp, record: &OdometryRecord) {
    hash.update(bytemuck::bytes_of(stamp));
    hash.update(bytemuck::bytes_of(record));
}
