//! The user's own simulator: processes that are started, asked and ended here.

mod process;
mod protocol;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use sim_to_real::{Machine, Motion, RunMemory, SimulatorDescription, SimulatorRun};

use super::progress::Progress;
use super::workers::work;
use crate::WorkFailed;
use crate::arguments::GapSimulatorArguments;
use process::Instance;

/// Instances of one simulator.
pub(super) struct Simulators {
    pub description: SimulatorDescription,
    idle: Mutex<Vec<Instance>>,
    n_instances: usize,
    known: Mutex<RunMemory>,
    n_runs: AtomicUsize,
    progress: Progress,
}

impl Simulators {
    /// Starts the instances and has each introduce itself.
    ///
    /// Errors: one does not start, does not answer in time or as the protocol wants, or differs from the first.
    pub(super) fn start(
        (command, arguments): (&str, &GapSimulatorArguments),
        machine: &Machine,
    ) -> Result<Self, WorkFailed> {
        let timeout = Duration::from_secs_f64(arguments.simulator_timeout);
        let (mut idle, mut first) = (Vec::new(), None);
        for _ in 0..arguments.simulators {
            let (instance, description) = Instance::start(command, timeout, machine)?;
            let expected: &SimulatorDescription = first.get_or_insert(description.clone());
            if *expected != description {
                let told = "every instance to introduce itself alike, found two that differ";
                return Err(WorkFailed(format!("--simulator: expected {told}")));
            }
            idle.push(instance);
        }
        let description = first.ok_or_else(|| WorkFailed("--simulators: expected at least 1".to_owned()))?;
        Ok(Self {
            description,
            n_instances: idle.len(),
            idle: Mutex::new(idle),
            known: Mutex::default(),
            n_runs: AtomicUsize::new(0),
            progress: Progress::simulator(),
        })
    }

    /// The motion of every run in their order; what was run before is remembered.
    ///
    /// Errors: the first run that fails.
    pub(super) fn run(&self, runs: &[SimulatorRun]) -> anyhow::Result<Vec<Motion>> {
        let mut known = self.known.lock().map_err(|_| a_thread_failed())?;
        known.recall(runs, |missing| {
            work(missing.len(), self.n_instances, |job| {
                let run = missing[job];
                Ok(self.run_one(&protocol::run_body(run)?, run.n_rows())?)
            })
        })
    }

    /// Runs in whichever instance is idle: there are as many threads as instances.
    fn run_one(&self, body: &str, n_rows: usize) -> Result<Motion, WorkFailed> {
        let idle = self.idle.lock().map_err(|_| a_thread_failed())?.pop();
        let mut instance = idle.ok_or_else(a_thread_failed)?;
        let motion = instance.run(body, n_rows)?;
        self.idle.lock().map_err(|_| a_thread_failed())?.push(instance);
        let n_runs = 1 + self.n_runs.fetch_add(1, Ordering::Relaxed);
        self.progress.told(format!("asking {}: {n_runs} drives so far", self.description.name));
        Ok(motion)
    }

    /// Ends the instances, and says how many runs were made.
    pub(super) fn finish(self) -> usize {
        self.progress.finish();
        self.n_runs.into_inner()
    }
}

fn a_thread_failed() -> WorkFailed {
    WorkFailed("a thread that asks the simulator has failed".to_owned())
}
