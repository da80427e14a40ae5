//! `surefoot train traversability`: one training or a search, a bar meanwhile, and the weights with their curves.
#![allow(clippy::disallowed_methods, reason = "people are told how long a training takes")]

mod data;
mod friction;
mod kinodynamics;
mod sweep;

use std::ops::ControlFlow;
use std::time::Instant;

use evidential::{
    Epoch, Method, Outcome, PARAMETER_NAMES, Percentiles, Phase, Selections, Settings, TrainError,
    TrainingEnd,
};
use indicatif::ProgressBar;
use serde::Serialize;

use crate::arguments::TrainArguments;
use crate::{UsageError, WorkFailed, interrupt, progress, summary};
use data::Data;
pub(crate) use friction::run_friction;
pub(crate) use kinodynamics::{labels, run_kinodynamics};

/// The content of `training.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    settings: &'a Settings,
    unevenness_max_m: f32,
    n_training: usize,
    n_validation: usize,
    validation_emd2: [f64; 4],
    learned_weight: Option<Percentiles>,
    end: TrainingEnd,
    took_s: f64,
    curves: &'a [Epoch],
}

pub(crate) fn run(arguments: &TrainArguments) -> anyhow::Result<()> {
    arguments.results.prepare()?;
    let data = Data::read(arguments)?;
    interrupt::catch_interrupts()?;
    if arguments.sweep {
        return sweep::run(arguments, &data);
    }
    match arguments.methods()[..] {
        [method] => train_one(arguments, &data, method),
        _ => {
            Err(UsageError("--method: expected one method without --sweep, found several".to_owned()).into())
        }
    }
}

fn train_one(arguments: &TrainArguments, data: &Data, method: Method) -> anyhow::Result<()> {
    let settings = arguments.settings(method, &Selections::shipped()?);
    let began = Instant::now();
    let bar = progress::bar(settings.epochs_max as u64, "{pos}/{len} passes   {msg}");
    let trained =
        evidential::train(&data.training, &data.validation, &settings, summary::revision(), &mut |epoch| {
            show(&bar, epoch);
            if interrupt::interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
    bar.finish_and_clear();
    let outcome = trained.map_err(told)?;
    let took_s = began.elapsed().as_secs_f64();
    write(arguments, data, &settings, &outcome, took_s)?;
    print!("{}", told_outcome(data, &settings, &outcome, took_s));
    println!(
        "  weights.safetensors, weights.json, training.json and training.png in {}",
        arguments.results.out.display()
    );
    match outcome.end {
        TrainingEnd::Finished => Ok(()),
        TrainingEnd::Interrupted => {
            let told = format!(
                "interrupted after {} passes; the best weights so far are kept",
                outcome.curves.len()
            );
            Err(WorkFailed(told).into())
        }
    }
}

/// Data and settings are the user's choice; all else is not.
fn told(error: TrainError) -> anyhow::Error {
    match error {
        TrainError::Settings(_)
        | TrainError::Data { .. }
        | TrainError::OneClass { .. }
        | TrainError::Mismatch { .. } => UsageError::from_input(error).into(),
        other => other.into(),
    }
}

fn show(bar: &ProgressBar, epoch: &Epoch) {
    bar.set_position(epoch.epoch as u64);
    bar.set_message(match epoch.phase {
        Phase::Joint => {
            format!("loss {:.4}, validation EMD2 {:.4}", epoch.training_loss, epoch.validation_error)
        }
        Phase::Flow => format!("flow: negative log density {:.3}", epoch.validation_error),
    });
}

fn write(
    arguments: &TrainArguments,
    data: &Data,
    settings: &Settings,
    outcome: &Outcome,
    took_s: f64,
) -> anyhow::Result<()> {
    // The sidecar holds the hash of the weights: a half-written pair is refused when it is read.
    arguments.results.write("weights.safetensors", &outcome.checkpoint.weights_bytes()?)?;
    arguments.results.write("weights.json", &outcome.checkpoint.sidecar_bytes()?)?;
    let written = Written {
        revision: summary::revision(),
        settings,
        unevenness_max_m: data.unevenness_max_m,
        n_training: data.training.examples.len(),
        n_validation: data.validation.examples.len(),
        validation_emd2: outcome.validation_emd2,
        learned_weight: outcome.learned_weight,
        end: outcome.end,
        took_s,
        curves: &outcome.curves,
    };
    arguments.results.write_json("training.json", &written)?;
    let title = format!("Training of {}, seed {}", settings.method.name(), settings.seed);
    let png = report::training::picture(&title, &outcome.curves)?;
    Ok(arguments.results.write("training.png", &png)?)
}

fn told_outcome(data: &Data, settings: &Settings, outcome: &Outcome, took_s: f64) -> String {
    let joint = outcome.curves.iter().filter(|epoch| epoch.phase == Phase::Joint).count();
    let mut told = format!(
        "  {}, seed {}: {} examples with unevenness up to {:.4} m, {joint} passes, {took_s:.1} s\n\n",
        settings.method.name(),
        settings.seed,
        data.training.examples.len(),
        data.unevenness_max_m,
    );
    told += &format!("  validation EMD2, {} examples\n", data.validation.examples.len());
    for (name, emd2) in PARAMETER_NAMES.iter().zip(outcome.validation_emd2) {
        told += &format!("    {name:<18}{emd2:8.4}\n");
    }
    told += &format!("    {:<18}{:8.4}\n\n", "sum", outcome.validation_emd2.iter().sum::<f64>());
    if let Some(Percentiles { p05, p25, p50, p75, p95 }) = outcome.learned_weight {
        told += "  learned weight n / (n + n_prior), percentiles of the validation data\n";
        told += &format!(
            "    5 %: {p05:.4}   25 %: {p25:.4}   50 %: {p50:.4}   75 %: {p75:.4}   95 %: {p95:.4}\n\n"
        );
    }
    told
}
