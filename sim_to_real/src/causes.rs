//! Causes: effects of the catalogue added to the calibrated model, fitted to real drives.

use crate::calibration::{coordinate, coordinates_of_causes, is_limit, with_values};
use crate::comparison::Comparison;
use crate::least_squares::{fit, mean_loss};
use crate::nuisance::{Information, Nuisance};
use bicycle::Effect;
use bicycle::effect::{CATALOGUE, Description, Role, add_in_order};

/// Effects added to the baseline, and how well the whole foretells the real drives.
#[derive(Clone, Debug)]
pub(crate) struct Explanation {
    pub(crate) causes: Vec<Effect>,
    /// Mean robust loss.
    pub(crate) loss: f64,
    /// The same on drives that it was not fitted to, where that was tried.
    pub(crate) foretold_loss: f64,
}

impl Explanation {
    pub(crate) fn new(causes: Vec<Effect>, loss: f64) -> Self {
        Self { causes, loss, foretold_loss: loss }
    }

    /// Logarithm of the loss: half of it as fitted, half as foretold, so that what fits one drive and not the other
    /// is believed less.
    pub(crate) fn energy(&self) -> f64 {
        0.5 * (self.loss.ln() + self.foretold_loss.ln())
    }

    /// Names of the causes; two forms of one cause share a name.
    pub(crate) fn ids(&self) -> Vec<&'static str> {
        self.causes.iter().map(|cause| cause.description().cause).collect()
    }
}

/// Effects of the catalogue that may be the cause of a gap.
pub(crate) fn candidates() -> impl Iterator<Item = &'static Description> {
    CATALOGUE.iter().filter(|description| description.role == Role::Cause)
}

/// The baseline with causes added, each in its place between command and sensor. What changes the command stands
/// before the calibrated actuators, which then follow the changed command.
pub fn composed(baseline: &[Effect], causes: &[Effect]) -> Vec<Effect> {
    let (on_command, other): (Vec<Effect>, Vec<Effect>) =
        causes.iter().partition(|cause| cause.acts_on_command());
    let mut effects = Vec::with_capacity(baseline.len() + causes.len());
    on_command.into_iter().for_each(|cause| add_in_order(&mut effects, cause));
    effects.extend(baseline);
    other.into_iter().for_each(|cause| add_in_order(&mut effects, cause));
    effects
}

/// Real drives and the model that was right on nominal ones.
#[derive(Clone, Debug)]
pub(crate) struct Trial<'a> {
    pub(crate) comparison: Comparison<'a>,
    baseline: &'a [Effect],
    /// The baseline's parameters where nominal drives tell how much they are known.
    nuisance: Option<Nuisance>,
}

impl<'a> Trial<'a> {
    /// With a baseline that is taken as it is.
    pub(crate) fn fixed(comparison: Comparison<'a>, baseline: &'a [Effect]) -> Self {
        Self { comparison, baseline, nuisance: None }
    }

    /// With a baseline that gives way as far as nominal drives let it.
    pub(crate) fn given_way(
        comparison: Comparison<'a>,
        baseline: &'a [Effect],
        nominal: &Information,
    ) -> Self {
        let nuisance = Nuisance::of(&comparison, baseline, nominal);
        Self { comparison, baseline, nuisance }
    }

    pub(crate) fn loss(&self, causes: &[Effect]) -> f64 {
        mean_loss(&self.judged_residuals(causes))
    }

    pub(crate) fn residuals(&self, causes: &[Effect]) -> Vec<f32> {
        self.comparison.residuals(&composed(self.baseline, causes))
    }

    /// The residuals as the loss judges them.
    pub(crate) fn judged_residuals(&self, causes: &[Effect]) -> Vec<f32> {
        let judged = self.comparison.judged_residuals(&composed(self.baseline, causes));
        match &self.nuisance {
            Some(nuisance) => nuisance.profiled_out(judged),
            None => judged,
        }
    }

