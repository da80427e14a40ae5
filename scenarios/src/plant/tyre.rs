//! Friction between tyre and ground: a brush.
//!
//! The tread is a brush whose bristles stick to the ground. Slip pulls them, rolling carries them out of the patch of
//! contact and brings loose ones in, so that their deflection u follows the slip velocity v over the relaxation length
//! l: du/dt = v - |rolling speed| u / l. A rolling tyre settles at u = l times its slip, v over the rolling speed: how
//! stiffly it answers does not depend on how fast it rolls. A wheel that stands is a spring and does not creep.
//!
//! Bristles slide from the patch's rear on, where a parabolic pressure lets go of them first. With the stiffness C, the
//! friction m of what slides, and s = |u| C / (3 m l) the force over the load is m (1 - (1 - s)^3), against u; from
//! s = 1 on all slide. What slides, slides by the ground's law of the slip speed. Along and across are alike.
//!
//! Loose ground gives way below the tread. By Janosi and Hanamoto it holds m (1 - exp(-j / K)) where it was sheared by j, and
//! under a wheel that slips by s it is sheared by s times the way into the contact (Wong, Theory of Ground Vehicles, section
//! 2.5): for little slip, m l / (2 K) times the slip over a contact of length l. Bristles and ground are two springs in
//! series, and the tyre is a brush of the stiffness of both; firm ground has K = 0.
//!
//! Source: Pacejka, Tire and Vehicle Dynamics (3rd edition), the brush model of section 3.2 on the single contact point
//! of section 7.2, whose deflection is limited to that of full sliding.

use bicycle::Vehicle;
use nalgebra::Vector2;

use crate::friction::{holding, load_factor};
use crate::{Deviation, Plant, Stribeck};

/// Rolling speed at which the tread's damping has half of its effect [m/s].
const ROLLING_SPEED_MPS: f64 = 0.03;
/// Damping of the standing tread over critical, for a quarter of the vehicle [-].
const DAMPING: f64 = 0.3;
/// Bristles that a tyre of everyday size rolls over at walking speed have settled after this [s].
const SETTLING_S: f64 = 3.0;

/// What the tyre is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tyre {
    relaxation_length_m: f64,
    /// Length of the contact over the root of the load [m/sqrt(N)].
    contact_m_per_root_n: f64,
    load_sensitivity: f64,
    reference_load_n: f64,
    /// Force over load and slip, for little slip [-].
    stiffness: f64,
    /// Damping of the standing tread over load [s/m].
    damping_s_per_m: f64,
    /// Friction over that of the ground's law [-].
    grip: f64,
}

/// Deflection of one tyre's bristles, forward and left, positive along the slip [m].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bristles(Vector2<f64>);

/// How a wheel stands on the ground in this step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footing {
    /// Velocity of the tread over the ground, forward and left [m/s].
    pub slip_mps: Vector2<f64>,
    /// Circumferential speed [m/s].
    pub rolling_mps: f64,
    /// Normal force [N].
    pub load_n: f64,
    /// The ground's friction.
    pub friction: Stribeck,
    /// The ground's shear deformation modulus, zero where it is firm [m].
    pub shear_deformation_m: f64,
}

/// Force of the ground on the tyre.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Grip {
    /// Forward and left [N].
    pub force_n: Vector2<f64>,
    /// Loss of forward force per slip speed within this step [N s/m].
    pub stiffness_ns_per_m: f64,
}

impl Tyre {
    pub(crate) fn new(vehicle: &Vehicle, reference_load_n: f64) -> Self {
        let tyre = &vehicle.tyre;
        let standing_n_per_m = tyre.slip_stiffness * reference_load_n / tyre.relaxation_length_m;
        let quarter_kg = reference_load_n / super::GRAVITY_MPS2;
        let damping_ns_per_m = 2.0 * DAMPING * (standing_n_per_m * quarter_kg).sqrt();
        Self {
            relaxation_length_m: tyre.relaxation_length_m,
            // A disc that is pressed in by load / stiffness touches over 2 sqrt(2 radius load / stiffness).
            contact_m_per_root_n: 2.0
                * (2.0 * vehicle.geometry.wheel_radius_m / tyre.radial_stiffness_n_per_m).sqrt(),
            load_sensitivity: tyre.load_sensitivity,
            reference_load_n,
            stiffness: tyre.slip_stiffness,
            damping_s_per_m: damping_ns_per_m / reference_load_n,
            grip: 1.0,
        }
    }

