//! What part of the world a picture shows, and how large.

use scenarios::Bounds;

use crate::axes::{Axes, Range};
use crate::canvas::Rect;

/// Left edge of a map and of the strips below it [px].
pub(super) const LEFT: f64 = 100.0;
/// Their width [px].
pub(super) const MAP_WIDTH: f64 = 1150.0;
/// Left edge of the column beside them [px].
pub(super) const LEGEND_X: f64 = 1290.0;

/// Room for the map on the page [px].
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height_min: f64,
    pub height_max: f64,
}

/// The whole world is shown where that costs no more than this share of the scale.
const WHOLE_WORLD_FROM: f64 = 0.9;

/// The axes of a map that shows all of `interest` with `margin_m` around it, at one scale for both directions,
/// as large as the slot allows. Where the whole world is hardly smaller, all of it is shown. `interest` lies in the world. Room that is left shows more of the world, and never what lies outside it.
pub(super) fn map_axes(interest: Bounds, margin_m: f64, world: Bounds, slot: Slot) -> Axes {
    let wanted = |axis: usize| Range {
        low: (interest.south_west_m[axis] - margin_m).max(world.south_west_m[axis]),
        high: (interest.north_east_m[axis] + margin_m).min(world.north_east_m[axis]),
    };
    let limit = |axis: usize| Range { low: world.south_west_m[axis], high: world.north_east_m[axis] };
    let scale = |x: Range, y: Range| (slot.width / x.span()).min(slot.height_max / y.span());
    let (mut x, mut y) = (wanted(0), wanted(1));
    if scale(limit(0), limit(1)) >= WHOLE_WORLD_FROM * scale(x, y) {
        (x, y) = (limit(0), limit(1));
    }
    let pixels_per_m = scale(x, y);
    let x = widened(x, slot.width / pixels_per_m, limit(0));
    let y = widened(y, slot.height_min / pixels_per_m, limit(1));
    let width = (x.span() * pixels_per_m).round();
    let frame = Rect {
        x: (slot.left + (slot.width - width) / 2.0).round(),
        y: slot.top,
        width,
        height: (y.span() * pixels_per_m).round(),
    };
    Axes { frame, x, y }
}

/// The range widened to both sides to at least `span`, as far as the world goes.
fn widened(range: Range, span: f64, limit: Range) -> Range {
    let span = span.max(range.span()).min(limit.span());
    let low = ((range.low + range.high - span) / 2.0).min(limit.high - span).max(limit.low);
    Range { low, high: low + span }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOT: Slot = Slot { left: 100.0, top: 50.0, width: 1000.0, height_min: 500.0, height_max: 800.0 };

    fn square(side_m: f64) -> Bounds {
        Bounds { south_west_m: [0.0; 2], north_east_m: [side_m; 2] }
    }

    #[test]
    fn corridor_fills_the_width_and_gets_the_least_height() {
        let interest = Bounds { south_west_m: [10.0, 40.0], north_east_m: [50.0, 42.0] };
        let axes = map_axes(interest, 5.0, square(100.0), SLOT);
        // 40 + 2 x 5 m over 1000 px: 20 px/m; 500 px are 25 m around y = 41.
        assert_eq!((axes.x.low, axes.x.high), (5.0, 55.0));
        assert_eq!((axes.y.low, axes.y.high), (28.5, 53.5));
        assert_eq!((axes.frame.width, axes.frame.height), (1000.0, 500.0));
    }

    #[test]
    fn nothing_beyond_the_world_is_shown() {
        let interest = Bounds { south_west_m: [1.0, 9.0], north_east_m: [9.0, 9.5] };
        let axes = map_axes(interest, 3.0, square(10.0), SLOT);
        // x is clamped to the whole world: 100 px/m (all of it would be 80); 500 px are 5 m, pushed south.
        assert_eq!((axes.x.low, axes.x.high), (0.0, 10.0));
        assert_eq!((axes.y.low, axes.y.high), (5.0, 10.0));
    }

    #[test]
    fn world_that_nearly_fits_is_shown_whole() {
        let interest = Bounds { south_west_m: [0.5, 0.5], north_east_m: [9.5, 6.0] };
        let world = Bounds { south_west_m: [0.0; 2], north_east_m: [10.0, 8.0] };
        let axes = map_axes(interest, 0.25, world, SLOT);
        // 1000 px / 9.5 m = 105 px/m against 100 px/m for all of it.
        assert_eq!((axes.y.low, axes.y.high), (0.0, 8.0));
        assert_eq!((axes.frame.width, axes.frame.height), (1000.0, 800.0));
    }

    #[test]
    fn both_directions_have_one_scale() {
        for north_east_m in [[90.0, 10.0], [10.0, 90.0], [60.0, 60.0]] {
            let interest = Bounds { south_west_m: [0.0; 2], north_east_m };
            let axes = map_axes(interest, 4.0, square(300.0), SLOT);
            let across = axes.frame.width / axes.x.span();
            let up = axes.frame.height / axes.y.span();
            assert!((across / up - 1.0).abs() < 2e-3, "{across} px/m, {up} px/m");
            assert!(axes.frame.width <= SLOT.width && axes.frame.height <= SLOT.height_max);
        }
    }
}
