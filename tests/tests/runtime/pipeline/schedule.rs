//! A drive with everything that the parts have rules for, and the order in which its messages came and its parts worked.

use std::collections::BTreeMap;
use std::sync::Arc;

use bicycle::{Applied, AppliedBy, Command, Decision, HoldReason, ImuSample, Odometry};
use navigator::{Jump, Order};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use scenarios::Episode;
use terrain::Scan;
use traversability::CvarLevel;

use super::in_process::{InProcess, Made};
use crate::fixture::{SEED, episode_config, machine, task};

pub const MILLISECOND_NS: u64 = 1_000_000;
pub const BEGAN_NS: u64 = 1_000 * MILLISECOND_NS;
/// Time between two looks of the vehicle at its sensors, and cycles between two scans.
pub const CYCLE_MS: u64 = 20;
pub const LASTS_MS: u64 = 15_000;

/// What happens at a time: something comes, or a part works.
#[derive(Clone, Debug)]
pub enum Step {
    Odometry(Odometry, Applied),
    Imu(Vec<ImuSample>),
    Scan(Arc<Scan>),
    Order(Order),
    Lead,
    Survey,
    Assess,
    Decide,
}

pub type Schedule = Vec<(u64, Step)>;

/// When what happens to the drive [ms].
pub mod plan {
    use std::ops::Range;

    pub const IMU_IS_SILENT: Range<u64> = 2300..2700;
    pub const NOT_A_NUMBER: Range<u64> = 3000..3200;
    pub const LEARNING_IS_SILENT: Range<u64> = 4000..6000;
    pub const JUMPS_FROM: u64 = 5010;
    pub const PAUSED: Range<u64> = 6500..7000;
    pub const BOLDER_FROM: u64 = 7300;
    pub const HELD: Range<u64> = 8000..10_500;
    pub const MISSION_IS_SILENT: Range<u64> = 11_000..14_200;
}

/// A drive, and the order in which its messages came and its parts worked.
pub struct Recorder {
    random: Xoshiro256PlusPlus,
    episode: Episode,
    /// What is on its way, by when it comes.
    coming: BTreeMap<(u64, u64), Step>,
    n_coming: u64,
    applied: Applied,
    decided: Decision,
}

impl Recorder {
    pub fn new() -> Self {
        let (vehicle, _) = machine();
        let mut config = episode_config(&vehicle);
        (config.control_hz, config.cycles_per_scan) = (1e3 / CYCLE_MS as f64, 10);
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(5),
            episode: Episode::new(task(), &vehicle, config, SEED).unwrap(),
            coming: BTreeMap::new(),
            n_coming: 0,
            applied: Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command },
            decided: Decision::Hold(HoldReason::NoMap),
        }
    }

    fn put(&mut self, at_ns: u64, step: Step) {
        self.n_coming += 1;
        self.coming.insert((at_ns, self.n_coming), step);
    }

    /// Measures, and carries out what was decided.
    fn measure(&mut self, at_ms: u64) {
        let at_ns = BEGAN_NS + at_ms * MILLISECOND_NS;
        let observation = self.episode.observe().clone();
        let correction = Jump { step_m: [3.0, -2.0, 0.0], yaw_rad: 0.3 };
        let mut odometry = Odometry { valid_at_ns: at_ns, ..observation.odometry };
        if at_ms >= plan::JUMPS_FROM {
            odometry = correction.odometry(&odometry);
        }
        if plan::NOT_A_NUMBER.contains(&at_ms) {
            odometry.yaw_rate_radps = f64::NAN;
        }
        let late_ns = self.random.random_range(0..6 * MILLISECOND_NS);
        self.put(at_ns + late_ns, Step::Odometry(odometry, self.applied));
        let of_now = |sample: &ImuSample| ImuSample { valid_at_ns: BEGAN_NS + sample.valid_at_ns, ..*sample };
        let imu: Vec<ImuSample> = observation.imu.iter().map(of_now).collect();
        if !imu.is_empty() && !plan::IMU_IS_SILENT.contains(&at_ms) {
            self.put(at_ns + late_ns, Step::Imu(imu));
        }
        if let Some(scan) = observation.scan {
            // Between two odometry messages, and now and then far behind them.
            let scan = Scan { valid_at_ns: at_ns + 7 * MILLISECOND_NS, ..scan.as_ref().clone() };
            let late_ns = self.random.random_range(7 * MILLISECOND_NS..70 * MILLISECOND_NS);
            self.put(at_ns + late_ns, Step::Scan(Arc::new(scan)));
        }
        let command = self.decided.command(self.applied.command);
        if command != self.applied.command {
            self.applied = Applied { command, since_ns: at_ns, by: AppliedBy::Command };
        }
        // Whoever holds it tells nobody.
        let held = plan::HELD.contains(&at_ms).then_some(Decision::Hold(HoldReason::Manual));
        self.episode.apply(&held.unwrap_or(self.decided)).unwrap();
    }

    /// The parts work again and again, none of them quite regularly.
    fn put_to_work(&mut self) {
        let parts =
            [(Step::Lead, 15, 9), (Step::Survey, 8, 7), (Step::Assess, 13, 30), (Step::Decide, 90, 20)];
        for (part, every_ms, more_ms) in parts {
            let mut at_ms = 0;
            while at_ms < LASTS_MS {
                at_ms += every_ms + self.random.random_range(0..=more_ms);
                let is_silent = match part {
                    Step::Assess => plan::LEARNING_IS_SILENT.contains(&at_ms),
                    Step::Lead => plan::MISSION_IS_SILENT.contains(&at_ms),
                    _ => false,
                };
                if !is_silent {
                    self.put(BEGAN_NS + at_ms * MILLISECOND_NS + 1, part.clone());
                }
            }
        }
        let level = CvarLevel::new(0.3).unwrap();
        for (at_ms, order) in [
            (plan::PAUSED.start, Order::Pause),
            (plan::PAUSED.end, Order::Resume),
            (plan::BOLDER_FROM, Order::Tolerate(level)),
        ] {
            self.put(BEGAN_NS + at_ms * MILLISECOND_NS, Step::Order(order));
            self.put(BEGAN_NS + at_ms * MILLISECOND_NS, Step::Lead);
        }
    }

    /// Drives, and returns what happened, with what the parts in one object made of it.
    pub fn record(mut self) -> (Schedule, Vec<Made>) {
        let mut parts = InProcess::new();
        let (mut schedule, mut made) = (Schedule::new(), Vec::new());
        self.put_to_work();
        for cycle in 0..LASTS_MS / CYCLE_MS {
            self.measure(cycle * CYCLE_MS);
            let until_ns = BEGAN_NS + (cycle + 1) * CYCLE_MS * MILLISECOND_NS;
            while let Some(entry) = self.coming.first_entry().filter(|entry| entry.key().0 < until_ns) {
                let ((at_ns, _), step) = entry.remove_entry();
                let (new, decided) = parts.step(at_ns, &step);
                made.extend(new);
                self.decided = decided.unwrap_or(self.decided);
                schedule.push((at_ns, step));
            }
        }
        assert_eq!(parts.navigator.n_jumps(), 1);
        (schedule, made)
    }
}
