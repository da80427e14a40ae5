//! Over the ground: every rollout where it began, coloured by its residual, before and after.

use sim_to_real::{GroundMap, GroundResidual};

use super::Pictures;
use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Image, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::colour_bar::ColourBar;

const LEFT: f64 = 100.0;
const TOP: f64 = 160.0;
const PANEL: f64 = 630.0;
const STEP: f64 = 690.0;
/// One of the sizes of a rollout's residual.
type Size = fn(&GroundResidual) -> f64;

/// Vegetation over the heights' colours.
const PLANTS: f32 = 0.45;

pub(super) fn page(pictures: &Pictures<'_>) -> Option<Canvas> {
    let residuals = &pictures.findings.map;
    let window = window(residuals)?;
    let (width, height) = (window[0].span(), window[1].span());
    let pixels_per_m = (PANEL / width).min(900.0 / height);
    let frame = Rect {
        x: LEFT,
        y: TOP,
        width: (width * pixels_per_m).round(),
        height: (height * pixels_per_m).round(),
    };
    let unit = pictures.reference.unit();
    let line = format!("root mean square residual of each rollout, in {unit}, where it began");
    let mut canvas =
        Canvas::titled(TOP + frame.height.max(380.0) + 80.0, "The residual over the ground", &[&line]);
    let worst = worst(residuals);
    let panels: [(&str, Size); 2] = [
        (pictures.reference.model(), |residual| residual.before),
        ("with the announced effects", |residual| residual.after),
    ];
    for (column, (title, value)) in panels.into_iter().enumerate() {
        let frame = Rect { x: LEFT + STEP * column as f64, ..frame };
        let axes = Axes { frame, x: window[0], y: window[1] };
        draw_panel(pictures.ground, &axes, title, &mut canvas);
        canvas.clipped(frame, |canvas| draw_residuals(residuals, value, worst, &axes, canvas));
        if column == 0 {
            axes.draw_y_ticks(&mut canvas);
            axes.draw_y_label(&mut canvas, "north [m]");
        }
    }
    let bar = ColourBar { title: ["residual", "[st. dev.]"], low: 0.0, high: worst, ramp: Ramp::RISK };
    let x = LEFT + 2.0 * STEP + 10.0;
    bar.draw((x, TOP), &mut canvas);
    if pictures.ground.is_some() {
        draw_classes((x, TOP + 290.0), &mut canvas);
    }
    Some(canvas)
}

/// Colours of the terrain's classes.
fn draw_classes((x, y): (f64, f64), canvas: &mut Canvas) {
    for (row, (class, name)) in [(0, "open"), (1, "loose"), (2, "plants")].into_iter().enumerate() {
        let y = y + 30.0 * row as f64;
        canvas.rect(Rect { x, y: y - 14.0, width: 24.0, height: 18.0 }, ground_colour(0.5, class), 1.0);
        canvas.text((x + 34.0, y), name, TextStyle::new(16, Anchor::Start));
    }
}

/// Higher ground is lighter, plants are green, loose ground is grey.
fn ground_colour(height_share: f32, class: u8) -> Rgb {
    let earth = Ramp::GROUND.at(height_share).blend(Rgb::WHITE, 0.35);
    match class {
        2 => earth.blend(Rgb::VEGETATION, PLANTS),
        1 => earth.blend(Rgb::INK_SOFT, 0.25),
        _ => earth,
    }
}

/// East and north around all rollouts, with a margin; equal scales.
fn window(residuals: &[GroundResidual]) -> Option<[Range; 2]> {
    let range = |position: fn(&GroundResidual) -> f64| {
        let positions = residuals.iter().map(position).filter(|position| position.is_finite());
        let [low, high] = positions.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], position| {
            [low.min(position), high.max(position)]
        });
        let margin = 0.08 * (high - low).max(1.0);
        (high >= low).then_some(Range { low: low - margin, high: high + margin })
    };
    Some([range(|residual| residual.x_m)?, range(|residual| residual.y_m)?])
}

/// The value that all but one in fifty rollouts stay below before.
fn worst(residuals: &[GroundResidual]) -> f64 {
    let mut sizes: Vec<f64> =
        residuals.iter().map(|residual| residual.before).filter(|size| size.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let place = (0.98 * sizes.len().saturating_sub(1) as f64) as usize;
    sizes.get(place).copied().unwrap_or(1.0).max(1.0)
}

fn draw_panel(ground: Option<&GroundMap>, axes: &Axes, title: &str, canvas: &mut Canvas) {
    if let Some(ground) = ground {
        canvas.image(axes.frame.x, axes.frame.y, &relief(ground, axes));
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_x_label(canvas, "east [m]");
    let middle = (axes.frame.x + 0.5 * axes.frame.width + 40.0, axes.frame.y - 14.0);
    canvas.text(middle, title, TextStyle::new(18, Anchor::Middle));
}

/// The ground by height and class; what is not mapped is unseen.
fn relief(ground: &GroundMap, axes: &Axes) -> Image {
    let frame = axes.frame;
    let (width, height) = (frame.width as usize, frame.height as usize);
    let finite = || ground.height_m.iter().copied().filter(|height| height.is_finite());
    let (low, high) = (finite().fold(f32::INFINITY, f32::min), finite().fold(f32::NEG_INFINITY, f32::max));
    let pixel = |index: usize| {
        let share = [(index % width) as f64 / frame.width, 1.0 - (index / width) as f64 / frame.height];
        let position_m = [axes.x.low + share[0] * axes.x.span(), axes.y.low + share[1] * axes.y.span()];
        let node: [f64; 2] = std::array::from_fn(|axis| {
            ((position_m[axis] - ground.origin_m[axis]) / ground.resolution_m).round()
        });
        let is_mapped = (0..2).all(|axis| (0.0..ground.n_nodes[axis] as f64).contains(&node[axis]));
        if !is_mapped {
            return Rgb::UNSEEN;
        }
        let place = node[0] as usize * ground.n_nodes[1] + node[1] as usize;
        ground_colour((ground.height_m[place] - low) / (high - low).max(0.01), ground.class[place])
    };
    Image { width, pixels: (0..width * height).map(pixel).collect() }
}

fn draw_residuals(residuals: &[GroundResidual], value: Size, worst: f64, axes: &Axes, canvas: &mut Canvas) {
    // The largest on top.
    let mut ordered: Vec<_> = residuals.iter().filter(|residual| value(residual).is_finite()).collect();
    ordered.sort_by(|a, b| value(a).total_cmp(&value(b)));
    for residual in ordered {
        let share = (value(residual) / worst).clamp(0.0, 1.0);
        let place = axes.place(residual.x_m, residual.y_m);
        canvas.circle(
            place,
            4.0 + 4.0 * share,
            Ramp::RISK.at(share as f32),
            Stroke::solid(Rgb::INK_SOFT, 0.6),
        );
    }
}
