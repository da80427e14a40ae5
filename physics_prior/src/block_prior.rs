//! What the prior says of many poses at once.

use bicycle::lanes::Block;
use traversability::{N_BINS, Risk};

/// Poses of one yaw in cells of a row that lie [`crate::ResolutionRatio::n_phases`] apart.
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
    /// 0 where the footprint touches no obstacle at any heading that the pose stands for, 1 where it does at one of
    /// them, 2 where it does at the middle one.
    pub obstruction: Block,
    /// 1 where so little of the footprint is known that it is judged as unknown ground, else 0.
    pub unknown: Block,
}

impl Default for BlockPrior {
    fn default() -> Self {
        Self { moments: [[Block::ZERO; N_BINS]; 4], obstruction: Block::ZERO, unknown: Block::ZERO }
    }
}

impl BlockPrior {
    /// The risk of a pose, by that of the ground and the obstacles that it touches.
    pub fn obstructed(&self, lane: usize, free: Risk) -> Risk {
        match self.obstruction.0[lane] {
            touching if touching > 1.0 => free.touching(),
            near if near > 0.0 => free.blocked(),
            _ => free,
        }
    }
}
