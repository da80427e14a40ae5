//! `surefoot train traversability --sweep`: all trainings of a search, some at a time, each kept as soon as it is done.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use evidential::{
    Grid, Method, Phase, Selection, Selections, Settings, TrainError, TrainingEnd, Trial, fingerprint,
};
use indicatif::ProgressBar;

use super::data::Data;
use super::told;
use crate::arguments::TrainArguments;
use crate::{UsageError, WorkFailed, interrupt, progress, summary};

/// All parameter sets of a method.
struct Candidates {
    method: Method,
    settings: Vec<Settings>,
}

pub(super) fn run(arguments: &TrainArguments, data: &Data) -> anyhow::Result<()> {
    let data_hash = fingerprint(&data.training, &data.validation)?;
    let candidates: Vec<Candidates> =
        arguments.methods().into_iter().map(|m| candidates(arguments, m)).collect();
    let log = TrialLog::read(arguments.results.file("trials.jsonl"), &data_hash)?;
    let queue = open_trainings(&candidates, arguments.seeds, &log);
    let search = Search::new(data, data_hash, log, queue);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..arguments.n_threads()).map(|_| scope.spawn(|| search.work())).collect();
        workers
            .into_iter()
            .try_for_each(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    search.bar.finish_and_clear();
    let (n_open, log) = search.into_parts();
    if n_open > 0 {
        let told = format!("interrupted with {n_open} trainings to do; the same command goes on");
        return Err(WorkFailed(told).into());
    }
    select(arguments, data, &candidates, &log)
}

fn candidates(arguments: &TrainArguments, method: Method) -> Candidates {
    // A search starts from the defaults, not from what an earlier one has found.
    let base = arguments.settings(method, &Selections::default());
    let paper = Grid::paper();
    let learning_rates = arguments.learning_rate.map_or(paper.learning_rates.clone(), |rate| vec![rate]);
    Candidates { method, settings: Grid { learning_rates, ..paper }.candidates(&base) }
}

/// What is not yet trained: all methods' first seeds first, so that an early end leaves something of each.
fn open_trainings(candidates: &[Candidates], n_seeds: u64, log: &TrialLog) -> VecDeque<Settings> {
    let mut open = VecDeque::new();
    for seed in 1..=n_seeds {
        for settings in candidates.iter().flat_map(|candidates| &candidates.settings) {
            let settings = Settings { seed, ..settings.clone() };
            if !log.trials.iter().any(|trial| trial.settings == settings) {
                open.push_back(settings);
            }
        }
    }
    open
}

fn select(
    arguments: &TrainArguments,
    data: &Data,
    candidates: &[Candidates],
    log: &TrialLog,
) -> anyhow::Result<()> {
    let mut selections = Selections {
        data: log.data_hash.clone(),
        provenance: data.training.origin.provenance.clone(),
        selections: Vec::new(),
    };
    println!("  {:<22}{:>9}{:>8}{:>10}   {:<20}", "method", "rate", "kappa", "entropy", "validation EMD2");
    for Candidates { method, settings } in candidates {
        let selection = Selection::of(*method, settings, arguments.seeds as usize, &log.trials)?;
        let Settings { learning_rate, physics_weight, entropy_weight, .. } = selection.settings;
        let if_used = |is_used: bool, weight: f64| if is_used { weight.to_string() } else { "-".to_owned() };
        println!(
            "  {:<22}{learning_rate:>9}{:>8}{:>10}   {:.4} +- {:.4}",
            method.name(),
            if_used(method.has_physics_loss(), physics_weight),
            if_used(method.is_evidential(), entropy_weight),
            selection.validation_total,
            selection.validation_deviation,
        );
        selections.selections.push(selection);
    }
    let path = arguments.results.file("selections.json");
    formats::write_json_atomic(&path, &selections)?;
    println!("\n  {}", path.display());
    Ok(())
}

/// A search under way.
struct Search<'a> {
    data: &'a Data,
    queue: Mutex<VecDeque<Settings>>,
    log: Mutex<TrialLog>,
    bar: ProgressBar,
    began: Instant,
    n_trainings: usize,
}

impl<'a> Search<'a> {
    fn new(data: &'a Data, data_hash: String, log: TrialLog, queue: VecDeque<Settings>) -> Self {
        let n_trainings = queue.len();
        let bar = progress::bar(n_trainings as u64, "{pos}/{len} trainings, {eta} left   {msg}");
        let log = TrialLog { data_hash, ..log };
        Self { data, queue: queue.into(), log: log.into(), bar, began: Instant::now(), n_trainings }
    }

