//! What the runs at one speed add up to.

use serde::Serialize;

use super::{Method, MixedRun, SURFACES};
use crate::statistics::{Mean, mcnemar_p_value, wilson_interval};

/// All methods at one speed.
#[derive(Clone, Debug, Serialize)]
pub struct SpeedReport {
    /// Target speed [m/s].
    pub speed_mps: f64,
    /// In the order of the methods that were asked for.
    pub rows: Vec<MixedRow>,
}

/// One method at one speed.
#[derive(Clone, Debug, Serialize)]
pub struct MixedRow {
    /// Which.
    pub method: Method,
    /// Runs.
    pub n: usize,
    /// Runs that came around.
    pub n_finished: usize,
    /// Runs that stayed between the walls all the way.
    pub n_within_walls: usize,
    /// Share of those with its 95 % Wilson interval.
    pub within_walls: [f64; 3],
    /// Root mean square distance to the line of the runs that came around [m].
    pub distance_m: Option<Mean>,
    /// Their time once around [s].
    pub time_s: Option<Mean>,
    /// The same ground with this method and with none; none for none.
    pub less_plain: Option<Paired>,
    /// All runs.
    pub runs: Vec<MixedRun>,
}

/// A method less [`Method::Plain`], on the same ground with the same noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Paired {
    /// Pairs of which both came around.
    pub n: usize,
    /// Root mean square distance to the line [m].
    pub distance_m: Option<Mean>,
    /// Time once around [s].
    pub time_s: Option<Mean>,
    /// The distance on each of the surfaces alone [m].
    pub surface_distance_m: [Option<Mean>; SURFACES.len()],
    /// Pairs of which only the one with the method stayed between the walls.
    pub n_only_method: usize,
    /// Pairs of which only the plain one did.
    pub n_only_plain: usize,
    /// Probability of a split at least as uneven by chance, two-sided and exact (McNemar).
    pub p_value: f64,
}

impl SpeedReport {
    /// Of runs method by method, each in the order of their numbers.
    pub(super) fn new(speed_mps: f64, methods: &[Method], runs: &[MixedRun]) -> Self {
        let per_method = runs.len() / methods.len();
        let of = |method: Method| {
            let place = methods.iter().position(|other| *other == method)?;
            Some(&runs[place * per_method..][..per_method])
        };
        let row = |method: &Method| {
            let runs = of(*method).unwrap_or_default();
            let plain = of(Method::Plain).filter(|_| *method != Method::Plain);
            MixedRow::new(*method, runs, plain.map(|plain| Paired::of(runs, plain)))
        };
        Self { speed_mps, rows: methods.iter().map(row).collect() }
    }

    /// A method's row.
    pub fn row(&self, method: Method) -> Option<&MixedRow> {
        self.rows.iter().find(|row| row.method == method)
    }
}

impl MixedRow {
    fn new(method: Method, runs: &[MixedRun], less_plain: Option<Paired>) -> Self {
        let finished: Vec<&MixedRun> = runs.iter().filter(|run| run.failure.is_none()).collect();
        let mean = |value: fn(&MixedRun) -> f64| {
            Mean::of(&finished.iter().map(|run| value(run)).collect::<Vec<f64>>())
        };
        let (n, n_within_walls) = (runs.len(), runs.iter().filter(|run| run.is_within_walls).count());
        let [low, high] = wilson_interval(n_within_walls, n.max(1));
        Self {
            method,
            n,
            n_finished: finished.len(),
            n_within_walls,
            within_walls: [n_within_walls as f64 / n.max(1) as f64, low, high],
            distance_m: mean(|run| run.distance_m),
            time_s: mean(|run| run.time_s),
            less_plain,
            runs: runs.to_vec(),
        }
    }
}

impl Paired {
    fn of(runs: &[MixedRun], plain: &[MixedRun]) -> Self {
        let pairs = || runs.iter().zip(plain);
        let both: Vec<(&MixedRun, &MixedRun)> =
            pairs().filter(|(run, plain)| run.failure.is_none() && plain.failure.is_none()).collect();
        let mean = |value: &dyn Fn(&MixedRun) -> Option<f64>| {
            let differences = both.iter().filter_map(|(run, plain)| Some(value(run)? - value(plain)?));
            Mean::of(&differences.collect::<Vec<f64>>())
        };
        let n_only = |within: bool, plain_within: bool| {
            pairs()
                .filter(|(run, plain)| (run.is_within_walls, plain.is_within_walls) == (within, plain_within))
                .count()
        };
        let (n_only_method, n_only_plain) = (n_only(true, false), n_only(false, true));
        Self {
            n: both.len(),
            distance_m: mean(&|run| Some(run.distance_m)),
            time_s: mean(&|run| Some(run.time_s)),
            surface_distance_m: std::array::from_fn(|surface| mean(&|run| run.surface_distance_m[surface])),
            n_only_method,
            n_only_plain,
            p_value: mcnemar_p_value(n_only_method, n_only_plain),
        }
    }
}
