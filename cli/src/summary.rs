//! What is left of a drive in numbers: `summary.json`, and the same for a person to read.

use std::collections::BTreeMap;
use std::fmt;

use bicycle::StopReason;
use kinodynamics::CorrectionCounts;
use navigator::ScanTally;
use serde::{Deserialize, Serialize};

use crate::WorkFailed;
use crate::arguments::{Goal, StartPose};
pub use crate::map::keep::Merged;
pub use crate::route::GuidedSummary;
use bench::closed_loop::Method;
pub use scenarios::Outcome;

/// Distribution of a duration over the cycles of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Milliseconds {
    /// Half of the cycles took at most this [ms].
    pub p50: f64,
    /// 99 of 100 cycles took at most this [ms].
    pub p99: f64,
    /// The longest [ms].
    pub max: f64,
}

impl Milliseconds {
    /// Nearest-rank percentiles of durations in milliseconds, in any order; `None` without samples.
    pub fn from_samples(samples_ms: &[f64]) -> Option<Self> {
        let mut sorted = samples_ms.to_vec();
        sorted.sort_by(f64::total_cmp);
        let rank = |share: f64| (share * sorted.len() as f64).ceil().max(1.0) as usize - 1;
        let at = |share: f64| sorted.get(rank(share)).copied();
        Some(Self { p50: at(0.5)?, p99: at(0.99)?, max: at(1.0)? })
    }
}

/// One drive in numbers; the content of `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How it ended.
    pub outcome: Outcome,
    /// Why it ended so, for a person; empty at the goal.
    pub reason: String,
    /// Simulated time until the goal was reached [s]; null when it was not.
    pub time_to_goal_s: Option<f64>,
    /// Simulated time until the end [s].
    pub duration_s: f64,
    /// Length of the path of the rear axle's centre [m].
    pub path_length_m: f64,
    /// Straight line left to the goal at the end [m].
    pub distance_to_goal_m: f64,
    /// Largest |roll| of the plant [deg].
    pub largest_roll_deg: f64,
    /// Largest |pitch| of the plant [deg].
    pub largest_pitch_deg: f64,
    /// Control cycles.
    pub cycles: u64,
    /// Time of the controller per cycle; null without a cycle.
    pub control_ms: Option<Milliseconds>,
    /// Time of mapping and risk map per update; null without an update.
    pub map_ms: Option<Milliseconds>,
    /// Cycles whose command came too late.
    pub deadline_misses: u64,
    /// Cycles in which the controller asked for a stop, by reason.
    pub stops: BTreeMap<StopReason, u64>,
    /// How often the localisation corrected itself by a jump.
    #[serde(default)]
    pub localisation_jumps: u64,
    /// Measurements that were refused, by reason.
    #[serde(default)]
    pub measurements_refused: BTreeMap<StopReason, u64>,
    /// What became of the scans and their points.
    #[serde(default)]
    pub scans: ScanTally,
    /// People who walked about.
    #[serde(default)]
    pub walkers: usize,
    /// How often one of them walked into the standing vehicle.
    #[serde(default)]
    pub walked_into: u64,
    /// Whether a stop would have spared whom the vehicle struck; null when it struck nobody.
    #[serde(default)]
    pub was_avoidable: Option<bool>,
    /// What became of the routes that the drive followed; null where it followed none.
    #[serde(default)]
    pub route: Option<GuidedSummary>,
    /// What became of what was seen in the map that it was kept in; null where none was.
    #[serde(default)]
    pub kept: Option<Merged>,
    /// What became of the commands on their way to the vehicle; null where nobody corrects them.
    #[serde(default)]
    pub correction: Option<CorrectionCounts>,
    /// Decides everything random.
    pub seed: u64,
    /// Name of the machine.
    pub vehicle: String,
    /// Name of the world.
    pub world: String,
    /// Where the drive started.
    pub start: StartPose,
    /// Where it should have ended.
    pub goal: Goal,
    /// All goals that were asked for, in their order; none where the seed picked one.
    pub goals: Vec<Goal>,
    /// What the controller knew of the ground.
    pub method: Method,
    /// Risk tolerance (CVaR level).
    pub alpha: f64,
    /// How the machine departed from its description, as asked for.
    #[serde(default)]
    pub deviations: Vec<String>,
    /// Share of the ground that was ever known that is unlike what the networks were trained on; null for a method
    /// that cannot tell.
    pub unfamiliar_share: Option<f64>,
    /// Instruction set that maps and controller used.
    pub isa: String,
    /// Threads of the controller.
    pub threads: usize,
    /// [`formats::config_hash`] of the resolved configuration.
    pub config_hash: String,
    /// [`revision`] of the program.
    pub revision: String,
}

