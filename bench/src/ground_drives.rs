//! What drives met that were recorded with maps, or over ground that is known from elsewhere.

use std::path::Path;

use bicycle::{Column, DriveLog, Run, Vehicle};
use evidential::{Checkpoint, EncounterError, Foretelling, LabelConfig, MapAt, encounters, maps_of_runs};
use formats::{ColumnNames, DriveFileError, McapReadError, read_drive_log_mcap, read_recorded_maps};
use navigator::Config;
use scenarios::WorldLayers;
use traversability::Encounter;

use crate::collection::{CollectionError, recorded_surface};

/// By what footprints are judged.
#[derive(Clone, Copy)]
pub struct GroundBelief<'a> {
    /// Who drove.
    pub vehicle: &'a Vehicle,
    /// Networks; without, physics alone judges.
    pub checkpoint: Option<&'a Checkpoint>,
    /// The ground below logs that hold no maps; with it, maps of recordings are left alone.
    pub elevation: Option<&'a WorldLayers>,
}

/// Drives that say nothing of a belief.
#[derive(Debug, thiserror::Error)]
pub enum GroundDriveError {
    /// A log without maps.
    #[error("{file}: expected a recording (.mcap) with maps, or --elevation with the ground below the drive")]
    NoMaps {
        /// The log.
        file: String,
    },
    /// A file that is no drive.
    #[error(transparent)]
    Drive(#[from] DriveFileError),
    /// A recording that is none.
    #[error(transparent)]
    Recording(#[from] McapReadError),
    /// A recording that cannot be read again.
    #[error("{file}: expected a readable file, found: {source}")]
    Unreadable {
        /// The recording.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A drive that makes no labels, or whose maps cannot be judged.
    #[error("{file}: {source}")]
    Encounters {
        /// The drive.
        file: String,
        /// Why.
        source: EncounterError,
    },
    /// Ground that is none.
    #[error(transparent)]
    Ground(#[from] CollectionError),
}

impl GroundBelief<'_> {
    /// What was met on all drives, numbered in their order, and how many they are; what files leave out is told in
    /// `doubts`.
    ///
    /// # Errors
    /// The first file that is no drive or has no maps.
    pub fn met(
        &self,
        paths: &[impl AsRef<Path>],
        doubts: &mut Vec<String>,
    ) -> Result<(Vec<Encounter>, usize), GroundDriveError> {
        let (mut met, mut n_drives) = (Vec::new(), 0);
        let geometry = &self.vehicle.geometry;
        let foretelling = Foretelling {
            geometry,
            labelling: LabelConfig::for_vehicle(geometry, &self.vehicle.limits),
            prior: Config::for_vehicle(self.vehicle).prior,
            checkpoint: self.checkpoint,
        };
        for path in paths.iter().map(AsRef::as_ref) {
            let (log, maps) = self.read(path, doubts)?;
            let file = path.display().to_string();
            let found = encounters(&foretelling, &log, &maps)
                .map_err(|source| GroundDriveError::Encounters { file, source })?;
            let first = n_drives as u32;
            met.extend(found.into_iter().map(|found| Encounter { drive: first + found.drive, ..found }));
            n_drives += maps.len();
        }
        Ok((met, n_drives))
    }

    fn read(
        &self,
        path: &Path,
        doubts: &mut Vec<String>,
    ) -> Result<(DriveLog, Vec<Vec<MapAt>>), GroundDriveError> {
        let Some(elevation) = self.elevation else { return with_maps(path, doubts) };
        let drive = formats::read_drive_named(path, &ColumnNames::default())?;
        tell_early(path, drive.ended_early, doubts);
        let places_m: Vec<[f64; 2]> = drive.log.runs().flat_map(|run| places_m(&run)).collect();
        let resolution_m = Config::for_vehicle(self.vehicle).elevation.resolution_m;
        let (_, surface) =
            recorded_surface(self.vehicle, elevation, places_m.into_iter(), "elevation", resolution_m)?;
        let of_run = |_| vec![MapAt { at_s: f64::NEG_INFINITY, surface: surface.clone() }];
        let maps = drive.log.runs().map(of_run).collect();
        Ok((drive.log, maps))
    }
}

/// A recording that has maps of its own.
fn with_maps(path: &Path, doubts: &mut Vec<String>) -> Result<(DriveLog, Vec<Vec<MapAt>>), GroundDriveError> {
    let file = path.display().to_string();
    if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("mcap")) {
        return Err(GroundDriveError::NoMaps { file });
    }
    let read = read_drive_log_mcap(path)?;
    tell_early(path, read.ended_early, doubts);
    let maps = read_recorded_maps(path).map_err(|source| GroundDriveError::Unreadable { file, source })?;
    let maps = maps_of_runs(&read.log, &read.time_ns, maps);
    Ok((read.log, maps))
}

fn tell_early(path: &Path, problem: Option<String>, doubts: &mut Vec<String>) {
    doubts.extend(problem.map(|problem| format!("{}: the recording ends early, {problem}", path.display())));
}

fn places_m(run: &Run<'_>) -> Vec<[f64; 2]> {
    let [x_m, y_m] = [Column::X, Column::Y].map(|column| run.column(column).unwrap_or_default());
    let places = x_m.iter().zip(y_m).map(|(x_m, y_m)| [*x_m, *y_m]);
    places.filter(|place| place.iter().all(|along| along.is_finite())).collect()
}
