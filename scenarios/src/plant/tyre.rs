//! Friction between tyre and ground.
//!
//! A rolling tyre slides by the combined-slip Stribeck curve, reached over its relaxation length. The curve is zero
//! at zero slip, so alone it lets a parked vehicle creep; a tyre that does not roll therefore holds by the elastic
//! shear of its tread (a bristle) up to the static friction of the ground.

use std::f64::consts::{E, SQRT_2};

use bicycle::Vehicle;
use nalgebra::Vector2;

use crate::{Deviation, Stribeck};

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
    /// Friction over that of the ground's curve [-].
    grip: f64,
    /// Steepness of the curve at small slip over that of the ground's [-].
    stiffness: f64,
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
            grip: 1.0,
            stiffness: 1.0,
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

    /// The ground's curve under this tyre. Friction over Stribeck speed is the steepness at small slip: both change
    /// together where only the rubber differs.
    fn curve(&self, ground: &Stribeck) -> Stribeck {
        let scaled = ground.scaled(self.grip as f32);
        let stretch = (self.grip / self.stiffness) as f32;
        Stribeck { stribeck_speed_mps: stretch * ground.stribeck_speed_mps, ..scaled }
    }

    /// Advances the shear by a step and gives the force.
    pub(crate) fn grip(&self, shear: &mut Shear, footing: &Footing, step_s: f64) -> Grip {
        let slip = footing.slip_mps;
        let speed_mps = slip.norm();
        let rolling_mps = footing.rolling_mps.abs();
        let rolling = rolling_mps / (rolling_mps + ROLLING_SPEED_MPS);
        let load_factor = self.load_factor(footing.load_n);
        let curve = self.curve(&footing.friction);
        let curve_s_per_m = load_factor * friction_per_speed(&curve, speed_mps);
        let limit = load_factor * adhesion(&curve, speed_mps);

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

#[cfg(test)]
mod tests {
    use super::*;

    const LOAD_N: f64 = 4000.0;

    fn tyre() -> Tyre {
        Tyre {
            relaxation_length_m: 0.3,
            load_sensitivity: 0.2,
            reference_load_n: LOAD_N,
            shear_per_m: 40.0,
            damping_s_per_m: 0.5,
            grip: 1.0,
            stiffness: 1.0,
        }
    }

    /// Friction over load after `duration_s` of steady slip.
    fn friction(slip_mps: Vector2<f64>, rolling_mps: f64, load_n: f64, duration_s: f64) -> Vector2<f64> {
        let footing = Footing { slip_mps, rolling_mps, load_n, friction: Stribeck::ASPHALT };
        let mut shear = Shear::default();
        let mut force_n = Vector2::zeros();
        for _ in 0..(duration_s / 1e-3).round() as usize {
            force_n = tyre().grip(&mut shear, &footing, 1e-3).force_n;
        }
        force_n / load_n
    }

    #[test]
    fn the_curve_peaks_at_the_static_friction_and_ends_at_the_dynamic() {
        let curve = Stribeck::ASPHALT;
        let value = |speed_mps: f64| friction_per_speed(&curve, speed_mps) * speed_mps;
        // vS / sqrt2 = 3.18 m/s: (0.98 - 0.70) + 0.70 tanh(10).
        let peak_mps = 4.5 / SQRT_2;
        assert!((value(peak_mps) - 0.98).abs() < 1e-6);
        assert!(value(0.9 * peak_mps) < 0.98 && value(1.1 * peak_mps) < 0.98);
        assert!((value(20.0) - 0.70).abs() < 1e-6);
        // At zero the limit of mu / v: (sqrt(2e) 0.28 + 10 sqrt2 0.70) / 4.5.
        let limit = ((2.0 * E).sqrt() * 0.28 + 10.0 * SQRT_2 * 0.70) / 4.5;
        assert!((friction_per_speed(&curve, 0.0) - limit).abs() < 1e-6);
        assert!((friction_per_speed(&curve, 1e-4) - limit).abs() < 1e-4);
    }

    #[test]
    fn a_rolling_tyre_slides_by_the_curve_against_its_slip() {
        let slip_mps = Vector2::new(0.6, -0.8);
        let curve = friction_per_speed(&Stribeck::ASPHALT, 1.0);
        let found = friction(slip_mps, 20.0, LOAD_N, 1.0);
        assert!((found + slip_mps * curve).norm() < 0.01, "{found}");
    }

    #[test]
    fn force_builds_up_over_the_relaxation_length() {
        // 10 m/s over 0.3 m: after 0.03 s the force stands at 1 - 1/e of its end.
        let slip_mps = Vector2::new(0.0, 0.2);
        let share = friction(slip_mps, 10.0, LOAD_N, 0.03).y / friction(slip_mps, 10.0, LOAD_N, 1.0).y;
        assert!((share - (1.0 - 1.0 / E)).abs() < 0.02, "{share}");
    }

    #[test]
    fn a_locked_tyre_holds_by_shear_and_slides_at_the_static_friction() {
        // 5 mm of shear at 40 / m: 0.2, and it stays.
        let mut shear = Shear::default();
        let mut footing = Footing {
            slip_mps: Vector2::new(0.05, 0.0),
            rolling_mps: 0.0,
            load_n: LOAD_N,
            friction: Stribeck::ASPHALT,
        };
        for _ in 0..100 {
            tyre().grip(&mut shear, &footing, 1e-3);
        }
        footing.slip_mps = Vector2::zeros();
        for _ in 0..60_000 {
            tyre().grip(&mut shear, &footing, 1e-3);
        }
        let held = tyre().grip(&mut shear, &footing, 1e-3).force_n.x / LOAD_N;
        assert!((held + 0.2).abs() < 1e-9, "{held}");
        let sliding = friction(Vector2::new(0.3, 0.0), 0.0, LOAD_N, 1.0);
        assert!((sliding.x + 0.98).abs() < 1e-6, "{sliding}");
    }

    #[test]
    fn friction_falls_with_load() {
        let slip_mps = Vector2::new(0.0, 3.0);
        let ratio = friction(slip_mps, 20.0, 2.0 * LOAD_N, 1.0).y / friction(slip_mps, 20.0, LOAD_N, 1.0).y;
        assert!((ratio - 0.8).abs() < 1e-3, "{ratio}");
    }

    #[test]
    fn harder_rubber_slides_sooner_and_answers_small_slip_as_before() {
        let hard = tyre().deviating(&[Deviation::TyreGrip { factor: 0.5 }], 0).curve(&Stribeck::ASPHALT);
        let small = friction_per_speed(&hard, 1e-4) / friction_per_speed(&Stribeck::ASPHALT, 1e-4);
        assert!((small - 1.0).abs() < 1e-4, "{small}");
        // The peak of 0.98 at 3.18 m/s is one of 0.49 at half of that.
        let peak_mps = 0.5 * 4.5 / SQRT_2;
        assert!((friction_per_speed(&hard, peak_mps) * peak_mps - 0.49).abs() < 1e-6);
    }

    #[test]
    fn softer_front_tyres_answer_small_slip_less_and_slide_with_the_same_friction() {
        let soft = Deviation::TyreStiffness { front: 0.5, rear: 1.0 };
        let [front, rear] = [0, 2].map(|index| tyre().deviating(&[soft], index).curve(&Stribeck::ASPHALT));
        assert_eq!(rear, Stribeck::ASPHALT);
        let small = friction_per_speed(&front, 1e-4) / friction_per_speed(&rear, 1e-4);
        assert!((small - 0.5).abs() < 1e-4, "{small}");
        let sliding = friction_per_speed(&front, 60.0) * 60.0;
        assert!((sliding - 0.70).abs() < 1e-6, "{sliding}");
    }
}
