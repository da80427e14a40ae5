//! What the risk tolerance does: success, time to the goal and tilt over alpha, a line for every method.

use bench::closed_loop::Method;
use bench::navigation::{Entrant, Report, Row};
use bench::statistics::Mean;

use crate::Picture;
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const TOP: f64 = 200.0;
const LEFT: f64 = 90.0;
const GAP: f64 = 90.0;
const HEIGHT: f64 = 460.0;
const BELOW: f64 = 90.0;
/// Marks of the same tolerance stand so far apart, method by method, in widths of a panel.
const ASIDE: f64 = 0.016;
/// What is left free beside the outermost marks, as a share of what they span.
const BESIDE: f64 = 0.1;
/// Marks that are nearer to each other count as spanning so much, in the axis's unit.
const LEAST_SPAN: f64 = 0.1;
const TEXT: TextStyle = TextStyle::new(18, Anchor::Start);

/// Of planners of other people's, in the order of their rows and then anew.
const OTHERS: [Rgb; 4] = [Rgb::INK_SOFT, Rgb(0xb0, 0x7a, 0x3c), Rgb(0x5e, 0x9e, 0x9a), Rgb(0xc2, 0x6f, 0xa8)];

/// Who is drawn, and in which colour.
type Line<'a> = (&'a Entrant, Rgb);

/// A value with the ends of its interval, if it has one.
type Mark = (f64, Option<[f64; 2]>);

/// What a panel shows of a row.
struct Quantity {
    heading: &'static str,
    of: fn(&Row) -> Option<Mark>,
    /// The axis ends here at the latest.
    most: f64,
}

/// Draws success, time and tilt over the risk tolerance, as a PNG 1600 px wide; `None` if no method was driven with two.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Option<Picture>, EncodeError> {
    let lines = lines(report);
    let is_swept = lines.iter().any(|(who, _)| levels_of(report, who).len() > 1);
    if !is_swept {
        return Ok(None);
    }
    let caption = "Success, time to the goal and tilt over the risk tolerance".to_owned();
    Ok(Some(Picture { file: "navigation_alpha.png", caption, png: drawn(report, &lines).png()? }))
}

/// In the order of their rows.
fn lines(report: &Report) -> Vec<Line<'_>> {
    let mut entrants: Vec<&Entrant> = report.rows.iter().map(|row| &row.method).collect();
    entrants.dedup();
    let mut others = OTHERS.iter().cycle();
    let coloured = entrants
        .into_iter()
        .filter_map(|who| Some((who, who.method().map(colour).or_else(|| others.next().copied())?)));
    coloured.collect()
}

/// A method's rows by ascending tolerance, without those that know none.
fn levels_of<'a>(report: &'a Report, who: &Entrant) -> Vec<(f64, &'a Row)> {
    let rows = report.rows.iter().filter(|row| row.method == *who);
    let mut levels: Vec<(f64, &Row)> = rows.filter_map(|row| Some((row.alpha?, row))).collect();
    levels.sort_by(|a, b| a.0.total_cmp(&b.0));
    levels
}

fn colour(method: Method) -> Rgb {
    match method {
        Method::Pietra => Rgb::ROLL,
        Method::PietraAvoid => Rgb(0x6c, 0xb3, 0xf2),
        Method::Evora => Rgb::UNFAMILIAR,
        Method::PhysicsInformed => Rgb::VEGETATION,
        Method::Vanilla => Rgb(0x9a, 0xc8, 0x62),
        Method::Physics => Rgb::PITCH,
        Method::Nominal => Rgb::FAILURE,
        Method::Truth => Rgb::INK,
    }
}

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        heading: "goal reached [%]",
        of: |row| Some((100.0 * row.success, Some([100.0 * row.wilson_low, 100.0 * row.wilson_high]))),
        most: 102.0,
    },
    Quantity {
        heading: "median time to the goal [s]",
        of: |row| row.median_time_to_goal_s.map(|time_s| (time_s, None)),
        most: f64::INFINITY,
    },
    Quantity {
        heading: "largest tilt, mean over drives [deg]",
        of: |row| {
            let Mean { value, low, high } = row.largest_tilt_deg;
            Some((value, Some([low, high])))
        },
        most: f64::INFINITY,
    },
];

/// From the least to the most of some values, and a little more; of none, from 0 to 1.
fn around(values: impl Iterator<Item = f64>) -> Range {
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return Range { low: 0.0, high: 1.0 };
    }
    let beside = BESIDE * (high - low).max(LEAST_SPAN);
    Range { low: low - beside, high: high + beside }
}

