//! Costs of one's own: what a user adds to what the controller prices itself.
//!
//! A [`StepCost`] prices every step of every rollout and becomes part of the inner loop when the program is compiled; a
//! [`RolloutCost`] looks at all rollouts at once, after they were rolled out. Several are put together as a tuple, `()`
//! is none. The controller's own terms, the time to a goal, the distance from a path, lateral acceleration and reverse,
//! are step costs like any other.

use crate::driven::Driven;
use crate::rollout::Job;
use crate::trace::Trace;
use bicycle::lanes::{Lanes, Real};
use bicycle::{LaneState, MotionState, Rates};
use std::f64::consts::TAU;
use std::ops::Deref;

/// Where the cells lie in which rollouts count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// The map's south-west corner [m].
    pub(crate) corner_m: [f64; 2],
    /// Length of a cell [m].
    pub(crate) cell_m: f64,
}

impl Frame {
    /// A point of the map frame in cells from the corner.
    pub(crate) fn cells(&self, at_m: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at_m[axis] - self.corner_m[axis]) / self.cell_m)
    }

    /// The state of a lane in the map frame: of position in cells, yaw in turns, speed and what turns.
    pub(crate) fn state(&self, lane: [f32; 5]) -> MotionState {
        let [x_cells, y_cells, turns, speed_mps, turn] = lane.map(f64::from);
        MotionState {
            x_m: self.corner_m[0] + x_cells * self.cell_m,
            y_m: self.corner_m[1] + y_cells * self.cell_m,
            yaw_rad: turns * TAU,
            speed_mps,
            turn,
        }
    }
}

/// Where a pack of rollouts is, one vehicle per lane.
#[derive(Clone, Copy)]
pub struct Place<'a, L: Lanes> {
    /// In cells.
    pub(crate) state: LaneState<L>,
    pub(crate) frame: &'a Frame,
}

impl<L: Lanes> Place<'_, L> {
    /// The instructions, to make constants with: `place.lanes().real(0.5)`.
    #[inline(always)]
    pub fn lanes(&self) -> L {
        self.state.x.0
    }

    /// From a point of the map frame [m] to the vehicle, east and north [m].
    #[inline(always)]
    pub fn offset_m(&self, from_m: [f64; 2]) -> [Real<L>; 2] {
        let [x_cells, y_cells] = self.frame.cells(from_m);
        let (lanes, cell_m) = (self.lanes(), self.lanes().real(self.frame.cell_m));
        [(self.state.x - lanes.real(x_cells)) * cell_m, (self.state.y - lanes.real(y_cells)) * cell_m]
    }

    /// Distance from a point of the map frame [m].
    #[inline(always)]
    pub fn distance_m(&self, from_m: [f64; 2]) -> Real<L> {
        let [east, north] = self.offset_m(from_m);
        east.mul_add(east, north * north).sqrt()
    }

    /// By how much the vehicle's yaw exceeds an angle, from -pi to pi [rad].
    #[inline(always)]
    pub fn turned_rad(&self, from_rad: f64) -> Real<L> {
        let lanes = self.lanes();
        (self.state.turns - lanes.real((from_rad / TAU).rem_euclid(1.0))).wrap_turns() * lanes.real(TAU)
    }

    /// What the actuators have reached: speed [m/s], and steering angle [rad] or yaw rate [rad/s].
    #[inline(always)]
    pub fn reached(&self) -> [Real<L>; 2] {
        [self.state.speed, self.state.steering]
    }
}

/// One step of a pack of rollouts; it is also the [`Place`] where it ends.
#[derive(Clone, Copy)]
pub struct Step<'a, L: Lanes> {
    pub(crate) t: usize,
    pub(crate) place: Place<'a, L>,
    pub(crate) rates: Rates<L>,
    pub(crate) command: [Real<L>; 2],
    pub(crate) risk: [Real<L>; 4],
}

impl<'a, L: Lanes> Deref for Step<'a, L> {
    type Target = Place<'a, L>;
    #[inline(always)]
    fn deref(&self) -> &Place<'a, L> {
        &self.place
    }
}

impl<L: Lanes> Step<'_, L> {
    /// Number of the step, the first being 0.
    #[inline(always)]
    pub fn number(&self) -> usize {
        self.t
    }

    /// Speed [m/s] and yaw rate [rad/s] of the step: the speed before the ground takes its share, the yaw rate after.
    #[inline(always)]
    pub fn rates(&self) -> Rates<L> {
        self.rates
    }

    /// What was asked for: speed [m/s], and steering angle [rad] or yaw rate [rad/s].
    #[inline(always)]
    pub fn command(&self) -> [Real<L>; 2] {
        self.command
    }

    /// Where the step began: worst linear traction [-], angular traction [-], |roll| [rad], |pitch| [rad].
    #[inline(always)]
    pub fn risk(&self) -> [Real<L>; 4] {
        self.risk
    }
}

