//! What slip it takes to move on from a pose, by the balance of forces along the heading.

use bicycle::{Differential, Vehicle};

use super::stand::{Stand, Statics};
use crate::Patch;
use crate::friction::{brush_friction, load_factor};
use crate::plant::LIMITED_SLIP_S_PER_M;

/// Friction between the body and the ground [-].
const BELLY_FRICTION: f64 = 0.5;
/// Ground steeper than this lies beside a wheel rather than under it [-].
const SLOPE_MAX: f64 = 4.0;
/// Passes after which the wheels' slip has settled to a thousandth on all but spinning wheels.
const SLIP_PASSES: usize = 8;
/// Share of its static load at which the front axle steers in full [-].
const STEERING_LOAD_SHARE: f64 = 0.3;

/// The vehicle at rest and what it stands on.
pub(super) struct Footing<'a> {
    pub stand: &'a Stand,
    /// Rise of the ground across the heading, weighted by the wheels' loads [-].
    pub left_slope: f64,
    /// Ground under each wheel.
    pub patch: [&'a Patch; 4],
}

impl Statics {
    /// Linear and angular traction, each in [0, 1].
    pub(super) fn traction(&self, footing: &Footing) -> [f64; 2] {
        let resistance_n = self.resistance_n(footing);
        if !self.holds_across(footing) || self.thrust_n(footing, 1.0) < resistance_n {
            return [0.0; 2];
        }
        let use_share = self.friction_use(footing, resistance_n);
        let tread_n = self.tread_n(footing, use_share);
        let drivetrain = &self.vehicle.drivetrain;
        if tread_n * self.vehicle.geometry.wheel_radius_m > drivetrain.drive_torque_max_nm {
            return [0.0; 2];
        }
        let speed_mps = self.vehicle.limits.speed_max_mps;
        let power_share = (drivetrain.power_max_w / (tread_n * speed_mps).max(f64::MIN_POSITIVE)).min(1.0);
        let slip = if use_share > 0.0 { self.slip(footing, use_share, tread_n) } else { 0.0 };
        let linear = (power_share * (1.0 - slip)).clamp(0.0, 1.0) * self.level_share(footing.stand);
        [linear, linear * self.steering_share(footing, use_share)]
    }

