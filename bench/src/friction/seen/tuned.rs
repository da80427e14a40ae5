//! The paper's Tables 2 and 5: drives of biased sensors and wrong descriptions, and nobody who tells what the ground is.

use bicycle::Vehicle;
use friction::{Held, Lesson, Losses, Network, Seen, Settings, TrainingError, predict, refine, train};
use rayon::prelude::*;
use scenarios::Looks;
use serde::Serialize;

use super::drives::{Domain, Job, Machine, SeenDrive, seen_drive};
use super::errors::Row;
use super::{FrictionBenchError, Request, TRAINING_SEED, baseline_rows, errors, see};
use crate::Verdict;
use crate::sweep::in_turns;

/// Of the worlds to tune on, over those to learn from; and of the worlds to be tested on, over those of the first test.
const TUNING_SEED: u64 = TRAINING_SEED + (1 << 20);
const TEST_SEED: u64 = 1 << 20;
const BATCHES: usize = 150;
const LEARNING_RATE: f64 = 1e-3;

/// What the inner problem leaves as it is, by the name of its row; the first is the whole method.
const VARIANTS: [(&str, Held); 3] = [
    ("fine-tuned", Held::Nothing),
    ("fine-tuned, inertia held", Held::Inertia),
    ("fine-tuned, wheel speed held", Held::WheelSpeed),
];
const UNTUNED: &str = "not fine-tuned";

/// What the inner problem found of a vehicle, beside the truth.
#[derive(Clone, Debug, Serialize)]
pub struct FoundVehicle {
    /// Its name.
    pub vehicle: String,
    /// Moment of inertia over the described one [-], found and true.
    pub inertia_factor: [f64; 2],
    /// Wheel speed over the measured one [-], found and true.
    pub wheel_scale: [f64; 2],
}

/// Rows, what was found of the vehicles by the whole method, and the rule.
pub(super) type Tuned = (Vec<Row>, Vec<FoundVehicle>, Verdict);

/// Drives, tunes and tests; lessons of the simulation serve the baseline that has one friction for all.
pub(super) fn measure(
    request: &Request,
    pool: &rayon::ThreadPool,
    (network, simulated): (&Network, &[Lesson]),
    after: &(impl Fn(&str) + Sync),
) -> Result<Tuned, FrictionBenchError> {
    let drive = |first_seed: u64| {
        in_turns(pool, request.n_drives[1] as usize, |index| {
            let driven = biased_drive(request, first_seed, index);
            after("drive");
            driven
        })
    };
    let (tuning, tests) = (drive(TUNING_SEED)?, drive(TEST_SEED + request.first_seed)?);
    let variants = in_turns(pool, VARIANTS.len(), |index| {
        let variant = Variant::of(&request.vehicles, &tuning, network, VARIANTS[index].1)?;
        let (name, row) = (VARIANTS[index].0, variant.errors(&request.vehicles, &tests)?);
        after("training");
        Ok::<_, FrictionBenchError>((Row::of(name, &row), variant.found))
    })?;
    let seen = see(network, &tests)?;
    let lessons: Vec<&Lesson> = tuning.iter().map(|drive| &drive.lesson).collect();
    let mut rows = pool.install(|| baseline_rows(simulated, &lessons, &tests))?;
    let untuned =
        pool.install(|| errors(&tests, |drive, _, lesson, window| predict(lesson, window, &seen[drive])));
    rows.extend(Row::of(UNTUNED, &untuned));
    let found = variants[0].1.clone();
    rows.extend(variants.into_iter().rev().filter_map(|(row, _)| row));
    let verdict = verdict(&rows);
    Ok((rows, found, verdict))
}

fn biased_drive(request: &Request, first_seed: u64, index: usize) -> Result<SeenDrive, FrictionBenchError> {
    let which = index % request.vehicles.len();
    let job = Job {
        seed: first_seed + index as u64,
        looks: Looks::HeldOut,
        domain: Domain::Biased(Machine::drawn(which as u64)),
        duration_s: request.duration_s,
    };
    seen_drive(&request.vehicles[which], job, index)
}

/// A network tuned to drives, and the vehicles that were found along with it.
struct Variant {
    network: Network,
    vehicles: Vec<friction::Refined>,
    found: Vec<FoundVehicle>,
}

impl Variant {
    fn of(
        vehicles: &[Vehicle],
        tuning: &[SeenDrive],
        network: &Network,
        held: Held,
    ) -> Result<Self, FrictionBenchError> {
        let seen = see(network, tuning)?;
        let (mut refined, mut found) = (Vec::new(), Vec::new());
        let mut lessons: Vec<Option<Lesson>> = vec![None; tuning.len()];
        for (which, vehicle) in vehicles.iter().enumerate() {
            let of_vehicle: Vec<usize> = (which..tuning.len()).step_by(vehicles.len()).collect();
            let own: Vec<Lesson> = of_vehicle.iter().map(|index| tuning[*index].lesson.clone()).collect();
            let seen: Vec<Seen> = of_vehicle.iter().map(|index| seen[*index].clone()).collect();
            let mut vehicle_refined = refine(&own, &seen, held)?;
            for ((index, lesson), labels) in of_vehicle.iter().zip(&own).zip(&mut vehicle_refined.labels) {
                lessons[*index] = Some(lesson.clone().labelled(std::mem::take(labels)));
            }
            let machine = Machine::drawn(which as u64);
            found.push(FoundVehicle {
                vehicle: vehicle.name.clone(),
                inertia_factor: [vehicle_refined.inertia_factor, 1.0 / machine.inertia_factor],
                wheel_scale: [vehicle_refined.wheel_scale, 1.0 / machine.wheel_scale],
            });
            refined.push(vehicle_refined);
        }
        let lessons: Vec<Lesson> = lessons.into_iter().flatten().collect();
        let network = network.copied().map_err(TrainingError::from)?;
        let settings = Settings {
            losses: Losses::Prior,
            batches: BATCHES,
            learning_rate: LEARNING_RATE,
            ..Settings::default()
        };
        train(&network, &lessons, settings, &mut |_, _| {})?;
        Ok(Self { network, vehicles: refined, found })
    }

    /// Errors over the tests, whose measurements are put right as those of the tuning were.
    fn errors(
        &self,
        vehicles: &[Vehicle],
        tests: &[SeenDrive],
    ) -> Result<Vec<super::errors::Located>, FrictionBenchError> {
        let corrected: Vec<Lesson> = tests
            .par_iter()
            .enumerate()
            .map(|(index, test)| self.vehicles[index % vehicles.len()].corrected(&test.lesson, index))
            .collect();
        let seen = see(&self.network, tests)?;
        Ok(errors(tests, |drive, index, _, _| {
            predict(&corrected[drive], &corrected[drive].windows[index], &seen[drive])
        }))
    }
}

fn verdict(rows: &[Row]) -> Verdict {
    let of = |name: &str| {
        rows.iter().find(|row| row.method == name).map_or(f64::NAN, |row| row.overall.ate_m.value)
    };
    let ([full, inertia, wheel], untuned) = (VARIANTS.map(|(name, _)| of(name)), of(UNTUNED));
    Verdict {
        rule: "fine-tuned < inertia held < wheel speed held <= not, by ATE".to_owned(),
        found: format!("{full:.3}, {inertia:.3}, {wheel:.3}, {untuned:.3}"),
        is_passed: full < inertia && inertia < wheel && wheel <= untuned,
    }
}
