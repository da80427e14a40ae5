//! What was foretold of the ground that a drive went over, and what it met there.

use bicycle::lanes::Instructions;
use bicycle::{Column, DriveLog, Geometry, Run};
use physics_prior::PriorConfig;
use terrain::{GridMap, SurfaceCell, TerrainClass, WheelLayout, envelope_height};
use traversability::{Encounter, Foretold, GroundShown, Pmf};

use crate::label::{Rolling, rolling};
use crate::{
    Checkpoint, Example, FeatureLayout, Label, LabelConfig, LabelError, Prediction, Predictor,
    PredictorError, Prior, Responses, Surveyor, SurveyorError, estimate_responses, labels,
};

/// The ground as it was known at a time of a drive.
#[derive(Clone, Debug)]
pub struct MapAt {
    /// Since the drive began [s]; minus infinity for a map that was there before.
    pub at_s: f64,
    /// The ground.
    pub surface: GridMap<SurfaceCell>,
}

/// Maps of a recording, sorted to the runs of its log. `rows_ns` are the times of the rows, `maps` those of the maps on the
/// same clock [ns]; a map that is older than every row belongs to the first.
pub fn maps_of_runs(
    log: &DriveLog,
    rows_ns: &[u64],
    maps: Vec<(u64, GridMap<SurfaceCell>)>,
) -> Vec<Vec<MapAt>> {
    let mut maps = maps.into_iter().peekable();
    let mut first = 0;
    let of_run = |run: Run<'_>| {
        let time_s = run.time_s();
        let rows = &rows_ns[first.min(rows_ns.len())..(first + time_s.len()).min(rows_ns.len())];
        first += time_s.len();
        let end_ns = rows_ns.get(first).copied().unwrap_or(u64::MAX);
        let mut own = Vec::new();
        while let Some((at_ns, surface)) = maps.next_if(|(at_ns, _)| *at_ns < end_ns) {
            let row = rows.partition_point(|row_ns| *row_ns < at_ns).min(rows.len().saturating_sub(1));
            let Some((row_s, row_ns)) = time_s.get(row).zip(rows.get(row)) else { continue };
            own.push(MapAt { at_s: row_s + (at_ns as f64 - *row_ns as f64) * 1e-9, surface });
        }
        own
    };
    log.runs().map(of_run).collect()
}

/// Who drives, and what foretells.
#[derive(Clone, Copy, Debug)]
pub struct Foretelling<'a> {
    /// The machine.
    pub geometry: &'a Geometry,
    /// What of a drive is measured traversability.
    pub labelling: LabelConfig,
    /// The physics prior; with networks, their own counts.
    pub prior: PriorConfig,
    /// Networks, if any.
    pub checkpoint: Option<&'a Checkpoint>,
}

