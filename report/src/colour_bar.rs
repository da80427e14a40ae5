//! A colour ramp with the values that its colours mean.

use crate::axes::{Range, number};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};

/// Height of the ramp itself [px].
pub(super) const HEIGHT: f64 = 190.0;
const WIDTH: f64 = 24.0;
const TEXT: TextStyle = TextStyle::new(17, Anchor::Start);

/// A ramp with its values.
pub(super) struct ColourBar<'a> {
    /// Name and unit.
    pub title: [&'a str; 2],
    /// Value at the lower end.
    pub low: f64,
    /// Value at the upper end.
    pub high: f64,
    pub ramp: Ramp,
}

impl ColourBar<'_> {
    pub(super) fn draw(&self, (x, y): Point, canvas: &mut Canvas) {
        canvas.text((x, y + 14.0), self.title[0], TEXT.bold());
        canvas.text((x, y + 36.0), self.title[1], TEXT.coloured(Rgb::INK_SOFT));
        let bar = Rect { x, y: y + 50.0, width: WIDTH, height: HEIGHT };
        for step in 0..HEIGHT as u32 {
            let share = 1.0 - (f64::from(step) + 0.5) / HEIGHT;
            let row = Rect { y: bar.y + f64::from(step), height: 1.0, ..bar };
            canvas.rect(row, self.ramp.at(share as f32), 1.0);
        }
        canvas.frame(bar, Stroke::solid(Rgb::INK_SOFT, 1.5));
        let values = Range { low: self.low.min(self.high), high: self.low.max(self.high) };
        let (ticks, decimals) = values.ticks(5.0);
        for value in ticks {
            let y = bar.bottom() - (value - self.low) / (self.high - self.low) * HEIGHT;
            canvas.line((bar.right(), y), (bar.right() + 5.0, y), Stroke::solid(Rgb::INK_SOFT, 1.5));
            let place = (bar.right() + 10.0, y + 6.0);
            canvas.text(place, &number(value, decimals), TextStyle::new(15, Anchor::Start));
        }
    }
}
