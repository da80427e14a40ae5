//! `surefoot replay`: what was recorded, decided again.

use std::path::Path;
use std::sync::Arc;

use bench::closed_loop::Method;
use evidential::{Checkpoint, shipped};
use navigator::Belief;
use runtime::replay::{self, Knowledge, ReplayReport};
use runtime::setup::{MachineSetup, RecordedSetup};

use crate::arguments::ReplayArguments;
use crate::drive::{read_checkpoint, read_inverse_model};
use crate::{UsageError, WorkFailed};

/// Every method that a recording may name.
const METHODS: [Method; 7] = [
    Method::Pietra,
    Method::PietraAvoid,
    Method::Evora,
    Method::PhysicsInformed,
    Method::Vanilla,
    Method::Physics,
    Method::Nominal,
];

pub(crate) fn run(arguments: &ReplayArguments) -> anyhow::Result<()> {
    arguments.copy.prepare()?;
    let records = replay::read(&arguments.files).map_err(UsageError::from_input)?;
    let Some(setup) = &records.setup else { return Ok(()) };
    let machine = MachineSetup::read(setup).map_err(UsageError::from_input)?;
    let knowledge = Knowledge {
        corrector: corrector(setup, arguments.kinodynamics_weights.as_deref())?,
        ..knowledge(setup, &machine, arguments.weights.as_deref())?
    };
    let report = replay::replay(&records, &knowledge).map_err(UsageError::from_input)?;
    arguments.copy.write(&report)?;
    show(&report);
    Ok(verdict(&report)?)
}

fn show(report: &ReplayReport) {
    println!(
        "{} of {} decisions made again to the last bit, from {} maps of the ground and {} risk maps",
        report.n_identical, report.n_decisions, report.n_surfaces, report.n_risk_maps
    );
    if report.n_corrections > 0 {
        println!("commands of {} decisions corrected for the ground again", report.n_corrections);
    }
    println!("localisation of {} maps of the ground made out again from the odometry", report.n_localised);
    if report.n_unverified > 0 {
        println!("  not verified: that of {}, for want of", report.n_unverified);
        report.unverified.iter().for_each(|why| println!("    {why}"));
    }
    for missing in &report.missing {
        println!("  not recorded: {missing}");
    }
    if let Some(why) = &report.ended_early {
        println!("  the recording breaks off: {why}");
    }
}

fn verdict(report: &ReplayReport) -> Result<(), WorkFailed> {
    match &report.first_difference {
        Some(difference) => Err(WorkFailed(difference.clone())),
        None if !report.contradictions.is_empty() => {
            let n_more = report.contradictions.len() - 1;
            Err(WorkFailed(format!("{}; {n_more} more such contradictions", report.contradictions[0])))
        }
        None if report.n_decisions == 0 => {
            Err(WorkFailed("expected decisions to make again, found none in the recording".to_owned()))
        }
        None if report.n_unmade > 0 => {
            let first = report.missing.first().map_or("", String::as_str);
            Err(WorkFailed(format!("{} decisions not made again, for want of {first}", report.n_unmade)))
        }
        None => Ok(()),
    }
}

/// The networks that corrected commands in the recording, and no others.
fn corrector(
    setup: &RecordedSetup,
    weights: Option<&Path>,
) -> Result<Option<Arc<kinodynamics::Checkpoint>>, UsageError> {
    let expected = &setup.corrector_sha256;
    if expected.is_empty() {
        return Ok(None);
    }
    let Some(folder) = weights else {
        return Err(UsageError(format!(
            "--kinodynamics-weights: expected the networks with SHA-256 {expected}, which corrected commands, found none"
        )));
    };
    let checkpoint = read_inverse_model(folder)?;
    let found = &checkpoint.sidecar().weights_sha256;
    if found != expected {
        return Err(UsageError(format!(
            "--kinodynamics-weights {}: expected networks with SHA-256 {expected}, found {found}",
            folder.display()
        )));
    }
    Ok(Some(Arc::new(checkpoint)))
}

/// The networks that the recording names, found by their hash and no others.
fn knowledge(
    setup: &RecordedSetup,
    machine: &MachineSetup,
    weights: Option<&Path>,
) -> anyhow::Result<Knowledge> {
    let named = METHODS.into_iter().find(|method| method.name() == setup.method);
    let method = named.ok_or_else(|| {
        UsageError(format!("recorded method: expected one that this program knows, found {}", setup.method))
    })?;
    let Some((training, unfamiliar)) = method.learned() else {
        let belief = if method == Method::Nominal { Belief::Nominal } else { Belief::Physics };
        return Ok(Knowledge { belief, checkpoint: 0, corrector: None });
    };
    let checkpoint: Checkpoint = match weights {
        Some(folder) => read_checkpoint(folder)?,
        None => shipped(training, &machine.vehicle.geometry).map_err(UsageError::from_input)?,
    };
    let digest = checkpoint.digest()?;
    let found = digest.hexadecimal();
    if found != setup.checkpoint_sha256 {
        let expected = &setup.checkpoint_sha256;
        return Err(UsageError(format!(
            "networks: expected those with SHA-256 {expected}, found {found}; give them with --weights"
        ))
        .into());
    }
    Ok(Knowledge::learned(Arc::new(checkpoint), unfamiliar, digest.short()))
}
