//! `surefoot collect`: what was asked, the drives or a recorded one, and the dataset with its summary and picture.
#![allow(clippy::disallowed_methods, reason = "a person is told how long it took")]

mod recorded;
mod summary;
mod teleoperation;

use std::path::{Path, PathBuf};
use std::time::Instant;

use bench::closed_loop::MapSource;
use bench::collection::{
    Collection, CollectionError, HeightScale, Place, Request, collect, find_height_scale,
};
use bicycle::Vehicle;
use evidential::Dataset;
use formats::{read_vehicle, write_bytes_atomic};
use scenarios::{RockFieldConfig, Split};

use crate::arguments::{CollectArguments, CollectMap, CollectWorld};
use crate::{UsageError, output, progress};
use summary::CollectSummary;

/// Share of the test footprints that shall be more uneven than half of the training ones, and how exactly.
const HARDER_SHARE: [f64; 2] = [0.91, 0.005];
/// Height scales that are driven for it.
const SCALES_TRIED: usize = 8;

pub(crate) fn run(arguments: &CollectArguments) -> anyhow::Result<()> {
    let picture = prepare_output(arguments)?;
    if arguments.teleop_random {
        return teleoperation::run(arguments);
    }
    let vehicle = read_vehicle(arguments.vehicle_name_or_path()).map_err(UsageError::from_input)?;
    let began = Instant::now();
    let (collection, scale) = match (&arguments.log, &arguments.elevation) {
        (Some(log), Some(elevation)) => (recorded::gather(arguments, &vehicle, log, elevation)?, None),
        _ => drive(arguments, &vehicle)?,
    };
    let summary = CollectSummary::of(&collection, scale, began.elapsed().as_secs_f64());
    write_bytes_atomic(&arguments.out, &collection.dataset.to_bytes()?)?;
    arguments.copy.write(&summary)?;
    formats::write_bytes_atomic(&picture, &report::collection::picture(&collection, &vehicle)?)?;
    print!("{summary}");
    println!("  {}\n  {}", arguments.out.display(), picture.display());
    Ok(())
}

/// Tries out the places of the results and tells where the picture goes.
fn prepare_output(arguments: &CollectArguments) -> Result<PathBuf, UsageError> {
    output::prepare_large_file("--out", &arguments.out)?;
    arguments.copy.prepare()?;
    Ok(arguments.out.with_extension("png"))
}

/// Simulated drives, and the height scale if one was looked for.
fn drive(
    arguments: &CollectArguments,
    vehicle: &Vehicle,
) -> anyhow::Result<(Collection, Option<HeightScale>)> {
    let mut request = request(arguments, vehicle)?;
    let scale = find_scale(arguments, &mut request)?;
    let n_trials = u64::from(request.n_maps) * u64::from(request.n_trials);
    let bar = progress::bar(n_trials, "{pos}/{len} trials, {eta} left");
    let collected = collect(&request, || bar.inc(1));
    bar.finish_and_clear();
    Ok((collected.map_err(told)?, scale))
}

fn request(arguments: &CollectArguments, vehicle: &Vehicle) -> Result<Request, UsageError> {
    let split = Split::from(arguments.split);
    let place = match arguments.world {
        CollectWorld::Testbed => rocks(RockFieldConfig::testbed(), arguments, split),
        CollectWorld::Rocks => rocks(RockFieldConfig::default(), arguments, split),
        CollectWorld::Arena => Place::Arena { split },
        CollectWorld::Floor => Place::Floor { split },
    };
    let is_scaled = matches!(place, Place::Rocks { split: Split::Test, .. });
    let asked = [
        ("--test-height-scale", arguments.test_height_scale.is_some()),
        ("--harder-than", arguments.harder_than.is_some()),
    ];
    if let Some((option, _)) = asked.iter().find(|(_, is_given)| *is_given && !is_scaled) {
        return Err(UsageError(format!(
            "{option}: expected together with --split test on a rock field, found without it"
        )));
    }
    Ok(Request {
        n_maps: arguments.maps,
        n_trials: arguments.trials,
        time_limit_s: arguments.time_limit,
        map_source: match arguments.map {
            CollectMap::Oracle => MapSource::Oracle,
            CollectMap::Sensed => MapSource::Sensed,
        },
        n_threads: arguments.threads.count(),
        ..Request::new(vehicle.clone(), place, arguments.seed)
    })
}

fn rocks(field: RockFieldConfig, arguments: &CollectArguments, split: Split) -> Place {
    let test_height_scale = arguments.test_height_scale.unwrap_or(field.test_height_scale);
    Place::Rocks { field: RockFieldConfig { test_height_scale, ..field }, split }
}

/// The height scale that makes the test split as hard as asked, put into the request.
fn find_scale(arguments: &CollectArguments, request: &mut Request) -> anyhow::Result<Option<HeightScale>> {
    let Some(path) = &arguments.harder_than else { return Ok(None) };
    let training = read_dataset(path)?;
    let found = find_height_scale(&training, request, HARDER_SHARE, SCALES_TRIED).map_err(told)?;
    if let Place::Rocks { field, .. } = &mut request.place {
        field.test_height_scale = found.scale;
    }
    Ok(Some(found))
}

/// A dataset from its file.
pub(crate) fn read_dataset(path: &Path) -> Result<Dataset, UsageError> {
    let told = |error: &dyn std::fmt::Display| UsageError(format!("{}: {error}", path.display()));
    let bytes =
        std::fs::read(path).map_err(|error| told(&format!("expected a readable file, found: {error}")))?;
    Dataset::from_bytes(&bytes).map_err(|error| told(&error))
}

/// What was asked for cannot be: the user's choice. All else is not.
fn told(error: CollectionError) -> anyhow::Error {
    match error {
        CollectionError::Place(_)
        | CollectionError::NoStart { .. }
        | CollectionError::Setting { .. }
        | CollectionError::Labels(_)
        | CollectionError::Layers(_)
        | CollectionError::NothingLabelled { .. }
        | CollectionError::NotCovered { .. }
        | CollectionError::Dataset(_)
        | CollectionError::Survey(_) => UsageError::from_input(error).into(),
        other => other.into(),
    }
}
