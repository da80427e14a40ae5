//! The parts of the engine on inputs whose answer is known by arithmetic.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod calibration;
mod causes;
mod conditions;
mod constancy;
mod intervals;
mod judgement;
mod left_over;
mod parts;
mod score_test;

use crate::drive::testing::{log, machine};
use crate::drive::{Drive, STEP_S};
use bicycle::{Column, Effect};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The effect with this one parameter.
pub(crate) fn effect(id: &str, value: f64) -> Effect {
    Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap()
}

/// Standard normal numbers of a seed.
pub(crate) fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

/// How a made-up machine differs from the kinematic bicycle of wheelbase 1 m.
#[derive(Clone, Copy)]
pub(crate) struct Made {
    /// Curvature over that of the commanded angle's tangent.
    pub(crate) curvature_ratio: f64,
    /// The same once more to the left.
    pub(crate) left_ratio: f64,
    /// Speed over the commanded one.
    pub(crate) speed_ratio: f64,
}

impl Made {
    /// The kinematic bicycle.
    pub(crate) const RIGHT: Self = Self { curvature_ratio: 1.0, left_ratio: 1.0, speed_ratio: 1.0 };
}

/// Drives of 24 s in arcs of 0.02 s, with noise: speeds and angles that change every second and a half.
pub(crate) fn arcs(made: Made, seed: u64) -> Drive {
    let mut noise = normal(seed);
    let [mut x, mut y, mut yaw] = [0.0_f64; 3];
    let n = (24.0 / STEP_S) as usize;
    let mut rows = Vec::with_capacity(n);
    let (mut asked, mut angle) = (2.0, 0.0);
    for row in 0..n {
        if row % 75 == 0 {
            asked = 2.0 + 0.7 * noise().clamp(-1.5, 1.5);
            angle = (0.12 * noise()).clamp(-0.3, 0.3);
        }
        let speed = made.speed_ratio * asked;
        let side = if angle > 0.0 { made.left_ratio } else { 1.0 };
        let yaw_rate = speed * made.curvature_ratio * side * angle.tan();
        rows.push([
            x + 0.01 * noise(),
            y + 0.01 * noise(),
            yaw + 0.003 * noise(),
            speed + 0.02 * noise(),
            yaw_rate + 0.005 * noise(),
            asked,
            angle,
        ]);
        // An arc: the chord lies half the turn to the side.
        let (turn, way) = (yaw_rate * STEP_S, speed * STEP_S);
        let chord = if turn.abs() < 1e-9 { way } else { way * (0.5 * turn).sin() / (0.5 * turn) };
        x += chord * (yaw + 0.5 * turn).cos();
        y += chord * (yaw + 0.5 * turn).sin();
        yaw += turn;
    }
    let columns =
        [Column::X, Column::Y, Column::Yaw, Column::Vx, Column::Wz, Column::CmdSpeed, Column::CmdSteer];
    let of = |column: Column, t: f64| {
        let place = columns.iter().position(|own| *own == column).unwrap();
        rows[(t / STEP_S).round() as usize][place]
    };
    let log = log(&columns, n, STEP_S, of);
    Drive::of(&log.runs().next().unwrap(), &machine()).unwrap()
}
