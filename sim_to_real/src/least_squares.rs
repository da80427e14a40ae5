//! Robust non-linear least squares with bounds, for a handful of parameters and thousands of residuals.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Where the pseudo-Huber loss bends from square to straight, in standard deviations.
const BEND: f64 = 3.0;
const N_ITERATIONS: usize = 25;
/// Other starts that are tried for a minimum which is not the next one, within a change that matters of where the fit ended,
/// and how far each is followed before the best of them is followed to the end.
const N_OTHER_STARTS: usize = 12;
const N_ITERATIONS_TRIED: usize = 4;
/// Steps to the least loss of residuals that are linear in the parameters, each with the weights that the one before leaves.
const N_REWEIGHTED: usize = 5;
/// Curvature of a parameter, in shares of the largest, of which nothing is told.
const SILENT: f64 = 1e-9;
/// A minimum of at most this share of the loss is another one, and not the same one found better.
const ANOTHER_MINIMUM: f64 = 0.98;

/// A parameter of a fit, in the coordinate it is fitted in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coordinate {
    pub(crate) start: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// A change that matters.
    pub(crate) scale: f64,
    /// Pull towards a value: the value, and its strength in residuals per scale.
    pub(crate) pull: Option<(f64, f64)>,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fit {
    pub(crate) values: Vec<f64>,
    /// Mean pseudo-Huber loss of the residuals, in which a residual of one standard deviation counts about one.
    pub(crate) loss: f64,
}

/// Mean of 2 b^2 (sqrt(1 + (r / b)^2) - 1) over residuals r in standard deviations; infinite where a rollout runs away beyond
/// all numbers.
pub(crate) fn mean_loss(residuals: &[f32]) -> f64 {
    let sum: f64 = residuals.iter().map(|r| loss(f64::from(*r))).sum();
    if sum.is_finite() { sum / residuals.len() as f64 } else { f64::INFINITY }
}

fn loss(residual: f64) -> f64 {
    let ratio = residual / BEND;
    2.0 * BEND * BEND * ((1.0 + ratio * ratio).sqrt() - 1.0)
}

/// What a residual counts for in a square: the loss's derivative over that of the square.
pub(crate) fn weight(residual: f32) -> f32 {
    1.0 / (1.0 + (residual / BEND as f32).powi(2)).sqrt()
}

/// The least of the minima next to the start and next to others around it.
pub(crate) fn fit_from_several(
    coordinates: &[Coordinate],
    mut residuals: impl FnMut(&[f64]) -> Vec<f32>,
) -> Fit {
    let first = fit(coordinates, &mut residuals);
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut tried = |_| {
        let start = started_around(coordinates, &first.values, &mut generator);
        fit_within(N_ITERATIONS_TRIED, &start, &mut residuals)
    };
    let best = (0..N_OTHER_STARTS).map(&mut tried).min_by(|a, b| a.loss.total_cmp(&b.loss));
    let followed = best.map(|best| fit(&started_at(coordinates, &best.values), &mut residuals));
    followed.filter(|other| other.loss < ANOTHER_MINIMUM * first.loss).unwrap_or(first)
}

fn started_at(coordinates: &[Coordinate], values: &[f64]) -> Vec<Coordinate> {
    let at = |(coordinate, &start): (&Coordinate, &f64)| Coordinate { start, ..*coordinate };
    coordinates.iter().zip(values).map(at).collect()
}

fn started_around(
    coordinates: &[Coordinate],
    values: &[f64],
    generator: &mut Xoshiro256PlusPlus,
) -> Vec<Coordinate> {
    let moved = |(own, value): (&Coordinate, &f64)| {
        (value + own.scale * generator.random_range(-1.0..1.0)).clamp(own.low, own.high)
    };
    let values: Vec<f64> = coordinates.iter().zip(values).map(moved).collect();
    started_at(coordinates, &values)
}

/// Levenberg and Marquardt with reweighting; derivatives by differences of a hundredth of a parameter's scale.
pub(crate) fn fit(coordinates: &[Coordinate], residuals: impl FnMut(&[f64]) -> Vec<f32>) -> Fit {
    fit_within(N_ITERATIONS, coordinates, residuals)
}

