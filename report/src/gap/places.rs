//! Where: shares by condition with their null, and the strongest conditions bin by bin.

use sim_to_real::{Condition, ConditionBin, ConditionTable};

use super::{AFTER, BEFORE, FLOOR, Pictures, Reference, draw_legend, words};
use crate::axes::{Axes, Range, number};
use crate::canvas::MARGIN;
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const BARS: Rect = Rect { x: 260.0, y: 150.0, width: 520.0, height: 0.0 };
const ROW: f64 = 44.0;
const PANEL: Rect = Rect { x: 110.0, y: 0.0, width: 400.0, height: 210.0 };
const PANEL_STEP: [f64; 2] = [505.0, 330.0];
/// Conditions that are shown bin by bin.
const PANELS: usize = 6;

pub(super) fn page(pictures: &Pictures<'_>) -> Option<Canvas> {
    let mut tables: Vec<&ConditionTable> =
        pictures.findings.conditions.iter().filter(|table| table.share.is_finite()).collect();
    let rank = |table: &ConditionTable| announced(table).unwrap_or(table.share);
    tables.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    if tables.is_empty() {
        return None;
    }
    let is_binned = |table: &&ConditionTable| table.condition != Condition::Constant && table.bins.len() > 1;
    let binned: Vec<_> = tables.iter().copied().filter(is_binned).take(PANELS).collect();
    let bars_height = ROW * tables.len() as f64;
    let panels_top = BARS.y + bars_height + 190.0;
    let height = panels_top + PANEL_STEP[1] * binned.len().div_ceil(3) as f64 - 40.0;
    let line = "share of the squared normalised residual's variance that bins of a condition explain";
    let mut canvas = Canvas::titled(height, "Where the residual lies", &[line]);
    draw_bars(&tables, (Rect { height: bars_height, ..BARS }, pictures.reference), &mut canvas);
    draw_panels(&binned, (panels_top, pictures.reference), &mut canvas);
    Some(canvas)
}

/// Through what is announced, where that is told.
fn announced(table: &ConditionTable) -> Option<f64> {
    table.announced_share.filter(|share| share.is_finite())
}

fn draw_bars(tables: &[&ConditionTable], (frame, reference): (Rect, Reference), canvas: &mut Canvas) {
    let whole = |table: &ConditionTable| (table.share + table.null_share).max(0.0);
    let most = tables.iter().map(|table| whole(table)).fold(0.1, f64::max);
    let n = tables.len() as f64;
    let axes = Axes { frame, x: Range { low: 0.0, high: 1.08 * most }, y: Range { low: -n, high: 0.0 } };
    for (row, table) in tables.iter().enumerate() {
        let centre = -(row as f64) - 0.5;
        let (x, y) = axes.place(whole(table), centre);
        let stands_out = table.share > crate::gap::text::STANDS_OUT;
        let colour = if stands_out { BEFORE } else { Rgb::RULE };
        canvas.rect(Rect { x: frame.x, y: y - 12.0, width: x - frame.x, height: 24.0 }, colour, 0.9);
        if let Some(share) = announced(table) {
            let right = axes.place(share.clamp(0.0, axes.x.high), centre).0;
            canvas.rect(Rect { x: frame.x, y: y - 4.0, width: right - frame.x, height: 8.0 }, AFTER, 1.0);
        }
        let null_x = axes.place(table.null_share.clamp(0.0, axes.x.high), centre).0;
        canvas.line((null_x, y - 17.0), (null_x, y + 17.0), Stroke::solid(Rgb::INK, 3.0));
        let style =
            TextStyle::new(18, Anchor::End).coloured(if stands_out { Rgb::INK } else { Rgb::INK_SOFT });
        canvas.text((frame.x - 14.0, y + 6.0), words::condition(table.condition).0, style);
        let told = if table.share < 0.0 {
            format!("{} below the null", number(-table.share, 2))
        } else {
            format!("{} above the null", number(table.share, 2))
        };
        let place = (frame.right() + 16.0, y + 6.0);
        canvas.text(place, &told, TextStyle::new(16, Anchor::Start).coloured(Rgb::INK_SOFT));
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_x_label(canvas, "share explained [-]");
    let entries =
        [("stands out", Stroke::solid(BEFORE, 12.0)), ("within the null", Stroke::solid(Rgb::RULE, 12.0))];
    draw_legend(&entries, (frame.right() + 260.0, frame.y + 30.0), canvas);
    let name = format!("the null: {}", reference.floor());
    let null = [(name.as_str(), Stroke::solid(Rgb::INK, 3.0))];
    draw_legend(&null, (frame.right() + 260.0, frame.y + 64.0), canvas);
    if tables.iter().any(|table| announced(table).is_some()) {
        let told = [("through what is announced, which orders them", Stroke::solid(AFTER, 8.0))];
        draw_legend(&told, (frame.right() + 260.0, frame.y + 98.0), canvas);
    }
}

fn draw_panels(tables: &[&ConditionTable], (top, reference): (f64, Reference), canvas: &mut Canvas) {
    if tables.is_empty() {
        return;
    }
    let title = "Bin by bin, the strongest conditions";
    canvas.text((MARGIN, top - 62.0), title, TextStyle::new(22, Anchor::Start).bold());
    let entries = [
        ("real drives", Stroke::solid(BEFORE, 3.0)),
        (reference.floor(), Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 3.0) }),
    ];
    draw_legend(&entries, (560.0, top - 62.0), canvas);
    for (place, table) in tables.iter().enumerate() {
        let (column, row) = ((place % 3) as f64, (place / 3) as f64);
        let frame = Rect { x: PANEL.x + column * PANEL_STEP[0], y: top + row * PANEL_STEP[1], ..PANEL };
        draw_panel(table, frame, largest(tables), canvas);
    }
}

fn size(square: f64) -> f64 {
    square.max(0.0).sqrt()
}

/// The largest residual of any bin, so that all panels share a scale [-].
fn largest(tables: &[&ConditionTable]) -> f64 {
    let bins = tables.iter().flat_map(|table| &table.bins);
    let sizes = bins.flat_map(|bin| [size(bin.mean_square), size(bin.null_mean_square)]);
    sizes.filter(|size| size.is_finite()).fold(1.0, f64::max)
}

fn draw_panel(table: &ConditionTable, frame: Rect, most: f64, canvas: &mut Canvas) {
    let low = table.bins.iter().map(|bin| bin.low).fold(f64::INFINITY, f64::min);
    let high = table.bins.iter().map(|bin| bin.high).fold(f64::NEG_INFINITY, f64::max);
    let x = if high > low { Range { low, high } } else { Range { low: low - 0.5, high: low + 0.5 } };
    let axes = Axes { frame, x, y: Range { low: 0.0, high: 1.1 * most } };
    axes.draw_rules(canvas);
    let null: fn(&ConditionBin) -> f64 = |bin| bin.null_mean_square;
    let real: fn(&ConditionBin) -> f64 = |bin| bin.mean_square;
    let dashed = Stroke { dash: "7 5", ..Stroke::solid(FLOOR, 3.0) };
    for (value, stroke) in [(null, dashed), (real, Stroke::solid(BEFORE, 3.0))] {
        let steps = table.bins.iter().filter(|bin| value(bin).is_finite());
        let points: Vec<Point> =
            steps.flat_map(|bin| [bin.low, bin.high].map(|x| axes.place(x, size(value(bin))))).collect();
        canvas.polyline(&points, stroke);
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    let (name, unit) = words::condition(table.condition);
    axes.draw_x_label(canvas, &format!("{name} [{unit}]"));
    axes.draw_y_label(canvas, "residual [standard deviations]");
}
