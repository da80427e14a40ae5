//! What comes again and again: a yaw rate that swings once in so many seconds or metres, as shimmy and wheels that are
//! out of true make it, stands out of the spectrum of what the commanded turning does not explain, however little of every
//! rollout it is.

mod spectrum;

use crate::drive::{Drive, STEP_S, VX, WZ};
use crate::findings::{Spectrum, Swing, SwingOver};
use bicycle::Command;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use spectrum::{Series, frequencies, powers};

/// Rows by which the commanded turning may be late: 0 to 1.2 s.
const LAGS: [usize; 15] = [0, 2, 4, 6, 8, 10, 13, 16, 20, 25, 30, 36, 43, 50, 60];
/// The lag at which a servo has followed, where turning yields with the speed.
const FOLLOWED: usize = 10;
const N_FEATURES: usize = LAGS.len() + 3;
/// A swing is told where every drive holds it so many times as strongly as its neighbours in the spectrum: of 260 cases without
/// one, none reaches 14.
const STANDS_OUT: f64 = 25.0;
/// Nominal drives may show this share of it.
const NOMINAL_SHARE: f64 = 0.5;
/// Singular values below this share of the largest are none.
const SINGULAR: f64 = 1e-10;

/// What the commanded turning makes of the yaw rate on nominal drives, and what it leaves there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct YawResponse {
    wheelbase_m: f64,
    weights: Vec<f64>,
    left: Vec<Series>,
}

impl YawResponse {
    /// `None` where no drive tells the yaw rate.
    pub(crate) fn of(wheelbase_m: f64, drives: &[&Drive]) -> Option<Self> {
        let told: Vec<&Drive> = drives.iter().copied().filter(|drive| tells(drive)).collect();
        let rows = told.iter().flat_map(|drive| rows(drive).map(|row| (*drive, row)));
        let mut products = DMatrix::zeros(N_FEATURES, N_FEATURES);
        let mut asked = DVector::zeros(N_FEATURES);
        for (drive, row) in rows.filter(|(drive, row)| drive.measured[WZ][*row].is_finite()) {
            let features = DVector::from(features(drive, wheelbase_m, row).to_vec());
            products.ger(1.0, &features, &features, 1.0);
            asked.axpy(drive.measured[WZ][row], &features, 1.0);
        }
        let least = SINGULAR * products.diagonal().max();
        let weights = products.svd(true, true).solve(&asked, least.max(f64::MIN_POSITIVE)).ok()?;
        let response = Self { wheelbase_m, weights: weights.iter().copied().collect(), left: Vec::new() };
        let left = told.iter().map(|drive| response.left(drive)).collect();
        (!told.is_empty()).then_some(Self { left, ..response })
    }

    /// The swing that stands out most in every drive, and not in the nominal ones, with the spectrum that it stands out of.
    pub(crate) fn swing(&self, drives: &[&Drive]) -> Option<(Swing, Spectrum)> {
        let told = drives.iter().filter(|drive| tells(drive));
        let real: Vec<Series> = told.map(|drive| self.left(drive)).collect();
        if real.len() < 2 {
            return None;
        }
        let found = [SwingOver::Time, SwingOver::Way].map(|over| self.swing_over(over, &real));
        let strongest = found.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
        strongest.map(|(_, swing, spectrum)| (swing, spectrum))
    }

    /// With its power.
    fn swing_over(&self, over: SwingOver, real: &[Series]) -> Option<(f64, Swing, Spectrum)> {
        let frequencies = frequencies(over, real, self.wheelbase_m);
        let real_power = of_all(real, over, &frequencies, f64::min);
        let place = (0..frequencies.len()).max_by(|a, b| real_power[*a].total_cmp(&real_power[*b]))?;
        let power = real_power[place];
        if power < STANDS_OUT {
            return None;
        }
        let nominal = of_all(&self.left, over, &frequencies, f64::max);
        let is_new = nominal[place] < NOMINAL_SHARE * power;
        // A power is the larger one of its neighbours' as well.
        let next = &frequencies[place.saturating_sub(1)..(place + 2).min(frequencies.len())];
        let (amplitude_radps, frequency) = strongest(real, over, next)?;
        let spectrum = Spectrum { over, frequencies, real: real_power, nominal };
        is_new.then_some((power, Swing { over, frequency, amplitude_radps }, spectrum))
    }

    /// What the commanded turning leaves of the yaw rate of a drive.
    fn left(&self, drive: &Drive) -> Series {
        let of_row = |row: usize| {
            let features = features(drive, self.wheelbase_m, row);
            let foretold: f64 =
                features.iter().zip(&self.weights).map(|(value, weight)| value * weight).sum();
            (drive.travelled[0][row], drive.measured[WZ][row] - foretold)
        };
        Series::of(rows(drive).map(of_row), STEP_S)
    }
}

/// Powers of all drives, of which one is chosen frequency by frequency.
fn of_all(drives: &[Series], over: SwingOver, frequencies: &[f64], chosen: fn(f64, f64) -> f64) -> Vec<f64> {
    let each: Vec<Vec<f64>> = drives.iter().map(|own| powers(own, over, frequencies)).collect();
    let at = |place: usize| each.iter().map(|own| own[place]).reduce(chosen).unwrap_or_default();
    (0..frequencies.len()).map(at).collect()
}

/// The largest mean amplitude of all drives, and its frequency.
fn strongest(drives: &[Series], over: SwingOver, frequencies: &[f64]) -> Option<(f64, f64)> {
    let mean = |frequency: f64| {
        drives.iter().map(|own| own.amplitude(over, frequency)).sum::<f64>() / drives.len() as f64
    };
    let sizes = frequencies.iter().map(|&frequency| (mean(frequency), frequency));
    sizes.max_by(|a, b| a.0.total_cmp(&b.0))
}

fn tells(drive: &Drive) -> bool {
    drive.evidence.yaw_rate
}

/// Rows with as long a memory of commands as the lags reach.
fn rows(drive: &Drive) -> impl Iterator<Item = usize> {
    let measures = |row: &usize| drive.measures(*row);
    let last = (0..drive.commands.len()).rev().find(measures).unwrap_or_default();
    let first = drive.starts.first().copied().unwrap_or(last).max(LAGS[LAGS.len() - 1]);
    first..last
}

/// The commanded turning [rad/s], as late as it may be, and what yields with the speed and with itself.
fn features(drive: &Drive, wheelbase_m: f64, row: usize) -> [f64; N_FEATURES] {
    let turning = |row: usize| {
        let Command { steering_rad, .. } = drive.commands[row];
        let turn = f64::from(steering_rad);
        if drive.evidence.is_skid_steered() { turn } else { drive.smooth[VX][row] * turn.tan() / wheelbase_m }
    };
    let squared = drive.smooth[VX][row].powi(2);
    let (now, followed) = (turning(row), turning(row - FOLLOWED));
    let yielding = [now * squared, followed * squared, now * now.abs()];
    std::array::from_fn(|k| LAGS.get(k).map_or_else(|| yielding[k - LAGS.len()], |lag| turning(row - lag)))
}

#[cfg(test)]
mod tests;
