//! What a user can set, with its ranges. Costs are in seconds: of everything that is weighed, one second more on the
//! way is the unit.

use crate::kernel::CHUNK;
use crate::rollout::MAX_SLOTS;
use bicycle::ModelError;
use bicycle::lanes::{Instructions, Isa, IsaAbsent};
use serde::{Deserialize, Serialize};

/// Controls of all rollouts together: half a gigabyte.
const MOST_CONTROLS: usize = 1 << 26;

/// Configuration of a [`crate::Controller`]. The default is what `surefoot drive` uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Sampled futures per iteration; a multiple of 64.
    pub n_rollouts: usize,
    /// Steps of the horizon; at least 2.
    pub n_steps: usize,
    /// Length of a step, from 0.01 to 1 [s].
    pub step_s: f64,
    /// Times that sampling and averaging are repeated per cycle.
    pub n_iterations: usize,
    /// Threads that share the rollouts, the calling one among them. The result does not depend on it.
    pub n_threads: usize,
    /// Instruction set, of the controller and of the maps that a pipeline makes for it; a forced one that the machine
    /// lacks is refused.
    pub isa: Isa,
    /// How controls are perturbed.
    pub sampling: Sampling,
    /// Whether the plan respects the limits on acceleration and steering rate.
    pub actuation: Actuation,
    /// How sharply low costs are preferred.
    pub temperature: Temperature,
    /// Weight of the control cost of Williams et al. 2017, over the temperature; 1 = information-theoretic MPPI,
    /// 0 = none [-].
    pub control_cost: f64,
    /// What things cost.
    pub costs: Costs,
    /// Known delay between a decision and its effect on the actuators: the start of the plan is predicted over it
    /// with the commands that were already sent [s].
    pub delay_s: f64,
    /// Shortest time between two decisions, from 0.001 to 1 [s]: decides how many commands are remembered for as long as delays reach.
    pub period_min_s: f64,
    /// How far the commands may run ahead of the measured speed and steering angle, as the time that the limits of
    /// acceleration and steering rate need for it, beyond the lag of the model's own effects; 0 = the plan of a model
    /// without effects starts exactly at the measured state [s].
    pub tracking_s: f64,
    /// Backing up when stuck; needs a reverse gear.
    pub recovery: Recovery,
}

/// How controls are perturbed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// What the noise is added to.
    pub space: SampleSpace,
    /// Standard deviation of the speed [m/s], or of the acceleration [m/s2] when sampling rates.
    pub speed_std: f64,
    /// Standard deviation of the steering angle [rad], or of the steering rate [rad/s] when sampling rates; of a model
    /// that is asked for a yaw rate, of that [rad/s] or of its rate [rad/s2].
    pub steering_std: f64,
    /// Correlation time of the noise; 0 = white [s].
    pub correlation_s: f64,
}

/// What the noise is added to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleSpace {
    /// Speed and steering angle.
    Controls,
    /// Their rates, which makes smooth sequences.
    Rates,
}

/// Whether the plan respects the limits on acceleration and steering rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Actuation {
    /// Commands act at once (PIETRA, equation 2 as printed).
    Instant,
    /// Commands change within the limits, from the measured state on.
    Limited,
}

/// How sharply low costs are preferred.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Temperature {
    /// Always the same.
    Fixed {
        /// Cost difference that makes a factor e [s].
        temperature_s: f64,
    },
    /// Chosen each iteration so that this share of the rollouts counts.
    EffectiveSampleSize {
        /// Effective sample size over the number of rollouts, in (0, 1).
        fraction: f64,
    },
}

impl Temperature {
    /// Coldest that the search may go [s].
    pub(crate) const LOWEST_S: f32 = 1e-3;
    /// Hottest that the search may go [s].
    pub(crate) const HIGHEST_S: f32 = 1e4;
}

/// What things cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Costs {
    /// Of a metre of distance to the goal, per step until it is reached [s/m]; 0 = time alone counts.
    pub distance_s_per_m: f64,
    /// Speed at which the straight line that is left at the end of the horizon is valued [m/s].
    pub rest_speed_mps: f64,
    /// Of a step beyond the limits of roll or pitch [s].
    pub attitude_s: f64,
    /// Of a step beyond the limit of lateral acceleration [s].
    pub lateral_s: f64,
    /// Of a step that asks of the ground, to turn and to stay on a slope, twice as much as three quarters of the friction
    /// that the map tells [s]; in proportion to what is too much, and nothing where nobody has told; 0 = the map is not
    /// asked.
    #[serde(default)]
    pub grip_s: f64,
    /// Of a step at twice the fastest speed that the map allows there [s]; in proportion to what is too much; 0 = the map is
    /// not asked.
    #[serde(default)]
    pub overspeed_s: f64,
    /// Of a step in reverse [s].
    pub reverse_s: f64,
    /// Of a metre of distance across a reference path, squared, per step [s/m2].
    pub path_across_s_per_m2: f64,
    /// Of a metre of being behind or ahead on a reference path, squared, per step [s/m2].
    pub path_along_s_per_m2: f64,
}

