//! What the runs of one density and risk tolerance add up to.

use serde::Serialize;

use super::published::Published;
use crate::statistics::{Count, fisher_exact, holm, mcnemar_p_value, newcombe_interval, wilson_interval};

/// A difference of two shares, the first less the second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The difference.
    pub value: f64,
    /// Lower end of Newcombe's 95 % interval.
    pub low: f64,
    /// Upper end of it.
    pub high: f64,
    /// Fisher's exact test, two-sided.
    pub p: f64,
    /// The same with Holm's correction over all cells of the method that have a published value.
    pub p_holm: f64,
}

/// The runs of one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// How many reached the goal.
    #[serde(flatten)]
    pub count: Count,
    /// Share that reached the goal.
    pub success: f64,
    /// Lower end of the share's 95 % Wilson interval.
    pub wilson_low: f64,
    /// Upper end of it.
    pub wilson_high: f64,
    /// Mean over the runs that reached the goal [s]; null without one.
    pub mean_time_to_goal_s: Option<f64>,
    /// Success less the published one; null where nothing is published.
    pub less_published: Option<Difference>,
    /// Time to the goal of each run by ascending seed [s]; null for one that did not reach it.
    pub times_to_goal_s: Vec<Option<f64>>,
}

/// The two methods on the same worlds with the same samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Paired {
    /// Success with the exact CVaR less that with whole bins.
    pub value: f64,
    /// Runs that only the exact CVaR brought to the goal.
    pub n_exact_only: usize,
    /// Runs that only whole bins brought to the goal.
    pub n_whole_bin_only: usize,
    /// McNemar's exact test, two-sided.
    pub p: f64,
    /// The same with Holm's correction over all cells.
    pub p_holm: f64,
}

/// All runs of a density and a risk tolerance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Probability of a bush [-].
    pub density: f64,
    /// Risk tolerance (CVaR level).
    pub alpha: f64,
    /// What is published of whole bins; null where nothing is.
    pub published: Option<Published>,
    /// Whole bins.
    pub whole_bin: Row,
    /// The exact CVaR.
    pub exact: Row,
    /// One against the other.
    pub exact_less_whole_bin: Paired,
}

impl Row {
    fn new(times_to_goal_s: Vec<Option<f64>>, published: Option<Published>) -> Self {
        let reached: Vec<f64> = times_to_goal_s.iter().copied().flatten().collect();
        let count = Count { n_hit: reached.len(), n: times_to_goal_s.len() };
        let [wilson_low, wilson_high] = wilson_interval(count.n_hit, count.n);
        let mean_s = reached.iter().sum::<f64>() / reached.len() as f64;
        Self {
            count,
            success: count.share(),
            wilson_low,
            wilson_high,
            mean_time_to_goal_s: (!reached.is_empty()).then_some(mean_s),
            less_published: published.map(|published| Difference::of(count, published.count)),
            times_to_goal_s,
        }
    }
}

impl Difference {
    /// Not yet corrected.
    fn of(first: Count, second: Count) -> Self {
        let [low, high] = newcombe_interval(first, second);
        let p = fisher_exact(first, second);
        Self { value: first.share() - second.share(), low, high, p, p_holm: p }
    }
}

impl Paired {
    /// Not yet corrected.
    fn of(exact: &Row, whole_bin: &Row) -> Self {
        let only = |one: &Row, other: &Row| {
            let pairs = one.times_to_goal_s.iter().zip(&other.times_to_goal_s);
            pairs.filter(|(time, other)| time.is_some() && other.is_none()).count()
        };
        let (n_exact_only, n_whole_bin_only) = (only(exact, whole_bin), only(whole_bin, exact));
        let p = mcnemar_p_value(n_exact_only, n_whole_bin_only);
        Self { value: exact.success - whole_bin.success, n_exact_only, n_whole_bin_only, p, p_holm: p }
    }
}

