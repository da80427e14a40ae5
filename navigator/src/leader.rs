//! The first word of the pipeline: orders and the way of the vehicle become what it is told to do.

use bicycle::{MotionCommand, SensorModel};

use crate::guard::GuardConfig;
use crate::input_ledger::InputLedger;
use crate::{MessageId, Mission, MissionMessage, OdometryMessage, Order, OrderRefusal, Said};

/// Keeps a mission and says when it is to be said again.
pub struct Leader {
    mission: Mission,
    ledger: InputLedger,
    period_ns: u64,
    told_at_ns: Option<u64>,
    has_changed: bool,
    stopwatch: Stopwatch,
}

impl Leader {
    /// Leads through a mission that is said again after `period_ns`, by odometry that these sensors misstate.
    pub fn new(mission: Mission, guard: &GuardConfig, sensors: SensorModel, period_ns: u64) -> Self {
        Self {
            mission,
            ledger: InputLedger::new(guard, sensors),
            period_ns,
            told_at_ns: None,
            has_changed: false,
            stopwatch: Stopwatch::default(),
        }
    }

    /// Follows the vehicle along its route; what no other part of the pipeline would use says nothing here.
    pub fn hear_odometry<C: MotionCommand>(&mut self, message: &OdometryMessage<C>) {
        if self.ledger.take(message).is_err() {
            return;
        }
        let Some(odometry) = self.ledger.odometry() else { return };
        self.stopwatch.run(&self.mission, odometry.valid_at_ns);
        self.has_changed |= self.mission.advance(odometry);
    }

    /// Takes an order, or counts why it does not count; what cannot be read is one that does not.
    pub fn hear_order(
        &mut self,
        order: Result<Order, OrderRefusal>,
        said: Said,
        now_ns: u64,
    ) -> Result<(), OrderRefusal> {
        self.has_changed = true;
        match order {
            Ok(order) => self.mission.order(order, said, now_ns),
            Err(refusal) => {
                self.mission.note_refused(refusal);
                Err(refusal)
            }
        }
    }

    /// Whether what the vehicle is told to do is to be said now: it changed, or was said long enough ago.
    pub fn is_due(&self, now_ns: u64) -> bool {
        let is_old = |at_ns: u64| now_ns.saturating_sub(at_ns) >= self.period_ns;
        self.has_changed || self.told_at_ns.is_none_or(is_old)
    }

    /// Says it, under this name.
    pub fn tell(&mut self, id: MessageId, now_ns: u64) -> MissionMessage {
        (self.told_at_ns, self.has_changed) = (Some(now_ns), false);
        MissionMessage::of(&self.mission, id, now_ns)
    }

    /// The mission.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// When the newest odometry was measured that could be used [ns].
    pub fn odometry_at_ns(&self) -> Option<u64> {
        self.ledger.odometry().map(|odometry| odometry.valid_at_ns)
    }

    /// Time of the mission: from the first odometry that it had until it was over [s].
    pub fn time_s(&self) -> f64 {
        self.stopwatch.time_s()
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Stopwatch {
    number: u64,
    began_ns: u64,
    until_ns: u64,
}

impl Stopwatch {
    fn run(&mut self, mission: &Mission, at_ns: u64) {
        if self.number != mission.number() {
            *self = Self { number: mission.number(), began_ns: at_ns, until_ns: at_ns };
        }
        if mission.target().is_some() {
            self.until_ns = at_ns;
        }
    }

    fn time_s(&self) -> f64 {
        self.until_ns.saturating_sub(self.began_ns) as f64 * 1e-9
    }
}

#[cfg(test)]
mod tests;
