//! `surefoot bench learning --traction-map`: what was learned elsewhere, judged on measured traction.

use std::path::Path;

use ::bench::traction_map::{Head, Interval, Judgement, Source, TractionMapReport, judge};
use serde::Serialize;

use crate::arguments::BenchLearningArguments;
use crate::picture::draw_traction_map;
use crate::{UsageError, output, summary};

/// Room that must be free beforehand: the numbers and the picture of a large map take less [bytes].
const ROOM_BYTES: u64 = 16 << 20;

/// Seed of the bootstrap: the map is judged once, whatever was trained with which seed.
const BOOTSTRAP_SEED: u64 = 1;

/// The content of `traction_map.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    traction_map: String,
    #[serde(flatten)]
    report: &'a TractionMapReport,
}

pub(super) fn run(arguments: &BenchLearningArguments, path: &Path) -> anyhow::Result<()> {
    let map = formats::read_traction_map(path).map_err(UsageError::from_input)?;
    formats::prepare_out_dir(&arguments.out, ROOM_BYTES)
        .map_err(|error| UsageError(format!("--out: {}", UsageError::from_input(error))))?;
    arguments.json.as_deref().map_or(Ok(()), output::prepare_json)?;
    let judgement = judge(&map, BOOTSTRAP_SEED)?;
    let name = file_name(path);
    print!("{}", told(&name, &judgement.report));
    write(arguments, &name, &judgement)?;
    let title = format!("Traction in a forest that the network never saw: {name}");
    draw_traction_map(&title, &map, &judgement, &arguments.out.join("traction_map.png"))?;
    println!("\n  traction_map.json and traction_map.png in {}", arguments.out.display());
    Ok(())
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn write(arguments: &BenchLearningArguments, name: &str, judgement: &Judgement) -> anyhow::Result<()> {
    let written =
        Written { revision: summary::revision(), traction_map: name.to_owned(), report: &judgement.report };
    for path in [Some(arguments.out.join("traction_map.json")), arguments.json.clone()].iter().flatten() {
        formats::write_json_atomic(path, &written)?;
    }
    Ok(())
}

fn told(name: &str, report: &TractionMapReport) -> String {
    let percent = |n: usize| 100.0 * n as f64 / report.n_cells as f64;
    let mut told = format!(
        "  {name}: {} cells with measured traction, {:.0} % out of distribution, {:.0} % with something above the \
         ground\n\n  {:<20}{:<24}{:<24}\n",
        report.n_cells,
        percent(report.n_out_of_distribution),
        percent(report.n_obstructed),
        "EMD2 [bins]",
        "linear [95 %]",
        "angular [95 %]",
    );
    for source in Source::ALL {
        let [linear, angular] =
            [&report.linear, &report.angular].map(|head| told_interval(head.score(source).emd2));
        told += &format!("  {:<20}{linear:<24}{angular:<24}\n", source.name());
    }
    let row = |name: &str, of: &dyn Fn(&Head) -> Interval| {
        let [linear, angular] = [&report.linear, &report.angular].map(|head| told_interval(of(head)));
        format!("  {name:<20}{linear:<24}{angular:<24}\n")
    };
    told += "\n  fused with physics\n";
    told += &row("- less prediction", &|head| head.score(Source::FusedWithPhysics).less_prediction);
    told += &row("- less prior alone", &|head| head.score(Source::FusedWithPhysics).less_prior);
    told += &row("- over uniform", &|head| head.score(Source::FusedWithPhysics).over_uniform);
    told += &row("density AUROC", &|head| head.density_auroc);
    told
}

fn told_interval(interval: Interval) -> String {
    format!("{:.2} [{:.2}, {:.2}]", interval.value, interval.low, interval.high)
}
