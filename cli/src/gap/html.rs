//! The report as one page that needs nothing else: the pictures are in it.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use sim_to_real::{Answer, NamedEffect, Verdict};

use super::told;
use crate::picture::{GapPicture, Reference};

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;color:#1b2230;max-width:1200px;margin:2em auto;padding:0 1em}\
h1{margin-bottom:.1em}h2{margin:2em 0 .3em;font-size:20px;border-top:1px solid #d9dee5;padding-top:.8em}\
p{margin:.3em 0}.soft{color:#5a6474}.verdict{font-size:20px;font-weight:600;margin:.8em 0}\
table{border-collapse:collapse;font-size:15px;font-variant-numeric:tabular-nums;margin:.6em 0}\
th,td{padding:4px 14px 4px 0;text-align:left;border-bottom:1px solid #d9dee5;vertical-align:top}\
th{color:#5a6474;font-weight:600}img{width:100%;height:auto;margin:.6em 0}\
.doubt{color:#8a3d00}figure{margin:1em 0}figcaption{color:#5a6474}code{font-size:14px}";

/// What a page tells besides the answer.
pub(super) struct Page<'a> {
    pub answer: &'a Answer,
    /// Vehicle and number of drives, in a line.
    pub drives: &'a str,
    /// What is doubtful about the drives.
    pub doubts: &'a [String],
    pub pictures: &'a [GapPicture],
    /// What the real drives were held against.
    pub reference: Reference,
    /// Program and revision.
    pub program: &'a str,
}

pub(super) fn page(page: &Page<'_>) -> String {
    let answer = page.answer;
    let figures = |files: &[&str]| -> String {
        page.pictures.iter().filter(|picture| files.contains(&picture.file)).map(figure).collect()
    };
    let body = [
        format!("<h1>{}</h1>\n<p class=\"soft\">{}</p>\n", escaped(&answer.case), escaped(page.drives)),
        format!("<p class=\"verdict\">{}</p>\n", escaped(&told::verdict(answer))),
        doubts(page.doubts),
        section("Which", &(effects(answer) + &figures(&["ranking.png"]))),
        section("Where", &(places(answer) + &figures(&["places.png", "ground.png"]))),
        section("How far", &(shrink(answer) + &figures(&["residuals.png", "heldout.png"]))),
        section("What next", &next(answer)),
        section("How to read this", reading(page.reference)),
        format!("<p class=\"soft\">{}</p>\n", escaped(page.program)),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Gap: {}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
        escaped(&answer.case),
        body.concat()
    )
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

fn section(title: &str, content: &str) -> String {
    format!("<h2>{title}</h2>\n{content}\n")
}

fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

fn doubts(doubts: &[String]) -> String {
    doubts.iter().map(|doubt| format!("<p class=\"doubt\">{}</p>\n", escaped(doubt))).collect()
}

fn effects(answer: &Answer) -> String {
    if answer.effects.is_empty() {
        return String::new();
    }
    let row = |effect: &NamedEffect| {
        format!(
            "<tr><td><code>{}</code></td><td>{}</td><td>{}</td></tr>\n",
            escaped(&effect.id),
            escaped(told::meaning(&effect.id)),
            escaped(&told::parameters(effect))
        )
    };
    let rows: String = answer.effects.iter().map(row).collect();
    let header = "<tr><th>effect</th><th>what it is</th><th>value (90 %)</th></tr>";
    format!("<table>\n{header}\n{rows}</table>\n{}", credible(answer))
}

/// What else would explain the drives.
fn credible(answer: &Answer) -> String {
    told::others(answer).map_or(String::new(), |(what, names)| {
        let names: Vec<_> = names.iter().map(|id| format!("<code>{}</code>", escaped(id))).collect();
        format!("<p>{what}: {}.</p>\n", names.join(", "))
    })
}

fn places(answer: &Answer) -> String {
    if answer.verdict == Verdict::None {
        return paragraph("Without a gap there is no place.");
    }
    paragraph(&format!("The residual follows: {}.", told::places(answer)))
}

fn shrink(answer: &Answer) -> String {
    told::shrink(&answer.shrink).iter().map(|line| paragraph(line)).collect()
}

fn next(answer: &Answer) -> String {
    if answer.advice.is_empty() {
        paragraph("Nothing is left to be told apart.")
    } else {
        answer.advice.iter().map(|line| paragraph(line)).collect()
    }
}

fn figure(picture: &GapPicture) -> String {
    let (caption, data) = (escaped(&picture.caption), BASE64_STANDARD.encode(&picture.png));
    format!(
        "<figure><img src=\"data:image/png;base64,{data}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>\n"
    )
}

/// Text that cannot be taken for markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests;
