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
    /// Whether so little of the footprint is known that it is judged as unknown ground.
    pub is_unknown: bool,
}

impl PriorBelief {
    pub(crate) fn new(distribution: &PmfQuad, evidence: f32, is_unknown: bool) -> Self {
        let [linear, angular, roll, pitch] = distribution.pmfs();
        Self { linear, angular, roll, pitch, evidence, is_unknown }
    }

    /// CVaR of every parameter from its bad end; obstacles play no part.
    pub fn risk(&self, level: CvarLevel) -> Risk {
        PmfQuad::new(&self.linear, &self.angular, &self.roll, &self.pitch).risk(level)
    }
}
