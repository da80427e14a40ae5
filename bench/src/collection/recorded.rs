//! Data from drives that were recorded, on ground that is known from elsewhere.

use std::sync::Arc;

use bicycle::{Column, DriveLog, Vehicle};
use evidential::{FeatureLayout, LabelConfig, Reversing, Surveyor, estimate_responses, labels};
use navigator::Config;
use scenarios::{Bounds, LayerConfig, World, WorldLayers, world_from_layers};
use terrain::{GridMap, SurfaceCell, height_at};

use super::{Collection, CollectionError, Recorded, Trial, dataset_of, examples, paper_prior};
use crate::closed_loop::true_surface;

/// Share of the labels that must lie on known ground.
const COVERED_SHARE_MIN: f64 = 0.5;

/// Labels recorded drives and looks at the ground below them. Poses are in the frame of the layers.
///
/// Runs whose machine is told its yaw rate instead of a steering angle are labelled in reverse too.
///
/// # Errors
/// Columns that are missing, layers that make no world, ground known under less than half of the labels, nothing
/// labelled.
pub fn collect_recorded(
    vehicle: &Vehicle,
    log: DriveLog,
    layers: &WorldLayers,
    source: &Recorded,
) -> Result<Collection, CollectionError> {
    let (config, prior) = (Config::for_vehicle(vehicle), paper_prior(vehicle));
    let is_steered = log.columns().any(|column| column == Column::CmdSteer);
    let reversing = if is_steered { Reversing::Masked } else { Reversing::Labelled };
    let labelling = LabelConfig { reversing, ..LabelConfig::for_vehicle(&vehicle.geometry, &vehicle.limits) };
    let responses = estimate_responses(&log, &vehicle.geometry, &labelling)?;
    let drives: Vec<_> = log
        .runs()
        .map(|run| labels(&run, &vehicle.geometry, &responses, &labelling))
        .collect::<Result<_, _>>()?;
    let poses_m = || drives.iter().flatten().map(|label| [label.pose[0], label.pose[1]]);
    let n_labels = poses_m().count();
    if n_labels == 0 {
        return Err(CollectionError::NothingLabelled { n_rows: log.n_rows(), n_runs: log.runs().len() });
    }
    let (world, surface) =
        recorded_surface(vehicle, layers, poses_m(), &source.ground, config.elevation.resolution_m)?;

    let layout = FeatureLayout::for_vehicle(&vehicle.geometry);
    let surveyor = Surveyor::new(&vehicle.geometry, layout, prior, config.elevation.resolution_m)?;
    let (mut all, mut trials) = (Vec::new(), Vec::new());
    for (index, (run, labels)) in log.runs().zip(&drives).enumerate() {
        let examples = examples(&surveyor, labels, &surface, index as u32)?;
        trials.push(Trial {
            map: 0,
            outcome: None,
            time_s: duration_s(run.time_s()),
            n_examples: examples.len(),
            n_unknown_ground: labels.len() - examples.len(),
        });
        all.extend(examples);
    }
    if (all.len() as f64) < COVERED_SHARE_MIN * n_labels as f64 {
        let (drive, ground) = (around(poses_m()), layers.bounds());
        return Err(CollectionError::NotCovered { n_labels, n_covered: all.len(), drive, ground });
    }
    let names = log.runs().map(|run| run.name().to_owned()).collect();
    let provenance = format!("recorded drive {} on {}", source.log, source.ground);
    let dataset = dataset_of(vehicle, layout, prior, names, provenance, all)?;
    Ok(Collection { dataset, trials, responses, labelling, worlds: vec![world], log })
}

fn duration_s(time_s: &[f64]) -> f64 {
    time_s.last().zip(time_s.first()).map_or(0.0, |(last_s, first_s)| last_s - first_s)
}

fn around(poses_m: impl Iterator<Item = [f64; 2]>) -> Bounds {
    let nothing = Bounds { south_west_m: [f64::INFINITY; 2], north_east_m: [f64::NEG_INFINITY; 2] };
    poses_m.fold(nothing, |bounds, place_m| Bounds {
        south_west_m: [0, 1].map(|axis| bounds.south_west_m[axis].min(place_m[axis])),
        north_east_m: [0, 1].map(|axis| bounds.north_east_m[axis].max(place_m[axis])),
    })
}

/// The part of the layers that the poses need, as a world and as the surface that a robot's map would show; unknown
/// where the layers have no height.
///
/// # Errors
/// Layers that make no world.
pub fn recorded_surface(
    vehicle: &Vehicle,
    layers: &WorldLayers,
    poses_m: impl Iterator<Item = [f64; 2]>,
    name: &str,
    resolution_m: f64,
) -> Result<(Arc<World>, GridMap<SurfaceCell>), CollectionError> {
    let margin_m = 2.0 * vehicle.geometry.length_m + 2.0 * layers.elevation_m.geometry().resolution_m;
    let Bounds { south_west_m, north_east_m } = around(poses_m);
    let window = Bounds {
        south_west_m: south_west_m.map(|edge_m| edge_m - margin_m),
        north_east_m: north_east_m.map(|edge_m| edge_m + margin_m),
    };
    // Trees that nobody saw are no part of a recorded drive.
    let config = LayerConfig { window: Some(window), stems_per_m2: 0.0, ..LayerConfig::for_vehicle(vehicle) };
    let world = world_from_layers(name, layers, &config, 0)?;
    let mut surface = true_surface(&world, resolution_m);
    let geometry = *surface.geometry();
    for (index, cell) in surface.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        if height_at(&layers.elevation_m, x_m, y_m).is_nan() {
            *cell = SurfaceCell::UNKNOWN;
        }
    }
    Ok((Arc::new(world), surface))
}
