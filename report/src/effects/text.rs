//! The catalogue in words.

use std::fmt::Write;

use bicycle::effect::{CATALOGUE, Description, Parameter, Role};

/// The catalogue for a terminal.
pub fn text() -> String {
    CATALOGUE.iter().map(entry).collect()
}

/// An effect on a few lines.
fn entry(description: &Description) -> String {
    let Description { id, meaning, parameters, .. } = description;
    let mut text = format!("{id}{}\n    {meaning}\n", standing(description));
    for parameter in *parameters {
        let Parameter { name, unit, low, high, neutral, .. } = parameter;
        let unit = if *unit == "-" { "" } else { unit };
        _ = writeln!(text, "    {name}: {low} to {high} {unit}, none at {neutral}");
    }
    text
}

/// What an effect is to a diagnosis, where it is not a cause of its own.
fn standing(description: &Description) -> String {
    match description.role {
        Role::Calibration => " (calibrated on nominal drives)".to_owned(),
        Role::Cause if description.id == description.cause => String::new(),
        Role::Cause => format!(" (a form of {})", description.cause),
    }
}

/// The whole catalogue as a page of Markdown that shows the picture `effects.png`.
pub fn page() -> String {
    let rows: String = CATALOGUE.iter().map(row).collect();
    format!(
        "# The catalogue of effects\n\n\
         What a real machine does and the kinematic bicycle does not: v speed, L wheelbase, g gravity. \
         They are written in `bicycle/src/effect`, those of one shape as a family; the same code runs in the diagnosis and in the controller's rollouts. \
         This page and its picture are written by `surefoot gap effects --out docs`.\n\n\
         | id | what it is | parameters: from, to, where it is no effect |\n|---|---|---|\n{rows}\n\
         A form is another way in which a cause can act; a diagnosis announces the cause and tells the form. \
         Effects marked as calibrated are ordinary physics of a machine, fitted to nominal drives and never announced.\n\n\
         ## What each does to a drive\n\n\
         The same commands with the effect, at the middle of the values that a diagnosis tries, less without it, as the \
         sensors see it: steps of steering (2, 6 s), of speed (4, 8, 10 s), vegetation (10 to 13 s), loose ground (13 to \
         16 s), a weave that quickens (14 to 20 s), a slope to the north-east (18 to 24 s). \
         Wheelbase 1 m, a speed loop of 0.4 s, tyres that yield a little.\n\n\
         ![Signatures](effects.png)\n"
    )
}

fn row(description: &Description) -> String {
    let parameter = |Parameter { name, unit, low, high, neutral, .. }: &Parameter| {
        let unit = if *unit == "-" { String::new() } else { format!(" {unit}") };
        format!("`{name}`: {low} to {high}{unit}, {neutral}")
    };
    let parameters: Vec<String> = description.parameters.iter().map(parameter).collect();
    let meaning = description.meaning.replace('|', "\\|");
    format!("| `{}`{} | {meaning} | {} |\n", description.id, standing(description), parameters.join("; "))
}
