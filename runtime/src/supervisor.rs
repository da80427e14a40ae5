//! Keeps the processes of a run alive, and shows how they are doing.

mod status_line;

pub use status_line::StatusLine;

use std::process::{Child, Command, ExitStatus};

use bicycle::Decision;
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;

use crate::RuntimeError;
use crate::timing::{ControlTiming, Timing};
use crate::usage::{ProcessUsage, Usage};
use bus::channel::{Bus, DECISION, Inlet, MISSION};
use bus::clock::{self, SECOND_NS};
use bus::message::mission::UNDER_WAY;
use bus::message::{DecisionRecord, MissionRecord, Stamp, StatusRecord};
use bus::status::Role;

/// How soon and how often what died is started again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RestartPolicy {
    /// Restarts within `window_ns`; at the next death the run is given up.
    pub restarts_max: usize,
    /// See `restarts_max` [ns].
    pub window_ns: u64,
    /// Wait before the first restart; each one that follows within the window doubles it [ns].
    pub back_off_ns: u64,
    /// Longest wait before a restart [ns].
    pub back_off_max_ns: u64,
}

impl Default for RestartPolicy {
    fn default() -> Self {
        Self {
            restarts_max: 8,
            window_ns: 60 * SECOND_NS,
            back_off_ns: SECOND_NS / 5,
            back_off_max_ns: 5 * SECOND_NS,
        }
    }
}

/// Time between two looks [ns].
const POLL_NS: u64 = SECOND_NS / 50;
/// Time that the others wait for the recorder, so that it misses nothing that they hear [ns].
const RECORDER_PATIENCE_NS: u64 = 10 * SECOND_NS;
/// Time that processes have to end when they are told to [ns].
const PATIENCE_NS: u64 = 3 * SECOND_NS;

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// The vehicle's process ended of itself, with this exit code.
    Plant(i32),
    /// The mission is over, with this [`MissionRecord::outcome`].
    MissionOver(u64),
    /// The user ended it.
    Interrupted,
    /// A process refused its input, or kept dying.
    GaveUp {
        /// Which.
        role: Role,
        /// Why.
        why: String,
    },
}

/// Whether a process begins a run or takes the place of one that has died.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// It begins.
    First,
    /// Another was there before it.
    Again,
}

/// What a run has to tell while it goes on.
#[derive(Clone, Copy, Debug)]
pub enum Told<'a> {
    /// How every process is doing, and what the mission's process said last; once a second.
    Statuses(&'a [StatusLine], Option<&'a MissionRecord>),
    /// A process has died and is started again.
    Died {
        /// Which.
        role: Role,
        /// Of what.
        status: ExitStatus,
        /// The wait before it is started again [ns].
        wait_ns: u64,
    },
    /// Control has decided to do something else, or for another reason, than before.
    Decided(Decision),
}

/// A process that is kept alive.
struct Kept {
    role: Role,
    child: Option<Child>,
    deaths_at_ns: Vec<u64>,
    due_at_ns: u64,
    status: Inlet<Stamp, StatusRecord>,
    last: Option<(Stamp, StatusRecord)>,
    usage: Usage,
}

/// How a run kept its times, and what its processes took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunReport {
    /// Control's times; `None` when nothing was decided.
    pub control: Option<ControlTiming>,
    /// Every process.
    pub processes: Vec<ProcessUsage>,
}

/// The processes of a run.
pub struct Supervisor<'a> {
    kept: Vec<Kept>,
    missions: Inlet<Stamp, MissionRecord>,
    mission: Option<MissionRecord>,
    decisions: Inlet<Stamp, DecisionRecord>,
    timing: Timing,
    decided: Option<Decision>,
    policy: RestartPolicy,
    command: &'a dyn Fn(Role, Start) -> Command,
    unended: Vec<String>,
    /// Whether the run is over when the mission is.
    ends_with_mission: bool,
    began_at_ns: u64,
}

impl<'a> Supervisor<'a> {
    /// A supervisor of these roles, each started by its command.
    pub fn new(
        bus: &Bus,
        roles: &[Role],
        policy: RestartPolicy,
        command: &'a dyn Fn(Role, Start) -> Command,
    ) -> Result<Self, RuntimeError> {
        let kept = |&role: &Role| {
            let status = bus.inlet(&role.status())?;
            Ok(Kept {
                role,
                child: None,
                deaths_at_ns: Vec::new(),
                due_at_ns: 0,
                status,
                last: None,
                usage: Usage::default(),
            })
        };
        Ok(Self {
            kept: roles.iter().map(kept).collect::<Result<_, RuntimeError>>()?,
            missions: bus.inlet(&MISSION)?,
            mission: None,
            decisions: bus.inlet(&DECISION)?,
            timing: Timing::default(),
            decided: None,
            policy,
            command,
            unended: Vec::new(),
            ends_with_mission: false,
            began_at_ns: clock::now_ns(),
        })
    }

