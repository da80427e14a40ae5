//! The nominal model calibrated on nominal drives, with everything that the catalogue holds of ordinary physics.

use crate::comparison::{Comparison, Yardstick};
use crate::drive::{Drive, STEP_S};
use crate::least_squares::{Coordinate, fit, fit_from_several};
use bicycle::Effect;
use bicycle::effect::Parameter;

/// What every machine has a little of, in order of action, with the values that the fit starts from.
const ORDINARY: [(&str, [f64; 4]); 33] = [
    ("steer_delay", [0.02, 0.0, 0.0, 0.0]),
    ("speed_delay", [0.02, 0.0, 0.0, 0.0]),
    ("speed_scale", [1.0, 0.0, 0.0, 0.0]),
    ("steer_gain", [1.0, 0.0, 0.0, 0.0]),
    ("steer_bias", [0.0; 4]),
    ("backlash", [0.004, 0.0, 0.0, 0.0]),
    ("steer_rate", [3.0, 0.0, 0.0, 0.0]),
    ("steer_servo", [0.1, 1.0, 0.0, 0.0]),
    ("limited_servo", [0.1, 1.0, 3.0, 0.0]),
    (SWING, [0.0; 4]),
    ("speed_ramp", [15.0, 15.0, 0.0, 0.0]),
    ("speed_lag", [0.03, 0.0, 0.0, 0.0]),
    ("wheel_slip", [0.01, 0.1, 0.0, 0.0]),
    ("speed_loop", [0.3, 0.0, 0.0, 0.0]),
    ("feed_forward", [0.1, 0.0, 0.0, 0.0]),
    ("speed_integral", [0.3, 0.0, 0.0, 0.0]),
    ("hill_compensation", [0.0; 4]),
    ("felt_slope", [0.0, 0.1, 0.0, 0.0]),
    ("drive_limit", [8.0, 8.0, 0.0, 0.0]),
    ("drive_power", [1e4, 0.0, 0.0, 0.0]),
    ("drive_lag", [0.03, 0.0, 0.0, 0.0]),
    ("rolling_drag", [0.0; 4]),
    ("quad_drag", [0.0; 4]),
    ("veg_drag", [0.0; 4]),
    ("loose_drag", [0.0; 4]),
    ("cornering_drag", [0.0; 4]),
    ("slope_gravity", [0.3, 0.0, 0.0, 0.0]),
    ("cross_slope", [0.0; 4]),
    ("understeer", [0.0; 4]),
    ("yaw_load", [0.0; 4]),
    ("rear_slip", [0.0; 4]),
    ("rear_steer", [0.0; 4]),
    ("pose_latency", [0.01, 0.0, 0.0, 0.0]),
];
/// Kinds of speed controllers, simple ones first, by what they have beside a proportional loop. Each is grown from the best
/// fit of those that it contains: from elsewhere the fit ends in a worse place than theirs.
const CONTROLLERS: [&[&str]; 5] = [
    &[],
    &["drive_lag"],
    &["speed_integral", "drive_lag"],
    &["speed_ramp", "speed_lag", "feed_forward", "drive_lag"],
    &["speed_ramp", "speed_lag", "feed_forward", "speed_integral", "drive_lag"],
];
/// A controller is taken for a less simple one when that foretells the drives better by this for each of its parts, in the
/// logarithm of the loss.
const WORTH_A_CONTROLLER: f64 = 0.02;
/// The same where no gravity acts: nothing then tells how the controller answers a force, and a less simple one that is
/// not there would answer it wrongly.
const WORTH_A_CONTROLLER_ON_A_PLANE: f64 = 0.03;
/// Pull towards no effect, so that what the drives leave open stays small.
const PULL: f64 = 1.5;
/// Shares of gravity, along and across.
const GRAVITY: [&str; 2] = ["slope_gravity", "cross_slope"];
/// What a controller does against the first of them.
const COMPENSATIONS: [&str; 2] = ["hill_compensation", "felt_slope"];
/// Effects whose time constant no machine is without.
const LAGS: [&str; 3] = ["steer_servo", "limited_servo", "speed_loop"];
/// What drive and brakes can do, and the ramps of a controller's reference within it.
const DRIVE_LIMIT: &str = "drive_limit";
const RAMP: &str = "speed_ramp";
/// What a drive can do, in what its controller's ramps ask of it, where nothing else is known.
const DRIVE_OVER_RAMP: f64 = 1.5;
/// What makes the turning lead the steering.
const SWING: &str = "steer_swing";
/// What a controller's model does without.
const NOT_FOR_CONTROL: [&str; 7] =
    [SWING, "limited_servo", "yaw_load", "drive_limit", "drive_power", "wheel_slip", "felt_slope"];
