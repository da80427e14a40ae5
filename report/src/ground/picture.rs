//! Foretold against met: the probability integral transform of every parameter, and where its bias lies.

use sim_to_real::{Calibration, GroundReport, N_PIT, PARAMETERS, PlaceTable};

use crate::Picture;
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const TOP: f64 = 190.0;
const HEIGHT: f64 = 240.0;
const LEFT: f64 = 90.0;
const GAP: f64 = 80.0;
const BINS_TOP: f64 = 590.0;
const BIN_ROW: f64 = 26.0;
const LEVEL: Stroke = Stroke::solid(Rgb::INK_SOFT, 1.5);
const WHISKER: Stroke = Stroke::solid(Rgb::ROLL, 2.0);
/// Width of the labels beside biases.
const LABELS: f64 = 130.0;

/// Draws it, 1600 px wide; `drives` says whose it is.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &GroundReport, drives: &str) -> Result<Picture, EncodeError> {
    let tables = PARAMETERS.map(|parameter| report.places.iter().find(|table| table.parameter == parameter));
    let n_bins = tables.iter().flatten().map(|table| table.bins.len()).max().unwrap_or(0);
    let height = BINS_TOP + BIN_ROW * n_bins as f64 + 110.0;
    let mut canvas = Canvas::titled(height, "The belief about the ground", &[drives]);
    let width = (PAGE_WIDTH - LEFT - MARGIN - 3.0 * GAP) / 4.0;
    for (column, (calibration, table)) in report.calibration.iter().zip(tables).enumerate() {
        let x = LEFT + (width + GAP) * column as f64;
        draw_transform(calibration, Rect { x, y: TOP, width, height: HEIGHT }, &mut canvas);
        if let Some(table) = table {
            let height = BIN_ROW * table.bins.len() as f64;
            let frame = Rect { x: x + LABELS - 60.0, y: BINS_TOP, width: width - LABELS + 60.0, height };
            draw_bins(table, frame, &mut canvas);
        }
    }
    let caption = "Above: where in what was foretold the measurements lie, level if the belief is calibrated. Below: what was \
                   met less what was foretold, by the condition that tells most."
        .to_owned();
    Ok(Picture { file: "ground.png", caption, png: canvas.png()? })
}

fn draw_transform(calibration: &Calibration, frame: Rect, canvas: &mut Canvas) {
    let most = calibration.pit.iter().copied().fold(0.25, f64::max);
    let axes = Axes { frame, x: Range { low: 0.0, high: 1.0 }, y: Range { low: 0.0, high: 1.1 * most } };
    canvas.text((frame.x, frame.y - 46.0), calibration.parameter, TextStyle::new(20, Anchor::Start).bold());
    canvas.clipped(frame, |canvas| {
        for (cell, share) in calibration.pit.iter().enumerate() {
            let (left, top) = axes.place(cell as f64 / N_PIT as f64, *share);
            let (right, bottom) = axes.place((cell + 1) as f64 / N_PIT as f64, 0.0);
            let bar = Rect { x: left + 1.0, y: top, width: right - left - 2.0, height: bottom - top };
            canvas.rect(bar, Rgb::ROLL, 0.5);
        }
        let level = 1.0 / N_PIT as f64;
        canvas.line(axes.place(0.0, level), axes.place(1.0, level), LEVEL);
    });
    axes.draw_labelled(canvas, "transform of what was met [-]", "share [-]");
}

fn draw_bins(table: &PlaceTable, frame: Rect, canvas: &mut Canvas) {
    let ends = table.bins.iter().flat_map(|bin| bin.bias.interval).map(f64::abs);
    let most = 1.15 * ends.fold(0.02, f64::max);
    let axes = Axes { frame, x: Range { low: -most, high: most }, y: Range { low: 0.0, high: 1.0 } };
    let title = format!("by {}", table.condition.name());
    canvas.text((frame.x + 60.0 - LABELS, frame.y - 18.0), &title, TextStyle::new(17, Anchor::Start));
    canvas.clipped(frame, |canvas| {
        canvas.line(axes.place(0.0, 0.0), axes.place(0.0, 1.0), LEVEL);
    });
    for (row, bin) in table.bins.iter().enumerate() {
        let y = frame.y + BIN_ROW * (row as f64 + 0.5);
        canvas.text((frame.x - 8.0, y + 5.0), &bin.label, TextStyle::new(14, Anchor::End));
        let [low, high] = bin.bias.interval.map(|end| axes.place(end, 0.0).0);
        canvas.line((low, y), (high, y), WHISKER);
        canvas.circle((axes.place(bin.bias.value, 0.0).0, y), 4.0, Rgb::WHITE, WHISKER);
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_x_label(canvas, "met less foretold ([-], [rad])");
}
