//! What came in of the vehicle itself, in its order: what may enter, what the newest of it is, how the frame of the
//! localisation moved, and where the vehicle was at a time. Every part of the pipeline keeps one, so that all of them hold
//! the same of the same messages.

use std::collections::BTreeMap;

use bicycle::{MotionCommand, Odometry, SensorModel, StopReason};

use crate::frame::Frame;
use crate::guard::{Admitted, Guard, GuardConfig};
use crate::track::Track;
use crate::{Jump, MessageId, OdometryMessage, Whereabouts};

/// The odometry that was taken in, and what it says.
pub(crate) struct InputLedger {
    guard: Guard,
    sensors: SensorModel,
    track: Track,
    frame: Frame,
    /// The newest usable, as it was measured.
    measured: Option<Odometry>,
    /// The same, corrected.
    odometry: Option<Odometry>,
    fault: Option<StopReason>,
    last: MessageId,
    n_taken: u64,
}

impl InputLedger {
    /// Nothing has come in yet. Odometry is corrected by what is believed of the sensors before it is judged.
    pub fn new(config: &GuardConfig, sensors: SensorModel) -> Self {
        Self {
            guard: Guard::new(*config),
            sensors,
            track: Track::new(config),
            frame: Frame::default(),
            measured: None,
            odometry: None,
            fault: None,
            last: MessageId::default(),
            n_taken: 0,
        }
    }

    /// Takes in what came next. A vehicle that stood still on purpose when it was measured repeats itself rightly: what it
    /// was told then is what its message says.
    pub fn take<C: MotionCommand>(&mut self, message: &OdometryMessage<C>) -> Result<Admitted, StopReason> {
        (self.last, self.n_taken) = (message.id, self.n_taken + 1);
        self.guard.note_command(message.applied.command.speed_mps());
        self.admit(&message.odometry)
    }

    /// The same of odometry alone. What cannot be used is the fault until usable odometry comes.
    pub fn admit(&mut self, measured: &Odometry) -> Result<Admitted, StopReason> {
        let corrected = self.sensors.corrected(measured);
        let admitted = self.guard.admit_odometry(&corrected);
        self.fault = admitted.err();
        let admitted = admitted?;
        (self.measured, self.odometry) = (Some(*measured), Some(corrected));
        match admitted {
            Admitted::Again => return Ok(admitted),
            Admitted::Onward => {}
            Admitted::Jumped(jump) => {
                // The sensors' errors are the vehicle's own: they turn and move with it.
                self.track.follow(&jump);
                self.frame.note(corrected.valid_at_ns, &jump);
            }
            Admitted::ClockSetBack => {
                self.track.forget();
                self.frame.forget();
            }
        }
        self.track.note(measured);
        Ok(admitted)
    }

    /// Where the vehicle was when a scan was taken, as it was measured; or why that scan is none.
    pub fn place(&mut self, scan_at_ns: u64) -> Result<Whereabouts, StopReason> {
        self.guard.admit_scan(scan_at_ns)?;
        Ok(self.track.at(scan_at_ns))
    }

    /// Notes a scan that was usable.
    pub fn note_scan(&mut self, valid_at_ns: u64) {
        self.guard.note_scan(valid_at_ns);
    }

    /// Whether the vehicle may drive now on what has come in.
    pub fn check(&self, now_ns: u64) -> Result<(), StopReason> {
        self.fault.map_or_else(|| self.guard.check(now_ns), Err)
    }

    /// As the sensors would say it if they told the truth.
    pub fn corrected(&self, measured: &Odometry) -> Odometry {
        self.sensors.corrected(measured)
    }

    /// The newest usable odometry, corrected.
    pub fn odometry(&self) -> Option<&Odometry> {
        self.odometry.as_ref()
    }

    /// The same as it was measured.
    pub fn measured(&self) -> Option<&Odometry> {
        self.measured.as_ref()
    }

    /// When it was measured; jumps up to then are followed [ns].
    pub fn frame_at_ns(&self) -> u64 {
        self.odometry.map_or(0, |odometry| odometry.valid_at_ns)
    }

    /// How the frame has moved since this time; `None` when it has not.
    pub fn moved_since(&self, at_ns: u64) -> Option<Jump> {
        self.frame.since(at_ns)
    }

    /// How the frame of one time lies in that of another; `None` where both are the same.
    pub fn moved_between(&self, from_ns: u64, to_ns: u64) -> Option<Jump> {
        self.frame.shift(from_ns, to_ns)
    }

    /// The message that was taken in last, usable or not, and how many were since this was asked before.
    pub fn take_count(&mut self) -> (MessageId, u64) {
        (self.last, std::mem::take(&mut self.n_taken))
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        self.guard.refused()
    }
}
