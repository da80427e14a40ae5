//! Friction of classes of ground from drives: the inner problem of AnyNav's bilevel optimisation (equations 26b to 33),
//! over classes instead of pixels.

use bicycle::DriveLog;
use route::FrictionCurve;

use crate::chassis::Chassis;
use crate::judge::{GroundFriction, judge};
use crate::least_squares::{Belief, Fit, Residual, fit};
use crate::model::{Layout, class_beliefs, misfit, run_beliefs, vehicle_beliefs};
use crate::samples::{DriveError, Sample, samples};

/// Levels of friction that the search starts from [-].
const STARTS: [f64; 3] = [0.25, 0.5, 0.9];
/// What the model errs by before anything is known [m/s2], and at least.
const MISFIT_MPS2: f64 = 0.5;
const MISFIT_MIN_MPS2: f64 = 0.05;
/// Friction that has to be refuted, over what was found [-], by this much loss, which is a dozen standard deviations of
/// residuals that hang together over a dozen samples.
const MUCH_MORE: f64 = 1.4;
const REFUTED_BY: f64 = 150.0;
/// Errors hang together over this time [s].
const BLOCK_S: f64 = 1.0;

/// A drive over classes of ground.
#[derive(Clone, Copy, Debug)]
pub struct Drive<'a> {
    /// What was measured.
    pub log: &'a DriveLog,
    /// Class of the ground under the vehicle in each row, an index into the classes.
    pub classes: &'a [usize],
}

/// Friction that cannot be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FindError {
    /// No drive at all.
    #[error("expected at least one drive, found none")]
    NoDrive,
    /// A drive that says nothing.
    #[error("drive {index}: {source}")]
    Drive {
        /// Which one, from 1.
        index: usize,
        /// Why.
        source: DriveError,
    },
    /// A row names no class.
    #[error("drive {index}: expected classes below {n_classes}, found {found}")]
    Class {
        /// Which drive, from 1.
        index: usize,
        /// Number of classes.
        n_classes: usize,
        /// The class given.
        found: usize,
    },
    /// A published curve is none.
    #[error("{ground}: expected {}, found {found:?}", FrictionCurve::EXPECTED)]
    Curve {
        /// Name of the class.
        ground: String,
        /// What was given.
        found: FrictionCurve,
    },
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// One for each class.
    pub grounds: Vec<GroundFriction>,
    /// Moment of inertia about the vertical over that of the description [-].
    pub inertia_factor: f64,
    /// Wheel speed over what was measured [-].
    pub wheel_scale: f64,
    /// Slip stiffness of front and rear tyres [-].
    pub slip_stiffness: [f64; 2],
    /// Standard deviation of what the model does not explain, ahead, left, and turning times half the wheelbase [m/s2].
    pub misfit_mps2: [f64; 3],
}

/// Finds the friction of `classes`, each with the published curve that its shape is taken from where drives do not show it.
///
/// # Errors
/// No drive, a drive without what is needed or too short, classes that do not fit, curves that are none.
pub fn find_friction(
    chassis: &Chassis,
    classes: &[(&str, FrictionCurve)],
    drives: &[Drive<'_>],
) -> Result<Found, FindError> {
    if drives.is_empty() {
        return Err(FindError::NoDrive);
    }
    if let Some((ground, found)) = classes.iter().find(|(_, curve)| !curve.is_valid()) {
        return Err(FindError::Curve { ground: (*ground).to_owned(), found: *found });
    }
    let (samples, n_runs) = gather(chassis, classes.len(), drives)?;
    let layout = Layout { n_runs, n_classes: classes.len() };
    let runs = (0..n_runs).flat_map(|_| run_beliefs());
    let of_classes = classes.iter().flat_map(|(_, published)| class_beliefs(published));
    let beliefs: Vec<Belief> = vehicle_beliefs().into_iter().chain(runs).chain(of_classes).collect();
    let starts = STARTS.map(|level| start(&beliefs, layout, level));
    let problem = Problem { chassis, classes, samples: &samples, layout, beliefs };
    let (fit, scale_mps2) = problem.solve(&starts);
    let doubted: Vec<bool> =
        (0..classes.len()).map(|class| problem.may_hold_more(&fit, class, scale_mps2)).collect();
    let grounds = judge(&problem, &fit, &doubted);
    Ok(Found {
        grounds,
        inertia_factor: fit.values[2].exp(),
        wheel_scale: 1.0 + fit.values[3],
        slip_stiffness: [0, 1].map(|axle| chassis.slip_stiffness[axle] * fit.values[axle].exp()),
        misfit_mps2: scale_mps2,
    })
}

fn gather(
    chassis: &Chassis,
    n_classes: usize,
    drives: &[Drive<'_>],
) -> Result<(Vec<Sample>, usize), FindError> {
    let (mut all, mut n_runs) = (Vec::new(), 0);
    for (place, drive) in drives.iter().enumerate() {
        let index = place + 1;
        if let Some(&found) = drive.classes.iter().find(|class| **class >= n_classes) {
            return Err(FindError::Class { index, n_classes, found });
        }
        let found = samples(chassis, drive.log, drive.classes, n_runs);
        all.extend(found.map_err(|source| FindError::Drive { index, source })?);
        n_runs += drive.log.runs().len();
    }
    Ok((all, n_runs))
}

/// Samples, and what is sought from them.
pub(crate) struct Problem<'a> {
    pub chassis: &'a Chassis,
    pub classes: &'a [(&'a str, FrictionCurve)],
    pub samples: &'a [Sample],
    pub layout: Layout,
    pub beliefs: Vec<Belief>,
}

