//! What has changed between two sets of drives: the ground, the vehicle, or what the sensors say of the ground.

use nalgebra::{DMatrix, DVector};
use serde::{Serialize, Serializer};
use terrain::TerrainClass;

use super::places::class_name;
use super::signature::{CLASSES, Signature, Trait};

/// Something that makes a belief about the ground wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroundCause {
    /// One class grips more or less than it did.
    Friction(TerrainClass),
    /// All ground grips more or less, as when it is wet.
    Wet,
    /// The map lies too high or too low: the sensor is not where it is said to be.
    HeightBias,
    /// Ground that is called by the first name is really of the second.
    Mislabelled(TerrainClass, TerrainClass),
    /// The vehicle carries a load: it sinks in, leans more, and its motor falls short on climbs.
    Heavier,
}

/// A cause with how well it explains what has changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RankedGroundCause {
    /// The cause.
    pub cause: GroundCause,
    /// Probability among all causes, nothing and something unknown, from Schwarz' criterion.
    pub score: f64,
    /// Share of the squared difference, in standard errors, that it explains.
    pub explained: f64,
    /// What it means in numbers.
    pub means: String,
}

/// What is said of a change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroundChange {
    /// Squared difference of the two sets in standard errors, and how many numbers it is made of.
    pub chi_squared: f64,
    /// See [`GroundChange::chi_squared`].
    pub n_traits: usize,
    /// The cause that is named; `None` where nothing has changed beyond chance, or nothing known explains it.
    pub named: Option<GroundCause>,
    /// Whether something has changed that no cause explains.
    pub is_unknown: bool,
    /// The causes that the drives cannot tell apart, together at least 95 %; empty where nothing has changed.
    pub credible: Vec<GroundCause>,
    /// All causes, the likeliest first.
    pub ranking: Vec<RankedGroundCause>,
}

impl GroundCause {
    /// Name in files.
    pub fn id(self) -> String {
        match self {
            Self::Friction(class) => format!("friction_{}", class_name(class as usize)),
            Self::Wet => "wet".to_owned(),
            Self::HeightBias => "height_bias".to_owned(),
            Self::Mislabelled(named, really) => {
                format!("{}_is_{}", class_name(named as usize), class_name(really as usize))
            }
            Self::Heavier => "heavier".to_owned(),
        }
    }

    /// In words.
    pub fn name(self) -> String {
        match self {
            Self::Friction(class) => format!("other friction of {} ground", class_name(class as usize)),
            Self::Wet => "other friction everywhere, as when it is wet".to_owned(),
            Self::HeightBias => "heights of the map are off: look at the sensor's mount".to_owned(),
            Self::Mislabelled(named, really) => {
                format!("what is called {} is {}", class_name(named as usize), class_name(really as usize))
            }
            Self::Heavier => "the vehicle is heavier".to_owned(),
        }
    }

    fn all() -> Vec<Self> {
        let mut all: Vec<Self> = CLASSES.into_iter().map(Self::Friction).collect();
        all.extend([Self::Wet, Self::HeightBias, Self::Heavier]);
        // Open ground that is called loose differs in its grip alone, and is told as that.
        for rigid in [TerrainClass::Open, TerrainClass::Loose] {
            all.push(Self::Mislabelled(rigid, TerrainClass::Vegetation));
            all.push(Self::Mislabelled(TerrainClass::Vegetation, rigid));
        }
        all
    }
}

impl Serialize for GroundCause {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.id())
    }
}

/// A difference this unlikely by chance is told, as a probability of the chi-squared distribution.
const CHANCE_MAX: f64 = 0.001;
/// How much less a loaded vehicle may seem to lean, by the error of measurement [-].
const LEAN_LESS: f64 = 0.02;
/// Variance of a difference over that within the drives: two sets are never driven over the same ground.
const OTHER_GROUND: f64 = 1.3;
/// Probability that the credible causes hold together.
const CREDIBLE: f64 = 0.95;

