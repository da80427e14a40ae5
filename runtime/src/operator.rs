//! Whoever directs a run from outside: says one order and waits for what becomes of it.

use navigator::{Order, OrderRefusal};

use crate::mission::{header_of, taken_by};
use bus::channel::{Bus, ChannelError, EMERGENCY_STOP, MISSION, ORDER};
use bus::clock::{self, SECOND_NS};
use bus::message::MissionRecord;

/// How long an answer is waited for [ns]: a mission process looks every 5 ms, where it gets its turn.
const PATIENCE_NS: u64 = 5 * SECOND_NS;
/// Time between two looks whether there is one [ns].
const POLL_NS: u64 = SECOND_NS / 200;

/// Why an order has no effect.
#[derive(Debug, thiserror::Error)]
pub enum OperatorError {
    /// The channels.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// It was heard and does not count.
    #[error("refused: {0}")]
    Refused(OrderRefusal),
    /// Nobody answers.
    #[error(
        "expected an answer of the run's mission process within {} s, found none; whether it was heard is not known",
        PATIENCE_NS / SECOND_NS
    )]
    Unanswered,
    /// Something else answers.
    #[error("expected a verdict that this program knows, found number {0}")]
    Verdict(u64),
}

/// Says an order to a run, and returns what the vehicle is told to do from then on.
///
/// # Errors
/// It was refused, or nobody answered in time.
pub fn tell(bus: &Bus, order: &Order) -> Result<MissionRecord, OperatorError> {
    let channel = if *order == Order::EmergencyStop { &EMERGENCY_STOP } else { &ORDER };
    let (header, points_m) = header_of(order);
    let mut missions = bus.inlet(&MISSION)?;
    let mut outlet = bus.outlet(channel, points_m.len().max(1))?;
    let mut loan = outlet.write(points_m.len(), |place| points_m[place])?;
    *loan.header_mut() = header;
    let said = outlet.send(loan, clock::now_ns())?.source();
    let until_ns = clock::now_ns() + PATIENCE_NS;
    loop {
        // Before the look: what came while this process itself did not get its turn counts.
        let is_last = clock::now_ns() >= until_ns;
        let mut answer = None;
        missions.poll(|_, records| {
            answer = records.iter().find(|record| record.order == said).copied().or(answer)
        });
        match answer.map(|record| (record, taken_by(record.verdict))) {
            Some((record, Some(Ok(())))) => return Ok(record),
            Some((_, Some(Err(refusal)))) => return Err(OperatorError::Refused(refusal)),
            Some((record, None)) => return Err(OperatorError::Verdict(record.verdict)),
            None if is_last => return Err(OperatorError::Unanswered),
            None => {}
        }
        // The mission process may have come to the channel only now.
        outlet.welcome();
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
}