fn fit_within(
    n_iterations: usize,
    coordinates: &[Coordinate],
    mut residuals: impl FnMut(&[f64]) -> Vec<f32>,
) -> Fit {
    let mut values: Vec<f64> = coordinates.iter().map(|coordinate| coordinate.start).collect();
    let mut here = residuals(&values);
    let mut total = total_loss(coordinates, &values, &here);
    let mut damping = 1e-3;
    for _ in 0..n_iterations {
        let linearised = Linearised::around(coordinates, &values, here.clone(), &mut residuals);
        let normal = linearised.normal(0..here.len()).pulled(coordinates, &values);
        let mut improved = false;
        while damping < 1e6 {
            let next = normal.step(coordinates, &values, damping);
            let there = residuals(&next);
            let after = total_loss(coordinates, &next, &there);
            if after < total {
                improved = (total - after) > 1e-5 * total;
                (values, here, total) = (next, there, after);
                damping = (damping * 0.2).max(1e-6);
                break;
            }
            damping *= 5.0;
        }
        if !improved {
            break;
        }
    }
    Fit { loss: mean_loss(&here), values }
}

fn pulls<'a>(
    coordinates: &'a [Coordinate],
    values: &'a [f64],
) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
    coordinates.iter().zip(values).enumerate().filter_map(|(i, (coordinate, value))| {
        let (towards, strength) = coordinate.pull?;
        let slope = strength / coordinate.scale;
        Some((i, slope, (value - towards) * slope))
    })
}

fn total_loss(coordinates: &[Coordinate], values: &[f64], residuals: &[f32]) -> f64 {
    let pulled: f64 = pulls(coordinates, values).map(|(_, _, residual)| residual * residual).sum();
    mean_loss(residuals) * residuals.len() as f64 + pulled
}

/// The residuals at a point and their weighted derivatives.
#[derive(Clone, Debug)]
pub(crate) struct Linearised {
    columns: Vec<Vec<f32>>,
    weights: Vec<f32>,
    here: Vec<f32>,
}

impl Linearised {
    pub(crate) fn at(
        coordinates: &[Coordinate],
        values: &[f64],
        mut residuals: impl FnMut(&[f64]) -> Vec<f32>,
    ) -> Self {
        let here = residuals(values);
        Self::around(coordinates, values, here, &mut residuals)
    }

    fn around(
        coordinates: &[Coordinate],
        values: &[f64],
        here: Vec<f32>,
        residuals: &mut impl FnMut(&[f64]) -> Vec<f32>,
    ) -> Self {
        let column = |(i, coordinate): (usize, &Coordinate)| {
            let mut moved = values.to_vec();
            let step = 0.01 * coordinate.scale;
            let step = if values[i] + step > coordinate.high { -step } else { step };
            moved[i] += step;
            let there = residuals(&moved);
            there.iter().zip(&here).map(|(b, a)| (b - a) / step as f32).collect()
        };
        let columns = coordinates.iter().enumerate().map(column).collect();
        let weights = here.iter().copied().map(weight).collect();
        Self { columns, weights, here }
    }

