//! The effects of a diagnosis, put into a controller's model.

use bicycle::effect::{CATALOGUE, DriveLag, EffectError, SpeedLag};
use bicycle::{Effect, Model};

use crate::answer::{Answer, NamedEffect, SCHEMA_VERSION, Verdict};
use crate::steering::Steering;

/// Why the effects of an answer do not go into a model. Every message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RepairError {
    /// A newer program wrote the answer.
    #[error("schema_version: expected at most {SCHEMA_VERSION}, found {found}")]
    Version {
        /// Of the answer.
        found: u32,
    },
    /// The machine steers otherwise than a controller's bicycle.
    #[error(
        "steering: expected a diagnosis of a machine that steers by an angle, as the controller does, found one that is \
         skid-steered: its effects on the steering mean yaw rates"
    )]
    SkidSteered,
    /// Nothing was announced although there is a gap.
    #[error(
        "verdict: expected effects to apply, found 'unknown': no effect of the catalogue explains the gap"
    )]
    Unknown,
    /// A part remains that what is named may stand for.
    #[error(
        "verdict: expected 'effects', or to be forced, found 'effects_and_unknown': a part of the gap is none of the \
         catalogue, and what is named may stand for it"
    )]
    PartUnknown,
    /// The effects themselves, or the model with them.
    #[error("{problem}")]
    Effects {
        /// What was expected and what was found.
        problem: String,
    },
}

/// What becomes of an answer that leaves a part of the gap unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartUnknown {
    /// It is refused.
    Refused,
    /// What it names is applied all the same.
    Applied,
}

/// A model with what the answer measured for a controller in place of its own effects, else with the announced effects
/// after its own; and the announced ones alone, as they fit it.
///
/// # Errors
/// An answer that names no effect, or none that a controller's model can hold.
pub fn repaired(
    model: &Model,
    answer: &Answer,
    part_unknown: PartUnknown,
) -> Result<(Model, Vec<Effect>), RepairError> {
    if answer.schema_version > SCHEMA_VERSION {
        return Err(RepairError::Version { found: answer.schema_version });
    }
    if answer.verdict == Verdict::EffectsAndUnknown && part_unknown == PartUnknown::Refused {
        return Err(RepairError::PartUnknown);
    }
    let announced = announced(answer)?;
    let (effects, added) = match &answer.controller_model {
        Some(measured) => (measured.effects(), measured.causes.clone()),
        None => {
            let added: Vec<Effect> = announced.into_iter().map(|effect| fitting(effect, model)).collect();
            ([&model.effects[..], &added].concat(), added)
        }
    };
    let repaired = Model { effects, ..model.clone() };
    repaired.validate().map_err(|error| refused(error.to_string()))?;
    Ok((repaired, added))
}

fn refused(problem: String) -> RepairError {
    RepairError::Effects { problem }
}

/// The announced effects as pieces of a model.
fn announced(answer: &Answer) -> Result<Vec<Effect>, RepairError> {
    if answer.steering == Steering::YawRate {
        return Err(RepairError::SkidSteered);
    }
    match answer.verdict {
        Verdict::None => Ok(Vec::new()),
        Verdict::Unknown => Err(RepairError::Unknown),
        Verdict::Effects | Verdict::EffectsAndUnknown => answer.effects.iter().map(effect).collect(),
    }
}

fn effect(named: &NamedEffect) -> Result<Effect, RepairError> {
    let id = named.form.as_deref().unwrap_or(&named.id);
    let description = CATALOGUE.iter().find(|description| description.id == id);
    let Some(description) = description else {
        let known: Vec<_> = CATALOGUE.iter().map(|description| description.id).collect();
        return Err(refused(format!("effects: expected one of {}, found '{id}'", known.join(", "))));
    };
    let mut values = [0.0; 4];
    for (value, parameter) in values.iter_mut().zip(description.parameters) {
        let estimate = named.parameters.get(parameter.name);
        let missing = || refused(format!("effects: {id}: expected parameter {}, found none", parameter.name));
        *value = estimate.ok_or_else(missing)?.value;
    }
    let effect = Effect::from_values(id, values);
    let effect = effect.ok_or_else(|| refused(format!("effects: '{id}' cannot be made")))?;
    effect.validate().map_err(|error: EffectError| refused(error.to_string()))?;
    Ok(effect)
}