/// All as believed, but for the level of friction.
fn start(beliefs: &[Belief], layout: Layout, level: f64) -> Vec<f64> {
    let mut start: Vec<f64> = beliefs.iter().map(|belief| belief.mean).collect();
    for class in 0..layout.n_classes {
        start[layout.class(class)] = level.ln();
    }
    start
}

impl Problem<'_> {
    /// The best of several starts with a guessed scatter, then from there with the scatter that is left.
    pub(crate) fn solve(&self, starts: &[Vec<f64>]) -> (Fit, [f64; 3]) {
        let first = starts.iter().map(|start| self.fit(&self.beliefs, start, [MISFIT_MPS2; 3]));
        let best = first.min_by(|a, b| a.loss.total_cmp(&b.loss));
        let values = best.map_or_else(Vec::new, |fit| fit.values);
        let scale_mps2 = self.scatter_mps2(&values);
        (self.fit(&self.beliefs, &values, scale_mps2), scale_mps2)
    }

    /// Whether a class could as well hold much more than was found: forces that end where the driving ended look like
    /// forces at a limit to a fit whose tyres are as stiff as it likes. All else is sought anew.
    fn may_hold_more(&self, fit: &Fit, class: usize, scale_mps2: [f64; 3]) -> bool {
        let place = self.layout.class(class);
        let mut beliefs = self.beliefs.clone();
        let more = fit.values[place] + MUCH_MORE.ln();
        let Belief { high, .. } = beliefs[place];
        beliefs[place].low = more.min(high);
        let mut start = fit.values.clone();
        start[place] = (more + MUCH_MORE.ln()).min(high);
        self.fit(&beliefs, &start, scale_mps2).loss < fit.loss + REFUTED_BY
    }

    fn fit(&self, beliefs: &[Belief], start: &[f64], scale_mps2: [f64; 3]) -> Fit {
        fit(beliefs, start, &|values, take| {
            for sample in self.samples {
                let places = self.layout.local(sample);
                let published = &self.classes[sample.class].1;
                let misfit = misfit(self.chassis, sample, published, places.map(|place| values[place]));
                let block = sample.run * 1_000_000 + (sample.time_s / BLOCK_S) as usize;
                for (component, scale) in misfit.misfit_mps2.iter().zip(scale_mps2) {
                    let slopes: [(usize, f64); crate::model::LOCAL] =
                        std::array::from_fn(|i| (places[i], component.slope[i] / scale));
                    take(Residual { value: component.value / scale, slopes: &slopes, block });
                }
            }
        })
    }

    /// Robust standard deviation of each component of the misfit.
    fn scatter_mps2(&self, values: &[f64]) -> [f64; 3] {
        let mut sizes: [Vec<f64>; 3] = Default::default();
        for sample in self.samples {
            let places = self.layout.local(sample);
            let published = &self.classes[sample.class].1;
            let misfit = misfit(self.chassis, sample, published, places.map(|place| values[place]));
            for (sizes, component) in sizes.iter_mut().zip(misfit.misfit_mps2) {
                sizes.push(component.value.abs());
            }
        }
        sizes.map(|mut sizes| {
            let middle = sizes.len() / 2;
            let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
            (1.4826 * *median).max(MISFIT_MIN_MPS2)
        })
    }
}
