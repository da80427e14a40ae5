//! A constant force in the map frame.

use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A constant force in the map frame.
    Wind {
        /// Acceleration E eastward [m/s2].
        east_mps2 in "m/s2": -3.0 to 3.0, neutral 0.0, tried [-0.4, 0.4];
        /// Acceleration N northward [m/s2].
        north_mps2 in "m/s2": -3.0 to 3.0, neutral 0.0, tried [-0.4, 0.4];
    }
}

impl Definition for Wind {
    const ID: &'static str = "wind";
    const MEANING: &'static str = "wind: dv/dt += (E, N) turned into the body frame";
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let lanes = state.speed.0;
        let [east, north] = [constants[0], constants[1]].map(|value| Real::constant(lanes, value));
        let [sine, cosine] = state.heading;
        state.resist(-east.mul_add(cosine, north * sine));
        state.side_acceleration = state.side_acceleration + north.mul_add(cosine, -(east * sine));
    }
}
