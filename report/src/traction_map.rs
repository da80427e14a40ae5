//! A judged traction map as a picture: what the ground looks like, what was measured, predicted and fused there, and
//! how far each is off.

mod text;

use bench::traction_map::{Head, Judgement, Source, TractionMapReport};
use formats::TractionMap;
use terrain::{GridGeometry, GridMap};
use traversability::{Bins, Pmf};

use crate::axes::{Axes, Range, number};
use crate::canvas::EncodeError;
use crate::canvas::{Anchor, Canvas, Image, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::colour_bar::ColourBar;
pub use text::text;

const MAPS_TOP: f64 = 140.0;
const LEFT: f64 = 90.0;
const PANEL_WIDTH: f64 = 310.0;
const PANEL_GAP: f64 = 26.0;
/// Above a row of maps: room for titles. Below: room for ticks.
const ROW_GAP: f64 = 96.0;
const PANEL_HEIGHT_MAX: f64 = 620.0;
const BARS_HEIGHT: f64 = 260.0;
const BARS_WIDTH: f64 = 520.0;
const SOFT: TextStyle = TextStyle::new(16, Anchor::Middle).coloured(Rgb::INK_SOFT);

/// Draws a judged traction map as a PNG of 1600 px width; `title` names the map.
///
/// # Errors
/// The encoder refuses.
pub fn picture(title: &str, map: &TractionMap, judgement: &Judgement) -> Result<Vec<u8>, EncodeError> {
    page(title, map, judgement).png()
}

fn page(title: &str, map: &TractionMap, judgement: &Judgement) -> Canvas {
    let window = Window::around(&map.known);
    let row_height = window.panel_height() + ROW_GAP;
    let bars_top = MAPS_TOP + 3.0 * row_height + 30.0;
    let mut canvas = Canvas::titled(bars_top + BARS_HEIGHT + 90.0, title, &[&subtitle(&judgement.report)]);
    draw_ground(map, judgement, &window, &mut canvas);
    let heads = [
        (
            "linear",
            [&map.measured.linear, &map.predicted.linear],
            [&judgement.prior.linear, &judgement.fused.linear],
        ),
        (
            "angular",
            [&map.measured.angular, &map.predicted.angular],
            [&judgement.prior.angular, &judgement.fused.angular],
        ),
    ];
    for (row, (name, [measured, predicted], [prior, fused])) in heads.into_iter().enumerate() {
        let top = MAPS_TOP + (row + 1) as f64 * row_height;
        draw_tractions(name, [measured, predicted, prior, fused], &map.known, &window.at(top), &mut canvas);
    }
    let report = &judgement.report;
    draw_errors("linear traction", &report.linear, 250.0, bars_top, &mut canvas);
    draw_errors("angular traction", &report.angular, 1030.0, bars_top, &mut canvas);
    canvas
}

fn subtitle(report: &TractionMapReport) -> String {
    format!(
        "{} cells with measured traction, {} out of distribution, {} with something above the ground · metres east and \
         north · mean traction",
        report.n_cells, report.n_out_of_distribution, report.n_obstructed
    )
}

/// The part of a map that is shown.
struct Window {
    geometry: GridGeometry,
    rows: [usize; 2],
    cols: [usize; 2],
    top: f64,
}

impl Window {
    /// All cells that are known.
    fn around(known: &GridMap<bool>) -> Self {
        let geometry = *known.geometry();
        let (mut rows, mut cols) = ([usize::MAX, 0], [usize::MAX, 0]);
        for (index, _) in known.values().iter().enumerate().filter(|(_, known)| **known) {
            let cell = geometry.cell(index);
            rows = [rows[0].min(cell.row), rows[1].max(cell.row + 1)];
            cols = [cols[0].min(cell.col), cols[1].max(cell.col + 1)];
        }
        Self { geometry, rows, cols, top: MAPS_TOP }
    }

    fn at(&self, top: f64) -> Self {
        Self { top, ..*self }
    }

    fn pixels_per_cell(&self) -> f64 {
        let (n_rows, n_cols) = (self.rows[1] - self.rows[0], self.cols[1] - self.cols[0]);
        (PANEL_WIDTH / n_cols as f64).min(PANEL_HEIGHT_MAX / n_rows as f64)
    }

    fn panel_height(&self) -> f64 {
        (self.pixels_per_cell() * (self.rows[1] - self.rows[0]) as f64).round()
    }

    /// The axes of one panel of the row.
    fn axes(&self, column: usize) -> Axes {
        let metres = |cells: [usize; 2], origin: i64| Range {
            low: (origin + cells[0] as i64) as f64 * self.geometry.resolution_m,
            high: (origin + cells[1] as i64) as f64 * self.geometry.resolution_m,
        };
        let width = (self.pixels_per_cell() * (self.cols[1] - self.cols[0]) as f64).round();
        let x = LEFT + column as f64 * (PANEL_WIDTH + PANEL_GAP);
        Axes {
            frame: Rect { x, y: self.top, width, height: self.panel_height() },
            x: metres(self.cols, self.geometry.origin[0]),
            y: metres(self.rows, self.geometry.origin[1]),
        }
    }

    /// Paints one value per cell; what has no colour is unseen.
    fn draw(&self, column: usize, title: &str, colour: impl Fn(usize) -> Option<Rgb>, canvas: &mut Canvas) {
        let axes = self.axes(column);
        let (width, height) = (axes.frame.width as usize, axes.frame.height as usize);
        let pixels = (0..width * height).map(|pixel| {
            let share = [(pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5];
            let col = self.cols[0] + (share[0] / self.pixels_per_cell()) as usize;
            let up = (share[1] / self.pixels_per_cell()) as usize;
            let row = (self.rows[1] - 1).saturating_sub(up);
            colour(row * self.geometry.n_cols + col.min(self.cols[1] - 1)).unwrap_or(Rgb::UNSEEN)
        });
        let image = Image { width, pixels: pixels.collect() };
        canvas.image(axes.frame.x, axes.frame.y, &image);
        axes.draw_frame(canvas);
        axes.draw_x_ticks(canvas);
        if column == 0 {
            axes.draw_y_ticks(canvas);
        }
        let middle = axes.frame.x + axes.frame.width / 2.0;
        canvas.text((middle, axes.frame.y - 14.0), title, TextStyle::new(18, Anchor::Middle));
    }

    /// Where a colour bar beside the last of `n_panels` stands.
    fn beside(&self, n_panels: usize) -> (f64, f64) {
        (LEFT + n_panels as f64 * (PANEL_WIDTH + PANEL_GAP) + 10.0, self.top)
    }
}

/// A ramp over a range of values.
struct Scale {
    ramp: Ramp,
    values: Range,
}

impl Scale {
    fn colour(&self, value: f32) -> Option<Rgb> {
        let share = (f64::from(value) - self.values.low) / self.values.span();
        value.is_finite().then(|| self.ramp.at(share as f32))
    }

    fn bar(&self, title: [&'static str; 2]) -> ColourBar<'static> {
        ColourBar { title, low: self.values.low, high: self.values.high, ramp: self.ramp }
    }
}

fn draw_ground(map: &TractionMap, judgement: &Judgement, window: &Window, canvas: &mut Canvas) {
    let known = |values: &[f32]| {
        let mut known: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
        known.sort_by(f32::total_cmp);
        known
    };
    // One trunk must not take all the colour.
    let at = |values: &[f32], share: f64| {
        let place = (share * (values.len().saturating_sub(1)) as f64).round() as usize;
        values.get(place).copied().map_or(0.0, f64::from)
    };
    let heights_m = known(map.elevation_m.values());
    let (low, high) = (at(&heights_m, 0.01), at(&heights_m, 0.98));
    let height = Scale { ramp: Ramp::SPEED, values: Range { low, high: high.max(low + 0.1) } };
    let density = Scale { ramp: Ramp::SPEED, values: Range { low: -1.0, high: 1.0 } };
    let layers = [
        ("heights as mapped", &map.elevation_m, &height),
        ("filtered ground", &judgement.ground.height_m, &height),
        ("density of the network's features", &map.normalised_density, &density),
    ];
    for (column, (title, values, scale)) in layers.into_iter().enumerate() {
        window.draw(column, title, |index| scale.colour(values.values()[index]), canvas);
    }
    let (x, y) = window.beside(3);
    height.bar(["height", "[m]"]).draw((x, y), canvas);
    density.bar(["density", "[-], below 0: unlike training"]).draw((x + 130.0, y), canvas);
}

fn draw_tractions(
    name: &str,
    maps: [&GridMap<Pmf>; 4],
    known: &GridMap<bool>,
    window: &Window,
    canvas: &mut Canvas,
) {
    let scale = Scale { ramp: Ramp::RISK, values: Range { low: 1.0, high: 0.0 } };
    let titles = ["measured", "predicted elsewhere", "physics prior", "fused"];
    for (column, (title, map)) in titles.into_iter().zip(maps).enumerate() {
        let colour = |index: usize| {
            let mean = map.values()[index].mean(&Bins::TRACTION);
            known.values()[index].then(|| scale.colour(mean)).flatten()
        };
        window.draw(column, &format!("{name}, {title}"), colour, canvas);
    }
    scale.bar(["mean traction", "[-]"]).draw(window.beside(4), canvas);
}

/// The mean error of every source as a dot on its interval.
fn draw_errors(title: &str, head: &Head, x: f64, top: f64, canvas: &mut Canvas) {
    let most = head.scores.iter().map(|score| score.emd2.high).fold(0.0, f64::max);
    let frame = Rect { x, y: top, width: BARS_WIDTH, height: BARS_HEIGHT };
    let n = head.scores.len() as f64;
    let axes = Axes { frame, x: Range { low: 0.0, high: 1.05 * most }, y: Range { low: -n, high: 0.0 } };
    let (ticks, decimals) = axes.x.ticks(6.0);
    for tick in ticks {
        let at = axes.place(tick, 0.0).0;
        canvas.line((at, frame.y), (at, frame.bottom()), Stroke::solid(Rgb::RULE, 1.0));
        canvas.text((at, frame.bottom() + 24.0), &number(tick, decimals), SOFT);
    }
    for (row, score) in head.scores.iter().enumerate() {
        let at = |error: f64| axes.place(error, -(row as f64) - 0.5);
        let (low, high, value) = (at(score.emd2.low), at(score.emd2.high), at(score.emd2.value));
        let chosen = score.source == Source::FusedWithPhysics;
        let colour = if chosen { Rgb::FAILURE } else { Rgb::INK };
        let stroke = Stroke::solid(colour, 2.5);
        canvas.line(low, high, stroke);
        for end in [low, high] {
            canvas.line((end.0, end.1 - 7.0), (end.0, end.1 + 7.0), stroke);
        }
        canvas.circle(value, 7.0, colour, Stroke::solid(Rgb::WHITE, 1.5));
        let name = TextStyle::new(17, Anchor::End).coloured(colour);
        canvas.text((frame.x - 14.0, value.1 + 6.0), score.source.name(), name);
    }
    axes.draw_frame(canvas);
    axes.draw_x_label(canvas, "EMD² to the measured distribution [bins], 95 % over blocks");
    canvas.text((frame.x, frame.y - 14.0), title, TextStyle::new(18, Anchor::Start).bold());
}
