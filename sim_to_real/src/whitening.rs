//! What belongs together in the residuals of nominal drives, taken apart.

use crate::rollout::PER_START;
use nalgebra::{DMatrix, SymmetricEigen};
use serde::{Deserialize, Serialize};

/// Share of the covariance that is taken for uncorrelated, so that nothing is believed to be free of noise because few
/// drives show none.
const UNCORRELATED: f64 = 0.1;
/// Residuals beyond this many standard deviations count as so many.
const CLIPPED_AT: f64 = 4.0;

/// The symmetric inverse root of the covariance of a start's residuals on nominal drives, [`PER_START`] squared numbers:
/// residuals times this are uncorrelated there and have a variance of 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Whitening(Vec<f32>);

impl Whitening {
    /// Leaves residuals as they are.
    pub(crate) fn none() -> Self {
        Self(DMatrix::<f32>::identity(PER_START, PER_START).as_slice().to_vec())
    }

    /// Of residuals of nominal drives, [`PER_START`] for each start.
    pub(crate) fn of(residuals: &[f32]) -> Self {
        let n = (residuals.len() / PER_START).max(1) as f64;
        let clipped = residuals.iter().map(|r| f64::from(*r).clamp(-CLIPPED_AT, CLIPPED_AT));
        let starts = DMatrix::from_iterator(PER_START, residuals.len() / PER_START, clipped);
        let mut covariance = &starts * starts.transpose() / n;
        for row in 0..PER_START {
            // What was never measured stays as it is.
            let variance = covariance[(row, row)];
            let variance = if variance > 0.0 { variance } else { 1.0 };
            for column in 0..PER_START {
                covariance[(row, column)] *= 1.0 - UNCORRELATED;
            }
            covariance[(row, row)] = variance;
        }
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(covariance);
        let roots = DMatrix::from_diagonal(&eigenvalues.map(|value| 1.0 / value.max(1e-6).sqrt()));
        let root = &eigenvectors * roots * eigenvectors.transpose();
        Self(root.iter().map(|value| *value as f32).collect())
    }

    /// The residuals of every start, uncorrelated.
    pub(crate) fn applied(&self, residuals: &[f32]) -> Vec<f32> {
        let mut white = vec![0.0; residuals.len()];
        for (start, white) in residuals.chunks(PER_START).zip(white.chunks_mut(PER_START)) {
            for (residual, column) in start.iter().zip(self.0.chunks(PER_START)) {
                white.iter_mut().zip(column).for_each(|(white, weight)| *white += residual * weight);
            }
        }
        white
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Two quantities that share a part: variances of 1 + 1 and 4 + 1, covariance 2, which is taken for 0.9 * 2. What the
    /// missing 0.2 leaves, W ((0, 0.2), (0.2, 0)) W with W the inverse root of ((2, 1.8), (1.8, 5)), is 0.09 between them
    /// and -0.07 and -0.04 of their variances.
    #[test]
    fn what_belongs_together_is_taken_apart() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut draw = || random.random_range(-1.0_f32..1.0) * 3.0_f32.sqrt();
        let mut residuals = vec![0.0; 20_000 * PER_START];
        for start in residuals.chunks_mut(PER_START) {
            let shared = draw();
            start[0] = shared + draw();
            start[1] = 2.0 * shared + draw();
        }
        let white = Whitening::of(&residuals).applied(&residuals);
        let mean = |of: &dyn Fn(&[f32]) -> f32| {
            white.chunks(PER_START).map(of).sum::<f32>() / (white.len() / PER_START) as f32
        };
        assert!((mean(&|start| start[0] * start[1])).abs() < 0.15);
        assert!((mean(&|start| start[0] * start[0]) - 1.0).abs() < 0.15);
        assert!((mean(&|start| start[1] * start[1]) - 1.0).abs() < 0.15);
        assert!(white.chunks(PER_START).all(|start| start[2..].iter().all(|value| value.abs() < 1e-6)));
    }
}
