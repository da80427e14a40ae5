//! What a vehicle is told to do, as one object without clock or channel: orders come in, an instruction comes out.
//!
//! An order counts once, in the order in which it was said, and not for longer than its age limit. An emergency stop is
//! latched: nothing but a reset ends it, and a reset moves nothing.

use std::collections::BTreeMap;
use std::convert::Infallible;

use bicycle::{Decision, HoldReason, Odometry, StopReason};
use mppi::ReferencePath;
use traversability::CvarLevel;

use crate::{Areas, Destination, Route};

/// Speed below which a vehicle that is near its last goal has arrived: a little above the noise of odometry [m/s].
const STANDING_MPS: f64 = 0.15;

/// What the controller is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instruction<'a> {
    /// Drive there.
    Drive(Target<'a>),
    /// Stand, and why; no command is among the reasons.
    Stand(Decision<Infallible>),
}

/// Where to drive.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// To a place, on the best way.
    Goal(Destination),
    /// Along a path.
    Path(ReferencePath<'a>),
}

impl PartialEq for Target<'_> {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Goal(one), Self::Goal(other)) => one == other,
            (Self::Path(one), Self::Path(other)) => {
                (one.points_m, one.speed_mps, one.tolerance_m)
                    == (other.points_m, other.speed_mps, other.tolerance_m)
            }
            _ => false,
        }
    }
}

impl Target<'_> {
    /// The place that it leads to, and how near counts as there.
    pub fn end(&self) -> Destination {
        match self {
            Self::Goal(destination) => *destination,
            Self::Path(path) => Destination {
                goal_m: path.points_m.last().copied().unwrap_or([f64::NAN; 2]),
                tolerance_m: path.tolerance_m,
            },
        }
    }
}

/// What somebody who directs a vehicle says.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Drive this, whatever was to be driven before.
    Drive(Route),
    /// Stand until told to go on.
    Pause,
    /// Go on; also when an operator gives the wheel back.
    Resume,
    /// Stand; the mission is over.
    Cancel,
    /// An operator takes the wheel.
    TakeOver,
    /// Stop, until reset.
    EmergencyStop,
    /// The emergency is over. What was under way is paused.
    Reset,
    /// Plan for this share of the worst outcomes.
    Tolerate(CvarLevel),
}

/// Who said an order, and when, on the clock of the measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Said {
    /// When it was said [ns].
    pub at_ns: u64,
    /// Whoever said it: when that one began [ns].
    pub sender_ns: u64,
    /// Counts the orders of one sender.
    pub sequence: u64,
}

/// Why an order does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, thiserror::Error)]
pub enum OrderRefusal {
    /// It was said longer ago than orders may be old.
    #[error("it came too late to count")]
    Stale,
    /// Something that was said after it has been taken, or the same once.
    #[error("something that was said later has been taken already")]
    OutOfOrder,
    /// It claims to be of a time that is still to come.
    #[error("it claims to be of a time that is still to come")]
    FromFuture,
    /// The emergency stop has not been reset.
    #[error("the emergency stop is latched; `reset` ends it")]
    EmergencyStop,
    /// There is nothing to reset.
    #[error("there is no emergency stop to reset")]
    NoEmergencyStop,
    /// There is no mission.
    #[error("there is no mission under way")]
    NoMission,
    /// An operator has the wheel.
    #[error("an operator has the wheel; `resume` gives it back")]
    Manual,
    /// Its numbers make no order.
    #[error("its numbers make no order")]
    Malformed,
    /// It leads to where the vehicle may not be.
    #[error("it leads out of the geofence or into an area to keep out of")]
    OutOfArea,
}

impl OrderRefusal {
    /// All of them; messages number them from 1.
    pub const ALL: [Self; 9] = [
        Self::Stale,
        Self::OutOfOrder,
        Self::FromFuture,
        Self::EmergencyStop,
        Self::NoEmergencyStop,
        Self::NoMission,
        Self::Manual,
        Self::Malformed,
        Self::OutOfArea,
    ];
}

