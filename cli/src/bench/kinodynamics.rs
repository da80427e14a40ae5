//! `surefoot bench kinodynamics`: the experiments, a bar meanwhile, and their results as text, JSON, pictures and page.
#![allow(clippy::disallowed_methods, reason = "people are told how long the benchmark takes")]

mod html;
mod log;
mod told;

use std::io::IsTerminal;
use std::time::Instant;

use ::bench::kinodynamics::{
    HALF_WIDTH_M, KinodynamicsError, Report, Request, Row, Stage, VEHICLE, Watch, data_curve, measure,
    tune_walls,
};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::arguments::{BenchKinodynamicsArguments, KinodynamicsRows};
use crate::picture::draw_laps;
use crate::{UsageError, WorkFailed, interrupt, output, summary};

/// Room that must be free beforehand [bytes].
const ROOM_BYTES: u64 = 32 << 20;

/// The content of `kinodynamics.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    took_s: f64,
    #[serde(flatten)]
    report: &'a Report,
}

pub(crate) fn run_kinodynamics(arguments: &BenchKinodynamicsArguments) -> anyhow::Result<()> {
    formats::prepare_out_dir(&arguments.out, ROOM_BYTES)
        .map_err(|error| UsageError(format!("--out: {}", UsageError::from_input(error))))?;
    arguments.json.as_deref().map_or(Ok(()), output::prepare_json)?;
    interrupt::catch_interrupts()?;
    if let Some(path) = &arguments.log {
        return log::run(arguments, path);
    }
    let request = request(arguments)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.n_threads()).build()?;
    let progress = Progress(if std::io::stderr().is_terminal() {
        ProgressBar::no_length()
    } else {
        ProgressBar::hidden()
    });
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
        print!("{}", told::data_curve(&points));
        let file = arguments.out.join("kinodynamics_data.json");
        for path in [Some(&file), arguments.json.as_ref()].into_iter().flatten() {
            formats::write_json_atomic(path, &points)?;
        }
        return Ok(());
    }
    let began = Instant::now();
    let report = pool.install(|| measure(&request, summary::revision(), &progress)).map_err(told_error)?;
    progress.0.finish_and_clear();
    print!("{}", told::report(&report));
    write(arguments, &report, began.elapsed().as_secs_f64())
}

fn request(arguments: &BenchKinodynamicsArguments) -> Result<Request, UsageError> {
    Ok(Request {
        vehicle: formats::read_vehicle(VEHICLE).map_err(UsageError::from_input)?,
        seed: arguments.seed,
        minutes: arguments.minutes,
        epochs: arguments.epochs,
        laps: arguments.laps,
        rows: match arguments.rows {
            KinodynamicsRows::Paper => Row::PAPER.to_vec(),
            KinodynamicsRows::All => Row::ALL.to_vec(),
        },
        half_width_m: arguments.half_width.unwrap_or(HALF_WIDTH_M),
    })
}

/// Too little data is the user's choice; all else is not.
fn told_error(error: KinodynamicsError) -> anyhow::Error {
    match error {
        KinodynamicsError::Train(::kinodynamics::TrainError::TooFew { .. })
        | KinodynamicsError::NothingToProbe { .. } => UsageError::from_input(error).into(),
        KinodynamicsError::Interrupted => WorkFailed(error.to_string()).into(),
        other => other.into(),
    }
}

fn write(arguments: &BenchKinodynamicsArguments, report: &Report, took_s: f64) -> anyhow::Result<()> {
    let written = Written { revision: summary::revision(), took_s, report };
    let out = |name: &str| arguments.out.join(name);
    for path in [Some(out("kinodynamics.json")), arguments.json.clone()].iter().flatten() {
        formats::write_json_atomic(path, &written)?;
    }
    let pages = [
        ("kinodynamics_outdoor.png", draw_laps(&report.outdoor, report.half_width_m)),
        ("kinodynamics_indoor.png", draw_laps(&report.indoor, report.half_width_m)),
    ];
    let mut pictures = Vec::new();
    for (name, page) in pages {
        let png = page?;
        formats::write_bytes_atomic(&out(name), &png)?;
        pictures.push(png);
    }
    let page = html::page(report, &pictures, summary::revision());
    formats::write_bytes_atomic(&out("kinodynamics.html"), page.as_bytes())?;
    println!(
        "\n  {took_s:.0} s; kinodynamics.json, kinodynamics.html, kinodynamics_outdoor.png and kinodynamics_indoor.png in {}",
        arguments.out.display()
    );
    Ok(())
}

/// A bar for a terminal.
struct Progress(ProgressBar);

impl Watch for Progress {
    fn stage(&self, stage: Stage) {
        let (told, n) = match stage {
            Stage::Driving(n) => ("minutes of random driving".to_owned(), n),
            Stage::Training(row, n) => (format!("passes, {}", row.name()), n),
            Stage::Laps(n) => ("laps".to_owned(), n),
        };
        // The template is a constant: were it wrong, the plain bar would do.
        if let Ok(style) = ProgressStyle::with_template("  {bar:28.green/black.bright} {pos}/{len} {msg}") {
            self.0.set_style(style.progress_chars("━╸━"));
        }
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
