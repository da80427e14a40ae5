//! What the wheels of a smoothed instant do, as a function of all that is sought.

use route::FrictionCurve;

use crate::chassis::{Chassis, GRAVITY_MPS2};
use crate::dual::Dual;
use crate::least_squares::Belief;
use crate::reasoning::{Coefficients, Push, TyreUse, Velocity, WheelInput, contact_mps, push};
use crate::samples::Sample;

/// Sought once: logarithms of the stiffness of front and rear tyres and of the inertia over their descriptions, scale of the
/// wheel speed, trim [rad] and scale of the steering, direction of the velocity sensor [rad].
pub(crate) const OF_VEHICLE: usize = 7;
/// Sought for each run: bias of the inertial unit ahead and left [m/s2].
pub(crate) const OF_RUN: usize = 2;
/// Sought for each class: logarithms of static friction, of sliding over static friction and of the Stribeck speed, and
/// resistance over weight [-].
pub(crate) const OF_CLASS: usize = 4;
/// Sought by one sample.
pub(crate) const LOCAL: usize = OF_VEHICLE + OF_RUN + OF_CLASS;

/// Where the parameters of runs and classes stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub n_runs: usize,
    pub n_classes: usize,
}

impl Layout {
    pub(crate) fn class(self, class: usize) -> usize {
        OF_VEHICLE + OF_RUN * self.n_runs + OF_CLASS * class
    }

    /// Places of a sample's parameters among all.
    pub(crate) fn local(self, sample: &Sample) -> [usize; LOCAL] {
        let (run, class) = (OF_VEHICLE + OF_RUN * sample.run, self.class(sample.class));
        std::array::from_fn(|i| match i {
            0..OF_VEHICLE => i,
            _ if i < OF_VEHICLE + OF_RUN => run + i - OF_VEHICLE,
            _ => class + i - OF_VEHICLE - OF_RUN,
        })
    }
}

fn belief(mean: f64, deviation: f64, low: f64, high: f64) -> Belief {
    Belief { mean, deviation, low, high }
}

/// Of the vehicle: as described, within what descriptions and calibrations err by.
pub(crate) fn vehicle_beliefs() -> [Belief; OF_VEHICLE] {
    [
        belief(0.0, 0.3, -1.2, 1.2),
        belief(0.0, 0.3, -1.2, 1.2),
        belief(0.0, 0.3, -1.0, 1.0),
        belief(0.0, 0.03, -0.2, 0.2),
        belief(0.0, 0.02, -0.2, 0.2),
        belief(0.0, 0.05, -0.3, 0.3),
        belief(0.0, 0.01, -0.1, 0.1),
    ]
}

pub(crate) fn run_beliefs() -> [Belief; OF_RUN] {
    [belief(0.0, 0.1, -1.0, 1.0); OF_RUN]
}

/// Of a class: the level is anybody's guess and the same for all, the shape that of the published curve.
pub(crate) fn class_beliefs(published: &FrictionCurve) -> [Belief; OF_CLASS] {
    let ratio = f64::from(published.sliding_friction / published.static_friction).ln();
    let speed = f64::from(published.stribeck_speed_mps).ln();
    [
        belief(0.55_f64.ln(), 0.7, 0.02_f64.ln(), 2.5_f64.ln()),
        belief(ratio, 0.2, ratio - 1.0, ratio + 1.0),
        belief(speed, 0.7, 0.05_f64.ln(), 20.0_f64.ln()),
        belief(0.02, 0.05, 0.0, 1.0),
    ]
}

/// Coefficients of a class from its parameters.
pub(crate) fn coefficients<const N: usize>(
    [statics, ratio, speed]: [Dual<N>; 3],
    published: &FrictionCurve,
) -> Coefficients<N> {
    let statics = statics.exp();
    let viscous = f64::from(published.viscous_friction / published.static_friction);
    Coefficients([statics, statics * ratio.exp(), statics * viscous, speed.exp()])
}

/// What the model makes of a sample, less what was measured [m/s2], and how far each tyre is used.
pub(crate) struct Misfit {
    pub misfit_mps2: [Dual<LOCAL>; 3],
    pub use_of_tyre: [TyreUse; 4],
}

