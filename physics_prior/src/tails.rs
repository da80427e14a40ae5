//! From outcomes to partial moments and their CVaR, and to the distribution over bins.

use bicycle::lanes::{Lanes, Real, Scalar};
use traversability::{Bins, N_BINS, PmfQuad};

use crate::outcomes::{Equations, Outcomes};
use crate::triangle::{Excess, Triangle, Triangles, probabilities};

/// Partial moments without a distribution in between, see [`traversability::PartialMoments`].
///
/// Outcomes are split between the bins' values, so the distribution lies on these values. With t a bin's value, linear
/// splitting leaves E[(t - Z)^+] and E[(Z - t)^+] as they were: they come from the outcomes themselves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tails {
    /// Of traction: shortfall of the uniform share.
    uniform_shortfall: [f32; N_BINS],
    /// Expected excess of the angles of unknown ground.
    unknown_excess: [f32; N_BINS],
}

/// Partial moments of one parameter.
type Moments<L> = [Real<L>; N_BINS];

impl Tails {
    pub fn new(equations: &Equations) -> Self {
        let share = equations.uniform_weight / N_BINS as f32;
        let values = Bins::TRACTION.values();
        let shortfall = |t: f32| values.iter().map(|value| (t - value).max(0.0)).sum::<f32>();
        Self {
            uniform_shortfall: values.map(|t| share * shortfall(t)),
            unknown_excess: unknown_excess(equations).map(|excess| excess as f32),
        }
    }

    /// Shortfalls of linear and of angular traction.
    #[inline(always)]
    pub fn shortfalls<L: Lanes>(&self, lanes: L, outcomes: &Outcomes<L>) -> [Moments<L>; 2] {
        let mut common = filled(lanes, &self.uniform_shortfall);
        for wheel in 0..4 {
            let probability = outcomes.vegetation_probability[wheel];
            // What has no probability adds nothing to any bit.
            if lanes.any(lanes.real(0.0).less(probability)) {
                add_shortfall(lanes, &mut common, outcomes.vegetation[wheel], probability);
            }
        }
        if lanes.any(lanes.real(0.0).less(outcomes.sliding_probability)) {
            add_shortfall(lanes, &mut common, lanes.real(0.0), outcomes.sliding_probability);
        }
        if lanes.any(lanes.real(0.0).less(outcomes.unknown_probability)) {
            add_shortfall(lanes, &mut common, outcomes.unknown, outcomes.unknown_probability);
        }
        [
            with_dirt(lanes, common, outcomes, &outcomes.linear_dirt),
            with_dirt(lanes, common, outcomes, &outcomes.angular_dirt),
        ]
    }

    /// Excesses of the angle about one axis, 0 for roll and 1 for pitch [rad].
    #[inline(always)]
    pub fn excesses_rad<L: Lanes>(&self, lanes: L, outcomes: &Outcomes<L>, axis: usize) -> Moments<L> {
        let mut excess = excess(lanes, outcomes, axis, filled(lanes, &self.unknown_excess));
        // What lies beyond the largest value counts as that.
        let beyond = excess[N_BINS - 1];
        for above in &mut excess {
            *above = (*above - beyond) * lanes.real_single(Bins::ATTITUDE_WIDTH_RAD);
        }
        excess
    }
}

/// The same moments in every lane.
#[inline(always)]
fn filled<L: Lanes>(lanes: L, values: &[f32; N_BINS]) -> Moments<L> {
    let mut moments = [lanes.real(0.0); N_BINS];
    for bin in 0..N_BINS {
        moments[bin] = lanes.real_single(values[bin]);
    }
    moments
}

/// Adds the expected shortfall of dirt, of which each wheel has several outcomes that are equally likely.
#[inline(always)]
fn with_dirt<L: Lanes>(
    lanes: L,
    mut moments: Moments<L>,
    outcomes: &Outcomes<L>,
    dirt: &[[Real<L>; 4]],
) -> Moments<L> {
    let per_outcome = lanes.real_single(1.0 / dirt.len() as f32);
    for wheels in dirt {
        for wheel in 0..4 {
            let probability = per_outcome * outcomes.dirt_probability[wheel];
            add_shortfall(lanes, &mut moments, wheels[wheel], probability);
        }
    }
    moments
}

