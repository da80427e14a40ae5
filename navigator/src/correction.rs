//! Whoever stands between the controller and the vehicle and corrects commands for the ground under the wheels.

use bicycle::{Command, Decision, ImuSample, MotionCommand, Odometry};
use kinodynamics::Corrector;

use crate::message::Correction;
use crate::{Admitted, MessageId};

/// A corrector with the unit's messages that it hears. Without one, messages are counted and decisions pass as they are.
pub(crate) struct Between {
    corrector: Option<Corrector>,
    last: MessageId,
    n_taken: u64,
}

impl Between {
    pub fn new(corrector: Option<Corrector>) -> Self {
        Self { corrector, last: MessageId::default(), n_taken: 0 }
    }

    pub fn corrector(&self) -> Option<&Corrector> {
        self.corrector.as_ref()
    }

    /// Takes in a message of the unit. Where one before it was lost everything begins anew with it: what a decision was
    /// made from is then told by the messages since.
    pub fn hear_imu(&mut self, id: MessageId, samples: impl IntoIterator<Item = ImuSample>) {
        let Some(corrector) = &mut self.corrector else { return };
        let follows = id.epoch_ns == self.last.epoch_ns && id.sequence == self.last.sequence.wrapping_add(1);
        if !follows {
            corrector.forget();
            self.n_taken = 0;
        }
        samples.into_iter().for_each(|sample| corrector.sense(&[sample]));
        self.last = id;
        self.n_taken += 1;
    }

    /// Clocks that are set back leave nothing to go on from.
    pub fn note(&mut self, admitted: Admitted) {
        if let (Admitted::ClockSetBack, Some(corrector)) = (admitted, &mut self.corrector) {
            corrector.forget();
        }
    }

    /// The message that was taken in last, and how many were since this was asked before.
    pub fn take_count(&mut self) -> (MessageId, u64) {
        (self.last, std::mem::take(&mut self.n_taken))
    }

    /// The decision as it goes to the vehicle, with what became of it.
    pub fn correct<C: MotionCommand>(
        &mut self,
        decision: Decision<C>,
        odometry: Option<&Odometry>,
        now_ns: u64,
    ) -> (Decision<C>, Option<Correction<C>>) {
        let Some(corrector) = &mut self.corrector else { return (decision, None) };
        let (Decision::Drive(planned), Some(odometry)) = (decision, odometry) else {
            corrector.rest();
            return (decision, None);
        };
        let [speed_mps, steering_rad] = planned.into();
        let corrected = corrector.correct(Command { speed_mps, steering_rad }, odometry, now_ns);
        let Command { speed_mps, steering_rad } = corrected.command;
        let command = C::from([speed_mps, steering_rad]);
        (Decision::Drive(command), Some(Correction { planned, corrected }))
    }
}
