//! What a simulator makes of its own recorded drives: the yardstick for everything else.

use super::replay::replayed;
use super::types::{RunSimulator, SimulatorDescription};
use crate::comparison::{Comparison, Yardstick, rollout_error};
use crate::drive::Drive;
use crate::least_squares::mean_loss;
use crate::whitening::Whitening;

/// Standard deviations, what belongs together in them, and what is left where nothing is wrong.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    pub(super) yardstick: Yardstick,
    pub(super) whitening: Whitening,
    /// Mean robust loss on the simulator's own drives.
    pub(super) loss: f64,
    /// Root mean square of their residuals, in standard deviations.
    pub(super) error: f64,
    /// The same in units of the noise of their own measurements.
    pub(super) own_drives_error: f64,
}

impl Reference {
    /// Sends the nominal drives through the simulator as it is. Where these are freer of noise than the real ones, as a
    /// simulator's log often is, the noise of the real ones counts.
    pub(super) fn of<E>(
        simulator: &SimulatorDescription,
        (nominal, real): (&[Drive], &[Drive]),
        run: &RunSimulator<'_, E>,
    ) -> Result<Self, E> {
        let rough = Yardstick::rough();
        let as_it_is = replayed(simulator, nominal, &[Vec::new()], &rough, run)?;
        let own = as_it_is.concat().concat();
        let (of_nominal, of_real) = (noise(nominal, &rough), noise(real, &rough));
        let larger = |(own, noise): (f64, f64)| own.max(noise);
        let sigmas = [&own, &of_nominal, &of_real].map(|residuals| Yardstick::of(residuals, &rough).0);
        let [own_sigmas, nominal_sigmas, real_sigmas] = sigmas;
        let yardstick = Yardstick(own_sigmas.iter().copied().zip(real_sigmas).map(larger).collect());
        let own_in_noise = in_units_of(&own, &rough, &Yardstick(nominal_sigmas));
        let [own, of_real] = [own, of_real].map(|residuals| in_units_of(&residuals, &rough, &yardstick));
        let left = if rollout_error(&own) > rollout_error(&of_real) { own } else { of_real };
        let whitening = Whitening::of(&left);
        Ok(Self {
            loss: mean_loss(&whitening.applied(&left)),
            error: rollout_error(&left),
            own_drives_error: rollout_error(&own_in_noise),
            yardstick,
            whitening,
        })
    }
}

/// What the noise of the measurements makes of residuals.
fn noise(drives: &[Drive], unit: &Yardstick) -> Vec<f32> {
    Comparison::new(1.0, drives.iter().collect(), unit).noise()
}

fn in_units_of(residuals: &[f32], from: &Yardstick, to: &Yardstick) -> Vec<f32> {
    let ratios = from.0.iter().zip(to.per_sigma()).map(|(from, per_sigma)| *from as f32 * per_sigma);
    residuals.iter().zip(ratios.collect::<Vec<_>>().iter().cycle()).map(|(r, ratio)| r * ratio).collect()
}
