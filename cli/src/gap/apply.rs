//! `surefoot gap apply`: the effects of a diagnosis, put into the controller's model.

use std::path::Path;

use bicycle::{Effect, Model};
use sim_to_real::{Answer, PartUnknown, RepairError, Verdict, repaired};

use super::model_file;
use crate::UsageError;
use crate::arguments::GapApplyArguments;

pub(super) fn run(arguments: &GapApplyArguments) -> anyhow::Result<()> {
    let answer = read_answer(&arguments.diagnosis)?;
    let part_unknown = if arguments.force { PartUnknown::Applied } else { PartUnknown::Refused };
    let found = repaired(&model_file::read(&arguments.model)?, &answer, part_unknown);
    let (model, effects) = found.map_err(|error| {
        let told = if error == RepairError::PartUnknown { FORCED.to_owned() } else { error.to_string() };
        UsageError(format!("{}: {told}", arguments.diagnosis.display()))
    })?;
    let text = text(&model, (&answer, &effects), &arguments.model)?;
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
    serde_json::from_str(&text)
        .map_err(|error| UsageError(format!("{file}: expected the answer of gap diagnose, found: {error}")))
}

/// The model as TOML, with a line that says where its effects come from.
fn text(model: &Model, (answer, added): (&Answer, &[Effect]), before: &Path) -> anyhow::Result<String> {
    let ids: Vec<_> = added.iter().map(|effect| effect.description().cause).collect();
    let added = if ids.is_empty() { "nothing".to_owned() } else { ids.join(", ") };
    let (before, case) = (before.display(), &answer.case);
    let origin = match &answer.controller_model {
        Some(_) => format!("{before} with the effects measured in case {case}, {added} added"),
        None => format!("{before} with {added} added, as diagnosed in case {case}"),
    };
    Ok(format!("# {}\n{}", origin.replace(['\n', '\r'], " "), formats::model_text(model)?))
}

fn say(answer: &Answer, effects: &[Effect], out: &Path) {
    println!("  {}", out.display());
    if let Some(measured) = &answer.controller_model {
        println!(
            "  {} effects as they were measured, in place of those of the model",
            measured.nominal.len()
        );
        if measured.causes.is_empty() && !answer.effects.is_empty() {
            println!("  What was announced is left out: the robot's drives are foretold better without it.");
        }
    } else if effects.is_empty() {
        println!("  The diagnosis found no gap: the model is as it was.");
    }
    for effect in effects {
        let description = effect.description();
        let values = description.parameters.iter().zip(effect.values());
        let values = values.map(|(p, value)| format!("{} = {value:.4} {}", p.name, p.unit));
        println!("  + {}  {}", description.id, values.collect::<Vec<_>>().join(", "));
    }
    if let Some([before, after]) = answer.controller_model.as_ref().and_then(|own| own.foretold_losses) {
        println!(
            "  Drives that it was not fitted to cost it {after:.2} instead of {before:.2} (mean robust loss)."
        );
    }
    if answer.verdict == Verdict::EffectsAndUnknown {
        println!("  A part of the gap is none of the catalogue and remains.");
    }
}

#[cfg(test)]
mod tests;