/// What a step costs, beside the limits of attitude.
///
/// ```
/// use bicycle::lanes::{Lanes, Real};
/// use mppi::{Step, StepCost};
///
/// /// A second for every step within a circle.
/// struct KeepOut {
///     centre_m: [f64; 2],
///     radius_m: f64,
/// }
///
/// impl StepCost for KeepOut {
///     fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
///         let (inside, lanes) = (step.distance_m(self.centre_m), step.lanes());
///         lanes.real(0.0).add_where(inside.less(lanes.real(self.radius_m)), lanes.real(1.0))
///     }
/// }
/// ```
pub trait StepCost: Send + Sync {
    /// Whether there is nothing to pay, ever.
    #[doc(hidden)]
    const IS_NOTHING: bool = false;
    /// Whether every step of every rollout is kept.
    #[doc(hidden)]
    const KEEPS_STEPS: bool = false;

    /// Cost of a step [s]. It counts until the goal is reached.
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L>;

    /// Cost of where a rollout ends [s]. It counts where the goal is not reached.
    fn end<L: Lanes>(&self, end: &Place<'_, L>) -> Real<L> {
        end.lanes().real(0.0)
    }

    /// Whether a plan that leads to this state with its step `t`, counted from 0, may not be driven. Asked in double
    /// precision, where [`StepCost::foresight_s`] says so. Where no plan is left the decision is to stop, for
    /// [`bicycle::StopReason::MovingObstacle`].
    fn forbids(&self, _t: usize, _state: &MotionState) -> bool {
        false
    }

    /// How far beyond the time that it takes to stop plans are to be looked at [s]; `None` where nothing is forbidden.
    fn foresight_s(&self) -> Option<f64> {
        None
    }

    /// Rolls out some futures.
    #[doc(hidden)]
    fn roll_out<M: Driven>(job: Job<'_, M::Stepper, Self>)
    where
        Self: Sized,
    {
        job.run();
    }
}

/// No cost.
impl StepCost for () {
    const IS_NOTHING: bool = true;

    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        step.lanes().real(0.0)
    }

    fn roll_out<M: Driven>(job: Job<'_, M::Stepper, Self>) {
        M::roll_out(job);
    }
}

/// A future that was rolled out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Future {
    /// Where it ends, in the map frame; at a goal it goes on until the horizon.
    pub end: MotionState,
    /// What it costs so far [s]; not finite when it met a number that is not.
    pub cost_s: f32,
    /// Its steps beyond the limits of attitude.
    pub n_broken: f32,
}

/// What whole rollouts cost, told once per update and iteration.
pub trait RolloutCost: Send {
    /// Whether there is nothing to pay, ever.
    #[doc(hidden)]
    const IS_NOTHING: bool = false;
    /// Whether it looks at every step of the rollouts, which are kept for it: that takes time and memory.
    const KEEPS_STEPS: bool = false;

    /// Adds to `added_s` what each of the futures costs more [s]; both have the same length, and the order is the same
    /// for any number of threads. A cost that is not finite leaves the future out. Must not allocate.
    fn add(&self, futures: &[Future], added_s: &mut [f32]);

    /// The same for who looks at every step and says so by [`RolloutCost::KEEPS_STEPS`]; asked after
    /// [`RolloutCost::add`].
    fn add_traced(&self, _trace: &Trace<'_>, _added_s: &mut [f32]) {}
}

/// No cost.
impl RolloutCost for () {
    const IS_NOTHING: bool = true;

    fn add(&self, _futures: &[Future], _added_s: &mut [f32]) {}
}

macro_rules! sum {
    ($($name:ident)+) => {
        /// The sum.
        impl<$($name: StepCost),+> StepCost for ($($name,)+) {
            const IS_NOTHING: bool = $($name::IS_NOTHING)&&+;

            #[inline(always)]
            fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
                #[allow(non_snake_case, reason = "a name for the value as for its type")]
                let ($($name,)+) = self;
                let sum = step.lanes().real(0.0);
                $(let sum = sum + $name.step(step);)+
                sum
            }

            #[inline(always)]
            fn end<L: Lanes>(&self, end: &Place<'_, L>) -> Real<L> {
                #[allow(non_snake_case, reason = "a name for the value as for its type")]
                let ($($name,)+) = self;
                let sum = end.lanes().real(0.0);
                $(let sum = sum + $name.end(end);)+
                sum
            }
        }

        /// The sum.
        impl<$($name: RolloutCost),+> RolloutCost for ($($name,)+) {
            const IS_NOTHING: bool = $($name::IS_NOTHING)&&+;
            const KEEPS_STEPS: bool = $($name::KEEPS_STEPS)||+;

            fn add(&self, futures: &[Future], added_s: &mut [f32]) {
                #[allow(non_snake_case, reason = "a name for the value as for its type")]
                let ($($name,)+) = self;
                $($name.add(futures, added_s);)+
            }

            fn add_traced(&self, trace: &Trace<'_>, added_s: &mut [f32]) {
                #[allow(non_snake_case, reason = "a name for the value as for its type")]
                let ($($name,)+) = self;
                $($name.add_traced(trace, added_s);)+
            }
        }
    };
}
sum!(A);
sum!(A B);
sum!(A B C);
sum!(A B C D);
