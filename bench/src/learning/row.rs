//! The rows of the tables.

use evidential::Method;
use serde::Serialize;

/// What predicts: a method, a prior alone, or a switch between the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Row {
    /// EVORA with physics prior and physics-informed loss.
    Pietra,
    /// EVORA with the physics prior.
    EvoraPhysicsPrior,
    /// EVORA's networks without their prior where their density is at least the smallest of the training, the physics
    /// prior elsewhere.
    Switch,
    /// Physics-informed loss without evidence.
    PhysicsInformed,
    /// EMD2 without evidence.
    Vanilla,
    /// The physics prior alone.
    PhysicsPrior,
    /// EVORA with the physics-informed loss.
    EvoraPhysicsLoss,
    /// EVORA.
    Evora,
    /// All bins alike.
    UniformPrior,
}

impl Row {
    /// All rows; best first, as the paper found them.
    pub const ALL: [Self; 9] = [
        Self::Pietra,
        Self::EvoraPhysicsPrior,
        Self::Switch,
        Self::PhysicsInformed,
        Self::Vanilla,
        Self::PhysicsPrior,
        Self::EvoraPhysicsLoss,
        Self::Evora,
        Self::UniformPrior,
    ];
    /// Table I.
    pub const TABLE_ONE: [Self; 6] = [
        Self::Pietra,
        Self::PhysicsInformed,
        Self::Vanilla,
        Self::Evora,
        Self::PhysicsPrior,
        Self::UniformPrior,
    ];
    /// Table II.
    pub const TABLE_TWO: [Self; 5] =
        [Self::Pietra, Self::EvoraPhysicsLoss, Self::EvoraPhysicsPrior, Self::Switch, Self::Evora];

    /// Place in [`Row::ALL`].
    pub(super) const fn place(self) -> usize {
        self as usize
    }

    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pietra => "PIETRA",
            Self::EvoraPhysicsLoss => "UPI alone",
            Self::EvoraPhysicsPrior => "PP alone",
            Self::Switch => "switch if OOD",
            Self::PhysicsInformed => "physics-informed",
            Self::Vanilla => "vanilla",
            Self::Evora => "EVORA",
            Self::PhysicsPrior => "physics prior",
            Self::UniformPrior => "uniform prior",
        }
    }

    /// The method whose networks predict; `None` for a prior.
    pub const fn method(self) -> Option<Method> {
        match self {
            Self::Pietra => Some(Method::Pietra),
            Self::EvoraPhysicsLoss => Some(Method::EvoraPhysicsLoss),
            Self::EvoraPhysicsPrior => Some(Method::EvoraPhysicsPrior),
            Self::Switch | Self::Evora => Some(Method::Evora),
            Self::PhysicsInformed => Some(Method::PhysicsInformed),
            Self::Vanilla => Some(Method::Vanilla),
            Self::PhysicsPrior | Self::UniformPrior => None,
        }
    }

    /// EMD2 that PIETRA prints for the row: overall, in and out of distribution (tables I and II). Its unit is another
    /// than ours: ratios between rows compare, values do not.
    pub const fn published(self) -> [f64; 3] {
        match self {
            Self::Pietra => [2.77, 2.68, 2.78],
            Self::EvoraPhysicsLoss => [3.27, 2.67, 3.32],
            Self::EvoraPhysicsPrior => [2.86, 2.73, 2.87],
            Self::Switch => [2.93, 2.72, 2.95],
            Self::PhysicsInformed => [2.99, 2.68, 3.02],
            Self::Vanilla => [3.05, 2.74, 3.08],
            Self::Evora => [3.30, 2.72, 3.35],
            Self::PhysicsPrior => [3.09, 2.93, 3.10],
            Self::UniformPrior => [4.35, 4.34, 4.35],
        }
    }

    /// Published ratios to the uniform prior: overall, in and out of distribution.
    pub fn published_ratios(self) -> [f64; 3] {
        let uniform = Self::UniformPrior.published();
        std::array::from_fn(|domain| self.published()[domain] / uniform[domain])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_where_their_place_says() {
        for (place, row) in Row::ALL.into_iter().enumerate() {
            assert_eq!(row.place(), place);
        }
    }

    #[test]
    fn published_ratios_are_those_of_the_tables() {
        // 2.77 / 4.35, 2.68 / 4.34 and 2.78 / 4.35.
        let expected = [0.637, 0.618, 0.639];
        for (found, expected) in Row::Pietra.published_ratios().into_iter().zip(expected) {
            assert!((found - expected).abs() < 5e-4, "{found}");
        }
    }
}
