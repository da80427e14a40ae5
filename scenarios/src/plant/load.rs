//! What pushes and pulls the body beside its wheels: air, wind, loads that tilt or swing, a trailer.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::GRAVITY_MPS2;
use super::chassis::{BodyMotion, Wrench};
use super::ground::Ground;
use super::trailer::Trailer;
use crate::Deviation;

/// Density of the air [kg/m3].
pub(crate) const AIR_KGPM3: f64 = 1.2;

/// One of them.
#[derive(Clone, Debug)]
pub(crate) enum Load {
    /// Drag coefficient times area [m2].
    Drag(f64),
    /// Force in the map frame [N].
    Steady(Vector3<f64>),
    /// Weights that slide along x and y [N].
    Tilting([f64; 2]),
    /// Moment about the body's z axis [N m].
    Moment(f64),
    /// The same, swinging.
    Swinging { torque_nm: f64, radps: f64, phase_rad: f64 },
    /// A cart.
    Towed(Box<Trailer>),
}

impl Load {
    /// The load that a deviation of a vehicle of this mass amounts to, if it is one.
    pub(crate) fn of(deviation: &Deviation, mass_kg: f64) -> Option<Self> {
        match *deviation {
            Deviation::DragArea { area_m2 } => Some(Self::Drag(area_m2)),
            Deviation::Wind { force_n: [east_n, north_n] } => {
                Some(Self::Steady(Vector3::new(east_n, north_n, 0.0)))
            }
            Deviation::SlopePull { along, across } => {
                Some(Self::Tilting([along, across].map(|share| share * mass_kg * GRAVITY_MPS2)))
            }
            Deviation::YawMoment { torque_nm } => Some(Self::Moment(torque_nm)),
            Deviation::Sway { torque_nm, period_s } => {
                Some(Self::Swinging { torque_nm, radps: TAU / period_s, phase_rad: 0.0 })
            }
            Deviation::Trailer { mass_kg, drawbar_m, resistance } => {
                Some(Self::Towed(Box::new(Trailer::new(mass_kg, drawbar_m, resistance))))
            }
            _ => None,
        }
    }

    /// Adds what it does to the body in a step.
    pub(crate) fn push(&mut self, body: &BodyMotion, ground: &Ground, step_s: f64, wrench: &mut Wrench) {
        let [ahead, left, up] = body.axes;
        match self {
            Self::Drag(area_m2) => {
                let velocity_mps = body.linear_mps;
                wrench.force_n -= velocity_mps * (0.5 * AIR_KGPM3 * *area_m2 * velocity_mps.norm());
            }
            Self::Steady(force_n) => wrench.force_n += *force_n,
            Self::Tilting([along_n, across_n]) => {
                wrench.force_n -= ahead * (*along_n * ahead.z) + left * (*across_n * left.z);
            }
            Self::Moment(torque_nm) => wrench.torque_nm += up * *torque_nm,
            Self::Swinging { torque_nm, radps, phase_rad } => {
                *phase_rad = (*phase_rad + *radps * step_s) % TAU;
                wrench.torque_nm += up * (*torque_nm * phase_rad.sin());
            }
            Self::Towed(trailer) => {
                let force_n = trailer.pull_n(body, ground, step_s);
                wrench.add_at(force_n, &body.origin_m, body);
            }
        }
    }
}