/// Backing up when stuck.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recovery {
    /// Stuck means to stay within `progress_m` for this long [s]; infinite = never back up.
    pub patience_s: f64,
    /// Distance that counts as progress [m].
    pub progress_m: f64,
    /// Distance to back up [m].
    pub distance_m: f64,
    /// Longest time to spend on it [s].
    pub duration_s: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            n_rollouts: 1024,
            n_steps: 50,
            step_s: 0.1,
            n_iterations: 1,
            n_threads: 1,
            isa: Isa::Auto,
            sampling: Sampling {
                space: SampleSpace::Rates,
                speed_std: 1.5,
                steering_std: 0.6,
                correlation_s: 0.5,
            },
            actuation: Actuation::Limited,
            temperature: Temperature::EffectiveSampleSize { fraction: 0.05 },
            control_cost: 0.1,
            costs: Costs {
                distance_s_per_m: 0.0,
                rest_speed_mps: 1.0,
                attitude_s: 20.0,
                lateral_s: 20.0,
                grip_s: 0.0,
                overspeed_s: 0.0,
                reverse_s: 0.1,
                path_across_s_per_m2: 0.5,
                path_along_s_per_m2: 0.1,
            },
            delay_s: 0.0,
            period_min_s: 0.01,
            tracking_s: 0.5,
            recovery: Recovery { patience_s: 2.0, progress_m: 0.25, distance_m: 1.5, duration_s: 4.0 },
        }
    }
}

impl Config {
    /// The work of the hand-written speed bound: time to goal with latch, attitude limits, white noise on the
    /// controls, instant actuators, fixed temperature.
    pub fn minimal() -> Self {
        Self {
            sampling: Sampling {
                space: SampleSpace::Controls,
                speed_std: 1.0,
                steering_std: 0.2236,
                correlation_s: 0.0,
            },
            actuation: Actuation::Instant,
            temperature: Temperature::Fixed { temperature_s: 1.0 },
            control_cost: 1.0,
            costs: Costs {
                distance_s_per_m: 1.0,
                attitude_s: 100.0,
                lateral_s: 0.0,
                reverse_s: 0.0,
                ..Self::default().costs
            },
            tracking_s: 0.0,
            recovery: Recovery { patience_s: f64::INFINITY, ..Self::default().recovery },
            ..Self::default()
        }
    }

