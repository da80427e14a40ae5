//! Our routes beside a slow reference, as text and as a picture.

use bench::route::{Attempt, End, ExpertReport, ExpertRow, Pair};
use scenarios::LandscapeKind;

use super::text::spread;
use crate::axes::{Axes, Range, round_step};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::Rgb;
use crate::table::Table;

/// Time of an attempt [s], and whether it got there.
type TimeOf = fn(&Attempt) -> (f64, bool);

const TOP: f64 = 175.0;
const LINE: f64 = 30.0;
const BETWEEN: f64 = 130.0;
const LABELS: f64 = 190.0;
const GAP: f64 = 60.0;
const OURS: Rgb = Rgb::VEGETATION;
const REFERENCE: Rgb = Rgb::ROLL;
const LABEL: TextStyle = TextStyle::new(18, Anchor::End);
const SMALL: TextStyle = TextStyle::new(17, Anchor::Start);

/// A row for each landscape, then one for each task.
pub fn experts(report: &ExpertReport) -> String {
    let header = [
        "",
        "at goal",
        "reference",
        "time [s]",
        "reference",
        "expected over reference's",
        "driven",
        "planned in [s]",
        "reference",
    ];
    let table = Table {
        title: format!("our routes beside a slow reference, seed {}, {}", report.seed, report.vehicle),
        note: "means with intervals of 95 %; driven: where both arrived".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.rows.iter().map(row).collect(),
    };
    let header = ["task", "length [m]", "reference", "expected [s]", "reference", "end", "reference"];
    let tasks = Table {
        title: "task by task".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.pairs.iter().map(pair).collect(),
        ..Table::default()
    };
    table.text() + "\n" + &tasks.text()
}

fn row(row: &ExpertRow) -> Vec<String> {
    let [ours_s, reference_s] = row.time_s.map(|time_s| spread(time_s, 1));
    let [ours_planned_s, reference_planned_s] = row.planning_s.map(|mean| spread(mean, 2));
    let [n_ours, n_reference] = row.n_success.map(|n_success| format!("{n_success} of {}", row.n));
    vec![
        row.landscape.name().to_owned(),
        n_ours,
        n_reference,
        ours_s,
        reference_s,
        spread(row.expected_ratio, 3),
        spread(row.driven_ratio, 3),
        ours_planned_s,
        reference_planned_s,
    ]
}

fn pair(pair: &Pair) -> Vec<String> {
    let Pair { landscape, task, ours, reference } = pair;
    vec![
        format!("{} {task}", landscape.name()),
        format!("{:.0}", ours.length_m),
        format!("{:.0}", reference.length_m),
        format!("{:.1}", ours.expected_s),
        format!("{:.1}", reference.expected_s),
        ours.end.name().to_owned(),
        reference.end.name().to_owned(),
    ]
}

/// Draws the expected and the driven time of every task, ours and the reference's joined by a line, as a PNG 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn experts_picture(report: &ExpertReport) -> Result<Vec<u8>, EncodeError> {
    let blocks = LandscapeKind::ALL
        .map(|kind| report.pairs.iter().filter(|pair| pair.landscape == kind).collect::<Vec<&Pair>>());
    let lines: usize = blocks.iter().map(Vec::len).sum();
    let height = TOP + LINE * lines as f64 + BETWEEN * blocks.len() as f64 - 40.0;
    let subtitle = format!("{}, seed {}", report.vehicle, report.seed);
    let mut canvas = Canvas::titled(height, "Our routes beside a slow reference", &[&subtitle]);
    draw_legend(&mut canvas);
    let mut top = TOP;
    for (pairs, kind) in blocks.iter().zip(LandscapeKind::ALL) {
        let heading = format!("{}, {} tasks", kind.name(), pairs.len());
        canvas.text((LABELS, top - 18.0), &heading, TextStyle::new(20, Anchor::Start).bold());
        draw_block(pairs, top, &mut canvas);
        top += LINE * pairs.len() as f64 + BETWEEN;
    }
    canvas.png()
}

fn draw_legend(canvas: &mut Canvas) {
    let y = 118.0;
    for (x, colour, label) in [(LABELS, OURS, "ours"), (LABELS + 100.0, REFERENCE, "the reference's")] {
        canvas.circle((x, y - 6.0), 7.0, colour, Stroke::solid(Rgb::WHITE, 1.0));
        canvas.text((x + 16.0, y), label, SMALL);
    }
    let x = LABELS + 290.0;
    canvas.circle((x, y - 6.0), 7.0, Rgb::WHITE, Stroke::solid(Rgb::FAILURE, 3.0));
    canvas.text((x + 16.0, y), "ended short of the goal, then", SMALL);
}

fn draw_block(pairs: &[&Pair], top: f64, canvas: &mut Canvas) {
    let times_s = |pair: &Pair| [pair.ours, pair.reference].map(|of| of.expected_s.max(of.time_s));
    let most_s = pairs.iter().flat_map(|pair| times_s(pair)).fold(1.0, f64::max);
    let step = round_step(most_s / 8.0);
    let (width, n) = ((PAGE_WIDTH - LABELS - GAP - MARGIN) / 2.0, pairs.len().max(1) as f64);
    let axes = |place: f64| Axes {
        frame: Rect { x: LABELS + place * (width + GAP), y: top, width, height: LINE * n },
        x: Range { low: 0.0, high: (most_s / step).ceil() * step },
        y: Range { low: -n, high: 0.0 },
    };
    draw_panel(pairs, &axes(0.0), ("expected time [s]", |of| (of.expected_s, true)), canvas);
    draw_panel(pairs, &axes(1.0), ("driven time [s]", |of| (of.time_s, of.end == End::Goal)), canvas);
    for (index, pair) in pairs.iter().enumerate() {
        let y = top + (index as f64 + 0.5) * LINE + 6.0;
        canvas.text((LABELS - 14.0, y), &format!("task {}", pair.task), LABEL);
    }
}

fn draw_panel(pairs: &[&Pair], axes: &Axes, (label, time): (&str, TimeOf), canvas: &mut Canvas) {
    axes.draw_rules(canvas);
    for (index, pair) in pairs.iter().enumerate() {
        let place = |of: &Attempt| axes.place(time(of).0, -(index as f64) - 0.5);
        canvas.line(place(&pair.ours), place(&pair.reference), Stroke::solid(Rgb::INK_SOFT, 2.0));
        for (of, colour) in [(&pair.reference, REFERENCE), (&pair.ours, OURS)] {
            let rim =
                if time(of).1 { Stroke::solid(Rgb::WHITE, 1.0) } else { Stroke::solid(Rgb::FAILURE, 3.0) };
            canvas.circle(place(of), 7.0, colour, rim);
        }
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_x_label(canvas, label);
}
