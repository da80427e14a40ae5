//! The time offset and lever arm under which poses and motion agree best.

use super::equations::{FARTHEST_S, Way, Window};
use super::{PoseSensor, PoseSensorError, PoseUnknown};
use crate::answer::Estimate;
use crate::screening::quantile;
use nalgebra::{DMatrix, DVector, Matrix5, Vector5};

/// From one time offset that is tried to the next [s].
const STEP_S: f64 = 0.01;
/// Least turn within a window that tells a lever arm [rad]: noise of the yaw rate adds up to a few thousandths within a window.
const LEAST_TURN_RAD: f64 = 0.05;
/// Shortest drives together that intervals can be told from [s].
const SHORTEST_S: f64 = 30.0;
/// Residuals beyond this many standard deviations count as so many.
const CLIPPED_AT: f64 = 2.5;
/// Half of a 90 % interval in standard errors.
const HALF_INTERVAL: f64 = 1.645;

/// Time offset [s] and lever arm, ahead and left [m].
type Values = [f64; 3];

/// What is asked of drives.
struct Search<'a> {
    ways: &'a [Way],
    offsets_s: Vec<f64>,
    has_lever_arm: bool,
}

pub(super) fn found(ways: &[Way], unknowns: &[PoseUnknown]) -> Result<PoseSensor, PoseSensorError> {
    let has_offset = unknowns.contains(&PoseUnknown::TimeOffset);
    let n = if has_offset { (FARTHEST_S / STEP_S).round() as i32 } else { 0 };
    let search = Search {
        ways,
        offsets_s: (-n..=n).map(|place| f64::from(place) * STEP_S).collect(),
        has_lever_arm: unknowns.contains(&PoseUnknown::LeverArm),
    };
    let estimates = search.estimates()?;
    let lever_arm = |place: usize| search.has_lever_arm.then_some(estimates[place]);
    Ok(PoseSensor {
        time_offset_s: has_offset.then_some(estimates[0]),
        lever_arm_ahead_m: lever_arm(1),
        lever_arm_left_m: lever_arm(2),
    })
}

