//! The steps that the rollouts take, each with no more arithmetic than its model and task need.

use super::Memory;
use crate::kernel::Kernel;
use bicycle::lanes::Real;
use bicycle::{GroundSample, LaneState, MotionStepper, Rates};

/// What of a step there is to compute.
pub(super) trait Motion {
    /// Whether effects act, which remember and may read the ground.
    const HAS_EFFECTS: bool;
    /// Whether lateral acceleration and reverse are priced.
    const HAS_MANOEUVRES: bool;
    /// Whether the vehicle stands beyond a limit of attitude.
    const IS_LEAVING: bool;
    fn step<K: Kernel, P: MotionStepper>(
        stepper: &P,
        state: &mut LaneState<K>,
        command: [Real<K>; 2],
        ground: &GroundSample<Real<K>>,
        memory: (&mut Memory<K>, usize),
    ) -> Rates<K>;
}

/// No effects, instant actuators, no prices of manoeuvres.
pub(super) struct Bare;
/// No effects.
pub(super) struct Plain;
/// Everything.
pub(super) struct Whole;
/// Everything, from a pose beyond a limit of attitude.
pub(super) struct Leaving;

impl Motion for Bare {
    const HAS_EFFECTS: bool = false;
    const HAS_MANOEUVRES: bool = false;
    const IS_LEAVING: bool = false;
    #[inline(always)]
    fn step<K: Kernel, P: MotionStepper>(
        stepper: &P,
        state: &mut LaneState<K>,
        command: [Real<K>; 2],
        ground: &GroundSample<Real<K>>,
        _: (&mut Memory<K>, usize),
    ) -> Rates<K> {
        stepper.step_bare(state, command, ground)
    }
}

impl Motion for Plain {
    const HAS_EFFECTS: bool = false;
    const HAS_MANOEUVRES: bool = true;
    const IS_LEAVING: bool = false;
    #[inline(always)]
    fn step<K: Kernel, P: MotionStepper>(
        stepper: &P,
        state: &mut LaneState<K>,
        command: [Real<K>; 2],
        ground: &GroundSample<Real<K>>,
        _: (&mut Memory<K>, usize),
    ) -> Rates<K> {
        stepper.step_plain(state, command, ground)
    }
}

impl Motion for Whole {
    const HAS_EFFECTS: bool = true;
    const HAS_MANOEUVRES: bool = true;
    const IS_LEAVING: bool = false;
    #[inline(always)]
    fn step<K: Kernel, P: MotionStepper>(
        stepper: &P,
        state: &mut LaneState<K>,
        command: [Real<K>; 2],
        ground: &GroundSample<Real<K>>,
        (memory, t): (&mut Memory<K>, usize),
    ) -> Rates<K> {
        stepper.step(state, command, ground, &mut memory.0, t)
    }
}

impl Motion for Leaving {
    const HAS_EFFECTS: bool = true;
    const HAS_MANOEUVRES: bool = true;
    const IS_LEAVING: bool = true;
    #[inline(always)]
    fn step<K: Kernel, P: MotionStepper>(
        stepper: &P,
        state: &mut LaneState<K>,
        command: [Real<K>; 2],
        ground: &GroundSample<Real<K>>,
        (memory, t): (&mut Memory<K>, usize),
    ) -> Rates<K> {
        stepper.step(state, command, ground, &mut memory.0, t)
    }
}
