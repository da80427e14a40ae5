//! Whether scores are probabilities.

use bench::gap_score::Calibration;

use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const FRAME: Rect = Rect { x: 150.0, y: 170.0, width: 720.0, height: 720.0 };

pub(super) fn page(calibration: &Calibration, title: &str) -> Option<Canvas> {
    if calibration.bins.is_empty() {
        return None;
    }
    let whole = Range { low: 0.0, high: 1.0 };
    let axes = Axes { frame: FRAME, x: whole, y: whole };
    let mut canvas = Canvas::titled(
        1000.0,
        title,
        &["every effect of every ranking; cases with something that has no name are left out"],
    );
    axes.draw_rules(&mut canvas);
    axes.draw_labelled(
        &mut canvas,
        "score [-]",
        "share of effects that had been added [-], with 95 % Wilson interval",
    );
    let perfect = Stroke { colour: Rgb::INK_SOFT, width: 2.0, dash: "8 6" };
    canvas.line(axes.place(0.0, 0.0), axes.place(1.0, 1.0), perfect);
    let points: Vec<_> = calibration.bins.iter().map(|bin| axes.place(bin.mean_score, bin.share)).collect();
    for (bin, &point) in calibration.bins.iter().zip(&points) {
        let n_true = (bin.share * bin.n as f64).round() as usize;
        let [low, high] = bench::statistics::wilson_interval(n_true, bin.n);
        let ends = [low, high].map(|share| axes.place(bin.mean_score, share));
        canvas.line(ends[0], ends[1], Stroke::solid(Rgb::ROLL, 2.0));
        canvas.circle(point, 8.0, Rgb::ROLL, Stroke::solid(Rgb::WHITE, 1.5));
        let told = format!("{}", bin.n);
        canvas.rimmed_text((point.0 + 14.0, point.1 + 20.0), &told, TextStyle::new(15, Anchor::Start));
    }
    draw_numbers(calibration, &mut canvas);
    Some(canvas)
}

fn draw_numbers(calibration: &Calibration, canvas: &mut Canvas) {
    let told = |value: Option<f64>| value.map_or("none".to_owned(), |value| number(value, 4));
    let lines = [
        ("Brier score, all effects", told(calibration.brier)),
        ("Brier score, first names", told(calibration.brier_first)),
        ("mean distance over the bins", told(calibration.expected_error)),
    ];
    for (place, (name, value)) in lines.iter().enumerate() {
        let y = FRAME.y + 40.0 + 36.0 * place as f64;
        canvas.text((960.0, y), name, TextStyle::new(18, Anchor::Start).coloured(Rgb::INK_SOFT));
        canvas.text((1340.0, y), value, TextStyle::new(18, Anchor::End).bold());
    }
    let soft = TextStyle::new(16, Anchor::Start).coloured(Rgb::INK_SOFT);
    canvas.text((960.0, FRAME.y + 170.0), "numbers beside points: scores in the bin", soft);
    canvas.text((960.0, FRAME.y + 196.0), "dashed: where scores are probabilities", soft);
}
