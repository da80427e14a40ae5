//! Plants that a wheel presses down and a bumper pushes through.

use bicycle::Vehicle;
use nalgebra::Vector2;

use super::ground::Ground;

/// Resistance over load for plants as tall as the wheel [-].
const WHEEL_RESISTANCE: f64 = 0.4;
/// Resistance over load for plants that reach a wheel's diameter up the bumper [-].
const BUMPER_RESISTANCE: f64 = 0.3;
/// How far stems bend before they give way, over the wheel's diameter [-].
const BENDING_SHARE: f64 = 0.1;

/// Bending of the stems before one wheel, east and north [m]: they push back before they give way, so that a
/// vehicle stuck in a bush stays stuck.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stems(Vector2<f64>);

/// How deep a wheel stands in plants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Immersion {
    /// Height of the plants above the foot of the wheel [m].
    pub height_m: f64,
    /// Diameter of the wheel [m].
    pub diameter_m: f64,
    /// From the ground to the belly [m].
    pub clearance_m: f64,
    /// Stems over those of plants of that height [-].
    pub density: f64,
}

impl Immersion {
    /// Horizontal resistance over the wheel's load [-].
    pub(crate) fn resistance(&self) -> f64 {
        let ratio = self.height_m / self.diameter_m;
        let above_belly = (self.height_m - self.clearance_m).max(0.0) / self.diameter_m;
        self.density * (WHEEL_RESISTANCE * ratio * ratio + BUMPER_RESISTANCE * above_belly)
    }
}

/// How far the plants at a wheel's leading edge reach above its foot, at most as far as they are tall [m].
pub(crate) fn plants_above_m(ground: &Ground, edge_m: Vector2<f64>, foot_m: f64) -> f64 {
    let plants_m = f64::from(ground.patch(edge_m.x, edge_m.y).vegetation_height_m);
    if plants_m > 0.0 {
        let above_m = ground.height_m(edge_m.x, edge_m.y) + plants_m - foot_m;
        above_m.clamp(0.0, plants_m)
    } else {
        0.0
    }
}

/// Resistance over the vehicle's weight in plants of a height on even ground [-].
pub(crate) fn vegetation_resistance(vehicle: &Vehicle, height_m: f64) -> f64 {
    let diameter_m = 2.0 * vehicle.geometry.wheel_radius_m;
    let clearance_m = vehicle.geometry.ground_clearance_m;
    Immersion { height_m, diameter_m, clearance_m, density: 1.0 }.resistance()
}

impl Stems {
    /// Bends the stems by a step of motion and gives their force on the wheel, east and north [N].
    pub(crate) fn push_n(
        &mut self,
        immersion: &Immersion,
        velocity_mps: Vector2<f64>,
        load_n: f64,
        step_s: f64,
    ) -> Vector2<f64> {
        if immersion.height_m <= 0.0 {
            self.0 = Vector2::zeros();
            return Vector2::zeros();
        }
        let bending_m = BENDING_SHARE * immersion.diameter_m;
        let decay = step_s * velocity_mps.norm() / bending_m;
        self.0 = (self.0 + velocity_mps * step_s) / (1.0 + decay);
        -self.0 * (immersion.resistance() * load_n / bending_m)
    }
}
