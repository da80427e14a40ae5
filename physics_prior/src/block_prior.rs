//! What the prior says of many poses at once.

use bicycle::lanes::Block;
use traversability::N_BINS;

/// Poses of one yaw in cells of a row that lie [`crate::Ratio::n_phases`] apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseLine {
    /// The first one's cell by lattice indices: column, row.
    pub cell: [i64; 2],
    /// Yaw bin.
    pub yaw: usize,
    /// Number of poses.
    pub n_lanes: usize,
}

/// What the prior says of a block of poses, for whoever mixes it with something else; one lane each.
#[derive(Clone, Debug)]
pub struct BlockPrior {
    /// Partial moments of the distributions of equation 18, as in [`traversability::PartialMoments`]: shape
    /// [parameter, bin].
    pub moments: [[Block; N_BINS]; 4],
    /// Number of obstacle cells that the footprint touches.
    pub n_obstacles: Block,
    /// 1 where so little of the footprint is known that it is judged as unknown ground, else 0.
    pub unknown: Block,
}

impl Default for BlockPrior {
    fn default() -> Self {
        Self { moments: [[Block::ZERO; N_BINS]; 4], n_obstacles: Block::ZERO, unknown: Block::ZERO }
    }
}