    /// The best of `known` with one effect more: the values that the catalogue tries, then the best of them refined
    /// while the known ones stay.
    pub(crate) fn with_one_more(&self, known: &[Effect], description: &Description) -> Option<Explanation> {
        let with = |cause: Effect| {
            let causes: Vec<Effect> = known.iter().copied().chain([cause]).collect();
            Explanation::new(causes.clone(), self.loss(&causes))
        };
        let tried = tried(description).into_iter().map(with);
        let best = tried.min_by(|a, b| a.loss.total_cmp(&b.loss))?;
        Some(self.sized(best))
    }

    /// The last cause at its best size, the others as they are where it has one parameter only.
    pub(crate) fn sized(&self, tried: Explanation) -> Explanation {
        let n_parameters = tried.causes.last().map_or(0, |cause| cause.description().parameters.len());
        if n_parameters == 1 { self.searched(tried) } else { self.refined(tried) }
    }

    /// All parameters of all causes fitted together.
    pub(crate) fn refined(&self, explanation: Explanation) -> Explanation {
        let causes = explanation.causes;
        let coordinates = coordinates_of_causes(&causes);
        let found = fit(&coordinates, |values| self.judged_residuals(&with_values(&causes, values)));
        if found.loss < explanation.loss {
            Explanation::new(with_values(&causes, &found.values), found.loss)
        } else {
            Explanation::new(causes, explanation.loss)
        }
    }

    /// The last cause's only parameter by golden section between the tried values around it: needs no derivative, so
    /// that thresholds are found as well.
    pub(crate) fn searched(&self, mut explanation: Explanation) -> Explanation {
        const GOLDEN: f64 = 0.618_033_988_749_894_8;
        let Some(cause) = explanation.causes.pop() else { return explanation };
        let description = cause.description();
        let parameter = &description.parameters[0];
        let known = explanation.causes;
        let with = |place: f64| {
            let cause = with_values(&[cause], &[place])[0];
            let causes: Vec<Effect> = known.iter().copied().chain([cause]).collect();
            Explanation::new(causes.clone(), self.loss(&causes))
        };
        let (mut low, mut high) = bracket(&description, cause.values()[0]);
        let mut best = Explanation::new(known.iter().copied().chain([cause]).collect(), explanation.loss);
        let inner = |low: f64, high: f64| [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        let [mut left, mut right] = inner(low, high).map(|place| (place, with(place)));
        for _ in 0..12 {
            for side in [&left, &right] {
                if side.1.loss < best.loss {
                    best = side.1.clone();
                }
            }
            if left.1.loss < right.1.loss {
                (high, right) = (right.0, left);
                let place = inner(low, high)[0];
                left = (place, with(place));
            } else {
                (low, left) = (left.0, right);
                let place = inner(low, high)[1];
                right = (place, with(place));
            }
        }
        debug_assert!(best.causes.last().is_some_and(|cause| cause.values()[0] >= parameter.low));
        best
    }
}

/// The effect at every combination of the values that the catalogue tries.
pub(crate) fn tried(description: &Description) -> Vec<Effect> {
    let mut values = vec![[0.0; 4]];
    for (place, parameter) in description.parameters.iter().enumerate() {
        let each = |so_far: &[f64; 4]| {
            let so_far = *so_far;
            parameter.tried.iter().map(move |&value| {
                let mut values = so_far;
                values[place] = value;
                values
            })
        };
        values = values.iter().flat_map(each).collect();
    }
    values.into_iter().filter_map(|values| Effect::from_values(description.id, values)).collect()
}

/// Coordinates of the tried values (or no effect) below and above a value.
fn bracket(description: &Description, value: f64) -> (f64, f64) {
    let parameter = &description.parameters[0];
    let mut marks: Vec<f64> =
        parameter.tried.iter().map(|&value| coordinate(parameter, value, None).start).collect();
    let middle = coordinate(parameter, value, None).start;
    let (first, last) = (marks[0], marks[marks.len() - 1]);
    let reach = last - first;
    if !is_limit(parameter) {
        marks.push(parameter.neutral);
    }
    marks.extend([first - reach, last + reach]);
    let ends = coordinate(parameter, value, None);
    let below = marks.iter().copied().filter(|&mark| mark < middle - 1e-9).fold(f64::NEG_INFINITY, f64::max);
    let above = marks.iter().copied().filter(|&mark| mark > middle + 1e-9).fold(f64::INFINITY, f64::min);
    (below.max(ends.low), above.min(ends.high))
}
