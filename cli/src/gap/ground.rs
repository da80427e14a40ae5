//! `surefoot gap ground`: drives with their maps, what was foretold from these, and the report.

use bench::closed_loop::{Method, layers_of};
use bench::ground_drives::GroundBelief;
use formats::{read_elevation, read_vehicle};
use sim_to_real::judge_ground;

use crate::UsageError;
use crate::arguments::GapGroundArguments;
use crate::drive::knowledge::Knowledge;
use crate::output::WithRevision;

pub(super) fn run(arguments: &GapGroundArguments) -> anyhow::Result<()> {
    let vehicle = read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    let asked = arguments.method.map(Method::from);
    let knowledge = Knowledge::of_ground(arguments.weights.as_deref(), asked, &vehicle)?;
    let elevation = arguments.elevation.as_deref().map(read_elevation).transpose();
    let elevation = elevation.map_err(UsageError::from_input)?.map(layers_of);
    arguments.results.prepare()?;
    let belief = GroundBelief {
        vehicle: &vehicle,
        checkpoint: knowledge.networks.as_deref(),
        elevation: elevation.as_ref(),
    };
    let mut doubts = Vec::new();
    let (met, n_drives) = belief.met(&arguments.drives, &mut doubts).map_err(UsageError::from_input)?;
    let (reference, _) = belief.met(&arguments.reference, &mut doubts).map_err(UsageError::from_input)?;
    doubts.iter().for_each(|doubt| eprintln!("surefoot: {doubt}"));
    let report = judge_ground(&met, &reference, n_drives).map_err(UsageError::from_input)?;
    let drives = format!(
        "{}, {n_drives} drives, {} of reference, judged by {}",
        vehicle.name,
        arguments.reference.len(),
        knowledge.method.name()
    );
    print!("{}", report::ground::text(&report));
    let picture = report::ground::picture(&report, &drives)?;
    arguments.results.write_json("ground.json", &WithRevision::of(&report))?;
    arguments.results.write("ground.png", &picture.png)?;
    arguments.results.write("ground.html", report::ground::page(&report, &drives, &picture).as_bytes())?;
    println!("\n  ground.html, ground.json and ground.png in {}", arguments.results.out.display());
    Ok(())
}
