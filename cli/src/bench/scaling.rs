//! `surefoot bench scaling`: what was measured as text, JSON and picture.

use ::bench::scaling::{Request, measure};

use super::told;
use crate::arguments::BenchScalingArguments;
use crate::output::WithRevision;

/// The files that it leaves.
const JSON: &str = "scaling.json";
const PICTURE: &str = "scaling.png";

pub(crate) fn run_scaling(arguments: &BenchScalingArguments) -> anyhow::Result<()> {
    let results = &arguments.results;
    results.prepare()?;
    let report = measure(&Request {
        over: arguments.over.iter().flat_map(|varied| varied.curves()).copied().collect(),
        n_threads: arguments.kernels.threads.count(),
        n_updates: arguments.updates,
        n_maps: arguments.maps,
        isa: arguments.kernels.isa.into(),
    })
    .map_err(told)?;
    print!("{}", report::scaling::text(&report));
    results.write_json(JSON, &WithRevision::of(&report))?;
    results.write(PICTURE, &report::scaling::picture(&report)?)?;
    println!("  {JSON} and {PICTURE} in {}", results.out.display());
    Ok(())
}
