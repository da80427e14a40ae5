//! The height scale at which the wanted share of the test split is out of distribution.

use evidential::Dataset;
use serde::Serialize;

use super::{CollectionError, Place, Request, collect};

/// A test split as uneven as wanted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeightScale {
    /// What all heights of the test maps are multiplied by.
    pub scale: f64,
    /// Share of the test footprints, as driven, that are more uneven than half of the training footprints.
    pub share: f64,
    /// What was tried, in order.
    pub rounds: Vec<ScaleRound>,
}

/// One scale that was driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScaleRound {
    /// Height scale.
    pub scale: f64,
    /// Share of the footprints above the threshold.
    pub share: f64,
}

/// Scales between which the search stays.
const SCALES: [f64; 2] = [0.25, 8.0];

/// Finds the height scale of the rock testbed's test split at which `share` of the footprints that are driven over are
/// more uneven than the median of those that were driven over for training, within `tolerance`.
///
/// Unevenness is a standard deviation of elevation and grows with the scale; which ground is driven over changes with
/// it too, so that every round drives. Returns the closest of at most `n_rounds`.
///
/// # Errors
/// As [`collect`]. A place other than rocks is driven once, as it is.
pub fn find_height_scale(
    training: &Dataset,
    request: &Request,
    [share, tolerance]: [f64; 2],
    n_rounds: usize,
) -> Result<HeightScale, CollectionError> {
    let threshold_m = training.unevenness_quantile_m(0.5);
    let mut rounds: Vec<ScaleRound> = Vec::new();
    let Place::Rocks { field, split } = &request.place else {
        let dataset = collect(request, || ())?.dataset;
        let share = share_above(&dataset, threshold_m);
        return Ok(HeightScale { scale: 1.0, share, rounds });
    };
    let mut scale = field.test_height_scale;
    for _ in 0..n_rounds.max(1) {
        let mut field = field.clone();
        field.test_height_scale = scale;
        let request = Request { place: Place::Rocks { field, split: *split }, ..request.clone() };
        let dataset = collect(&request, || ())?.dataset;
        let round = ScaleRound { scale, share: share_above(&dataset, threshold_m) };
        rounds.push(round);
        if (round.share - share).abs() <= tolerance {
            break;
        }
        // With this footprint on the threshold, the wanted share would lie above it.
        let marginal_m = dataset.unevenness_quantile_m(1.0 - share);
        scale = (scale * f64::from(threshold_m / marginal_m)).clamp(SCALES[0], SCALES[1]);
    }
    let misses = |round: &&ScaleRound| (round.share - share).abs();
    let best = rounds.iter().min_by(|a, b| misses(a).total_cmp(&misses(b)));
    let best = best.copied().unwrap_or(ScaleRound { scale, share: f64::NAN });
    Ok(HeightScale { scale: best.scale, share: best.share, rounds })
}

/// Share of the examples above a threshold.
fn share_above(dataset: &Dataset, threshold_m: f32) -> f64 {
    let n_above = dataset.examples.iter().filter(|example| example.unevenness_m > threshold_m).count();
    n_above as f64 / dataset.examples.len().max(1) as f64
}
