//! Errands: goals of an action, each of which somebody waits for to end. They know neither network nor clock.
//!
//! A goal is ordered of the mission, and under way once that has answered with a number: from then on what the mission
//! says of that number tells how the goal ends, whoever ordered what else.

use std::cmp::Ordering;

use bus::clock::SECOND_NS;
use bus::message::MissionRecord;
use bus::message::mission::{CANCELLED, EMERGENCY_STOP, REACHED, UNDER_WAY};
use ros2_client::action::{GoalId, GoalStatusEnum};

use crate::orders::Ticket;

/// Goals that are not over, at the most.
const OPEN_MAX: usize = 8;
/// Goals whose ends are kept for whoever asks, at the most.
const OVER_MAX: usize = 32;
/// How long they are kept [ns].
const OVER_NS: u64 = 600 * SECOND_NS;
/// Those who wait for the end of one goal, at the most.
const ASKERS_MAX: usize = 8;
/// Time between two words of how far a goal is [ns].
const PROGRESS_NS: u64 = SECOND_NS / 2;
/// Time after which a mission that was not cancelled is told to be so again [ns].
const AGAIN_NS: u64 = SECOND_NS;

/// Why a goal is not accepted. Every message is one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ErrandError {
    /// It has been accepted before.
    #[error("goal_id: expected a new one, found that of a goal before")]
    Known,
    /// There are too many.
    #[error("goals: expected at most {OPEN_MAX} that are not over, found one more")]
    TooMany,
}

/// Why nothing is cancelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Uncancelled {
    /// There is no such goal.
    Unknown,
    /// It is over.
    Over,
}

/// A goal as it was accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Accepted {
    pub(crate) id: GoalId,
    /// Where it leads, east and north in the map [m].
    pub(crate) place_m: [f64; 2],
    /// When it was accepted [ns], and the same on the robot's clock.
    pub(crate) at_ns: u64,
    pub(crate) stamp_ns: i64,
}

/// How a goal ended.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ending {
    pub(crate) status: GoalStatusEnum,
    /// Why it was not reached, in one line; empty where it was.
    pub(crate) problem: String,
}

impl Ending {
    fn aborted(problem: impl Into<String>) -> Self {
        Self { status: GoalStatusEnum::Aborted, problem: problem.into() }
    }
}

/// Goals, and those who wait for their ends, who are told by what they asked by, an `R`.
pub(crate) struct Errands<R> {
    errands: Vec<Errand<R>>,
    told_at_ns: u64,
    has_news: bool,
}

struct Errand<R> {
    accepted: Accepted,
    stage: Stage,
    cancel: Option<Cancel>,
    askers: Vec<R>,
}

enum Stage {
    /// The mission has not answered yet.
    Ordered(Ticket),
    /// It is the mission of this number, and, if heard, has been said to be so.
    UnderWay { number: u64, is_heard: bool },
    /// It ended then [ns].
    Over { ending: Ending, at_ns: u64, is_noted: bool },
}

/// What becomes of a wish to cancel.
#[derive(Clone, Copy, PartialEq)]
enum Cancel {
    /// It waits for that time [ns], and for orders up to this one, which may have taken the goal's place meanwhile: theirs
    /// are not to be cancelled.
    Due { from_ns: u64, behind: Ticket },
    /// The mission has been told.
    Ordered(Ticket),
}

impl<R> Default for Errands<R> {
    fn default() -> Self {
        Self { errands: Vec::new(), told_at_ns: 0, has_news: true }
    }
}

impl<R> Errands<R> {
    /// Whether there is room for a goal of this name.
    pub(crate) fn admit(&self, id: GoalId) -> Result<(), ErrandError> {
        let n_open = self.errands.iter().filter(|errand| !errand.is_over()).count();
        match self.errands.iter().any(|errand| errand.accepted.id == id) {
            true => Err(ErrandError::Known),
            false if n_open >= OPEN_MAX => Err(ErrandError::TooMany),
            false => Ok(()),
        }
    }

    /// A goal that was admitted has been ordered.
    pub(crate) fn begin(&mut self, accepted: Accepted, order: Ticket) {
        let stage = Stage::Ordered(order);
        self.errands.push(Errand { accepted, stage, cancel: None, askers: Vec::new() });
        self.has_news = true;
    }

