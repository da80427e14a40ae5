//! Planners of the user's own: processes that drive in lock-step over the channels of a run of their own each.

mod instance;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use ::bench::navigation::{Answers, ExternalError, PlannerName};
use bicycle::{Decision, Limits};
use scenarios::Episode;
use simulator::Answer;

use crate::arguments::{BenchNavigationArguments, PlannerArgument};
use crate::{UsageError, WorkFailed};
use instance::Instance;

/// Everybody who was entered, and the processes that wait for a drive.
pub(super) struct Planners {
    entered: Vec<PlannerArgument>,
    timeout: Duration,
    limits: Limits,
    idle: Mutex<Vec<Instance>>,
    n_started: AtomicUsize,
}

impl Planners {
    /// Starts one process of each and has it join; commands are to keep to the limits.
    ///
    /// Errors: a name that was entered twice; a process that does not start or does not join in time.
    pub(super) fn start(arguments: &BenchNavigationArguments, limits: Limits) -> anyhow::Result<Self> {
        let entered = arguments.planners.clone();
        for (place, PlannerArgument { name, .. }) in entered.iter().enumerate() {
            if entered[..place].iter().any(|other| other.name == *name) {
                let told = format!("--planner: expected every name once, found \"{name}\" twice");
                return Err(UsageError(told).into());
            }
        }
        let planners = Self {
            entered,
            timeout: Duration::from_secs_f64(arguments.planner_timeout),
            limits,
            idle: Mutex::default(),
            n_started: AtomicUsize::new(0),
        };
        for PlannerArgument { name, .. } in &planners.entered {
            let instance = planners.instance(name)?;
            planners.release(instance);
        }
        Ok(planners)
    }

    /// Drives an episode to its end. As many drive beside each other as there are threads that ask.
    pub(super) fn drive(
        &self,
        name: &PlannerName,
        episode: Episode,
    ) -> Result<(Episode, Answers), ExternalError> {
        let mut instance = self.instance(name)?;
        let (episode, answers) = instance.drive(episode)?;
        self.release(instance);
        Ok((episode, told(&answers)))
    }

    /// One that is idle, or another one.
    fn instance(&self, name: &PlannerName) -> Result<Instance, WorkFailed> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = idle.iter().position(|instance| instance.name() == name) {
            return Ok(idle.swap_remove(place));
        }
        drop(idle);
        let planner = self.entered.iter().find(|planner| planner.name == *name);
        let planner = planner.ok_or_else(|| WorkFailed(format!("expected a planner {name}, found none")))?;
        let number = self.n_started.fetch_add(1, Ordering::Relaxed);
        Instance::start(planner.clone(), number, self.limits, self.timeout)
    }

    fn release(&self, instance: Instance) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(instance);
    }
}

fn told(answers: &[Answer]) -> Answers {
    let mut told = Answers::default();
    for Answer { decision, took } in answers {
        told.cycles_ms.push(1e3 * took.as_secs_f64());
        if let Decision::Stop(reason) = decision {
            *told.stops.entry(*reason).or_default() += 1;
        }
    }
    told
}
