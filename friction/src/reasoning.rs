//! From friction to motion: what the ground does to each wheel, what that does to the vehicle, and the next instant.

use std::f64::consts::{E, SQRT_2};

use route::FrictionCurve;

use crate::chassis::{Chassis, GRAVITY_MPS2};
use crate::dual::Dual;

/// Slip below which friction falls off linearly, so that a wheel at rest has a direction [m/s].
const STILL_MPS: f64 = 1e-4;
/// Rolling speed below which a tyre counts as standing [m/s].
const STANDING_MPS: f64 = 0.05;

/// Coefficients of the Stribeck law with their derivatives: static, sliding, viscous [s/m], Stribeck speed [m/s].
#[derive(Clone, Copy, Debug)]
pub struct Coefficients<const N: usize>(pub [Dual<N>; 4]);

impl<const N: usize> Coefficients<N> {
    /// Of a curve that depends on nothing.
    pub fn constant(curve: &FrictionCurve) -> Self {
        let FrictionCurve { static_friction, sliding_friction, viscous_friction, stribeck_speed_mps } =
            *curve;
        let all = [static_friction, sliding_friction, viscous_friction, stribeck_speed_mps];
        Self(all.map(|value| Dual::constant(f64::from(value))))
    }

    /// Friction at a speed of sliding [-] (AnyNav, equation 1 with the factor sqrt(2e), as [`FrictionCurve::at`]).
    pub fn at(&self, sliding_mps: Dual<N>) -> Dual<N> {
        let [statics, sliding, viscous, speed_mps] = self.0;
        let x = sliding_mps / speed_mps;
        let rise = (statics - sliding) * (2.0 * E).sqrt();
        rise * x * (-(x * x)).exp() + sliding * (x * (10.0 * SQRT_2)).tanh() + viscous * sliding_mps
    }
}

/// How the vehicle moves in the plane of the ground: the centre of mass ahead and left [m/s], turning left [rad/s].
pub type Velocity<const N: usize> = [Dual<N>; 3];

/// What drives a wheel.
#[derive(Clone, Copy, Debug)]
pub struct WheelInput<const N: usize> {
    /// Circumferential speed [m/s].
    pub edge_mps: Dual<N>,
    /// Angle, left positive [rad].
    pub steering_rad: Dual<N>,
    /// Force over load and slip for little slip; infinite for a tyre that follows the law alone [-].
    pub slip_stiffness: Dual<N>,
    /// Friction over that of the ground's law [-].
    pub grip: Dual<N>,
    /// Normal force [N].
    pub load_n: Dual<N>,
}

/// Velocity of a wheel's contact along and across the wheel [m/s] (equation 10).
pub(crate) fn contact_mps<const N: usize>(
    velocity: &Velocity<N>,
    at_m: [f64; 2],
    steering_rad: Dual<N>,
) -> [Dual<N>; 2] {
    let [ahead_mps, left_mps, yaw_radps] = *velocity;
    let (x_mps, y_mps) = (ahead_mps - yaw_radps * at_m[1], left_mps + yaw_radps * at_m[0]);
    let (sin, cos) = steering_rad.sin_cos();
    [x_mps * cos + y_mps * sin, y_mps * cos - x_mps * sin]
}

/// How a tyre is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TyreUse {
    /// 0 sticks, 1 is where the tyre's stiffness alone would reach the ground's friction [-].
    pub share: f64,
    /// Speed of sliding [m/s].
    pub sliding_mps: f64,
}

