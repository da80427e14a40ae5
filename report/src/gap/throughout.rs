//! Is it the same throughout: what each announced parameter would be in parts of the real drives alone.

use sim_to_real::{Answer, Division, Estimate, NamedEffect, PartEstimate};

use super::{AFTER, BEFORE, draw_legend, text, words};
use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, MARGIN, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const DIVISIONS: [Division; 5] =
    [Division::Time, Division::Drive, Division::Steering, Division::Speed, Division::TerrainClass];
const TOP: f64 = 215.0;
const PANEL: Rect = Rect { x: 110.0, y: 0.0, width: 262.0, height: 220.0 };
const STEP: [f64; 2] = [296.0, 370.0];
/// Parameters that are shown.
const MOST: usize = 4;
/// Half the height of a panel at most, in half-widths of intervals.
const REACH: f64 = 6.0;

pub(super) fn page(answer: &Answer) -> Option<Canvas> {
    let parameters = answer.effects.iter().flat_map(|effect| {
        effect.parameters.iter().map(move |(parameter, whole)| (effect, parameter.as_str(), *whole))
    });
    let told: Vec<(&NamedEffect, &str, Estimate, Vec<&PartEstimate>)> = parameters
        .map(|(effect, parameter, whole)| (effect, parameter, whole, parts_of(answer, effect, parameter)))
        .filter(|(.., parts)| !parts.is_empty())
        .take(MOST)
        .collect();
    if told.is_empty() {
        return None;
    }
    let line =
        "what is announced, fitted to parts of the real drives alone; intervals of 90 %, by chance alone";
    let height = TOP + STEP[1] * told.len() as f64 - 20.0;
    let mut canvas = Canvas::titled(height, "Is it the same throughout", &[line]);
    let entries = [
        ("in a part of the drives", Stroke::solid(BEFORE, 3.0)),
        ("in all of them, as announced", Stroke { dash: "7 5", ..Stroke::solid(AFTER, 3.0) }),
    ];
    draw_legend(&entries, (MARGIN, 130.0), &mut canvas);
    for (row, (effect, parameter, whole, parts)) in told.iter().enumerate() {
        let top = TOP + STEP[1] * row as f64;
        let title = format!("{}: {}", effect.id, text::parameter(text::found(effect), parameter, whole));
        canvas.text((MARGIN, top - 34.0), &title, TextStyle::new(20, Anchor::Start).bold());
        draw_row(parts, *whole, top, &mut canvas);
    }
    Some(canvas)
}

fn parts_of<'a>(answer: &'a Answer, effect: &NamedEffect, parameter: &str) -> Vec<&'a PartEstimate> {
    let is_own = |part: &&PartEstimate| part.effect == effect.id && part.parameter == parameter;
    let is_number = |part: &&PartEstimate| part.estimate.value.is_finite();
    answer.by_part.iter().filter(is_own).filter(is_number).collect()
}

fn draw_row(parts: &[&PartEstimate], whole: Estimate, top: f64, canvas: &mut Canvas) {
    let y = shown(parts, whole);
    let divided = |division: Division| -> Vec<&PartEstimate> {
        parts.iter().copied().filter(|part| part.division == division).collect()
    };
    let panels = DIVISIONS.map(divided).into_iter().filter(|parts| !parts.is_empty());
    for (column, parts) in panels.enumerate() {
        let frame = Rect { x: PANEL.x + STEP[0] * column as f64, y: top, ..PANEL };
        let axes = Axes { frame, x: Range { low: -0.5, high: parts.len() as f64 - 0.5 }, y };
        let places = [whole.low, whole.high].map(|value| axes.place(axes.x.low, value).1);
        canvas.clipped(frame, |canvas| {
            let band = Rect { x: frame.x, y: places[1], width: frame.width, height: places[0] - places[1] };
            canvas.rect(band, AFTER, 0.12);
            let middle = axes.place(axes.x.low, whole.value).1;
            let dashed = Stroke { dash: "7 5", ..Stroke::solid(AFTER, 3.0) };
            canvas.line((frame.x, middle), (frame.right(), middle), dashed);
            parts.iter().enumerate().for_each(|(place, part)| draw_part(place as f64, part, &axes, canvas));
        });
        let style = TextStyle::new(15, Anchor::Middle).coloured(Rgb::INK_SOFT);
        for (place, part) in parts.iter().enumerate() {
            let x = axes.place(place as f64, y.low).0;
            canvas.text((x, frame.bottom() + 22.0), &name(part), style);
        }
        axes.draw_frame(canvas);
        if column == 0 {
            axes.draw_y_ticks(canvas);
        }
        axes.draw_x_label(canvas, words::division(parts[0].division));
    }
}

fn draw_part(place: f64, part: &PartEstimate, axes: &Axes, canvas: &mut Canvas) {
    let [low, value, high] = [part.estimate.low, part.estimate.value, part.estimate.high]
        .map(|value| axes.place(place, value.clamp(axes.y.low - axes.y.span(), axes.y.high + axes.y.span())));
    canvas.line(low, high, Stroke::solid(BEFORE, 3.0));
    for (x, y) in [low, high] {
        canvas.line((x - 7.0, y), (x + 7.0, y), Stroke::solid(BEFORE, 3.0));
    }
    canvas.circle(value, 6.0, BEFORE, Stroke::solid(Rgb::WHITE, 1.5));
}

/// The values that all panels of a parameter show: those of the parts, as far as they are within reach of the whole.
fn shown(parts: &[&PartEstimate], whole: Estimate) -> Range {
    let half = |estimate: Estimate| 0.5 * (estimate.high - estimate.low);
    let mut halves: Vec<f64> = parts.iter().map(|part| half(part.estimate)).collect();
    halves.sort_by(f64::total_cmp);
    let reach = REACH * half(whole).max(halves[halves.len() / 2]).max(1e-6 * whole.value.abs() + 1e-9);
    let ends = parts.iter().flat_map(|part| [part.estimate.low, part.estimate.high]);
    let (low, high) = ends
        .chain([whole.low, whole.high])
        .map(|value| value.clamp(whole.value - reach, whole.value + reach))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let room = 0.08 * (high - low);
    Range { low: low - room, high: high + room }
}

/// What a part of the drives is called below it.
fn name(part: &PartEstimate) -> String {
    let whole = |value: Option<f64>| number(value.unwrap_or(0.0), 0);
    match part.division {
        Division::Time => format!("to {}", whole(part.to.map(|share| 100.0 * share))),
        Division::Steering if part.from.is_none() => "right".to_owned(),
        Division::Steering => "left".to_owned(),
        Division::Speed => {
            format!("{} to {}", number(part.from.unwrap_or(0.0), 1), number(part.to.unwrap_or(0.0), 1))
        }
        Division::Drive | Division::TerrainClass => whole(part.from),
    }
}
