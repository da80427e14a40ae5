//! Levenberg and Marquardt for a few dozen parameters, with a prior on each and residuals of which some are wild.

use nalgebra::{DMatrix, DVector};

/// Where the pseudo-Huber loss bends from square to straight, in standard deviations.
const BEND: f64 = 2.0;
const ITERATIONS: usize = 40;

/// What is believed of a parameter before the data.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Belief {
    pub mean: f64,
    pub deviation: f64,
    pub low: f64,
    pub high: f64,
}

/// One residual in standard deviations, and its derivatives by parameter.
pub(crate) struct Residual<'a> {
    pub value: f64,
    pub slopes: &'a [(usize, f64)],
    /// Residuals of a block hang together.
    pub block: usize,
}

/// Residuals at a point, each handed to the second argument.
pub(crate) type Residuals<'a> = dyn Fn(&[f64], &mut dyn FnMut(Residual<'_>)) + 'a;

/// Normal equations at a point.
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    loss: f64,
}

/// A fit.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub values: Vec<f64>,
    pub loss: f64,
    /// Of the parameters, from the blocks' scatter and the prior.
    pub covariance: DMatrix<f64>,
}

fn weight(residual: f64) -> f64 {
    1.0 / (1.0 + (residual / BEND).powi(2)).sqrt()
}

fn loss(residual: f64) -> f64 {
    2.0 * BEND * BEND * ((1.0 + (residual / BEND).powi(2)).sqrt() - 1.0)
}

fn normal(beliefs: &[Belief], values: &[f64], residuals: &Residuals<'_>) -> Normal {
    let n = values.len();
    let mut normal = Normal { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n), loss: 0.0 };
    for (i, (belief, value)) in beliefs.iter().zip(values).enumerate() {
        let off = (value - belief.mean) / belief.deviation;
        normal.loss += off * off;
        normal.gradient[i] += off / belief.deviation;
        normal.matrix[(i, i)] += belief.deviation.powi(-2);
    }
    residuals(values, &mut |residual| {
        let weight = weight(residual.value);
        normal.loss += loss(residual.value);
        for &(i, slope) in residual.slopes {
            normal.gradient[i] += weight * slope * residual.value;
            for &(j, other) in residual.slopes {
                normal.matrix[(i, j)] += weight * slope * other;
            }
        }
    });
    normal
}

fn step(normal: &Normal, beliefs: &[Belief], values: &[f64], damping: f64) -> Vec<f64> {
    let mut damped = normal.matrix.clone();
    for i in 0..values.len() {
        damped[(i, i)] *= 1.0 + damping;
    }
    let change = damped.cholesky().map(|factor| factor.solve(&normal.gradient));
    let moved = |(i, belief): (usize, &Belief)| {
        let change = change.as_ref().map_or(0.0, |change| change[i]);
        (values[i] - change).clamp(belief.low, belief.high)
    };
    beliefs.iter().enumerate().map(moved).collect()
}

/// Minimises the beliefs' squares and the residuals' losses from `start` on.
pub(crate) fn fit(beliefs: &[Belief], start: &[f64], residuals: &Residuals<'_>) -> Fit {
    let mut values = start.to_vec();
    let mut here = normal(beliefs, &values, residuals);
    let mut damping = 1e-2;
    for _ in 0..ITERATIONS {
        let mut gain = 0.0;
        while damping < 1e8 {
            let next = step(&here, beliefs, &values, damping);
            let there = normal(beliefs, &next, residuals);
            if there.loss < here.loss {
                gain = (here.loss - there.loss) / here.loss;
                (values, here) = (next, there);
                damping = (damping * 0.2).max(1e-9);
                break;
            }
            damping *= 6.0;
        }
        if gain < 1e-6 {
            break;
        }
    }
    let covariance = covariance(beliefs, &values, &here, residuals);
    Fit { values, loss: here.loss, covariance }
}

/// Inverse of the normal matrix around the scatter of the blocks' gradients and of the prior (Huber's sandwich): honest
/// where residuals next to each other err together.
fn covariance(
    beliefs: &[Belief],
    values: &[f64],
    normal: &Normal,
    residuals: &Residuals<'_>,
) -> DMatrix<f64> {
    let n = values.len();
    let mut scatter = DMatrix::zeros(n, n);
    for (i, belief) in beliefs.iter().enumerate() {
        scatter[(i, i)] = belief.deviation.powi(-2);
    }
    let (mut block, mut gradient) = (usize::MAX, DVector::<f64>::zeros(n));
    residuals(values, &mut |residual| {
        if residual.block != block {
            scatter += &gradient * gradient.transpose();
            gradient.fill(0.0);
            block = residual.block;
        }
        for &(i, slope) in residual.slopes {
            gradient[i] += weight(residual.value) * slope * residual.value;
        }
    });
    scatter += &gradient * gradient.transpose();
    let inverse = normal.matrix.clone().cholesky().map(|factor| factor.inverse());
    inverse.map_or_else(
        || DMatrix::from_diagonal(&DVector::from_iterator(n, beliefs.iter().map(|b| b.deviation.powi(2)))),
        |inverse| &inverse * scatter * &inverse,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide(mean: f64) -> Belief {
        Belief { mean, deviation: 100.0, low: -50.0, high: 50.0 }
    }

    /// y = a exp(-b t) + outlier, a = 2, b = 0.7.
    #[test]
    fn a_curve_is_found_in_spite_of_an_outlier_and_its_error_is_told() {
        let noise = |k: usize| 0.02 * ((k * 7919 % 1000) as f64 / 500.0 - 1.0) * 3.0_f64.sqrt();
        let measured: Vec<f64> = (0..400)
            .map(|k| 2.0 * (-0.7 * 0.01 * k as f64).exp() + noise(k) + if k == 50 { 5.0 } else { 0.0 })
            .collect();
        let residuals = |values: &[f64], take: &mut dyn FnMut(Residual<'_>)| {
            for (k, measured) in measured.iter().enumerate() {
                let t = 0.01 * k as f64;
                let decay = (-values[1] * t).exp();
                let slopes = [(0, decay / 0.02), (1, -values[0] * t * decay / 0.02)];
                take(Residual {
                    value: (values[0] * decay - measured) / 0.02,
                    slopes: &slopes,
                    block: k / 10,
                });
            }
        };
        let found = fit(&[wide(1.0), wide(0.0)], &[1.0, 0.1], &residuals);
        for (value, truth) in found.values.iter().zip([2.0, 0.7]) {
            assert!((value - truth).abs() < 0.01, "{found:?}");
        }
        let deviation = found.covariance[(1, 1)].sqrt();
        assert!((5e-4..1e-2).contains(&deviation), "{deviation}");
    }

    #[test]
    fn without_data_the_belief_stays_and_bounds_hold() {
        let belief = Belief { mean: 0.3, deviation: 0.5, low: -1.0, high: 1.0 };
        let found = fit(&[belief], &[0.9], &|_, _| {});
        assert!((found.values[0] - 0.3).abs() < 1e-6 && (found.covariance[(0, 0)] - 0.25).abs() < 1e-9);
        let pulled = fit(&[belief], &[0.0], &|values, take| {
            take(Residual { value: (values[0] - 5.0) * 1e3, slopes: &[(0, 1e3)], block: 0 });
        });
        assert_eq!(pulled.values, [1.0]);
    }
}
