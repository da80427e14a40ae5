//! The rows of the table: who plans, and with what knowledge.

use route::{FrictionCurve, GroundCell, RouteConfig};
use scenarios::{GroundKind, Landscape, stream};
use serde::Serialize;
use terrain::GridMap;

use rand::RngExt;
use rand_distr::StandardNormal;

/// How a route is planned (AnyNav, table 6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Shortest way around obstacles and ice; whatever the rest is like.
    Binary,
    /// Cheapest way by how likely a look from above says that ground can be driven on; heights unseen, one speed.
    Appearance,
    /// Friction 0.2 everywhere.
    Constant20,
    /// Friction 0.5 everywhere.
    Constant50,
    /// Friction 0.8 everywhere.
    Constant80,
    /// Half of the friction of each ground.
    Friction50,
    /// One and a half times the friction of each ground.
    Friction150,
    /// Three quarters of the planned speed.
    Speed75,
    /// Five quarters of the planned speed.
    Speed125,
    /// Turns cost nothing.
    NoSteering,
    /// As shipped.
    Ours,
}

impl Method {
    /// All, in the order of the table.
    pub const ALL: [Self; 11] = [
        Self::Binary,
        Self::Appearance,
        Self::Constant20,
        Self::Constant50,
        Self::Constant80,
        Self::Friction50,
        Self::Friction150,
        Self::Speed75,
        Self::Speed125,
        Self::NoSteering,
        Self::Ours,
    ];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Binary => "binary",
            Self::Appearance => "URA*-like",
            Self::Constant20 => "friction 0.2",
            Self::Constant50 => "friction 0.5",
            Self::Constant80 => "friction 0.8",
            Self::Friction50 => "0.5 friction",
            Self::Friction150 => "1.5 friction",
            Self::Speed75 => "0.75 speed",
            Self::Speed125 => "1.25 speed",
            Self::NoSteering => "no steering cost",
            Self::Ours => "ours",
        }
    }

    /// What planned speeds are multiplied with [-].
    pub(super) const fn speed_factor(self) -> f64 {
        match self {
            Self::Speed75 => 0.75,
            Self::Speed125 => 1.25,
            _ => 1.0,
        }
    }

    /// What it weighs, of what our planner weighs.
    pub(super) fn config(self, ours: RouteConfig) -> RouteConfig {
        let by_length = RouteConfig {
            viscous_weight_mps: 0.0,
            slope_weight: 0.0,
            roughness_weight: 0.0,
            roughness_max_m: 100.0,
            steering_weight: 0.0,
            ..ours
        };
        match self {
            Self::Binary | Self::Appearance => by_length,
            Self::NoSteering => RouteConfig { steering_weight: 0.0, ..ours },
            _ => ours,
        }
    }

    /// The map that it searches, made of the one that everybody could know.
    pub(super) fn map(self, known: &GridMap<GroundCell>, landscape: &Landscape) -> GridMap<GroundCell> {
        let friction = |change: &dyn Fn(FrictionCurve) -> FrictionCurve| {
            let cells = known.values().iter();
            cells.map(|cell| GroundCell { friction: change(cell.friction), ..*cell }).collect()
        };
        let values: Vec<GroundCell> = match self {
            Self::Binary => binary(known, landscape),
            Self::Appearance => appearance(known, landscape),
            Self::Constant20 => friction(&|_| constant(0.2)),
            Self::Constant50 => friction(&|_| constant(0.5)),
            Self::Constant80 => friction(&|_| constant(0.8)),
            Self::Friction50 => friction(&|curve| curve.scaled(0.5)),
            Self::Friction150 => friction(&|curve| curve.scaled(1.5)),
            Self::Speed75 | Self::Speed125 | Self::NoSteering | Self::Ours => known.values().to_vec(),
        };
        GridMap::from_values(*known.geometry(), values).unwrap_or_else(|| known.clone())
    }
}

/// The same friction at every speed of sliding that is asked for.
const fn constant(friction: f32) -> FrictionCurve {
    FrictionCurve {
        static_friction: friction,
        sliding_friction: friction,
        viscous_friction: 0.0,
        stribeck_speed_mps: 0.5,
    }
}

