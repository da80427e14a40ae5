//! Success and time of every row, with intervals and beside the paper's.

use bench::route::{Method, Report, Row, Tracking, published};
use bench::statistics::Mean;
use scenarios::LandscapeKind;

use crate::axes::{Axes, Range, round_step};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

/// Something of a row.
type OfRow<'a, T> = dyn Fn(&Row) -> T + 'a;

const TOP: f64 = 175.0;
const LINE: f64 = 34.0;
const BETWEEN: f64 = 150.0;
const LABELS: f64 = 270.0;
const GAP: f64 = 60.0;
const LABEL: TextStyle = TextStyle::new(18, Anchor::End);
const SMALL: TextStyle = TextStyle::new(17, Anchor::Start);

/// Draws the table as bars, a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    let blocks = LandscapeKind::ALL
        .map(|landscape| report.rows.iter().filter(|row| row.landscape == landscape).collect::<Vec<&Row>>());
    let heights = blocks.each_ref().map(|rows| LINE * rows.len() as f64);
    let height = TOP + heights.iter().sum::<f64>() + BETWEEN * blocks.len() as f64 - 40.0;
    let title = "Routes planned with and without friction, driven by the plant";
    let mut canvas = Canvas::titled(height, title, &[]);
    draw_legend(&mut canvas);
    let mut top = TOP;
    for ((rows, landscape), height) in blocks.iter().zip(LandscapeKind::ALL).zip(heights) {
        let tasks = rows.iter().map(|row| row.n).max().unwrap_or(0);
        let heading = format!("{}, {tasks} tasks", landscape.name());
        canvas.text((LABELS, top - 18.0), &heading, TextStyle::new(20, Anchor::Start).bold());
        Block { rows, top, height }.draw(&mut canvas);
        top += height + BETWEEN;
    }
    canvas.png()
}

fn draw_legend(canvas: &mut Canvas) {
    let y = 108.0;
    canvas.rect(Rect { x: LABELS, y: y - 13.0, width: 34.0, height: 16.0 }, Rgb::ROLL, 0.75);
    canvas.text((LABELS + 44.0, y), "here, with 95 %", SMALL);
    canvas.circle((LABELS + 220.0, y - 6.0), 6.0, Rgb::WHITE, Stroke::solid(Rgb::FAILURE, 3.0));
    canvas.text((LABELS + 236.0, y), "the paper's, in its own worlds", SMALL);
}

struct Block<'a> {
    rows: &'a [&'a Row],
    top: f64,
    height: f64,
}

impl Block<'_> {
    fn axes(&self, place: usize, most: f64) -> Axes {
        let width = (PAGE_WIDTH - LABELS - GAP - MARGIN) / 2.0;
        let x = LABELS + place as f64 * (width + GAP);
        let n = self.rows.len() as f64;
        Axes {
            frame: Rect { x, y: self.top, width, height: self.height },
            x: Range { low: 0.0, high: most },
            y: Range { low: -n, high: 0.0 },
        }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let share = |row: &Row| {
            let [low, high] = row.success_interval.map(|end| 100.0 * end);
            Some(Mean { value: 100.0 * row.success(), low, high })
        };
        let paper = |row: &Row| 100.0 * published(row.landscape, row.method).success;
        self.panel(&self.axes(0, 100.0), "tasks at the goal [%]", (&share, &paper), canvas);
        let paper_s = |row: &Row| published(row.landscape, row.method).time_s;
        let highest = |row: &&&Row| row.time_s.map_or(0.0, |mean| mean.high).max(paper_s(row));
        let most_s = self.rows.iter().map(|row| highest(&row)).fold(1.0, f64::max);
        let step = round_step(most_s / 8.0);
        let axes = self.axes(1, (most_s / step).ceil() * step);
        self.panel(&axes, "time of these [s]", (&|row: &Row| row.time_s, &paper_s), canvas);
        for (index, row) in self.rows.iter().enumerate() {
            let y = self.top + (index as f64 + 0.5) * LINE + 6.0;
            let name = match row.tracking {
                Tracking::Pd => row.method.name().to_owned(),
                Tracking::Mppi => format!("{}, by MPPI, {} tasks", row.method.name(), row.n),
            };
            let style = if row.method == Method::Ours { LABEL.bold() } else { LABEL };
            canvas.text((LABELS - 14.0, y), &name, style);
        }
    }

    fn panel(
        &self,
        axes: &Axes,
        label: &str,
        (value, paper): (&OfRow<'_, Option<Mean>>, &OfRow<'_, f64>),
        canvas: &mut Canvas,
    ) {
        for (index, row) in self.rows.iter().enumerate() {
            let middle = -(index as f64) - 0.5;
            let (_, y) = axes.place(0.0, middle);
            if let Some(mean) = value(row) {
                let (left, _) = axes.place(0.0, middle);
                let [at, low, high] =
                    [mean.value, mean.low, mean.high].map(|value| axes.place(value, middle).0);
                let bar = Rect { x: left, y: y - 0.32 * LINE, width: at - left, height: 0.64 * LINE };
                canvas.rect(bar, if row.method == Method::Ours { Rgb::VEGETATION } else { Rgb::ROLL }, 0.75);
                canvas.line((low, y), (high, y), Stroke::solid(Rgb::INK, 2.0));
            }
            if row.tracking == Tracking::Pd {
                let place = axes.place(paper(row), middle);
                canvas.circle(place, 6.0, Rgb::WHITE, Stroke::solid(Rgb::FAILURE, 3.0));
            }
        }
        axes.draw_frame(canvas);
        axes.draw_x_ticks(canvas);
        axes.draw_x_label(canvas, label);
    }
}
