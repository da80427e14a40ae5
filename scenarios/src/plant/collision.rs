//! What obstacles do to the vehicle.

use nalgebra::Vector2;

/// What obstacles did to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// When it first touched one, since the start [s].
    pub time_s: f64,
    /// Where its rear axle's centre was then, in the map [m].
    pub at_m: [f64; 2],
    /// Level momentum that obstacles have taken from it by wheels and body, until it stood or came back [N s].
    pub impulse_ns: f64,
}

/// The first touch of an obstacle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Collisions {
    first: Option<Collision>,
    impulse_ns: Vector2<f64>,
    /// Level velocity before the last step [m/s].
    velocity_mps: Vector2<f64>,
    /// The same before the first touch [m/s].
    approach_mps: Vector2<f64>,
}

impl Collisions {
    /// Counts the impulse of obstacles in a step that ended at a time, with this level velocity of the centre of gravity
    /// [m/s] and place of the rear axle's centre [m].
    pub(super) fn count(
        &mut self,
        velocity_mps: Vector2<f64>,
        at_m: [f64; 2],
        time_s: f64,
        impulse_ns: impl FnOnce() -> Vector2<f64>,
    ) {
        // A hard body is stopped and thrown back within one step: what counts is how it came.
        let before_mps = std::mem::replace(&mut self.velocity_mps, velocity_mps);
        if self.first.is_some() && before_mps.dot(&self.approach_mps) <= 0.0 {
            self.approach_mps = Vector2::zeros();
            return;
        }
        let impulse_ns = impulse_ns();
        if impulse_ns != Vector2::zeros() {
            if self.first.is_none() {
                self.approach_mps = before_mps;
            }
            self.impulse_ns += impulse_ns;
            let first = Collision { time_s, at_m, impulse_ns: 0.0 };
            self.first.get_or_insert(first).impulse_ns = self.impulse_ns.norm();
        }
    }

    pub(super) fn first(&self) -> Option<Collision> {
        self.first
    }
}
