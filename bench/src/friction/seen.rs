//! Friction seen from above: the paper's Tables 1 and 4 on drives of the plant over worlds whose looks no learner knew.

mod baselines;
mod drives;
mod errors;
mod speed;
mod tuned;

use bicycle::Vehicle;
use friction::{
    Coefficients, Lesson, Losses, Network, Seen, Settings, State, Window, coefficients_of, predict, train,
};
use rayon::prelude::*;
use scenarios::{Looks, PAINTED_GROUNDS};
use serde::Serialize;

use super::FrictionBenchError;
use crate::Verdict;
use crate::sweep::in_turns;
use baselines::{Residual, best_level, bicycle, constant, particle_levels};
use drives::{Domain, Job, PIXEL_M, SeenDrive, seen_drive};
pub use errors::{Errors, Row, SeenGround};
use errors::{Located, WindowError};
pub use speed::SeeingTimes;
pub use tuned::FoundVehicle;

/// Of worlds to learn from; tests' seeds are of 32 bits.
const TRAINING_SEED: u64 = 1 << 33;

/// What to drive and how long to learn.
#[derive(Clone, Debug)]
pub struct Request {
    /// Machines, each with as many drives.
    pub vehicles: Vec<Vehicle>,
    /// Drives to learn from, and to be tested on.
    pub n_drives: [u64; 2],
    /// Length of a drive [s].
    pub duration_s: f64,
    /// Batches of each training.
    pub batches: usize,
    /// The first seed of the tests' worlds.
    pub first_seed: u64,
    /// Threads.
    pub n_threads: usize,
}

/// A test world as it looks, as its friction is seen and as it is, from the north-west on.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Red, green, blue.
    pub colours: Vec<[f32; 3]>,
    /// Friction at a sliding speed of 1 m/s as the network sees it, and as the plant has it [-].
    pub friction: [Vec<f32>; 2],
}

/// What came out.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The first seed of the tests' worlds.
    pub first_seed: u64,
    /// Drives to learn from, and to be tested on.
    pub n_drives: [u64; 2],
    /// Windows to learn from.
    pub n_windows: usize,
    /// Batches of each training.
    pub batches: usize,
    /// One for each method.
    pub rows: Vec<Row>,
    /// By class.
    pub grounds: Vec<SeenGround>,
    /// One for each method on drives of biased sensors and wrong descriptions, without labels.
    pub tuned_rows: Vec<Row>,
    /// What was found of the vehicles there.
    pub vehicles: Vec<FoundVehicle>,
    /// The pass rules of Tables 1, 4 and 5, fixed before the first training.
    pub verdicts: Vec<Verdict>,
    /// How long seeing takes.
    pub seeing: SeeingTimes,
    /// The first test world.
    #[serde(skip)]
    pub picture: Picture,
    /// The network of both losses, as safetensors.
    #[serde(skip)]
    pub weights: Vec<u8>,
}

/// Three trainings that differ in what they learn from.
const VARIANTS: [(&str, Losses); 3] = [
    ("seen, both losses", Losses::Both),
    ("seen, motion loss", Losses::Motion),
    ("seen, prior loss", Losses::Prior),
];

/// Drives, trains and tests; `after` hears of each drive and each training.
///
/// # Errors
/// A vehicle that cannot be driven, a training that diverges.
pub fn measure(request: &Request, after: impl Fn(&str) + Sync) -> Result<Report, FrictionBenchError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let drive = |looks: Looks, first_seed: u64, n: u64| {
        in_turns(&pool, n as usize, |index| {
            let vehicle = &request.vehicles[index % request.vehicles.len()];
            let (seed, duration_s) = (first_seed + index as u64, request.duration_s);
            let driven = seen_drive(vehicle, Job { seed, looks, domain: Domain::Exact, duration_s }, index);
            after("drive");
            driven
        })
    };
    let training = drive(Looks::Known, TRAINING_SEED, request.n_drives[0])?;
    let tests = drive(Looks::HeldOut, request.first_seed, request.n_drives[1])?;
    let lessons: Vec<Lesson> = training.into_iter().map(|drive| drive.lesson).collect();
    let networks = in_turns(&pool, VARIANTS.len(), |index| {
        let trained = trained(&lessons, VARIANTS[index].1, request.batches);
        after("training");
        trained
    })?;
    let seen = networks.iter().map(|network| pool.install(|| see(network, &tests)));
    let seen = seen.collect::<Result<Vec<_>, FrictionBenchError>>()?;
    let rows = pool.install(|| rows(&lessons, &tests, &seen))?;
    let (tuned_rows, vehicles, tuned) = tuned::measure(request, &pool, (&networks[0], &lessons), &after)?;
    let grounds = grounds(&tests, &seen[0]);
    Ok(Report {
        first_seed: request.first_seed,
        n_drives: request.n_drives,
        n_windows: lessons.iter().map(|lesson| lesson.windows.len()).sum(),
        batches: request.batches,
        verdicts: verdicts(&rows, &grounds).into_iter().chain([tuned]).collect(),
        grounds,
        rows,
        tuned_rows,
        vehicles,
        seeing: speed::measure()?,
        picture: picture(&tests[0], &seen[0][0]),
        weights: networks[0].to_bytes().map_err(friction::TrainingError::from)?,
    })
}

