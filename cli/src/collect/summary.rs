//! What was gathered, in numbers.

use std::collections::BTreeMap;
use std::fmt;

use bench::collection::{Collection, HeightScale};
use evidential::{Dataset, LabelConfig, PARAMETER_BINS, PARAMETER_NAMES, Response, Responses};
use serde::Serialize;

/// The content of `--json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct CollectSummary {
    pub vehicle: String,
    pub provenance: String,
    pub n_examples: usize,
    pub n_features: usize,
    pub n_drives: usize,
    /// Labels on ground that is not known well enough.
    pub n_unknown_ground: usize,
    /// Simulated or recorded time [s].
    pub driven_s: f64,
    /// How simulated trials ended.
    pub outcomes: BTreeMap<String, usize>,
    pub parameters: Vec<ParameterSummary>,
    /// Standard deviation of elevation under the footprints [m]: percentile and value.
    pub unevenness_percentiles_m: Vec<(u32, f32)>,
    pub responses: Responses,
    pub labelling: LabelConfig,
    /// How the height scale of the test split was found, if it was.
    pub height_scale: Option<HeightScale>,
    /// Time it all took [s].
    pub elapsed_s: f64,
    pub revision: &'static str,
}

/// What was measured of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct ParameterSummary {
    pub name: &'static str,
    /// Share of the examples in which it means something.
    pub valid_share: f64,
    /// Mean of the valid ones; `None` when there is none.
    pub mean: Option<f64>,
    /// Share of the valid ones in each bin.
    pub bin_shares: [f64; traversability::N_BINS],
}

const PERCENTILES: [u32; 7] = [1, 10, 25, 50, 75, 90, 99];

impl CollectSummary {
    pub fn of(collection: &Collection, height_scale: Option<HeightScale>, elapsed_s: f64) -> Self {
        let dataset = &collection.dataset;
        let mut outcomes = BTreeMap::new();
        for trial in &collection.trials {
            let ended = trial.outcome.map_or_else(|| "recorded".to_owned(), |outcome| outcome.to_string());
            *outcomes.entry(ended).or_default() += 1;
        }
        let trials = collection.trials.iter();
        Self {
            vehicle: dataset.origin.vehicle.clone(),
            provenance: dataset.origin.provenance.clone(),
            n_examples: dataset.examples.len(),
            n_features: dataset.origin.layout.n_features(),
            n_drives: dataset.origin.drives.len(),
            n_unknown_ground: trials.clone().map(|trial| trial.n_unknown_ground).sum(),
            driven_s: trials.map(|trial| trial.time_s).sum(),
            outcomes,
            parameters: (0..PARAMETER_NAMES.len()).map(|k| ParameterSummary::of(dataset, k)).collect(),
            unevenness_percentiles_m: PERCENTILES
                .map(|percent| (percent, dataset.unevenness_quantile_m(f64::from(percent) / 100.0)))
                .to_vec(),
            responses: collection.responses,
            labelling: collection.labelling,
            height_scale,
            elapsed_s,
            revision: crate::summary::revision(),
        }
    }
}

impl ParameterSummary {
    fn of(dataset: &Dataset, parameter: usize) -> Self {
        let values = dataset.examples.iter().map(|example| example.measured[parameter]);
        let valid: Vec<f32> = values.filter(|value| !value.is_nan()).collect();
        let per_valid = 1.0 / valid.len().max(1) as f64;
        let mut bin_shares = [0.0; traversability::N_BINS];
        for bin in valid.iter().filter_map(|value| PARAMETER_BINS[parameter].bin_of(*value)) {
            bin_shares[bin] += per_valid;
        }
        Self {
            name: PARAMETER_NAMES[parameter],
            valid_share: valid.len() as f64 / dataset.examples.len().max(1) as f64,
            mean: (!valid.is_empty())
                .then(|| valid.iter().map(|value| f64::from(*value)).sum::<f64>() * per_valid),
            bin_shares,
        }
    }
}

impl fmt::Display for CollectSummary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}: {} examples of {} features", self.vehicle, self.n_examples, self.n_features)?;
        writeln!(out, "  {}", self.provenance)?;
        let outcomes: Vec<String> = self.outcomes.iter().map(|(name, n)| format!("{n} {name}")).collect();
        writeln!(out, "  {} drives, {:.0} s: {}", self.n_drives, self.driven_s, outcomes.join(", "))?;
        if self.n_unknown_ground > 0 {
            writeln!(out, "  {} labels left out, their ground is not known", self.n_unknown_ground)?;
        }
        for parameter in &self.parameters {
            let mean = parameter.mean.map_or(String::new(), |mean| format!(", mean {mean:.3}"));
            let percent = 100.0 * parameter.valid_share;
            writeln!(out, "  {:<17}{percent:5.1} % valid{mean}", parameter.name)?;
        }
        let percentiles = self.unevenness_percentiles_m.iter();
        let percentiles: Vec<String> =
            percentiles.map(|(percent, value_m)| format!("{percent} %: {value_m:.3}")).collect();
        writeln!(out, "  unevenness [m]   {}", percentiles.join("  "))?;
        for (name, response) in [("speed", self.responses.speed), ("turn", self.responses.turn)] {
            let Response { delay_s, rate_max_per_s, time_constant_s } = response;
            let rate = rate_max_per_s.map_or(String::new(), |rate| format!("at most {rate:.2} per s, "));
            writeln!(
                out,
                "  {name} follows its command: delay {delay_s:.2} s, {rate}lag {time_constant_s:.2} s"
            )?;
        }
        if let Some(found) = &self.height_scale {
            let percent = 100.0 * found.share;
            writeln!(out, "  heights times {:.3}: {percent:.1} % out of distribution", found.scale)?;
        }
        writeln!(out, "  took {:.1} s", self.elapsed_s)
    }
}
