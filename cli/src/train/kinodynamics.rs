//! `surefoot train kinodynamics`: the fit, a bar meanwhile, and the weights.

use std::ops::ControlFlow;

use kinodynamics::{
    Answer, Architecture, EffectPart, Epoch, LabelConfig, LabelCounts, Latency, Outcome, Recording, Sensing,
    Settings, SpeedSource, TrainError, train,
};
use serde::Serialize;

use crate::arguments::{
    KinodynamicsAnswer, KinodynamicsEffect, KinodynamicsFilter, KinodynamicsLabelArguments,
    KinodynamicsSensing, KinodynamicsSpeed, TrainKinodynamicsArguments,
};
use crate::{UsageError, interrupt, progress, summary};

/// The content of `kinodynamics_training.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    settings: &'a Settings,
    latency: Latency,
    n_examples: [usize; 2],
    counts: LabelCounts,
    identity_rmse_per_m: f64,
    curves: &'a [Epoch],
}

pub(crate) fn run_kinodynamics(arguments: &TrainKinodynamicsArguments) -> anyhow::Result<()> {
    arguments.results.prepare()?;
    let path = &arguments.train;
    let refused = |told: String| UsageError(format!("{}: {told}", path.display()));
    let bytes = std::fs::read(path).map_err(|error| refused(error.to_string()))?;
    let recording = Recording::from_bytes(&bytes).map_err(|error| refused(error.to_string()))?;
    interrupt::catch_interrupts()?;
    let settings = settings(arguments);
    let bar = progress::bar(settings.n_passes() as u64, "{pos}/{len} passes");
    let outcome = train(&recording, &settings, summary::revision(), &mut |_| {
        bar.inc(1);
        if interrupt::interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.finish_and_clear();
    let outcome = outcome.map_err(|error| told_error(error, &refused))?;
    write(arguments, &settings, &outcome)?;
    print!("{}", told(&outcome));
    println!(
        "  kinodynamics.safetensors, kinodynamics.json and kinodynamics_training.json in {}",
        arguments.results.out.display()
    );
    Ok(())
}

/// What the recording or the settings are at fault for is the user's choice; all else is not.
fn told_error(error: TrainError, refused: &dyn Fn(String) -> UsageError) -> anyhow::Error {
    match error {
        TrainError::Candle(_) | TrainError::Checkpoint(_) | TrainError::Diverged { .. } => error.into(),
        theirs => refused(theirs.to_string()).into(),
    }
}

fn settings(arguments: &TrainKinodynamicsArguments) -> Settings {
    let sensing = match arguments.sensing {
        KinodynamicsSensing::Imu => Sensing::Imu { embedding: arguments.embedding },
        KinodynamicsSensing::Blind => Sensing::Blind,
    };
    let answer = match arguments.answer {
        KinodynamicsAnswer::Curvature => Answer::Curvature,
        KinodynamicsAnswer::SpeedAndCurvature => Answer::SpeedAndCurvature,
    };
    let paper = Settings::paper(Architecture { sensing, answer }, arguments.seed);
    let (labels, teacher) = (labels(&arguments.labels), arguments.labels.teacher.into());
    Settings { labels, teacher, epochs: arguments.epochs, ..paper }
}

/// How examples are made; the latency is the drive's.
pub(crate) fn labels(arguments: &KinodynamicsLabelArguments) -> LabelConfig {
    let paper = LabelConfig::paper(0.0);
    let kept = match arguments.filter {
        KinodynamicsFilter::Paper => paper,
        KinodynamicsFilter::Understeer => LabelConfig { difference_max_per_m: None, ..paper },
        KinodynamicsFilter::None => LabelConfig::unfiltered(0.0),
    };
    let speed_source = match arguments.speed {
        KinodynamicsSpeed::Commanded => SpeedSource::Commanded,
        KinodynamicsSpeed::Wheels => SpeedSource::Wheels,
    };
    let effect = match arguments.effect {
        KinodynamicsEffect::Middle => EffectPart::Middle,
        KinodynamicsEffect::Beginning => EffectPart::Beginning,
    };
    LabelConfig { effect, speed_source, ..kept }
}

fn write(
    arguments: &TrainKinodynamicsArguments,
    settings: &Settings,
    outcome: &Outcome,
) -> anyhow::Result<()> {
    // The sidecar holds the hash of the weights: a half-written pair is refused when it is read.
    arguments.results.write("kinodynamics.safetensors", &outcome.checkpoint.weights_bytes()?)?;
    arguments.results.write("kinodynamics.json", &outcome.checkpoint.sidecar_bytes()?)?;
    let written = Written {
        revision: summary::revision(),
        settings,
        latency: outcome.latency,
        n_examples: outcome.n_examples,
        counts: outcome.counts,
        identity_rmse_per_m: outcome.identity_rmse_per_m,
        curves: &outcome.curves,
    };
    arguments.results.write_json("kinodynamics_training.json", &written)?;
    Ok(())
}

fn told(outcome: &Outcome) -> String {
    let Outcome {
        counts, latency, n_examples: [n_training, n_validation], identity_rmse_per_m, curves, ..
    } = outcome;
    let best = curves.iter().map(|epoch| epoch.validation_rmse_per_m).fold(f64::INFINITY, f64::min);
    format!(
        "  latency {:.3} s (correlation {:.2}), dead time {:.3} s\n  of {} commands {} are examples; dropped: {} without samples, {} slow, {} \
         of other sign, {} oversteer, {} too different\n  {n_training} examples to learn from, {n_validation} in other \
         blocks of time to choose by\n  curvature on these off by {best:.4} 1/m (root mean square); the wish itself by \
         {identity_rmse_per_m:.4}\n",
        latency.seconds,
        latency.correlation,
        latency.dead_time_s,
        counts.ticks,
        counts.kept,
        counts.no_samples,
        counts.slow,
        counts.other_sign,
        counts.oversteer,
        counts.different
    )
}
