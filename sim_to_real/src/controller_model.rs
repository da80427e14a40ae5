//! The model for a controller that a diagnosis measured: what was announced is fitted anew beside the controller's own
//! model, which has a simpler speed loop than the one that drives were diagnosed with, and the whole is judged on drives
//! that it was not fitted to.

use crate::baseline::{Baseline, GapError, drives_of};
use crate::calibration::{coordinates_of_causes, held_coordinates, with_values};
use crate::causes::{Explanation, Trial, composed};
use crate::comparison::{Comparison, Yardstick};
use crate::cross_validation::CrossValidation;
use crate::diagnosis::Diagnosis;
use crate::drive::Drive;
use crate::least_squares::fit;
use crate::machine::Machine;
use bicycle::{DriveLog, Effect};
use serde::{Deserialize, Serialize};

/// What a controller's model holds beside the kinematic bicycle, and how well that foretells the robot's drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerModel {
    /// The model before: the user's own, or what the simulator's drives calibrated; fitted anew to the robot's drives where
    /// that foretells them better.
    pub nominal: Vec<Effect>,
    /// The announced effects as they fit it; none where it foretells better without them.
    pub causes: Vec<Effect>,
    /// Mean robust loss on drives left out, of the model before and of this one [-]; absent where nothing was announced or
    /// a prediction ran away.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foretold_losses: Option<[f64; 2]>,
}

impl ControllerModel {
    /// All effects in order of action.
    pub fn effects(&self) -> Vec<Effect> {
        composed(&self.nominal, &self.causes)
    }

    /// The causes fitted, the rest as it is.
    fn with_causes_fitted(self, trial: &Trial<'_>) -> Self {
        let start = Explanation::new(self.causes.clone(), trial.loss(&self.causes));
        Self { causes: trial.refined(start).causes, ..self }
    }

    /// Everything fitted, what is not a cause held where it is by a pull.
    fn with_all_fitted(self, comparison: &Comparison<'_>) -> Self {
        let mut coordinates = held_coordinates(&self.nominal);
        let n_nominal = coordinates.len();
        coordinates.extend(coordinates_of_causes(&self.causes));
        let with = |values: &[f64]| Self {
            nominal: with_values(&self.nominal, &values[..n_nominal]),
            causes: with_values(&self.causes, &values[n_nominal..]),
            ..self
        };
        with(&fit(&coordinates, |values| comparison.residuals(&with(values).effects())).values)
    }
}

/// How much of a controller's model is fitted to the robot's drives.
#[derive(Clone, Copy)]
enum Fitted {
    Nothing,
    Causes,
    Everything,
}

/// A controller's model before, what was announced, and what drives are measured by.
struct Repair<'a> {
    wheelbase_m: f64,
    yardstick: &'a Yardstick,
    nominal: &'a [Effect],
    announced: &'a [Effect],
}

impl Repair<'_> {
    fn comparison<'d>(&self, drives: Vec<&'d Drive>) -> Comparison<'d> {
        Comparison::new(self.wheelbase_m, drives, self.yardstick)
    }

    fn fitted(&self, drives: &[&Drive], fitted: Fitted) -> ControllerModel {
        let model = |causes: &[Effect]| ControllerModel {
            nominal: self.nominal.to_vec(),
            causes: causes.to_vec(),
            foretold_losses: None,
        };
        let comparison = self.comparison(drives.to_vec());
        let with_causes =
            || model(self.announced).with_causes_fitted(&Trial::fixed(comparison.clone(), self.nominal));
        match fitted {
            Fitted::Nothing => model(&[]),
            Fitted::Causes => with_causes(),
            Fitted::Everything => with_causes().with_all_fitted(&comparison),
        }
    }

    /// Whichever way of fitting foretells drives best that it was not fitted to.
    fn best(&self, drives: &[Drive]) -> ControllerModel {
        let all: Vec<&Drive> = drives.iter().collect();
        if self.announced.is_empty() {
            return self.fitted(&all, Fitted::Nothing);
        }
        let left_out = CrossValidation::of(drives);
        let ways = [Fitted::Nothing, Fitted::Causes, Fitted::Everything];
        let losses = ways.map(|way| self.foretold_loss(&left_out, way));
        let best = (0..ways.len()).fold(0, |best, way| if losses[way] < losses[best] { way } else { best });
        // What runs away beyond all numbers has no loss that a file could hold.
        let told = Some([losses[0], losses[best]]).filter(|told| told.iter().all(|loss| loss.is_finite()));
        ControllerModel { foretold_losses: told, ..self.fitted(&all, ways[best]) }
    }

    /// Mean loss of every drive under the model that the others give.
    fn foretold_loss(&self, drives: &CrossValidation, fitted: Fitted) -> f64 {
        let folds = drives.folds();
        let loss = |(rest, own): &(Vec<&Drive>, &Drive)| {
            self.comparison(vec![*own]).loss(&self.fitted(rest, fitted).effects())
        };
        folds.iter().map(loss).sum::<f64>() / folds.len() as f64
    }
}

