//! Which drives make a table, and which of them a part of the work does.

use std::num::ParseIntError;
use std::str::FromStr;

use bicycle::Vehicle;
use bicycle::lanes::Instructions;
use formats::ConfigText;
use mppi::Isa;
use navigator::Config;
use scenarios::{Engine, EpisodeConfig, RockFieldConfig};
use serde::{Deserialize, Serialize};
use traversability::CvarLevel;

use super::drive::{DriveResult, Job, Place};
use super::external::External;
use super::{Entrant, PlannerName};
use crate::closed_loop::Method;
use crate::sweep::{SweepError, hash_of, sweep};

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// The machine: a name that is shipped, or a path.
    pub vehicle: String,
    /// Fastest speed that is commanded [m/s]; `None` for that of the machine's description.
    pub speed_mps: Option<f64>,
    /// What the controller knows of the ground; a row each, for every level where there are levels.
    pub methods: Vec<Method>,
    /// Planners of other people's; a row each.
    pub planners: Vec<PlannerName>,
    /// Risk tolerances of the methods that know distributions, see [`Method::has_level`].
    pub levels: Vec<CvarLevel>,
    /// What the ground looks like.
    pub field: RockFieldConfig,
    /// Decides maps, starts, goals, sensor noise and samples.
    pub seed: u64,
    /// Maps.
    pub n_maps: u32,
    /// Starts with their goals on each map.
    pub n_pairs: u32,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Instruction set of the controller.
    pub isa: Isa,
    /// What simulates the vehicle.
    pub plant: Engine,
    /// Settings of the pipeline that differ from the machine's, as TOML; nothing where none do.
    pub settings: String,
}

/// All drives of a table, and what they have in common: results of two plans that are equal belong into one table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The machine: a name that is shipped, or a path.
    pub vehicle: String,
    /// Fastest speed that is commanded [m/s].
    pub speed_mps: f64,
    /// What the controller knows of the ground.
    pub methods: Vec<Method>,
    /// Planners of other people's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub planners: Vec<PlannerName>,
    /// Risk tolerances of the methods that know distributions.
    pub levels: Vec<CvarLevel>,
    /// What the ground looks like.
    pub field: RockFieldConfig,
    /// Decides maps, starts, goals, sensor noise and samples.
    pub seed: u64,
    /// Maps.
    pub n_maps: u32,
    /// Starts with their goals on each map.
    pub n_pairs: u32,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Instruction set that the controller uses; another one may differ in the last bits, and then in a drive's course.
    pub isa: Isa,
    /// [`formats::config_hash`] of the pipeline's configuration.
    pub config_hash: String,
    /// What simulates the vehicle.
    pub plant: Engine,
    /// Settings of the pipeline that differ from the machine's, as TOML.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub settings: String,
}

/// One of `n` equal parts of the work, by start and goal: a pair is driven with every method in the same part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    n: u32,
}

/// No such part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected I/N, the I-th of N parts, 1 <= I <= N <= 10000, found {found:?}")]
pub struct ShardError {
    found: String,
}

impl Shard {
    /// All of the work.
    pub const WHOLE: Self = Self { index: 0, n: 1 };

    fn holds(self, pair: u32) -> bool {
        pair % self.n == self.index
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(word: &str) -> Result<Self, ShardError> {
        let read = || -> Result<Option<Self>, ParseIntError> {
            let Some((index, n)) = word.trim().split_once('/') else { return Ok(None) };
            let (index, n) = (index.parse::<u32>()?, n.parse::<u32>()?);
            Ok((1 <= index && index <= n && n <= 10_000).then(|| Self { index: index - 1, n }))
        };
        read().ok().flatten().ok_or_else(|| ShardError { found: word.to_owned() })
    }
}

/// What all drives have in common.
pub(super) struct Settings {
    pub field: RockFieldConfig,
    pub seed: u64,
    pub vehicle: Vehicle,
    pub config: Config,
    pub episode: EpisodeConfig,
}

impl Plan {
    /// The plan of a request.
    ///
    /// # Errors
    /// Nothing to drive, a field or settings that cannot be, or an instruction set that the machine lacks.
    pub fn new(request: &Request) -> Result<Self, SweepError> {
        let machine = machine(&request.vehicle, request.speed_mps)?;
        request.field.validate()?;
        request.plant.check()?;
        let plan = Self {
            vehicle: request.vehicle.clone(),
            speed_mps: machine.limits.speed_max_mps,
            methods: request.methods.clone(),
            planners: request.planners.clone(),
            levels: request.levels.clone(),
            field: request.field.clone(),
            seed: request.seed,
            n_maps: request.n_maps,
            n_pairs: request.n_pairs,
            time_limit_s: request.time_limit_s,
            isa: Instructions::find(request.isa)?.isa(),
            config_hash: hash_of(&config_for(&machine, &request.field, &request.settings, Isa::Auto)?)?,
            plant: request.plant,
            settings: request.settings.clone(),
        };
        if plan.jobs(Shard::WHOLE).next().is_none() {
            return Err(SweepError::NoDrives {
                expected: "at least one map, one pair, one method and, for methods with a level, one alpha",
            });
        }
        Ok(plan)
    }