fn trained(lessons: &[Lesson], losses: Losses, batches: usize) -> Result<Network, FrictionBenchError> {
    let network = Network::new(PIXEL_M, 1).map_err(friction::TrainingError::from)?;
    let settings = Settings { losses, batches, ..Settings::default() };
    train(&network, lessons, settings, &mut |_, _| {})?;
    Ok(network)
}

/// What a network sees of each world.
fn see(network: &Network, drives: &[SeenDrive]) -> Result<Vec<Seen>, FrictionBenchError> {
    let see = |drive: &SeenDrive| {
        let coefficients =
            network.see(&drive.lesson.recording.view).map_err(friction::TrainingError::from)?;
        Ok(Seen { coefficients })
    };
    drives.par_iter().map(see).collect()
}

/// Errors of a prediction over all windows of all tests.
fn errors(
    tests: &[SeenDrive],
    predict: impl Fn(usize, usize, &Lesson, &Window) -> Vec<State> + Sync,
) -> Vec<Located> {
    let of_drive = |(drive, test): (usize, &SeenDrive)| {
        let windows = test.lesson.windows.iter().enumerate();
        let error = |(index, window): (usize, &Window)| {
            let states = predict(drive, index, &test.lesson, window);
            (drive, test.grounds[index], WindowError::of(&states, &test.truth[index]))
        };
        windows.map(error).collect::<Vec<_>>()
    };
    tests.par_iter().enumerate().flat_map_iter(of_drive).collect()
}

/// What a network for the bicycle's remainder predicts, by test and window.
fn residual_states(lessons: &[&Lesson], tests: &[SeenDrive]) -> candle_core::Result<Vec<Vec<Vec<State>>>> {
    let residual = Residual::trained(lessons, 1)?;
    let of_test = |test: &SeenDrive| {
        test.lesson.windows.iter().map(|window| residual.predict(&test.lesson, window)).collect()
    };
    tests.iter().map(of_test).collect()
}

/// Rows that see no friction. One level for all ground is that of the simulated drives, the network for the bicycle's
/// remainder learns from `learned`.
fn baseline_rows(
    simulated: &[Lesson],
    learned: &[&Lesson],
    tests: &[SeenDrive],
) -> Result<Vec<Row>, FrictionBenchError> {
    let level = best_level(&simulated.iter().collect::<Vec<_>>());
    let residual = residual_states(learned, tests).map_err(friction::TrainingError::from)?;
    let levels: Vec<Vec<f64>> =
        tests.iter().enumerate().map(|(drive, test)| particle_levels(&test.lesson, drive as u64)).collect();
    let bicycle = errors(tests, |_, _, lesson, window| bicycle(lesson, window));
    let one = errors(tests, |_, _, lesson, window| constant(lesson, window, level));
    let particles =
        errors(tests, |drive, index, lesson, window| constant(lesson, window, levels[drive][index]));
    let residual = errors(tests, |drive, index, _, _| residual[drive][index].clone());
    let all = BASELINES.into_iter().zip([bicycle, one, particles, residual]);
    Ok(all.filter_map(|(name, errors)| Row::of(name, &errors)).collect())
}

fn rows(lessons: &[Lesson], tests: &[SeenDrive], seen: &[Vec<Seen>]) -> Result<Vec<Row>, FrictionBenchError> {
    let mut rows = baseline_rows(lessons, &lessons.iter().collect::<Vec<_>>(), tests)?;
    let by_class = |test: &SeenDrive| test.classes.iter().map(|class| coefficients_of(*class)).collect();
    let published: Vec<Seen> = tests.iter().map(|test| Seen { coefficients: by_class(test) }).collect();
    let own: Vec<Seen> = tests.iter().map(|test| Seen { coefficients: test.coefficients.clone() }).collect();
    let told = [("told the class", &published), ("told the coefficients", &own)];
    let named = VARIANTS.iter().zip(seen).map(|((name, _), seen)| (*name, seen)).chain(told);
    rows.extend(named.filter_map(|(name, seen)| {
        Row::of(name, &errors(tests, |drive, _, lesson, window| predict(lesson, window, &seen[drive])))
    }));
    Ok(rows)
}

