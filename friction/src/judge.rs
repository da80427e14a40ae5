//! How far what was found can be believed: a number with an interval, or a bound.

use nalgebra::RowVector3;
use route::FrictionCurve;
use serde::{Deserialize, Serialize};

use crate::chassis::GRAVITY_MPS2;
use crate::dual::Dual;
use crate::find::Problem;
use crate::least_squares::Fit;
use crate::model::{coefficients, misfit};
use crate::reasoning::TyreUse;
use crate::samples::SPACING_S;

/// Speed of sliding at which grounds are compared where none was driven [m/s], that of the paper.
pub const SLIDING_MPS: f64 = 1.0;
/// From this use on a tyre's own stiffness hides less than a tenth of the ground's friction.
const LIMIT_USE: f64 = 1.5;
/// Time at the limit that makes a measurement [s].
const LIMIT_S: f64 = 0.8;
/// A logarithm that is less certain than this is no measurement.
const DEVIATION_MAX: f64 = 0.15;
/// What the model itself errs by, in the logarithm of friction: chosen on development drives.
const MODEL_DEVIATION: f64 = 0.08;
/// From this share of the Stribeck speed on the law's own rise from zero is over to 99 % [-].
const RISEN_SHARE: f64 = 0.2;
/// Half of the width of an interval of 90 % in standard deviations.
const Z_90: f64 = 1.645;
/// Share of instants that used more friction than the bound says; the rest may be noise.
const BEYOND_SHARE: f64 = 0.02;

/// What drives say of a ground's friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Grip {
    /// Tyres were at their limit: so much, with an interval of 90 %.
    Measured {
        /// Speed at which tyres slid, in the middle of those at the limit; not below that at which the law has risen from
        /// zero [m/s].
        sliding_mps: f64,
        /// Friction coefficient at that speed [-].
        friction: f64,
        /// 5 % lie below [-].
        low: f64,
        /// 5 % lie above [-].
        high: f64,
    },
    /// Tyres never came near their limit: so much was used, the ground may hold any amount more.
    AtLeast {
        /// Friction coefficient [-].
        friction: f64,
    },
}

/// What was found of one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundFriction {
    /// Name of the class.
    pub ground: String,
    /// Driven on it, away from its borders [s].
    pub driven_s: f64,
    /// Of that, with a whole axle at its limit [s].
    pub at_limit_s: f64,
    /// What is known of its friction.
    pub grip: Grip,
    /// The curve to plan with: the one found, or the published one, raised to the bound where it lies below.
    pub curve: FrictionCurve,
}

/// How a class was driven.
#[derive(Clone, Debug, Default)]
struct Driving {
    n: usize,
    /// Speeds of sliding of the axle at the limit [m/s].
    sliding_mps: Vec<f64>,
    used: Vec<f64>,
}

/// What is known of each class; `doubted` says which may as well hold much more.
pub(crate) fn judge(problem: &Problem<'_>, fit: &Fit, doubted: &[bool]) -> Vec<GroundFriction> {
    let mut driving = vec![Driving::default(); problem.classes.len()];
    for sample in problem.samples {
        let places = problem.layout.local(sample);
        let published = &problem.classes[sample.class].1;
        let uses =
            misfit(problem.chassis, sample, published, places.map(|place| fit.values[place])).use_of_tyre;
        let driving = &mut driving[sample.class];
        driving.sliding_mps.extend(limit_mps(&uses));
        let run = places[crate::model::OF_VEHICLE];
        let [x, y] = [0, 1].map(|axis| sample.specific_mps2[axis] - fit.values[run + axis]);
        driving.n += 1;
        driving.used.push(x.hypot(y) / GRAVITY_MPS2);
    }
    driving
        .into_iter()
        .enumerate()
        .map(|(class, driving)| of_class(problem, fit, (class, doubted[class]), driving))
        .collect()
}

fn of_class(
    problem: &Problem<'_>,
    fit: &Fit,
    (class, is_doubted): (usize, bool),
    driving: Driving,
) -> GroundFriction {
    let (name, published) = problem.classes[class];
    let at_limit_s = driving.sliding_mps.len() as f64 * SPACING_S;
    let first = problem.layout.class(class);
    let parameters: [Dual<3>; 3] = std::array::from_fn(|i| Dual::variable(fit.values[first + i], i));
    let found = coefficients(parameters, &published);
    let risen_mps = RISEN_SHARE * found.0[3].value;
    let sliding_mps = median(driving.sliding_mps).unwrap_or(SLIDING_MPS).max(risen_mps);
    let friction = found.at(Dual::from(sliding_mps));
    let slope = RowVector3::from(friction.slope) / friction.value;
    let covariance = fit.covariance.fixed_view::<3, 3>(first, first);
    let deviation = (slope * covariance * slope.transpose())[0].sqrt();
    let is_measured = at_limit_s >= LIMIT_S && deviation < DEVIATION_MAX && !is_doubted;
    let (grip, curve) = if is_measured {
        let width = (Z_90 * deviation.hypot(MODEL_DEVIATION)).exp();
        let (low, high) = (friction.value / width, friction.value * width);
        let [statics, dynamic, viscous, speed] = found.0.map(|value| value.value as f32);
        let curve = FrictionCurve {
            static_friction: statics,
            sliding_friction: dynamic,
            viscous_friction: viscous,
            stribeck_speed_mps: speed,
        };
        (Grip::Measured { sliding_mps, friction: friction.value, low, high }, curve)
    } else {
        let least = used_for_sure(driving.used);
        let known = f64::from(published.at(SLIDING_MPS as f32));
        let curve = published.scaled((least / known).max(1.0) as f32);
        (Grip::AtLeast { friction: least }, curve)
    };
    let driven_s = driving.n as f64 * SPACING_S;
    GroundFriction { ground: name.to_owned(), driven_s, at_limit_s, grip, curve }
}

/// Speed of sliding of the axle whose two tyres are both at their limit, if one is [m/s].
fn limit_mps(uses: &[TyreUse; 4]) -> Option<f64> {
    let axles = uses.chunks(2).filter(|axle| axle.iter().all(|tyre| tyre.share > LIMIT_USE));
    axles.map(|axle| 0.5 * (axle[0].sliding_mps + axle[1].sliding_mps)).next()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Friction that all wheels together used, but for the few instants that used most.
fn used_for_sure(mut used: Vec<f64>) -> f64 {
    used.sort_by(f64::total_cmp);
    let place = ((used.len() as f64) * (1.0 - BEYOND_SHARE)) as usize;
    used.get(place.min(used.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
