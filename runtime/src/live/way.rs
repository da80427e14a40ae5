//! The way of least time to the goal, read off the field that the controller is steered by beyond its horizon.

use mppi::CostToGoView;
use terrain::{Cell, Pose};

/// Longest way that is shown [cells].
const CELLS_MAX: usize = 1000;

/// From cell to neighbouring cell, always to where the least time is left, until none is left or it falls no further.
/// Empty outside the map. Heights and attitudes are the vehicle's height and zero.
pub(super) fn to_goal(field: &CostToGoView<'_>, [x_m, y_m, z_m]: [f64; 3]) -> Vec<Pose> {
    let geometry = &field.geometry;
    let seconds = |cell: Cell| field.seconds[cell.row * geometry.n_cols + cell.col];
    let mut way = Vec::new();
    let mut next = geometry.cell_at(x_m, y_m);
    while let Some(cell) = next.filter(|_| way.len() < CELLS_MAX) {
        let [x_m, y_m] = geometry.centre_m(cell);
        way.push(Pose { x_m, y_m, z_m, ..Pose::default() });
        let rows = cell.row.saturating_sub(1)..(cell.row + 2).min(geometry.n_rows);
        let cols = cell.col.saturating_sub(1)..(cell.col + 2).min(geometry.n_cols);
        let around = rows.flat_map(|row| cols.clone().map(move |col| Cell { row, col }));
        let least = around.min_by(|a, b| seconds(*a).total_cmp(&seconds(*b)));
        next = least.filter(|least| seconds(*least) < seconds(cell));
    }
    way
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::GridGeometry;

    #[test]
    fn the_way_falls_to_the_goal_and_ends() {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 4, n_cols: 5 };
        // Least time in the corner: the sum of row and column.
        let seconds: Vec<f32> = (0..20).map(|k| (k / 5 + k % 5) as f32).collect();
        let field = CostToGoView { geometry, seconds: &seconds, turning_s: &[] };
        let way = to_goal(&field, [4.5, 3.5, 0.7]);
        let places: Vec<[f64; 2]> = way.iter().map(|pose| [pose.x_m, pose.y_m]).collect();
        assert_eq!(places, [[4.5, 3.5], [3.5, 2.5], [2.5, 1.5], [1.5, 0.5], [0.5, 0.5]]);
        assert!(way.iter().all(|pose| pose.z_m == 0.7));
        assert!(to_goal(&field, [-1.0, 0.0, 0.0]).is_empty());
        let level = [1.0; 20];
        assert_eq!(
            to_goal(&CostToGoView { geometry, seconds: &level, turning_s: &[] }, [2.5, 2.5, 0.0]).len(),
            1
        );
    }
}
