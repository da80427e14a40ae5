//! From outcomes to the distribution over bins, and straight to its CVaR.

use traversability::{Bins, CvarLevel, N_BINS, PartialMoments, PmfQuad, Risk};

use crate::outcomes::{Equations, Outcomes};
use crate::triangle::{Excess, VALUES, probabilities};

/// CVaR at one level without a distribution in between.
///
/// Outcomes are split between the bins' values, so the distribution lies on these values, and by Rockafellar and
/// Uryasev its CVaR is the best over them of t - E[(t - Z)^+] / level from the left, t + E[(Z - t)^+] / level from
/// the right. With t a bin's value, linear splitting leaves both expectations as they were: they come from
/// the outcomes themselves, and every t is one lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tails {
    per_level: f32,
    /// Of traction: value less what the uniform share costs.
    traction: [f32; N_BINS],
    /// Of traction: shortfall of the uniform share.
    uniform_shortfall: [f32; N_BINS],
    /// Expected excess of the angles of unknown ground.
    unknown_excess: Excess,
}

impl Tails {
    pub fn new(equations: &Equations, level: CvarLevel) -> Self {
        let per_level = level.reciprocal();
        let unknown_excess = unknown_excess(equations);
        let share = equations.uniform_weight / N_BINS as f32;
        let values = Bins::TRACTION.values();
        let shortfall = |t: f32| values.iter().map(|value| (t - value).max(0.0)).sum::<f32>();
        Self {
            per_level,
            traction: values.map(|t| t - per_level * share * shortfall(t)),
            uniform_shortfall: values.map(|t| share * shortfall(t)),
            unknown_excess,
        }
    }

    /// CVaR of every parameter from its bad end (equation 6).
    #[inline(always)]
    pub fn risk(&self, outcomes: &Outcomes) -> Risk {
        Risk {
            linear_traction: self.traction(outcomes, &outcomes.linear_dirt),
            angular_traction: self.traction(outcomes, &outcomes.angular_dirt),
            roll_rad: self.angle_rad(outcomes, 0),
            pitch_rad: self.angle_rad(outcomes, 1),
        }
    }

    /// Partial moments of every parameter, which do not depend on the level.
    #[inline(always)]
    pub fn moments(&self, outcomes: &Outcomes) -> PartialMoments {
        let shortfalls = |dirt: &[[f32; 4]]| {
            let mut shortfalls = self.uniform_shortfall;
            add_shortfalls(&mut shortfalls, outcomes, dirt, 1.0);
            shortfalls
        };
        let excesses_rad = |axis: usize| {
            let excess = excess(outcomes, axis, &self.unknown_excess);
            excess.map(|above| (above - excess[N_BINS - 1]) * Bins::ATTITUDE_WIDTH_RAD)
        };
        let [linear, angular] = [shortfalls(&outcomes.linear_dirt), shortfalls(&outcomes.angular_dirt)];
        PartialMoments { moments: [linear, angular, excesses_rad(0), excesses_rad(1)] }
    }

    #[inline(always)]
    fn traction(&self, outcomes: &Outcomes, dirt: &[[f32; 4]]) -> f32 {
        let mut tails = self.traction;
        add_shortfalls(&mut tails, outcomes, dirt, -self.per_level);
        let mut best = f32::NEG_INFINITY;
        for tail in tails {
            best = if tail > best { tail } else { best };
        }
        best
    }

    #[inline(always)]
    fn angle_rad(&self, outcomes: &Outcomes, axis: usize) -> f32 {
        let excess = excess(outcomes, axis, &self.unknown_excess);
        // What lies beyond the largest value counts as that.
        let beyond = excess[N_BINS - 1];
        let mut best = f32::INFINITY;
        for (value, excess) in VALUES.iter().zip(excess) {
            let tail = value + self.per_level * (excess - beyond);
            best = if tail < best { tail } else { best };
        }
        best * Bins::ATTITUDE_WIDTH_RAD
    }
}

