//! The plant beside what is known, as text and picture: its tyre's friction over slip, and what drives at different speeds would teach.

use bench::plant::{COLLECTION_MPS, Labels, Published, ROLLING_MPS, Report};

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN, PAGE_WIDTH};
use crate::colour::Rgb;

const TOP: f64 = 150.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 110.0;
const GAP: f64 = 100.0;
const BELOW: f64 = 80.0;
const N_PANELS: f64 = 3.0;

/// One colour a row: three speeds, five grounds.
const COLOURS: [Rgb; 5] = [Rgb::ROLL, Rgb::PITCH, Rgb::VEGETATION, Rgb::UNFAMILIAR, Rgb::FAILURE];
const CLOSED_FORM: Stroke = Stroke { dash: "9 6", ..Stroke::solid(Rgb::INK, 2.0) };
const SMALL: TextStyle = TextStyle::new(16, Anchor::Start);

/// Draws what was measured of a plant as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    page(report).png()
}

fn page(report: &Report) -> Canvas {
    let title = format!("The plant of {}, {:.0} times real time", report.vehicle, report.times_real_time);
    let mut canvas = Canvas::titled(TOP + HEIGHT + BELOW, &title, &[]);
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP * (N_PANELS - 1.0)) / N_PANELS;
    let frame = |place: f64| Rect { x: LEFT + (width + GAP) * place, y: TOP, width, height: HEIGHT };
    draw_cornering(report, frame(0.0), &mut canvas);
    draw_published(report, frame(1.0), &mut canvas);
    draw_labels(report, frame(2.0), &mut canvas);
    canvas
}

/// A frame with its title, rules and axes; what goes in is drawn by `draw`.
fn panel(axes: &Axes, [title, x, y]: [&str; 3], canvas: &mut Canvas, draw: impl FnOnce(&mut Canvas)) {
    let Axes { frame, .. } = *axes;
    canvas.text((frame.x, frame.y - 48.0), title, TextStyle::new(20, Anchor::Start).bold());
    axes.draw_rules(canvas);
    canvas.clipped(frame, draw);
    axes.draw_labelled(canvas, x, y);
}

fn draw_entry(text: &str, stroke: Stroke, (x, y): Point, canvas: &mut Canvas) {
    canvas.line((x, y - 5.0), (x + 30.0, y - 5.0), stroke);
    canvas.text((x + 40.0, y), text, SMALL);
}

fn draw_cornering(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let axes = Axes { frame, x: Range { low: 0.0, high: 20.0 }, y: Range { low: 0.0, high: 1.1 } };
    let words = ["Cornering on asphalt, at three speeds", "slip angle [°]", "force over load [-]"];
    panel(&axes, words, canvas, |canvas| {
        for (index, speed_mps) in ROLLING_MPS.iter().enumerate() {
            let points: Vec<_> =
                report.cornering.iter().map(|row| axes.place(row.angle_deg, row.plant[index])).collect();
            // Curves that lie on each other: the first is the widest.
            let stroke = Stroke::solid(COLOURS[index], 9.0 - 3.0 * index as f64);
            canvas.polyline(&points, stroke);
            let place = (frame.right() - 180.0, frame.bottom() - 100.0 + 26.0 * index as f64);
            draw_entry(&format!("{speed_mps} m/s"), stroke, place, canvas);
        }
        let points: Vec<_> =
            report.cornering.iter().map(|row| axes.place(row.angle_deg, row.closed_form)).collect();
        canvas.polyline(&points, CLOSED_FORM);
        draw_entry("closed form", CLOSED_FORM, (frame.right() - 180.0, frame.bottom() - 22.0), canvas);
    });
}

fn draw_published(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let axes = Axes { frame, x: Range { low: 0.0, high: 0.4 }, y: Range { low: 0.0, high: 1.3 } };
    let words = ["Beside a published tyre", "tan(slip angle), braking slip [-]", "force over load [-]"];
    panel(&axes, words, canvas, |canvas| {
        let rows = [("across", &report.published_across), ("along", &report.published_along)];
        for (index, (name, rows)) in rows.into_iter().enumerate() {
            let slip = |row: &Published| if index == 0 { row.slip.to_radians().tan() } else { row.slip };
            let ours: Vec<_> = rows.iter().map(|row| axes.place(slip(row), row.plant)).collect();
            canvas.polyline(&ours, Stroke::solid(COLOURS[index], 2.5));
            for row in rows {
                let place = axes.place(slip(row), row.published);
                canvas.circle(place, 5.0, Rgb::WHITE, Stroke::solid(COLOURS[index], 2.5));
            }
            let place = (frame.right() - 230.0, frame.bottom() - 74.0 + 26.0 * index as f64);
            draw_entry(&format!("plant, {name}"), Stroke::solid(COLOURS[index], 2.5), place, canvas);
        }
        canvas.text((frame.right() - 230.0, frame.bottom() - 22.0), "rings: PAC2002", SMALL);
    });
}

fn draw_labels(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let axes = Axes { frame, x: Range { low: 0.0, high: 4.5 }, y: Range { low: 0.8, high: 1.02 } };
    let words = ["Traction labels", "speed of collection [m/s]", "linear traction [-]"];
    panel(&axes, words, canvas, |canvas| {
        for (index, labels) in report.labels.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let pairs = COLLECTION_MPS.iter().zip(labels.traction);
            let points: Vec<_> =
                pairs.map(|(speed_mps, traction)| axes.place(*speed_mps, traction)).collect();
            canvas.polyline(&points, Stroke::solid(colour, 2.5));
            for &point in &points {
                canvas.circle(point, 4.0, colour, Stroke::solid(colour, 1.0));
            }
            let place = (frame.x + 24.0, frame.bottom() - 126.0 + 26.0 * index as f64);
            draw_entry(labels.ground, Stroke::solid(colour, 2.5), place, canvas);
        }
    });
}

/// What was measured, for a terminal.
pub fn text(report: &Report) -> String {
    let stiffness = report
        .cornering
        .get(1)
        .map_or([0.0; 3], |row| row.plant.map(|friction| friction / row.angle_deg.to_radians().tan()));
    let mut told = format!(
        "  {}\n  cornering force over load and slip at 0.5 degrees: {:.2}, {:.2}, {:.2} at 1, 5, 15 m/s\n",
        report.vehicle, stiffness[0], stiffness[1], stiffness[2]
    );
    told += &format!(
        "  largest distance to the published tyre, friction over load: {:.3} across, {:.3} along\n\n",
        farthest(&report.published_across),
        farthest(&report.published_along)
    );
    told += &format!("  {:<18}", "linear traction at");
    told.extend(COLLECTION_MPS.map(|speed_mps| format!("{speed_mps:>8} m/s")));
    told.push('\n');
    told.extend(report.labels.iter().map(labels_text));
    told + &format!("\n  {:.0} times real time on one core, over rocks\n", report.times_real_time)
}

fn labels_text(labels: &Labels) -> String {
    let numbers: String = labels.traction.iter().map(|traction| format!("{traction:>12.4}")).collect();
    format!("  {:<18}{numbers}\n", labels.ground)
}

fn farthest(rows: &[Published]) -> f64 {
    rows.iter().map(|row| (row.plant - row.published).abs()).fold(0.0, f64::max)
}