    /// How many drives a part of the work is.
    pub fn n_drives(&self, shard: Shard) -> usize {
        self.jobs(shard).count()
    }

    /// Does the drives of a part that are not among `known`, those of planners of other people's by way of `external`;
    /// `after_drive` sees each one as it ends, in any order and on any thread, and an error of its ends the work.
    ///
    /// # Errors
    /// No threads to be had, a drive that could not begin or go on, or an error of `after_drive`.
    pub fn drive(
        &self,
        shard: Shard,
        known: &[DriveResult],
        n_threads: usize,
        external: &External<'_>,
        after_drive: impl Fn(&DriveResult) -> Result<(), SweepError> + Sync,
    ) -> Result<Vec<DriveResult>, SweepError> {
        let is_known = |job: &Job| known.iter().any(|drive| job.is_of(drive));
        let jobs: Vec<Job> = self.jobs(shard).filter(|job| !is_known(job)).collect();
        let settings = self.settings()?;
        sweep(&jobs, n_threads, |job| job.drive(&settings, external), after_drive)
    }

    /// Who drives at which level, in the order of the rows.
    pub(super) fn rows(&self) -> impl Iterator<Item = (Entrant, Option<CvarLevel>)> {
        let ours = self.methods.iter().flat_map(|&method| match method.has_level() {
            true => self.levels.iter().map(|&level| (method.into(), Some(level))).collect(),
            false => vec![(method.into(), None)],
        });
        ours.chain(self.planners.iter().map(|name| (Entrant::External(name.clone()), None)))
    }

    /// Row by row, each row by ascending map and pair.
    pub(super) fn jobs(&self, shard: Shard) -> impl Iterator<Item = Job> {
        let (n_maps, n_pairs) = (self.n_maps, self.n_pairs);
        self.rows().flat_map(move |(who, level)| {
            let pairs = (0..n_maps * n_pairs).filter(move |&pair| shard.holds(pair));
            pairs.map(move |pair| Job { who: who.clone(), level, map: pair / n_pairs, pair: pair % n_pairs })
        })
    }

    /// The machine as it is driven, its limit of speed the plan's.
    ///
    /// # Errors
    /// A file that is no longer there or no machine.
    pub fn machine(&self) -> Result<Vehicle, SweepError> {
        machine(&self.vehicle, Some(self.speed_mps))
    }

