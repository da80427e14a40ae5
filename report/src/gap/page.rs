//! The report as one page that needs nothing else: the pictures are in it.

use sim_to_real::{Answer, NamedEffect, ResidualState, Verdict};

use super::{Reference, in_simulator, text, words};
use crate::Picture;
use crate::html::{self, escaped, figure, paragraph, section};

/// What a page tells besides the answer.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// The answer.
    pub answer: &'a Answer,
    /// Vehicle and number of drives, in a line.
    pub drives: &'a str,
    /// What is doubtful about the drives.
    pub doubts: &'a [String],
    /// The pictures, each told apart by its file.
    pub pictures: &'a [Picture],
    /// What the real drives were held against.
    pub reference: Reference,
    /// Program and revision.
    pub program: &'a str,
}

/// The page.
pub fn page(page: &Page<'_>) -> String {
    let answer = page.answer;
    let figures = |files: &[&str]| -> String {
        page.pictures.iter().filter(|picture| files.contains(&picture.file)).map(figure).collect()
    };
    let body = [
        html::heading(&answer.case, page.drives),
        format!("<p class=\"verdict\">{}</p>\n", escaped(&text::verdict(answer))),
        doubts(page.doubts),
        answer.pose_sensor.as_ref().map_or(String::new(), |found| paragraph(&text::pose_sensor(found))),
        // What the user's own simulator says counts for more than its calibrated image.
        answer.in_simulator.as_ref().map_or(String::new(), in_simulator::section),
        section("Which", &(effects(answer) + &figures(&["ranking.png", "throughout.png"]))),
        section(
            "Where",
            &(places(answer)
                + &left(answer)
                + &figures(&["places.png", "left.png", "swing.png", "ground.png"])),
        ),
        section(
            "How far",
            &(shrink(answer) + &in_units(answer) + &figures(&["residuals.png", "heldout.png"])),
        ),
        section("What next", &next(answer)),
        section("How to read this", reading(page.reference)),
        html::soft(page.program),
    ];
    html::page(&format!("Gap: {}", answer.case), &body.concat())
}

fn reading(reference: Reference) -> &'static str {
    match reference {
        Reference::Simulator => READING,
        Reference::Bicycle => READING_WITHOUT_SIMULATOR,
    }
}

const READING_WITHOUT_SIMULATOR: &str = "\
<p>There were no nominal drives: the model that everything is measured against is the kinematic bicycle, of which the \
wheelbase alone is known, and whatever the machine does beyond it counts as a gap, ordinary physics included. Rollouts \
start from measured states every 0.2 s and predict the measurements 0.3, 0.6, 1.2 and 2.0 s later. A residual is what \
the measurement differs by, divided by the standard deviation of what a repaired model leaves on these drives.</p>\
<p>The floor is the noise of the measurements, below which no model can go. What closes is (before - after) / (before \
- floor). The prediction was written before the held-out drives were opened; they were used for nothing else. Effects \
were announced as long as they foretold stretches better that were left out. Intervals hold 90 %.</p>";

const READING: &str = "\
<p>The model that everything is measured against is the kinematic bicycle, calibrated on the nominal drives until it \
drives as the simulator does. Rollouts start from measured states every 0.2 s and predict the measurements 0.3, 0.6, \
1.2 and 2.0 s later. A residual is what the measurement differs by, divided by its standard deviation on nominal \
drives: 1 is what the simulator's own drives show.</p>\
<p>The floor is the error on nominal drives that the model was not calibrated on: nothing can be expected to go below \
it. What closes is (before - after) / (before - floor). The prediction was written before the held-out drives were \
opened; they were used for nothing else. Intervals hold 90 %.</p>";

fn doubts(doubts: &[String]) -> String {
    doubts.iter().map(|doubt| format!("<p class=\"doubt\">{}</p>\n", escaped(doubt))).collect()
}

fn effects(answer: &Answer) -> String {
    if answer.effects.is_empty() {
        return String::new();
    }
    let row = |effect: &NamedEffect| {
        format!(
            "<tr><td><code>{}</code></td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escaped(&effect.id),
            escaped(text::meaning(effect)),
            escaped(&text::parameters(effect)),
            escaped(&text::asked_for(answer, &effect.id).unwrap_or_default())
        )
    };
    let rows: String = answer.effects.iter().map(row).collect();
    html::table(&["effect", "what it is", "value (90 %)", "how strongly"], &rows) + &credible(answer)
}

/// What else would explain the drives.
fn credible(answer: &Answer) -> String {
    text::others(answer).map_or(String::new(), |(what, names)| {
        let names: Vec<_> = names.iter().map(|id| format!("<code>{}</code>", escaped(id))).collect();
        format!("<p>{what}: {}.</p>\n", names.join(", "))
    })
}

fn places(answer: &Answer) -> String {
    if answer.verdict == Verdict::None {
        return paragraph("Without a gap there is no place.");
    }
    paragraph(&format!("The residual follows: {}.", text::places(answer)))
}

/// What no announced effect explains.
fn left(answer: &Answer) -> String {
    text::left(answer).iter().map(|line| paragraph(&format!("Left: {line}."))).collect()
}

fn shrink(answer: &Answer) -> String {
    text::shrink(&answer.shrink).iter().map(|line| paragraph(line)).collect()
}

/// Errors by quantity and horizon in their own units: before, after and the floor.
fn in_units(answer: &Answer) -> String {
    let errors = &answer.errors_by_quantity;
    if errors.is_empty() {
        return String::new();
    }
    let mut horizons_s: Vec<f64> = errors.iter().map(|error| error.horizon_s).collect();
    horizons_s.sort_by(f64::total_cmp);
    horizons_s.dedup();
    let mut quantities: Vec<ResidualState> = errors.iter().map(|error| error.quantity).collect();
    quantities.sort();
    quantities.dedup();
    let cell = |quantity: ResidualState, horizon_s: f64| {
        let own = errors.iter().find(|own| own.quantity == quantity && own.horizon_s == horizon_s);
        own.map_or(String::new(), |own| {
            let [before, after, floor] = [own.before, own.after, own.floor].map(text::rounded);
            format!("{before} to {after} (floor {floor})")
        })
    };
    let row = |quantity: &ResidualState| {
        let name = format!("{} [{}]", words::state(*quantity), quantity.unit());
        let cells = horizons_s.iter().map(|&horizon_s| cell(*quantity, horizon_s));
        html::row(&[name].into_iter().chain(cells).collect::<Vec<_>>())
    };
    let heads = horizons_s.iter().map(|horizon_s| format!("after {horizon_s} s"));
    let header: Vec<String> =
        ["held-out error, before to after".to_owned()].into_iter().chain(heads).collect();
    html::table(&header, &quantities.iter().map(row).collect::<String>())
}

fn next(answer: &Answer) -> String {
    if answer.advice.is_empty() {
        paragraph("Nothing is left to be told apart.")
    } else {
        answer.advice.iter().map(|line| paragraph(line)).collect()
    }
}

#[cfg(test)]
mod tests;