/// A motor's lag acts inside a speed loop. A model without one closes any distance within a step, which a late motor would
/// overshoot: there it is a lag of the command.
fn fitting(effect: Effect, model: &Model) -> Effect {
    let has_loop = model.effects.iter().any(|own| matches!(own, Effect::SpeedLoop(_)));
    match effect {
        Effect::DriveLag(DriveLag { time_constant_s }) if !has_loop => {
            Effect::SpeedLag(SpeedLag { time_constant_s })
        }
        _ => effect,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::answer::{Estimate, Shrink};

    fn named(id: &str, parameters: &[(&str, f64)]) -> NamedEffect {
        let estimate = |value: f64| Estimate { value, low: value, high: value };
        let parameters =
            parameters.iter().map(|(name, value)| ((*name).to_owned(), estimate(*value))).collect();
        NamedEffect { id: id.to_owned(), form: None, parameters }
    }

    fn answer(verdict: Verdict, effects: Vec<NamedEffect>) -> Answer {
        Answer {
            schema_version: SCHEMA_VERSION,
            case: "c".to_owned(),
            steering: Steering::Angle,
            verdict,
            effects,
            by_part: Vec::new(),
            left: Vec::new(),
            swing: None,
            leaning: None,
            ranking: Vec::new(),
            credible_set: Vec::new(),
            places: Vec::new(),
            shrink: Shrink::default(),
            errors_by_quantity: Vec::new(),
            pose_sensor: None,
            controller_model: None,
            in_simulator: None,
            advice: Vec::new(),
        }
    }

    #[test]
    fn none_leaves_the_model_and_unknown_is_refused() {
        assert_eq!(announced(&answer(Verdict::None, Vec::new())), Ok(Vec::new()));
        let told = announced(&answer(Verdict::Unknown, Vec::new())).unwrap_err();
        assert_eq!(told, RepairError::Unknown);
    }

    #[test]
    fn effects_that_no_model_can_hold_are_refused_by_name() {
        let refused =
            |named: NamedEffect| announced(&answer(Verdict::Effects, vec![named])).unwrap_err().to_string();
        let told = refused(named("steer_magic", &[]));
        assert!(told.contains("expected one of ") && told.contains("found 'steer_magic'"), "{told}");
        let told =
            refused(NamedEffect { id: "steer_lag".to_owned(), form: None, parameters: BTreeMap::new() });
        assert_eq!(told, "effects: steer_lag: expected parameter time_constant_s, found none");
        let told = refused(named("steer_lag", &[("time_constant_s", 1e6)]));
        assert!(told.starts_with("effect steer_lag: time_constant_s: expected "), "{told}");
    }

    /// Its steering effects mean yaw rates, which no angle can follow.
    #[test]
    fn a_skid_steered_machine_is_not_for_a_controller_that_steers_by_an_angle() {
        let gain = named("steer_gain", &[("ratio", 0.38)]);
        let skid = Answer { steering: Steering::YawRate, ..answer(Verdict::Effects, vec![gain.clone()]) };
        assert_eq!(announced(&skid).unwrap_err(), RepairError::SkidSteered);
        assert_eq!(announced(&answer(Verdict::Effects, vec![gain])).unwrap().len(), 1);
    }

    #[test]
    fn a_motors_lag_needs_a_speed_loop_to_act_in() {
        let lag = Effect::from_values("drive_lag", [0.3, 0.0, 0.0, 0.0]).unwrap();
        let mut model = bicycle::Model::of(&formats::read_vehicle("rc_car").unwrap());
        assert_eq!(fitting(lag, &model), Effect::from_values("speed_lag", [0.3, 0.0, 0.0, 0.0]).unwrap());
        model.effects.push(Effect::from_values("speed_loop", [0.4, 0.0, 0.0, 0.0]).unwrap());
        assert_eq!(fitting(lag, &model), lag);
    }

    #[test]
    fn an_answer_of_a_newer_program_or_with_a_part_unknown_is_refused() {
        let model = bicycle::Model::of(&formats::read_vehicle("rc_car").unwrap());
        let newer = Answer { schema_version: SCHEMA_VERSION + 1, ..answer(Verdict::None, Vec::new()) };
        let told = repaired(&model, &newer, PartUnknown::Refused).unwrap_err();
        assert_eq!(told, RepairError::Version { found: SCHEMA_VERSION + 1 });
        let gain = named("steer_gain", &[("ratio", 0.8)]);
        let partly = answer(Verdict::EffectsAndUnknown, vec![gain]);
        let told = repaired(&model, &partly, PartUnknown::Refused).unwrap_err();
        assert_eq!(told, RepairError::PartUnknown);
        let (found, added) = repaired(&model, &partly, PartUnknown::Applied).unwrap();
        assert_eq!((found.effects.len(), added.len()), (1, 1));
    }
}
