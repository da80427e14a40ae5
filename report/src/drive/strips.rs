//! Speed and attitude over time, below the map.

use super::{DrivePicture, PathSample};
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;
use crate::view::{LEFT, LEGEND_X, MAP_WIDTH};

/// Height of both strips with their axis [px].
pub(super) const HEIGHT: f64 = SPEED_HEIGHT + GAP + ATTITUDE_HEIGHT + 75.0;

const SPEED_HEIGHT: f64 = 150.0;
const ATTITUDE_HEIGHT: f64 = 210.0;
const GAP: f64 = 46.0;
const LINE: f64 = 2.5;

/// A curve and its name.
struct Curve {
    name: &'static str,
    colour: Rgb,
    value: fn(&PathSample) -> f64,
    /// Pattern of its limits; they differ so that equal limits show both.
    limit_dash: &'static str,
}

impl Curve {
    fn limit_stroke(&self) -> Stroke {
        Stroke { colour: self.colour, width: 2.0, dash: self.limit_dash }
    }
}

const SPEED: Curve =
    Curve { name: "speed", colour: Rgb::INK, value: |sample| sample.speed_mps, limit_dash: "" };
const ROLL: Curve = Curve {
    name: "roll",
    colour: Rgb::ROLL,
    value: |sample| sample.roll_rad.to_degrees(),
    limit_dash: "14 10",
};
const PITCH: Curve = Curve {
    name: "pitch",
    colour: Rgb::PITCH,
    value: |sample| sample.pitch_rad.to_degrees(),
    limit_dash: "4 6",
};

pub(super) fn draw(picture: &DrivePicture<'_>, top: f64, canvas: &mut Canvas) {
    let last_s = picture.driven.last().map_or(0.0, |sample| sample.time_s);
    let strip = |y: f64, height: f64, values: Range| Axes {
        frame: Rect { x: LEFT, y, width: MAP_WIDTH, height },
        x: Range { low: 0.0, high: last_s.max(1.0) },
        y: values,
    };
    let speed = strip(top, SPEED_HEIGHT, shown(picture, &[&SPEED], 0.0));
    draw_strip(picture, &speed, &[(&SPEED, None)], canvas);
    speed.draw_y_label(canvas, "speed [m/s]");

    let limits = &picture.vehicle.limits;
    let (roll_max_deg, pitch_max_deg) = (limits.roll_max_rad.to_degrees(), limits.pitch_max_rad.to_degrees());
    let values = shown(picture, &[&ROLL, &PITCH], roll_max_deg.max(pitch_max_deg));
    let attitude = strip(speed.frame.bottom() + GAP, ATTITUDE_HEIGHT, values);
    let curves = [(&ROLL, Some(roll_max_deg)), (&PITCH, Some(pitch_max_deg))];
    draw_strip(picture, &attitude, &curves, canvas);
    attitude.draw_y_label(canvas, "attitude [deg]");
    attitude.draw_x_ticks(canvas);
    attitude.draw_x_label(canvas, "time [s]");
}

/// All that the curves reach, and plus and minus `limit`, with some air.
fn shown(picture: &DrivePicture<'_>, curves: &[&Curve], limit: f64) -> Range {
    let values = picture.driven.iter().flat_map(|sample| curves.iter().map(|curve| (curve.value)(sample)));
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((-limit, limit), |(low, high), value| (low.min(value), high.max(value)));
    let air = 0.08 * (high - low).max(0.1);
    Range { low: if low < 0.0 { low - air } else { low }, high: high + air }
}

/// Curves over their limits, named at the right.
fn draw_strip(
    picture: &DrivePicture<'_>,
    axes: &Axes,
    curves: &[(&Curve, Option<f64>)],
    canvas: &mut Canvas,
) {
    axes.draw_rules(canvas);
    let zero = [axes.place(axes.x.low, 0.0), axes.place(axes.x.high, 0.0)];
    canvas.polyline(&zero, Stroke::solid(Rgb::INK_SOFT, 1.0));
    for (row, (curve, limit)) in curves.iter().enumerate() {
        canvas.clipped(axes.frame, |canvas| {
            if let Some(limit) = limit {
                draw_limits(axes, *limit, curve, canvas);
            }
            let points: Vec<Point> = picture
                .driven
                .iter()
                .map(|sample| axes.place(sample.time_s, (curve.value)(sample)))
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .collect();
            canvas.polyline(&points, Stroke::solid(curve.colour, LINE));
        });
        draw_name(curve, *limit, (LEGEND_X, axes.frame.y + 16.0 + 58.0 * row as f64), canvas);
    }
    axes.draw_frame(canvas);
    axes.draw_y_ticks(canvas);
}

fn draw_limits(axes: &Axes, limit: f64, curve: &Curve, canvas: &mut Canvas) {
    for value in [-limit, limit] {
        let ends = [axes.place(axes.x.low, value), axes.place(axes.x.high, value)];
        canvas.polyline(&ends, curve.limit_stroke());
    }
}

fn draw_name(curve: &Curve, limit: Option<f64>, (x, y): Point, canvas: &mut Canvas) {
    let text = TextStyle::new(17, Anchor::Start);
    canvas.line((x, y - 6.0), (x + 34.0, y - 6.0), Stroke::solid(curve.colour, LINE + 0.5));
    canvas.text((x + 46.0, y), curve.name, text);
    if let Some(limit) = limit {
        canvas.line((x, y + 18.0), (x + 34.0, y + 18.0), curve.limit_stroke());
        canvas.text(
            (x + 46.0, y + 24.0),
            &format!("its limit, ±{limit:.0} deg"),
            text.coloured(Rgb::INK_SOFT),
        );
    }
}
