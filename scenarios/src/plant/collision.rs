//! What obstacles do to the vehicle.

use nalgebra::{Vector2, Vector3};

use super::chassis::Chassis;
use super::ground::Ground;
use super::wheel::{RunningGear, Wheel};

/// What obstacles did to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// When it first touched one, since the start [s].
    pub time_s: f64,
    /// Where its rear axle's centre was then, in the map [m].
    pub at_m: [f64; 2],
    /// Level momentum that the obstacle has taken from it by wheels and body, until the vehicle stood, came back or
    /// parted from it [N s].
    pub impulse_ns: f64,
}

/// The first touch of an obstacle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Collisions {
    first: Option<Collision>,
    impulse_ns: Vector2<f64>,
    /// Whether the first touch has passed.
    is_over: bool,
}

impl Collisions {
    /// Counts what obstacles did in a step that ended at a time.
    pub(super) fn count(
        &mut self,
        (gear, wheels): (&[RunningGear; 4], &[Wheel; 4]),
        (chassis, ground): (&Chassis, &Ground),
        (time_s, step_s): (f64, f64),
    ) {
        if self.is_over || !ground.has_obstacles() {
            return;
        }
        let on_wheels = gear.iter().zip(wheels).map(|(gear, wheel)| gear.obstacle_force_n(wheel, ground));
        let impulse_ns =
            chassis.obstacle_impulse_ns(ground).xy() + on_wheels.sum::<Vector3<f64>>().xy() * step_s;
        let motion = chassis.motion();
        let is_against = impulse_ns.dot(&motion.linear_mps.xy()) < 0.0;
        if self.first.is_some() && !is_against {
            self.is_over = true;
        } else if impulse_ns != Vector2::zeros() {
            self.impulse_ns += impulse_ns;
            let at_m = motion.origin_m.xy().into();
            let first = Collision { time_s, at_m, impulse_ns: 0.0 };
            self.first.get_or_insert(first).impulse_ns = self.impulse_ns.norm();
        }
    }

    pub(super) fn first(&self) -> Option<Collision> {
        self.first
    }
}