    /// Level way of the vehicle over the way that its driven wheels roll in the mean, up and down their ground; the
    /// speed controller holds their mean speed [-].
    fn level_share(&self, stand: &Stand) -> f64 {
        let driven = || (0..4).filter(|&i| self.is_driven(i));
        let rolled: f64 = driven().map(|i| stand.slope[i].clamp(-SLOPE_MAX, SLOPE_MAX).hypot(1.0)).sum();
        driven().count() as f64 / rolled
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

    /// Sum of the driven wheels' tread forces [N].
    fn tread_n(&self, footing: &Footing, use_share: f64) -> f64 {
        let driven = (0..4).filter(|&i| self.is_driven(i));
        driven.map(|i| use_share * self.adhesion(footing, i) * self.normal_n(footing, use_share, i)).sum()
    }

    /// Normal force that carries a wheel's load while it uses a share of its friction [N].
    fn normal_n(&self, footing: &Footing, use_share: f64, i: usize) -> f64 {
        let tau = if self.is_driven(i) { use_share * self.adhesion(footing, i) } else { 0.0 };
        let slope = footing.stand.slope[i].clamp(-SLOPE_MAX, SLOPE_MAX);
        footing.stand.load_n[i] * slope.hypot(1.0) / (1.0 + tau * slope).max(0.2)
    }

    /// By how much the vehicle falls behind the mean speed of its driven wheels, over that speed, when they pull with
    /// `tread_n` together, in [0, 1].
    ///
    /// The motor turns all n of them with the same torque, and the differentials carry some from the faster to the
    /// slower: a wheel that runs ahead of the ground by y holds f(y) = tread / n + (x - y) / slack, where x is the mean
    /// of all y, f the brush's force and the slack the wheels' difference of speed per force. Solved by the secants
    /// f(y) / y: light wheels slip more, and spin where the differentials let them.
    fn slip(&self, footing: &Footing, use_share: f64, tread_n: f64) -> f64 {
        let speed_mps = self.vehicle.limits.speed_max_mps;
        let stiffness = self.vehicle.tyre.slip_stiffness;
        let slack = self.slack_mps_per_n();
        let driven: [bool; 4] = std::array::from_fn(|i| self.is_driven(i));
        let wheels = || (0..4).filter(|&i| driven[i]);
        let n = wheels().count() as f64;
        let held: [f64; 4] = std::array::from_fn(|i| self.adhesion(footing, i).max(f64::MIN_POSITIVE));
        let normal_n: [f64; 4] = std::array::from_fn(|i| self.normal_n(footing, use_share, i).max(1e-6));
        let (mut mean_mps, mut slip_mps) = (0.0, [1e-6 * speed_mps; 4]);
        for _ in 0..SLIP_PASSES {
            let secant: [f64; 4] = std::array::from_fn(|i| {
                normal_n[i] * brush_friction(held[i], stiffness, slip_mps[i] / speed_mps) / slip_mps[i]
            });
            let yielding = |i: usize| 1.0 / (1.0 + secant[i] * slack);
            let pulled: f64 = wheels().map(|i| secant[i] * yielding(i)).sum();
            mean_mps = tread_n / n * wheels().map(yielding).sum::<f64>() / pulled;
            for i in wheels() {
                slip_mps[i] = ((tread_n / n * slack + mean_mps) * yielding(i)).min(speed_mps);
            }
        }
        (mean_mps / speed_mps).min(1.0)
    }

    /// Difference of speed between wheels that the differentials answer with a force at one of them [m/s/N].
    fn slack_mps_per_n(&self) -> f64 {
        let limited = 1.0 / (LIMITED_SLIP_S_PER_M * 0.25 * self.weight_n);
        match self.vehicle.drivetrain.differential {
            // Large against all tyres, and a number.
            Differential::Open => 1e6 * limited,
            Differential::LimitedSlip => limited,
            Differential::Locked => 0.0,
        }
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
    fn friction(&self, footing: &Footing, i: usize) -> f64 {
        let load = footing.stand.load_n[i] / (0.25 * self.weight_n);
        let factor = load_factor(self.vehicle.tyre.load_sensitivity, load);
        factor * f64::from(footing.patch[i].friction.static_friction)
    }

    /// What of it is left along the wheel: a circle, of which each takes as much across as the slope asks of all [-].
    fn adhesion(&self, footing: &Footing, i: usize) -> f64 {
        let friction = self.friction(footing, i);
        (friction * friction - footing.left_slope.powi(2)).max(0.0).sqrt()
    }

    /// Whether the wheels hold the vehicle on the slope across its heading; else it goes down that, wherever it steers.
    fn holds_across(&self, footing: &Footing) -> bool {
        let load_n = footing.stand.load_n;
        let held_n: f64 = (0..4).map(|i| self.friction(footing, i) * load_n[i]).sum();
        held_n > footing.left_slope.abs() * load_n.iter().sum::<f64>()
    }

    fn is_driven(&self, i: usize) -> bool {
        let rear = self.vehicle.drivetrain.rear_share;
        if i < 2 { rear < 1.0 } else { rear > 0.0 }
    }

    /// Friction of the driven wheels' ground, weighted by load [-], and the share of the load that they carry.
    fn driven(&self, footing: &Footing) -> [f64; 2] {
        let load_n = footing.stand.load_n.map(|load_n| load_n.max(1e-6));
        let driven = || (0..4).filter(|&i| self.is_driven(i));
        let driven_n: f64 = driven().map(|i| load_n[i]).sum();
        let held_n: f64 =
            driven().map(|i| load_n[i] * f64::from(footing.patch[i].friction.static_friction)).sum();
        [held_n / driven_n, driven_n / load_n.iter().sum::<f64>()]
    }

    /// What is left of the steering: grip that neither propulsion nor the cross slope takes, a front axle that is on
    /// the ground, and differentials that want to go straight.
    fn steering_share(&self, footing: &Footing, use_share: f64) -> f64 {
        let [friction, driven_share] = self.driven(footing);
        let across = footing.left_slope / friction.max(1e-3);
        // A share of what the cross slope leaves.
        let grip = ((1.0 - use_share * use_share) * (1.0 - across * across).max(0.0)).sqrt();
        let front_n = footing.stand.load_n[0] + footing.stand.load_n[1];
        let pressed = (front_n / (STEERING_LOAD_SHARE * self.front_rest_n())).min(1.0);
        grip * pressed / (1.0 + driven_share * self.tightness())
    }

    /// By how much differentials between all wheels lengthen the turn [-]. Tyres and differentials yield to the wheels'
    /// difference of speed in series; the moment of what is left takes slip angles of the axles to hold, of the tyres'
    /// same stiffness: with locked wheels (track / wheelbase)^2 remains of it.
    fn tightness(&self) -> f64 {
        let Vehicle { geometry, limits, tyre, drivetrain, .. } = &self.vehicle;
        let ratio = geometry.track_m / geometry.wheelbase_m;
        // Slip speed per friction.
        let tyres_mps = limits.speed_max_mps / tyre.slip_stiffness;
        let differential_mps = match drivetrain.differential {
            Differential::Open => return 0.0,
            Differential::LimitedSlip => 1.0 / LIMITED_SLIP_S_PER_M,
            Differential::Locked => 0.0,
        };
        ratio * ratio * tyres_mps / (differential_mps + tyres_mps)
    }
}
