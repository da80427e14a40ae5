//! What slip it takes to move on from a pose, by the balance of forces along the heading.

use std::f64::consts::{E, SQRT_2};

use super::stand::{Stand, Statics};
use crate::{Patch, Stribeck};

/// Friction between the body and the ground [-].
const BELLY_FRICTION: f64 = 0.5;
/// How hard the differentials resist wheels of different speed, over the wheels' load [s/m].
const DIFFERENTIAL_S_PER_M: f64 = 0.25;
/// Ground steeper than this lies beside a wheel rather than under it [-].
const SLOPE_MAX: f64 = 4.0;
/// Share of its static load at which the front axle steers in full [-].
const STEERING_LOAD_SHARE: f64 = 0.3;

/// The vehicle at rest and what it stands on.
pub(super) struct Footing<'a> {
    pub stand: &'a Stand,
    /// Ground under each wheel.
    pub patch: [&'a Patch; 4],
}

impl Statics {
    /// Linear and angular traction, each in [0, 1].
    pub(super) fn traction(&self, footing: &Footing) -> [f64; 2] {
        let resistance_n = self.resistance_n(footing);
        if self.thrust_n(footing, 1.0) < resistance_n {
            return [0.0; 2];
        }
        let use_share = self.friction_use(footing, resistance_n);
        let [tread_n, pressed_n] = self.tread_forces_n(footing, use_share);
        let drivetrain = &self.vehicle.drivetrain;
        if tread_n * self.vehicle.geometry.wheel_radius_m > drivetrain.drive_torque_max_nm {
            return [0.0; 2];
        }
        let speed_mps = self.vehicle.limits.speed_max_mps;
        let friction = self.mean_friction(footing);
        let slip_mps = slip_at(&friction, tread_n.max(0.0) / pressed_n.max(f64::MIN_POSITIVE));
        let power_share = (drivetrain.power_max_w / (tread_n * speed_mps).max(f64::MIN_POSITIVE)).min(1.0);
        let linear = (power_share - slip_mps / speed_mps).clamp(0.0, 1.0) * footing.stand.pitch_cosine();
        [linear, linear * self.steering_share(footing, use_share, &friction)]
    }

    /// Horizontal push of the driven wheels, less what it takes to lift all wheels over their ground, when each driven
    /// wheel uses a share of its friction [N].
    ///
    /// A wheel that carries the vertical load F on ground of slope t and pulls with T = tau N pushes forward with
    /// F (tau - t) / (1 + tau t).
    fn thrust_n(&self, footing: &Footing, use_share: f64) -> f64 {
        (0..4)
            .map(|i| {
                let tau = if self.is_driven(i) { use_share * self.adhesion(footing, i) } else { 0.0 };
                let slope = footing.stand.slope[i].clamp(-SLOPE_MAX, SLOPE_MAX);
                footing.stand.load_n[i] * (tau - slope) / (1.0 + tau * slope).max(0.2)
            })
            .sum()
    }

    /// Sum of the driven wheels' tread forces and of the normal forces that carry them [N].
    fn tread_forces_n(&self, footing: &Footing, use_share: f64) -> [f64; 2] {
        (0..4).filter(|&i| self.is_driven(i)).fold([0.0; 2], |[tread_n, pressed_n], i| {
            let tau = use_share * self.adhesion(footing, i);
            let slope = footing.stand.slope[i].clamp(-SLOPE_MAX, SLOPE_MAX);
            let normal_n = footing.stand.load_n[i] * slope.hypot(1.0) / (1.0 + tau * slope).max(0.2);
            [tread_n + tau * normal_n, pressed_n + normal_n]
        })
    }