/// What stands there for a servo within a rate and a late compensation, at less cost for each of many steps.
const FOR_CONTROL: [&str; 3] = ["steer_rate", "steer_servo", "hill_compensation"];
/// Below this share of gravity along the slope the simulator is one of a plane.
const PLANE: f64 = 0.25;

/// Fits the ordinary effects to drives, and the yardstick to what is left.
pub(crate) fn calibrated(wheelbase_m: f64, drives: &[&Drive]) -> (Vec<Effect>, Yardstick) {
    let rough = Yardstick::rough();
    let comparison = Comparison::new(wheelbase_m, drives.to_vec(), &rough);
    let simplest = simplest_fit(&comparison, ordinary(CONTROLLERS[0], &FOR_CONTROL));
    let mut yardstick = Yardstick::of(&comparison.residuals(&simplest), &rough);
    let mut effects = with_controller(&Comparison::new(wheelbase_m, drives.to_vec(), &yardstick), simplest);
    for _ in 0..2 {
        let comparison = Comparison::new(wheelbase_m, drives.to_vec(), &yardstick);
        let whole = with_whole_gravity(effects);
        let held = held_of(&whole);
        effects = fitted(&comparison, whole, &held);
        yardstick = Yardstick::of(&comparison.residuals(&effects), &yardstick);
    }
    (effects, yardstick)
}

/// The best fit from a start, limits tried first.
fn fitted(comparison: &Comparison<'_>, start: Vec<Effect>, held: &[&str]) -> Vec<Effect> {
    refined(comparison, &with_limits_tried(comparison, start), held)
}

/// The best fit with a proportional loop. Where a time constant of it has become shorter than a step, with which its slope
/// is gone, from other starts around there too: play can stand for a servo, and limits of the drive for a speed loop, well
/// enough that a fit stays at a loop which no force has power over.
fn simplest_fit(comparison: &Comparison<'_>, start: Vec<Effect>) -> Vec<Effect> {
    let found = fitted(comparison, start, &COMPENSATIONS);
    let is_gone = |own: &Effect| LAGS.contains(&own.description().id) && own.values()[0] < STEP_S;
    if !found.iter().any(is_gone) {
        return found;
    }
    let residuals = |values: &[f64]| comparison.residuals(&with_values(&found, values));
    with_values(&found, &fit_from_several(&coordinates_beside(&found, &COMPENSATIONS), residuals).values)
}

/// The same effects fitted to other drives, from where they are.
pub(crate) fn recalibrated(
    wheelbase_m: f64,
    drives: &[&Drive],
    (effects, yardstick): (&[Effect], &Yardstick),
) -> Vec<Effect> {
    let comparison = Comparison::new(wheelbase_m, drives.to_vec(), yardstick);
    refined(&comparison, effects, &held_of(effects))
}

/// The ordinary effects with a proportional speed loop, fitted to drives in units of their yardstick, for a controller's
/// model: without what answers a change of a command by more than that change, which sampled plans would exploit, and
/// without limits of the drive. Those that a proportional loop asks for are of the ramp in the machine's own speed
/// controller; taken for limits of its force they would forbid slopes that it climbs.
pub(crate) fn proportional(wheelbase_m: f64, drives: &[&Drive], yardstick: &Yardstick) -> Vec<Effect> {
    let comparison = Comparison::new(wheelbase_m, drives.to_vec(), yardstick);
    let effects = simplest_fit(&comparison, ordinary(CONTROLLERS[0], &NOT_FOR_CONTROL));
    let whole = with_whole_gravity(effects);
    refined(&comparison, &whole, &held_of(&whole))
}

/// The ordinary effects with a speed controller of some kind, and without some.
fn ordinary(controller: &[&str], without: &[&str]) -> Vec<Effect> {
    let is_free = |id: &str| !CONTROLLERS.concat().contains(&id) && !without.contains(&id);
    let has = |id: &str| controller.contains(&id) || is_free(id);
    let own = ORDINARY.iter().filter(|(id, _)| has(id));
    own.filter_map(|&(id, values)| Effect::from_values(id, values)).collect()
}