/// Compares drives with those of a time when all was right.
pub(super) fn change(real: &Signature, reference: &Signature) -> Option<GroundChange> {
    let traits = real.shared_with(reference);
    (!traits.is_empty()).then_some(())?;
    let (real, before) = (real.only(&traits), reference.only(&traits));
    let difference = Difference {
        change: &real.values - &before.values,
        weight: ((&real.covariance + &before.covariance) * OTHER_GROUND).cholesky()?.inverse(),
        traits: &traits,
        reference,
    };
    let n_traits = traits.len();
    let nothing = difference.chi_squared(&DMatrix::zeros(n_traits, 0), &DVector::zeros(0));
    let price = (real.n_blocks.max(2) as f64).ln();
    let mut fits: Vec<Fit> =
        GroundCause::all().into_iter().filter_map(|cause| difference.fit(cause)).collect();
    fits.sort_by(|a, b| a.criterion(price).total_cmp(&b.criterion(price)));
    let likelihood = |criterion: f64| (-0.5 * (criterion - nothing).max(-1400.0)).exp();
    let sum: f64 = 1.0 + fits.iter().map(|fit| likelihood(fit.criterion(price))).sum::<f64>();
    let ranking: Vec<RankedGroundCause> = fits
        .iter()
        .map(|fit| RankedGroundCause {
            cause: fit.cause,
            score: likelihood(fit.criterion(price)) / sum,
            explained: 1.0 - fit.chi_squared / nothing,
            means: fit.means.clone(),
        })
        .collect();
    let has_changed = chance(nothing, n_traits) < CHANCE_MAX;
    let best = fits.first().filter(|best| has_changed && best.criterion(price) < nothing);
    let is_explained = |fit: &&Fit| {
        chance(fit.chi_squared, n_traits - fit.n_free) >= CHANCE_MAX || fit.chi_squared < 0.3 * nothing
    };
    let named = best.filter(is_explained).map(|best| best.cause);
    Some(GroundChange {
        chi_squared: nothing,
        n_traits,
        named,
        is_unknown: has_changed && named.is_none(),
        credible: if named.is_some() { credible(&ranking) } else { Vec::new() },
        ranking,
    })
}

fn credible(ranking: &[RankedGroundCause]) -> Vec<GroundCause> {
    let all: f64 = ranking.iter().map(|ranked| ranked.score).sum();
    let mut sum = 0.0;
    let needed = ranking.iter().take_while(|ranked| {
        let is_needed = sum < CREDIBLE * all;
        sum += ranked.score;
        is_needed
    });
    needed.map(|ranked| ranked.cause).collect()
}

/// Probability that chance makes a sum of so many squares of normal numbers larger (Wilson and Hilferty 1931).
fn chance(chi_squared: f64, n: usize) -> f64 {
    if n == 0 {
        return 1.0;
    }
    let spread = 2.0 / (9.0 * n as f64);
    let normal = ((chi_squared / n as f64).cbrt() - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(normal / std::f64::consts::SQRT_2)
}

/// What has changed, and how well that is known.
struct Difference<'a> {
    change: DVector<f64>,
    /// Inverse of its covariance.
    weight: DMatrix<f64>,
    /// What it is made of.
    traits: &'a [Trait],
    /// All that the reference shows: of classes, too, that are not met any more.
    reference: &'a Signature,
}

/// A cause at its best.
struct Fit {
    cause: GroundCause,
    chi_squared: f64,
    n_free: usize,
    means: String,
}

impl Fit {
    /// Schwarz' criterion: misfit, and a price for every free number.
    fn criterion(&self, price: f64) -> f64 {
        self.chi_squared + price * self.n_free as f64
    }
}

