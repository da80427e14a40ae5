//! Which of the things seen now is which of those seen before.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Steps in which squared distances are told apart, since the library counts in whole numbers.
const STEPS_PER_UNIT: f64 = 1e6;

/// For every row the column that it goes with, such that all costs together are least; `None` for a row that goes with
/// none. Leaving a row without costs `most`, so that no pair costs more.
///
/// `costs` holds `n_columns` finite numbers >= 0 for each row; beyond `most` it does not matter what stands there.
pub(crate) fn assign(costs: &[f64], n_columns: usize, most: f64) -> Vec<Option<usize>> {
    let n_rows = costs.len().checked_div(n_columns).unwrap_or(0);
    if n_rows == 0 {
        return Vec::new();
    }
    let whole = |cost: f64| (cost.min(2.0 * most) * STEPS_PER_UNIT) as i64;
    // Each row has a column of its own to go with when nothing else will do.
    let matrix =
        Matrix::from_fn(n_rows, n_columns + n_rows, |(row, column)| match column.checked_sub(n_columns) {
            None => whole(costs[row * n_columns + column]),
            Some(_) => whole(most),
        });
    let (_, columns) = kuhn_munkres_min(&matrix);
    let is_pair = |(row, column): (usize, usize)| {
        (column < n_columns && costs[row * n_columns + column] <= most).then_some(column)
    };
    columns.into_iter().enumerate().map(is_pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MOST: f64 = 9.0;

    /// The oracle: every way to give rows columns or none.
    fn least(costs: &[f64], n_columns: usize, row: usize, taken: &mut Vec<bool>) -> f64 {
        if row * n_columns >= costs.len() {
            return 0.0;
        }
        let mut best = MOST + least(costs, n_columns, row + 1, taken);
        for column in 0..n_columns {
            let cost = costs[row * n_columns + column];
            if !taken[column] && cost <= MOST {
                taken[column] = true;
                best = best.min(cost + least(costs, n_columns, row + 1, taken));
                taken[column] = false;
            }
        }
        best
    }

    proptest! {
        #[test]
        fn all_costs_together_are_least(
            n_columns in 1..5_usize,
            costs in prop::collection::vec(0.0..20.0_f64, 0..20),
        ) {
            let n_rows = costs.len() / n_columns;
            let costs = &costs[..n_rows * n_columns];
            let pairs = assign(costs, n_columns, MOST);
            prop_assert_eq!(pairs.len(), n_rows);
            let mut used: Vec<usize> = pairs.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            prop_assert_eq!(used.len(), pairs.iter().flatten().count(), "each column once");
            let cost_of = |(row, column): (usize, &Option<usize>)| {
                column.map_or(MOST, |column| costs[row * n_columns + column])
            };
            let total: f64 = pairs.iter().enumerate().map(cost_of).sum();
            let expected = least(costs, n_columns, 0, &mut vec![false; n_columns]);
            prop_assert!((total - expected).abs() < 1e-4, "{} instead of {}", total, expected);
        }
    }

    #[test]
    fn nobody_and_nothing_go_together() {
        assert_eq!(assign(&[], 0, MOST), []);
        assert_eq!(assign(&[], 3, MOST), []);
    }
}
