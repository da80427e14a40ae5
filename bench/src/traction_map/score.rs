//! Errors of distributions over a map, and how sure they are when neighbouring cells are alike.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;
use terrain::GridGeometry;
use traversability::Pmf;

use super::{N_RESAMPLES, Source};

/// A number with its interval of 95 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Interval {
    /// Over all cells.
    pub value: f64,
    /// 2.5 % of the redraws are below.
    pub low: f64,
    /// 2.5 % of the redraws are above.
    pub high: f64,
}

/// How far a way to have distributions is off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MethodScore {
    /// Where the distributions come from.
    pub source: Source,
    /// Mean squared earth mover's distance to the measured distributions (equation 12), in bins.
    pub emd2: Interval,
    /// Mean error less that of the prediction, paired.
    pub less_prediction: Interval,
    /// Mean error less that of the physics prior alone, paired: what the prediction adds to the prior.
    pub less_prior: Interval,
    /// Mean error over that of the uniform distribution, paired [-].
    pub over_uniform: Interval,
}

/// One traction parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Head {
    /// In the order of [`Source::ALL`].
    pub scores: [MethodScore; 6],
    /// Area under the curve of a low density as the sign of a prediction whose error is above the median: 0.5 is
    /// chance, 1 perfect.
    pub density_auroc: Interval,
}

impl Head {
    /// The errors of one source.
    pub fn score(&self, source: Source) -> &MethodScore {
        // The discriminants count from 0 in the order of `Source::ALL`.
        &self.scores[source as usize]
    }
}

/// EMD2 of equation 12: squared length of the difference of two cumulative distributions.
pub(super) fn emd2(a: &Pmf, b: &Pmf) -> f64 {
    let mut cumulative = 0.0;
    let differences =
        a.probabilities().iter().zip(b.probabilities()).map(|(a, b)| f64::from(*a) - f64::from(*b));
    differences
        .map(|difference| {
            cumulative += difference;
            cumulative * cumulative
        })
        .sum()
}