    /// Trains what the queue holds until it is empty or the user has had enough.
    fn work(&self) -> anyhow::Result<()> {
        while !interrupt::interrupted() {
            let Some(settings) = lock(&self.queue).pop_front() else { break };
            let trained = self.train(&settings);
            if let Ok(Some(trial)) = trained {
                let mut log = lock(&self.log);
                log.keep(trial)?;
                self.tell(&log);
            } else {
                // Broken off, or to be tried again once the reason is gone.
                lock(&self.queue).push_front(settings);
                trained?;
            }
        }
        Ok(())
    }

    /// One training; `None` if it was broken off.
    fn train(&self, settings: &Settings) -> anyhow::Result<Option<Trial>> {
        let Data { training, validation, .. } = self.data;
        let trained = evidential::train(training, validation, settings, summary::revision(), &mut |_| {
            if interrupt::interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let (validation_emd2, validation_standard_error, n_epochs) = match trained {
            Ok(outcome) if outcome.end == TrainingEnd::Interrupted => return Ok(None),
            Ok(outcome) => {
                let joint = outcome.curves.iter().filter(|epoch| epoch.phase == Phase::Joint);
                (Some(outcome.validation_emd2), outcome.validation_standard_error, joint.count())
            }
            // A candidate that runs away is a result.
            Err(TrainError::NonFiniteLoss { epoch, .. }) => (None, 0.0, epoch),
            Err(other) => return Err(told(other)),
        };
        let data = lock(&self.log).data_hash.clone();
        let settings = settings.clone();
        Ok(Some(Trial { settings, data, validation_emd2, validation_standard_error, n_epochs }))
    }

    /// Says how far the search has come, on the bar or, where there is none, in a line.
    fn tell(&self, log: &TrialLog) {
        let Some(trial) = log.trials.last() else { return };
        let line = told_trial(trial);
        self.bar.inc(1);
        self.bar.set_message(line.clone());
        if self.bar.is_hidden() {
            let n_done = log.n_new;
            let left_s =
                self.began.elapsed().as_secs_f64() / n_done as f64 * (self.n_trainings - n_done) as f64;
            println!("  {n_done}/{} {line}, about {:.0} min left", self.n_trainings, (left_s / 60.0).ceil());
        }
    }

    /// Trainings left, and all that are done.
    fn into_parts(self) -> (usize, TrialLog) {
        let queue = self.queue.into_inner().unwrap_or_else(PoisonError::into_inner);
        (queue.len(), self.log.into_inner().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A worker that panicked ends the search; what the others see until then is whole.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn told_trial(trial: &Trial) -> String {
    let Settings { method, seed, learning_rate, physics_weight, entropy_weight, .. } = &trial.settings;
    let parameters = format!(
        "{} rate {learning_rate} kappa {physics_weight} entropy {entropy_weight} seed {seed}",
        method.name()
    );
    match trial.validation_emd2 {
        Some(emd2) => {
            format!("{parameters}: {:.4} after {} passes", emd2.iter().sum::<f64>(), trial.n_epochs)
        }
        None => format!("{parameters}: not finite in pass {}", trial.n_epochs),
    }
}

/// Finished trainings, one JSON value per line.
struct TrialLog {
    path: PathBuf,
    data_hash: String,
    trials: Vec<Trial>,
    /// Trainings done by this process.
    n_new: usize,
}

impl TrialLog {
    /// What an earlier run has left, none if there was none.
    fn read(path: PathBuf, data_hash: &str) -> Result<Self, UsageError> {
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => {
                return Err(UsageError(format!(
                    "{}: expected a readable file, found: {error}",
                    path.display()
                )));
            }
        };
        let mut trials = Vec::new();
        for (index, line) in text.lines().enumerate() {
            trials.push(parse(line, data_hash).map_err(|problem| at_line(&path, index + 1, &problem))?);
        }
        Ok(Self { path, data_hash: data_hash.to_owned(), trials, n_new: 0 })
    }

    /// Adds a training and writes the file anew.
    fn keep(&mut self, trial: Trial) -> anyhow::Result<()> {
        self.trials.push(trial);
        self.n_new += 1;
        let mut text = Vec::new();
        for trial in &self.trials {
            serde_json::to_writer(&mut text, trial)?;
            text.push(b'\n');
        }
        Ok(formats::write_bytes_atomic(&self.path, &text)?)
    }
}

fn parse(line: &str, data_hash: &str) -> Result<Trial, String> {
    let trial: Trial = serde_json::from_str(line)
        .map_err(|error| format!("expected a training of a search, found: {error}"))?;
    if trial.data == data_hash {
        return Ok(trial);
    }
    Err(format!(
        "expected a training on data {data_hash}, found one on {}; another --out starts anew",
        trial.data
    ))
}

fn at_line(path: &Path, line: usize, problem: &str) -> UsageError {
    UsageError(format!("{}, line {line}: {problem}", path.display()))
}
