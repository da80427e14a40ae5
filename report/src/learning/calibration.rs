//! Calibration: histograms of the probability integral transform, per parameter, in and out of distribution.

use bench::learning::{CalibrationReport, DomainReport, Report, Row};
use evidential::PARAMETER_NAMES;

use super::{draw_legend, stroke};
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const SHOWN: [Row; 5] = [Row::Pietra, Row::PhysicsInformed, Row::Vanilla, Row::Evora, Row::PhysicsPrior];
const WIDTH: f64 = 262.0;
const HEIGHT: f64 = 210.0;
const GAPS: [f64; 2] = [48.0, 92.0];
/// Share of the transforms at the upper edge of a panel; taller steps are cut.
const SHARE_MAX: f64 = 0.4;

/// A row's report in one domain.
type OfRow = fn(&Report, Row) -> &DomainReport;

pub(super) fn draw(report: &Report, (x, y): Point, canvas: &mut Canvas) {
    let title =
        "Calibration: share of measurements in each tenth of the predicted distribution (0.1 if calibrated)";
    canvas.text((x - 62.0, y - 100.0), title, TextStyle::new(20, Anchor::Start).bold());
    let domains: [(&str, OfRow); 2] = [
        ("in distribution", |report, row| &report.row(row).in_distribution),
        ("out of distribution", |report, row| &report.row(row).out_of_distribution),
    ];
    for (line, (name, domain)) in domains.into_iter().enumerate() {
        let top = y + (HEIGHT + GAPS[1]) * line as f64;
        let style = TextStyle::new(18, Anchor::Start).bold();
        canvas.text((x - 62.0, top - 46.0), name, style);
        for (head, parameter) in PARAMETER_NAMES.into_iter().enumerate() {
            let left = x + (WIDTH + GAPS[0]) * head as f64;
            let frame = Rect { x: left, y: top, width: WIDTH, height: HEIGHT };
            let axes =
                Axes { frame, x: Range { low: 0.0, high: 1.0 }, y: Range { low: 0.0, high: SHARE_MAX } };
            canvas.text((left, top - 14.0), parameter, TextStyle::new(17, Anchor::Start));
            draw_panel(&axes, head, |row| domain(report, row).calibration.as_ref(), canvas);
            if head == 0 {
                axes.draw_y_ticks(canvas);
            }
            if line == 1 {
                axes.draw_x_ticks(canvas);
            }
        }
    }
    let below = y + 2.0 * HEIGHT + GAPS[1] + 56.0;
    let middle = x + 2.0 * WIDTH + 1.5 * GAPS[0];
    let label = "probability integral transform of the measurement [-]";
    canvas.text((middle, below), label, TextStyle::new(18, Anchor::Middle));
    draw_legend(&SHOWN, (x + 4.0 * (WIDTH + GAPS[0]), y + 20.0), canvas);
}

fn draw_panel<'a>(
    axes: &Axes,
    head: usize,
    calibration: impl Fn(Row) -> Option<&'a CalibrationReport>,
    canvas: &mut Canvas,
) {
    axes.draw_rules(canvas);
    let calibrated = Stroke { dash: "8 5", ..Stroke::solid(Rgb::INK_SOFT, 1.5) };
    canvas.line(axes.place(0.0, 0.1), axes.place(1.0, 0.1), calibrated);
    canvas.clipped(axes.frame, |canvas| {
        for row in SHOWN.into_iter().rev() {
            let Some(calibration) = calibration(row) else { continue };
            let transforms = &calibration.heads[head].transforms;
            let width = 1.0 / transforms.len() as f64;
            let step = |(tenth, share): (usize, &f64)| {
                let low = tenth as f64 * width;
                [axes.place(low, *share), axes.place(low + width, *share)]
            };
            if transforms.iter().all(|share| share.is_finite()) {
                let points: Vec<Point> = transforms.iter().enumerate().flat_map(step).collect();
                canvas.polyline(&points, stroke(row));
            }
        }
    });
    axes.draw_frame(canvas);
}