/// Why nothing can be said of a drive.
#[derive(Debug, thiserror::Error)]
pub enum EncounterError {
    /// The drive makes no labels.
    #[error(transparent)]
    Labels(#[from] LabelError),
    /// The ground cannot be looked at.
    #[error(transparent)]
    Survey(#[from] SurveyorError),
    /// The networks cannot judge it.
    #[error(transparent)]
    Predictor(#[from] PredictorError),
    /// Nothing to foretell from.
    #[error("maps: expected at least one map of the ground, found none in {n_drives} drives")]
    NoMap {
        /// Drives that were looked at.
        n_drives: usize,
    },
}

/// Every labelled footprint of drives, a run of the log for each: by the newest map of then, and by maps that were made
/// from farther away. `maps` are those of each run in the order of their times, all of one resolution.
///
/// # Errors
/// No map at all, columns that are missing, see [`labels`]; a parameter of the prior out of range, networks that are none,
/// maps of several resolutions.
pub fn encounters(
    foretelling: &Foretelling<'_>,
    log: &DriveLog,
    maps: &[Vec<MapAt>],
) -> Result<Vec<Encounter>, EncounterError> {
    let first = maps.iter().flatten().next().ok_or(EncounterError::NoMap { n_drives: maps.len() })?;
    let mut foreteller = Foreteller::new(foretelling, first.surface.geometry().resolution_m)?;
    let responses = estimate_responses(log, foretelling.geometry, &foretelling.labelling)?;
    let mut all = Vec::new();
    for ((number, run), maps) in (0..).zip(log.runs()).zip(maps) {
        all.extend(foreteller.encounters(&MappedRun { number, run, maps }, &responses)?);
    }
    Ok(all)
}

/// A drive with the maps that were made on the way.
struct MappedRun<'a> {
    number: u32,
    run: Run<'a>,
    maps: &'a [MapAt],
}

/// Foretells footprints from maps as a risk map would, and tells what each layer has to say.
struct Foreteller {
    geometry: Geometry,
    wheels: WheelLayout,
    surveyor: Surveyor,
    learned: Option<Learned>,
    labelling: LabelConfig,
}

/// Networks, and what they are weighed against.
struct Learned {
    predictor: Predictor,
    prior: Prior,
    prior_evidence: f32,
}

/// How far ahead footprints are foretold, in lengths of the vehicle; with the first, the newest map counts.
const AHEAD_LENGTHS: [f64; 3] = [0.0, 1.5, 4.0];
/// A map counts as of such a distance up to so much more of it.
const AHEAD_MORE: f64 = 1.6;

impl Foreteller {
    fn new(foretelling: &Foretelling<'_>, resolution_m: f64) -> Result<Self, EncounterError> {
        let Foretelling { geometry, labelling, prior, checkpoint } = *foretelling;
        let learned = checkpoint.map(Learned::of).transpose()?;
        let (layout, prior) = match checkpoint {
            Some(checkpoint) => (checkpoint.sidecar.layout, checkpoint.sidecar.prior),
            None => (FeatureLayout::for_vehicle(geometry), prior),
        };
        Ok(Self {
            geometry: *geometry,
            wheels: WheelLayout { wheelbase_m: geometry.wheelbase_m, track_m: geometry.track_m },
            surveyor: Surveyor::new(geometry, layout, prior, resolution_m)?,
            learned,
            labelling,
        })
    }

    fn encounters(
        &mut self,
        drive: &MappedRun<'_>,
        responses: &Responses,
    ) -> Result<Vec<Encounter>, EncounterError> {
        let labels = labels(&drive.run, &self.geometry, responses, &self.labelling)?;
        let rolling = rolling(&drive.run, &self.geometry, responses, &self.labelling, &labels)?;
        let mut found = Vec::new();
        for (label, rolling) in labels.iter().zip(&rolling) {
            for (index, distance_m) in self.maps_for(drive, label) {
                found.extend(self.encounter(
                    drive,
                    label,
                    rolling,
                    &drive.maps[index].surface,
                    distance_m,
                )?);
            }
        }
        Ok(found)
    }

    /// For each distance ahead, the newest map that was made from there, and from how far it really was [m].
    fn maps_for(&self, drive: &MappedRun<'_>, label: &Label) -> Vec<(usize, f64)> {
        let n_made = drive.maps.partition_point(|map| map.at_s <= label.time_s);
        let distance_m = |index: usize| distance_m(drive, drive.maps[index].at_s, label);
        let mut chosen: Vec<(usize, f64)> = Vec::new();
        for lengths in AHEAD_LENGTHS {
            let least_m = lengths * self.geometry.length_m;
            let from_there = (0..n_made).rev().find(|&index| distance_m(index) >= least_m);
            let Some(index) = from_there else { continue };
            let is_near = lengths == 0.0 || distance_m(index) <= AHEAD_MORE * least_m;
            if is_near && chosen.iter().all(|(other, _)| *other != index) {
                chosen.push((index, distance_m(index)));
            }
        }
        chosen
    }

    fn encounter(
        &mut self,
        drive: &MappedRun<'_>,
        label: &Label,
        rolling: &Rolling,
        surface: &GridMap<SurfaceCell>,
        distance_m: f64,
    ) -> Result<Option<Encounter>, EncounterError> {
        let Some(example) = self.surveyor.example(surface, label, drive.number)? else { return Ok(None) };
        let Some(ground) = self.shown(surface, &example, measured_height_m(drive, label)) else {
            return Ok(None);
        };
        Ok(Some(Encounter {
            drive: drive.number,
            time_s: label.time_s,
            pose: label.pose,
            distance_m,
            speed_mps: rolling.speed_mps,
            wheel_share: rolling.wheel_share,
            slip: rolling.slip,
            measured: label.measured,
            ground,
            foretold: self.foretold(&example)?,
        }))
    }

    /// `None` where a wheel stands on ground without a height.
    fn shown(
        &self,
        surface: &GridMap<SurfaceCell>,
        example: &Example,
        axle_height_m: f64,
    ) -> Option<GroundShown> {
        let [x_m, y_m, yaw_rad] = example.pose;
        let contacts = self.wheels.contact_points_m(x_m, y_m, yaw_rad);
        let mut mean =
            SurfaceCell { vegetation_height_m: 0.0, class_probability: [0.0; 4], ..SurfaceCell::UNKNOWN };
        for [x_m, y_m] in contacts {
            let cell = surface.geometry().cell_at(x_m, y_m).map(|cell| surface[cell])?;
            mean.vegetation_height_m += 0.25 * cell.vegetation_height_m;
            for class in 0..TerrainClass::COUNT {
                mean.class_probability[class] += 0.25 * cell.class_probability[class];
            }
        }
        let radius_m = self.geometry.wheel_radius_m;
        // A wheel stands on the first ground that a ball of its radius touches: within a cell around the middle.
        let reach_m = radius_m.min(surface.geometry().resolution_m);
        let [front_left, rear_left, rear_right, front_right] =
            contacts.map(|[x_m, y_m]| f64::from(envelope_height(surface, x_m, y_m, reach_m)));
        let rear_m = 0.5 * (rear_left + rear_right);
        let slope_along = (0.5 * (front_left + front_right) - rear_m) / self.wheels.wheelbase_m;
        let left_above_m = 0.5 * (front_left + rear_left - rear_right - front_right);
        let shown = GroundShown {
            class: mean.class(),
            vegetation_height_m: mean.vegetation_height_m,
            slope_along,
            slope_across: left_above_m / self.wheels.track_m,
            unevenness_m: example.unevenness_m,
            height_error_m: rear_m + radius_m - axle_height_m,
        };
        (slope_along.is_finite() && left_above_m.is_finite()).then_some(shown)
    }

    fn foretold(&self, example: &Example) -> Result<Foretold, PredictorError> {
        let prior = example.prior.map(Pmf::normalised);
        let Some(learned) = &self.learned else {
            return Ok(Foretold { prior, networks: None, learned_share: [0.0; 4], posterior: prior });
        };
        let prediction = learned.predictor.predict(&[&example.features])?.remove(0);
        let learned_share = learned.share(&prediction);
        let against = if learned.prior == Prior::Uniform { [Pmf::UNIFORM; 4] } else { prior };
        let posterior = std::array::from_fn(|parameter| {
            against[parameter].mixed_with(&prediction.pmfs[parameter], learned_share[parameter])
        });
        Ok(Foretold { prior, networks: Some(prediction.pmfs), learned_share, posterior })
    }
}

impl Learned {
    fn of(checkpoint: &Checkpoint) -> Result<Self, PredictorError> {
        Ok(Self {
            predictor: Predictor::new(checkpoint, Instructions::widest())?,
            prior: checkpoint.sidecar.method.prior(),
            prior_evidence: checkpoint.sidecar.prior.evidence as f32,
        })
    }

    fn share(&self, prediction: &Prediction) -> [f32; 4] {
        prediction.learned_share(self.prior, self.prior_evidence)
    }
}

/// From where the vehicle was at a time to the label [m]; nothing for a map that was there before the drive.
fn distance_m(drive: &MappedRun<'_>, at_s: f64, label: &Label) -> f64 {
    let time_s = drive.run.time_s();
    let row = time_s.partition_point(|&row_s| row_s < at_s).min(time_s.len().saturating_sub(1));
    let columns = [Column::X, Column::Y].map(|column| drive.run.column(column).map(|values| values[row]));
    match columns {
        [Some(x_m), Some(y_m)] if at_s.is_finite() => (label.pose[0] - x_m).hypot(label.pose[1] - y_m),
        _ => 0.0,
    }
}

/// NaN where the drive has no heights [m].
fn measured_height_m(drive: &MappedRun<'_>, label: &Label) -> f64 {
    let row = drive.run.time_s().partition_point(|&row_s| row_s < label.time_s);
    drive.run.column(Column::Z).and_then(|heights_m| heights_m.get(row).copied()).unwrap_or(f64::NAN)
}