    /// The weighted normal equations of a range of residuals.
    fn normal(&self, range: std::ops::Range<usize>) -> Normal {
        let n = self.columns.len();
        let mut normal = Normal { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n) };
        for i in 0..n {
            let own = self.columns[i][range.clone()].iter().zip(&self.weights[range.clone()]);
            let weighed: Vec<f32> = own.map(|(column, weight)| column * weight).collect();
            normal.gradient[i] = dot(&weighed, &self.here[range.clone()]);
            for j in 0..=i {
                normal.matrix[(i, j)] = dot(&weighed, &self.columns[j][range.clone()]);
                normal.matrix[(j, i)] = normal.matrix[(i, j)];
            }
        }
        normal
    }

    /// Of half the loss of all residuals, by each two parameters.
    pub(crate) fn curvature(&self) -> DMatrix<f64> {
        self.normal(0..self.here.len()).matrix
    }

    /// Derivatives of half the loss that other residuals have, weighted as those at the point.
    pub(crate) fn gradient(&self, residuals: &[f32]) -> DVector<f64> {
        let weighed: Vec<f32> = residuals.iter().zip(&self.weights).map(|(r, weight)| r * weight).collect();
        DVector::from_iterator(self.columns.len(), self.columns.iter().map(|column| dot(column, &weighed)))
    }

    /// What residuals become where the parameters change.
    pub(crate) fn move_by(&self, change: &DVector<f64>, residuals: &mut [f32]) {
        for (column, change) in self.columns.iter().zip(change.iter()) {
            let change = *change as f32;
            residuals.iter_mut().zip(column).for_each(|(residual, column)| *residual += column * change);
        }
    }

    /// Of some rows of residuals alone, each of so many numbers.
    pub(crate) fn of_rows(&self, rows: &[usize], n_per_row: usize) -> Self {
        let own = |values: &Vec<f32>| -> Vec<f32> {
            rows.iter().flat_map(|row| &values[row * n_per_row..][..n_per_row]).copied().collect()
        };
        Self {
            columns: self.columns.iter().map(own).collect(),
            weights: own(&self.weights),
            here: own(&self.here),
        }
    }

    /// The change of the parameters with which the loss is least where the residuals are linear in them, and the residuals
    /// there; `None` where they tell nothing of a parameter.
    pub(crate) fn at_its_least(&self) -> Option<(DVector<f64>, Self)> {
        let (mut change, mut least) = (DVector::zeros(self.columns.len()), self.clone());
        for _ in 0..N_REWEIGHTED {
            let Normal { matrix, gradient } = least.normal(0..least.here.len());
            let step = -matrix.cholesky()?.solve(&gradient);
            self.move_by(&step, &mut least.here);
            least.weights = least.here.iter().copied().map(weight).collect();
            change += step;
        }
        Some((change, least))
    }

    /// Standard error of each parameter at the least of the loss, by leaving out one of `n` stretches after the other and
    /// taking the step that the rest then asks for: sqrt((n - 1) / n sum of squares). Infinite where but one stretch tells
    /// anything of a parameter, or none.
    pub(crate) fn jackknife(&self, n: usize) -> Vec<f64> {
        let whole = self.normal(0..self.here.len());
        let length = self.here.len().div_ceil(n).max(1);
        let mut squares = vec![0.0; self.columns.len()];
        for first in (0..self.here.len()).step_by(length) {
            let out = self.normal(first..(first + length).min(self.here.len()));
            let rest =
                Normal { matrix: &whole.matrix - out.matrix, gradient: &whole.gradient - out.gradient };
            squares.iter_mut().zip(rest.leap()).for_each(|(square, step)| *square += step * step);
        }
        let share = (n - 1) as f64 / n as f64;
        squares.into_iter().map(|square| (share * square).sqrt()).collect()
    }
}