/// Adds the expected shortfall of all outcomes of traction at every bin value, times `weight`; `dirt` holds outcomes
/// of each wheel that are equally likely.
#[inline(always)]
fn add_shortfalls(sums: &mut [f32; N_BINS], outcomes: &Outcomes, dirt: &[[f32; 4]], weight: f32) {
    let per_outcome = weight / dirt.len() as f32;
    for wheels in dirt {
        for wheel in 0..4 {
            add_shortfall(sums, wheels[wheel], per_outcome * outcomes.dirt_probability[wheel]);
        }
    }
    let vegetation_shares = &outcomes.vegetation_probability;
    if vegetation_shares.iter().any(|&share| share > 0.0) {
        for wheel in 0..4 {
            add_shortfall(sums, outcomes.vegetation[wheel], weight * vegetation_shares[wheel]);
        }
    }
    if outcomes.unknown_probability > 0.0 {
        add_shortfall(sums, outcomes.unknown, weight * outcomes.unknown_probability);
    }
}

#[inline(always)]
fn add_shortfall(sums: &mut [f32; N_BINS], traction: f32, weight: f32) {
    for k in 0..N_BINS {
        sums[k] += weight * (Bins::TRACTION.values()[k] - traction).max(0.0);
    }
}

/// Expected excess of the angle about one axis.
#[inline(always)]
fn excess(outcomes: &Outcomes, axis: usize, of_unknown: &Excess) -> Excess {
    let mut excess = *of_unknown;
    for excess in &mut excess {
        *excess *= outcomes.unknown_angle_probability[axis];
    }
    for triangles in &outcomes.angles {
        triangles.add_excess(2 * axis, &mut excess);
        triangles.add_excess(2 * axis + 1, &mut excess);
    }
    excess
}

fn unknown_excess(equations: &Equations) -> Excess {
    let mut excess = [0.0; N_BINS];
    for lane in 0..4 {
        equations.unknown_attitude.add_excess(lane, &mut excess);
    }
    excess
}

/// The distributions of a pose (equation 18), with the uniform share of traction spread over all bins.
pub(crate) fn distribution(equations: &Equations, outcomes: &Outcomes) -> PmfQuad {
    let mut quad = PmfQuad { rows: [[0.0; 4]; N_BINS] };
    let dirt: [&[[f32; 4]]; 2] = [&outcomes.linear_dirt, &outcomes.angular_dirt];
    for (lane, dirt) in dirt.into_iter().enumerate() {
        for row in &mut quad.rows {
            row[lane] = equations.uniform_weight / N_BINS as f32;
        }
        for wheel in 0..4 {
            let probability = outcomes.dirt_probability[wheel] / dirt.len() as f32;
            for traction in dirt {
                add_atom(&mut quad, lane, traction[wheel], probability);
            }
            add_atom(&mut quad, lane, outcomes.vegetation[wheel], outcomes.vegetation_probability[wheel]);
        }
        add_atom(&mut quad, lane, outcomes.unknown, outcomes.unknown_probability);
    }
    let unknown_excess = unknown_excess(equations);
    for axis in 0..2 {
        let probabilities = probabilities(&excess(outcomes, axis, &unknown_excess));
        for (row, probability) in quad.rows.iter_mut().rev().zip(probabilities) {
            row[2 + axis] = probability;
        }
    }
    quad
}

/// Adds a probability at a traction, split between the two bins whose values enclose it.
fn add_atom(quad: &mut PmfQuad, lane: usize, traction: f32, probability: f32) {
    let values = Bins::TRACTION.values();
    let below = values[1..N_BINS - 1].iter().take_while(|&&value| traction >= value).count();
    let share = (traction - values[below]) / (values[below + 1] - values[below]);
    quad.rows[below][lane] += probability * (1.0 - share);
    quad.rows[below + 1][lane] += probability * share;
}
