//! Pitch or roll of nominal drives, by what the body does and stands on.

use super::block::{Block, N_REGRESSORS};
use nalgebra::{Cholesky, DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// On level ground at a steady speed straight ahead [rad], per angle of the ground [-], per acceleration [rad s2/m].
type Coefficients = [f64; N_REGRESSORS];
/// Singular values below this are none: level ground has no angle.
const SINGULAR: f64 = 1e-9;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Axis {
    pub(super) coefficients: Coefficients,
    /// Variance of the mean of a second about what these foretell [rad2].
    scatter_rad2: f64,
    /// Mean squares of what the coefficients of one drive differ by from those of the others.
    apart: Coefficients,
}

impl Axis {
    /// Of two drives or more.
    pub(super) fn of(drives: &[&[Block]], axis: usize) -> Self {
        let left_out = (0..drives.len()).map(|out| {
            let others: Vec<&[Block]> =
                drives.iter().enumerate().filter(|(k, _)| *k != out).map(|own| *own.1).collect();
            let of_others = regression(&others.concat(), axis);
            apart(&errors(drives[out], &of_others, axis), drives[out], axis)
        });
        let apart: Vec<Coefficients> = left_out.collect();
        let scatter = drives.iter().map(|own| scatter_rad2(own, axis));
        let n = drives.len() as f64;
        Self {
            coefficients: regression(&drives.concat(), axis),
            scatter_rad2: scatter.sum::<f64>() / n,
            apart: std::array::from_fn(|k| apart.iter().map(|apart| apart[k].powi(2)).sum::<f64>() / n),
        }
    }

    /// What is left of the measured angle.
    pub(super) fn left(&self, own: &Block, axis: usize) -> f64 {
        left(own, &self.coefficients, axis)
    }

    /// Columns of a drive weighed by the inverse covariance of its errors: the scatter of every second, its own where that is
    /// larger than a simulator's, and coefficients of its own. Angles that do not scatter at all tell nothing.
    pub(super) fn weighed(&self, blocks: &[Block], axis: usize, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let own = centred(blocks, axis);
        let drawn = DMatrix::from_diagonal(&DVector::from_column_slice(&self.apart));
        let scatter = self.scatter_rad2.max(scatter_rad2(blocks, axis));
        let scatter = DMatrix::from_diagonal_element(blocks.len(), blocks.len(), scatter);
        let covariance = Cholesky::new(&own * drawn * own.transpose() + scatter);
        covariance.map_or_else(|| 0.0 * columns, |covariance| covariance.solve(columns))
    }
}

fn regression(blocks: &[Block], axis: usize) -> Coefficients {
    let body = DVector::from_iterator(blocks.len(), blocks.iter().map(|own| own.body[axis]));
    let found = design(blocks, axis).svd(true, true).solve(&body, SINGULAR);
    found.map_or([0.0; N_REGRESSORS], |found| std::array::from_fn(|k| found[k]))
}

fn left(own: &Block, coefficients: &Coefficients, axis: usize) -> f64 {
    own.body[axis]
        - own.regressors(axis).iter().zip(coefficients).map(|(value, per)| value * per).sum::<f64>()
}

fn errors(blocks: &[Block], coefficients: &Coefficients, axis: usize) -> DVector<f64> {
    DVector::from_iterator(blocks.len(), blocks.iter().map(|own| left(own, coefficients, axis)))
}

/// Mean square of what a drive's own coefficients leave.
fn scatter_rad2(blocks: &[Block], axis: usize) -> f64 {
    errors(blocks, &regression(blocks, axis), axis).norm_squared() / blocks.len() as f64
}

/// How far each coefficient alone has to change for the least errors of a drive.
fn apart(errors: &DVector<f64>, blocks: &[Block], axis: usize) -> Coefficients {
    let own = centred(blocks, axis);
    std::array::from_fn(|k| {
        let squares = own.column(k).norm_squared();
        if squares > SINGULAR { own.column(k).dot(errors) / squares } else { 0.0 }
    })
}

fn design(blocks: &[Block], axis: usize) -> DMatrix<f64> {
    DMatrix::from_fn(blocks.len(), N_REGRESSORS, |row, k| blocks[row].regressors(axis)[k])
}

/// The regressors of every second, all but the constant about their means.
fn centred(blocks: &[Block], axis: usize) -> DMatrix<f64> {
    let mut own = design(blocks, axis);
    for k in 1..N_REGRESSORS {
        let mean = own.column(k).mean();
        own.column_mut(k).add_scalar_mut(-mean);
    }
    own
}
