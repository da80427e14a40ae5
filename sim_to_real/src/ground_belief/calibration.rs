//! Whether what was foretold is what was met: bias, probability integral transform, coverage.

use serde::Serialize;
use traversability::{Bins, Encounter, N_BINS, Pmf};

use super::block_mean::{BlockMean, block_mean};

/// The four parameters in the order of an [`Encounter`].
pub const PARAMETERS: [&str; 4] = ["linear traction", "angular traction", "roll", "pitch"];
/// Their bins.
pub(super) const BINS: [Bins; 4] = [Bins::TRACTION, Bins::TRACTION, Bins::ATTITUDE, Bins::ATTITUDE];
/// Cells of the histogram of the probability integral transform.
pub const N_PIT: usize = 10;
/// Probability outside a central 90 % interval, on each side.
const TAIL: f64 = 0.05;
/// Standard errors from which on a deviation is said.
pub(super) const TELLING: f64 = 3.0;
/// Deviations of coverage below this are not said, however sure they are.
const COVERAGE_TOLERANCE: f64 = 0.05;

/// In what a belief parts from what was met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Parting {
    /// In nothing that these drives show.
    None,
    /// The ground is worse than foretold.
    TooOptimistic,
    /// The ground is better than foretold.
    TooPessimistic,
    /// What is met lies outside the central 90 % more often than one time in ten.
    OverConfident,
    /// Less often.
    UnderConfident,
    /// Too little was met to say.
    Unknown,
}

/// What was foretold of a parameter, and what was met.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Its name.
    pub parameter: &'static str,
    /// What was met, less the mean of what was foretold: a traction [-], or an angle [rad].
    pub bias: Option<BlockMean>,
    /// Mean of what was met.
    pub met: Option<BlockMean>,
    /// Share of what was met inside the central 90 % of what was foretold.
    pub coverage: Option<BlockMean>,
    /// Histogram of the probability integral transform, summing to one; level where the belief is calibrated (for
    /// distributions over bins that of Czado, Gneiting and Held 2009, Biometrics 65).
    pub pit: [f64; N_PIT],
    /// The verdict.
    pub parting: Parting,
}

/// Probability below and up to the bin of a value.
fn around(pmf: &Pmf, bin: usize) -> [f64; 2] {
    let below: f64 = pmf.probabilities()[..bin].iter().map(|p| f64::from(*p)).sum();
    [below, (below + f64::from(pmf.probabilities()[bin])).min(1.0)]
}

/// Share of the way from one end of an interval to the other that lies within another.
fn share_within([low, high]: [f64; 2], within: [f64; 2]) -> f64 {
    if high <= low {
        return f64::from(u8::from(within[0] <= low && low < within[1]));
    }
    ((high.min(within[1]) - low.max(within[0])) / (high - low)).max(0.0)
}

/// What was met less the mean of what was foretold; NaN where the measurement means nothing.
pub(super) fn residual(encounter: &Encounter, parameter: usize) -> f64 {
    let mean = encounter.foretold.posterior[parameter].mean(&BINS[parameter]);
    f64::from(within_bins(encounter, parameter) - mean)
}

/// A measurement as far as the bins reach: whoever rolled back had no traction, and no bin knows more than all of it.
fn within_bins(encounter: &Encounter, parameter: usize) -> f32 {
    let values = BINS[parameter].values();
    let measured = encounter.measured[parameter];
    if parameter < 2 { measured.clamp(values[0], values[N_BINS - 1]) } else { measured }
}

impl Calibration {
    pub(super) fn of(encounters: &[&Encounter], parameter: usize) -> Self {
        let bin = |encounter: &Encounter| BINS[parameter].bin_of(encounter.measured[parameter]);
        let cumulated = |encounter: &Encounter| {
            bin(encounter).map(|bin| around(&encounter.foretold.posterior[parameter], bin))
        };
        let of = |value: &dyn Fn(&Encounter) -> f64| block_mean(encounters.iter().copied(), value);
        let coverage = of(&|encounter| {
            cumulated(encounter).map_or(f64::NAN, |ends| share_within(ends, [TAIL, 1.0 - TAIL]))
        });
        let bias = of(&|encounter| residual(encounter, parameter));
        let met = of(&|encounter| f64::from(within_bins(encounter, parameter)));
        let mut pit = [0.0; N_PIT];
        let met_ends: Vec<[f64; 2]> =
            encounters.iter().filter_map(|encounter| cumulated(encounter)).collect();
        for (cell, share) in pit.iter_mut().enumerate() {
            let within = [cell, cell + 1].map(|edge| edge as f64 / N_PIT as f64);
            let sum: f64 =
                met_ends.iter().map(|ends| share_within(ends.map(|p| p.min(1.0 - 1e-12)), within)).sum();
            *share = sum / met_ends.len().max(1) as f64;
        }
        let parting = parting(bias.as_ref(), coverage.as_ref(), parameter);
        Self { parameter: PARAMETERS[parameter], bias, met, coverage, pit, parting }
    }
}

/// Half a bin: differences below it are within what bins can say.
fn tolerance(parameter: usize) -> f64 {
    let values = BINS[parameter].values();
    0.5 * f64::from(values[2] - values[1])
}

fn parting(bias: Option<&BlockMean>, coverage: Option<&BlockMean>, parameter: usize) -> Parting {
    let (Some(bias), Some(coverage)) = (bias, coverage) else { return Parting::Unknown };
    let is_biased = bias.deviations_from(0.0).abs() > TELLING && bias.value.abs() > tolerance(parameter);
    let expected = 1.0 - 2.0 * TAIL;
    let off = coverage.value - expected;
    let is_off = coverage.deviations_from(expected).abs() > TELLING && off.abs() > COVERAGE_TOLERANCE;
    // Little traction is bad, a large angle is bad.
    let is_worse = (bias.value < 0.0) == (parameter < 2);
    match (is_biased, is_off) {
        (true, _) if is_worse => Parting::TooOptimistic,
        (true, _) => Parting::TooPessimistic,
        (false, true) if off < 0.0 => Parting::OverConfident,
        (false, true) => Parting::UnderConfident,
        (false, false) => Parting::None,
    }
}