/// The map that everybody could know: true heights, roughness, trees and water, and of each ground the published
/// friction,
/// from which the true one departs.
pub(super) fn known(landscape: &Landscape) -> GridMap<GroundCell> {
    let world = &landscape.world;
    let geometry = *world.geometry();
    let mut map = GridMap::filled(geometry, GroundCell::UNKNOWN);
    for (index, cell) in map.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let patch = &world.patches.values()[index];
        let (_, friction) = FrictionCurve::PUBLISHED[landscape.grounds.values()[index] as usize];
        *cell = GroundCell {
            height_m: world.heights.values()[index],
            friction,
            roughness_m: world.roughness_m(x_m, y_m, geometry.resolution_m) as f32,
            is_obstacle: patch.obstacle_height_m > 0.0 || patch.is_water(),
        };
    }
    map
}

/// Obstacles and ice are forbidden, the rest is alike (Ramirez-Robles et al. 2024, as AnyNav tells it).
fn binary(known: &GridMap<GroundCell>, landscape: &Landscape) -> Vec<GroundCell> {
    let cells = known.values().iter().zip(landscape.grounds.values());
    let open = GroundCell::level(constant(1.0));
    cells
        .map(|(cell, ground)| GroundCell {
            is_obstacle: cell.is_obstacle || *ground == GroundKind::Ice,
            ..open
        })
        .collect()
}

/// How likely a look from above says that a ground can be driven on, in the order of the grounds, and for obstacles.
const LIKELY: [f32; 7] = [0.95, 0.6, 0.85, 0.8, 0.55, 0.7, 0.6];
const LIKELY_OBSTACLE: f32 = 0.15;
/// Standard deviation of one network of an ensemble, and their number.
const NOISE: f32 = 0.15;
const N_NETWORKS: usize = 5;
/// Ground that is likelier not to be driven on than to be is closed.
const CLOSED_BELOW: f32 = 0.5;

/// A grid of the ensemble's mean probability, over which a metre costs the more the less likely it is (Moore et al.
/// 2023;
/// a metre at probability p costs 3 + 1 / p).
fn appearance(known: &GridMap<GroundCell>, landscape: &Landscape) -> Vec<GroundCell> {
    let mut rng = stream(0, &[0x0A57, landscape.kind as u64]);
    let cells = known.values().iter().zip(landscape.grounds.values());
    cells
        .map(|(cell, ground)| {
            let truth = if cell.is_obstacle { LIKELY_OBSTACLE } else { LIKELY[*ground as usize] };
            let noise: f32 = (0..N_NETWORKS).map(|_| rng.sample::<f32, _>(StandardNormal)).sum();
            let likely = (truth + NOISE * noise / N_NETWORKS as f32).clamp(0.02, 0.99);
            GroundCell { is_obstacle: likely < CLOSED_BELOW, ..GroundCell::level(constant(likely)) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenarios::LandscapeKind;

    #[test]
    fn every_row_searches_what_it_knows() {
        let landscape = Landscape::new(LandscapeKind::Garden, 2).unwrap();
        let known = known(&landscape);
        let at = |method: Method, index: usize| method.map(&known, &landscape).values()[index];
        let grounds = landscape.grounds.values();
        let of = |kind: GroundKind| {
            let is_it = |index: &usize| grounds[*index] == kind && !known.values()[*index].is_obstacle;
            (0..grounds.len()).find(is_it).unwrap()
        };
        let ice = of(GroundKind::Ice);
        assert_eq!(at(Method::Ours, ice).friction, FrictionCurve::ICE);
        assert!(at(Method::Binary, ice).is_obstacle && !at(Method::Constant80, ice).is_obstacle);
        for (method, friction) in
            [(Method::Constant20, 0.2), (Method::Constant50, 0.5), (Method::Constant80, 0.8)]
        {
            assert!((at(method, ice).friction.at(1.0) - friction).abs() < 1e-6);
            assert_eq!(at(method, ice).height_m, known.values()[ice].height_m);
        }
        let sand = of(GroundKind::Sand);
        let share = at(Method::Friction150, sand).friction.at(1.0) / FrictionCurve::SAND.at(1.0);
        assert!((share - 1.5).abs() < 1e-5);
        // 0.7 +- 0.15 / sqrt(5), four deviations.
        let seen = at(Method::Appearance, sand);
        assert!((seen.friction.at(1.0) - 0.7).abs() < 0.27 && seen.height_m == 0.0);
    }
}
