//! Between missions, orders and the messages that tell of them.

use navigator::{Mission, Order, OrderRefusal, Route, Said, Stage, Target};
use traversability::CvarLevel;

use crate::message::{MissionRecord, OrderHeader};

/// Numbers of [`MissionRecord::state`].
pub(crate) const DRIVE: u64 = 0;
pub(crate) const NONE: u64 = 1;
pub(crate) const PAUSED: u64 = 2;
pub(crate) const MANUAL: u64 = 3;
pub(crate) const EMERGENCY_STOP: u64 = 4;

/// Numbers of [`MissionRecord::outcome`].
pub(crate) const UNDER_WAY: u64 = 0;
pub(crate) const REACHED: u64 = 1;
pub(crate) const CANCELLED: u64 = 10;

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

impl MissionRecord {
    /// What a mission is at. Its time, and what became of orders, are left out.
    pub fn of(mission: &Mission) -> Self {
        let (leg, n_legs) = mission.progress();
        let record = Self {
            outcome: match mission.stage() {
                Stage::Idle | Stage::Driving | Stage::Paused => UNDER_WAY,
                Stage::Reached => REACHED,
                Stage::Cancelled => CANCELLED,
            },
            state: state_of(mission),
            number: mission.number(),
            leg: leg as u64,
            n_legs: n_legs as u64,
            alpha: mission.level().map_or(0.0, CvarLevel::get),
            n_refused: mission.refused().values().sum(),
            ..Self::default()
        };
        mission.target().map_or(record, |target| record.with_target(&target))
    }

    /// Where it leads, if it leads anywhere.
    pub fn destination_m(&self) -> Option<[f64; 2]> {
        (self.n_legs > 0 || self.state == DRIVE).then_some(self.goal_m)
    }

    /// The share of worst outcomes to plan for, if anybody has said so.
    pub fn level(&self) -> Option<CvarLevel> {
        CvarLevel::new(self.alpha).ok()
    }

    /// Whether the vehicle is to drive.
    pub fn is_driving(&self) -> bool {
        self.state == DRIVE && self.outcome == UNDER_WAY
    }

    fn with_target(mut self, target: &Target<'_>) -> Self {
        let end = target.end();
        (self.goal_m, self.tolerance_m) = (end.goal_m, end.tolerance_m);
        if let Target::Path(path) = target {
            self.path_speed_mps = path.speed_mps;
            self.n_corners = path.points_m.len() as u64;
            for (place, [x_m, y_m]) in path.points_m.iter().enumerate() {
                (self.corner_x_m[place], self.corner_y_m[place]) = (*x_m, *y_m);
            }
        }
        self
    }
}

fn state_of(mission: &Mission) -> u64 {
    match (mission.is_latched(), mission.is_manual(), mission.stage()) {
        (true, ..) => EMERGENCY_STOP,
        (_, true, _) => MANUAL,
        (.., Stage::Paused) => PAUSED,
        (.., Stage::Driving) => DRIVE,
        (.., Stage::Idle | Stage::Reached | Stage::Cancelled) => NONE,
    }
}

impl OrderHeader {
    /// An order as its message: header, without stamp, and points.
    pub fn of(order: &Order) -> (Self, &[[f64; 2]]) {
        let kind = |kind| (Self { kind, ..Self::default() }, NO_POINTS);
        match order {
            Order::Drive(route) => {
                let speed_mps = route.path_speed_mps();
                let header = Self {
                    kind: if speed_mps.is_some() { PATH } else { GOALS },
                    tolerance_m: route.tolerance_m(),
                    speed_mps: speed_mps.unwrap_or(0.0),
                    ..Self::default()
                };
                (header, route.points_m())
            }
            Order::Pause => kind(PAUSE),
            Order::Resume => kind(RESUME),
            Order::Cancel => kind(CANCEL),
            Order::TakeOver => kind(TAKE_OVER),
            Order::EmergencyStop => kind(STOP),
            Order::Reset => kind(RESET),
            Order::Tolerate(level) => (Self { alpha: level.get(), ..kind(TOLERATE).0 }, NO_POINTS),
        }
    }

    /// The order that a message tells of.
    pub fn order(&self, points_m: &[[f64; 2]]) -> Result<Order, OrderRefusal> {
        let malformed = |_| OrderRefusal::Malformed;
        let Self { tolerance_m, speed_mps, .. } = *self;
        Ok(match self.kind {
            GOALS => Order::Drive(Route::goals(points_m.to_vec(), tolerance_m).map_err(malformed)?),
            PATH => Order::Drive(Route::path(points_m.to_vec(), speed_mps, tolerance_m).map_err(malformed)?),
            PAUSE => Order::Pause,
            RESUME => Order::Resume,
            CANCEL => Order::Cancel,
            TAKE_OVER => Order::TakeOver,
            STOP => Order::EmergencyStop,
            RESET => Order::Reset,
            TOLERATE => Order::Tolerate(CvarLevel::new(self.alpha).map_err(|_| OrderRefusal::Malformed)?),
            _ => return Err(OrderRefusal::Malformed),
        })
    }

    /// Who said it, and when.
    pub fn said(&self) -> Said {
        let stamp = &self.stamp;
        Said { at_ns: stamp.valid_at_ns, sender_ns: stamp.epoch_ns, sequence: stamp.sequence }
    }
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
            let (header, points_m) = OrderHeader::of(&order);
            assert_eq!(header.order(points_m), Ok(order));
        }
        for kind in [0, 10, u64::MAX] {
            let header = OrderHeader { kind, ..OrderHeader::default() };
            assert_eq!(header.order(&[]), Err(OrderRefusal::Malformed), "{kind}");
        }
        let nowhere = OrderHeader { kind: GOALS, tolerance_m: 1.0, ..OrderHeader::default() };
        assert_eq!(nowhere.order(&[]), Err(OrderRefusal::Malformed));
        let reckless = OrderHeader { kind: TOLERATE, alpha: 0.0, ..OrderHeader::default() };
        assert_eq!(reckless.order(&[]), Err(OrderRefusal::Malformed));
    }

    #[test]
    fn every_verdict_survives_the_way() {
        for taken in OrderRefusal::ALL.map(Err).into_iter().chain([Ok(())]) {
            assert_eq!(taken_by(verdict_of(taken)), Some(taken));
        }
        assert_eq!([taken_by(9), taken_by(u64::MAX)], [None; 2]);
    }
}
