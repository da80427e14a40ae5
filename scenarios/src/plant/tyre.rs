//! Friction between tyre and ground.
//!
//! A rolling tyre slides by the combined-slip Stribeck curve, reached over its relaxation length. The curve is zero
//! at zero slip, so alone it lets a parked vehicle creep; a tyre that does not roll therefore holds by the elastic
//! shear of its tread (a bristle) up to the static friction of the ground.

use std::f64::consts::{E, SQRT_2};

use bicycle::Vehicle;
use nalgebra::Vector2;

use crate::Stribeck;

/// Rolling speed at which shear and sliding have equal say [m/s].
const ROLLING_SPEED_MPS: f64 = 0.03;
/// Damping of the tread's shear over critical, for a quarter of the vehicle [-].
const SHEAR_DAMPING: f64 = 0.3;
/// Friction keeps at least this share however large the load [-].
const GRIP_MIN: f64 = 0.4;

/// What the tyre is made of, the same for all wheels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tyre {
    relaxation_length_m: f64,
    load_sensitivity: f64,
    reference_load_n: f64,
    /// Shear stiffness over load [1/m].
    shear_per_m: f64,
    /// Shear damping over load [s/m].
    damping_s_per_m: f64,
}

/// Shear of one tyre's tread: friction over load, forward and left, positive along the slip [-].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shear(Vector2<f64>);

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
        // A carcass is about as stiff sideways and along as it is radially.
        let shear_n_per_m = vehicle.tyre.radial_stiffness_n_per_m;
        let damping = 2.0 * SHEAR_DAMPING * (shear_n_per_m * reference_load_n / super::GRAVITY_MPS2).sqrt();
        Self {
            relaxation_length_m: vehicle.tyre.relaxation_length_m,
            load_sensitivity: vehicle.tyre.load_sensitivity,
            reference_load_n,
            shear_per_m: shear_n_per_m / reference_load_n,
            damping_s_per_m: damping / reference_load_n,
        }
    }

    /// Advances the shear by a step and gives the force.
    pub(crate) fn grip(&self, shear: &mut Shear, footing: &Footing, step_s: f64) -> Grip {
        let slip = footing.slip_mps;
        let speed_mps = slip.norm();
        let rolling_mps = footing.rolling_mps.abs();
        let rolling = rolling_mps / (rolling_mps + ROLLING_SPEED_MPS);
        let load_factor = self.load_factor(footing.load_n);
        let curve_s_per_m = load_factor * friction_per_speed(&footing.friction, speed_mps);
        let limit = load_factor * adhesion(&footing.friction, speed_mps);

        let decay_per_s = rolling * rolling_mps / self.relaxation_length_m;
        let shear_per_m = (1.0 - rolling) * self.shear_per_m;
        let growth = slip * (step_s * (shear_per_m + decay_per_s * curve_s_per_m));
        shear.0 = capped((shear.0 + growth) / (1.0 + step_s * decay_per_s), limit);

        let damping_s_per_m = (1.0 - rolling) * self.damping_s_per_m;
        let friction = capped(shear.0 + slip * damping_s_per_m, limit);
        let per_slip = step_s * (shear_per_m + decay_per_s * curve_s_per_m) + damping_s_per_m;
        Grip { force_n: -friction * footing.load_n, stiffness_ns_per_m: per_slip * footing.load_n }
    }

    /// Friction over that at the reference load: one minus `load_sensitivity` at twice that load.
    fn load_factor(&self, load_n: f64) -> f64 {
        let excess = load_n / self.reference_load_n - 1.0;
        (1.0 - self.load_sensitivity * excess).max(GRIP_MIN)
    }
}

fn capped(value: Vector2<f64>, limit: f64) -> Vector2<f64> {
    let norm = value.norm();
    if norm > limit { value * (limit / norm) } else { value }
}

/// The Stribeck curve over the slip speed, finite at zero slip [s/m].
pub(crate) fn friction_per_speed(curve: &Stribeck, speed_mps: f64) -> f64 {
    let statics = f64::from(curve.static_friction);
    let dynamic = f64::from(curve.dynamic_friction);
    let stribeck_mps = f64::from(curve.stribeck_speed_mps);
    let x = speed_mps / stribeck_mps;
    let peak = (2.0 * E).sqrt() * (statics - dynamic) * (-x * x).exp() / stribeck_mps;
    let steepness = 10.0 * SQRT_2;
    let coulomb = if x < 1e-6 {
        dynamic * steepness / stribeck_mps
    } else {
        dynamic * (steepness * x).tanh() / speed_mps
    };
    peak + coulomb + f64::from(curve.viscous_friction)
}

/// The most that the ground holds at a slip speed: static friction up to the curve's peak, then the curve [-].
pub(crate) fn adhesion(curve: &Stribeck, speed_mps: f64) -> f64 {
    let sliding = friction_per_speed(curve, speed_mps) * speed_mps;
    if speed_mps < f64::from(curve.stribeck_speed_mps) / SQRT_2 {
        sliding.max(f64::from(curve.static_friction))
    } else {
        sliding
    }
}
