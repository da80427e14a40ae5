//! Axes: round ticks, and a frame that carries them.

use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

const TICK_TEXT: u32 = 16;
const LABEL_TEXT: u32 = 18;
const TICK_LENGTH: f64 = 6.0;

/// Values shown from one end of an axis to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub low: f64,
    pub high: f64,
}

impl Range {
    pub(super) fn span(self) -> f64 {
        self.high - self.low
    }

    /// Round values inside the range, at most about `most` of them, and the number of decimals that tells them apart.
    pub(super) fn ticks(self, most: f64) -> (Vec<f64>, usize) {
        let step = round_step(self.span() / most);
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        ((first..=last).map(|i| i as f64 * step).collect(), decimals)
    }
}

/// The smallest of 1, 2 or 5 times a power of ten that is not below `least`; 1 for what is no length.
pub(super) fn round_step(least: f64) -> f64 {
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(least.log10().floor());
    // The quotient of two close floats may miss 2 or 5 by a hair.
    let mantissa = least / power * (1.0 - 1e-9);
    let round = [1.0, 2.0, 5.0].into_iter().find(|&round| mantissa <= round);
    power * round.unwrap_or(10.0)
}

/// A frame with a value axis below and one at the left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    pub frame: Rect,
    pub x: Range,
    pub y: Range,
}

impl Axes {
    /// Page position of a value pair.
    pub(super) fn place(&self, x: f64, y: f64) -> Point {
        (
            self.frame.x + (x - self.x.low) / self.x.span() * self.frame.width,
            self.frame.bottom() - (y - self.y.low) / self.y.span() * self.frame.height,
        )
    }

    /// Ticks and their numbers below the frame.
    pub(super) fn draw_x_ticks(&self, canvas: &mut Canvas) {
        let (ticks, decimals) = self.x.ticks(self.frame.width / 90.0);
        let style = TextStyle::new(TICK_TEXT, Anchor::Middle).coloured(Rgb::INK_SOFT);
        for tick in ticks {
            let (x, y) = (self.place(tick, self.y.low).0, self.frame.bottom());
            canvas.line((x, y), (x, y + TICK_LENGTH), Stroke::solid(Rgb::INK_SOFT, 1.5));
            canvas.text((x, y + 24.0), &number(tick, decimals), style);
        }
    }

    /// Ticks and their numbers left of the frame.
    pub(super) fn draw_y_ticks(&self, canvas: &mut Canvas) {
        let (ticks, decimals) = self.y.ticks(self.frame.height / 32.0);
        let style = TextStyle::new(TICK_TEXT, Anchor::End).coloured(Rgb::INK_SOFT);
        for tick in ticks {
            let (x, y) = (self.frame.x, self.place(self.x.low, tick).1);
            canvas.line((x - TICK_LENGTH, y), (x, y), Stroke::solid(Rgb::INK_SOFT, 1.5));
            canvas.text((x - 11.0, y + 6.0), &number(tick, decimals), style);
        }
    }

    /// The frame with ticks, their numbers and what they count.
    pub(super) fn draw_labelled(&self, canvas: &mut Canvas, x_label: &str, y_label: &str) {
        self.draw_frame(canvas);
        self.draw_x_ticks(canvas);
        self.draw_y_ticks(canvas);
        self.draw_x_label(canvas, x_label);
        self.draw_y_label(canvas, y_label);
    }

    /// Faint lines across the frame at the ticks.
    pub(super) fn draw_rules(&self, canvas: &mut Canvas) {
        let rule = Stroke::solid(Rgb::RULE, 1.0);
        for tick in self.x.ticks(self.frame.width / 90.0).0 {
            let x = self.place(tick, self.y.low).0;
            canvas.line((x, self.frame.y), (x, self.frame.bottom()), rule);
        }
        for tick in self.y.ticks(self.frame.height / 32.0).0 {
            let y = self.place(self.x.low, tick).1;
            canvas.line((self.frame.x, y), (self.frame.right(), y), rule);
        }
    }

    /// The frame itself.
    pub(super) fn draw_frame(&self, canvas: &mut Canvas) {
        canvas.frame(self.frame, Stroke::solid(Rgb::INK_SOFT, 1.5));
    }

    /// What the axis below means, with its unit.
    pub(super) fn draw_x_label(&self, canvas: &mut Canvas, label: &str) {
        let place = (self.frame.x + self.frame.width / 2.0, self.frame.bottom() + 50.0);
        canvas.text(place, label, TextStyle::new(LABEL_TEXT, Anchor::Middle));
    }

    /// What the axis at the left means, with its unit, above its upper end.
    pub(super) fn draw_y_label(&self, canvas: &mut Canvas, label: &str) {
        let place = (self.frame.x - 62.0, self.frame.y - 14.0);
        canvas.text(place, label, TextStyle::new(LABEL_TEXT, Anchor::Start));
    }
}

/// A number with a true minus sign and no negative zero.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|byte| matches!(byte, b'0' | b'.')) => digits.to_owned(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        // 3.2 to 47.9 in at most ten steps: 4.47 rounds up to 5.
        let (ticks, decimals) = Range { low: 3.2, high: 47.9 }.ticks(10.0);
        assert_eq!(ticks, [5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0]);
        assert_eq!(decimals, 0);
        // Steps of 0.25 round up to 0.5.
        assert_eq!(Range { low: 0.0, high: 1.0 }.ticks(4.0), (vec![0.0, 0.5, 1.0], 1));
    }

    #[test]
    fn step_is_one_two_or_five() {
        let cases = [
            (1.0, 1.0),
            (1.01, 2.0),
            (2.0, 2.0),
            (4.9, 5.0),
            (5.1, 10.0),
            (0.03, 0.05),
            (0.1, 0.1),
            (700.0, 1000.0),
        ];
        for (least, expected) in cases {
            assert!((round_step(least) / expected - 1.0).abs() < 1e-12, "{least}: {}", round_step(least));
        }
        assert_eq!((round_step(0.0), round_step(f64::NAN)), (1.0, 1.0));
    }

    #[test]
    fn place_puts_the_low_corner_at_the_lower_left() {
        let frame = Rect { x: 100.0, y: 50.0, width: 200.0, height: 80.0 };
        let axes = Axes { frame, x: Range { low: -1.0, high: 3.0 }, y: Range { low: 10.0, high: 20.0 } };
        assert_eq!(axes.place(-1.0, 10.0), (100.0, 130.0));
        assert_eq!(axes.place(3.0, 20.0), (300.0, 50.0));
        assert_eq!(axes.place(0.0, 15.0), (150.0, 90.0));
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(number(-0.04, 1), "0.0");
        assert_eq!(number(-12.0, 0), "\u{2212}12");
    }
}