    /// Goals that are to be cancelled from now on: the one that is named, and those up to a stamp that is not 0; all, if
    /// neither is told. `last` is the newest order.
    pub(crate) fn cancel(
        &mut self,
        id: GoalId,
        stamp_ns: i64,
        now_ns: u64,
        last: Ticket,
    ) -> Result<Vec<Accepted>, Uncancelled> {
        let is_all = id == GoalId::ZERO && stamp_ns == 0;
        let is_meant = |one: &Accepted| is_all || one.id == id || one.stamp_ns <= stamp_ns && stamp_ns != 0;
        let is_known = self.errands.iter().any(|errand| errand.accepted.id == id);
        let meant = self.errands.iter_mut().filter(|errand| is_meant(&errand.accepted) && !errand.is_over());
        let mut cancelled = Vec::new();
        for errand in meant {
            errand.cancel.get_or_insert(Cancel::Due { from_ns: now_ns, behind: last });
            cancelled.push(errand.accepted);
        }
        self.has_news |= !cancelled.is_empty();
        match is_known {
            _ if !cancelled.is_empty() || id == GoalId::ZERO => Ok(cancelled),
            true => Err(Uncancelled::Over),
            false => Err(Uncancelled::Unknown),
        }
    }

    /// Has the mission cancelled if that is due, once orders up to `answered` are answered. `order` gives the order, if
    /// there is room for it.
    pub(crate) fn cancel_due(
        &mut self,
        now_ns: u64,
        answered: Ticket,
        order: impl FnOnce() -> Option<Ticket>,
    ) {
        let is_under_way = |errand: &&mut Errand<R>| matches!(errand.stage, Stage::UnderWay { .. });
        let Some(errand) = self.errands.iter_mut().find(is_under_way) else { return };
        match errand.cancel {
            Some(Cancel::Due { from_ns, behind }) if now_ns >= from_ns && answered >= behind => {
                let again = Cancel::Due { from_ns: now_ns + AGAIN_NS, behind };
                errand.cancel = Some(order().map_or(again, Cancel::Ordered));
            }
            _ => {}
        }
    }

    /// An order has been answered.
    pub(crate) fn note_answer(&mut self, ticket: Ticket, said: &Result<MissionRecord, String>, now_ns: u64) {
        for errand in self.errands.iter_mut().filter(|errand| !errand.is_over()) {
            match (&errand.stage, said) {
                (Stage::Ordered(own), Ok(mission)) if *own == ticket => {
                    errand.stage = Stage::UnderWay { number: mission.number, is_heard: false };
                    self.has_news = true;
                }
                (Stage::Ordered(own), Err(problem)) if *own == ticket => {
                    errand.end(Ending::aborted(problem), now_ns);
                    self.has_news = true;
                }
                (_, Err(_)) if errand.cancel == Some(Cancel::Ordered(ticket)) => {
                    errand.cancel = Some(Cancel::Due { from_ns: now_ns + AGAIN_NS, behind: ticket });
                }
                _ => {}
            }
        }
        // Answers come by another way than what the mission says, and no later.
        if let Ok(mission) = said {
            self.judge(mission, now_ns);
        }
    }

    /// Follows what the mission says.
    pub(crate) fn follow(&mut self, mission: &MissionRecord, now_ns: u64) {
        for errand in &mut self.errands {
            match &mut errand.stage {
                Stage::UnderWay { number, is_heard } if *number == mission.number => *is_heard = true,
                _ => {}
            }
        }
        self.judge(mission, now_ns);
    }

    fn judge(&mut self, mission: &MissionRecord, now_ns: u64) {
        for errand in &mut self.errands {
            if let Some(ending) = errand.ending(mission) {
                errand.end(ending, now_ns);
                self.has_news = true;
            }
        }
    }

    /// Somebody asks how a goal ends: told at once if it is over or there is none, else by [`Self::take_told`].
    pub(crate) fn ask(&mut self, id: GoalId, asker: R) -> Option<Ending> {
        let Some(errand) = self.errands.iter_mut().find(|errand| errand.accepted.id == id) else {
            let problem = "goal_id: expected that of a goal that is kept, found another".to_owned();
            return Some(Ending { status: GoalStatusEnum::Unknown, problem });
        };
        if let Stage::Over { ending, .. } = &errand.stage {
            return Some(ending.clone());
        }
        if errand.askers.len() == ASKERS_MAX {
            errand.askers.remove(0);
        }
        errand.askers.push(asker);
        None
    }