impl Difference<'_> {
    fn chi_squared(&self, directions: &DMatrix<f64>, sizes: &DVector<f64>) -> f64 {
        let left = &self.change - directions * sizes;
        (left.transpose() * &self.weight * &left)[(0, 0)]
    }

    /// `None` where the cause leaves no trace in what both sets show, or would have to act the wrong way.
    fn fit(&self, cause: GroundCause) -> Option<Fit> {
        let directions = self.directions(cause)?;
        let weighted = directions.transpose() * &self.weight;
        let sizes = (&weighted * &directions).cholesky()?.solve(&(&weighted * &self.change));
        is_possible(cause, &sizes).then(|| Fit {
            cause,
            chi_squared: self.chi_squared(&directions, &sizes),
            n_free: sizes.len(),
            means: means(cause, &sizes),
        })
    }

    /// Where a cause moves the traits: one column for every free number.
    fn directions(&self, cause: GroundCause) -> Option<DMatrix<f64>> {
        let n = self.traits.len();
        let column = |moved: &dyn Fn(Trait) -> f64| {
            let column = DVector::from_iterator(n, self.traits.iter().map(|own| moved(*own)));
            (column.amax() > 0.0).then_some(column)
        };
        let unit = |is_moved: bool| f64::from(u8::from(is_moved));
        let columns: Vec<DVector<f64>> = match cause {
            GroundCause::Friction(class) => [Trait::SlipLevel(class), Trait::SlipSteep(class)]
                .into_iter()
                .filter_map(|moved| column(&|own| unit(own == moved)))
                .collect(),
            GroundCause::Wet => {
                let is_known = |class: &TerrainClass| self.shows(Trait::SlipLevel(*class));
                // On a single class it is that class' friction.
                (CLASSES.iter().filter(|class| is_known(class)).count() > 1).then_some(())?;
                let level = column(&|own| unit(matches!(own, Trait::SlipLevel(_))));
                let steep = column(&|own| unit(matches!(own, Trait::SlipSteep(_))));
                level.into_iter().chain(steep).collect()
            }
            GroundCause::HeightBias => vec![column(&|own| unit(matches!(own, Trait::Height(_))))?],
            // Plants that are taken for ground lift the map there, ground that is taken for plants lowers it.
            GroundCause::Mislabelled(named, really) => {
                let height = column(&|own| unit(own == Trait::Height(named)))?;
                let slip = column(&|own| self.towards(own, named, really));
                std::iter::once(height).chain(slip).collect()
            }
            GroundCause::Heavier => {
                // The axle is always among it; what else there is depends on what was measured.
                let axle = column(&|own| unit(matches!(own, Trait::Height(_))))?;
                let leans = [Trait::RollGain, Trait::PitchGain];
                let leans = leans.into_iter().filter_map(|moved| column(&|own| unit(own == moved)));
                // The motor falls short uphill.
                let motor = column(&|own| -unit(own == Trait::WheelSlope));
                std::iter::once(axle).chain(leans).chain(motor).collect()
            }
        };
        (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
    }

    fn shows(&self, wanted: Trait) -> bool {
        self.traits.contains(&wanted)
    }

    /// How slip on one class would have to move to be that of another.
    fn towards(&self, own: Trait, named: TerrainClass, really: TerrainClass) -> f64 {
        let other = match own {
            Trait::SlipLevel(class) if class == named => Trait::SlipLevel(really),
            Trait::SlipSteep(class) if class == named => Trait::SlipSteep(really),
            _ => return 0.0,
        };
        let values = [other, own].map(|wanted| self.reference.value(wanted));
        if let [Some(other), Some(own)] = values { other - own } else { 0.0 }
    }
}

/// Slip of a mislabelled part lies between that of both classes, give or take its error.
const PART: std::ops::RangeInclusive<f64> = -0.3..=1.5;

/// Whether the cause acts the way that it has to: a load sinks the vehicle in and makes it lean more, not less.
fn is_possible(cause: GroundCause, sizes: &DVector<f64>) -> bool {
    match cause {
        GroundCause::Mislabelled(_, really) => {
            let is_lifted = really == TerrainClass::Vegetation;
            (sizes[0] > 0.0) == is_lifted && sizes.iter().skip(1).all(|part| PART.contains(part))
        }
        GroundCause::Heavier => sizes[0] > 0.0 && sizes.iter().skip(1).all(|gain| *gain > -LEAN_LESS),
        _ => true,
    }
}

fn means(cause: GroundCause, sizes: &DVector<f64>) -> String {
    let slip = |size: Option<&f64>, where_| size.map_or(String::new(), |size| format!("{size:+.3} {where_}"));
    match cause {
        GroundCause::Friction(_) | GroundCause::Wet => {
            let parts = [slip(sizes.get(0), "on the level"), slip(sizes.get(1), "on steep ground")];
            format!(
                "slip {}",
                parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
            )
        }
        GroundCause::HeightBias => format!("the map lies {:+.3} m higher", sizes[0]),
        GroundCause::Mislabelled(..) => format!("the map lies {:+.3} m higher there", sizes[0]),
        GroundCause::Heavier => format!("the axle lies {:.3} m lower", sizes[0]),
    }
}