/// A fit with the speed controller that is worth its parts, grown from one with a proportional loop.
fn with_controller(comparison: &Comparison<'_>, simplest: Vec<Effect>) -> Vec<Effect> {
    let fit = |parts: &'static [&'static str], effects: Vec<Effect>| ControllerFit {
        parts,
        loss: comparison.loss(&effects),
        effects,
    };
    let mut fits = vec![fit(CONTROLLERS[0], simplest)];
    for parts in &CONTROLLERS[1..] {
        let contained = fits.iter().filter(|simpler| simpler.parts.iter().all(|part| parts.contains(part)));
        let best = contained.min_by(|a, b| a.loss.total_cmp(&b.loss));
        let starts = best.map_or_else(Vec::new, |simpler| {
            let start = grown(&simpler.effects, parts);
            ramped(&start).into_iter().chain([start]).collect()
        });
        fits.extend(starts.into_iter().map(|start| fit(parts, fitted(comparison, start, &COMPENSATIONS))));
    }
    let best = fits.into_iter().min_by(|a, b| a.energy().total_cmp(&b.energy()));
    best.map_or_else(Vec::new, |best| best.effects)
}

/// A fit with a speed controller of some kind.
struct ControllerFit {
    parts: &'static [&'static str],
    loss: f64,
    effects: Vec<Effect>,
}

impl ControllerFit {
    fn energy(&self) -> f64 {
        let worth = if is_heavy(&self.effects) { WORTH_A_CONTROLLER } else { WORTH_A_CONTROLLER_ON_A_PLANE };
        self.loss.ln() + worth * self.parts.len() as f64
    }
}

/// Where a fit with a less simple controller starts: at the simpler fit, with next to nothing of what that lacks.
fn grown(simpler: &[Effect], parts: &[&str]) -> Vec<Effect> {
    let mut known = simpler.iter().peekable();
    let start = |own: Effect| {
        known.next_if(|known| known.description().id == own.description().id).copied().unwrap_or(own)
    };
    ordinary(parts, &FOR_CONTROL).into_iter().map(start).collect()
}

/// The same start with ramps where the drive's limits are, if it has ramps: without them these were taken for limits.
fn ramped(start: &[Effect]) -> Option<Vec<Effect>> {
    let limits = start.iter().find(|own| own.description().id == DRIVE_LIMIT)?.values();
    start.iter().find(|own| own.description().id == RAMP)?;
    let moved = |own: &Effect| {
        let id = own.description().id;
        let values = match id {
            RAMP => limits,
            DRIVE_LIMIT => limits.map(|limit| DRIVE_OVER_RAMP * limit),
            "speed_lag" => [0.2, 0.0, 0.0, 0.0],
            "feed_forward" => [0.5, 0.0, 0.0, 0.0],
            "speed_loop" => own.values().map(|time_s| 0.5 * time_s),
            _ => return *own,
        };
        Effect::from_values(id, values).unwrap_or(*own)
    };
    Some(start.iter().map(moved).collect())
}

/// Limits that nothing reached leave no slope to follow: each is tried at every value of the catalogue.
fn with_limits_tried(comparison: &Comparison<'_>, mut effects: Vec<Effect>) -> Vec<Effect> {
    let mut least = comparison.loss(&effects);
    for place in 0..effects.len() {
        let description = effects[place].description();
        for (which, parameter) in description.parameters.iter().enumerate().filter(|(_, p)| is_limit(p)) {
            for &value in parameter.tried {
                let mut values = effects[place].values();
                values[which] = value;
                let mut changed = effects.clone();
                changed[place] = Effect::from_values(description.id, values).unwrap_or(effects[place]);
                let loss = comparison.loss(&changed);
                if loss < least {
                    (least, effects) = (loss, changed);
                }
            }
        }
    }
    effects
}

/// Gravity acts whole or, in a simulator of a plane, not at all. Told apart, the shares are not fitted any more; what is
/// missing along the slope is what the controller compensates.
fn with_whole_gravity(mut effects: Vec<Effect>) -> Vec<Effect> {
    let along = share_along(&effects);
    let whole = if along > PLANE { 1.0 } else { 0.0 };
    let is_found_whole = (along - whole).abs() < f64::EPSILON;
    for effect in &mut effects {
        let id = effect.description().id;
        let share = match id {
            _ if GRAVITY.contains(&id) => whole,
            _ if COMPENSATIONS.contains(&id) && !is_found_whole => (whole - along).max(0.0),
            _ => continue,
        };
        let [_, others @ ..] = effect.values();
        let [second, third, fourth] = others;
        *effect = Effect::from_values(id, [share, second, third, fourth]).unwrap_or(*effect);
    }
    effects
}

/// Share of gravity that acts along slopes.
fn share_along(effects: &[Effect]) -> f64 {
    let along = effects.iter().find(|effect| effect.description().id == GRAVITY[0]);
    along.map_or(0.0, |effect| effect.values()[0])
}

fn is_heavy(effects: &[Effect]) -> bool {
    share_along(effects) > PLANE
}

