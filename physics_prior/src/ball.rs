//! How a round wheel rests on ground that is rough on the scale of its radius.

use std::ops::Range;

/// A ball in the wheel's place: it stands on the first ground that it touches, which need not lie under its
/// centre.
#[derive(Clone, Debug)]
pub(crate) struct Ball {
    /// Columns, rows to each cell under the ball, and how far its surface there lies above its lowest
    /// point [m].
    rises: Vec<([isize; 2], f32)>,
    /// Largest number of columns or rows among them.
    pub reach: i64,
}

impl Ball {
    /// The ball on cells of a size; with a radius of less than a cell it touches what is under its centre only.
    pub fn new(radius_m: f64, resolution_m: f64) -> Self {
        let reach = (radius_m / resolution_m).floor() as isize;
        let mut rises = Vec::new();
        for row in -reach..=reach {
            for col in -reach..=reach {
                let off_m = libm::hypot(col as f64, row as f64) * resolution_m;
                if off_m <= radius_m {
                    let rise_m = radius_m - (radius_m * radius_m - off_m * off_m).sqrt();
                    rises.push(([col, row], rise_m as f32));
                }
            }
        }
        Self { rises, reach: reach as i64 }
    }

    /// Where the ball's lowest point comes to rest over the cells of one row, on heights that are minus infinity
    /// where unknown; so is the result over unknown cells.
    pub fn rest(
        &self,
        heights_m: &[f32],
        n_cols: usize,
        row: usize,
        cols: &Range<usize>,
        rests_m: &mut [f32],
    ) {
        let n_rows = heights_m.len() / n_cols;
        rests_m[cols.clone()].fill(f32::NEG_INFINITY);
        for &([east, north], rise_m) in &self.rises {
            let Some(row) = row.checked_add_signed(north).filter(|&row| row < n_rows) else { continue };
            let start = cols.start.max(east.min(0).unsigned_abs());
            let end = cols.end.min(n_cols.saturating_sub(east.max(0) as usize));
            if start >= end {
                continue;
            }
            let first = row * n_cols + start.wrapping_add_signed(east);
            let touched = &heights_m[first..first + (end - start)];
            for (rest_m, height_m) in rests_m[start..end].iter_mut().zip(touched) {
                let height_m = height_m - rise_m;
                *rest_m = if height_m > *rest_m { height_m } else { *rest_m };
            }
        }
        for col in cols.clone() {
            if heights_m[row * n_cols + col] == f32::NEG_INFINITY {
                rests_m[col] = f32::NEG_INFINITY;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rests over a grid of 9 x 9 cells of 0.1 m.
    fn rests(radius_m: f64, height_m: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        let heights_m: Vec<f32> = (0..81).map(|i| height_m(i / 9, i % 9)).collect();
        let ball = Ball::new(radius_m, 0.1);
        let mut rests_m = vec![0.0; 81];
        for row in 0..9 {
            ball.rest(&heights_m, 9, row, &(0..9), &mut rests_m[row * 9..row * 9 + 9]);
        }
        rests_m
    }

    #[test]
    fn beside_a_step_the_ball_stands_on_its_edge() {
        // A step of 0.2 m between columns 4 and 5; the edge's cell centre lies 0.1 k m away. A ball of 0.25 m
        // touching it rests 0.25 - sqrt(0.25^2 - (0.1 k)^2) below the step.
        let rests_m = rests(0.25, |_, col| if col > 4 { 0.2 } else { 0.0 });
        for (col, off_m) in [(4, 0.1f32), (3, 0.2)] {
            let expected = 0.2 - (0.25 - (0.0625 - off_m * off_m).sqrt());
            assert!((rests_m[4 * 9 + col] - expected).abs() < 1e-6);
        }
        assert_eq!((rests_m[4 * 9 + 2], rests_m[4 * 9 + 5]), (0.0, 0.2));
    }

    #[test]
    fn a_small_ball_stands_on_the_cell_itself() {
        let height_m = |row: usize, col: usize| ((row * 7 + col * 3) % 11) as f32;
        let rests_m = rests(0.09, height_m);
        assert!((0..81).all(|i| rests_m[i] == height_m(i / 9, i % 9)));
    }

    #[test]
    fn it_bridges_a_ditch_and_not_the_unknown() {
        let rests_m = rests(0.15, |_, col| if col == 4 { -1.0 } else { 0.0 });
        // Both edges are 0.1 m away: 0.15 - sqrt(0.15^2 - 0.1^2) = 0.0382 below them.
        assert!((rests_m[40] + 0.038_197).abs() < 1e-5);
        let rests_m = rests(0.15, |_, col| if col == 4 { f32::NEG_INFINITY } else { 0.0 });
        assert_eq!((rests_m[40], rests_m[41]), (f32::NEG_INFINITY, 0.0));
    }

    #[test]
    fn a_plane_stays_a_plane() {
        let rests_m = rests(0.25, |row, col| 0.03 * row as f32 - 0.05 * col as f32);
        // Away from the border every cell is lifted alike.
        let lift_m = rests_m[40] - (0.03 * 4.0 - 0.05 * 4.0);
        assert!(lift_m > 0.0);
        assert!((rests_m[3 * 9 + 5] - (0.03 * 3.0 - 0.05 * 5.0) - lift_m).abs() < 1e-6);
    }
}