/// Force of the ground on a wheel ahead and left of the body [N], and how its tyre is used.
///
/// Equations 9, 12 and 13 with the sign that drives: mu N along the edge's velocity over the ground. A rolling tyre
/// sticks first: its friction is mu tanh(C s / mu), s being the sliding over the rolling speed and C the slip stiffness.
/// Where C is infinite, or the wheel stands, that is the paper's law.
pub fn wheel_force<const N: usize>(
    velocity: &Velocity<N>,
    at_m: [f64; 2],
    wheel: &WheelInput<N>,
    ground: &Coefficients<N>,
) -> ([Dual<N>; 2], TyreUse) {
    let [along_mps, across_mps] = contact_mps(velocity, at_m, wheel.steering_rad);
    let slip_mps = [wheel.edge_mps - along_mps, -across_mps];
    let still = Dual::from(STILL_MPS * STILL_MPS);
    let sliding_mps = (slip_mps[0] * slip_mps[0] + slip_mps[1] * slip_mps[1] + still).sqrt();
    let standing = Dual::from(STANDING_MPS * STANDING_MPS);
    let rolling_mps = (wheel.edge_mps * wheel.edge_mps + standing).sqrt();
    let limit = ground.at(sliding_mps) * wheel.grip;
    let (used, friction) = if wheel.slip_stiffness.value.is_finite() {
        let used = wheel.slip_stiffness * sliding_mps / (rolling_mps * limit);
        (used, limit * used.tanh())
    } else {
        (Dual::from(f64::INFINITY), limit)
    };
    let per_slip = friction * wheel.load_n / sliding_mps;
    let (sin, cos) = wheel.steering_rad.sin_cos();
    let [along_n, across_n] = slip_mps.map(|slip| slip * per_slip);
    (
        [along_n * cos - across_n * sin, along_n * sin + across_n * cos],
        TyreUse { share: used.value, sliding_mps: sliding_mps.value },
    )
}

/// What all wheels do: specific force ahead and left [m/s2], angular acceleration [rad/s2], use of front and rear tyres.
#[derive(Clone, Copy, Debug)]
pub struct Push<const N: usize> {
    /// Friction over mass, ahead and left [m/s2].
    pub specific_mps2: [Dual<N>; 2],
    /// Moment about the vertical [N m].
    pub moment_nm: Dual<N>,
    /// Use of each wheel's tyre, see [`wheel_force`].
    pub use_of_tyre: [TyreUse; 4],
}

/// Sum of the wheels' friction (equations 14 to 17, in the plane of the ground).
pub fn push<const N: usize>(
    chassis: &Chassis,
    velocity: &Velocity<N>,
    wheels: &[WheelInput<N>; 4],
    grounds: &[Coefficients<N>; 4],
) -> Push<N> {
    let zero = Dual::from(0.0);
    let mut sum = Push { specific_mps2: [zero; 2], moment_nm: zero, use_of_tyre: [TyreUse::default(); 4] };
    for (index, at_m) in chassis.contacts_m().into_iter().enumerate() {
        let (force_n, used) = wheel_force(velocity, at_m, &wheels[index], &grounds[index]);
        for (sum, force_n) in sum.specific_mps2.iter_mut().zip(force_n) {
            *sum = *sum + force_n * (1.0 / chassis.mass_kg);
        }
        sum.moment_nm = sum.moment_nm + force_n[1] * at_m[0] - force_n[0] * at_m[1];
        sum.use_of_tyre[index] = used;
    }
    sum
}

/// Where a vehicle is and how it moves, on a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Centre of mass along the plane's axes [m].
    pub at_m: [f64; 2],
    /// Heading from the plane's first axis to its second [rad].
    pub heading_rad: f64,
    /// Ahead, left [m/s] and turning left [rad/s].
    pub velocity: [f64; 3],
    /// Friction over mass in the last step, ahead and left [m/s2]: moves the weight in the next one.
    pub specific_mps2: [f64; 2],
}

impl State {
    /// Numbers in a state.
    pub const LEN: usize = 8;

    /// East, north [m], heading [rad], ahead, left [m/s], turning [rad/s], friction over mass ahead and left [m/s2].
    pub fn values<const N: usize>(&self) -> [Dual<N>; Self::LEN] {
        let ([x_m, y_m], [ahead, left, yaw], [felt_x, felt_y]) =
            (self.at_m, self.velocity, self.specific_mps2);
        [x_m, y_m, self.heading_rad, ahead, left, yaw, felt_x, felt_y].map(Dual::from)
    }

