//! `surefoot gap score`: every case of a set diagnosed, every answer held against its label.
#![allow(clippy::disallowed_methods, reason = "how long a diagnosis takes is a part of its score")]

mod unfinished;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use bench::gap_score::{DiagnosedCase, Score, score};
use bicycle::DriveLog;
use formats::{GapCase, GapLabel};
use serde::Serialize;
use sim_to_real::{Answer, Baseline, Machine, diagnose, verify};

use super::machine;
use super::workers::{Bar, work};
use crate::arguments::GapScoreArguments;
use crate::{UsageError, WorkFailed, summary};
use unfinished::Unfinished;

/// The content of `score.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    set: String,
    #[serde(flatten)]
    score: &'a Score,
}

/// A case with its label.
struct Labelled {
    name: String,
    label: GapLabel,
    case: GapCase,
}

/// What all cases of a vehicle have in common.
struct Vehicle {
    machine: Machine,
    baseline: Baseline,
}

pub(super) fn run(arguments: &GapScoreArguments) -> anyhow::Result<()> {
    let cases = labelled(arguments)?;
    arguments.results.prepare()?;
    let (diagnosed, failures) = match &arguments.answers {
        Some(folder) => (read_answers(folder, cases)?, Vec::new()),
        None => diagnose_all(arguments, cases)?,
    };
    let score = score(&diagnosed);
    print!("{}", report::gap_score::text(&score));
    write(arguments, &score)?;
    match failures.first() {
        None => Ok(()),
        Some(first) => Err(WorkFailed(format!("{} cases have no answer; {first}", failures.len())).into()),
    }
}

/// Errors: labels that are not the set's, a case without a folder, no case at all.
fn labelled(arguments: &GapScoreArguments) -> Result<Vec<Labelled>, UsageError> {
    let labels =
        formats::read_sealed_labels(&arguments.set, &arguments.labels).map_err(UsageError::from_input)?;
    let cases = labels.into_iter().take(arguments.first.unwrap_or(usize::MAX)).map(|(name, label)| {
        let folder = arguments.set.join("cases").join(&name);
        let case = formats::read_gap_case(&folder).map_err(UsageError::from_input)?;
        Ok(Labelled { name, label, case })
    });
    let cases: Vec<Labelled> = cases.collect::<Result<_, UsageError>>()?;
    if cases.is_empty() {
        return Err(UsageError(format!(
            "{}: expected at least one label, found none",
            arguments.labels.display()
        )));
    }
    Ok(cases)
}

fn read_answers(folder: &Path, cases: Vec<Labelled>) -> Result<Vec<DiagnosedCase>, UsageError> {
    let read = |Labelled { name, label, .. }: Labelled| {
        let path = folder.join(format!("{name}.json"));
        let refuse =
            |found: String| UsageError(format!("{}: expected an answer, found: {found}", path.display()));
        let text = std::fs::read(&path).map_err(|error| refuse(error.to_string()))?;
        let answer: Answer = serde_json::from_slice(&text).map_err(|error| refuse(error.to_string()))?;
        Ok(DiagnosedCase { name, label, answer, naming_s: None })
    };
    cases.into_iter().map(read).collect()
}

