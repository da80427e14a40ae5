//! What the user's own simulator says, in lines and as a section of the page.

use sim_to_real::{CauseKind, InSimulator, SimulatorCandidate, SimulatorCause, Verdict};

use super::text::{closed, listed, rounded};
use crate::html::{self, escaped, paragraph};

/// The verdict, every cause and how far the gap shrinks, line by line.
pub(super) fn in_simulator(own: &InSimulator) -> Vec<String> {
    let mut lines = vec![verdict(own)];
    lines.extend(own.causes.iter().map(cause));
    if !own.not_told_apart.is_empty() {
        let names: Vec<&str> = own.not_told_apart.iter().map(String::as_str).collect();
        lines.push(format!("as well would do {}", listed(&names)));
    }
    lines.extend(shrink(own));
    lines
}

fn verdict(own: &InSimulator) -> String {
    let simulator = &own.simulator;
    match own.verdict {
        Verdict::None => format!("{simulator}: nothing that was tried brings it clearly nearer to the robot"),
        Verdict::Effects => format!("{simulator} drives as the robot does with"),
        Verdict::EffectsAndUnknown => {
            format!(
                "{simulator} comes nearer to the robot with what follows; the rest is none of what was tried"
            )
        }
        Verdict::Unknown => {
            format!("{simulator} differs from the robot, and nothing that was tried explains it")
        }
    }
}

/// `your tyre_friction of 0.900 is 0.620 (0.580 to 0.660) on the robot`.
fn cause(cause: &SimulatorCause) -> String {
    let found = format!(
        "{} ({} to {})",
        rounded(cause.found.value),
        rounded(cause.found.low),
        rounded(cause.found.high)
    );
    let unit = if cause.unit == "-" { String::new() } else { format!(" {}", cause.unit) };
    match cause.kind {
        CauseKind::Knob => {
            format!("your {} of {}{unit} is {found} on the robot", cause.name, rounded(cause.nominal))
        }
        CauseKind::Effect => format!("{} added, {} {found}{unit}", cause.name, cause.parameter),
    }
}

fn shrink(own: &InSimulator) -> Vec<String> {
    let shrink = &own.shrink;
    let Some((before, after)) = shrink.before.zip(shrink.after) else {
        return vec!["no held-out drives: nothing was verified in it".to_owned()];
    };
    let floor = shrink.floor;
    let mut lines = vec![format!(
        "held-out error in it {before:.2} as it is, {after:.2} with that, {floor:.2} is the floor"
    )];
    lines.extend(closed(shrink));
    lines.extend(shrink.position_error_2s_m.map(|error| {
        format!(
            "position error after 2 s in it {:.3} m as it is, {:.3} m with that",
            error.before, error.after
        )
    }));
    lines
}

/// The section of the page.
pub(super) fn section(own: &InSimulator) -> String {
    let told: String = in_simulator(own).iter().map(|line| paragraph(line)).collect();
    let row = |tried: &SimulatorCandidate| {
        let kind = match tried.kind {
            CauseKind::Effect => "effect",
            CauseKind::Knob => "parameter",
        };
        format!(
            "<tr><td><code>{}</code></td><td>{kind}</td><td>{}</td><td>{:.1} &plusmn; {:.1} %</td></tr>\n",
            escaped(&tried.name),
            rounded(tried.value),
            100.0 * tried.gain,
            100.0 * tried.gain_standard_error
        )
    };
    let rows: String = own.candidates.iter().map(row).collect();
    let table = html::table(&["tried alone", "what", "best value", "takes off the loss elsewhere"], &rows);
    html::section("In your simulator", &(told + &table + &paragraph(READING)))
}

const READING: &str = "Every drive went through the simulator from its first row with all that was commanded. Each \
effect was wrapped around its commands or sensors, each parameter of its own was turned, and fitted to the real drives; \
what it takes off the loss was measured on drives that it was not fitted to, with the standard error of \
chance over stretches of five seconds.";