/// What is not fitted once gravity is whole: its shares, and on a plane what would compensate them.
fn held_of(effects: &[Effect]) -> Vec<&'static str> {
    if is_heavy(effects) { GRAVITY.to_vec() } else { [GRAVITY, COMPENSATIONS].concat() }
}

/// All parameters of all effects fitted together, but for those of effects that are held.
fn refined(comparison: &Comparison<'_>, effects: &[Effect], held: &[&str]) -> Vec<Effect> {
    let residuals = |values: &[f64]| comparison.residuals(&with_values(effects, values));
    with_values(effects, &fit(&coordinates_beside(effects, held), residuals).values)
}

/// The parameters of effects as they are fitted together; what is held has no room.
fn coordinates_beside(effects: &[Effect], held: &[&str]) -> Vec<Coordinate> {
    effects.iter().flat_map(|own| coordinates_of(own, held.contains(&own.description().id))).collect()
}

/// The parameters of calibrated effects as they would be fitted again; what is held has no room.
pub(crate) fn free_coordinates(effects: &[Effect]) -> Vec<Coordinate> {
    coordinates_beside(effects, &held_of(effects))
}

/// The same, each pulled to where it is.
pub(crate) fn held_coordinates(effects: &[Effect]) -> Vec<Coordinate> {
    let held = |own: Coordinate| Coordinate { pull: own.pull.map(|_| (own.start, PULL)), ..own };
    free_coordinates(effects).into_iter().map(held).collect()
}

/// The parameters of causes, which nothing pulls anywhere.
pub(crate) fn coordinates_of_causes(causes: &[Effect]) -> Vec<Coordinate> {
    let of = |cause: &Effect| {
        let parameters = cause.description().parameters.iter().zip(cause.values());
        parameters.map(|(parameter, value)| coordinate(parameter, value, None)).collect::<Vec<_>>()
    };
    causes.iter().flat_map(of).collect()
}

fn coordinates_of(effect: &Effect, is_held: bool) -> Vec<Coordinate> {
    let own = |(parameter, value): (&Parameter, f64)| {
        let own = coordinate(parameter, value, Some(PULL));
        if is_held { Coordinate { low: own.start, high: own.start, pull: None, ..own } } else { own }
    };
    effect.description().parameters.iter().zip(effect.values()).map(own).collect()
}

/// A parameter as the fit sees it: limits by their logarithm, all else as it is.
pub(crate) fn coordinate(parameter: &Parameter, value: f64, pull: Option<f64>) -> Coordinate {
    if is_limit(parameter) {
        let [start, low, high] = [value, parameter.low, parameter.high].map(f64::ln);
        return Coordinate { start, low, high, scale: 0.3, pull: None };
    }
    let scale = scale(parameter);
    let (low, high) = (parameter.low, parameter.high);
    Coordinate { start: value, low, high, scale, pull: pull.map(|strength| (parameter.neutral, strength)) }
}

/// How far apart two sizes of an effect are, in changes that matter.
pub(crate) fn distance(one: &Effect, other: &Effect) -> f64 {
    let values = one.values().into_iter().zip(other.values());
    let apart = |(parameter, (one, other)): (&Parameter, (f64, f64))| {
        let [one, other] = [one, other].map(|value| coordinate(parameter, value, None));
        (one.start - other.start) / one.scale
    };
    one.description().parameters.iter().zip(values).map(apart).fold(0.0, f64::hypot)
}

/// A change of a parameter that matters: half the smallest effect that is tried.
fn scale(parameter: &Parameter) -> f64 {
    let distance = |tried: &f64| (tried - parameter.neutral).abs();
    0.5 * parameter.tried.iter().map(distance).fold(f64::INFINITY, f64::min)
}

/// Whether the parameter bounds something, so that its largest value is no effect.
pub(crate) fn is_limit(parameter: &Parameter) -> bool {
    parameter.neutral == parameter.high
}

/// From the fit's coordinate to the parameter's value.
pub(crate) fn value_at(parameter: &Parameter, coordinate: f64) -> f64 {
    let value = if is_limit(parameter) { coordinate.exp() } else { coordinate };
    value.clamp(parameter.low, parameter.high)
}

/// The same effects with other values of their parameters, in the coordinates of the fit.
pub(crate) fn with_values(effects: &[Effect], coordinates: &[f64]) -> Vec<Effect> {
    let mut coordinates = coordinates.iter();
    effects
        .iter()
        .map(|effect| {
            let description = effect.description();
            let mut values = effect.values();
            for (value, parameter) in values.iter_mut().zip(description.parameters) {
                *value = coordinates.next().map_or(*value, |&coordinate| value_at(parameter, coordinate));
            }
            Effect::from_values(description.id, values).unwrap_or(*effect)
        })
        .collect()
}
