//! What a cycle tells about itself.

use bicycle::lanes::Isa;
use serde::Serialize;

/// The parts of a rollout's cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(usize)]
pub enum CostTerm {
    /// Time and distance until the goal is reached, or distance from the moving point of a path.
    Running,
    /// Steps beyond the limits of roll or pitch.
    Attitude,
    /// Steps beyond the limit of lateral acceleration, beyond what the ground is known to hold, or faster than it may be
    /// driven over.
    Lateral,
    /// Steps in reverse.
    Reverse,
    /// Deviation from the nominal controls.
    Control,
    /// What is left at the end of the horizon.
    Terminal,
    /// What costs of one's own come to, see [`crate::StepCost`] and [`crate::RolloutCost`].
    Added,
}

impl CostTerm {
    /// Number of terms.
    pub const COUNT: usize = 7;
    /// All terms in the order of [`Diagnostics::best_terms_s`].
    pub const ALL: [Self; Self::COUNT] = [
        Self::Running,
        Self::Attitude,
        Self::Lateral,
        Self::Reverse,
        Self::Control,
        Self::Terminal,
        Self::Added,
    ];
}

/// What happened in the last cycle that sampled; of several iterations, in the last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Diagnostics {
    /// Instruction set in use.
    pub isa: Isa,
    /// Cost terms of the cheapest rollout [s].
    pub best_terms_s: [f32; CostTerm::COUNT],
    /// Mean cost terms over all rollouts with a finite cost [s].
    pub mean_terms_s: [f32; CostTerm::COUNT],
    /// Least cost [s].
    pub baseline_s: f32,
    /// Sum of exp((baseline - cost) / temperature).
    pub normalizer: f32,
    /// (sum w)^2 / sum w^2, from 1 to the number of rollouts.
    pub effective_sample_size: f32,
    /// Temperature [s].
    pub temperature_s: f32,
    /// -T ln(mean exp(-cost / T)) [s]; between the least and the mean cost.
    pub free_energy_s: f32,
    /// Rollouts that keep every limit over the whole horizon.
    pub n_feasible: usize,
    /// Rollouts that met a number that is not finite and were left out.
    pub n_non_finite: usize,
    /// Whether the vehicle is backing up because it was stuck.
    pub is_recovering: bool,
    /// Whether there is no way where it was stuck: the ground held it, which then moved less than half as far as it was
    /// told, or it was stuck about there the time before.
    pub is_no_way: bool,
    /// Whether the plan is a single rollout, because the mean of all broke a limit.
    pub is_best_alone: bool,
}

impl Diagnostics {
    pub(crate) fn new(isa: Isa) -> Self {
        Self {
            isa,
            best_terms_s: [0.0; CostTerm::COUNT],
            mean_terms_s: [0.0; CostTerm::COUNT],
            baseline_s: 0.0,
            normalizer: 0.0,
            effective_sample_size: 0.0,
            temperature_s: 0.0,
            free_energy_s: 0.0,
            n_feasible: 0,
            n_non_finite: 0,
            is_recovering: false,
            is_no_way: false,
            is_best_alone: false,
        }
    }
}
