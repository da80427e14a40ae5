//! A cart of one axle on a drawbar. It rolls along its own heading without slipping sideways; drawbar and coupling are
//! a stiff, well damped spring. Its weight rests on its own axle.

use nalgebra::{Vector2, Vector3};

use super::GRAVITY_MPS2;
use super::chassis::BodyMotion;
use super::ground::Ground;

/// Natural frequency of the coupling with the cart on it [rad/s].
const COUPLING_RADPS: f64 = 40.0;
/// Speed over which rolling resistance changes its sign [m/s].
const REST_MPS: f64 = 0.02;

/// The cart.
#[derive(Clone, Debug)]
pub(crate) struct Trailer {
    mass_kg: f64,
    drawbar_m: f64,
    resistance: f64,
    /// Middle of its axle on the map [m], and its speed; none before the first step.
    axle: Option<(Vector2<f64>, f64)>,
}

impl Trailer {
    pub(crate) fn new(mass_kg: f64, drawbar_m: f64, resistance: f64) -> Self {
        Self { mass_kg, drawbar_m, resistance, axle: None }
    }

    /// Rolls for a step behind the body's origin and gives the force on the body there [N].
    pub(crate) fn pull_n(&mut self, body: &BodyMotion, ground: &Ground, step_s: f64) -> Vector3<f64> {
        let hitch_m = body.origin_m.xy();
        let hitch_mps = body.velocity_at_mps(&body.origin_m).xy();
        let behind = || (hitch_m - body.axes[0].xy().normalize() * self.drawbar_m, 0.0);
        let (mut axle_m, mut speed_mps) = self.axle.unwrap_or_else(behind);
        let bar_m = hitch_m - axle_m;
        let heading = bar_m.normalize();
        let stretch_m = bar_m.norm() - self.drawbar_m;
        let stretch_mps = hitch_mps.dot(&heading) - speed_mps;
        let stiffness_n_per_m = self.mass_kg * COUPLING_RADPS * COUPLING_RADPS;
        let damping_ns_per_m = 2.0 * self.mass_kg * COUPLING_RADPS;
        let tension_n = stiffness_n_per_m * stretch_m + damping_ns_per_m * stretch_mps;

        let ahead_m = axle_m + heading * (0.5 * self.drawbar_m);
        let rise_m = ground.height_m(ahead_m.x, ahead_m.y) - ground.height_m(axle_m.x, axle_m.y);
        let sine = rise_m / rise_m.hypot(0.5 * self.drawbar_m);
        let weight_n = self.mass_kg * GRAVITY_MPS2;
        let rolling_n = self.resistance * weight_n * (speed_mps / REST_MPS).tanh();
        speed_mps += step_s * (tension_n - rolling_n - weight_n * sine) / self.mass_kg;
        axle_m += heading * (speed_mps * step_s);
        self.axle = Some((axle_m, speed_mps));
        Vector3::new(-heading.x * tension_n, -heading.y * tension_n, 0.0)
    }
}