impl Quantity {
    /// Of all rows with their intervals, but for those that are drawn without one.
    fn range(&self, report: &Report) -> Range {
        let ends = |row: &Row| {
            let (value, interval) = (self.of)(row)?;
            Some(interval.filter(|_| row.alpha.is_some()).unwrap_or([value; 2]))
        };
        let range = around(report.rows.iter().filter_map(ends).flatten());
        Range { high: range.high.min(self.most), ..range }
    }
}

/// "30 starts and goals", or how many the rows have at least and at most.
fn n_driven(report: &Report) -> String {
    let counts = report.rows.iter().map(|row| row.n);
    match (counts.clone().min(), counts.max()) {
        (Some(fewest), Some(most)) if fewest < most => format!("{fewest} to {most} starts and goals"),
        (_, most) => format!("{} starts and goals", most.unwrap_or(0)),
    }
}

fn drawn(report: &Report, lines: &[Line<'_>]) -> Canvas {
    let told = format!(
        "{}, seed {}, {} a point; bars are 95 % intervals; who knows no tolerance is a dashed line",
        report.plan.vehicle,
        report.plan.seed,
        n_driven(report)
    );
    let mut canvas = Canvas::titled(TOP + HEIGHT + BELOW, "What the risk tolerance does", &[&told]);
    draw_legend(lines, &mut canvas);
    let width = (PAGE_WIDTH - LEFT - MARGIN - 2.0 * GAP) / 3.0;
    let x = around(report.rows.iter().filter_map(|row| row.alpha));
    for (place, quantity) in QUANTITIES.iter().enumerate() {
        let frame = Rect { x: LEFT + (width + GAP) * place as f64, y: TOP, width, height: HEIGHT };
        draw_panel(report, lines, quantity, &Axes { frame, x, y: quantity.range(report) }, &mut canvas);
    }
    canvas
}

fn draw_legend(lines: &[Line<'_>], canvas: &mut Canvas) {
    let mut x = LEFT;
    for (who, colour) in lines {
        draw_mark((x, 132.0), *colour, canvas);
        canvas.text((x + 16.0, 138.0), who.name(), TEXT);
        x += 56.0 + 10.0 * who.name().len() as f64;
    }
}

fn draw_panel(report: &Report, lines: &[Line<'_>], quantity: &Quantity, axes: &Axes, canvas: &mut Canvas) {
    axes.draw_rules(canvas);
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_x_label(canvas, "risk tolerance alpha [-]");
    canvas.text((axes.frame.x, axes.frame.y - 14.0), quantity.heading, TEXT.bold());
    for (place, &(who, colour)) in lines.iter().enumerate() {
        let aside = ASIDE * axes.x.span() * (place as f64 - 0.5 * (lines.len() - 1) as f64);
        let levels = levels_of(report, who);
        if levels.is_empty() {
            draw_level_line(report, (who, colour), quantity, axes, canvas);
        }
        let marks = levels.iter().filter_map(|(alpha, row)| Some((alpha + aside, (quantity.of)(row)?)));
        let marks: Vec<(f64, Mark)> = marks.collect();
        let line: Vec<Point> = marks.iter().map(|(alpha, (value, _))| axes.place(*alpha, *value)).collect();
        canvas.polyline(&line, Stroke::solid(colour, 2.0));
        for (alpha, (value, interval)) in marks {
            if let Some([low, high]) = interval {
                let ends = [low, high].map(|end| axes.place(alpha, end));
                canvas.line(ends[0], ends[1], Stroke::solid(colour, 2.0));
            }
            draw_mark(axes.place(alpha, value), colour, canvas);
        }
    }
}

/// Who knows no tolerance does the same at any.
fn draw_level_line(
    report: &Report,
    (who, colour): Line<'_>,
    quantity: &Quantity,
    axes: &Axes,
    canvas: &mut Canvas,
) {
    let row = report.rows.iter().find(|row| row.method == *who);
    if let Some((value, _)) = row.and_then(quantity.of) {
        let [from, to] = [axes.x.low, axes.x.high].map(|alpha| axes.place(alpha, value));
        canvas.line(from, to, Stroke { dash: "9 6", ..Stroke::solid(colour, 2.0) });
    }
}

fn draw_mark(place: Point, colour: Rgb, canvas: &mut Canvas) {
    canvas.circle(place, 6.0, colour, Stroke::solid(Rgb::WHITE, 1.5));
}
