//! What learned evidence weighs against its prior.

use bench::learning::{Absurd, Ground, GroundEvidence, Report, Row};

use super::curves::{draw_boundary, middle_m, unevenness_range};
use super::{draw_legend, draw_title, look, stroke};
use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

/// Grounds of the right panel, from above.
const GROUNDS: [Ground; 8] = [
    Ground::Validation,
    Ground::InDistribution,
    Ground::Absurd(Absurd::Wall),
    Ground::Absurd(Absurd::Spike),
    Ground::Absurd(Absurd::Noise),
    Ground::Absurd(Absurd::Vegetation),
    Ground::Absurd(Absurd::Loose),
    Ground::Absurd(Absurd::Obstacle),
];
const WEIGHT: Range = Range { low: 0.0, high: 1.0 };
/// What the rules ask for: above in distribution, below elsewhere.
const LIMITS: [f64; 2] = [0.9, 0.1];

/// Median weight per bin of unevenness, with what 90 % of the footprints have for PIETRA.
pub(super) fn draw_over_unevenness(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let axes = Axes { frame, x: unevenness_range(report), y: WEIGHT };
    draw_title("Weight of what was learned, median; shaded: PIETRA, 5 to 95 %", frame, canvas);
    axes.draw_rules(canvas);
    let places = |row: Row, of: &dyn Fn(&GroundEvidence) -> f64| -> Vec<_> {
        let bins = (0..report.unevenness_bins.len()).filter_map(|bin| {
            let evidence = report.evidence_of(row)?.on(Ground::Uneven(bin))?;
            of(evidence).is_finite().then(|| axes.place(middle_m(report, bin), of(evidence)))
        });
        bins.collect()
    };
    let mut outline = places(Row::Pietra, &|evidence| evidence.weight.p95);
    outline.extend(places(Row::Pietra, &|evidence| evidence.weight.p05).into_iter().rev());
    if outline.len() > 2 {
        canvas.polygon(&outline, look(Row::Pietra).0, 0.15);
    }
    let rows: Vec<Row> = report.evidence.iter().map(|evidence| evidence.row).collect();
    for &row in rows.iter().rev() {
        canvas.polyline(&places(row, &|evidence| evidence.weight.p50), stroke(row));
    }
    draw_boundary(report, &axes, canvas);
    axes.draw_labelled(
        canvas,
        "standard deviation of elevation under the footprint [m]",
        "n / (n + n_prior) [-]",
    );
    draw_legend(&rows, (frame.right() - 180.0, frame.y + 30.0), canvas);
}

/// Medians and what 90 % of the footprints have, on familiar and on absurd ground.
pub(super) fn draw_by_ground(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let labels = 240.0;
    let frame = Rect { x: frame.x + labels, width: frame.width - labels, ..frame };
    let axes = Axes { frame, x: WEIGHT, y: Range { low: -(GROUNDS.len() as f64), high: 0.0 } };
    let title = Rect { x: frame.x - labels + 62.0, ..frame };
    draw_title("The same on familiar and on absurd ground, 5, 50 and 95 %", title, canvas);
    for tick in [0.0, 0.2, 0.4, 0.6, 0.8, 1.0] {
        let x = axes.place(tick, 0.0).0;
        canvas.line((x, frame.y), (x, frame.bottom()), Stroke::solid(Rgb::RULE, 1.0));
        let style = TextStyle::new(16, Anchor::Middle).coloured(Rgb::INK_SOFT);
        canvas.text((x, frame.bottom() + 24.0), &number(tick, 1), style);
    }
    for limit in LIMITS {
        let x = axes.place(limit, 0.0).0;
        let line = Stroke { dash: "8 5", ..Stroke::solid(Rgb::INK, 1.5) };
        canvas.line((x, frame.y), (x, frame.bottom()), line);
    }
    for (place, &ground) in GROUNDS.iter().enumerate() {
        let y = axes.place(0.0, -(place as f64) - 0.5).1;
        canvas.text((frame.x - 14.0, y + 6.0), &ground.name(), TextStyle::new(17, Anchor::End));
        let n = report.evidence.len() as f64;
        for (index, evidence) in report.evidence.iter().enumerate() {
            let offset = 9.0 * (index as f64 - 0.5 * (n - 1.0));
            if let Some(found) = evidence.on(ground) {
                draw_weight(evidence.row, found, &axes, y + offset, canvas);
            }
        }
    }
    axes.draw_frame(canvas);
    axes.draw_x_label(canvas, "n / (n + n_prior) [-]; dashed: the rules' limits");
}

fn draw_weight(row: Row, found: &GroundEvidence, axes: &Axes, y: f64, canvas: &mut Canvas) {
    let weight = &found.weight;
    if weight.p50.is_finite() {
        let x = |value: f64| axes.place(value, 0.0).0;
        let (colour, _) = look(row);
        canvas.line((x(weight.p05), y), (x(weight.p95), y), Stroke::solid(colour, 2.0));
        canvas.circle((x(weight.p50), y), 4.5, colour, Stroke::solid(Rgb::WHITE, 1.0));
    }
}
