//! What can be moved to bring a simulator nearer to the robot: one parameter each.

use super::types::{CauseKind, Knob, SimulatorDescription};
use crate::answer::Ranked;
use crate::calibration::{coordinate, is_limit, value_at};
use bicycle::Effect;
use bicycle::effect::{CATALOGUE, Description, Parameter, Role};

/// Shares of the way from a knob's default to its end that are tried first.
const KNOB_SHARES: [f64; 2] = [0.3, 0.8];
/// Knobs whose ends have at least this ratio are fitted by their logarithm.
const WIDE: f64 = 4.0;

/// An effect with one parameter, or a knob. Places are coordinates of the fit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Lever {
    Effect(&'static Description),
    Knob(Knob),
}

/// The simulator's knobs and the first `n_causes` of the ranking that can be wrapped around it.
pub(super) fn levers(simulator: &SimulatorDescription, ranking: &[Ranked], n_causes: usize) -> Vec<Lever> {
    let wrapped = ranking.iter().filter_map(|ranked| wrapped(&ranked.id)).take(n_causes);
    wrapped.map(Lever::Effect).chain(simulator.knobs.iter().cloned().map(Lever::Knob)).collect()
}

/// The effect of that id, if it acts on commands or sensors alone.
fn wrapped(id: &str) -> Option<&'static Description> {
    let description = CATALOGUE.iter().find(|own| own.id == id && own.role == Role::Cause)?;
    let [only] = description.parameters else { return None };
    let effect = Effect::from_values(id, [only.neutral, 0.0, 0.0, 0.0])?;
    (!effect.acts_on_body()).then_some(description)
}

impl Lever {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Effect(description) => description.id,
            Self::Knob(knob) => &knob.name,
        }
    }

    pub(super) fn kind(&self) -> CauseKind {
        match self {
            Self::Effect(_) => CauseKind::Effect,
            Self::Knob(_) => CauseKind::Knob,
        }
    }

    pub(super) fn parameter_name(&self) -> &str {
        match self {
            Self::Effect(description) => description.parameters[0].name,
            Self::Knob(knob) => &knob.name,
        }
    }

    pub(super) fn unit(&self) -> &str {
        match self {
            Self::Effect(description) => description.parameters[0].unit,
            Self::Knob(knob) => &knob.unit,
        }
    }

    /// What the simulator has of it.
    pub(super) fn nominal(&self) -> f64 {
        match self {
            Self::Effect(description) => description.parameters[0].neutral,
            Self::Knob(knob) => knob.default,
        }
    }

    pub(super) fn value(&self, place: f64) -> f64 {
        match self {
            Self::Effect(description) => value_at(&description.parameters[0], place),
            Self::Knob(knob) if is_wide(knob) => place.exp().clamp(knob.low, knob.high),
            Self::Knob(knob) => place.clamp(knob.low, knob.high),
        }
    }

    pub(super) fn effect(&self, place: f64) -> Option<Effect> {
        match self {
            Self::Effect(own) => Effect::from_values(own.id, [self.value(place), 0.0, 0.0, 0.0]),
            Self::Knob(_) => None,
        }
    }

    /// Where nothing is changed. A limit is taken for none as far beyond its largest tried value as that is from the
    /// smallest.
    pub(super) fn neutral(&self) -> f64 {
        match self {
            Self::Effect(own) if is_limit(&own.parameters[0]) => {
                let (first, last) = tried_ends(&own.parameters[0]);
                2.0 * last - first
            }
            Self::Effect(own) => own.parameters[0].neutral,
            Self::Knob(knob) => knob_place(knob, knob.default),
        }
    }

    /// The places that are tried first.
    pub(super) fn tried(&self) -> Vec<f64> {
        match self {
            Self::Effect(own) => {
                let parameter = &own.parameters[0];
                parameter.tried.iter().map(|&value| coordinate(parameter, value, None).start).collect()
            }
            Self::Knob(knob) => {
                let middle = knob_place(knob, knob.default);
                let ends = [knob.low, knob.high].map(|end| knob_place(knob, end) - middle);
                let sides = ends.into_iter().filter(|way| way.abs() > 0.0);
                sides.flat_map(|way| KNOB_SHARES.map(|share| middle + share * way)).collect()
            }
        }
    }

    /// The farthest places that may be tried.
    pub(super) fn ends(&self) -> [f64; 2] {
        match self {
            Self::Effect(own) => {
                let parameter = &own.parameters[0];
                let bounds = coordinate(parameter, parameter.tried[0], None);
                let (first, last) = tried_ends(parameter);
                let reach = last - first;
                [(first - reach).max(bounds.low), (last + reach).min(bounds.high)]
            }
            Self::Knob(knob) => [knob.low, knob.high].map(|end| knob_place(knob, end)),
        }
    }
}

fn tried_ends(parameter: &Parameter) -> (f64, f64) {
    let at = |value: f64| coordinate(parameter, value, None).start;
    (at(parameter.tried[0]), at(parameter.tried[parameter.tried.len() - 1]))
}

fn is_wide(knob: &Knob) -> bool {
    knob.low > 0.0 && knob.high / knob.low >= WIDE
}

fn knob_place(knob: &Knob, value: f64) -> f64 {
    if is_wide(knob) { value.ln() } else { value }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;

    fn ranked(ids: &[&str]) -> Vec<Ranked> {
        ids.iter().map(|id| Ranked { id: (*id).to_owned(), score: 0.1 }).collect()
    }

    #[test]
    fn what_acts_on_the_body_cannot_be_wrapped_and_is_passed_over() {
        let simulator = SimulatorDescription { name: "s".to_owned(), stochastic: false, knobs: Vec::new() };
        let ranking = ranked(&["friction", "steer_lag", "mass", "wind", "gyro_bias", "accel_limit"]);
        let names = |n| -> Vec<String> {
            levers(&simulator, &ranking, n).iter().map(|lever| lever.name().to_owned()).collect()
        };
        assert_eq!(names(5), ["steer_lag", "gyro_bias", "accel_limit"]);
        assert_eq!(names(2), ["steer_lag", "gyro_bias"]);
    }

    /// A knob from 0.2 to 1.8 with its default at 0.9 is wide: by logarithm, 0.3 and 0.8 of the way to either end.
    #[test]
    fn a_knob_is_tried_on_both_sides_within_its_range() {
        let knob = Knob { name: "k".into(), unit: "-".into(), low: 0.2, high: 1.8, default: 0.9 };
        let lever = Lever::Knob(knob.clone());
        let values: Vec<f64> = lever.tried().iter().map(|&place| lever.value(place)).collect();
        let expected = [
            0.9 * (0.2_f64 / 0.9).powf(0.3),
            0.9 * (0.2_f64 / 0.9).powf(0.8),
            0.9 * 2.0_f64.powf(0.3),
            0.9 * 2.0_f64.powf(0.8),
        ];
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{values:?}");
        }
        let [low, high] = lever.ends().map(|place| lever.value(place));
        assert!((low - 0.2).abs() < 1e-12 && (high - 1.8).abs() < 1e-12);
        let one_sided = Lever::Knob(Knob { default: 0.2, low: 0.2, high: 0.5, ..knob });
        assert_eq!(one_sided.tried().len(), 2);
    }
}
