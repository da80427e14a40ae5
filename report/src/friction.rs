//! Friction found without labels beside the truth, as text and picture.

use bench::friction::{Report, Row, Share};
use friction::Grip;

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::Rgb;
use crate::table::Table;

const TOP: f64 = 150.0;
const HEIGHT: f64 = 560.0;
const LEFT: f64 = 110.0;
const GAP: f64 = 120.0;
const BELOW: f64 = 80.0;
const FRICTION: Range = Range { low: 0.0, high: 1.5 };
const COLOURS: [(&str, Rgb); 7] = [
    ("asphalt", Rgb::OBSTACLE),
    ("rock", Rgb::FAILURE),
    ("dirt", Rgb::PITCH),
    ("grass", Rgb::VEGETATION),
    ("mud", Rgb::UNFAMILIAR),
    ("sand", Rgb::GOAL),
    ("ice", Rgb::ROLL),
];
const DASHED: Stroke = Stroke { dash: "9 6", ..Stroke::solid(Rgb::INK_SOFT, 1.5) };
const AT_SPEED: &str = "true friction at the sliding speed of the drive [-]";
const MOST: &str = "most that the ground truly holds [-]";
const SMALL: TextStyle = TextStyle::new(16, Anchor::Start);

/// Draws what was found over the truth, and the bounds over the truth, as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    let within = percent(report.score.within);
    let title = format!("Friction found from drives, nobody told: {within} within 20 % of the truth");
    let mut canvas = Canvas::titled(TOP + HEIGHT + BELOW, &title, &[]);
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP) / 2.0;
    let axes = |place: f64| Axes {
        frame: Rect { x: LEFT + (width + GAP) * place, y: TOP, width, height: HEIGHT },
        x: FRICTION,
        y: FRICTION,
    };
    draw_numbers(report, &axes(0.0), &mut canvas);
    draw_bounds(report, &axes(1.0), &mut canvas);
    canvas.png()
}

fn colour(ground: &str) -> Rgb {
    COLOURS.iter().find(|(name, _)| *name == ground).map_or(Rgb::INK, |(_, colour)| *colour)
}

/// A frame with its title, rules and the line where found and true agree.
fn panel(axes: &Axes, [title, x, y]: [&str; 3], canvas: &mut Canvas, draw: impl FnOnce(&mut Canvas)) {
    canvas.text((axes.frame.x, axes.frame.y - 48.0), title, TextStyle::new(20, Anchor::Start).bold());
    axes.draw_rules(canvas);
    let most = FRICTION.high;
    canvas.clipped(axes.frame, |canvas| {
        canvas.line(axes.place(0.0, 0.0), axes.place(most, most), Stroke::solid(Rgb::INK_SOFT, 1.5));
        draw(canvas);
    });
    axes.draw_labelled(canvas, x, y);
}

fn draw_numbers(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    let words = ["Driven at the limit: a number, with 90 % (dashed: 20 %)", AT_SPEED, "friction found [-]"];
    panel(axes, words, canvas, |canvas| {
        for factor in [0.8, 1.2] {
            canvas.line(axes.place(0.0, 0.0), axes.place(1.5, 1.5 * factor), DASHED);
        }
        for row in &report.rows {
            let Grip::Measured { friction, low, high, .. } = row.grip else { continue };
            let place = |value: f64| axes.place(row.true_friction, value);
            canvas.line(place(low), place(high), Stroke::solid(colour(row.ground), 1.5));
            canvas.circle(place(friction), 4.5, colour(row.ground), Stroke::solid(Rgb::WHITE, 1.0));
        }
    });
    for (index, (name, colour)) in COLOURS.into_iter().enumerate() {
        let (x, y) = (axes.frame.x + 24.0, axes.frame.y + 28.0 + 26.0 * index as f64);
        canvas.circle((x, y - 5.0), 6.0, colour, Stroke::solid(Rgb::WHITE, 1.0));
        canvas.text((x + 16.0, y), name, SMALL);
    }
}

fn draw_bounds(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    let words =
        ["Never near the limit: \u{201c}at least\u{201d}, right below the line", MOST, "friction used [-]"];
    panel(axes, words, canvas, |canvas| {
        for row in &report.rows {
            let Grip::AtLeast { friction } = row.grip else { continue };
            let (x, y) = axes.place(row.true_most_friction, friction);
            let stroke = Stroke::solid(colour(row.ground), 2.5);
            canvas.line((x - 6.0, y), (x + 6.0, y), stroke);
            canvas.line((x, y), (x, y - 12.0), stroke);
        }
    });
}

/// What was found, for a terminal.
pub fn text(report: &Report) -> String {
    let mut names: Vec<&str> = Vec::new();
    for row in &report.rows {
        if !names.contains(&row.vehicle.as_str()) {
            names.push(&row.vehicle);
        }
    }
    let all = names.into_iter().chain(COLOURS.map(|(name, _)| name));
    let rows = all.map(|name| line(name, &report.rows)).collect();
    let header = ["", "cases", "a number", "within 20 %", "median error", "at least"].map(str::to_owned);
    let table = Table {
        title: format!(
            "friction found without labels, seeds {} to {}",
            report.first_seed,
            report.first_seed + report.n_seeds - 1
        ),
        header: header.to_vec(),
        rows,
        ..Table::default()
    };
    table.text() + "\n" + &verdict(report)
}

fn line(name: &str, rows: &[Row]) -> Vec<String> {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.vehicle == name || row.ground == name).collect();
    let mut errors: Vec<f64> = rows
        .iter()
        .filter_map(|row| match row.grip {
            Grip::Measured { friction, .. } => Some((friction / row.true_friction - 1.0).abs()),
            Grip::AtLeast { .. } => None,
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let n_within = errors.iter().filter(|error| **error <= 0.2).count();
    let median =
        errors.get(errors.len() / 2).map_or("-".to_owned(), |error| format!("{:.0} %", 100.0 * error));
    let numbers = [rows.len(), errors.len(), n_within];
    let bounds = (rows.len() - errors.len()).to_string();
    let [cases, measured, within] = numbers.map(|n| n.to_string());
    vec![name.to_owned(), cases, measured, within, median, bounds]
}

fn percent(share: Share) -> String {
    format!("{:.0} %", 100.0 * share.value())
}

fn verdict(report: &Report) -> String {
    let (score, verdict) = (&report.score, &report.verdict);
    let told = |what: &str, share: Share, rule: &str, holds: Option<bool>| {
        let [low, high] = share.interval().map(|end| 100.0 * end);
        let verdict = holds.map_or("", |holds| if holds { "holds" } else { "FAILS" });
        let numbers = format!("{} of {}", share.n, share.of);
        format!(
            "  {what:<50}{numbers:>12}  {:>5} [{low:.0}, {high:.0}]  {rule:<9}{verdict}\n",
            percent(share)
        )
    };
    told("numbers within 20 % of the truth", score.within, ">= 90 %", Some(verdict.within))
        + &told("  the published table on the same grounds", score.published_within, "", None)
        + &told("intervals of 90 % that hold the truth", score.covered, ">= 80 %", Some(verdict.covered))
        + &told("surely at the limit, and given a number", score.answered, ">= 70 %", Some(verdict.answered))
        + &told("never at the limit, and given a number", score.unfounded, "<= 5 %", Some(verdict.unfounded))
        + &told("\"at least\", and indeed hardly at the limit", score.never_right, "", None)
        + &told(
            "bounds within a tenth of the truth or below",
            score.bounds_hold,
            ">= 95 %",
            Some(verdict.bounds_hold),
        )
}