    /// The same with the rubber and the carcass of wheel `index`.
    pub(crate) fn deviating(mut self, deviations: &[Deviation], index: usize) -> Self {
        for deviation in deviations {
            match *deviation {
                Deviation::TyreGrip { factor } => self.grip *= factor,
                Deviation::TyreStiffness { front, rear } => {
                    self.stiffness *= if index < 2 { front } else { rear };
                }
                Deviation::FlatTyre { wheel, stiffness, .. } if wheel == index => self.stiffness *= stiffness,
                _ => {}
            }
        }
        self
    }

    /// Advances the bristles by a step, implicitly in what rolling carries away, and gives the force.
    pub(crate) fn grip(&self, bristles: &mut Bristles, footing: &Footing, step_s: f64) -> Grip {
        let slip_mps = footing.slip_mps;
        let friction = self.friction(footing, slip_mps.norm());
        let rolling_mps = footing.rolling_mps.abs();
        let kept = 1.0 / (1.0 + step_s * rolling_mps / self.relaxation_length_m);
        let stiffness = self.stiffness_on(footing, friction);
        let sliding_m = 3.0 * friction * self.relaxation_length_m / stiffness;
        bristles.0 = capped((bristles.0 + slip_mps * step_s) * kept, sliding_m);

        // m (1 - (1 - s)^3) over u.
        let s = if sliding_m > 0.0 { bristles.0.norm() / sliding_m } else { 1.0 };
        let per_m = stiffness / self.relaxation_length_m * (1.0 - s + s * s / 3.0);
        let standing = ROLLING_SPEED_MPS / (ROLLING_SPEED_MPS + rolling_mps);
        let damping_s_per_m = standing * self.damping_s_per_m;
        let over_load = capped(bristles.0 * per_m + slip_mps * damping_s_per_m, friction);
        let per_slip = step_s * kept * per_m + damping_s_per_m;
        Grip { force_n: -over_load * footing.load_n, stiffness_ns_per_m: per_slip * footing.load_n }
    }

    /// Stiffness of the bristles in series with the ground's [-].
    fn stiffness_on(&self, footing: &Footing, friction: f64) -> f64 {
        if footing.shear_deformation_m == 0.0 {
            return self.stiffness;
        }
        let contact_m = self.contact_m_per_root_n * footing.load_n.sqrt();
        let ground = friction * contact_m / (2.0 * footing.shear_deformation_m);
        self.stiffness * ground / (self.stiffness + ground)
    }

    /// Friction over load where the tread slides [-].
    fn friction(&self, footing: &Footing, speed_mps: f64) -> f64 {
        let load = footing.load_n / self.reference_load_n;
        self.grip * load_factor(self.load_sensitivity, load) * holding(&footing.friction, speed_mps)
    }
}

fn capped(value: Vector2<f64>, limit: f64) -> Vector2<f64> {
    let norm = value.norm();
    if norm > limit { value * (limit / norm) } else { value }
}

/// Friction over load, forward and left [-], that a tyre under a quarter of a vehicle settles at on a test bench: it rolls
/// at `rolling_mps` and its tread moves over the ground at `slip_mps`, forward and left [m/s].
pub fn steady_friction(
    vehicle: &Vehicle,
    ground: Stribeck,
    rolling_mps: f64,
    slip_mps: [f64; 2],
) -> [f64; 2] {
    let mass_kg = vehicle.body.mass_kg + 4.0 * vehicle.wheel.mass_kg;
    let load_n = 0.25 * mass_kg * super::GRAVITY_MPS2;
    let slip_mps = slip_mps.into();
    let footing = Footing { slip_mps, rolling_mps, load_n, friction: ground, shear_deformation_m: 0.0 };
    settled(&Tyre::new(vehicle, load_n), &footing).into()
}

/// Force over load after as long as bristles take to settle, from loose ones.
fn settled(tyre: &Tyre, footing: &Footing) -> Vector2<f64> {
    let (mut bristles, mut force_n) = (Bristles::default(), Vector2::zeros());
    for _ in 0..(SETTLING_S / Plant::STEP_S).round() as usize {
        force_n = tyre.grip(&mut bristles, footing, Plant::STEP_S).force_n;
    }
    force_n / footing.load_n
}

#[cfg(test)]
mod tests;
