//! `surefoot collect --teleop-random`: random driving of a small car, to learn inverse kinodynamics from.

use bench::kinodynamics::{SURFACES, Teleoperation, teleoperate};
use serde::Serialize;

use crate::arguments::CollectArguments;
use crate::{UsageError, progress};

/// What is told of a recording.
#[derive(Serialize)]
struct Summary {
    vehicle: String,
    minutes: u32,
    n_commands: usize,
    n_samples: usize,
    grounds: Vec<String>,
    latency_s: f64,
}

pub(super) fn run(arguments: &CollectArguments) -> anyhow::Result<()> {
    let vehicle = formats::read_vehicle(arguments.vehicle_name_or_path()).map_err(UsageError::from_input)?;
    let only = arguments.surface.as_deref().map(surface).transpose()?;
    let asked = Teleoperation { minutes: arguments.minutes, only, seed: arguments.seed };
    let bar = progress::bar(u64::from(asked.minutes), "{pos}/{len} minutes");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.count()).build()?;
    let recording = pool.install(|| teleoperate(&vehicle, &asked, &|| bar.inc(1)))?;
    bar.finish_and_clear();
    formats::write_bytes_atomic(&arguments.out, &recording.to_bytes()?)?;
    let summary = Summary {
        vehicle: recording.vehicle.name.clone(),
        minutes: asked.minutes,
        n_commands: recording.n_ticks(),
        n_samples: recording.runs.iter().map(|run| run.imu.len()).sum(),
        grounds: recording.grounds_driven().into_iter().map(str::to_owned).collect(),
        latency_s: kinodynamics::estimate_latency(&recording)?.seconds,
    };
    arguments.copy.write(&summary)?;
    println!(
        "  {}: {} commands and {} samples in {} minutes on {}; latency {:.3} s\n  {}",
        summary.vehicle,
        summary.n_commands,
        summary.n_samples,
        summary.minutes,
        summary.grounds.join(", "),
        summary.latency_s,
        arguments.out.display()
    );
    Ok(())
}

fn surface(name: &str) -> Result<usize, UsageError> {
    SURFACES.iter().position(|surface| surface.name == name).ok_or_else(|| {
        let names: Vec<&str> = SURFACES.iter().map(|surface| surface.name).collect();
        UsageError(format!("--surface: expected one of {}, found {name}", names.join(", ")))
    })
}
