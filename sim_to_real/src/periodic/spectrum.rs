//! Spectra over the time or the way.

use crate::findings::SwingOver;
use serde::{Deserialize, Serialize};
use std::f64::consts::{LN_2, TAU};

/// Rows that are averaged.
const PER_VALUE: usize = 2;
/// Errors beyond this many of the usual ones count no more than that.
const FARTHEST: f64 = 5.0;
/// Of the usual error, the median of all sizes.
const USUAL_OF_MEDIAN: f64 = 1.4826;
/// Frequencies on either side that say how strong a spectrum is about one.
const NEIGHBOURS: usize = 25;
/// Swings per second that are looked for,
const PER_SECOND: [f64; 2] = [0.5, 8.0];
/// and per wheelbase: wheels have a radius of a fortieth of it up to all of it.
const PER_WHEELBASE: [f64; 2] = [0.15, 6.0];
/// Frequencies lie so far apart, of one per span of the drives.
const APART: f64 = 0.5;
const MOST_FREQUENCIES: usize = 1500;

/// Values of a drive with their time and way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Series {
    interval_s: f64,
    way_m: Vec<f64>,
    values: Vec<f64>,
}

impl Series {
    /// Of rows of way and value; one that is missing counts as none.
    pub(super) fn of(rows: impl Iterator<Item = (f64, f64)>, step_s: f64) -> Self {
        let rows: Vec<(f64, f64)> = rows.collect();
        let mut sizes: Vec<f64> =
            rows.iter().map(|(_, value)| value.abs()).filter(|size| size.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        let farthest = FARTHEST * USUAL_OF_MEDIAN * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
        let bounded = |value: f64| if value.is_finite() { value.clamp(-farthest, farthest) } else { 0.0 };
        let pairs = rows.chunks_exact(PER_VALUE);
        Self {
            interval_s: step_s * PER_VALUE as f64,
            way_m: pairs.clone().map(|rows| rows[0].0).collect(),
            values: pairs
                .map(|rows| rows.iter().map(|(_, value)| bounded(*value)).sum::<f64>() / PER_VALUE as f64)
                .collect(),
        }
    }

    fn place(&self, over: SwingOver, k: usize) -> f64 {
        match over {
            SwingOver::Time => k as f64 * self.interval_s,
            SwingOver::Way => self.way_m[k],
        }
    }

    fn span(&self, over: SwingOver) -> f64 {
        let ways = self.way_m.iter().copied();
        match over {
            SwingOver::Time => self.values.len() as f64 * self.interval_s,
            SwingOver::Way => ways.clone().fold(0.0, f64::max) - ways.fold(f64::INFINITY, f64::min).min(0.0),
        }
    }

    /// Of the swing of one frequency.
    pub(super) fn amplitude(&self, over: SwingOver, frequency: f64) -> f64 {
        let sums = self.values.iter().enumerate().fold([0.0; 2], |[cosines, sines], (k, value)| {
            let (sine, cosine) = (TAU * frequency * self.place(over, k)).sin_cos();
            [cosines + value * cosine, sines + value * sine]
        });
        2.0 * sums[0].hypot(sums[1]) / self.values.len().max(1) as f64
    }
}

/// Frequencies that drives can tell apart.
pub(super) fn frequencies(over: SwingOver, drives: &[Series], wheelbase_m: f64) -> Vec<f64> {
    let [low, high] = match over {
        SwingOver::Time => PER_SECOND,
        SwingOver::Way => PER_WHEELBASE.map(|number| number / wheelbase_m),
    };
    let span = drives.iter().map(|own| own.span(over)).fold(0.0, f64::max);
    let apart = APART / span.max(f64::MIN_POSITIVE.sqrt());
    let n = ((high - low) / apart).clamp(0.0, MOST_FREQUENCIES as f64) as usize;
    (0..n).map(|k| low + k as f64 * apart).collect()
}

/// Power at every frequency, or the larger one next to it, over what it is about it.
pub(super) fn powers(series: &Series, over: SwingOver, frequencies: &[f64]) -> Vec<f64> {
    let raw: Vec<f64> =
        frequencies.iter().map(|frequency| series.amplitude(over, *frequency).powi(2)).collect();
    let about = |place: usize, reach: usize| place.saturating_sub(reach)..(place + reach + 1).min(raw.len());
    let usual = |place: usize| {
        let mut near = raw[about(place, NEIGHBOURS)].to_vec();
        near.sort_by(f64::total_cmp);
        // Of noise, powers are distributed exponentially: the median is ln 2 of the mean.
        (near[near.len() / 2] / LN_2).max(f64::MIN_POSITIVE)
    };
    let over: Vec<f64> = (0..raw.len()).map(|place| raw[place] / usual(place)).collect();
    (0..over.len()).map(|place| over[about(place, 1)].iter().copied().fold(0.0, f64::max)).collect()
}
