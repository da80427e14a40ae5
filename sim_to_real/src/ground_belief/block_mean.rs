//! Means and lines through what was met on the way, with errors that know that neighbours on the way are alike.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use traversability::Encounter;

/// Footprints that are met within this time of each other count as one piece of evidence [s].
const BLOCK_S: f64 = 3.0;
/// Blocks that a mean or a line needs.
const BLOCKS_MIN: usize = 4;
/// Half-width of a 90 % interval over the standard error.
const NORMAL_90: f64 = 1.645;

/// A mean over blocks of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlockMean {
    /// The mean.
    pub value: f64,
    /// Ends of its 90 % interval.
    pub interval: [f64; 2],
    /// Values that it is the mean of.
    pub n: usize,
    /// Stretches of three seconds that they were met in.
    pub n_blocks: usize,
}

impl BlockMean {
    pub(super) fn standard_error(&self) -> f64 {
        0.5 * (self.interval[1] - self.interval[0]) / NORMAL_90
    }

    /// How many standard errors a value lies below (negative) or above the mean.
    pub(super) fn deviations_from(&self, value: f64) -> f64 {
        let standard_error = self.standard_error();
        if self.value == value { 0.0 } else { (self.value - value) / standard_error }
    }
}

/// Mean of what is finite; `None` for fewer blocks than a mean needs.
pub(super) fn block_mean<'a>(
    encounters: impl Iterator<Item = &'a Encounter>,
    value: impl Fn(&Encounter) -> f64,
) -> Option<BlockMean> {
    let rows = encounters.map(|encounter| (encounter, [1.0], value(encounter)));
    let line = BlockLine::through(rows)?;
    let (value, half) = (line.coefficients[0], NORMAL_90 * line.covariance[(0, 0)].sqrt());
    Some(BlockMean { value, interval: [value - half, value + half], n: line.n, n_blocks: line.n_blocks })
}

/// A linear function of a few numbers, fitted by least squares.
#[derive(Clone, Debug)]
pub(super) struct BlockLine {
    /// One for each number.
    pub coefficients: DVector<f64>,
    /// Of the coefficients, from the scatter of blocks and not of single footprints.
    pub covariance: DMatrix<f64>,
    pub n: usize,
    pub n_blocks: usize,
}

impl BlockLine {
    /// Through the finite ones of rows that come in the order of the way; `None` for too few blocks, or numbers that do not
    /// vary.
    ///
    /// The covariance is the sandwich of Liang and Zeger (1986, Biometrika 73), a block for a cluster.
    pub fn through<'a, const N: usize>(
        rows: impl Iterator<Item = (&'a Encounter, [f64; N], f64)>,
    ) -> Option<Self> {
        let rows: Vec<_> =
            rows.filter(|(_, x, y)| y.is_finite() && x.iter().all(|x| x.is_finite())).collect();
        let block = |encounter: &Encounter| (encounter.drive, (encounter.time_s / BLOCK_S).floor() as i64);
        let blocks: Vec<_> = rows.chunk_by(|(a, ..), (b, ..)| block(a) == block(b)).collect();
        if blocks.len() < BLOCKS_MIN {
            return None;
        }
        let (mut products, mut sides) = (DMatrix::zeros(N, N), DVector::zeros(N));
        for (_, x, y) in &rows {
            let x = DVector::from_row_slice(x);
            products += &x * x.transpose();
            sides += x * *y;
        }
        let inverse = products.clone().cholesky()?.inverse();
        let coefficients = &inverse * sides;
        let mut scatter = DMatrix::zeros(N, N);
        for block in &blocks {
            let score = block.iter().fold(DVector::zeros(N), |sum, (_, x, y)| {
                let x = DVector::from_row_slice(x);
                let residual = y - x.dot(&coefficients);
                sum + x * residual
            });
            scatter += &score * score.transpose();
        }
        let n_blocks = blocks.len();
        let few = n_blocks as f64 / (n_blocks - N) as f64;
        let covariance = &inverse * scatter * &inverse * few;
        Some(Self { coefficients, covariance, n: rows.len(), n_blocks })
    }
}
