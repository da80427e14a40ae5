//! `surefoot bench plant`: what was measured as text, JSON and picture.

use ::bench::plant::{Report, measure};

use crate::UsageError;
use crate::arguments::BenchPlantArguments;
use crate::output::WithRevision;

pub(crate) fn run_plant(arguments: &BenchPlantArguments) -> anyhow::Result<()> {
    let vehicle = formats::read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    arguments.results.prepare()?;
    let report = measure(&vehicle)?;
    print!("{}", report::plant::text(&report));
    write(&report, arguments)
}

fn write(report: &Report, arguments: &BenchPlantArguments) -> anyhow::Result<()> {
    arguments.results.write_json("plant.json", &WithRevision::of(report))?;
    arguments.results.write("plant.png", &report::plant::picture(report)?)?;
    println!("\n  plant.json and plant.png in {}", arguments.results.out.display());
    Ok(())
}
