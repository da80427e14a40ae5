//! What swings: the spectrum of the yaw rate that the commands leave unexplained, in which something stands out.

use sim_to_real::{Spectrum, SwingOver};

use super::{BEFORE, FLOOR, Pictures, draw_legend};
use crate::axes::{Axes, Range};
use crate::canvas::{Canvas, MARGIN, Point, Rect, Stroke};

const HEIGHT: f64 = 640.0;
const FRAME: Rect = Rect { x: 140.0, y: 190.0, width: 1380.0, height: 360.0 };

pub(super) fn page(pictures: &Pictures<'_>) -> Option<Canvas> {
    let spectrum = pictures.findings.spectrum.as_ref()?;
    let (low, high) = (spectrum.frequencies.first()?, spectrum.frequencies.last()?);
    let largest = powers(spectrum).into_iter().flat_map(|(_, _, power)| power.iter()).copied();
    let largest = largest.filter(|power| power.is_finite()).fold(1.0, f64::max);
    let line = "power over that of the frequencies about, of the yaw rate that the commanded turning leaves unexplained";
    let mut canvas = Canvas::titled(HEIGHT, "What swings", &[line]);
    let axes = Axes {
        frame: FRAME,
        x: Range { low: *low, high: high.max(low + f64::EPSILON) },
        y: Range { low: 0.0, high: 1.05 * largest },
    };
    axes.draw_rules(&mut canvas);
    for (_, stroke, power) in powers(spectrum) {
        let points = spectrum.frequencies.iter().zip(power).filter(|(_, power)| power.is_finite());
        let points: Vec<Point> = points.map(|(frequency, power)| axes.place(*frequency, *power)).collect();
        canvas.polyline(&points, stroke);
    }
    let entries = powers(spectrum).map(|(name, stroke, _)| (name, stroke));
    draw_legend(&entries, (MARGIN, 130.0), &mut canvas);
    axes.draw_labelled(&mut canvas, over(spectrum.over), "power over its neighbours' [-]");
    Some(canvas)
}

fn powers(spectrum: &Spectrum) -> [(&'static str, Stroke, &[f64]); 2] {
    let dashed = Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 2.0) };
    [
        ("largest of the nominal drives", dashed, &spectrum.nominal),
        ("least of the real drives", Stroke::solid(BEFORE, 2.5), &spectrum.real),
    ]
}

fn over(over: SwingOver) -> &'static str {
    match over {
        SwingOver::Time => "frequency [1/s]",
        SwingOver::Way => "times per metre of the way [1/m]",
    }
}