/// Friction at a sliding speed of 1 m/s [-].
fn friction_at_1(coefficients: &[f32; 4]) -> f64 {
    Coefficients::<0>(coefficients.map(|value| f64::from(value).into())).at(1.0.into()).value
}

fn grounds(tests: &[SeenDrive], seen: &[Seen]) -> Vec<SeenGround> {
    let mut sums = [[0.0; 5]; 7];
    for (test, seen) in tests.iter().zip(seen) {
        for (pixel, class) in test.classes.iter().enumerate() {
            let [found, own] = [&seen.coefficients[pixel], &test.coefficients[pixel]];
            let sums = &mut sums[usize::from(*class)];
            let values =
                [friction_at_1(found), friction_at_1(own), f64::from(found[2]), f64::from(own[2]), 1.0];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
    }
    let ground = |(name, [found, own, viscous, own_viscous, n]): (&'static str, [f64; 5])| SeenGround {
        ground: name,
        friction: [found / n, own / n],
        viscous: [viscous / n, own_viscous / n],
    };
    PAINTED_GROUNDS.iter().map(|(name, _)| *name).zip(sums).map(ground).collect()
}

fn picture(test: &SeenDrive, seen: &Seen) -> Picture {
    let view = &test.lesson.recording.view;
    let n = view.n_rows * view.n_cols;
    let pixels =
        || (0..view.n_rows).rev().flat_map(|row| (0..view.n_cols).map(move |col| row * view.n_cols + col));
    let colour = |pixel: usize| std::array::from_fn(|channel| view.values[channel * n + pixel]);
    let friction = |of: &[[f32; 4]]| pixels().map(|pixel| friction_at_1(&of[pixel]) as f32).collect();
    Picture {
        width: view.n_cols,
        colours: pixels().map(colour).collect(),
        friction: [friction(&seen.coefficients), friction(&test.coefficients)],
    }
}

/// Names of the methods that the paper's rows are compared with.
const BASELINES: [&str; 4] =
    ["kinematic bicycle", "constant friction", "particle filter", "residual network"];

fn verdicts(rows: &[Row], grounds: &[SeenGround]) -> Vec<Verdict> {
    let of = |name: &str, which: fn(&Errors) -> f64| {
        rows.iter().find(|row| row.method == name).map_or(f64::NAN, |row| which(&row.overall))
    };
    let ratio = |rule: &str, which: fn(&Errors) -> f64| {
        let best = BASELINES.iter().map(|name| of(name, which)).fold(f64::INFINITY, f64::min);
        let found = of(VARIANTS[0].0, which) / best;
        Verdict { rule: rule.to_owned(), found: format!("{found:.2}"), is_passed: found <= 0.6 }
    };
    let [both, motion, prior] = VARIANTS.map(|(name, _)| of(name, |errors| errors.ate_m.value));
    let friction: Vec<f64> = grounds.iter().map(|ground| ground.friction[0]).collect();
    let others = || friction[..6].iter().copied();
    let is_ranked = others().all(|other| other <= friction[0]) && others().all(|other| other > friction[6]);
    let viscous = |which: &[usize]| which.iter().map(|i| grounds[*i].viscous[0]).collect::<Vec<_>>();
    let least = viscous(&[4, 5]).into_iter().fold(f64::INFINITY, f64::min);
    let most = viscous(&[0, 1, 2, 3, 6]).into_iter().fold(0.0, f64::max);
    vec![
        ratio("ATE over the best baseline's at most 0.6", |errors| errors.ate_m.value),
        ratio("RRE over the best baseline's at most 0.6", |errors| errors.rre_deg.value),
        ratio("RTE over the best baseline's at most 0.6", |errors| errors.rte_m.value),
        Verdict {
            rule: "both losses better than either, by ATE".to_owned(),
            found: format!("{both:.3} both, {motion:.3} motion, {prior:.3} prior"),
            is_passed: both < motion && both < prior,
        },
        Verdict {
            rule: "of the frictions seen at 1 m/s asphalt's is most and ice's least".to_owned(),
            found: format!("{:.2} asphalt, {:.2} ice", friction[0], friction[6]),
            is_passed: is_ranked,
        },
        Verdict {
            rule: "viscous friction of mud and sand above all others'".to_owned(),
            found: format!("{least:.4} s/m of the less, {most:.4} s/m of the most of the others"),
            is_passed: least > most,
        },
    ]
}