impl Search<'_> {
    fn estimates(&self) -> Result<[Estimate; 3], PoseSensorError> {
        let stretches = self.stretches(0.0);
        let n_stretches = stretches.iter().copied().max().map_or(0, |last| last + 1);
        let found_s = self.ways.iter().map(Way::duration_s).sum();
        if found_s < SHORTEST_S {
            return Err(PoseSensorError::Short { needed_s: SHORTEST_S, found_s });
        }
        if self.has_lever_arm {
            self.check_turning()?;
        }
        let far = PoseSensorError::Far { within_s: FARTHEST_S };
        let even = vec![vec![1.0; stretches.len()]];
        let first = self.best(&even).remove(0).ok_or_else(|| far.clone())?;
        let weights = self.weights(&first);
        let without = |left_out: usize| {
            let weight = |(stretch, weight): (&usize, &f64)| if *stretch == left_out { 0.0 } else { *weight };
            stretches.iter().zip(&weights).map(weight).collect()
        };
        let all = [weights.clone()].into_iter().chain((0..n_stretches).map(without)).collect::<Vec<_>>();
        let mut values = self.best(&all).into_iter().collect::<Option<Vec<_>>>().ok_or(far)?;
        let whole = values.remove(0);
        Ok(std::array::from_fn(|place| estimate(whole[place], values.iter().map(|own| own[place]))))
    }

    fn check_turning(&self) -> Result<(), PoseSensorError> {
        let windows = self.windows(0.0);
        let n = windows.iter().flatten().count().max(1) as f64;
        let squares: f64 = windows.iter().flatten().map(|window| window.moves_of_a_lever().powi(2)).sum();
        let found_rad = (squares / n).sqrt();
        let straight = PoseSensorError::Straight { needed_rad: LEAST_TURN_RAD, found_rad };
        if found_rad < LEAST_TURN_RAD { Err(straight) } else { Ok(()) }
    }

    fn windows(&self, offset_s: f64) -> Vec<Option<Window>> {
        let mut stretch = 0;
        let of_way = |way: &Way| {
            let windows = way.windows(offset_s, stretch);
            stretch = windows.iter().flatten().map(|window| window.stretch + 1).max().unwrap_or(stretch);
            windows
        };
        self.ways.iter().flat_map(of_way).collect()
    }

    /// The stretch of every window; 0 of one with a hole, which never counts.
    fn stretches(&self, offset_s: f64) -> Vec<usize> {
        self.windows(offset_s).iter().map(|window| window.map_or(0, |window| window.stretch)).collect()
    }

    /// The best values for every weighting of the windows; none where the offset lies beyond what is tried.
    fn best(&self, weightings: &[Vec<f64>]) -> Vec<Option<Values>> {
        let costs: Vec<Vec<f64>> = self
            .offsets_s
            .iter()
            .map(|offset_s| {
                let windows = self.windows(*offset_s);
                weightings.iter().map(|weights| self.fit(&windows, weights).cost).collect()
            })
            .collect();
        let of = |(place, weights): (usize, &Vec<f64>)| {
            let costs: Vec<f64> = costs.iter().map(|costs| costs[place]).collect();
            let offset_s = self.least(&costs)?;
            let [ahead, left] = self.fit(&self.windows(offset_s), weights).lever_arm_m;
            Some([offset_s, ahead, left])
        };
        weightings.iter().enumerate().map(of).collect()
    }

    /// Offset of the least cost, between those that were tried by a parabola.
    fn least(&self, costs: &[f64]) -> Option<f64> {
        if costs.len() == 1 {
            return Some(self.offsets_s[0]);
        }
        let least = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
        let (before, after) = (costs.get(least.checked_sub(1)?)?, costs.get(least + 1)?);
        let bend = before - 2.0 * costs[least] + after;
        Some(self.offsets_s[least] + 0.5 * STEP_S * (before - after) / bend.max(f64::MIN_POSITIVE))
    }

    /// Least squares of the displacements, and of the turns up to a constant rate. The cost is twice the negative logarithm
    /// of their likelihood under normal errors whose sizes they tell themselves.
    fn fit(&self, windows: &[Option<Window>], weights: &[f64]) -> Fit {
        let counted = || windows.iter().zip(weights).filter_map(|(window, w)| Some((window.as_ref()?, *w)));
        let (mut squares, mut products) = (Matrix5::zeros(), Vector5::zeros());
        let (mut n, mut turns) = (0.0, 0.0);
        for (window, weight) in counted() {
            squares += window.regressors.transpose() * window.regressors * weight;
            products += window.regressors.transpose() * window.moved_m * weight;
            n += weight;
            turns += weight * window.turn_rad;
        }
        let solution = self.solved(&squares, &products);
        let turn_rad = turns / n;
        let (mut of_turn, mut of_way) = (0.0, 0.0);
        for (window, weight) in counted() {
            of_turn += weight * (window.turn_rad - turn_rad).powi(2);
            of_way += weight * (window.moved_m - window.regressors * solution).norm_squared();
        }
        let cost = n * ((of_turn / n).ln() + 2.0 * (of_way / n).ln());
        Fit { cost, turn_rad, solution, lever_arm_m: [solution[3], solution[4]] }
    }

    /// The least solution of the normal equations, without a lever arm where none is asked for.
    fn solved(&self, squares: &Matrix5<f64>, products: &Vector5<f64>) -> Vector5<f64> {
        let n = if self.has_lever_arm { 5 } else { 3 };
        let squares = DMatrix::from_fn(n, n, |row, column| squares[(row, column)]);
        let products = DVector::from_fn(n, |row, _| products[row]);
        let largest = squares.diagonal().max();
        let solution = squares.svd(true, true).solve(&products, 1e-12 * largest);
        let solution = solution.unwrap_or_else(|_| DVector::zeros(n));
        Vector5::from_fn(|row, _| if row < n { solution[row] } else { 0.0 })
    }

    /// How much every window counts once those that fit badly do less.
    fn weights(&self, values: &Values) -> Vec<f64> {
        let windows = self.windows(values[0]);
        let fit = self.fit(&windows, &vec![1.0; windows.len()]);
        let turn = |window: &Window| (window.turn_rad - fit.turn_rad).abs();
        let way = |window: &Window| (window.moved_m - window.regressors * fit.solution).norm();
        let usual =
            |size: &dyn Fn(&Window) -> f64| quantile(windows.iter().flatten().map(size).collect(), 0.5);
        // Medians of the size of a normal number, and of two.
        let (turn_sigma, way_sigma) = (usual(&turn) / 0.6745, usual(&way) / 1.1774);
        let weight = |window: &Window| {
            let worst = (turn(window) / turn_sigma).max(way(window) / way_sigma);
            (CLIPPED_AT / worst.max(f64::MIN_POSITIVE)).min(1.0)
        };
        windows.iter().map(|window| window.as_ref().map_or(0.0, weight)).collect()
    }
}

struct Fit {
    cost: f64,
    turn_rad: f64,
    solution: Vector5<f64>,
    lever_arm_m: [f64; 2],
}

/// With the jackknife's interval from what is found without each stretch.
fn estimate(value: f64, without: impl ExactSizeIterator<Item = f64> + Clone) -> Estimate {
    let n = without.len() as f64;
    let mean = without.clone().sum::<f64>() / n;
    let half = HALF_INTERVAL * ((n - 1.0) / n * without.map(|own| (own - mean).powi(2)).sum::<f64>()).sqrt();
    Estimate { value, low: value - half, high: value + half }
}
