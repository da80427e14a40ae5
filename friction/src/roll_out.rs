//! Where a vehicle goes in 20 steps of 0.1 s over ground that differs from wheel to wheel and from step to step, and how
//! that depends on every coefficient on the way.
//!
//! Within a step derivatives run forward, over eight numbers of the state and sixteen coefficients; over the steps they run
//! back. So 320 coefficients cost little more than sixteen.

use crate::chassis::{Chassis, GRAVITY_MPS2};
use crate::dual::Dual;
use crate::reasoning::{Coefficients, Controls, State, Surface};

/// Steps of a prediction (AnyNav, section 5.2.2).
pub const STEPS: usize = 20;
/// Length of a step [s].
pub const PERIOD_S: f64 = 0.1;
/// Euler steps in a step: stiff tyres ask for more than one.
pub const SUBSTEPS: usize = 10;
const STEP_S: f64 = PERIOD_S / SUBSTEPS as f64;
/// Directions of derivatives within a step.
const DIRECTIONS: usize = State::LEN + 16;

/// Coefficients under each wheel: static, sliding, viscous [s/m], Stribeck speed [m/s].
pub type WheelCoefficients = [[f64; 4]; 4];
/// A gradient by coefficients, for each step.
pub type CoefficientGradient = [WheelCoefficients; STEPS];

/// Ground during one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Under each wheel.
    pub coefficients: WheelCoefficients,
    /// Rise of the ground east and north [-].
    pub gradient: [f64; 2],
}

impl Ground {
    fn surface<const N: usize>(&self, coefficient: impl Fn(usize, usize) -> Dual<N>) -> Surface<N> {
        let [east, north] = self.gradient;
        let across_mps2 = GRAVITY_MPS2 / (1.0 + east * east + north * north).sqrt();
        let friction = |wheel: usize| Coefficients(std::array::from_fn(|which| coefficient(wheel, which)));
        Surface {
            friction: std::array::from_fn(friction),
            pull_mps2: [-east * across_mps2, -north * across_mps2],
            across_mps2,
        }
    }
}

/// States at the end of each step. `controls` has one entry for each Euler step; `ground` is asked at the begin of each
/// step with the step's index and the state.
pub fn roll_out(
    chassis: &Chassis,
    start: &State,
    controls: &[Controls],
    mut ground: impl FnMut(usize, &State) -> Ground,
) -> Vec<State> {
    let mut state = *start;
    let mut states = Vec::with_capacity(STEPS);
    for (step, controls) in controls.chunks(SUBSTEPS).enumerate() {
        let ground = ground(step, &state);
        let surface = ground.surface::<0>(|wheel, which| ground.coefficients[wheel][which].into());
        for controls in controls {
            state = State::of_values(&chassis.advance(&state.values(), controls, &surface, STEP_S));
        }
        states.push(state);
    }
    states
}

/// A loss of the state at the end of a step, and its gradient by the first six numbers of the state.
pub type StateLoss<'a> = dyn Fn(usize, &State) -> (f64, [f64; 6]) + 'a;

/// Sum of the losses of a roll-out over given grounds, and its gradient by every coefficient.
pub fn loss_gradient(
    chassis: &Chassis,
    start: &State,
    controls: &[Controls],
    grounds: &[Ground],
    loss: &StateLoss<'_>,
) -> (f64, CoefficientGradient) {
    let mut state = *start;
    let mut passed = Vec::with_capacity(controls.len());
    let mut ends = Vec::with_capacity(STEPS);
    for (controls, ground) in controls.chunks(SUBSTEPS).zip(grounds) {
        let variable = |wheel: usize, which: usize| {
            Dual::variable(ground.coefficients[wheel][which], State::LEN + 4 * wheel + which)
        };
        let surface = ground.surface::<DIRECTIONS>(variable);
        for controls in controls {
            let mut values = state.values::<DIRECTIONS>();
            for (i, value) in values.iter_mut().enumerate() {
                value.slope[i] = 1.0;
            }
            let after = chassis.advance(&values, controls, &surface, STEP_S);
            passed.push(after.map(|dual| dual.slope));
            state = State::of_values(&after);
        }
        ends.push(loss(ends.len(), &state));
    }
    (ends.iter().map(|(loss, _)| loss).sum(), back(&passed, &ends))
}

/// From the last Euler step to the first: what a change of the state before it does to the losses after it.
fn back(passed: &[[[f64; DIRECTIONS]; State::LEN]], ends: &[(f64, [f64; 6])]) -> CoefficientGradient {
    let mut gradient = [[[0.0; 4]; 4]; STEPS];
    let mut adjoint = [0.0; State::LEN];
    for (index, slopes) in passed.iter().enumerate().rev() {
        let step = index / SUBSTEPS;
        if index % SUBSTEPS == SUBSTEPS - 1 {
            for (adjoint, slope) in adjoint.iter_mut().zip(ends[step].1) {
                *adjoint += slope;
            }
        }
        let by = |direction: usize| {
            slopes.iter().zip(&adjoint).map(|(slopes, adjoint)| slopes[direction] * adjoint).sum::<f64>()
        };
        for (i, value) in gradient[step].as_flattened_mut().iter_mut().enumerate() {
            *value += by(State::LEN + i);
        }
        adjoint = std::array::from_fn(by);
    }
    gradient
}
