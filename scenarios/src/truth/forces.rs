//! What wheels do to the body, and the sum of all that acts on it.

use bicycle::Axle;
use nalgebra::{Matrix3, Vector3};

/// Stiffness of the travel stops over that of the spring [-].
const STOP_RATIO: f64 = 10.0;
/// A lifted wheel keeps this share of its stiffness, so that the balance stays solvable [-].
const LIFTED_SHARE: f64 = 1e-3;

/// Force of one wheel over the height of the ground at its hub: straight pieces with kinks at the travel's ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct WheelSpring {
    pub rest_n: f64,
    pub stiffness_n_per_m: f64,
    /// Rise at which the travel ends [m], and the stiffness beyond.
    stop_m: f64,
    stop_n_per_m: f64,
}

/// Sums over all contacts and gravity.
#[derive(Clone, Copy)]
pub(super) struct Forces {
    /// Upward force [N], its moments over the distance ahead and to the left [N m].
    pub balance: Vector3<f64>,
    /// Derivative of the balance by heave, pitch sine and left rise.
    pub stiffness: Matrix3<f64>,
    /// Load of each wheel [N].
    pub load_n: [f64; 4],
    /// Load on the belly [N].
    pub belly_n: f64,
}

impl Forces {
    /// Adds an upward force at a point of the body that stiffens with depth.
    #[inline]
    pub fn push(&mut self, [ahead_m, left_m]: [f64; 2], force_n: f64, n_per_m: f64) {
        let arm = Vector3::new(1.0, ahead_m, left_m);
        self.balance += arm * force_n;
        self.stiffness += arm * Vector3::new(-1.0, ahead_m, -left_m).transpose() * n_per_m;
    }

    /// How far from equilibrium, over the weight; moments count by `arm_m` [-].
    pub fn excess(&self, weight_n: f64, arm_m: f64) -> f64 {
        let scaled = Vector3::new(self.balance.x, self.balance.y / arm_m, self.balance.z / arm_m);
        scaled.norm() / weight_n
    }
}

impl WheelSpring {
    pub fn new(axle: &Axle, tyre_n_per_m: f64, rest_n: f64) -> Self {
        let strut = &axle.suspension;
        let in_series = |strut_n_per_m: f64| strut_n_per_m * tyre_n_per_m / (strut_n_per_m + tyre_n_per_m);
        Self {
            rest_n,
            stiffness_n_per_m: in_series(strut.stiffness_n_per_m),
            stop_m: strut.travel_m * (1.0 + strut.stiffness_n_per_m / tyre_n_per_m),
            stop_n_per_m: in_series((1.0 + STOP_RATIO) * strut.stiffness_n_per_m),
        }
    }

    /// Force and stiffness when the ground is `rise_m` higher than at rest.
    #[inline]
    pub fn at(&self, rise_m: f64) -> [f64; 2] {
        let beyond_m = (rise_m - self.stop_m).max(0.0);
        let force_n =
            self.rest_n + self.stiffness_n_per_m * (rise_m - beyond_m) + self.stop_n_per_m * beyond_m;
        if force_n <= 0.0 {
            return [0.0, LIFTED_SHARE * self.stiffness_n_per_m];
        }
        [force_n, if beyond_m > 0.0 { self.stop_n_per_m } else { self.stiffness_n_per_m }]
    }
}
