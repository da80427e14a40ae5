//! The catalogue of effects, in words and as what each does to a drive: one row per effect, one column per measured
//! quantity.

mod text;

use sim_to_real::Signature;

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN, PAGE_WIDTH};
use crate::colour::Rgb;
pub use text::{page, text};

const TOP: f64 = 130.0;
const LEFT: f64 = 250.0;
const ROW: f64 = 92.0;
const HEIGHT: f64 = 62.0;
const GAP: f64 = 68.0;
const BELOW: f64 = 70.0;
/// Changes below this are drawn as none, in the quantity's unit.
const NOTHING: f64 = 1e-3;

/// A quantity: its name with unit, and its values.
type Quantity = (&'static str, fn(&Signature) -> &[f64]);
const QUANTITIES: [Quantity; 4] = [
    ("speed [m/s]", |signature| &signature.speed_mps),
    ("yaw rate [rad/s]", |signature| &signature.yaw_rate_radps),
    ("yaw [rad]", |signature| &signature.yaw_rad),
    ("distance of positions [m]", |signature| &signature.distance_m),
];

/// Draws all signatures as the bytes of a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(signatures: &[Signature]) -> Result<Vec<u8>, EncodeError> {
    let title = "What each effect changes in what is measured";
    let mut canvas = Canvas::titled(TOP + ROW * signatures.len() as f64 + BELOW, title, &[]);
    let n = QUANTITIES.len() as f64;
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP * (n - 1.0)) / n;
    for (column, (name, values)) in QUANTITIES.iter().enumerate() {
        let x = LEFT + (width + GAP) * column as f64;
        canvas.text((x, TOP - 24.0), name, TextStyle::new(18, Anchor::Start));
        for (row, signature) in signatures.iter().enumerate() {
            let frame = Rect { x, y: TOP + ROW * row as f64, width, height: HEIGHT };
            let is_last = row + 1 == signatures.len();
            draw_strip(&signature.time_s, values(signature), (frame, is_last), &mut canvas);
        }
    }
    for (row, signature) in signatures.iter().enumerate() {
        draw_name(signature, TOP + ROW * row as f64, &mut canvas);
    }
    canvas.png()
}

/// The effect and the values it was tried with.
fn draw_name(signature: &Signature, y: f64, canvas: &mut Canvas) {
    let description = signature.effect.description();
    canvas.text((MARGIN, y + 20.0), description.id, TextStyle::new(17, Anchor::Start).bold());
    let values = signature.effect.values();
    let told = |(parameter, value): (&bicycle::effect::Parameter, f64)| match parameter.unit {
        "-" => format!("{value}"),
        unit => format!("{value} {unit}"),
    };
    let told: Vec<String> = description.parameters.iter().zip(values).map(told).collect();
    let style = TextStyle::new(15, Anchor::Start).coloured(Rgb::INK_SOFT);
    canvas.text((MARGIN, y + 42.0), &told.join(", "), style);
}

fn draw_strip(time_s: &[f64], values: &[f64], (frame, is_last): (Rect, bool), canvas: &mut Canvas) {
    let last_s = time_s.last().copied().unwrap_or(1.0);
    let (low, high) =
        values.iter().fold((-NOTHING, NOTHING), |(low, high), value| (low.min(*value), high.max(*value)));
    let air = 0.12 * (high - low);
    let axes =
        Axes { frame, x: Range { low: 0.0, high: last_s }, y: Range { low: low - air, high: high + air } };
    let zero = [axes.place(0.0, 0.0), axes.place(last_s, 0.0)];
    canvas.polyline(&zero, Stroke::solid(Rgb::INK_SOFT, 1.0));
    if values.iter().any(|value| value.abs() > NOTHING) {
        let points: Vec<Point> =
            time_s.iter().zip(values).map(|(time_s, value)| axes.place(*time_s, *value)).collect();
        canvas.polyline(&points, Stroke::solid(Rgb::ROLL, 2.0));
        axes.draw_y_ticks(canvas);
        let most = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let style = TextStyle::new(14, Anchor::End).coloured(Rgb::INK_SOFT);
        canvas.text((frame.right() - 6.0, frame.y + 16.0), &format!("\u{b1}{most:.2} at most"), style);
    }
    axes.draw_frame(canvas);
    if is_last {
        axes.draw_x_ticks(canvas);
        axes.draw_x_label(canvas, "time [s]");
    }
}