/// The value that a share of the ascending values does not exceed (nearest rank); NaN of none.
pub(super) fn quantile(ascending: &[f64], share: f64) -> f64 {
    let rank = (share * ascending.len() as f64).ceil() as usize;
    ascending.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// Cells by the square of ground they lie in, as places in a list of cells.
#[derive(Debug)]
pub(super) struct Blocks(Vec<Vec<usize>>);

impl Blocks {
    pub fn of(geometry: &GridGeometry, cells: &[usize], block_m: f64) -> Self {
        let n = (block_m / geometry.resolution_m).round().max(1.0) as usize;
        let mut blocks: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        for (place, &index) in cells.iter().enumerate() {
            let cell = geometry.cell(index);
            blocks.entry([cell.row / n, cell.col / n]).or_default().push(place);
        }
        Self(blocks.into_values().collect())
    }

    pub fn n(&self) -> usize {
        self.0.len()
    }

    /// As many blocks as there are, drawn with replacement.
    fn redraw(&self, random: &mut Xoshiro256PlusPlus) -> Vec<usize> {
        (0..self.n()).map(|_| random.random_range(0..self.n())).collect()
    }
}

/// The errors of every source, cell by cell, as means with intervals.
pub(super) fn head(errors: &[Vec<f64>; 6], density: &[f64], blocks: &Blocks, seed: u64) -> Head {
    let sums: Vec<[f64; 7]> = blocks.0.iter().map(|places| block_sums(errors, places)).collect();
    let means = |drawn: &mut dyn Iterator<Item = usize>| -> [f64; 6] {
        let mut total = [0.0; 7];
        for block in drawn {
            for (total, sum) in total.iter_mut().zip(sums[block]) {
                *total += sum;
            }
        }
        std::array::from_fn(|source| total[source] / total[6])
    };
    let bad = above_median(&errors[0]);
    let auroc_of = |places: Vec<usize>| auroc(places.into_iter().map(|i| (-density[i], bad[i])).collect());
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut redrawn = Vec::with_capacity(N_RESAMPLES);
    let mut aurocs = Vec::with_capacity(N_RESAMPLES);
    for _ in 0..N_RESAMPLES {
        let drawn = blocks.redraw(&mut random);
        redrawn.push(means(&mut drawn.iter().copied()));
        aurocs.push(auroc_of(drawn.iter().flat_map(|&block| blocks.0[block].iter().copied()).collect()));
    }
    let all = means(&mut (0..blocks.n()));
    let interval = |of: &dyn Fn(&[f64; 6]) -> f64| Interval::of(of(&all), redrawn.iter().map(of).collect());
    let less =
        |source: Source, other: Source| interval(&|means| means[source as usize] - means[other as usize]);
    let scores = Source::ALL.map(|source| MethodScore {
        source,
        emd2: interval(&|means| means[source as usize]),
        less_prediction: less(source, Source::Prediction),
        less_prior: less(source, Source::Prior),
        over_uniform: interval(&|means| means[source as usize] / means[Source::Uniform as usize]),
    });
    let density_auroc = Interval::of(auroc_of((0..density.len()).collect()), aurocs);
    Head { scores, density_auroc }
}

/// Sums of the errors of one block, and at the end how many cells it has.
fn block_sums(errors: &[Vec<f64>; 6], places: &[usize]) -> [f64; 7] {
    let mut sums = [0.0; 7];
    for &place in places {
        for (sum, errors) in sums.iter_mut().zip(errors) {
            *sum += errors[place];
        }
        sums[6] += 1.0;
    }
    sums
}

impl Interval {
    fn of(value: f64, mut redrawn: Vec<f64>) -> Self {
        redrawn.retain(|value| !value.is_nan());
        redrawn.sort_by(f64::total_cmp);
        Self { value, low: quantile(&redrawn, 0.025), high: quantile(&redrawn, 0.975) }
    }
}

fn above_median(errors: &[f64]) -> Vec<bool> {
    let mut ascending = errors.to_vec();
    ascending.sort_by(f64::total_cmp);
    let median = quantile(&ascending, 0.5);
    errors.iter().map(|&error| error > median).collect()
}

/// Probability that a bad one of the (score, bad) pairs has a higher score than a good one, ties counting one half
/// (Mann and Whitney); NaN without one of each.
fn auroc(mut pairs: Vec<(f64, bool)>) -> f64 {
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n_bad = pairs.iter().filter(|(_, bad)| *bad).count() as f64;
    let n_good = pairs.len() as f64 - n_bad;
    let (mut good_below, mut won) = (0.0, 0.0);
    for tied in pairs.chunk_by(|a, b| a.0 == b.0) {
        let bad = tied.iter().filter(|(_, bad)| *bad).count() as f64;
        let good = tied.len() as f64 - bad;
        won += bad * (good_below + 0.5 * good);
        good_below += good;
    }
    won / (n_bad * n_good)
}

#[cfg(test)]
mod tests {
    use traversability::Bins;

    use super::*;

    fn one_hot(value: f32) -> Pmf {
        Pmf::one_hot(&Bins::TRACTION, value).unwrap()
    }

    #[test]
    fn the_distance_counts_the_bins_between() {
        assert_eq!(emd2(&one_hot(0.0), &one_hot(0.0)), 0.0);
        assert_eq!(emd2(&one_hot(0.0), &one_hot(1.0)), 11.0);
        assert_eq!(emd2(&one_hot(0.25), &one_hot(0.45)), 2.0);
        // NOTES: uniform against one-hot in the first bin: sum of (k/12)^2 for k = 0..11 = 3.514.
        assert!((emd2(&Pmf::UNIFORM, &one_hot(0.0)) - 506.0 / 144.0).abs() < 1e-6);
    }

    #[test]
    fn the_area_is_the_share_of_pairs_in_order() {
        let pairs = |pairs: &[(f64, bool)]| auroc(pairs.to_vec());
        assert_eq!(pairs(&[(1.0, true), (0.0, false)]), 1.0);
        assert_eq!(pairs(&[(1.0, false), (0.0, true)]), 0.0);
        assert_eq!(pairs(&[(1.0, false), (1.0, true)]), 0.5);
        // Bad at 1 and 3, good at 2 and 1: of four pairs (1,2) is lost, (1,1) tied, two are won.
        assert_eq!(pairs(&[(1.0, true), (3.0, true), (2.0, false), (1.0, false)]), 0.625);
        assert!(pairs(&[(1.0, true)]).is_nan());
    }

    #[test]
    fn sources_count_in_the_order_of_their_list() {
        for (place, source) in Source::ALL.into_iter().enumerate() {
            assert_eq!(source as usize, place);
        }
    }

    #[test]
    fn blocks_hold_their_cells_and_no_others() {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [0, 0], n_rows: 4, n_cols: 5 };
        let cells: Vec<usize> = (0..20).filter(|index| *index != 7).collect();
        let blocks = Blocks::of(&geometry, &cells, 1.0);
        assert_eq!(blocks.n(), 6);
        assert_eq!(
            blocks.0[1],
            [2, 3, 7],
            "row 0: cells 2 and 3; row 1: cell 8, the eighth of those that are left"
        );
    }

    #[test]
    fn pairing_takes_out_what_all_sources_share() {
        // Four blocks of different difficulty; every source is off by its number more, whatever the block.
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 1, n_cols: 8 };
        let cells: Vec<usize> = (0..8).collect();
        let blocks = Blocks::of(&geometry, &cells, 2.0);
        let errors = std::array::from_fn(|s| (0..8).map(|i| (i / 2 * 3 + s) as f64).collect());
        let density: Vec<f64> = (0..8).map(|i| -f64::from(i)).collect();
        let head = head(&errors, &density, &blocks, 1);
        let score = &head.scores[4];
        assert_eq!(score.emd2.value, 8.5);
        assert!(score.emd2.low < 7.0 && score.emd2.high > 10.0, "{:?}", score.emd2);
        // The fifth source is off by 4 more than the first and by 2 more than the third, in every redraw.
        for (difference, expected) in [(score.less_prediction, 4.0), (score.less_prior, 2.0)] {
            let ends = [difference.value, difference.low, difference.high];
            assert!(ends.iter().all(|end| (end - expected).abs() < 1e-12), "{difference:?}");
        }
        assert_eq!(head.density_auroc.value, 1.0);
    }

    #[test]
    fn cells_of_a_block_are_drawn_together() {
        // Two blocks of 50 cells: the sources differ by 1 in the one and not at all in the other. Redraws of blocks give
        // 0, 1/2 or 1, the ends with a quarter each; 100 cells drawn one by one would stay within 0.4 and 0.6.
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 1, n_cols: 100 };
        let cells: Vec<usize> = (0..100).collect();
        let blocks = Blocks::of(&geometry, &cells, 50.0);
        let error = |source: usize, cell: usize| {
            f64::from(u8::from(source == Source::FusedWithPhysics as usize && cell < 50))
        };
        let errors = std::array::from_fn(|s| (0..100).map(|i| error(s, i)).collect());
        let fused = head(&errors, &[0.0; 100], &blocks, 1).scores[Source::FusedWithPhysics as usize];
        assert_eq!((fused.less_prior.low, fused.less_prior.value, fused.less_prior.high), (0.0, 0.5, 1.0));
    }
}
