//! What the physics prior believes of one pose.

use traversability::{CvarLevel, Pmf, PmfQuad, Risk};

/// Distributions of the four traversability parameters of one pose, and what they weigh against data
/// (PIETRA, equations 11 and 18).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorBelief {
    /// Linear traction, over [`traversability::Bins::TRACTION`].
    pub linear: Pmf,
    /// Angular traction, over [`traversability::Bins::TRACTION`].
    pub angular: Pmf,
    /// |roll|, over [`traversability::Bins::ATTITUDE`].
    pub roll: Pmf,
    /// |pitch|, over [`traversability::Bins::ATTITUDE`].
    pub pitch: Pmf,
    /// Pseudo-count of observations that the prior stands for.
    pub evidence: f32,
}

impl PriorBelief {
    pub(crate) fn new(distribution: &PmfQuad, evidence: f32) -> Self {
        let [linear, angular, roll, pitch] = distribution.pmfs();
        Self { linear, angular, roll, pitch, evidence }
    }

    /// CVaR of every parameter from its bad end; obstacles play no part.
    pub fn risk(&self, level: CvarLevel) -> Risk {
        PmfQuad::new(&self.linear, &self.angular, &self.roll, &self.pitch).risk(level)
    }
}