/// Git revision that this program was built from, `unknown` outside a repository. Uncommitted changes do not show.
pub fn revision() -> &'static str {
    env!("SUREFOOT_REVISION")
}

/// Program and revision, for pages.
pub fn program() -> String {
    format!("surefoot {}, revision {}", env!("CARGO_PKG_VERSION"), revision())
}

impl Summary {
    /// Whether the drive did what it should.
    ///
    /// # Errors
    /// The goal was not reached; the message says what happened instead.
    pub fn verdict(&self) -> Result<(), WorkFailed> {
        match self.outcome {
            Outcome::Goal => Ok(()),
            _ => Err(WorkFailed(format!(
                "goal not reached, {:.1} m left: {}",
                self.distance_to_goal_m,
                self.told_outcome()
            ))),
        }
    }

    fn told_outcome(&self) -> String {
        match self.reason.as_str() {
            "" => self.outcome.to_string(),
            reason => format!("{}: {reason}", self.outcome),
        }
    }
}

fn told_counts(counts: &BTreeMap<StopReason, u64>) -> String {
    let told: Vec<String> = counts
        .iter()
        .filter(|(_, count)| **count > 0)
        .map(|(reason, count)| format!("{reason} {count}x"))
        .collect();
    if told.is_empty() { "none".to_owned() } else { told.join(", ") }
}

impl fmt::Display for Summary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut row = |name: &str, told: String| writeln!(formatter, "  {name:<16}{told}");
        row("outcome", self.told_outcome())?;
        row("time", format!("{:.1} s simulated", self.duration_s))?;
        row(
            "path",
            format!("{:.1} m driven, {:.1} m from the goal", self.path_length_m, self.distance_to_goal_m),
        )?;
        row(
            "largest tilt",
            format!("roll {:.1} deg, pitch {:.1} deg", self.largest_roll_deg, self.largest_pitch_deg),
        )?;
        row("control", told_milliseconds(self.control_ms))?;
        row("map", told_milliseconds(self.map_ms))?;
        row("cycles", format!("{}, {} too late", self.cycles, self.deadline_misses))?;
        row("stops", told_counts(&self.stops))?;
        row("localisation", format!("{} jumps", self.localisation_jumps))?;
        row("refused", told_counts(&self.measurements_refused))?;
        if let Some(GuidedSummary { map, length_m, expected_s, n_again, n_kept }) = &self.route {
            row("route", format!("{length_m:.0} m in {expected_s:.0} s expected, over {map}"))?;
            row("routes again", format!("{n_again}, {n_kept} times none other was found"))?;
        }
        if let Some(merged) = &self.kept {
            row("kept in", merged.to_string())?;
        }
        if let Some(correction) = &self.correction {
            row("correction", correction.to_string())?;
        }
        row("world", format!("{}, seed {}", self.world, self.seed))?;
        row("start", format!("{:.2},{:.2},{:.3}", self.start.x_m, self.start.y_m, self.start.yaw_rad))?;
        row("goal", format!("{:.2},{:.2}", self.goal.x_m, self.goal.y_m))?;
        row("vehicle", self.vehicle.clone())?;
        if !self.deviations.is_empty() {
            row("departs by", self.deviations.join(" "))?;
        }
        if self.walkers > 0 {
            row("people", format!("{}, {} walked into the vehicle", self.walkers, self.walked_into))?;
        }
        row("method", format!("{}, alpha {}", self.method.name(), self.alpha))?;
        if let Some(share) = self.unfamiliar_share {
            row(
                "unfamiliar",
                format!("{:.0} % of the known ground is unlike the training data", 1e2 * share),
            )?;
        }
        row("ran on", format!("{}, threads {}", self.isa, self.threads))?;
        let config = self.config_hash.get(..12).unwrap_or(&self.config_hash);
        row("made by", format!("revision {}, config {config}", self.revision))
    }
}

