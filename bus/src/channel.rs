//! Channels between the processes: publish and subscribe over shared memory, without a copy on the way.

mod bus;
mod failures;
mod inlet;
mod outlet;

use std::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

use crate::message::{
    CheckpointHeader, CommandRecord, DecisionRecord, FutureRecord, ImuRecord, MissionRecord, OdometryRecord,
    OrderHeader, PlanRecord, PointRecord, RiskHeader, ScanHeader, Stamp, StatusRecord, StuckRecord,
    SurfaceHeader, TrackRecord, TracksHeader,
};
use crate::payload;
pub use bus::{Bus, Cleared, RunName, RunNameError, free_shared_memory_bytes};
pub(crate) use inlet::FUTURE_NS;
pub use inlet::{Counts, Inlet, Message, Refusal};
pub use outlet::{Loan, Outlet};

/// A header that begins with a stamp.
pub trait Header: ZeroCopySend + bytemuck::Pod + Default + Debug + 'static {
    /// The stamp.
    fn stamp(&self) -> &Stamp;
    /// The stamp, to be filled by the outlet.
    fn stamp_mut(&mut self) -> &mut Stamp;
}

impl Header for Stamp {
    fn stamp(&self) -> &Stamp {
        self
    }
    fn stamp_mut(&mut self) -> &mut Stamp {
        self
    }
}

macro_rules! header {
    ($($name:ident),*) => { $(
        impl Header for $name {
            fn stamp(&self) -> &Stamp {
                &self.stamp
            }
            fn stamp_mut(&mut self) -> &mut Stamp {
                &mut self.stamp
            }
        }
    )* };
}
header!(ScanHeader, SurfaceHeader, TracksHeader, RiskHeader, CheckpointHeader, OrderHeader);

/// An element of a payload.
pub trait Element: ZeroCopySend + bytemuck::Pod + Default + Debug + 'static {}
impl<T: ZeroCopySend + bytemuck::Pod + Default + Debug + 'static> Element for T {}

/// One kind of message: its name, its types, how many are kept, and what makes one malformed.
pub struct Channel<H, T> {
    /// Name of the service.
    pub name: &'static str,
    /// Messages that wait for a subscriber; of more, the oldest is dropped.
    pub depth: usize,
    /// Messages that a reader which comes late is still given.
    pub history: usize,
    /// Processes of a run that read it, all of them and the live view. A [`Bus`] adds room for third parties.
    pub n_readers: usize,
    /// Refuses what no reader could use.
    pub check: fn(&H, &[T]) -> Result<(), Refusal>,
}

/// Readers of every channel beside the run's own, unless somebody asks for another number.
pub const THIRD_PARTIES: usize = 2;

/// Where the vehicle is: whoever runs the vehicle.
pub const ODOMETRY: Channel<Stamp, OdometryRecord> =
    Channel { name: "odometry", depth: 32, history: 0, n_readers: 6, check: payload::check_odometry };
/// What the inertial measurement unit feels, as many samples as have come since the last message: whoever runs the
/// vehicle.
pub const IMU: Channel<Stamp, ImuRecord> =
    Channel { name: "imu", depth: 32, history: 0, n_readers: 3, check: payload::check_imu };
/// What the range sensor sees: whoever runs the vehicle.
pub const SCAN: Channel<ScanHeader, PointRecord> =
    Channel { name: "scan", depth: 2, history: 0, n_readers: 2, check: payload::check_scan };
/// The map of the ground: mapping.
pub const SURFACE: Channel<SurfaceHeader, [f32; 8]> =
    Channel { name: "surface", depth: 2, history: 0, n_readers: 4, check: payload::check_surface };
/// What moves: mapping, after every scan, where the settings say how it is dealt with.
pub const TRACKS: Channel<TracksHeader, TrackRecord> =
    Channel { name: "tracks", depth: 4, history: 0, n_readers: 3, check: payload::check_tracks };
/// The risk map of what was learned: learning.
pub const RISK: Channel<RiskHeader, [f32; 4]> =
    Channel { name: "risk", depth: 1, history: 0, n_readers: 4, check: payload::check_risk };
/// The risk map of physics alone: mapping, while learning is silent.
pub const RISK_PHYSICS: Channel<RiskHeader, [f32; 4]> =
    Channel { name: "risk_physics", n_readers: 3, ..RISK };
/// What the vehicle shall do: control.
pub const COMMAND: Channel<Stamp, CommandRecord> =
    Channel { name: "command", depth: 32, history: 0, n_readers: 4, check: payload::check_command };