/// Compares a sample with what its wheels should do; the third component is the angular acceleration times half the
/// wheelbase.
pub(crate) fn misfit(
    chassis: &Chassis,
    sample: &Sample,
    published: &FrictionCurve,
    values: [f64; LOCAL],
) -> Misfit {
    let all: [Dual<LOCAL>; LOCAL] = std::array::from_fn(|i| Dual::variable(values[i], i));
    let [
        front,
        rear,
        inertia,
        wheel_scale,
        trim,
        steering_scale,
        heading,
        bias_x,
        bias_y,
        statics,
        ratio,
        speed,
        resistance,
    ] = all;
    let friction = coefficients([statics, ratio, speed], published);
    let one = Dual::from(1.0);
    // A sensor that is turned takes a part of the speed for drift.
    let [ahead_mps, left_mps] = sample.velocity_mps;
    let velocity: Velocity<LOCAL> = [
        Dual::from(ahead_mps),
        Dual::from(left_mps) - heading * ahead_mps + Dual::from(sample.yaw_radps * chassis.cog_ahead_m),
        Dual::from(sample.yaw_radps),
    ];
    let steering = (one + steering_scale) * sample.steering_rad + trim;
    let wheel = (one + wheel_scale) * sample.wheel_mps;
    let stiffness = [front, rear].map(Dual::exp);
    let wheels = wheels(chassis, sample, &velocity, [steering, wheel], stiffness);
    let pushed = push(chassis, &velocity, &wheels, &[friction; 4]);
    let Push { specific_mps2: [x, y], moment_nm, use_of_tyre } = pushed;
    let speed_mps = ahead_mps.hypot(velocity[1].value).max(0.1);
    let drag = |along_mps: f64| resistance * (-GRAVITY_MPS2 * along_mps / speed_mps);
    let half_m = 0.5 * chassis.wheelbase_m;
    let turning = moment_nm * (half_m / chassis.yaw_inertia_kgm2) / inertia.exp();
    let misfit_mps2 = [
        x + drag(ahead_mps) + bias_x - Dual::from(sample.specific_mps2[0]),
        y + drag(velocity[1].value) + bias_y - Dual::from(sample.specific_mps2[1]),
        turning - Dual::from(sample.yaw_radps2 * half_m),
    ];
    Misfit { misfit_mps2, use_of_tyre }
}

fn wheels(
    chassis: &Chassis,
    sample: &Sample,
    velocity: &Velocity<LOCAL>,
    [steering, wheel_mps]: [Dual<LOCAL>; 2],
    stiffness: [Dual<LOCAL>; 2],
) -> [WheelInput<LOCAL>; 4] {
    let loads_n = chassis.loads_n(sample.specific_mps2, GRAVITY_MPS2);
    let contacts_m = chassis.contacts_m();
    let angle = |index: usize| if index < 2 { steering } else { Dual::from(0.0) };
    let rolling: [Dual<LOCAL>; 4] =
        std::array::from_fn(|i| contact_mps(velocity, contacts_m[i], angle(i))[0]);
    let edges = edges_mps(chassis, rolling, wheel_mps);
    std::array::from_fn(|i| WheelInput {
        edge_mps: edges[i],
        steering_rad: angle(i),
        slip_stiffness: stiffness[i / 2] * chassis.slip_stiffness[i / 2],
        grip: chassis.load_factor(loads_n[i].into()),
        load_n: loads_n[i].into(),
    })
}

/// Circumferential speeds of the wheels whose driven ones have this mean. Open and limited-slip differentials leave each
/// its own way round the bend and about the same slip; wheels that are not driven roll freely, or brake with the others.
fn edges_mps(chassis: &Chassis, rolling: [Dual<LOCAL>; 4], wheel_mps: Dual<LOCAL>) -> [Dual<LOCAL>; 4] {
    let driven: Vec<usize> = (0..4).filter(|i| chassis.driven[i / 2]).collect();
    let sum = driven.iter().fold(Dual::from(0.0), |sum, i| sum + rolling[*i]);
    let slip = wheel_mps - sum * (1.0 / driven.len().max(1) as f64);
    let braking = if slip.value < 0.0 { slip } else { Dual::from(0.0) };
    std::array::from_fn(|i| match (chassis.driven[i / 2], chassis.is_locked) {
        (true, true) => wheel_mps,
        (true, false) => rolling[i] + slip,
        (false, _) => rolling[i] + braking,
    })
}
