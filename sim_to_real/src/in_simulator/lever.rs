//! What can be moved to bring a simulator nearer to the robot: one parameter each.

use super::types::{CauseKind, Knob, SimulatorDescription};
use crate::answer::Ranked;
use crate::calibration::{coordinate, is_limit, value_at};
use bicycle::Effect;
use bicycle::effect::{CATALOGUE, Description, Parameter, Role};

/// Shares of the way from where nothing is changed to an end that are tried first. An error that grows as the distance from
/// the truth falls by 62 % or more at one of them, wherever the truth lies beyond 0.02: what is only just visible as well as
/// what is not.
const SHARES: [f64; 3] = [0.03, 0.12, 0.5];
/// Limits are tried at so many equal ratios, down from where there is none.
const N_LIMITS: i32 = 6;
/// Knobs whose ends have at least this ratio are fitted by their logarithm.
const WIDE: f64 = 4.0;

/// An effect with one parameter, or a knob. Places are coordinates of the fit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Lever {
    Effect(&'static Description),
    Knob(Knob),
}

/// The simulator's knobs and the first `n_causes` of the ranking that can be wrapped around it; apart from them, the other
/// effects of the ranking that can.
pub(super) fn levers(
    simulator: &SimulatorDescription,
    ranking: &[Ranked],
    n_causes: usize,
) -> (Vec<Lever>, Vec<Lever>) {
    let mut wrapped = ranking.iter().filter_map(|ranked| wrapped(&ranked.id)).map(Lever::Effect);
    let likeliest = wrapped.by_ref().take(n_causes);
    (likeliest.chain(simulator.knobs.iter().cloned().map(Lever::Knob)).collect(), wrapped.collect())
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
        let (neutral, [first, last]) = (self.neutral(), self.ends());
        if let Self::Effect(own) = self
            && is_limit(&own.parameters[0])
        {
            let step = (tried_ends(&own.parameters[0]).0 - neutral) / f64::from(N_LIMITS);
            return (1..=N_LIMITS).map(|n| neutral + f64::from(n) * step).collect();
        }
        let ways = [first - neutral, last - neutral].into_iter().filter(|way| way.abs() > 0.0);
        ways.flat_map(|way| SHARES.map(|share| neutral + share * way)).collect()
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
        ids.iter().map(|id| Ranked { id: (*id).to_owned(), score: 0.1, support: None }).collect()
    }

    #[test]
    fn what_acts_on_the_body_cannot_be_wrapped_and_is_passed_over() {
        let simulator = SimulatorDescription { name: "s".to_owned(), stochastic: false, knobs: Vec::new() };
        let ranking = ranked(&["friction", "steer_lag", "mass", "wind", "gyro_bias", "accel_limit"]);
        let names = |n| {
            let (likeliest, others) = levers(&simulator, &ranking, n);
            let names = |levers: &[Lever]| levers.iter().map(|lever| lever.name().to_owned()).collect();
            let both: [Vec<String>; 2] = [names(&likeliest), names(&others)];
            both
        };
        assert_eq!(names(5), [vec!["steer_lag", "gyro_bias", "accel_limit"], vec![]]);
        assert_eq!(names(2), [vec!["steer_lag", "gyro_bias"], vec!["accel_limit"]]);
    }

    /// A knob from 0.2 to 1.8 with its default at 0.9 is wide: by logarithm, shares of the way to either end.
    #[test]
    fn a_knob_is_tried_on_both_sides_within_its_range() {
        let knob = Knob { name: "k".into(), unit: "-".into(), low: 0.2, high: 1.8, default: 0.9 };
        let lever = Lever::Knob(knob.clone());
        let values: Vec<f64> = lever.tried().iter().map(|&place| lever.value(place)).collect();
        let below = [0.03, 0.12, 0.5].map(|share| 0.9 * (0.2_f64 / 0.9).powf(share));
        let above = [0.03, 0.12, 0.5].map(|share| 0.9 * 2.0_f64.powf(share));
        let expected = [below, above].concat();
        assert_eq!(values.len(), 6);
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{values:?}");
        }
        let [low, high] = lever.ends().map(|place| lever.value(place));
        assert!((low - 0.2).abs() < 1e-12 && (high - 1.8).abs() < 1e-12);
        let one_sided = Lever::Knob(Knob { default: 0.2, low: 0.2, high: 0.5, ..knob });
        assert_eq!(one_sided.tried().len(), 3);
    }

    /// Wherever the truth lies from 0.02 of the way to the end on, one of the places tried first takes 62 % off an error
    /// that grows as the distance from it: 1 - ((x - p) / x)^2.
    #[test]
    fn the_first_places_miss_nothing_between_hardly_visible_and_the_end() {
        let nearest = |truth: f64| SHARES.map(|share| 1.0 - ((truth - share) / truth).powi(2));
        let gains =
            (2..=100).map(|percent| nearest(0.01 * f64::from(percent)).into_iter().fold(0.0, f64::max));
        let least = gains.fold(1.0, f64::min);
        assert!((least - 0.624).abs() < 0.005, "{least}");
    }

    #[test]
    fn limits_are_tried_from_where_they_bind_hard_to_where_they_hardly_bind() {
        let lever = Lever::Effect(wrapped("accel_limit").unwrap());
        let values: Vec<f64> = lever.tried().iter().map(|&place| lever.value(place)).collect();
        let parameter = &CATALOGUE.iter().find(|own| own.id == "accel_limit").unwrap().parameters[0];
        let (first, last) = (parameter.tried[0], parameter.tried[parameter.tried.len() - 1]);
        assert_eq!(values.len(), 6);
        assert!((values[5] - first).abs() < 1e-9, "{values:?}");
        // Where there is none is last^2 / first; six equal ratios lead from there to the first.
        let ratio = (last / first).powf(2.0 / 6.0);
        for (value, next) in values.iter().zip(&values[1..]) {
            assert!((value / next - ratio).abs() < 1e-9, "{values:?}");
        }
    }
}