/// What each decision was made from: control.
pub const DECISION: Channel<Stamp, DecisionRecord> =
    Channel { name: "decision", depth: 16, history: 0, n_readers: 2, check: payload::check_anything };
/// The way that the last command begins, one place for each step of the plan, the vehicle's own first: control, with
/// every command to drive.
pub const PLAN: Channel<Stamp, PlanRecord> =
    Channel { name: "plan", depth: 1, history: 0, n_readers: 1, check: payload::check_plan };
/// Some of the futures that were tried for it, cheap and dear, for whoever wants to see them: control, twice a second while
/// it drives.
pub const FUTURES: Channel<Stamp, FutureRecord> =
    Channel { name: "futures", depth: 1, history: 0, n_readers: 1, check: payload::check_futures };
/// Where the vehicle got stuck: control.
pub const STUCK: Channel<Stamp, StuckRecord> =
    Channel { name: "stuck", depth: 8, history: 0, n_readers: 3, check: payload::check_stuck };
/// What the vehicle is told to do: mission, or whoever runs the vehicle. Decisions are made from the last that was said,
/// however long ago a reader came.
pub const MISSION: Channel<Stamp, MissionRecord> =
    Channel { name: "mission", depth: 2, history: 1, n_readers: 8, check: payload::check_mission };
/// What somebody who directs the vehicle says: one at a time, each for a moment.
pub const ORDER: Channel<OrderHeader, [f64; 2]> =
    Channel { name: "order", depth: 8, history: 0, n_readers: 2, check: payload::check_order };
/// Emergency stops, which wait for nobody who says something else.
pub const EMERGENCY_STOP: Channel<OrderHeader, [f64; 2]> =
    Channel { name: "emergency_stop", depth: 8, history: 0, n_readers: 2, check: payload::check_order };

/// Networks that were learned while driving: learning.
pub const CHECKPOINT: Channel<CheckpointHeader, u8> =
    Channel { name: "checkpoint", depth: 2, history: 0, n_readers: 1, check: payload::check_checkpoint };

/// How a process is doing. Several publish at once: one channel for each role.
pub const fn status_channel(name: &'static str) -> Channel<Stamp, StatusRecord> {
    Channel { name, depth: 2, history: 0, n_readers: 3, check: payload::check_anything }
}

/// Why a channel cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ChannelError {
    /// The process could not join the others.
    #[error("run {run}: expected to join its processes, found: {problem}")]
    Join {
        /// Name of the run.
        run: String,
        /// What the system said.
        problem: String,
    },
    /// The folder by which a user's processes find one another is not his alone.
    #[error("{folder}: expected a folder of user {user} and nobody else (mode 700), found {found}")]
    Folder {
        /// Its path.
        folder: String,
        /// Number of the user.
        user: u32,
        /// What is there.
        found: String,
    },
    /// A channel could not be opened, e.g. because another program made one of other types under its name.
    #[error("channel {channel}: expected to open it, found: {problem}")]
    Open {
        /// Its name.
        channel: &'static str,
        /// What the system said.
        problem: String,
    },
    /// The run has no such channel.
    #[error("channel {channel}: expected a process of the run that uses it, found none")]
    Absent {
        /// Its name.
        channel: &'static str,
    },
    /// Somebody else has the channel.
    #[error(
        "channel {channel}: expected to be its only publisher, found another process that publishes on it; end that \
         one first"
    )]
    Taken {
        /// Its name.
        channel: &'static str,
    },
    /// Its publisher may have died, and what it left behind cannot be cleared away.
    #[error(
        "channel {channel}: expected to clear away what dead processes left behind, found that of {n_failed} that could \
         not be removed; remove the folder of the run"
    )]
    Left {
        /// Its name.
        channel: &'static str,
        /// Dead processes whose files are still there.
        n_failed: u64,
    },
    /// Every place of a reader is taken.
    #[error(
        "channel {channel}: expected at most {n_readers} readers, found as many there before this one; start the run \
         with a higher --third-parties"
    )]
    Full {
        /// Its name.
        channel: &'static str,
        /// Places that it has.
        n_readers: usize,
    },
    /// A message could not be sent.
    #[error("channel {channel}: expected to send, found: {problem}")]
    Send {
        /// Its name.
        channel: &'static str,
        /// What the system said.
        problem: String,
    },
    /// There is too little shared memory.
    #[error(
        "shared memory {place}: expected {needed_mb:.0} MB free for this process, found {free_mb:.0} MB; in a \
         container, give it more, e.g. --shm-size 256m"
    )]
    Memory {
        /// Where it lies.
        place: &'static str,
        /// What the process may need [MB].
        needed_mb: f64,
        /// What there is [MB].
        free_mb: f64,
    },
}