    /// Share of the friction at which thrust equals resistance, in [-1, 1]; negative downhill.
    fn friction_use(&self, footing: &Footing, resistance_n: f64) -> f64 {
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..10 {
            let middle = 0.5 * (low + high);
            if self.thrust_n(footing, middle) < resistance_n { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Rolling resistance, plants and a dragging belly [N].
    fn resistance_n(&self, footing: &Footing) -> f64 {
        let rolling = self.vehicle.tyre.rolling_resistance;
        let wheels_n: f64 = (0..4)
            .map(|i| {
                let patch = footing.patch[i];
                footing.stand.load_n[i] * (rolling + f64::from(patch.rolling_resistance) + self.plants(patch))
            })
            .sum();
        if footing.stand.belly_n <= 0.0 {
            return wheels_n;
        }
        let slope = footing.stand.belly_slope.clamp(-SLOPE_MAX, SLOPE_MAX);
        let wedge = (1.0 - BELLY_FRICTION * slope).max(0.05);
        wheels_n + footing.stand.belly_n * (BELLY_FRICTION + slope).max(0.0) / wedge
    }

    /// Resistance of plants over a wheel's load [-].
    fn plants(&self, patch: &Patch) -> f64 {
        let geometry = &self.vehicle.geometry;
        let height_m = f64::from(patch.vegetation_height_m);
        let diameter_m = 2.0 * geometry.wheel_radius_m;
        let ratio = height_m / diameter_m;
        0.4 * ratio * ratio + 0.3 * (height_m - geometry.ground_clearance_m).max(0.0) / diameter_m
    }

    /// Largest friction of a wheel under its load [-].
    fn adhesion(&self, footing: &Footing, i: usize) -> f64 {
        let excess = footing.stand.load_n[i] / (0.25 * self.weight_n) - 1.0;
        let factor = (1.0 - self.vehicle.tyre.load_sensitivity * excess).max(0.4);
        factor * f64::from(footing.patch[i].friction.static_friction)
    }

    fn is_driven(&self, i: usize) -> bool {
        let rear = self.vehicle.drivetrain.rear_share;
        if i < 2 { rear < 1.0 } else { rear > 0.0 }
    }

    /// Friction of the driven wheels' ground, weighted by load.
    fn mean_friction(&self, footing: &Footing) -> Stribeck {
        let mut mean = Stribeck {
            static_friction: 0.0,
            dynamic_friction: 0.0,
            viscous_friction: 0.0,
            stribeck_speed_mps: 0.0,
        };
        let driven = || (0..4).filter(|&i| self.is_driven(i));
        let total_n: f64 = driven().map(|i| footing.stand.load_n[i].max(1e-6)).sum();
        for i in driven() {
            let share = (footing.stand.load_n[i].max(1e-6) / total_n) as f32;
            let friction = &footing.patch[i].friction;
            mean.static_friction += share * friction.static_friction;
            mean.dynamic_friction += share * friction.dynamic_friction;
            mean.viscous_friction += share * friction.viscous_friction;
            mean.stribeck_speed_mps += share * friction.stribeck_speed_mps;
        }
        mean
    }

    /// What is left of the steering: grip that neither propulsion nor the cross slope takes, a front axle that is on
    /// the ground, and differentials that want to go straight.
    fn steering_share(&self, footing: &Footing, use_share: f64, friction: &Stribeck) -> f64 {
        let across = footing.stand.left_rise / f64::from(friction.static_friction).max(1e-3);
        let grip = (1.0 - use_share * use_share - across * across).max(0.0).sqrt();
        let front_n = footing.stand.load_n[0] + footing.stand.load_n[1];
        let pressed = (front_n / (STEERING_LOAD_SHARE * self.front_rest_n())).min(1.0);
        let geometry = &self.vehicle.geometry;
        // Slip speed per friction: the tyres yield to the differentials as springs in series.
        let yielding_mps = 1.0 / per_speed(friction, 0.0).max(1e-6);
        let ratio = geometry.track_m / geometry.wheelbase_m;
        let tight = ratio * ratio * yielding_mps / (1.0 / DIFFERENTIAL_S_PER_M + yielding_mps);
        grip * pressed / (1.0 + tight)
    }
}

/// The Stribeck curve over the slip speed, finite at zero slip [s/m].
fn per_speed(curve: &Stribeck, slip_mps: f64) -> f64 {
    let [statics, dynamic, viscous, stribeck_mps] =
        [curve.static_friction, curve.dynamic_friction, curve.viscous_friction, curve.stribeck_speed_mps]
            .map(f64::from);
    let x = slip_mps / stribeck_mps;
    let steepness = 10.0 * SQRT_2;
    let coulomb = if x < 1e-6 { steepness } else { (steepness * x).tanh() / x };
    ((2.0 * E).sqrt() * (statics - dynamic) * (-x * x).exp() + dynamic * coulomb) / stribeck_mps + viscous
}

/// Slip speed at which a friction is reached, on the rising side of the curve [m/s].
fn slip_at(curve: &Stribeck, friction: f64) -> f64 {
    // The curve bends downwards, so the secant's slope falls with slip and the iteration climbs towards the root.
    (0..5).fold(0.0, |slip_mps, _| friction / per_speed(curve, slip_mps))
}