impl Cell {
    /// Of at least one run with whole bins and as many with the exact CVaR, by ascending seed [s].
    pub(super) fn new(
        [density, alpha]: [f64; 2],
        whole_bin: Vec<Option<f64>>,
        exact: Vec<Option<f64>>,
    ) -> Self {
        let published = Published::at(density, alpha);
        let [whole_bin, exact] = [whole_bin, exact].map(|times_s| Row::new(times_s, published));
        let exact_less_whole_bin = Paired::of(&exact, &whole_bin);
        Self { density, alpha, published, whole_bin, exact, exact_less_whole_bin }
    }

    /// Corrects the probabilities of all cells, each family of tests for itself.
    pub(super) fn correct(cells: &mut [Self]) {
        let whole_bin = cells.iter_mut().filter_map(|cell| cell.whole_bin.less_published.as_mut());
        correct(whole_bin.map(|difference| (difference.p, &mut difference.p_holm)));
        let exact = cells.iter_mut().filter_map(|cell| cell.exact.less_published.as_mut());
        correct(exact.map(|difference| (difference.p, &mut difference.p_holm)));
        let paired = cells.iter_mut().map(|cell| &mut cell.exact_less_whole_bin);
        correct(paired.map(|paired| (paired.p, &mut paired.p_holm)));
    }
}

fn correct<'a>(family: impl Iterator<Item = (f64, &'a mut f64)>) {
    let (probabilities, places): (Vec<f64>, Vec<&mut f64>) = family.unzip();
    for (place, corrected) in places.into_iter().zip(holm(&probabilities)) {
        *place = corrected;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first `n` of ten runs reach the goal, after as many seconds as their number.
    fn first(n: usize) -> Vec<Option<f64>> {
        (1..=10).map(|number| (number <= n).then_some(number as f64)).collect()
    }

    #[test]
    fn cell_counts_pairs_and_times() {
        let mut exact = first(4);
        (exact[0], exact[8], exact[9]) = (None, Some(3.0), Some(6.0));
        let cell = Cell::new([1.0, 0.6], first(2), exact);
        assert_eq!((cell.whole_bin.count.n_hit, cell.exact.count.n_hit), (2, 5));
        assert_eq!(
            (cell.whole_bin.mean_time_to_goal_s, cell.exact.mean_time_to_goal_s),
            (Some(1.5), Some(3.6))
        );
        let paired = cell.exact_less_whole_bin;
        assert_eq!((paired.n_exact_only, paired.n_whole_bin_only), (4, 1));
        // At most one of five throws: 6 of 32, twice.
        assert!((paired.p - 12.0 / 32.0).abs() < 1e-12 && (paired.value - 0.3).abs() < 1e-12);
        let published = cell.exact.less_published.unwrap();
        assert!((published.value - (0.5 - 0.225)).abs() < 1e-12);
        assert!(published.low < published.value && published.value < published.high);
    }

    #[test]
    fn nobody_there_has_no_time_and_what_is_not_published_no_difference() {
        let cell = Cell::new([0.3, 0.6], first(0), first(1));
        assert_eq!((cell.whole_bin.mean_time_to_goal_s, cell.whole_bin.less_published), (None, None));
    }

    #[test]
    fn each_family_is_corrected_by_its_own_size() {
        let of = |density: f64| Cell::new([density, 0.6], first(0), first(7));
        let mut cells = [of(1.0), of(0.7), of(0.3)];
        Cell::correct(&mut cells);
        // Three cells are paired, with seven pairs of a kind each; two have a published value.
        let p = 2.0 / 128.0;
        for cell in &cells {
            assert!((cell.exact_less_whole_bin.p_holm - 3.0 * p).abs() < 1e-12);
        }
        let [most, least] = [1, 0].map(|index| cells[index].whole_bin.less_published.unwrap());
        assert!(most.p < least.p && (most.p_holm - 2.0 * most.p).abs() < 1e-12);
        assert!((least.p_holm - least.p.max(most.p_holm)).abs() < 1e-12);
    }
}