    fn settings(&self) -> Result<Settings, SweepError> {
        let vehicle = self.machine()?;
        let mut episode = EpisodeConfig::for_vehicle(&vehicle);
        episode.rules.time_limit_s = self.time_limit_s;
        episode.engine = self.plant;
        Ok(Settings {
            field: self.field.clone(),
            seed: self.seed,
            config: config_for(&vehicle, &self.field, &self.settings, self.isa)?,
            episode,
            vehicle,
        })
    }
}

/// The machine, with another limit of its speed if one was asked for.
fn machine(name_or_path: &str, speed_mps: Option<f64>) -> Result<Vehicle, SweepError> {
    let mut vehicle = formats::read_vehicle(name_or_path)?;
    vehicle.limits.speed_max_mps = speed_mps.unwrap_or(vehicle.limits.speed_max_mps);
    Ok(vehicle)
}

/// What `surefoot drive` uses on this ground with these settings, on one thread.
fn config_for(
    vehicle: &Vehicle,
    field: &RockFieldConfig,
    settings: &str,
    isa: Isa,
) -> Result<Config, SweepError> {
    let mut config = Config::for_vehicle(vehicle);
    if !settings.is_empty() {
        config = formats::overlay(&ConfigText::new("settings", settings), &config)?;
    }
    if config.areas.geofence_m.is_empty() {
        config.areas.geofence_m = Place::fence_m(field);
    }
    config.controller.n_threads = 1;
    config.controller.isa = isa;
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(methods: &[Method], levels: &[f64], n_maps: u32, n_pairs: u32) -> Result<Plan, SweepError> {
        Plan::new(&Request {
            vehicle: "pietra_full_size".to_owned(),
            speed_mps: None,
            methods: methods.to_vec(),
            planners: Vec::new(),
            levels: levels.iter().map(|&level| CvarLevel::new(level).unwrap()).collect(),
            field: RockFieldConfig::default(),
            seed: 1,
            n_maps,
            n_pairs,
            time_limit_s: 1.0,
            isa: Isa::Portable,
            plant: Engine::Rapier,
            settings: String::new(),
        })
    }

    #[test]
    fn only_methods_with_distributions_are_driven_once_for_each_level() {
        let plan = plan(&[Method::Truth, Method::Physics, Method::Nominal], &[0.4, 0.8], 1, 3).unwrap();
        let told: Vec<String> = plan.jobs(Shard::WHOLE).step_by(3).map(|job| job.to_string()).collect();
        assert_eq!(
            told,
            [
                "truth, map 1, pair 1",
                "physics, alpha 0.4, map 1, pair 1",
                "physics, alpha 0.8, map 1, pair 1",
                "nominal, map 1, pair 1"
            ]
        );
    }

    #[test]
    fn parts_hold_every_drive_once_and_every_method_of_a_pair_together() {
        let plan = plan(&[Method::Physics, Method::Nominal], &[0.4, 0.8], 3, 5).unwrap();
        for n in [1, 2, 7, 15, 40] {
            let parts: Vec<Vec<Job>> =
                (1..=n).map(|index| plan.jobs(format!("{index}/{n}").parse().unwrap()).collect()).collect();
            let mut together: Vec<Job> = parts.concat();
            assert_eq!(together.len(), plan.n_drives(Shard::WHOLE));
            together.sort_by_key(|job| plan.jobs(Shard::WHOLE).position(|other| other == *job));
            assert_eq!(together, plan.jobs(Shard::WHOLE).collect::<Vec<_>>());
            for part in parts {
                assert_eq!(part.len() % 3, 0, "all three rows of a pair");
            }
        }
    }

    #[test]
    fn parts_that_cannot_be_are_refused() {
        assert_eq!("1/1".parse(), Ok(Shard::WHOLE));
        for word in ["0/3", "4/3", "1/0", "1/10001", "1", "a/b", "-1/3", "1/2/3", ""] {
            let told = word.parse::<Shard>().unwrap_err().to_string();
            assert!(told.ends_with(&format!("found {word:?}")), "{told}");
        }
    }

    #[test]
    fn nothing_to_drive_is_told() {
        for nothing in [
            plan(&[], &[0.4], 1, 1),
            plan(&[Method::Physics], &[], 1, 1),
            plan(&[Method::Physics], &[0.4], 0, 1),
            plan(&[Method::Physics], &[0.4], 1, 0),
        ] {
            assert!(matches!(nothing, Err(SweepError::NoDrives { .. })));
        }
    }

    /// The settings are the machine's own but for what is said, the fence of the field included, and their hash tells them
    /// apart.
    #[test]
    fn settings_of_ones_own_are_laid_over_those_of_the_machine() {
        let vehicle = formats::read_vehicle("buggy_fifth").unwrap();
        let field = RockFieldConfig::navigation();
        let config = |settings: &str| config_for(&vehicle, &field, settings, Isa::Portable);
        let own = config("").unwrap();
        let mut other = config("[speed]\nleast_mps = 100.0").unwrap();
        assert!(hash_of(&own).unwrap() != hash_of(&other).unwrap());
        assert!((other.speed.least_mps - 100.0).abs() < 1e-9);
        other.speed = own.speed;
        assert_eq!(own, other);
        let told = config("[speed]\nleast_mph = 3.0").unwrap_err().to_string();
        assert!(told.starts_with("settings:2: speed.least_mph: expected"), "{told}");
    }

    #[test]
    fn a_plan_outlives_its_text() {
        let plan = plan(&[Method::Pietra, Method::Truth], &[0.1, 0.6], 2, 2).unwrap();
        let text = serde_json::to_string(&plan).unwrap();
        assert_eq!(serde_json::from_str::<Plan>(&text).unwrap(), plan);
    }
}
