//! Between missions, orders and the messages that tell of them.

use navigator::{Mission, MissionMessage, Order, OrderRefusal, Route, Said, Stage};
use traversability::CvarLevel;

use crate::convert::mission_record;
use bus::message::mission::{CANCELLED, REACHED, UNDER_WAY};
use bus::message::{MissionRecord, OrderHeader};

/// Numbers of [`OrderHeader::kind`].
const GOALS: u64 = 1;
const PATH: u64 = 2;
const PAUSE: u64 = 3;
const RESUME: u64 = 4;
const CANCEL: u64 = 5;
const TAKE_OVER: u64 = 6;
const STOP: u64 = 7;
const RESET: u64 = 8;
const TOLERATE: u64 = 9;

/// Of orders that lead nowhere.
const NO_POINTS: &[[f64; 2]] = &[];

/// What a mission is at, as `told` of it. Its time, and what became of orders, are left out.
pub fn record_of(mission: &Mission, told: &MissionMessage) -> MissionRecord {
    let (leg, n_legs) = mission.progress();
    MissionRecord {
        outcome: match mission.stage() {
            Stage::Idle | Stage::Driving | Stage::Paused => UNDER_WAY,
            Stage::Reached => REACHED,
            Stage::Cancelled => CANCELLED,
        },
        number: mission.number(),
        leg: leg as u64,
        n_legs: n_legs as u64,
        n_refused: mission.refused().values().sum(),
        ..mission_record(told)
    }
}

/// An order as its message: header, without stamp, and points.
pub fn header_of(order: &Order) -> (OrderHeader, &[[f64; 2]]) {
    let kind = |kind| (OrderHeader { kind, ..OrderHeader::default() }, NO_POINTS);
    match order {
        Order::Drive(route) => {
            let speed_mps = route.path_speed_mps();
            let header = OrderHeader {
                kind: if speed_mps.is_some() { PATH } else { GOALS },
                tolerance_m: route.tolerance_m(),
                speed_mps: speed_mps.unwrap_or(0.0),
                ..OrderHeader::default()
            };
            (header, route.points_m())
        }
        Order::Pause => kind(PAUSE),
        Order::Resume => kind(RESUME),
        Order::Cancel => kind(CANCEL),
        Order::TakeOver => kind(TAKE_OVER),
        Order::EmergencyStop => kind(STOP),
        Order::Reset => kind(RESET),
        Order::Tolerate(level) => (OrderHeader { alpha: level.get(), ..kind(TOLERATE).0 }, NO_POINTS),
    }
}

/// The order that a message tells of.
pub fn order_of(header: &OrderHeader, points_m: &[[f64; 2]]) -> Result<Order, OrderRefusal> {
    let malformed = |_| OrderRefusal::Malformed;
    let OrderHeader { tolerance_m, speed_mps, .. } = *header;
    Ok(match header.kind {
        GOALS => Order::Drive(Route::goals(points_m.to_vec(), tolerance_m).map_err(malformed)?),
        PATH => Order::Drive(Route::path(points_m.to_vec(), speed_mps, tolerance_m).map_err(malformed)?),
        PAUSE => Order::Pause,
        RESUME => Order::Resume,
        CANCEL => Order::Cancel,
        TAKE_OVER => Order::TakeOver,
        STOP => Order::EmergencyStop,
        RESET => Order::Reset,
        TOLERATE => Order::Tolerate(CvarLevel::new(header.alpha).map_err(|_| OrderRefusal::Malformed)?),
        _ => return Err(OrderRefusal::Malformed),
    })
}

/// Who said it, and when.
pub fn said_by(header: &OrderHeader) -> Said {
    let stamp = &header.stamp;
    Said { at_ns: stamp.valid_at_ns, sender_ns: stamp.epoch_ns, sequence: stamp.sequence }
}

/// What became of an order, as [`MissionRecord::verdict`].
pub(crate) fn verdict_of(taken: Result<(), OrderRefusal>) -> u64 {
    let number = |refusal| OrderRefusal::ALL.iter().position(|known| *known == refusal);
    taken.err().and_then(number).map_or(0, |place| place as u64 + 1)
}

/// What a verdict says; `None` for a number that is none.
pub(crate) fn taken_by(verdict: u64) -> Option<Result<(), OrderRefusal>> {
    let place = match verdict.checked_sub(1) {
        None => return Some(Ok(())),
        Some(place) => usize::try_from(place).ok()?,
    };
    OrderRefusal::ALL.get(place).map(|refusal| Err(*refusal))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::convert::mission_message;
    use bus::message::Stamp;
    use navigator::MessageId;

    fn orders() -> Vec<Order> {
        let points_m = vec![[1.0, 2.0], [30.0, 4.0]];
        vec![
            Order::Drive(Route::goals(points_m.clone(), 0.5).unwrap()),
            Order::Drive(Route::path(points_m, 0.7, 0.5).unwrap()),
            Order::Pause,
            Order::Resume,
            Order::Cancel,
            Order::TakeOver,
            Order::EmergencyStop,
            Order::Reset,
            Order::Tolerate(CvarLevel::new(0.25).unwrap()),
        ]
    }

    #[test]
    fn every_order_survives_the_way_and_numbers_that_are_none_are_refused() {
        for order in orders() {
            let (header, points_m) = header_of(&order);
            assert_eq!(order_of(&header, points_m), Ok(order));
        }
        for kind in [0, 10, u64::MAX] {
            let header = OrderHeader { kind, ..OrderHeader::default() };
            assert_eq!(order_of(&header, &[]), Err(OrderRefusal::Malformed), "{kind}");
        }
        let nowhere = OrderHeader { kind: GOALS, tolerance_m: 1.0, ..OrderHeader::default() };
        assert_eq!(order_of(&nowhere, &[]), Err(OrderRefusal::Malformed));
        let reckless = OrderHeader { kind: TOLERATE, alpha: 0.0, ..OrderHeader::default() };
        assert_eq!(order_of(&reckless, &[]), Err(OrderRefusal::Malformed));
    }

    /// What control hears is what the mission says, whatever was ordered.
    #[test]
    fn every_mission_survives_the_way() {
        let mut mission = Mission::new(0);
        for (place, order) in orders().into_iter().enumerate() {
            let said = Said { sequence: place as u64 + 1, ..Said::default() };
            mission.order(order.clone(), said, 0).ok();
            let stamp = Stamp { epoch_ns: 3, sequence: 4, valid_at_ns: 5, ..Stamp::default() };
            let told = MissionMessage::of(&mission, MessageId { epoch_ns: 3, sequence: 4 }, 5);
            assert_eq!(mission_message(&stamp, &record_of(&mission, &told)), told, "{order:?}");
        }
    }

    #[test]
    fn every_verdict_survives_the_way() {
        for taken in OrderRefusal::ALL.map(Err).into_iter().chain([Ok(())]) {
            assert_eq!(taken_by(verdict_of(taken)), Some(taken));
        }
        assert_eq!([taken_by(10), taken_by(u64::MAX)], [None; 2]);
    }
}
