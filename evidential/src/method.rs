//! The methods that can be trained: PIETRA, the work it builds on, and what stands between them.

use serde::{Deserialize, Serialize};

/// How the networks are trained and what their evidence is weighed against (PIETRA, tables I and II).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Posterior over the physics prior, uncertainty-aware physics-informed loss (equations 11 and 14).
    Pietra,
    /// Posterior over the physics prior, loss without physics: EVORA with the prior alone changed.
    EvoraPhysicsPrior,
    /// Posterior over the uniform prior, physics-informed loss: EVORA with the loss alone changed.
    EvoraPhysicsLoss,
    /// Posterior over the uniform prior, UEMD2 loss (equation 13).
    Evora,
    /// No evidence: EMD2 to the data plus weighted EMD2 to the physics prior.
    PhysicsInformed,
    /// No evidence: EMD2 to the data (equation 12).
    Vanilla,
}

/// What the learned evidence is weighed against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prior {
    /// The physics prior of the pose.
    Physics,
    /// All bins alike.
    Uniform,
    /// Nothing: the prediction stands alone and has no flow.
    None,
}

impl Method {
    /// All methods, as the tables list them.
    pub const ALL: [Self; 6] = [
        Self::Pietra,
        Self::EvoraPhysicsPrior,
        Self::EvoraPhysicsLoss,
        Self::Evora,
        Self::PhysicsInformed,
        Self::Vanilla,
    ];

    /// Name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pietra => "pietra",
            Self::EvoraPhysicsPrior => "evora-physics-prior",
            Self::EvoraPhysicsLoss => "evora-physics-loss",
            Self::Evora => "evora",
            Self::PhysicsInformed => "physics-informed",
            Self::Vanilla => "vanilla",
        }
    }

    /// What the learned evidence is weighed against, in training and afterwards.
    pub const fn prior(self) -> Prior {
        match self {
            Self::Pietra | Self::EvoraPhysicsPrior => Prior::Physics,
            Self::EvoraPhysicsLoss | Self::Evora => Prior::Uniform,
            Self::PhysicsInformed | Self::Vanilla => Prior::None,
        }
    }

    /// Whether the loss has a term that keeps the prediction close to the physics prior (weight kappa).
    pub const fn has_physics_loss(self) -> bool {
        matches!(self, Self::Pietra | Self::EvoraPhysicsLoss | Self::PhysicsInformed)
    }

    /// Whether there is a flow, and with it evidence and an entropy bonus.
    pub const fn is_evidential(self) -> bool {
        !matches!(self.prior(), Prior::None)
    }
}
