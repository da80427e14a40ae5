//! `surefoot gap apply`: the effects of a diagnosis, put into the controller's model.

use std::path::Path;

use bicycle::effect::{CATALOGUE, DriveLag, EffectError, SpeedLag};
use bicycle::{Effect, Model};
use formats::ConfigText;
use sim_to_real::{Answer, NamedEffect, SCHEMA_VERSION, Steering, Verdict};

use crate::UsageError;
use crate::arguments::GapApplyArguments;

pub(super) fn run(arguments: &GapApplyArguments) -> anyhow::Result<()> {
    let answer = read_answer(&arguments.diagnosis)?;
    let told = |message: String| UsageError(format!("{}: {message}", arguments.diagnosis.display()));
    if answer.verdict == Verdict::EffectsAndUnknown && !arguments.force {
        return Err(told(FORCED.to_owned()).into());
    }
    let effects = effects(&answer).map_err(told)?;
    let mut model = read_model(&arguments.model)?;
    let effects: Vec<Effect> = effects.into_iter().map(|effect| fitting(effect, &model)).collect();
    model.effects.extend(&effects);
    model.validate().map_err(|error| told(error.to_string()))?;
    let text = text(&model, &answer, &arguments.model)?;
    formats::write_bytes_atomic(&arguments.out, text.as_bytes())
        .map_err(|error| UsageError(format!("--out: {}", UsageError::from_input(error))))?;
    say(&answer, &effects, &arguments.out);
    Ok(())
}

/// What is said of a diagnosis that leaves a part unknown.
const FORCED: &str = "verdict: expected 'effects', or --force, found 'effects_and_unknown': a part of the gap is none of \
    the catalogue, and what is named may stand for it";

fn read_answer(path: &Path) -> Result<Answer, UsageError> {
    let file = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|error| UsageError(format!("{file}: expected a readable file, found: {error}")))?;
    let answer: Answer = serde_json::from_str(&text).map_err(|error| {
        UsageError(format!("{file}: expected the answer of gap diagnose, found: {error}"))
    })?;
    if answer.schema_version > SCHEMA_VERSION {
        let found = answer.schema_version;
        let told = format!("{file}: schema_version: expected at most {SCHEMA_VERSION}, found {found}");
        return Err(UsageError(told));
    }
    Ok(answer)
}

/// The announced effects as pieces of a model.
fn effects(answer: &Answer) -> Result<Vec<Effect>, String> {
    if answer.steering == Steering::YawRate {
        return Err(
            "steering: expected a diagnosis of a machine that steers by an angle, as the controller does, \
                    found one that is skid-steered: its effects on the steering mean yaw rates"
                .to_owned(),
        );
    }
    match answer.verdict {
        Verdict::None => Ok(Vec::new()),
        Verdict::Unknown => {
            Err("verdict: expected effects to apply, found 'unknown': no effect of the catalogue explains the gap"
                .to_owned())
        }
        Verdict::Effects | Verdict::EffectsAndUnknown => answer.effects.iter().map(effect).collect(),
    }
}

fn effect(named: &NamedEffect) -> Result<Effect, String> {
    let id = named.form.as_deref().unwrap_or(&named.id);
    let description = CATALOGUE.iter().find(|description| description.id == id);
    let Some(description) = description else {
        let known: Vec<_> = CATALOGUE.iter().map(|description| description.id).collect();
        return Err(format!("effects: expected one of {}, found '{id}'", known.join(", ")));
    };
    let mut values = [0.0; 4];
    for (value, parameter) in values.iter_mut().zip(description.parameters) {
        let estimate = named.parameters.get(parameter.name);
        *value = estimate
            .ok_or_else(|| format!("effects: {id}: expected parameter {}, found none", parameter.name))?
            .value;
    }
    let effect = Effect::from_values(id, values).ok_or_else(|| format!("effects: '{id}' cannot be made"))?;
    effect.validate().map_err(|error: EffectError| error.to_string())?;
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

/// A model's file, or the model that a vehicle's file or a shipped vehicle stands for.
fn read_model(path: &Path) -> Result<Model, UsageError> {
    let name = path.to_string_lossy();
    let is_shipped = formats::shipped_vehicle_names().any(|shipped| shipped == name);
    let vehicle = || formats::read_vehicle(&name).map(|vehicle| Model::of(&vehicle));
    if is_shipped {
        return vehicle().map_err(UsageError::from_input);
    }
    let text = ConfigText::read(path).map_err(UsageError::from_input)?;
    let model = if text.has_key("geometry") { vehicle() } else { formats::parse_model(&text) };
    model.map_err(UsageError::from_input)
}

/// The model as TOML, with a line that says where its effects come from.
fn text(model: &Model, answer: &Answer, before: &Path) -> anyhow::Result<String> {
    let ids: Vec<_> = answer.effects.iter().map(|effect| effect.id.as_str()).collect();
    let added = if ids.is_empty() { "nothing".to_owned() } else { ids.join(", ") };
    let origin = format!("{} with {added} added, as diagnosed in case {}", before.display(), answer.case);
    Ok(format!("# {}\n{}", origin.replace(['\n', '\r'], " "), formats::model_text(model)?))
}

fn say(answer: &Answer, effects: &[Effect], out: &Path) {
    println!("  {}", out.display());
    if effects.is_empty() {
        println!("  The diagnosis found no gap: the model is as it was.");
    }
    for effect in effects {
        let description = effect.description();
        let values = description.parameters.iter().zip(effect.values());
        let values = values.map(|(p, value)| format!("{} = {value:.4} {}", p.name, p.unit));
        println!("  + {}  {}", description.id, values.collect::<Vec<_>>().join(", "));
    }
    if answer.verdict == Verdict::EffectsAndUnknown {
        println!("  A part of the gap is none of the catalogue and remains.");
    }
}

#[cfg(test)]
mod tests;
