//! How well a drive would tell explanations apart: what one of them measures is held against what another foretells
//! once its own parameters have been given the best values for it (T-optimality, Atkinson and Fedorov 1975), in
//! standard deviations.
//!
//! With residuals d of a rival, their derivatives J by its parameters and the information M that the drives so far hold
//! of these, the least sum of squares is d'd - d'J (M + J'J)^-1 J'd. All three sums add up over pieces.

use crate::calibration::{coordinates_of_causes, with_values};
use crate::causes::{Trial, composed};
use crate::judgement::TEMPERATURE;
use bicycle::Effect;
use nalgebra::{DMatrix, DVector};

/// Step of the derivatives, in changes of a parameter that matter.
const DERIVATIVE_STEP: f64 = 0.05;

/// An explanation that the drives so far leave open.
#[derive(Clone, Debug)]
pub(super) struct Rival {
    pub(super) name: String,
    pub(super) causes: Vec<Effect>,
    /// Mean robust loss on the drives so far.
    pub(super) loss: f64,
    /// J'J on the drives so far.
    information: DMatrix<f64>,
}

impl Rival {
    pub(super) fn new(trial: &Trial<'_>, name: String, causes: Vec<Effect>) -> Self {
        let sums = Sums::of(trial, &causes);
        Self { name, loss: trial.loss(&causes), causes, information: sums.information }
    }

    /// The same, as well in accord with the drives so far as another.
    pub(super) fn made_likely_as(self, other: &Self) -> Self {
        Self { loss: other.loss, ..self }
    }

    /// The whole model.
    pub(super) fn effects(&self, baseline: &[Effect]) -> Vec<Effect> {
        composed(baseline, &self.causes)
    }
}

/// Sums over the residuals of a rival where another explanation is true.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sums {
    square: f64,
    cross: DVector<f64>,
    information: DMatrix<f64>,
    n: usize,
}

impl Sums {
    pub(super) fn of(trial: &Trial<'_>, causes: &[Effect]) -> Self {
        let coordinates = coordinates_of_causes(causes);
        let here = trial.residuals(causes);
        let columns: Vec<Vec<f32>> = (0..coordinates.len())
            .map(|place| {
                let mut places: Vec<f64> = coordinates.iter().map(|own| own.start).collect();
                let step = DERIVATIVE_STEP * coordinates[place].scale;
                let step = if places[place] + step > coordinates[place].high { -step } else { step };
                places[place] += step;
                let there = trial.residuals(&with_values(causes, &places));
                there.iter().zip(&here).map(|(b, a)| (b - a) / step as f32).collect()
            })
            .collect();
        let n = columns.len();
        Self {
            square: dot(&here, &here),
            cross: DVector::from_fn(n, |i, _| dot(&columns[i], &here)),
            information: DMatrix::from_fn(n, n, |i, j| dot(&columns[i], &columns[j])),
            n: here.len(),
        }
    }

    pub(super) fn none(n_parameters: usize) -> Self {
        let cross = DVector::zeros(n_parameters);
        Self { square: 0.0, cross, information: DMatrix::zeros(n_parameters, n_parameters), n: 0 }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self {
            square: self.square + other.square,
            cross: &self.cross + &other.cross,
            information: &self.information + &other.information,
            n: self.n + other.n,
        }
    }

    /// The sum of squares that is left once the rival's parameters are best for it.
    fn least(&self, known: &DMatrix<f64>) -> f64 {
        let information = &self.information + known;
        let ridge =
            DMatrix::identity(self.cross.len(), self.cross.len()) * (1e-9 * (1.0 + information.trace()));
        let moved = (information + ridge).cholesky().map(|factor| factor.solve(&self.cross));
        let gained = moved.map_or(0.0, |moved| moved.dot(&self.cross));
        (self.square - gained).max(0.0)
    }
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

/// The drives so far in two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SoFar {
    /// Number of their residuals.
    pub(super) n: usize,
    /// Mean robust loss of a true model.
    pub(super) true_loss: f64,
}

impl SoFar {
    /// Log odds of the truth against a rival, by the mean losses of both over the drives so far and a new one on which
    /// the truth leaves noise alone and the rival `excess` more in all.
    pub(super) fn log_odds(&self, [truth, rival]: [f64; 2], (excess, n): (f64, usize)) -> f64 {
        let all = |own: f64, excess: f64| self.n as f64 * own + n as f64 * self.true_loss + excess;
        (all(rival, excess) / all(truth, 0.0)).ln() / TEMPERATURE
    }
}

/// Ordered pairs of a truth and what else might be believed, by index into the rivals.
pub(super) type Contest = (usize, usize);

/// The logarithm of the truth's probability, averaged over which one is true.
pub(super) fn expected_log_probability(
    rivals: &[Rival],
    contests: &[Contest],
    sums: &[Sums],
    so_far: SoFar,
) -> f64 {
    let mut against = vec![0.0; rivals.len()];
    for (&(truth, rival), sums) in contests.iter().zip(sums) {
        let losses = [rivals[truth].loss, rivals[rival].loss];
        let excess = sums.least(&rivals[rival].information);
        against[truth] += (-so_far.log_odds(losses, (excess, sums.n))).exp();
    }
    let truths: Vec<f64> = (0..rivals.len())
        .filter(|index| contests.iter().any(|(truth, _)| truth == index))
        .map(|index| -against[index].ln_1p())
        .collect();
    truths.iter().sum::<f64>() / truths.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// d = (3, 4), J = (1, 0): the rival's parameter takes the 3 away; with information 2 known of it, d'J^2 / 3 = 3.
    #[test]
    fn what_a_parameter_can_take_away_is_no_discrimination() {
        let sums = Sums {
            square: 25.0,
            cross: DVector::from_element(1, 3.0),
            information: DMatrix::from_element(1, 1, 1.0),
            n: 2,
        };
        assert!((sums.least(&DMatrix::zeros(1, 1)) - 16.0).abs() < 1e-6);
        assert!((sums.least(&DMatrix::from_element(1, 1, 2.0)) - 22.0).abs() < 1e-6);
    }

    /// 100 residuals so far with loss 1 for both, 100 new ones on which the rival has loss 2: ln(300 / 200) / T.
    #[test]
    fn odds_are_those_of_the_mean_losses() {
        let so_far = SoFar { n: 100, true_loss: 1.0 };
        let expected = 1.5_f64.ln() / TEMPERATURE;
        assert!((so_far.log_odds([1.0, 1.0], (100.0, 100)) - expected).abs() < 1e-9);
        assert_eq!(so_far.log_odds([1.0, 1.0], (0.0, 100)), 0.0);
    }
}
