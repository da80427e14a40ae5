//! The machine as described and as it is: which part is built from which.

use bicycle::Vehicle;

use super::Plant;
use super::drivetrain::Drivetrain;
use super::ground::Ground;
use super::rest::Rest;
use super::wheel::RunningGear;
use crate::Deviation;
use crate::deviation::{altered_actuators, altered_body, altered_wheel};

/// The machine as described, and as it is.
pub(crate) struct Machine<'a> {
    pub vehicle: &'a Vehicle,
    pub deviations: &'a [Deviation],
    pub body: Vehicle,
    pub actuators: Vehicle,
    pub rest: Rest,
}

impl<'a> Machine<'a> {
    pub(crate) fn new(vehicle: &'a Vehicle, deviations: &'a [Deviation]) -> Self {
        let body = altered_body(vehicle, deviations);
        let rest = Rest::new(&body);
        Self { vehicle, deviations, body, actuators: altered_actuators(vehicle, deviations), rest }
    }

    /// Tyres are made for the vehicle as described, and keep their stiffness under another load.
    pub(crate) fn gear(&self, cell_m: f64, step_s: f64) -> [RunningGear; 4] {
        let described = Rest::new(self.vehicle);
        std::array::from_fn(|i| {
            let wheel = altered_wheel(&self.body, self.deviations, i);
            RunningGear::new(&wheel, &described, cell_m, step_s).deviating(self.deviations, i)
        })
    }

    /// The motor controller knows mass and wheels from the description.
    pub(crate) fn drivetrain(&self, ground: &Ground) -> Drivetrain {
        let rest = Rest::new(self.vehicle);
        let gear = RunningGear::new(self.vehicle, &rest, ground.resolution_m(), Plant::STEP_S);
        let stance = rest.stance(self.vehicle, &gear.envelope);
        Drivetrain::new(&self.actuators, &rest, &stance).deviating(self.deviations)
    }
}
