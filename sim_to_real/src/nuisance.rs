//! The calibrated parameters as nuisance parameters: what of a gap they may be to blame for, since nominal drives leave
//! them open, is no evidence for a cause.

use crate::calibration::{free_coordinates, with_values};
use crate::comparison::Comparison;
use crate::least_squares::{Coordinate, Linearised};
use bicycle::Effect;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};

/// A parameter of which nominal drives show nothing still costs this much to change by what matters, in squared residuals.
const LEAST: f64 = 1.0;
/// What nominal drives say of a parameter counts this many times: a real drive in which it looks otherwise has a gap before
/// it has a better calibration.
const HELD: f64 = 3.0;

/// How strongly nominal drives hold the calibrated parameters: their Fisher information, the curvature of the loss there,
/// column by column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Information(Vec<f64>);

impl Information {
    /// Of no drives.
    pub(crate) fn none() -> Self {
        Self(Vec::new())
    }

    /// Of nominal drives on the parameters that were fitted to them.
    pub(crate) fn of(nominal: &Comparison<'_>, effects: &[Effect]) -> Self {
        Self(linearised(nominal, effects).1.curvature().as_slice().to_vec())
    }
}

/// Parameters that a calibration fits, and the judged residuals linear in them.
fn linearised(comparison: &Comparison<'_>, effects: &[Effect]) -> (Vec<Coordinate>, Linearised) {
    let all = free_coordinates(effects);
    let is_free = |coordinate: &Coordinate| coordinate.low < coordinate.high;
    let free: Vec<Coordinate> = all.iter().copied().filter(is_free).collect();
    let residuals = |values: &[f64]| {
        let mut values = values.iter();
        let mut value = |own: &Coordinate| if is_free(own) { values.next().copied() } else { None };
        let moved: Vec<f64> = all.iter().map(|own| value(own).unwrap_or(own.start)).collect();
        comparison.judged_residuals(&with_values(effects, &moved))
    };
    let values: Vec<f64> = free.iter().map(|coordinate| coordinate.start).collect();
    let linear = Linearised::at(&free, &values, residuals);
    (free, linear)
}

/// The calibrated parameters on some drives: how these change with them, and what nominal drives have against it.
#[derive(Clone, Debug)]
pub(crate) struct Nuisance {
    linear: Linearised,
    /// Of the curvature of both.
    whole: Cholesky<f64, Dyn>,
    /// Upper root of what nominal drives have against a change.
    against: DMatrix<f64>,
}

impl Nuisance {
    /// `None` where nothing was calibrated, or other parameters than nominal drives tell of.
    pub(crate) fn of(comparison: &Comparison<'_>, effects: &[Effect], nominal: &Information) -> Option<Self> {
        Self::linear(linearised(comparison, effects), nominal)
    }

    fn linear((free, linear): (Vec<Coordinate>, Linearised), nominal: &Information) -> Option<Self> {
        (!free.is_empty() && nominal.0.len() == free.len().pow(2)).then_some(())?;
        let least = DVector::from_iterator(free.len(), free.iter().map(|own| LEAST / own.scale.powi(2)));
        let known = DMatrix::from_column_slice(free.len(), free.len(), &nominal.0);
        let against = HELD * known + DMatrix::from_diagonal(&least);
        let whole = (linear.curvature() + &against).cholesky()?;
        Some(Self { against: against.cholesky()?.l().transpose(), whole, linear })
    }

    /// What is left of residuals where the parameters have given way to them (profile likelihood, linear in the
    /// parameters), and behind it what that costs on nominal drives, as residuals too.
    pub(crate) fn profiled_out(&self, mut residuals: Vec<f32>) -> Vec<f32> {
        let change = -self.whole.solve(&self.linear.gradient(&residuals));
        self.linear.move_by(&change, &mut residuals);
        residuals.extend((&self.against * change).iter().map(|paid| *paid as f32));
        residuals
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::causes::Trial;
    use crate::comparison::Yardstick;
    use crate::engine_tests::{Made, arcs, effect};

    fn parameter(scale: f64) -> Coordinate {
        Coordinate { start: 0.0, low: -9.0, high: 9.0, scale, pull: None }
    }

    /// A hundred residuals of 1 that a parameter takes away one to one. A hundred of nominal drives hold it as 300, and 1 is
    /// there anyway: it gives way by 100 / 401, and what is left, 100 (301 / 401)^2, and what that costs,
    /// 301 (100 / 401)^2, are 100 * 301 / 401 together. Without nominal drives they would be 100 / 101.
    #[test]
    fn residuals_are_profiled_as_far_as_nominal_drives_let_them() {
        let linear = || Linearised::at(&[parameter(1.0)], &[0.0], |values| vec![values[0] as f32; 100]);
        let left = |information: f64| {
            let nuisance =
                Nuisance::linear((vec![parameter(1.0)], linear()), &Information(vec![information]));
            let profiled = nuisance.unwrap().profiled_out(vec![1.0; 100]);
            assert_eq!(profiled.len(), 101);
            profiled.iter().map(|r| f64::from(r * r)).sum::<f64>()
        };
        assert!((left(100.0) - 100.0 * 301.0 / 401.0).abs() < 1e-3, "{}", left(100.0));
        assert!((left(0.0) - 100.0 / 101.0).abs() < 1e-3, "{}", left(0.0));
    }

    /// A steering gain of 0.97 that nominal drives of as many rollouts contradict three times is an effect with its size; what
    /// the calibration could be to blame for is a quarter of it.
    #[test]
    fn what_nominal_drives_contradict_stays_a_cause() {
        let (nominal, real) = (arcs(Made::RIGHT, 3), arcs(Made { curvature_ratio: 0.97, ..Made::RIGHT }, 1));
        let rough = Yardstick::rough();
        let of = |drive, yardstick: &Yardstick| Comparison::new(1.0, vec![drive], yardstick);
        let yardstick = Yardstick::of(&of(&nominal, &rough).residuals(&[]), &rough);
        let calibrated = [effect("steer_gain", 1.0)];
        let information = Information::of(&of(&nominal, &yardstick), &calibrated);
        let fixed = Trial::fixed(of(&real, &yardstick), &calibrated);
        let free = Trial::given_way(of(&real, &yardstick), &calibrated, &information);
        let cause = [effect("steer_gain", 0.97)];
        let (held, given_way, explained) = (fixed.loss(&[]), free.loss(&[]), free.loss(&cause));
        let share = (held - given_way) / (held - explained);
        assert!((0.1..0.4).contains(&share), "{held} {given_way} {explained}");
        assert!(explained < 1.2 && given_way > 1.5 * explained, "{given_way} {explained}");
        // Nobody knows the calibration where the vehicle was never steered.
        let straight = Information(vec![0.0]);
        let unknown = Trial::given_way(of(&real, &yardstick), &calibrated, &straight);
        assert!(unknown.loss(&[]) < 1.5 * explained, "{}", unknown.loss(&[]));
    }
}
