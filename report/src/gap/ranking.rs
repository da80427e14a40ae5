//! Which: every effect with its probability, the announced ones and the credible set marked.

use sim_to_real::{Answer, Ranked};

use super::{AFTER, BEFORE, draw_legend};
use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const LEFT: f64 = 240.0;
const TOP: f64 = 170.0;
const WIDTH: f64 = 700.0;
const ROW: f64 = 40.0;
/// Effects that are shown: at least and at most so many, in between those that are likelier than this.
const LEAST: usize = 5;
const MOST: usize = 14;
const LIKELY: f64 = 5e-3;

pub(super) fn page(answer: &Answer) -> Option<Canvas> {
    let n_likely = answer.ranking.iter().take_while(|ranked| ranked.score >= LIKELY).count();
    let shown = &answer.ranking[..n_likely.clamp(LEAST, MOST).min(answer.ranking.len())];
    if shown.is_empty() {
        return None;
    }
    let height = ROW * shown.len() as f64;
    let n_more = answer.ranking.len() - shown.len();
    let more =
        if n_more > 0 { format!(" · {n_more} less likely ones are not shown") } else { String::new() };
    let line = format!("probability that an effect is a part of the cause{more}");
    let mut canvas = Canvas::titled(TOP + height + 80.0, "Which effect", &[&line]);
    let entries = [
        ("announced", Stroke::solid(BEFORE, 12.0)),
        ("cannot be told from it", Stroke::solid(AFTER, 12.0)),
        ("other", Stroke::solid(Rgb::RULE, 12.0)),
    ];
    draw_legend(&entries, (LEFT, 130.0), &mut canvas);
    draw_bars(answer, shown, Rect { x: LEFT, y: TOP, width: WIDTH, height }, &mut canvas);
    Some(canvas)
}

fn draw_bars(answer: &Answer, shown: &[Ranked], frame: Rect, canvas: &mut Canvas) {
    let n = shown.len() as f64;
    let axes = Axes { frame, x: Range { low: 0.0, high: 1.0 }, y: Range { low: -n, high: 0.0 } };
    for (row, ranked) in shown.iter().enumerate() {
        let (x, y) = axes.place(ranked.score.clamp(0.0, 1.0), -(row as f64) - 0.5);
        let announced = answer.effects.iter().find(|effect| effect.id == ranked.id);
        let colour = match announced {
            Some(_) => BEFORE,
            None if answer.credible_set.contains(&ranked.id) => AFTER,
            None => Rgb::RULE,
        };
        canvas.rect(
            Rect { x: frame.x, y: y - 12.0, width: (x - frame.x).max(2.0), height: 24.0 },
            colour,
            0.9,
        );
        canvas.text((frame.x - 14.0, y + 6.0), &ranked.id, TextStyle::new(18, Anchor::End));
        let score = TextStyle::new(16, Anchor::Start).coloured(Rgb::INK_SOFT);
        canvas.text((frame.right() + 16.0, y + 6.0), &number(ranked.score, 3), score);
        if let Some(effect) = announced {
            let told = crate::gap::text::parameters(effect);
            canvas.text((frame.right() + 90.0, y + 6.0), &told, TextStyle::new(17, Anchor::Start));
        }
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_x_label(canvas, "probability [-]");
}