/// How far a mission is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// There has been none yet.
    Idle,
    /// Under way.
    Driving,
    /// Under way, and waiting.
    Paused,
    /// The vehicle stands at the end of the route.
    Reached,
    /// Somebody has cancelled it.
    Cancelled,
}

/// What a vehicle is told to do.
#[derive(Clone, Debug)]
pub struct Mission {
    order_age_max_ns: u64,
    areas: Areas,
    stage: Stage,
    route: Option<Route>,
    leg: usize,
    is_latched: bool,
    is_manual: bool,
    level: Option<CvarLevel>,
    number: u64,
    last: Said,
    reset_at_ns: u64,
    refused: BTreeMap<OrderRefusal, u64>,
}

impl Mission {
    /// No mission yet; orders count for so long after they were said [ns].
    pub fn new(order_age_max_ns: u64) -> Self {
        Self {
            order_age_max_ns,
            areas: Areas::default(),
            stage: Stage::Idle,
            route: None,
            leg: 0,
            is_latched: false,
            is_manual: false,
            level: None,
            number: 0,
            last: Said::default(),
            reset_at_ns: 0,
            refused: BTreeMap::new(),
        }
    }

    /// The same with the emergency stop latched, for whoever does not know what was ordered before.
    pub fn latched(self) -> Self {
        Self { is_latched: true, ..self }
    }

    /// The same for a vehicle that may not be everywhere.
    pub fn within(self, areas: Areas) -> Self {
        Self { areas, ..self }
    }

    /// Takes an order, or counts why it does not count.
    ///
    /// To stop is never wrong: an emergency stop counts however late it comes, unless it was said before a reset.
    pub fn order(&mut self, order: Order, said: Said, now_ns: u64) -> Result<(), OrderRefusal> {
        let taken = self.admit(&order, said, now_ns).and_then(|()| self.obey(order, said));
        match taken {
            // Whoever is ahead of the clock keeps nobody else out.
            Ok(()) => self.last = self.last.max(Said { at_ns: said.at_ns.min(now_ns), ..said }),
            Err(refusal) => self.note_refused(refusal),
        }
        taken
    }

    /// Counts an order that did not even get here.
    pub fn note_refused(&mut self, refusal: OrderRefusal) {
        *self.refused.entry(refusal).or_default() += 1;
    }

    /// Follows the vehicle along its route. Returns whether that changed what is to be done.
    pub fn advance(&mut self, odometry: &Odometry) -> bool {
        let Some(route) = self.route.as_ref().filter(|_| !self.is_latched && odometry.is_finite()) else {
            return false;
        };
        let [x_m, y_m, _] = odometry.position_m;
        let [ahead_mps, left_mps] = odometry.velocity_mps;
        let leg = route.next_leg(self.leg, [x_m, y_m]);
        let stands = libm::hypot(ahead_mps, left_mps) < STANDING_MPS;
        let is_there = stands && self.stage == Stage::Driving && route.is_end(leg, [x_m, y_m]);
        let has_changed = is_there || leg != self.leg;
        self.leg = leg;
        if is_there {
            self.end(Stage::Reached);
        }
        has_changed
    }