    /// Those who are to be told of an end now.
    pub(crate) fn take_told(&mut self) -> Vec<(R, Ending)> {
        let mut told = Vec::new();
        for errand in &mut self.errands {
            if let Stage::Over { ending, .. } = &errand.stage {
                told.extend(errand.askers.drain(..).map(|asker| (asker, ending.clone())));
            }
        }
        told
    }

    /// Why goals were not reached that have ended since the last look.
    pub(crate) fn problems(&mut self) -> Vec<String> {
        let mut problems = Vec::new();
        for errand in &mut self.errands {
            let Stage::Over { ending, is_noted, .. } = &mut errand.stage else { continue };
            if !std::mem::replace(is_noted, true) && !ending.problem.is_empty() {
                problems.push(ending.problem.clone());
            }
        }
        problems
    }

    /// The goal that is under way, when it is due to be told how far it is.
    pub(crate) fn progress(&mut self, now_ns: u64) -> Option<Accepted> {
        let is_under_way = |errand: &&Errand<R>| matches!(errand.stage, Stage::UnderWay { .. });
        let errand = self.errands.iter().find(is_under_way)?;
        let is_due = now_ns.saturating_sub(self.told_at_ns) >= PROGRESS_NS;
        is_due.then(|| {
            self.told_at_ns = now_ns;
            errand.accepted
        })
    }

    /// How all goals that are kept stand, if that has changed since the last look.
    pub(crate) fn news(&mut self, now_ns: u64) -> Option<Vec<(Accepted, GoalStatusEnum)>> {
        self.forget(now_ns);
        let status = |errand: &Errand<R>| (errand.accepted, errand.status());
        std::mem::take(&mut self.has_news).then(|| self.errands.iter().map(status).collect())
    }

    /// Leaves out what ended too long ago, or too many goals ago.
    fn forget(&mut self, now_ns: u64) {
        let n_over = self.errands.iter().filter(|errand| errand.is_over()).count();
        let mut n_left = n_over.saturating_sub(OVER_MAX);
        let n_before = self.errands.len();
        self.errands.retain(|errand| match errand.stage {
            Stage::Over { at_ns, .. } => {
                let is_too_many = n_left > 0;
                n_left -= usize::from(is_too_many);
                !is_too_many && now_ns.saturating_sub(at_ns) < OVER_NS
            }
            Stage::Ordered(_) | Stage::UnderWay { .. } => true,
        });
        self.has_news |= self.errands.len() != n_before;
    }
}

impl<R> Errand<R> {
    fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Over { .. })
    }

    fn status(&self) -> GoalStatusEnum {
        match &self.stage {
            Stage::Over { ending, .. } => ending.status,
            _ if self.cancel.is_some() => GoalStatusEnum::Canceling,
            Stage::Ordered(_) => GoalStatusEnum::Accepted,
            Stage::UnderWay { .. } => GoalStatusEnum::Executing,
        }
    }

    /// How it ends by what the mission says, if it does.
    fn ending(&self, mission: &MissionRecord) -> Option<Ending> {
        let Stage::UnderWay { number, is_heard } = self.stage else { return None };
        match (mission.number.cmp(&number), mission.state, mission.outcome) {
            (Ordering::Greater, ..) => Some(Ending::aborted("another goal or path has taken its place")),
            // What was said before the goal was ordered may come after the answer, but a mission that begins anew is latched.
            (Ordering::Less, state, _) if is_heard || state == EMERGENCY_STOP => {
                Some(Ending::aborted("mission lost: whoever led it has begun anew"))
            }
            (Ordering::Less, ..) => None,
            (Ordering::Equal, _, REACHED) => {
                Some(Ending { status: GoalStatusEnum::Succeeded, problem: String::new() })
            }
            (Ordering::Equal, _, CANCELLED) => Some(Ending::aborted("the mission was cancelled")),
            (Ordering::Equal, EMERGENCY_STOP, _) => Some(Ending::aborted("emergency stop")),
            (Ordering::Equal, _, UNDER_WAY) => None,
            (Ordering::Equal, _, outcome) => {
                Some(Ending::aborted(format!("the mission was given up, with outcome {outcome}")))
            }
        }
    }

    /// Whoever wanted it cancelled gets what was wanted, unless it was reached before.
    fn end(&mut self, mut ending: Ending, at_ns: u64) {
        if self.cancel.is_some() && ending.status == GoalStatusEnum::Aborted {
            ending.status = GoalStatusEnum::Canceled;
        }
        self.stage = Stage::Over { ending, at_ns, is_noted: false };
    }
}

#[cfg(test)]
mod tests;