/// Adds the shortfall of an outcome at every bin value.
#[inline(always)]
fn add_shortfall<L: Lanes>(lanes: L, sums: &mut Moments<L>, traction: Real<L>, probability: Real<L>) {
    // No traction falls short of the first value, which is 0.
    for k in 1..N_BINS {
        let short = (lanes.real_single(Bins::TRACTION.values()[k]) - traction).max(lanes.real(0.0));
        sums[k] = sums[k] + probability * short;
    }
}

/// Expected excess of the angle about one axis.
#[inline(always)]
fn excess<L: Lanes>(lanes: L, outcomes: &Outcomes<L>, axis: usize, of_unknown: Excess<L>) -> Excess<L> {
    let mut excess = of_unknown;
    for excess in &mut excess {
        *excess = *excess * outcomes.unknown_angle_probability[axis];
    }
    outcomes.angles[2 * axis].add_excess(lanes, &mut excess);
    outcomes.angles[2 * axis + 1].add_excess(lanes, &mut excess);
    excess
}

fn unknown_excess(equations: &Equations) -> [f64; N_BINS] {
    let [half_width, zero, one] = [f64::from(equations.unknown_bins), 0.0, 1.0].map(|v| Real(Scalar, v));
    let mut excess = [zero; N_BINS];
    let around = [Triangle::new(Scalar, half_width, one)];
    Triangles { centre: zero, around }.add_excess(Scalar, &mut excess);
    excess.map(|excess| excess.1)
}

/// The distributions of a pose (equation 18), with the uniform share of traction spread over all bins.
pub(crate) fn distribution(equations: &Equations, outcomes: &Outcomes<Scalar>) -> PmfQuad {
    let mut quad = PmfQuad { rows: [[0.0; 4]; N_BINS] };
    let dirt: [&[[Real<Scalar>; 4]]; 2] = [&outcomes.linear_dirt, &outcomes.angular_dirt];
    for (lane, dirt) in dirt.into_iter().enumerate() {
        for row in &mut quad.rows {
            row[lane] = equations.uniform_weight / N_BINS as f32;
        }
        for wheel in 0..4 {
            let probability = outcomes.dirt_probability[wheel].1 / dirt.len() as f64;
            for traction in dirt {
                add_atom(&mut quad, lane, traction[wheel].1, probability);
            }
            let on_vegetation = outcomes.vegetation_probability[wheel].1;
            add_atom(&mut quad, lane, outcomes.vegetation[wheel].1, on_vegetation);
        }
        add_atom(&mut quad, lane, 0.0, outcomes.sliding_probability.1);
        add_atom(&mut quad, lane, outcomes.unknown.1, outcomes.unknown_probability.1);
    }
    let unknown_excess = unknown_excess(equations).map(|excess| Real(Scalar, excess));
    for axis in 0..2 {
        let excess = excess(Scalar, outcomes, axis, unknown_excess).map(|excess| excess.1);
        for (row, probability) in quad.rows.iter_mut().rev().zip(probabilities(&excess)) {
            row[2 + axis] = probability;
        }
    }
    quad
}

/// Adds a probability at a traction, split between the two bins whose values enclose it.
fn add_atom(quad: &mut PmfQuad, lane: usize, traction: f64, probability: f64) {
    let values = Bins::TRACTION.values().map(f64::from);
    let below = values[1..N_BINS - 1].iter().take_while(|&&value| traction >= value).count();
    let share = (traction - values[below]) / (values[below + 1] - values[below]);
    quad.rows[below][lane] += (probability * (1.0 - share)) as f32;
    quad.rows[below + 1][lane] += (probability * share) as f32;
}