    /// What is to be done now.
    pub fn instruction(&self) -> Instruction<'_> {
        let hold = |reason| Instruction::Stand(Decision::Hold(reason));
        match (self.is_latched, self.is_manual, self.stage, self.target()) {
            (true, ..) => Instruction::Stand(Decision::Stop(StopReason::EmergencyStop)),
            (_, true, ..) => hold(HoldReason::Manual),
            (_, _, Stage::Driving, Some(target)) => Instruction::Drive(target),
            (_, _, Stage::Paused, _) => hold(HoldReason::Paused),
            _ => hold(HoldReason::NoMission),
        }
    }

    /// Where the mission leads next, whether or not it waits; `None` without one.
    pub fn target(&self) -> Option<Target<'_>> {
        self.route.as_ref().map(|route| route.target(self.leg))
    }

    /// How far it is.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Whether an emergency stop is latched.
    pub fn is_latched(&self) -> bool {
        self.is_latched
    }

    /// Whether an operator has the wheel.
    pub fn is_manual(&self) -> bool {
        self.is_manual
    }

    /// The share of worst outcomes to plan for, if anybody has said so.
    pub fn level(&self) -> Option<CvarLevel> {
        self.level
    }

    /// Missions so far.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The point of the route that is headed for, from 0, and how many there are.
    pub fn progress(&self) -> (usize, usize) {
        (self.leg, self.route.as_ref().map_or(0, |route| route.points_m().len()))
    }

    /// Orders that did not count, by reason.
    pub fn refused(&self) -> &BTreeMap<OrderRefusal, u64> {
        &self.refused
    }

    fn admit(&self, order: &Order, said: Said, now_ns: u64) -> Result<(), OrderRefusal> {
        if *order == Order::EmergencyStop {
            let is_settled = said.at_ns < self.reset_at_ns;
            return if is_settled { Err(OrderRefusal::OutOfOrder) } else { Ok(()) };
        }
        let is_again = said.sender_ns == self.last.sender_ns && said.sequence <= self.last.sequence;
        if said.at_ns > now_ns {
            Err(OrderRefusal::FromFuture)
        } else if now_ns - said.at_ns > self.order_age_max_ns {
            Err(OrderRefusal::Stale)
        } else if said.at_ns < self.last.at_ns || is_again {
            Err(OrderRefusal::OutOfOrder)
        } else {
            Ok(())
        }
    }

    fn obey(&mut self, order: Order, said: Said) -> Result<(), OrderRefusal> {
        match order {
            Order::EmergencyStop => self.stop(),
            Order::Reset => self.reset(said)?,
            Order::Tolerate(level) => self.level = Some(level),
            Order::Cancel => {
                self.require_mission()?;
                self.end(Stage::Cancelled);
            }
            _ if self.is_latched => return Err(OrderRefusal::EmergencyStop),
            Order::Drive(_) if self.is_manual => return Err(OrderRefusal::Manual),
            Order::Drive(route) => self.begin(route)?,
            Order::Pause => {
                self.require_mission()?;
                self.stage = Stage::Paused;
            }
            Order::Resume => self.resume()?,
            Order::TakeOver => self.is_manual = true,
        }
        Ok(())
    }

    fn begin(&mut self, route: Route) -> Result<(), OrderRefusal> {
        if !route.points_m().iter().all(|point_m| self.areas.allow(*point_m)) {
            return Err(OrderRefusal::OutOfArea);
        }
        self.leg = route.first_leg();
        self.route = Some(route);
        self.stage = Stage::Driving;
        self.number += 1;
        Ok(())
    }

    fn end(&mut self, stage: Stage) {
        (self.stage, self.route, self.leg) = (stage, None, 0);
    }

    /// Takes the wheel from everybody.
    fn stop(&mut self) {
        (self.is_latched, self.is_manual) = (true, false);
        if self.stage == Stage::Driving {
            self.stage = Stage::Paused;
        }
    }

    fn reset(&mut self, said: Said) -> Result<(), OrderRefusal> {
        if !std::mem::take(&mut self.is_latched) {
            return Err(OrderRefusal::NoEmergencyStop);
        }
        self.reset_at_ns = said.at_ns;
        Ok(())
    }

    fn resume(&mut self) -> Result<(), OrderRefusal> {
        if !std::mem::take(&mut self.is_manual) {
            self.require_mission()?;
        }
        if self.route.is_some() {
            self.stage = Stage::Driving;
        }
        Ok(())
    }

    fn require_mission(&self) -> Result<(), OrderRefusal> {
        if self.route.is_some() { Ok(()) } else { Err(OrderRefusal::NoMission) }
    }
}

#[cfg(test)]
mod tests;
