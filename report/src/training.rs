//! The curves of a training: loss and validation error over the passes, and the flow's own fit beside them.

use evidential::{Epoch, Phase};

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN, PAGE_WIDTH};
use crate::colour::Rgb;

const PANEL_TOP: f64 = 150.0;
const PANEL_HEIGHT: f64 = 420.0;
const PANEL_LEFT: f64 = 120.0;
const GAP: f64 = 130.0;
const BELOW: f64 = 90.0;

const TRAINING: Rgb = Rgb::ROLL;
const VALIDATION: Rgb = Rgb::PITCH;

/// Draws the curves of a training as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(title: &str, curves: &[Epoch]) -> Result<Vec<u8>, EncodeError> {
    page(title, curves).png()
}

fn page(title: &str, curves: &[Epoch]) -> Canvas {
    let mut canvas = Canvas::titled(PANEL_TOP + PANEL_HEIGHT + BELOW, title, &[]);
    let of =
        |phase: Phase| curves.iter().filter(|epoch| epoch.phase == phase).copied().collect::<Vec<Epoch>>();
    let panels: Vec<_> = [
        (of(Phase::Joint), "predictor and flow", ["training loss", "validation EMD2"]),
        (of(Phase::Flow), "flow alone", ["training, −log density", "validation, −log density"]),
    ]
    .into_iter()
    .filter(|(epochs, ..)| !epochs.is_empty())
    .collect();
    let n = panels.len().max(1) as f64;
    let width = (PAGE_WIDTH - PANEL_LEFT - MARGIN - GAP * (n - 1.0)) / n;
    for (place, (epochs, name, labels)) in panels.iter().enumerate() {
        let x = PANEL_LEFT + (width + GAP) * place as f64;
        let frame = Rect { x, y: PANEL_TOP, width, height: PANEL_HEIGHT };
        draw_panel(epochs, name, labels, frame, &mut canvas);
    }
    canvas
}

fn draw_panel(epochs: &[Epoch], name: &str, labels: &[&str; 2], frame: Rect, canvas: &mut Canvas) {
    let axes =
        Axes { frame, x: Range { low: 0.0, high: (epochs.len() as f64).max(2.0) }, y: value_range(epochs) };
    canvas.text((frame.x, frame.y - 44.0), name, TextStyle::new(20, Anchor::Start).bold());
    axes.draw_rules(canvas);
    let best = epochs.iter().rev().find(|epoch| epoch.is_best);
    let values: [fn(&Epoch) -> f64; 2] = [|epoch| epoch.training_loss, |epoch| epoch.validation_error];
    for ((value, colour), (label, row)) in
        values.into_iter().zip([TRAINING, VALIDATION]).zip(labels.iter().zip([0.0, 1.0]))
    {
        let points: Vec<_> = epochs
            .iter()
            .map(|epoch| axes.place(epoch.epoch as f64, value(epoch).min(axes.y.high)))
            .collect();
        canvas.clipped(frame, |canvas| canvas.polyline(&points, Stroke::solid(colour, 2.5)));
        let y = frame.y + 26.0 + 26.0 * row;
        canvas.line(
            (frame.right() - 260.0, y - 5.0),
            (frame.right() - 226.0, y - 5.0),
            Stroke::solid(colour, 3.0),
        );
        canvas.text((frame.right() - 216.0, y), label, TextStyle::new(17, Anchor::Start));
    }
    if let Some(best) = best {
        let place = axes.place(best.epoch as f64, best.validation_error);
        canvas.circle(place, 6.0, Rgb::WHITE, Stroke::solid(VALIDATION, 3.0));
        let place = (frame.right() - 216.0, frame.y + 78.0);
        let told = format!("kept: {:.4}, pass {}", best.validation_error, best.epoch);
        canvas.text(place, &told, TextStyle::new(17, Anchor::Start).coloured(Rgb::INK_SOFT));
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_x_label(canvas, "passes over the data");
}

/// From a little below the least value to the first quarter of a second pass: the first pass alone would flatten all
/// that follows.
fn value_range(epochs: &[Epoch]) -> Range {
    let values = |epochs: &[Epoch]| -> Vec<f64> {
        epochs.iter().flat_map(|epoch| [epoch.training_loss, epoch.validation_error]).collect()
    };
    let least = values(epochs).into_iter().fold(f64::INFINITY, f64::min);
    let later = if epochs.len() > 4 { &epochs[2..] } else { epochs };
    let largest = values(later).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let margin = 0.06 * (largest - least).max(1e-6);
    Range { low: least - margin, high: largest + margin }
}
