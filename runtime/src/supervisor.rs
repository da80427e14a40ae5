//! Keeps the processes of a run alive, and shows how they are doing.

use std::process::{Child, Command, ExitStatus};

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

    /// Keeps them going until the vehicle's process ends, one cannot be kept, or `is_over`; `show` is given the state
    /// of all once a second. Ends them all before it returns.
    pub fn run(
        &mut self,
        is_over: &dyn Fn() -> bool,
        show: &mut dyn FnMut(&[StatusLine], Option<&MissionRecord>),
    ) -> RunEnd {
        let mut shown_at_ns = clock::now_ns();
        let end = loop {
            let now_ns = clock::now_ns();
            if is_over() {
                break RunEnd::Interrupted;
            }
            if let Some(end) = self.tend(now_ns) {
                break end;
            }
            self.listen();
            if let Some(outcome) = self.outcome() {
                break RunEnd::MissionOver(outcome);
            }
            if now_ns.saturating_sub(shown_at_ns) >= SECOND_NS {
                shown_at_ns = now_ns;
                self.kept.iter_mut().for_each(|kept| kept.account(now_ns));
                show(&self.lines(now_ns), self.mission.as_ref());
            }
            clock::sleep_until(now_ns + POLL_NS);
        };
        self.end_all();
        self.listen();
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

    fn tend(&mut self, now_ns: u64) -> Option<RunEnd> {
        let awaits_recorder = self.awaits_recorder(now_ns);
        let Self { kept, policy, command, .. } = self;
        let mut tended = kept.iter_mut().filter(|kept| !awaits_recorder || kept.role == Role::Recorder);
        tended.find_map(|kept| kept.tend(now_ns, policy, command))
    }

    /// Whether the recorder has yet to open its channels. A robot speaks whenever it likes: what the others made of a
    /// message that was not recorded could not be made again. Without a recording the vehicle still drives.
    fn awaits_recorder(&self, now_ns: u64) -> bool {
        let recorder = self.kept.iter().find(|kept| kept.role == Role::Recorder);
        let is_awaited = recorder.is_some_and(|kept| kept.last.is_none() && kept.deaths_at_ns.is_empty());
        is_awaited && now_ns.saturating_sub(self.began_at_ns) < RECORDER_PATIENCE_NS
    }

    fn listen(&mut self) {
        let (mission, timing) = (&mut self.mission, &mut self.timing);
        self.decisions.poll(|stamp, records| records.iter().for_each(|record| timing.take(stamp, record)));
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
            Ok(Some(status)) => self.bury(status, now_ns, policy),
            Err(error) => Some(RunEnd::GaveUp { role: self.role, why: error.to_string() }),
        }
    }

    fn bury(&mut self, status: ExitStatus, now_ns: u64, policy: &RestartPolicy) -> Option<RunEnd> {
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
        self.due_at_ns = now_ns + (policy.back_off_ns << (n_recent - 1).min(16)).min(policy.back_off_max_ns);
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

/// Why a signal was not sent; one that has ended by itself just now is what is wanted.
fn unsent(sent: Result<(), Errno>) -> Option<Errno> {
    sent.err().filter(|why| *why != Errno::SRCH)
}

/// How one process is doing.
#[derive(Clone, Copy, Debug)]
pub struct StatusLine {
    /// Its role.
    pub role: Role,
    /// Its process, while it runs.
    pub process: Option<u32>,
    /// How often it had to be restarted.
    pub n_restarts: usize,
    /// Age of its last status [s], and that.
    pub status: Option<(f64, StatusRecord)>,
}

impl std::fmt::Display for StatusLine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let inputs: &[&str] = match self.role {
            Role::Plant => &["command"],
            Role::Mapping => &["odometry", "scan"],
            Role::Learning => &["surface"],
            Role::Control => &["odometry", "learned map", "physics map", "mission"],
            Role::Recorder => &[],
            Role::Mission => &["odometry"],
            Role::Ros => &["command", "odometry", "scan"],
        };
        write!(formatter, "{:9}", self.role.name())?;
        let Some((age_s, status)) = self.status.filter(|_| self.process.is_some()) else {
            return write!(formatter, " not heard of yet, restarts {}", self.n_restarts);
        };
        if age_s > 2.0 {
            return write!(formatter, " silent for {age_s:.1} s, restarts {}", self.n_restarts);
        }
        let [median_ms, largest_ms] = status.lateness_s.map(|lateness_s| 1e3 * lateness_s);
        write!(formatter, " {:5.1} Hz  late {median_ms:.1}, {largest_ms:.1} ms", status.rate_hz)?;
        for (name, age_s) in inputs.iter().zip(status.age_s).filter(|(_, age_s)| *age_s >= 0.0) {
            write!(formatter, "  {name} {:.0} ms", 1e3 * age_s)?;
        }
        write!(
            formatter,
            "  missed {}  lost {}  refused {}  failed {}  restarts {}",
            status.n_missed, status.n_lost, status.n_refused, status.n_failed, self.n_restarts
        )?;
        match self.role {
            Role::Control => write!(formatter, "  futures {:.0}", status.figure),
            Role::Recorder if status.figure < 0.0 => write!(formatter, "  no recording"),
            Role::Recorder => write!(formatter, "  {:.1} MB", 1e-6 * status.figure),
            _ => Ok(()),
        }
    }
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
