//! What the planner makes of a cover: one traction for each, the worst that is likely enough to matter.

use serde::Serialize;
use terrain::GridGeometry;
use traversability::{CvarLevel, Risk, RiskMap, lower_tail_cvar};

use super::mixture::Mixture;
use super::world::{CELL_M, Cover, N_CELLS, World};

/// How the worst share of a distribution becomes one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// As in EVORA's public planner, see [`whole_bin_cvar`].
    WholeBin,
    /// [`lower_tail_cvar`]: the bin that the level cuts counts by its part.
    Exact,
}

impl Method {
    /// Both, in the order of the table.
    pub const ALL: [Self; 2] = [Self::WholeBin, Self::Exact];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::WholeBin => "whole-bin",
            Self::Exact => "exact",
        }
    }

    /// Traction that a plan expects of a cover, linear as angular [-].
    pub fn traction(self, cover: Cover, level: CvarLevel) -> f32 {
        let (values, bins) = (Mixture::bin_values(), cover.traction().bins());
        match self {
            Self::WholeBin => whole_bin_cvar(&values, &bins, level),
            Self::Exact => lower_tail_cvar(&values, &bins, level),
        }
    }
}

/// Mean of the lowest bins up to the first at which the level is reached, that one whole, rounded up to the value of a
/// bin and then down to a whole percent; at level 1 the mean of all, rounded the same way. So does the public planner of
/// EVORA (mppi_numba, deterministic dynamics), to whom a traction is a bin, and a map one byte for each cell.
pub fn whole_bin_cvar(values: &[f32], probabilities: &[f32], level: CvarLevel) -> f32 {
    let (mut mass, mut sum) = (0.0, 0.0);
    for (value, probability) in values.iter().zip(probabilities) {
        mass += f64::from(*probability);
        sum += f64::from(value * probability);
        if level != CvarLevel::MEAN && mass >= level.get() {
            break;
        }
    }
    // Single precision keeps a bin's own value from being rounded to the next.
    let mean = (sum / mass) as f32;
    let bin = values.iter().copied().find(|&value| mean <= value);
    (f64::from(bin.unwrap_or(mean)) * 100.0).floor() as f32 / 100.0
}

/// The map that is planned on: one traction for each cover, and around the world a ring on which nothing moves.
pub fn risk_map(world: &World, method: Method, level: CvarLevel) -> RiskMap {
    let side = N_CELLS + 2;
    let geometry = GridGeometry { resolution_m: CELL_M, origin: [-1; 2], n_rows: side, n_cols: side };
    let [dirt, bush] = Cover::ALL.map(|cover| {
        let traction = method.traction(cover, level);
        Risk { linear_traction: traction, angular_traction: traction, ..Risk::NONE }
    });
    let mut map = RiskMap::constant(geometry, 1, dirt);
    map.fill(|risks, _| {
        for (index, risk) in risks.iter_mut().enumerate() {
            let is_bush = world.cover_at(geometry.centre_m(geometry.cell(index))) == Some(Cover::Bush);
            *risk = if is_bush { bush } else { dirt };
        }
    });
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(level: f64) -> CvarLevel {
        CvarLevel::new(level).unwrap()
    }

    #[test]
    fn whole_bin_takes_the_bin_that_the_level_cuts_and_rounds_up() {
        let (values, bins) = ([0.0, 0.2, 0.6, 1.0], [0.1, 0.3, 0.4, 0.2]);
        // 0.1 + 0.3 reach 0.3: 0.06 / 0.4 = 0.15, the next bin is 0.2; exactly 0.2 x 0.2 / 0.3 = 0.133.
        assert_eq!(whole_bin_cvar(&values, &bins, level(0.3)), 0.2);
        assert!((lower_tail_cvar(&values, &bins, level(0.3)) - 0.4 / 3.0).abs() < 1e-6);
        // The mean is 0.06 + 0.24 + 0.2 = 0.5.
        assert_eq!(whole_bin_cvar(&values, &bins, CvarLevel::MEAN), 0.6);
        // A level within the first bin, and a first bin that is empty.
        assert_eq!(whole_bin_cvar(&values, &bins, level(0.05)), 0.0);
        assert_eq!(whole_bin_cvar(&values, &[0.0, 1.0, 0.0, 0.0], level(0.4)), 0.2);
    }

    #[test]
    fn whole_percents_are_kept() {
        assert_eq!(whole_bin_cvar(&[0.025, 0.675], &[0.0, 1.0], level(0.5)), 0.67);
    }

    #[test]
    fn exact_expects_less_of_a_bush_where_the_low_mode_ends() {
        // 0.434 of a bush is the low mode, so that at 0.6 a sixth of the tail is the high one: the mean of the low mode
        // is 0.1197, that of the lowest part of the high one about 0.7. With whole bins it is the bin above.
        let [whole_bin, exact] = Method::ALL.map(|method| method.traction(Cover::Bush, level(0.6)));
        assert!((0.25..0.30).contains(&exact), "{exact}");
        assert!(whole_bin - exact > 0.02, "{whole_bin} {exact}");
        // The mean of dirt is 0.65, but for what is cut off.
        assert!((Method::Exact.traction(Cover::Dirt, CvarLevel::MEAN) - 0.65).abs() < 1e-3);
        assert_eq!(Method::WholeBin.traction(Cover::Dirt, CvarLevel::MEAN), 0.67);
    }

    #[test]
    fn map_lies_over_the_world_and_nothing_moves_around_it() {
        let world = World::new(0.5, 1);
        let map = risk_map(&world, Method::Exact, level(0.4));
        let traction_at = |x_m: f64, y_m: f64| map.view().risk_at(x_m, y_m, 0.0).angular_traction;
        for (row, col) in (0..9).flat_map(|row| (0..9).map(move |col| (row, col))) {
            let [x_m, y_m] = [col, row].map(|i| f64::from(i) + 0.5);
            let cover = world.cover_at([x_m, y_m]).unwrap();
            assert_eq!(traction_at(x_m, y_m), Method::Exact.traction(cover, level(0.4)));
        }
        assert_eq!((traction_at(-0.5, 4.0), traction_at(4.0, 9.5), traction_at(-3.0, 0.0)), (0.0, 0.0, 0.0));
    }
}
