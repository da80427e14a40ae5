//! A held-out drive over time: measured, predicted by the nominal model, predicted by the repaired one.

use super::{AFTER, BEFORE, Reference, draw_legend};
use crate::axes::{Axes, Range};
use crate::canvas::{Canvas, Point, Rect, Stroke};
use crate::colour::Rgb;

/// What was measured at an instant and what both models had predicted for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutSample {
    /// Time of the measurement [s].
    pub time_s: f64,
    /// Yaw rate: measured, nominal, repaired [rad/s].
    pub yaw_rate_radps: [f64; 3],
    /// Forward speed: measured, nominal, repaired [m/s].
    pub speed_mps: [f64; 3],
    /// Distance of the predicted from the measured position: nominal, repaired [m].
    pub position_error_m: [f64; 2],
}

/// One held-out drive with predictions of one horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOutStrip {
    /// Name of the drive.
    pub drive: String,
    /// How far ahead was predicted [s].
    pub horizon_s: f64,
    /// In the order of time.
    pub samples: Vec<HeldOutSample>,
}

const LEFT: f64 = 110.0;
const TOP: f64 = 190.0;
const WIDTH: f64 = 1440.0;
const HEIGHT: f64 = 210.0;
const STEP: f64 = 290.0;

type Curve = (fn(&HeldOutSample) -> f64, Stroke);

pub(super) fn page(strip: &HeldOutStrip, reference: Reference) -> Canvas {
    let line = format!(
        "{} · every value as predicted {:.1} s ahead of its measurement",
        strip.drive, strip.horizon_s
    );
    let mut canvas = Canvas::titled(TOP + 3.0 * STEP, "A held-out drive", &[&line]);
    // Where both predictions are the same, the wider one shows below the other.
    let [measured, nominal, repaired] =
        [Stroke::solid(Rgb::INK, 4.0), Stroke::solid(BEFORE, 4.5), Stroke::solid(AFTER, 2.0)];
    let entries =
        [("measured", measured), (reference.model(), nominal), ("with the announced effects", repaired)];
    draw_legend(&entries, (LEFT, 122.0), &mut canvas);
    let yaw_rates: [Curve; 3] = [
        (|sample| sample.yaw_rate_radps[0], measured),
        (|sample| sample.yaw_rate_radps[1], nominal),
        (|sample| sample.yaw_rate_radps[2], repaired),
    ];
    let speeds: [Curve; 3] = [
        (|sample| sample.speed_mps[0], measured),
        (|sample| sample.speed_mps[1], nominal),
        (|sample| sample.speed_mps[2], repaired),
    ];
    let errors: [Curve; 2] =
        [(|sample| sample.position_error_m[0], nominal), (|sample| sample.position_error_m[1], repaired)];
    draw_strip(strip, &yaw_rates, "yaw rate [rad/s]", 0, &mut canvas);
    draw_strip(strip, &speeds, "forward speed [m/s]", 1, &mut canvas);
    let axes = draw_strip(strip, &errors, "position error [m]", 2, &mut canvas);
    axes.draw_x_label(&mut canvas, "time [s]");
    canvas
}

fn draw_strip(strip: &HeldOutStrip, curves: &[Curve], label: &str, row: usize, canvas: &mut Canvas) -> Axes {
    let frame = Rect { x: LEFT, y: TOP + STEP * row as f64, width: WIDTH, height: HEIGHT };
    let values = strip.samples.iter().flat_map(|sample| curves.iter().map(|(value, _)| value(sample)));
    let axes = Axes {
        frame,
        x: range(strip.samples.iter().map(|sample| sample.time_s), 0.0),
        y: range(values, 0.06),
    };
    axes.draw_rules(canvas);
    canvas.clipped(frame, |canvas| {
        for (value, stroke) in curves {
            let points: Vec<Point> = strip
                .samples
                .iter()
                .map(|sample| axes.place(sample.time_s, value(sample)))
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .collect();
            canvas.polyline(&points, *stroke);
        }
    });
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_y_label(canvas, label);
    axes
}

/// All finite values, with some air.
fn range(values: impl Iterator<Item = f64>, air: f64) -> Range {
    let [low, high] = values
        .filter(|value| value.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    if high <= low {
        let middle = if low.is_finite() { low } else { 0.0 };
        return Range { low: middle - 0.5, high: middle + 0.5 };
    }
    Range { low: low - air * (high - low), high: high + air * (high - low) }
}