/// The controller's model with what a diagnosis announced: as it was, with the announced effects fitted in it, or with
/// everything fitted, whichever foretells the robot's drives best that it was not fitted to. `own` are the effects of the
/// user's model; else it is what the simulator's drives calibrated. Where nothing was announced the model is as it was.
///
/// # Errors
/// No run, or a run without the needed columns or too short.
pub fn controller_model(
    (baseline, diagnosis): (&Baseline, &Diagnosis),
    machine: &Machine,
    real: &[DriveLog],
    own: Option<&[Effect]>,
) -> Result<ControllerModel, GapError> {
    let repair = Repair {
        wheelbase_m: baseline.wheelbase_m,
        yardstick: &baseline.yardstick,
        nominal: own.unwrap_or_else(|| baseline.effects_for_control()),
        announced: diagnosis.effects(),
    };
    Ok(repair.best(&drives_of("real", machine, real)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine_tests::{Made, arcs, effect};

    fn made(curvature_ratio: f64, speed_ratio: f64, seed: u64) -> Drive {
        arcs(Made { curvature_ratio, speed_ratio, ..Made::RIGHT }, seed)
    }

    fn best(drives: &[Drive], nominal: &[Effect], announced: &[Effect]) -> ControllerModel {
        Repair { wheelbase_m: 1.0, yardstick: &Yardstick::rough(), nominal, announced }.best(drives)
    }

    /// Curvature at 0.8 of the commanded one is found beside a model that has 0.9 of its own: 0.8 / 0.9.
    #[test]
    fn what_was_announced_is_fitted_beside_the_model_that_is_there() {
        let drives = [made(0.8, 1.0, 1), made(0.8, 1.0, 2)];
        let own = [effect("steer_gain", 0.9)];
        let found = best(&drives, &own, &[effect("steer_gain", 0.5)]);
        let product: f64 = found.effects().iter().map(|own| own.values()[0]).product();
        assert!((product - 0.8).abs() < 0.01, "{found:?}");
        let [before, after] = found.foretold_losses.unwrap();
        assert!(after < before, "{found:?}");
    }

    /// A speed scale that is off as well is no cause, and is set right all the same.
    #[test]
    fn the_rest_is_fitted_where_that_foretells_better() {
        let drives = [made(0.8, 0.85, 3), made(0.8, 0.85, 4)];
        let found = best(&drives, &[effect("speed_scale", 1.0)], &[effect("steer_gain", 0.9)]);
        assert!((found.nominal[0].values()[0] - 0.85).abs() < 0.02, "{found:?}");
        assert!((found.causes[0].values()[0] - 0.8).abs() < 0.02, "{found:?}");
    }

    /// What one drive says and the other contradicts foretells neither.
    #[test]
    fn what_does_not_foretell_is_left_out() {
        let drives = [made(0.7, 1.0, 5), made(1.3, 1.0, 6)];
        let found = best(&drives, &[], &[effect("steer_gain", 0.9)]);
        assert_eq!((found.causes.len(), found.nominal.len()), (0, 0), "{found:?}");
        assert!(found.foretold_losses.is_some_and(|[before, after]| before.to_bits() == after.to_bits()));
    }

    #[test]
    fn without_an_announcement_nothing_changes() {
        let own = [effect("speed_scale", 0.5)];
        let found = best(&[made(0.8, 1.0, 7)], &own, &[]);
        assert_eq!((&found.nominal[..], found.causes.len(), found.foretold_losses), (&own[..], 0, None));
    }
}