/// The weighted normal equations at a point.
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Normal {
    /// The step to the least, infinite for parameters of which nothing is told, alone or beside the others.
    fn leap(self) -> Vec<f64> {
        let least = SILENT * self.matrix.diagonal().max();
        let is_told = |place: &usize| self.matrix[(*place, *place)] > least;
        let told: Vec<usize> = (0..self.gradient.len()).filter(is_told).collect();
        let matrix = self.matrix.select_rows(&told).select_columns(&told);
        let mut steps = vec![f64::INFINITY; self.gradient.len()];
        if let Some(factor) = matrix.cholesky() {
            let found = factor.solve(&self.gradient.select_rows(&told));
            told.iter().zip(found.iter()).for_each(|(place, step)| steps[*place] = *step);
        }
        steps
    }

    fn pulled(mut self, coordinates: &[Coordinate], values: &[f64]) -> Self {
        for (i, slope, residual) in pulls(coordinates, values) {
            self.matrix[(i, i)] += slope * slope;
            self.gradient[i] += slope * residual;
        }
        self
    }

    fn step(&self, coordinates: &[Coordinate], values: &[f64], damping: f64) -> Vec<f64> {
        let mut damped = self.matrix.clone();
        for (i, coordinate) in coordinates.iter().enumerate() {
            damped[(i, i)] += damping * (self.matrix[(i, i)] + 1.0 / (coordinate.scale * coordinate.scale));
        }
        let step = damped.cholesky().map(|factor| factor.solve(&self.gradient));
        let moved = |(i, coordinate): (usize, &Coordinate)| {
            let change = step.as_ref().map_or(0.0, |step| step[i]);
            (values[i] - change).clamp(coordinate.low, coordinate.high)
        };
        coordinates.iter().enumerate().map(moved).collect()
    }
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    let chunks = a.chunks(64).zip(b.chunks(64));
    chunks.map(|(a, b)| f64::from(a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coordinate(start: f64) -> Coordinate {
        Coordinate { start, low: -10.0, high: 10.0, scale: 1.0, pull: None }
    }

    /// y = a exp(-b t) with a = 2, b = 0.7, and an outlier of a hundred standard deviations.
    #[test]
    fn a_curve_is_found_in_spite_of_an_outlier() {
        let model = |a: f64, b: f64, t: f64| a * (-b * t).exp();
        let measured: Vec<f64> = (0..200)
            .map(|k| model(2.0, 0.7, 0.02 * f64::from(k)) + if k == 50 { 1.0 } else { 0.0 })
            .collect();
        let found = fit(&[coordinate(1.0), coordinate(0.1)], |values| {
            let at =
                |(k, y): (usize, &f64)| ((model(values[0], values[1], 0.02 * k as f64) - y) * 100.0) as f32;
            measured.iter().enumerate().map(at).collect()
        });
        assert!((found.values[0] - 2.0).abs() < 5e-3 && (found.values[1] - 0.7).abs() < 5e-3, "{found:?}");
    }

    /// (x^2 - 1)^2 + 0.3 x + 1 from x = 1 has its next minimum at 0.96 and a lower one at -1.04: the slope
    /// 4 x^3 - 4 x + 0.3 is -0.001 and 0.04 less than 0 there.
    #[test]
    fn a_lower_minimum_beyond_the_next_is_found() {
        let valleys = |x: &[f64]| vec![(((x[0] * x[0] - 1.0).powi(2) + 0.3 * x[0] + 1.0) as f32).sqrt(); 8];
        let start = [Coordinate { scale: 3.0, ..coordinate(1.0) }];
        assert!((fit(&start, valleys).values[0] - 0.96).abs() < 0.02);
        assert!((fit_from_several(&start, valleys).values[0] + 1.04).abs() < 0.02);
    }

    #[test]
    fn bounds_hold_and_pulls_decide_what_nothing_else_does() {
        let bounded =
            fit(&[Coordinate { high: 3.0, ..coordinate(0.0) }], |values| vec![(values[0] - 5.0) as f32; 4]);
        assert_eq!(bounded.values, [3.0]);
        let pulled = fit(&[Coordinate { pull: Some((1.5, 1.0)), ..coordinate(0.0) }], |_| vec![0.0; 4]);
        assert!((pulled.values[0] - 1.5).abs() < 1e-3);
    }

    /// Rows of two numbers, the first three at 1 and the others at 3, in hundredths: the rows 3 to 5 alone ask for 3, with nothing
    /// left there, and all of them for the mean of both, 2, which leaves 1 of each.
    #[test]
    fn rows_alone_have_a_least_of_their_own() {
        let measured = |k: usize| if k < 6 { 1.0 } else { 3.0 };
        let parameters = [coordinate(0.0)];
        let all = Linearised::at(&parameters, &[2.0], |values| {
            (0..12).map(|k| 0.01 * (values[0] - measured(k)) as f32).collect()
        });
        let (change, least) = all.of_rows(&[3, 4, 5], 2).at_its_least().unwrap();
        assert!((change[0] - 1.0).abs() < 1e-3 && least.here.iter().all(|left| left.abs() < 1e-5));
        assert_eq!(least.here.len(), 6);
        let (change, least) = all.at_its_least().unwrap();
        assert!(change[0].abs() < 1e-3 && least.here.iter().all(|left| (left.abs() - 0.01).abs() < 1e-5));
        let nothing = Linearised::at(&parameters, &[2.0], |_| vec![1.0; 4]);
        assert!(nothing.at_its_least().is_none());
    }

    /// A small residual counts as its square, a large one as 2 b |r|.
    #[test]
    fn the_loss_bends() {
        assert!((mean_loss(&[0.01]) / 1e-4 - 1.0).abs() < 1e-3);
        assert!((mean_loss(&[3000.0]) / 18000.0 - 1.0).abs() < 1e-2);
    }
}
