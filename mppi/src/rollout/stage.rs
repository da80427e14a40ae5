//! What the controller prices itself, beside the limits of attitude: the way to a goal or along a path, lateral
//! acceleration, reverse.

use super::{GoalTask, Met, Rest};
use crate::cost::{Place, Step, StepCost};
use crate::kernel::Kernel;
use crate::objective::ReferenceStep;
use bicycle::LaneState;
use bicycle::lanes::{Constant, Lanes, Real};

/// The task of the rollouts: a cost that knows when it is done, and where its end may be looked up in a table.
pub(super) trait Stage<K: Kernel>: StepCost {
    /// Where the way goes on after a step.
    fn goes_on(&self, step: &Step<'_, K>, under_way: K::Mask) -> K::Mask;
    /// Cost of where a rollout ends that is under way [s].
    fn finish(&self, end: &Place<'_, K>) -> Real<K>;
}

impl GoalTask<'_> {
    /// Distance to the goal [cells].
    #[inline(always)]
    fn distance<L: Lanes>(&self, place: &Place<'_, L>) -> Real<L> {
        self.square(place).sqrt()
    }

    /// Square of the distance to the goal [cells2].
    #[inline(always)]
    fn square<L: Lanes>(&self, place: &Place<'_, L>) -> Real<L> {
        let lanes = place.lanes();
        let dx = place.state.x - Real::constant(lanes, self.x_cells);
        let dy = place.state.y - Real::constant(lanes, self.y_cells);
        dx.mul_add(dx, dy * dy)
    }
}

impl StepCost for GoalTask<'_> {
    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let mut time = Real::constant(step.lanes(), self.step_s);
        if let Some(window) = self.window {
            time = window.within(&step.state, time);
        }
        // A square root a step is a fifth of the rollouts' time: none is taken for what nobody prices.
        if self.distance_s.value() == 0.0 {
            return time;
        }
        self.distance(step).mul_add(Real::constant(step.lanes(), self.distance_s), time)
    }

    /// The straight line.
    #[inline(always)]
    fn end<L: Lanes>(&self, end: &Place<'_, L>) -> Real<L> {
        self.distance(end) * Real::constant(end.lanes(), self.rest_s)
    }
}

impl<K: Kernel> Stage<K> for GoalTask<'_> {
    #[inline(always)]
    fn goes_on(&self, step: &Step<'_, K>, under_way: K::Mask) -> K::Mask {
        let kernel = step.lanes();
        // As the distance beside the tolerance, which may be negative. What is no number has not arrived.
        let square = Real::constant(kernel, self.tolerance_square);
        kernel.and(under_way, self.square(step).exceeds(square))
    }

    #[inline(always)]
    fn finish(&self, end: &Place<'_, K>) -> Real<K> {
        let LaneState { x, y, turns, .. } = end.state;
        match &self.rest {
            Rest::Straight => self.end(end),
            // The field has an answer for whoever is nowhere: zero, or no number, is added to it.
            Rest::Field(field) => field.time_to_go(x, y, turns) + (x + y) * x.0.real(0.0),
            Rest::StraightFacing(field) => self.end(end) + field.time_to_turn(x, y, turns),
        }
    }
}

/// A moving point to keep up with.
pub(super) struct PathTask<'a>(pub(super) &'a [ReferenceStep]);

impl StepCost for PathTask<'_> {
    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let (lanes, reference) = (step.lanes(), &self.0[step.t]);
        let dx = step.state.x - Real::constant(lanes, reference.x_cells);
        let dy = step.state.y - Real::constant(lanes, reference.y_cells);
        let [tx, ty] = reference.tangent.map(|value| Real::constant(lanes, value));
        let (along, across) = (dx.mul_add(tx, dy * ty), dy.mul_add(tx, -(dx * ty)));
        let along = along * along * Real::constant(lanes, reference.along_s);
        (across * across).mul_add(Real::constant(lanes, reference.across_s), along)
    }
}

impl<K: Kernel> Stage<K> for PathTask<'_> {
    #[inline(always)]
    fn goes_on(&self, _: &Step<'_, K>, under_way: K::Mask) -> K::Mask {
        under_way
    }

    #[inline(always)]
    fn finish(&self, end: &Place<'_, K>) -> Real<K> {
        self.end(end)
    }
}

/// Steps beyond a lateral acceleration.
pub(super) struct Lateral {
    pub(super) most_mps2: Constant,
    /// Of a step [s].
    pub(super) price_s: Constant,
}

impl StepCost for Lateral {
    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let (lanes, rates) = (step.lanes(), step.rates());
        let sideways = (rates.speed * rates.yaw_rate).abs().exceeds(Real::constant(lanes, self.most_mps2));
        lanes.real(0.0).add_where(sideways, Real::constant(lanes, self.price_s))
    }
}

/// Share of the friction that a plan may use: beyond it tyres slide, and what they then do no model foretells well.
const GRIP_SHARE: f64 = 0.75;
const GRAVITY_MPS2: f64 = 9.81;

/// Steps that ask more of the ground than it is known to hold, to turn and to stay on a slope. What tyres do beyond that is
/// nothing that a plan may rely on, so that it is priced and not foretold: plans that were told how little a slide turns
/// steered harder for it.
pub(super) struct Grip<'a, K: Kernel> {
    /// Of a step that asks twice as much [s].
    pub(super) price_s: Constant,
    pub(super) met: &'a Met<K>,
}

impl<K: Kernel> Grip<'_, K> {
    #[inline(always)]
    pub(super) fn step(&self, step: &Step<'_, K>) -> Real<K> {
        let (lanes, rates) = (step.lanes(), step.rates());
        let ([east, north], gravity) = (self.met.ground.gradient, lanes.real(GRAVITY_MPS2));
        let (sine, cosine) = step.state.turns.sin_cos_turns();
        let ahead = gravity * east.mul_add(cosine, north * sine);
        let left = north.mul_add(cosine, -(east * sine));
        let across = gravity.mul_add(left, rates.speed * rates.yaw_rate);
        let asked = ahead.mul_add(ahead, across * across).sqrt();
        let most = self.met.friction * lanes.real(GRIP_SHARE * GRAVITY_MPS2);
        (asked / most - lanes.real(1.0)).max(lanes.real(0.0)) * Real::constant(lanes, self.price_s)
    }
}

/// Steps faster than the ground may be driven over.
pub(super) struct Overspeed<'a, K: Kernel> {
    /// Of a step that is twice as fast [s].
    pub(super) price_s: Constant,
    pub(super) met: &'a Met<K>,
}

impl<K: Kernel> Overspeed<'_, K> {
    #[inline(always)]
    pub(super) fn step(&self, step: &Step<'_, K>) -> Real<K> {
        let (lanes, traction) = (step.lanes(), self.met.ground.linear_traction);
        let share = (step.rates().speed * traction).abs() / self.met.fastest_mps;
        (share - lanes.real(1.0)).max(lanes.real(0.0)) * Real::constant(lanes, self.price_s)
    }
}

/// Steps in reverse.
pub(super) struct Reverse {
    /// Of a step [s].
    pub(super) price_s: Constant,
}

impl StepCost for Reverse {
    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let (lanes, zero) = (step.lanes(), step.lanes().real(0.0));
        zero.add_where(step.rates().speed.less(zero), Real::constant(lanes, self.price_s))
    }
}
