//! `surefoot bench kinodynamics`: the experiments, a bar meanwhile, and their results as text, JSON, pictures and page.
#![allow(clippy::disallowed_methods, reason = "people are told how long the benchmark takes")]

mod log;

use std::time::Instant;

use ::bench::kinodynamics::{
    HALF_WIDTH_M, KinodynamicsError, Report, Request, Row, Stage, VEHICLE, Watch, data_curve, measure,
    tune_walls,
};
use indicatif::ProgressBar;
use serde::Serialize;

use crate::arguments::{BenchKinodynamicsArguments, KinodynamicsRows};
use crate::train::labels;
use crate::{UsageError, WorkFailed, interrupt, progress, summary};

/// The content of `kinodynamics.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    took_s: f64,
    #[serde(flatten)]
    report: &'a Report,
}

pub(crate) fn run_kinodynamics(arguments: &BenchKinodynamicsArguments) -> anyhow::Result<()> {
    arguments.results.prepare()?;
    interrupt::catch_interrupts()?;
    if let Some(path) = &arguments.log {
        return log::run(arguments, path);
    }
    let request = request(arguments)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.count()).build()?;
    let progress = Progress(progress::bar(0, "{pos}/{len} {msg}"));
    if !arguments.tune_walls.is_empty() {
        let tuned =
            pool.install(|| tune_walls(&request, &arguments.tune_walls, &progress)).map_err(told_error)?;
        progress.0.finish_and_clear();
        for [half_width_m, success] in tuned {
            println!("  {half_width_m:.3} m: {:.1} % of the turns succeed", 100.0 * success);
        }
        return Ok(());
    }
    if !arguments.data_minutes.is_empty() {
        let points =
            pool.install(|| data_curve(&request, &arguments.data_minutes, summary::revision(), &progress));
        let points = points.map_err(told_error)?;
        progress.0.finish_and_clear();
        print!("{}", report::kinodynamics::data_curve_text(&points));
        return Ok(arguments.results.write_json("kinodynamics_data.json", &points)?);
    }
    let began = Instant::now();
    let report = pool.install(|| measure(&request, summary::revision(), &progress)).map_err(told_error)?;
    progress.0.finish_and_clear();
    print!("{}", report::kinodynamics::text(&report));
    write(arguments, &report, began.elapsed().as_secs_f64())
}

fn request(arguments: &BenchKinodynamicsArguments) -> Result<Request, UsageError> {
    Ok(Request {
        vehicle: formats::read_vehicle(VEHICLE).map_err(UsageError::from_input)?,
        seed: arguments.seed,
        minutes: arguments.minutes,
        epochs: arguments.epochs,
        laps: arguments.laps,
        labels: labels(&arguments.labels),
        teacher: arguments.labels.teacher.into(),
        rows: rows(&arguments.rows),
        half_width_m: arguments.half_width.unwrap_or(HALF_WIDTH_M),
    })
}

/// All that were asked for, alone or in a group, in the order of the tables.
fn rows(asked: &[KinodynamicsRows]) -> Vec<Row> {
    let of = |asked: &KinodynamicsRows| -> &'static [Row] {
        match asked {
            KinodynamicsRows::Paper => &Row::PAPER,
            KinodynamicsRows::Controls => &Row::CONTROLS,
            KinodynamicsRows::All => &Row::ALL,
            KinodynamicsRows::Baseline => &[Row::Baseline],
            KinodynamicsRows::Ablation => &[Row::Ablation],
            KinodynamicsRows::Learned => &[Row::Learned],
            KinodynamicsRows::Oracle => &[Row::Oracle],
            KinodynamicsRows::Shuffled => &[Row::Shuffled],
            KinodynamicsRows::Constant => &[Row::Constant],
            KinodynamicsRows::Wide => &[Row::Wide],
        }
    };
    Row::ALL.into_iter().filter(|row| asked.iter().any(|asked| of(asked).contains(row))).collect()
}

/// Too little data is the user's choice; all else is not.
pub(super) fn told_error(error: KinodynamicsError) -> anyhow::Error {
    match error {
        KinodynamicsError::Train(::kinodynamics::TrainError::TooFew { .. })
        | KinodynamicsError::NothingToProbe { .. } => UsageError::from_input(error).into(),
        KinodynamicsError::Interrupted => WorkFailed(error.to_string()).into(),
        other => other.into(),
    }
}

fn write(arguments: &BenchKinodynamicsArguments, report: &Report, took_s: f64) -> anyhow::Result<()> {
    let written = Written { revision: summary::revision(), took_s, report };
    arguments.results.write_json("kinodynamics.json", &written)?;
    let pictures = report::kinodynamics::pictures(report)?;
    for picture in &pictures {
        arguments.results.write(picture.file, &picture.png)?;
    }
    let page = report::kinodynamics::page(report, &pictures, summary::revision());
    arguments.results.write("kinodynamics.html", page.as_bytes())?;
    println!(
        "\n  {took_s:.0} s; kinodynamics.json, kinodynamics.html, kinodynamics_outdoor.png and kinodynamics_indoor.png in {}",
        arguments.results.out.display()
    );
    Ok(())
}

/// A bar for a terminal.
pub(super) struct Progress(pub(super) ProgressBar);

impl Watch for Progress {
    fn stage(&self, stage: Stage) {
        let (told, n) = match stage {
            Stage::Driving(n) => ("minutes of random driving".to_owned(), n),
            Stage::Training(row, n) => (format!("passes, {}", row.name()), n),
            Stage::Laps(n) => ("laps".to_owned(), n),
        };
        self.0.set_length(n);
        self.0.set_position(0);
        self.0.set_message(told);
    }

    fn step(&self) {
        self.0.inc(1);
    }

    fn interrupted(&self) -> bool {
        interrupt::interrupted()
    }
}
