//! Discs that move: places that the vehicle's body is to keep away from, another one at every step of the horizon.
//!
//! Seen from above the body is a rectangle. Nearness costs; what would touch a disc within the time that it takes to stop
//! may not be driven at all.

use crate::cost::{Place, Step, StepCost};
use crate::diagnostics::CostTerm;
use crate::driven::Driven;
use crate::rollout::Job;
use bicycle::MotionState;
use bicycle::lanes::{Lanes, Real};

/// The room that a vehicle takes up, seen from above, about the point that moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outline {
    /// From the point to the front [m].
    pub front_m: f64,
    /// From the point to the rear, as a positive number [m].
    pub rear_m: f64,
    /// Half of the width [m].
    pub half_width_m: f64,
}

/// A disc at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disc {
    /// Its centre, in the frame of the map: east, north [m].
    pub centre_m: [f64; 2],
    /// Nearer to the centre than this the body must not come [m].
    pub radius_m: f64,
    /// So much farther nearness begins to cost [m], > 0.
    pub margin_m: f64,
}

/// What nearness to discs costs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiscPrices {
    /// Of a step that touches a disc [s].
    pub touch_s: f64,
    /// Of a step close to one at 1 m/s or more, on top [s]. It falls with the square of the distance to nothing at the
    /// margin's end, and with the square of the speed below 1 m/s, as the way to stop does: who is slow may be near.
    pub near_s: f64,
    /// How far plans are looked at beyond the time that it takes to stop [s].
    pub foresight_s: f64,
}

/// Discs that move, as a cost of steps. Without any it costs nothing, not even time. Made once with all the memory that
/// it will ever use.
#[derive(Clone, Debug, Default)]
pub struct MovingDiscs {
    outline: Outline,
    prices: DiscPrices,
    n_steps: usize,
    n_max: usize,
    n: usize,
    /// Shape [disc, step].
    discs: Vec<Disc>,
}

impl MovingDiscs {
    /// Room for `n_max` discs over `n_steps` steps; none is there.
    pub fn new(outline: Outline, prices: DiscPrices, n_max: usize, n_steps: usize) -> Self {
        Self { outline, prices, n_steps, n_max, n: 0, discs: vec![Disc::default(); n_max * n_steps] }
    }

    /// Takes all away.
    pub fn clear(&mut self) {
        self.n = 0;
    }

    /// Adds one that is at `at` at the end of every step, counted from 0. Beyond the room there is, it is left out.
    pub fn add(&mut self, at: impl Fn(usize) -> Disc) {
        if self.n == self.n_max {
            return;
        }
        let places = &mut self.discs[self.n * self.n_steps..][..self.n_steps];
        places.iter_mut().enumerate().for_each(|(t, place)| *place = at(t));
        self.n += 1;
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Those of a step; of the last one beyond the horizon.
    #[inline(always)]
    fn at(&self, t: usize) -> impl Iterator<Item = &Disc> {
        let t = t.min(self.n_steps.saturating_sub(1));
        self.discs[..self.n * self.n_steps].chunks_exact(self.n_steps.max(1)).map(move |places| &places[t])
    }

    /// From the body at a pose to a place [m]; 0 within the body.
    pub fn distance_m(&self, state: &MotionState, [x_m, y_m]: [f64; 2]) -> f64 {
        let (sin, cos) = libm::sincos(state.yaw_rad);
        let [east_m, north_m] = [x_m - state.x_m, y_m - state.y_m];
        let (ahead_m, left_m) = (cos * east_m + sin * north_m, cos * north_m - sin * east_m);
        let Outline { front_m, rear_m, half_width_m } = self.outline;
        let beyond_m = (ahead_m - front_m).max(-rear_m - ahead_m).max(0.0);
        let beside_m = (left_m.abs() - half_width_m).max(0.0);
        libm::hypot(beyond_m, beside_m)
    }
}

impl StepCost for MovingDiscs {
    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let lanes = step.lanes();
        let [zero, one] = [0.0, 1.0].map(|value| lanes.real(value));
        let Outline { front_m, rear_m, half_width_m } = self.outline;
        let [front, rear, half_width] = [front_m, -rear_m, half_width_m].map(|value_m| lanes.real(value_m));
        let [touch, near] = [self.prices.touch_s, self.prices.near_s].map(|price_s| lanes.real(price_s));
        let (sin, cos) = heading(step);
        let [speed, _] = step.reached();
        let near = near * one.min(speed * speed);
        let mut cost = zero;
        for disc in self.at(step.number()) {
            // From the disc to the vehicle; the disc lies the other way.
            let [east, north] = step.offset_m(disc.centre_m);
            let ahead = -(cos * east + sin * north);
            let left = sin * east - cos * north;
            let beyond = zero.max(ahead - front).max(rear - ahead);
            let beside = zero.max(left.abs() - half_width);
            let gap = beyond.mul_add(beyond, beside * beside).sqrt() - lanes.real(disc.radius_m);
            let closeness = zero.max(one - zero.max(gap) * lanes.real(1.0 / disc.margin_m));
            cost = (closeness * closeness).mul_add(near, cost);
            cost = cost.add_where(gap.less(zero), touch);
        }
        cost
    }

    fn forbids(&self, t: usize, state: &MotionState) -> bool {
        self.at(t).any(|disc| self.distance_m(state, disc.centre_m) < disc.radius_m)
    }

    fn foresight_s(&self) -> Option<f64> {
        (!self.is_empty()).then_some(self.prices.foresight_s)
    }

    /// Without a disc as if there were no cost at all.
    fn roll_out<M: Driven>(job: Job<'_, M::Stepper, Self>) {
        if !job.scene.cost.is_empty() {
            return M::roll_out_among(job);
        }
        let Job { instructions, scene, chunk } = job;
        M::roll_out(Job { instructions, scene: &scene.with_cost(&()), chunk: &mut *chunk });
        chunk.terms[CostTerm::Added as usize].0.fill(0.0);
    }
}

#[inline(always)]
fn heading<L: Lanes>(place: &Place<'_, L>) -> (Real<L>, Real<L>) {
    place.state.turns.wrap_turns().sin_cos_turns()
}
