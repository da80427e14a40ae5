//! Intervals of the announced parameters, by leaving out one stretch of the real drives after the other.

use crate::answer::{Estimate, NamedEffect};
use crate::calibration::{coordinates_of_causes, is_limit, value_at, with_values};
use crate::causes::Trial;
use crate::least_squares::Linearised;
use bicycle::Effect;

/// Stretches of the real drives.
const N_STRETCHES: usize = 10;
/// Half the width of a 90 % interval in standard errors of a jackknife over ten stretches (Student, 9 degrees).
const STUDENT_90: f64 = 1.833;
/// What the calibrated model's own error adds, in changes of the parameter that matter,
const MODEL_ERROR: f64 = 0.06;
/// and what the difference between the machine's effect and the catalogue's formula adds, in distances from no effect.
const FORM_ERROR: f64 = 0.12;
/// All of it so many times wider: the 90 % quantile of error over half-width among parameters that were named rightly on
/// labelled machines of other equations (split conformal prediction), for effects on the commands,
const CONFORMAL_ON_COMMANDS: f64 = 2.4;
/// on the body, whose forces a machine's own controller answers,
const CONFORMAL_ON_BODY: f64 = 3.5;
/// and on the sensors.
const CONFORMAL_ON_SENSORS: f64 = 0.6;

/// The effects with their parameters and 90 % intervals.
pub(crate) fn named_effects(trial: &Trial<'_>, causes: &[Effect]) -> Vec<NamedEffect> {
    let with_factor = |cause: &Effect| {
        let factor = conformal(cause);
        cause.description().parameters.iter().map(move |parameter| (parameter, factor))
    };
    let parameters: Vec<_> = causes.iter().flat_map(with_factor).collect();
    let centre = coordinates_of_causes(causes);
    let places: Vec<f64> = centre.iter().map(|coordinate| coordinate.start).collect();
    let linearised =
        Linearised::at(&centre, &places, |values| trial.judged_residuals(&with_values(causes, values)));
    let errors = linearised.jackknife(N_STRETCHES);
    let mut estimates =
        parameters.iter().zip(&centre).zip(errors).map(|((&(parameter, factor), centre), error)| {
            let size = if is_limit(parameter) { 1.0 } else { centre.start - parameter.neutral };
            let half = factor
                * (STUDENT_90 * error)
                    .hypot(STUDENT_90 * MODEL_ERROR * centre.scale)
                    .hypot(FORM_ERROR * size);
            let at = |place: f64| value_at(parameter, place);
            let (low, high) = (at(centre.start - half), at(centre.start + half));
            (parameter.name.to_owned(), Estimate { value: at(centre.start), low, high })
        });
    let named = |cause: &Effect| {
        let description = cause.description();
        let own = estimates.by_ref().take(description.parameters.len()).collect();
        let form = (description.id != description.cause).then(|| description.id.to_owned());
        NamedEffect { id: description.cause.to_owned(), form, parameters: own }
    };
    causes.iter().map(named).collect()
}

/// By how much the intervals of an effect are wider.
fn conformal(effect: &Effect) -> f64 {
    if effect.acts_on_sensors() {
        CONFORMAL_ON_SENSORS
    } else if effect.acts_on_body() {
        CONFORMAL_ON_BODY
    } else {
        CONFORMAL_ON_COMMANDS
    }
}