/// Answers, and what went wrong with the cases that have none.
fn diagnose_all(
    arguments: &GapScoreArguments,
    cases: Vec<Labelled>,
) -> anyhow::Result<(Vec<DiagnosedCase>, Vec<String>)> {
    let answers = arguments.results.file("answers");
    std::fs::create_dir_all(&answers)?;
    let unfinished = Unfinished::resume(arguments, answers)?;
    let missing: Vec<&Labelled> =
        cases.iter().filter(|labelled| unfinished.answer(&labelled.name).is_none()).collect();
    if missing.len() < cases.len() {
        println!("  {} of {} cases were answered before", cases.len() - missing.len(), cases.len());
    }
    let vehicles = calibrated(&missing, arguments.threads)?;
    let bar = Bar::new(cases.len(), "cases");
    let results = work(cases.len(), arguments.threads, |index| {
        let Labelled { name, label, case } = &cases[index];
        let (answer, naming_s) = match unfinished.answer(name) {
            Some(kept) => kept,
            None => match answered(case, &vehicles[&nominal(case)]) {
                Ok((answer, naming_s)) => {
                    unfinished.keep(name, (&answer, naming_s))?;
                    (answer, naming_s)
                }
                Err(error) => return Ok(Err(format!("{name}: {error:#}"))),
            },
        };
        bar.step(name);
        Ok(Ok(DiagnosedCase { name: name.clone(), label: label.clone(), answer, naming_s: Some(naming_s) }))
    })?;
    bar.finish();
    unfinished.finish()?;
    let (mut diagnosed, mut failures) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(case) => diagnosed.push(case),
            Err(failure) => failures.push(failure),
        }
    }
    Ok((diagnosed, failures))
}

/// What a baseline depends on: the vehicle's file and the nominal drives.
type Nominal = (PathBuf, Vec<PathBuf>);

fn nominal(case: &GapCase) -> Nominal {
    let resolved = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
    (resolved(&case.vehicle), case.sim.iter().map(resolved).collect())
}

fn calibrated(cases: &[&Labelled], n_threads: usize) -> anyhow::Result<BTreeMap<Nominal, Vehicle>> {
    let mut all: Vec<Nominal> = cases.iter().map(|labelled| nominal(&labelled.case)).collect();
    all.sort();
    all.dedup();
    let bar = Bar::new(all.len(), "vehicles");
    let vehicles = work(all.len(), n_threads, |index| {
        let (vehicle, sim) = &all[index];
        let sim = read_drives(sim)?;
        let machine = machine::read(&vehicle.to_string_lossy(), &sim)?;
        let baseline = Baseline::calibrate(&machine, &sim, &|_| ()).map_err(UsageError::from_input)?;
        bar.step(&machine.name);
        Ok(Vehicle { machine, baseline })
    })?;
    bar.finish();
    Ok(all.into_iter().zip(vehicles).collect())
}

/// The whole answer, and the time until the cause was named [s]. The held-out drives are opened after that.
fn answered(case: &GapCase, vehicle: &Vehicle) -> anyhow::Result<(Answer, f64)> {
    let Vehicle { machine, baseline } = vehicle;
    let real = read_drives(&case.real)?;
    let start = Instant::now();
    let diagnosis = diagnose(baseline, machine, &real)?;
    let naming_s = start.elapsed().as_secs_f64();
    let answer = diagnosis.answer(&case.name);
    if case.heldout.is_empty() {
        return Ok((answer, naming_s));
    }
    let verification = verify(baseline, machine, &diagnosis, &read_drives(&case.heldout)?)?;
    Ok((verification.complete(answer), naming_s))
}

fn read_drives(paths: &[PathBuf]) -> Result<Vec<DriveLog>, UsageError> {
    let read = |path: &PathBuf| Ok(formats::read_drive(path).map_err(UsageError::from_input)?.log);
    paths.iter().map(read).collect()
}

fn write(arguments: &GapScoreArguments, score: &Score) -> anyhow::Result<()> {
    let folder = arguments.set.file_name().unwrap_or(arguments.set.as_os_str());
    let title = format!("Diagnoses of {}", folder.display());
    let written = Written { revision: summary::revision(), set: arguments.set.display().to_string(), score };
    arguments.results.write_json("score.json", &written)?;
    let pictures = report::gap_score::pictures(score, &title)?;
    for picture in &pictures {
        arguments.results.write(picture.file, &picture.png)?;
    }
    let program = format!("surefoot, revision {}", summary::revision());
    let page = report::gap_score::page(score, &title, &pictures, &program);
    arguments.results.write("score.html", page.as_bytes())?;
    println!(
        "\n  score.html, score.json and {} pictures in {}",
        pictures.len(),
        arguments.results.out.display()
    );
    Ok(())
}
