//! How probable roll and pitch make a cause.

use super::block::{PITCH, ROLL};
use crate::findings::Leaning;
use bicycle::Effect;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// Columns of a [`Gram`]: what is left, an offset of each angle,
const LEFT: usize = 0;
const OFFSET: [usize; 2] = [1, 2];
/// forces, one with two components twice, and what sensors misstate, of which a body is foretold wrongly.
pub(super) const CAUSES: [&str; 10] = [
    "rolling_drag",
    "quad_drag",
    "veg_drag",
    "wind",
    "wind",
    "cross_slope",
    "mass",
    "odom_scale",
    "gyro_bias",
    "yaw_misalign",
];
const FIRST_CAUSE: usize = 3;
const FIRST_OF_SENSORS: usize = FIRST_CAUSE + 7;
pub(super) const N_COLUMNS: usize = FIRST_CAUSE + CAUSES.len();
/// Inner products of the columns, of errors that are independent and 1.
pub(super) type Gram = SMatrix<f64, N_COLUMNS, N_COLUMNS>;

/// Nominal drives are few: errors are Student's with so many degrees of freedom.
const FREEDOM: f64 = 8.0;
/// No lean is worth more than this, in the logarithm of the odds: what the rollouts say beyond doubt stays so.
const MOST: f64 = 10.0;
/// Every size that is free to fit takes this off the logarithm of the odds, twice what chance makes of it.
const PRICE: f64 = 1.0;
/// A body leans where every drive says so by this many standard deviations, to the same side. Of 170 cases without any effect
/// none reaches 2.
const LEANS: f64 = 5.0;
/// Squared lengths below this share of the largest are none.
const SINGULAR: f64 = 1e-9;

/// What the drives of a robot say of forces; of none, nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct AttitudeEvidence {
    drives: Vec<Gram>,
}

/// Causes with the sizes that the angles ask for, and what these take off their squared errors.
struct Fitted {
    columns: Vec<usize>,
    sizes: DVector<f64>,
    taken_off: f64,
}

impl AttitudeEvidence {
    pub(super) fn of(drives: Vec<Gram>) -> Self {
        Self { drives }
    }

    /// Logarithm of how many times as probable the angles are with these causes, forces at whatever size, as without; at least
    /// 0, for a force may act where no spring feels it.
    pub(crate) fn support(&self, causes: &[Effect]) -> f64 {
        let all: Gram = self.drives.iter().sum();
        let everything = |gram: &Gram| Fitted::of(gram, (OFFSET[PITCH]..N_COLUMNS).collect()).taken_off;
        let stated = rightly_stated(&all, causes);
        let fitted = Fitted::to_forces(&stated, causes);
        let with = (everything(&stated) - fitted.taken_off).max(0.0);
        let ratio = (FREEDOM + everything(&all)) / (FREEDOM + with);
        (0.5 * (FREEDOM + 1.0) * ratio.ln() - PRICE * fitted.columns.len() as f64).clamp(0.0, MOST)
    }

    /// How much further the body leans than these causes say, if every drive of two or more agrees: one alone was off by six
    /// standard deviations without any effect.
    pub(crate) fn leaning(&self, causes: &[Effect]) -> Option<Leaning> {
        if self.drives.len() < 2 {
            return None;
        }
        let drives: Vec<Gram> = self.drives.iter().map(|own| rightly_stated(own, causes)).collect();
        let fitted = Fitted::to_forces(&drives.iter().sum(), causes);
        let of_axis = |axis: usize| {
            let offsets: Vec<(f64, f64)> =
                drives.iter().map(|own| fitted.offset(own, OFFSET[axis])).collect();
            let (mean, _) = *offsets.first()?;
            let agrees = |(size, strength): &(f64, f64)| *strength > LEANS && size.signum() == mean.signum();
            let n = offsets.len() as f64;
            offsets.iter().all(agrees).then(|| offsets.iter().map(|(size, _)| size).sum::<f64>() / n)
        };
        let [pitch, roll] = [PITCH, ROLL].map(of_axis);
        (pitch.or(roll).is_some())
            .then(|| Leaning { pitch_rad: pitch.unwrap_or_default(), roll_rad: roll.unwrap_or_default() })
    }
}

/// Whether a column is of a cause.
fn is_of(column: usize, cause: &Effect) -> bool {
    CAUSES[column - FIRST_CAUSE] == cause.description().cause
}

/// The same once what the sensors misstate is put right, which the rollouts tell the size of.
fn rightly_stated(gram: &Gram, causes: &[Effect]) -> Gram {
    let mut left = SVector::<f64, N_COLUMNS>::zeros();
    left[LEFT] = 1.0;
    for column in FIRST_OF_SENSORS..N_COLUMNS {
        let own = causes.iter().find(|cause| is_of(column, cause));
        left[column] = own.map_or(0.0, |cause| match cause {
            // Of accelerations that were measured so many times as large.
            Effect::OdomScale(scale) => 1.0 / scale.ratio - 1.0,
            _ => -cause.values()[0],
        });
    }
    let products = gram * left;
    let mut stated = *gram;
    stated.set_column(LEFT, &products);
    stated.set_row(LEFT, &products.transpose());
    stated[(LEFT, LEFT)] = left.dot(&products);
    stated
}

/// Which way an effect of one size acts.
fn direction(cause: &Effect) -> Option<f64> {
    let [parameter] = cause.description().parameters else { return None };
    Some((cause.values()[0] - parameter.neutral).signum())
}

impl Fitted {
    /// Forces of these causes; what the angles ask for the other way round is none.
    fn to_forces(gram: &Gram, causes: &[Effect]) -> Self {
        let cause = |column: usize| causes.iter().find(|cause| is_of(column, cause));
        let fitted = Self::of(
            gram,
            (FIRST_CAUSE..FIRST_OF_SENSORS).filter(|column| cause(*column).is_some()).collect(),
        );
        let agrees = |(column, size): (&usize, &f64)| {
            let is_this_way = direction(cause(*column)?).is_none_or(|direction| direction * size > 0.0);
            is_this_way.then_some(*column)
        };
        let agreed: Vec<usize> = fitted.columns.iter().zip(&fitted.sizes).filter_map(agrees).collect();
        if agreed.len() == fitted.columns.len() { fitted } else { Self::of(gram, agreed) }
    }

    fn of(gram: &Gram, columns: Vec<usize>) -> Self {
        if columns.is_empty() {
            return Self { columns, sizes: DVector::zeros(0), taken_off: 0.0 };
        }
        let products =
            DMatrix::from_fn(columns.len(), columns.len(), |row, k| gram[(columns[row], columns[k])]);
        let asked = DVector::from_iterator(columns.len(), columns.iter().map(|column| gram[(*column, LEFT)]));
        let least = SINGULAR * products.diagonal().max();
        let sizes = products.svd(true, true).solve(&asked, least.max(f64::MIN_POSITIVE));
        let sizes = sizes.unwrap_or_else(|_| DVector::zeros(columns.len()));
        Self { taken_off: asked.dot(&sizes), columns, sizes }
    }

    /// An offset of one drive beside the causes, and how many standard deviations that is.
    fn offset(&self, drive: &Gram, column: usize) -> (f64, f64) {
        let caused = self.columns.iter().zip(&self.sizes).map(|(own, size)| drive[(column, *own)] * size);
        let asked = drive[(column, LEFT)] - caused.sum::<f64>();
        let squares = drive[(column, column)].max(f64::MIN_POSITIVE);
        (asked / squares, asked.abs() / squares.sqrt())
    }
}