    /// Refuses values that make no controller.
    ///
    /// # Errors
    /// The first field that is out of range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let counts = [
            ("n_rollouts", self.n_rollouts, 1 << 20),
            ("n_steps", self.n_steps, 1000),
            ("n_iterations", self.n_iterations, 100),
            ("n_threads", self.n_threads, 1024),
        ];
        for (field, found, most) in counts {
            let allowed = (1..=most).contains(&found);
            check(allowed, field, "a whole number >= 1 and not beyond all reason", found as f64)?;
        }
        check(
            self.n_rollouts.is_multiple_of(CHUNK),
            "n_rollouts",
            "a multiple of 64",
            self.n_rollouts as f64,
        )?;
        check(self.n_steps >= 2, "n_steps", "at least 2", self.n_steps as f64)?;
        let n_controls = self.n_rollouts * self.n_steps;
        check(n_controls <= MOST_CONTROLS, "n_rollouts x n_steps", "at most 67108864", n_controls as f64)?;
        self.validate_numbers()?;
        Instructions::find(self.isa)?;
        Ok(())
    }

    /// Refuses what a controller that runs by this configuration cannot change.
    pub(crate) fn refuse_other_layout(&self, other: &Self) -> Result<(), ConfigError> {
        let told = |of: &Self| {
            [
                ("n_rollouts", of.n_rollouts.to_string()),
                ("n_steps", of.n_steps.to_string()),
                ("step_s", of.step_s.to_string()),
                ("n_threads", of.n_threads.to_string()),
                ("isa", format!("{:?}", of.isa)),
                ("delay_s", of.delay_s.to_string()),
                ("period_min_s", of.period_min_s.to_string()),
            ]
        };
        for ((field, expected), (_, found)) in told(self).into_iter().zip(told(other)) {
            if expected != found {
                return Err(ConfigError::Fixed { field, expected, found });
            }
        }
        Ok(())
    }

    fn validate_numbers(&self) -> Result<(), ConfigError> {
        let (sampling, costs, recovery) = (&self.sampling, &self.costs, &self.recovery);
        let step = ("a time from 0.01 to 1 s", 0.01..=1.0);
        let period = ("a time from 0.001 to 1 s", 0.001..=1.0);
        let delay = ("a time from 0 to 2 s", 0.0..=2.0);
        let time = ("a time from 0 to 100 s", 0.0..=100.0);
        let deviation = ("a number from 1e-6 to 1000", 1e-6..=1e3);
        let size = ("a number from 0.001 to 10000", 1e-3..=1e4);
        let weight = ("a number from 0 to 1e6", 0.0..=1e6);
        let ranges = [
            ("step_s", self.step_s, &step),
            ("period_min_s", self.period_min_s, &period),
            ("delay_s", self.delay_s, &delay),
            ("tracking_s", self.tracking_s, &time),
            ("sampling.speed_std", sampling.speed_std, &deviation),
            ("sampling.steering_std", sampling.steering_std, &deviation),
            ("sampling.correlation_s", sampling.correlation_s, &time),
            ("control_cost", self.control_cost, &weight),
            ("costs.rest_speed_mps", costs.rest_speed_mps, &size),
            ("costs.distance_s_per_m", costs.distance_s_per_m, &weight),
            ("costs.attitude_s", costs.attitude_s, &weight),
            ("costs.lateral_s", costs.lateral_s, &weight),
            ("costs.grip_s", costs.grip_s, &weight),
            ("costs.overspeed_s", costs.overspeed_s, &weight),
            ("costs.reverse_s", costs.reverse_s, &weight),
            ("costs.path_across_s_per_m2", costs.path_across_s_per_m2, &weight),
            ("costs.path_along_s_per_m2", costs.path_along_s_per_m2, &weight),
            ("recovery.progress_m", recovery.progress_m, &size),
            ("recovery.distance_m", recovery.distance_m, &size),
            ("recovery.duration_s", recovery.duration_s, &size),
        ];
        for (field, found, (expected, range)) in ranges {
            check(range.contains(&found), field, expected, found)?;
        }
        check(recovery.patience_s > 0.0, "recovery.patience_s", "a number > 0 or inf", recovery.patience_s)?;
        match self.temperature {
            Temperature::Fixed { temperature_s: found } => {
                let field = "temperature.fixed.temperature_s";
                check(size.1.contains(&found), field, size.0, found)
            }
            Temperature::EffectiveSampleSize { fraction: found } => {
                let allowed = found > 0.0 && found < 1.0;
                check(allowed, "temperature.effective_sample_size.fraction", "a number in (0, 1)", found)
            }
        }
    }
}

fn check(allowed: bool, field: &'static str, expected: &'static str, found: f64) -> Result<(), ConfigError> {
    if allowed { Ok(()) } else { Err(ConfigError::Field { field, expected, found }) }
}

/// Why there is no controller, or why it does not change.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A value is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Field {
        /// Dotted path of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The forced instruction set is not there.
    #[error(transparent)]
    Isa(#[from] IsaAbsent),
    /// The model of the vehicle cannot be.
    #[error("model: {0}")]
    Model(#[from] ModelError),
    /// The effects carry more from step to step than the rollouts have room for.
    #[error(
        "model: effects remember {found} numbers per rollout at step_s = {step_s}, at most {MAX_SLOTS} fit; \
             use longer steps or shorter delays"
    )]
    EffectMemory {
        /// What they need.
        found: usize,
        /// Length of a step [s].
        step_s: f64,
    },
    /// What a running controller cannot change.
    #[error("{field}: expected {expected} as before, found {found}; for another one, make a new controller")]
    Fixed {
        /// Path of the field, or what it is about.
        field: &'static str,
        /// What the controller was made with.
        expected: String,
        /// What was asked for.
        found: String,
    },
    /// The system refused a thread.
    #[error("n_threads: the system refused a thread: {0}")]
    Threads(#[from] std::io::Error),
}