fn told_milliseconds(distribution: Option<Milliseconds>) -> String {
    match distribution {
        Some(ms) => format!("{:.2} ms median, {:.2} ms p99, {:.2} ms max", ms.p50, ms.p99, ms.max),
        None => "never ran".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn example(outcome: Outcome) -> Summary {
        Summary {
            outcome,
            reason: String::new(),
            time_to_goal_s: Some(47.2),
            duration_s: 47.2,
            path_length_m: 43.9,
            distance_to_goal_m: 0.4,
            largest_roll_deg: 12.5,
            largest_pitch_deg: 17.0,
            cycles: 472,
            control_ms: Some(Milliseconds { p50: 0.2, p99: 0.3, max: 0.5 }),
            map_ms: None,
            deadline_misses: 0,
            stops: BTreeMap::from([(StopReason::NoFeasibleRollout, 3), (StopReason::StaleScan, 0)]),
            localisation_jumps: 2,
            measurements_refused: BTreeMap::from([(StopReason::InputOutOfOrder, 5)]),
            scans: ScanTally { fused: 40, blind: 1, ..ScanTally::default() },
            walkers: 0,
            walked_into: 0,
            was_avoidable: None,
            route: None,
            kept: None,
            correction: None,
            seed: 1,
            vehicle: "pietra_full_size".to_owned(),
            world: "rocks".to_owned(),
            start: StartPose { x_m: 5.0, y_m: 25.0, yaw_rad: 0.0 },
            goal: Goal { x_m: 45.0, y_m: 25.0 },
            goals: Vec::new(),
            method: Method::Physics,
            alpha: 0.6,
            deviations: vec!["steering_delay=0.2".to_owned()],
            unfamiliar_share: Some(0.125),
            isa: "avx512".to_owned(),
            threads: 2,
            config_hash: formats::config_hash(&0.6).unwrap(),
            revision: revision().to_owned(),
        }
    }

    #[test]
    fn percentiles_are_nearest_rank() {
        // 1, 2, ..., 200: rank ceil(0.5 * 200) = 100, ceil(0.99 * 200) = 198.
        let samples: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        let ms = Milliseconds::from_samples(&samples);
        assert_eq!(ms, Some(Milliseconds { p50: 100.0, p99: 198.0, max: 200.0 }));
        assert_eq!(Milliseconds::from_samples(&[7.0]), Some(Milliseconds { p50: 7.0, p99: 7.0, max: 7.0 }));
        // Rank ceil(0.5 * 3) = 2, ceil(0.99 * 3) = 3.
        let three = Milliseconds { p50: 2.0, p99: 3.0, max: 3.0 };
        assert_eq!(Milliseconds::from_samples(&[3.0, 1.0, 2.0]), Some(three));
        assert_eq!(Milliseconds::from_samples(&[]), None);
    }

    #[test]
    fn json_reads_back_and_names_are_snake_case() {
        let summary = example(Outcome::AttitudeLimit);
        let json = serde_json::to_string_pretty(&summary).unwrap();
        assert_eq!(serde_json::from_str::<Summary>(&json).unwrap(), summary);
        for part in ["\"attitude_limit\"", "\"no_feasible_rollout\": 3", "\"map_ms\": null", "\"physics\""] {
            assert!(json.contains(part), "{part} in {json}");
        }
    }

    #[test]
    fn only_the_goal_is_a_success() {
        assert_eq!(example(Outcome::Goal).verdict(), Ok(()));
        let mut summary = example(Outcome::Stuck);
        summary.reason = "under 0.1 m in 5 s".to_owned();
        let told = summary.verdict().unwrap_err().0;
        assert_eq!(told, "goal not reached, 0.4 m left: stuck: under 0.1 m in 5 s");
    }

    #[test]
    fn a_person_can_read_it() {
        let told = example(Outcome::Goal).to_string();
        for part in [
            "goal reached",
            "43.9 m driven",
            "roll 12.5 deg",
            "no feasible rollout 3x",
            "never ran",
            "12 % of",
        ] {
            assert!(told.contains(part), "{part} in {told}");
        }
        assert!(!told.contains("stale scan"), "reasons that never came are left out: {told}");
    }
}