    /// The same for a run that ends when its mission does, because no process of a vehicle says when.
    pub fn until_the_mission_is_over(self) -> Self {
        Self { ends_with_mission: true, ..self }
    }

    /// Keeps them going until the vehicle's process ends, one cannot be kept, or `is_over`; `tell` is given what
    /// happens meanwhile. Ends them all before it returns.
    pub fn run(&mut self, is_over: &dyn Fn() -> bool, tell: &mut dyn FnMut(Told<'_>)) -> RunEnd {
        let mut shown_at_ns = clock::now_ns();
        let end = loop {
            let now_ns = clock::now_ns();
            if is_over() {
                break RunEnd::Interrupted;
            }
            if let Some(end) = self.tend(now_ns, tell) {
                break end;
            }
            self.listen(tell);
            if let Some(outcome) = self.outcome() {
                break RunEnd::MissionOver(outcome);
            }
            if now_ns.saturating_sub(shown_at_ns) >= SECOND_NS {
                shown_at_ns = now_ns;
                self.kept.iter_mut().for_each(|kept| kept.account(now_ns));
                tell(Told::Statuses(&self.lines(now_ns), self.mission.as_ref()));
            }
            clock::sleep_until(now_ns + POLL_NS);
        };
        self.end_all();
        self.listen(tell);
        end
    }

    /// Processes that could not be told to end, and why: they may still run.
    pub fn unended(&self) -> &[String] {
        &self.unended
    }

    /// What the mission's process said last.
    pub fn mission(&self) -> Option<&MissionRecord> {
        self.mission.as_ref()
    }

    /// How the run kept its times so far, and what its processes took.
    pub fn report(&self) -> RunReport {
        let usage = |kept: &Kept| kept.usage.report(kept.role.name(), kept.deaths_at_ns.len());
        RunReport { control: self.timing.report(), processes: self.kept.iter().map(usage).collect() }
    }

    /// How the mission ended that the run ends with.
    fn outcome(&self) -> Option<u64> {
        let outcome = self.mission.as_ref().map_or(UNDER_WAY, |mission| mission.outcome);
        (self.ends_with_mission && outcome != UNDER_WAY).then_some(outcome)
    }

    fn tend(&mut self, now_ns: u64, tell: &mut dyn FnMut(Told<'_>)) -> Option<RunEnd> {
        let awaits_recorder = self.awaits_recorder(now_ns);
        let Self { kept, policy, command, .. } = self;
        let mut tended = kept.iter_mut().filter(|kept| !awaits_recorder || kept.role == Role::Recorder);
        tended.find_map(|kept| kept.tend(now_ns, policy, command, tell))
    }

    /// Whether the recorder has yet to open its channels. A robot speaks whenever it likes: what the others made of a
    /// message that was not recorded could not be made again. Without a recording the vehicle still drives.
    fn awaits_recorder(&self, now_ns: u64) -> bool {
        let recorder = self.kept.iter().find(|kept| kept.role == Role::Recorder);
        let is_awaited = recorder.is_some_and(|kept| kept.last.is_none() && kept.deaths_at_ns.is_empty());
        is_awaited && now_ns.saturating_sub(self.began_at_ns) < RECORDER_PATIENCE_NS
    }

    fn listen(&mut self, tell: &mut dyn FnMut(Told<'_>)) {
        let Self { mission, timing, decided, .. } = self;
        self.decisions.poll(|stamp, records| {
            for record in records {
                timing.take(stamp, record);
                let last = std::mem::replace(decided, record.command.decision());
                if let Some(decision) = decided.filter(|decision| !is_as(decision, last.as_ref())) {
                    tell(Told::Decided(decision));
                }
            }
        });
        self.missions.poll(|_, missions| *mission = missions.first().copied().or(*mission));
        for kept in &mut self.kept {
            let last = &mut kept.last;
            kept.status.poll(|stamp, records| {
                *last = records.first().map(|record| (*stamp, *record)).or(*last);
            });
        }
    }

    fn lines(&self, now_ns: u64) -> Vec<StatusLine> {
        let line = |kept: &Kept| StatusLine {
            role: kept.role,
            process: kept.child.as_ref().map(Child::id),
            n_restarts: kept.deaths_at_ns.len(),
            status: kept.last.map(|(stamp, status)| (clock::age_s(now_ns, stamp.published_at_ns), status)),
        };
        self.kept.iter().map(line).collect()
    }

    fn end_all(&mut self) {
        let until_ns = clock::now_ns() + PATIENCE_NS;
        let Self { kept, unended, .. } = self;
        unended.extend(kept.iter_mut().filter_map(|kept| kept.signal(Signal::TERM).err()));
        while self.kept.iter_mut().any(Kept::is_running) && clock::now_ns() < until_ns {
            clock::sleep_until(clock::now_ns() + POLL_NS / 4);
        }
        for kept in &mut self.kept {
            match (kept.signal(Signal::KILL), &mut kept.child) {
                // Who cannot be killed is not waited for.
                (Err(why), _) => self.unended.push(why),
                // It has been killed; how it ended is of no interest any more.
                (Ok(()), Some(child)) => drop(child.wait()),
                (Ok(()), None) => {}
            }
        }
    }
}

impl Kept {
    /// Starts it when it is due, and looks whether it still runs.
    fn tend(
        &mut self,
        now_ns: u64,
        policy: &RestartPolicy,
        command: &dyn Fn(Role, Start) -> Command,
        tell: &mut dyn FnMut(Told<'_>),
    ) -> Option<RunEnd> {
        let Some(child) = &mut self.child else {
            if now_ns < self.due_at_ns {
                return None;
            }
            let start = if self.deaths_at_ns.is_empty() { Start::First } else { Start::Again };
            return match command(self.role, start).spawn() {
                Ok(child) => {
                    self.child = Some(child);
                    None
                }
                Err(error) => Some(RunEnd::GaveUp { role: self.role, why: error.to_string() }),
            };
        };
        match child.try_wait() {
            Ok(None) => None,
            Ok(Some(status)) => self.bury(status, now_ns, policy, tell),
            Err(error) => Some(RunEnd::GaveUp { role: self.role, why: error.to_string() }),
        }
    }

    fn bury(
        &mut self,
        status: ExitStatus,
        now_ns: u64,
        policy: &RestartPolicy,
        tell: &mut dyn FnMut(Told<'_>),
    ) -> Option<RunEnd> {
        self.child = None;
        match status.code() {
            Some(code @ (0 | 1)) if self.role == Role::Plant => return Some(RunEnd::Plant(code)),
            // What was refused once is refused again.
            Some(2) => {
                return Some(RunEnd::GaveUp { role: self.role, why: "it refused its input".to_owned() });
            }
            _ => {}
        }
        self.deaths_at_ns.push(now_ns);
        let recent = |at_ns: &&u64| now_ns.saturating_sub(**at_ns) < policy.window_ns;
        let n_recent = self.deaths_at_ns.iter().filter(recent).count();
        if n_recent > policy.restarts_max {
            let window_s = policy.window_ns / SECOND_NS;
            let why = format!("it ended {n_recent} times within {window_s} s, the last time by {status}");
            return Some(RunEnd::GaveUp { role: self.role, why });
        }
        let wait_ns = (policy.back_off_ns << (n_recent - 1).min(16)).min(policy.back_off_max_ns);
        self.due_at_ns = now_ns + wait_ns;
        tell(Told::Died { role: self.role, status, wait_ns });
        None
    }

    fn account(&mut self, now_ns: u64) {
        if let Some(child) = &self.child {
            self.usage.look(child.id(), now_ns);
        }
    }

    /// Says why a signal could not be sent.
    fn signal(&mut self, signal: Signal) -> Result<(), String> {
        let process = self.child.as_ref().and_then(|child| i32::try_from(child.id()).ok());
        let Some(process) = process.and_then(Pid::from_raw).filter(|_| self.is_running()) else {
            return Ok(());
        };
        unsent(kill_process(process, signal)).map_or(Ok(()), |why| {
            let (name, number) = (self.role.name(), process.as_raw_nonzero());
            Err(format!("{name}: expected to send signal {signal:?} to process {number}, found: {why}"))
        })
    }

    fn is_running(&mut self) -> bool {
        self.child.as_mut().is_some_and(|child| matches!(child.try_wait(), Ok(None)))
    }
}

/// Whether a decision is to do the same as the last one for the same reason; every command to drive is to drive.
fn is_as(decision: &Decision, last: Option<&Decision>) -> bool {
    match (decision, last) {
        (Decision::Drive(_), Some(Decision::Drive(_))) => true,
        (decision, last) => Some(decision) == last,
    }
}

/// Why a signal was not sent; one that has ended by itself just now is what is wanted.
fn unsent(sent: Result<(), Errno>) -> Option<Errno> {
    sent.err().filter(|why| *why != Errno::SRCH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_that_are_not_sent_are_told_but_to_those_that_have_ended() {
        assert_eq!([Ok(()), Err(Errno::SRCH)].map(unsent), [None; 2]);
        assert_eq!(unsent(Err(Errno::PERM)), Some(Errno::PERM));
    }
}
