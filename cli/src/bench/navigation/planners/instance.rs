//! One process of a planner, and the vehicle that it commands. What joins a run stays in the thread that joined it: each
//! has a thread of its own.

use std::cell::RefCell;
use std::process::ChildStdin;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use ::bench::navigation::PlannerName;
use bicycle::Limits;
use bus::channel::{Bus, RunName};
use bus::clock::{self, SECOND_NS};
use scenarios::Episode;
use simulator::{Answer, LockStep, LockStepError, Patience};

use crate::WorkFailed;
use crate::arguments::PlannerArgument;
use crate::own_process::OwnProcess;

/// The variable that names the run to a planner.
const RUN: &str = "SUREFOOT_RUN";
/// Time between two looks whether a planner has joined [ns].
const LOOK_NS: u64 = SECOND_NS / 100;

/// An episode that was driven to its end.
type Driven = (Episode, Vec<Answer>);

/// A planner that has joined. Its process ends with this.
pub(super) struct Instance {
    name: PlannerName,
    episodes: Option<Sender<Episode>>,
    driven: Receiver<Result<Option<Driven>, WorkFailed>>,
    thread: Option<JoinHandle<()>>,
}

impl Instance {
    /// Starts the process and waits until it has joined.
    pub(super) fn start(
        planner: PlannerArgument,
        number: usize,
        limits: Limits,
        timeout: Duration,
    ) -> Result<Self, WorkFailed> {
        let name = planner.name.clone();
        let (episodes, asked) = channel();
        let (answer, driven) = channel();
        let serve = move || match Seat::take(planner, number, limits, timeout) {
            Ok(mut seat) => {
                drop(answer.send(Ok(None)));
                asked.iter().for_each(|episode| drop(answer.send(seat.drive(episode).map(Some))));
            }
            Err(told) => drop(answer.send(Err(told))),
        };
        let thread = Builder::new().name("planner".to_owned()).spawn(serve);
        let thread = thread.map_err(|error| WorkFailed(format!("--planner: {error}")))?;
        let instance = Self { name, episodes: Some(episodes), driven, thread: Some(thread) };
        instance.answer()?;
        Ok(instance)
    }

    pub(super) fn name(&self) -> &PlannerName {
        &self.name
    }

    /// Drives an episode to its end.
    pub(super) fn drive(&mut self, episode: Episode) -> Result<Driven, WorkFailed> {
        if let Some(episodes) = &self.episodes {
            // Where the thread has ended, nobody answers, and that is told.
            drop(episodes.send(episode));
        }
        self.answer()?.ok_or_else(|| WorkFailed("--planner: expected a drive, found none".to_owned()))
    }

    fn answer(&self) -> Result<Option<Driven>, WorkFailed> {
        self.driven.recv().unwrap_or_else(|_| Err(WorkFailed("--planner: its thread has failed".to_owned())))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.episodes = None;
        if let Some(thread) = self.thread.take() {
            // Its panic was told already, by its silence.
            drop(thread.join());
        }
    }
}

/// The vehicle's side of the run, and the process on the other.
struct Seat {
    planner: PlannerArgument,
    timeout: Duration,
    /// Ends before the vehicle leaves, who then clears away what it left behind.
    process: Option<RefCell<OwnProcess>>,
    /// Its standard input ends with the benchmark, however that ends.
    _stdin: Option<ChildStdin>,
    vehicle: LockStep,
    bus: Bus,
    run: RunName,
}

impl Seat {
    fn take(
        planner: PlannerArgument,
        number: usize,
        limits: Limits,
        timeout: Duration,
    ) -> Result<Self, WorkFailed> {
        let refused = |told: &dyn std::fmt::Display| failed(&planner, told);
        let run = format!("navigation-{}-{number}", std::process::id());
        let name: RunName = run.parse().map_err(|error| refused(&error))?;
        let bus = Bus::join(&name).map_err(|error| refused(&error))?;
        let vehicle = LockStep::new(&bus, limits).map_err(|error| refused(&error))?;
        let started = OwnProcess::start(&planner.command, &[(RUN, &run)]);
        let mut process =
            started.map_err(|error| refused(&format!("expected a command that starts, found: {error}")))?;
        process.hear_stdout();
        let _stdin = process.stdin();
        let process = Some(RefCell::new(process));
        let seat = Self { planner, timeout, process, _stdin, vehicle, bus, run: name };
        seat.await_planner()?;
        Ok(seat)
    }

    fn await_planner(&self) -> Result<(), WorkFailed> {
        let until_ns = clock::now_ns() + clock::nanoseconds(self.timeout.as_secs_f64());
        while !self.vehicle.has_planner() {
            if self.has_ended() {
                let told =
                    format!("expected it to join run {}, found that it ended{}", self.run, self.ending());
                return Err(failed(&self.planner, &told));
            }
            if clock::now_ns() > until_ns {
                let (run, limit_s) = (&self.run, self.timeout.as_secs_f64());
                let told = format!("expected it to join run {run} within {limit_s} s, found nobody");
                return Err(failed(&self.planner, &told));
            }
            clock::sleep_until(clock::now_ns() + LOOK_NS);
        }
        Ok(())
    }

    fn drive(&mut self, mut episode: Episode) -> Result<Driven, WorkFailed> {
        let Self { vehicle, process, timeout, .. } = self;
        let has_ended = || process.as_ref().is_none_or(|process| process.borrow_mut().has_ended());
        let driven = vehicle.drive(&mut episode, &Patience { limit: *timeout, is_gone: &has_ended });
        match driven {
            Ok(answers) => Ok((episode, answers)),
            Err(gone @ LockStepError::Gone { .. }) => {
                Err(failed(&self.planner, &format!("{gone}{}", self.ending())))
            }
            Err(error) => Err(failed(&self.planner, &error)),
        }
    }

    fn has_ended(&self) -> bool {
        self.process.as_ref().is_none_or(|process| process.borrow_mut().has_ended())
    }

    fn ending(&self) -> String {
        self.process.as_ref().map(|process| process.borrow_mut().ending()).unwrap_or_default()
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.process = None;
        self.bus.clear_dead();
    }
}

fn failed(planner: &PlannerArgument, told: &dyn std::fmt::Display) -> WorkFailed {
    WorkFailed(format!("--planner '{}={}': {told}", planner.name, planner.command))
}
