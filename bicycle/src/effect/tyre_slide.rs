//! Axles that slide where what holds them on their way takes more than the grip.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Constants, Definition, Driving, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Axles that slide.
    TyreSlide {
        /// Friction coefficient M [-].
        mu in "-": 0.02 to 10.0, neutral 10.0, tried [0.2, 0.3, 0.4, 0.55, 0.8];
        /// Share D of the weight on driven wheels [-].
        driven_share in "-": 0.35 to 1.0, neutral 1.0, tried [0.5, 1.0];
    }
}

/// Share of the squared grip that is left for the curve when the drive takes all it can.
const LEAST_LEFT: f64 = 0.1;

impl Definition for TyreSlide {
    const ID: &'static str = "tyre_slide";
    const CAUSE: &'static str = "friction";
    const MEANING: &'static str = "tyres that slide: the sideways speed w of each axle follows the model's as far as the grip \
        goes, dw/dt = a / (1 + (a / G)^4)^(1/4) - v yaw_rate with a what following takes and G^2 = (M g)^2 - (dv/dt)^2; \
        dv/dt += w yaw_rate with w at the rear; -M g <= drive force <= D M g";
    const STAGES: &'static [Stage] = &[Stage::Drive, Stage::Motion];
    const CARRIES_MOTION: bool = true;

    fn constants(&self, step_s: f64) -> [f64; 4] {
        let limit_mps2 = self.mu * STANDARD_GRAVITY_MPS2;
        [limit_mps2, limit_mps2 * self.driven_share, step_s, 1.0 / step_s]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let [brakes, drive] = [constants[0], constants[1]].map(|limit| Real::constant(state.speed.0, limit));
        let force = (state.acceleration + state.resisted).clamp(-brakes, drive);
        state.acceleration = force - state.resisted;
    }

    /// A body whose squared radius of gyration is the product of its axles' distances from the centre of gravity moves as
    /// if each axle carried a mass of its own; vehicles are near to it (dynamic index of 1). What the steered front axle takes
    /// from the speed ahead and what the turn gives it cancel while the wheels roll, and are left out.
    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let lanes = state.forward.0;
        let [limit, step, per_step] =
            [constants[0], constants[2], constants[3]].map(|value| Real::constant(lanes, value));
        let grip = limit * limit;
        let left = (grip - state.acceleration * state.acceleration).max(grip * lanes.real(LEAST_LEFT));
        let [lateral, yaw_rate] = state.carried();
        let curving = state.forward * yaw_rate - state.side_acceleration;
        let slid = |reached: Real<L>, wanted: Real<L>| {
            let asked = (wanted - reached).mul_add(per_step, curving);
            let square = asked * asked / left;
            let given = asked / square.mul_add(square, lanes.real(1.0)).sqrt().sqrt();
            (given - curving).mul_add(step, reached)
        };
        let front = |lateral: Real<L>, yaw_rate: Real<L>| yaw_rate.mul_add(state.wheelbase, lateral);
        let rear_wanted = state.lateral;
        let ahead = slid(front(lateral, yaw_rate), front(rear_wanted, state.yaw_rate));
        let behind = slid(lateral, rear_wanted);
        let turning = (ahead - behind) / state.wheelbase;
        state.carry(behind, turning);
        state.gained = (behind * turning).mul_add(step, state.gained);
    }
}