    /// From the same numbers.
    pub fn of_values<const N: usize>(values: &[Dual<N>; Self::LEN]) -> Self {
        let [x_m, y_m, heading_rad, ahead, left, yaw, felt_x, felt_y] = values.map(|dual| dual.value);
        Self { at_m: [x_m, y_m], heading_rad, velocity: [ahead, left, yaw], specific_mps2: [felt_x, felt_y] }
    }
}

/// Ground under a vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Surface<const N: usize> {
    /// Under each wheel.
    pub friction: [Coefficients<N>; 4],
    /// Pull of gravity along the map's axes [m/s2].
    pub pull_mps2: [f64; 2],
    /// Gravity across the ground [m/s2].
    pub across_mps2: f64,
}

/// What the wheels do during a step.
#[derive(Clone, Copy, Debug)]
pub struct Controls {
    /// Circumferential speed of each wheel [m/s].
    pub edge_mps: [f64; 4],
    /// Angle of the front wheels, left positive [rad].
    pub steering_rad: f64,
}

/// A plane of one ground, steepest along its first axis.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Its friction.
    pub friction: FrictionCurve,
    /// Rise along its first axis [rad].
    pub slope_rad: f64,
}

impl Chassis {
    /// The next instant, by the semi-implicit Euler method (equations 19 to 22): velocities first, places with the new
    /// ones.
    pub fn step(&self, state: &State, controls: &Controls, plane: &Plane, step_s: f64) -> State {
        let (sin_slope, cos_slope) = plane.slope_rad.sin_cos();
        let pull_mps2 = [-GRAVITY_MPS2 * sin_slope, 0.0];
        let ground = Surface {
            friction: [Coefficients::constant(&plane.friction); 4],
            pull_mps2,
            across_mps2: GRAVITY_MPS2 * cos_slope,
        };
        State::of_values(&self.advance::<0>(&state.values(), controls, &ground, step_s))
    }

    /// The same of a state with derivatives, in the order of [`State::values`], over ground that differs from wheel to wheel.
    pub fn advance<const N: usize>(
        &self,
        state: &[Dual<N>; State::LEN],
        controls: &Controls,
        ground: &Surface<N>,
        step_s: f64,
    ) -> [Dual<N>; State::LEN] {
        let [x_m, y_m, heading, ahead_mps, left_mps, yaw_radps, felt_x, felt_y] = *state;
        let wheels = self.wheels([felt_x, felt_y], controls, ground.across_mps2);
        let pushed = push(self, &[ahead_mps, left_mps, yaw_radps], &wheels, &ground.friction);
        let (sin, cos) = heading.sin_cos();
        let [east_mps2, north_mps2] = ground.pull_mps2;
        // The body turns under its velocity; gravity pulls down the plane.
        let specific = pushed.specific_mps2;
        let change = [
            specific[0] + cos * east_mps2 + sin * north_mps2 + left_mps * yaw_radps,
            specific[1] + cos * north_mps2 - sin * east_mps2 - ahead_mps * yaw_radps,
            pushed.moment_nm * (1.0 / self.yaw_inertia_kgm2),
        ];
        let ahead_mps = ahead_mps + change[0] * step_s;
        let left_mps = left_mps + change[1] * step_s;
        let yaw_radps = yaw_radps + change[2] * step_s;
        [
            x_m + (ahead_mps * cos - left_mps * sin) * step_s,
            y_m + (ahead_mps * sin + left_mps * cos) * step_s,
            heading + yaw_radps * step_s,
            ahead_mps,
            left_mps,
            yaw_radps,
            specific[0],
            specific[1],
        ]
    }

    fn wheels<const N: usize>(
        &self,
        specific_mps2: [Dual<N>; 2],
        controls: &Controls,
        across_mps2: f64,
    ) -> [WheelInput<N>; 4] {
        let loads_n = self.loads(specific_mps2, across_mps2);
        std::array::from_fn(|index| WheelInput {
            edge_mps: controls.edge_mps[index].into(),
            steering_rad: if index < 2 { controls.steering_rad.into() } else { 0.0.into() },
            slip_stiffness: self.slip_stiffness[index / 2].into(),
            grip: self.load_factor(loads_n[index]),
            load_n: loads_n[index],
        })
    }
}
