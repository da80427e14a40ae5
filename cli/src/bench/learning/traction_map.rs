//! `surefoot bench learning --traction-map`: what was learned elsewhere, judged on measured traction.

use std::path::Path;

use ::bench::traction_map::{Judgement, TractionMapReport, judge};
use serde::Serialize;

use crate::arguments::BenchLearningArguments;
use crate::{UsageError, summary};

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
    arguments.results.prepare()?;
    let judgement = judge(&map, BOOTSTRAP_SEED)?;
    let name = file_name(path);
    print!("{}", report::traction_map::text(&name, &judgement.report));
    write(arguments, &name, &judgement)?;
    let title = format!("Traction in a forest that the network never saw: {name}");
    let png = report::traction_map::picture(&title, &map, &judgement)?;
    arguments.results.write("traction_map.png", &png)?;
    println!("\n  traction_map.json and traction_map.png in {}", arguments.results.out.display());
    Ok(())
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn write(arguments: &BenchLearningArguments, name: &str, judgement: &Judgement) -> anyhow::Result<()> {
    let written =
        Written { revision: summary::revision(), traction_map: name.to_owned(), report: &judgement.report };
    Ok(arguments.results.write_json("traction_map.json", &written)?)
}
