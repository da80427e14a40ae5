//! The search row by row against every move from every pose.

use super::*;

const N_ROWS: usize = 18;
const N_COLS: usize = 23;

/// Times per metre that differ by cell and edge, with cells that take a thousand times longer, and a border.
fn slowness() -> Vec<[f32; N_HEADINGS]> {
    let mut state = 12345_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 16
    };
    (0..(N_ROWS + 2) * (N_COLS + 2))
        .map(|_| {
            let factor = if next() % 6 == 0 { 1000.0 } else { 1.0 };
            std::array::from_fn(|_| factor * (1.0 + (next() % 100) as f32 / 50.0))
        })
        .collect()
}

/// Every move from every pose, over and over, until none is better.
fn exhaustive(turning: &Turning, mut labels_s: Vec<f32>) -> Vec<f32> {
    let (n_rows, n_cols) = (N_ROWS as isize, N_COLS as isize);
    loop {
        let before = labels_s.clone();
        for (index, step) in turning.moves.iter().enumerate() {
            for cell in 0..n_rows * n_cols {
                let (row, col) = (cell / n_cols, cell % n_cols);
                let at = |heading: usize, [east, north]: [isize; 2]| {
                    turning.padded(heading, 0).wrapping_add_signed(turning.step([col + east, row + north]))
                };
                let (start, end) = (at(step.from_heading, [0, 0]), at(step.to_heading, step.by));
                let time_s = turning.moves_s[index * N_ROWS * N_COLS + cell as usize];
                labels_s[start] = labels_s[start].min(labels_s[end] + time_s);
                let [east, north] = step.by;
                let is_inside = (0..n_cols).contains(&(col + east)) && (0..n_rows).contains(&(row + north));
                if let Some(slowdown) = turning.reverse_slowdown.filter(|_| is_inside) {
                    labels_s[end] = labels_s[end].min(labels_s[start] + slowdown * time_s);
                }
            }
        }
        if labels_s == before {
            return labels_s;
        }
    }
}

#[test]
fn rows_that_are_due_are_all_that_have_to_be_looked_at() {
    let slowness = slowness();
    let field_s = vec![0.0; N_ROWS * N_COLS];
    for (reverse_slowdown, radius_cells) in [(None, 4.3), (Some(4.0), 4.3), (Some(1.5), 9.0)] {
        let mut turning = Turning::new(radius_cells, reverse_slowdown, N_ROWS, N_COLS);
        turning.update(&Ground {
            slowness: &slowness,
            padding: 1,
            resolution_m: 0.5,
            field_s: &field_s,
            goal_cells: [17.0, 6.0],
            reached: &[(6 * N_COLS + 17, 0.0), (6 * N_COLS + 18, 0.25)],
            exits: &[3, 4 * N_COLS],
            border_slowness: 1000.0,
        });
        let mut seeds_s = turning.labels_s.clone();
        for heading in 0..N_HEADINGS {
            for row in 1..N_ROWS - 1 {
                let start = turning.padded(heading, row);
                for (col, seed_s) in seeds_s[start..start + N_COLS].iter_mut().enumerate() {
                    let is_inner = (1..N_COLS - 1).contains(&col);
                    *seed_s = match (row, col) {
                        (6, 17) => 0.0,
                        (6, 18) => 0.25,
                        _ if is_inner => f32::INFINITY,
                        _ => *seed_s,
                    };
                }
            }
        }
        assert_eq!(exhaustive(&turning, seeds_s), turning.labels_s);
    }
}

/// At right angles pi / 2 - 1, facing away pi, the shorter way round.
#[test]
fn what_a_turn_loses_is_its_arc_less_its_gain() {
    for turn_rad in [0.0, 0.3, 1.570_796_4, 2.5, std::f32::consts::PI, 4.0, -1.0, -5.0] {
        let e = f64::from(turn_rad).rem_euclid(TAU);
        let e = e.min(TAU - e);
        assert!((f64::from(lost_rad(turn_rad)) - (e - e.sin())).abs() < 0.01, "{turn_rad}");
    }
}
