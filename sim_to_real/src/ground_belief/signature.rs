//! What ground, vehicle and sensors leave in a set of drives, as numbers with a covariance.

use nalgebra::{DMatrix, DVector};
use terrain::TerrainClass;
use traversability::Encounter;

use super::block_mean::BlockLine;
use super::calibration::BINS;

/// Classes that are driven on.
pub(super) const CLASSES: [TerrainClass; 3] =
    [TerrainClass::Open, TerrainClass::Loose, TerrainClass::Vegetation];

/// A number of a signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trait {
    /// Slip of the wheels on ground of a class that is not steep [-].
    SlipLevel(TerrainClass),
    /// Slip against the slope on steep ground of a class: uphill as it is, downhill turned round [-].
    SlipSteep(TerrainClass),
    /// Height of the map above the measured one on a class [m].
    Height(TerrainClass),
    /// Speed of the wheels over the speed asked for, on level ground [-].
    WheelLevel,
    /// What a climb adds to it, per slope [-].
    WheelSlope,
    /// |roll| that was met per |roll| foretold [-].
    RollGain,
    /// The same of pitch.
    PitchGain,
}

/// The traits that a set of drives shows.
#[derive(Clone, Debug)]
pub(super) struct Signature {
    pub traits: Vec<Trait>,
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Stretches of driving behind it.
    pub n_blocks: usize,
}

/// Slip beyond this is a wheel that spins: how fast does not matter [-].
const SLIP_MAX: f64 = 0.2;
/// From here on ground is steep: a tyre slips little more on little friction before half of that is used [-].
const STEEP: f64 = 0.2;
/// Slopes beyond this say nothing more about what grows with the slope [-].
const SLOPE_MAX: f64 = 0.5;
/// Angles foretold below this are covered by noise [rad].
const ANGLE_MIN_RAD: f64 = 0.05;

impl Signature {
    /// Of footprints judged by the newest map, in the order of the drives.
    pub fn of(encounters: &[&Encounter]) -> Self {
        let mut groups: Vec<(Vec<Trait>, BlockLine)> = Vec::new();
        for class in CLASSES {
            let on = || encounters.iter().copied().filter(|met| met.ground.class == class);
            let slip = |met: &Encounter| met.slip.clamp(-SLIP_MAX, SLIP_MAX);
            let level = on().map(|met| (met, [1.0], if is_steep(met) { f64::NAN } else { slip(met) }));
            groups.extend(BlockLine::through(level).map(|line| (vec![Trait::SlipLevel(class)], line)));
            let steep = on().map(|met| {
                let against = slip(met) * met.ground.slope_along.signum();
                (met, [1.0], if is_steep(met) { against } else { f64::NAN })
            });
            groups.extend(BlockLine::through(steep).map(|line| (vec![Trait::SlipSteep(class)], line)));
            let height = on().map(|met| (met, [1.0], met.ground.height_error_m));
            groups.extend(BlockLine::through(height).map(|line| (vec![Trait::Height(class)], line)));
        }
        let wheels = encounters.iter().map(|met| (*met, line_of_slope(met), met.wheel_share));
        groups.extend(
            BlockLine::through(wheels).map(|line| (vec![Trait::WheelLevel, Trait::WheelSlope], line)),
        );
        for (parameter, gain) in [(2, Trait::RollGain), (3, Trait::PitchGain)] {
            let angles = encounters.iter().map(|met| {
                let foretold_rad = f64::from(met.foretold.prior[parameter].mean(&BINS[parameter]));
                let met_rad = f64::from(met.measured[parameter]);
                (*met, [foretold_rad], if foretold_rad > ANGLE_MIN_RAD { met_rad } else { f64::NAN })
            });
            groups.extend(BlockLine::through(angles).map(|line| (vec![gain], line)));
        }
        Self::joined(groups)
    }

    fn joined(groups: Vec<(Vec<Trait>, BlockLine)>) -> Self {
        let n = groups.iter().map(|(traits, _)| traits.len()).sum();
        let mut joined = Self {
            traits: Vec::with_capacity(n),
            values: DVector::zeros(n),
            covariance: DMatrix::zeros(n, n),
            n_blocks: 0,
        };
        for (traits, line) in groups {
            let first = joined.traits.len();
            joined.values.rows_mut(first, traits.len()).copy_from(&line.coefficients);
            joined
                .covariance
                .view_mut((first, first), (traits.len(), traits.len()))
                .copy_from(&line.covariance);
            joined.n_blocks = joined.n_blocks.max(line.n_blocks);
            joined.traits.extend(traits);
        }
        joined
    }

    pub fn place(&self, wanted: Trait) -> Option<usize> {
        self.traits.iter().position(|found| *found == wanted)
    }

    pub fn value(&self, wanted: Trait) -> Option<f64> {
        self.place(wanted).map(|place| self.values[place])
    }

    /// The traits that both show.
    pub fn shared_with(&self, other: &Self) -> Vec<Trait> {
        self.traits.iter().copied().filter(|own| other.place(*own).is_some()).collect()
    }

    /// These traits alone.
    pub fn only(&self, traits: &[Trait]) -> Self {
        let places: Vec<usize> = traits.iter().filter_map(|wanted| self.place(*wanted)).collect();
        Self {
            traits: traits.to_vec(),
            values: self.values.select_rows(&places),
            covariance: self.covariance.select_rows(&places).select_columns(&places),
            n_blocks: self.n_blocks,
        }
    }
}

fn is_steep(met: &Encounter) -> bool {
    met.ground.slope_along.abs() >= STEEP
}

/// A constant, and the slope that is climbed.
fn line_of_slope(met: &Encounter) -> [f64; 2] {
    [1.0, met.ground.slope_along.clamp(-SLOPE_MAX, SLOPE_MAX)]
}
