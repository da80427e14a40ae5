//! The last half second of the inertial measurement unit, and what may be wrong with it.

use bicycle::ImuSample;
use serde::{Deserialize, Serialize};

use crate::architecture::{AXES, WINDOW};

/// Time between samples [ns]: 200 Hz.
pub const PERIOD_NS: u64 = 5_000_000;
/// Samples in a row that may be missing; the last one stands in for them.
const MISSING_MAX: u64 = 3;
/// Share of the window that may be made up, and that may be saturated [-].
const MADE_UP_MAX: usize = WINDOW / 10;
const SATURATED_MAX: usize = WINDOW / 20;
/// Mean specific force of a vehicle that does not fly or fall, along the body's upward axis [m/s2]: on a slope of 45 degrees
/// it is 6.9, and shaking leaves the mean as it is.
const UPWARD_MPS2: [f32; 2] = [5.5, 14.0];

/// Range of the unit: what a component cannot exceed, so that one that reaches it may have been more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuRange {
    /// Specific force [m/s2].
    pub acceleration_mps2: f32,
    /// Angular rate [rad/s].
    pub rate_radps: f32,
}

impl Default for ImuRange {
    /// 16 g and 2000 degrees per second, as most small units have.
    fn default() -> Self {
        Self { acceleration_mps2: 156.9, rate_radps: 34.9 }
    }
}

/// Why the history says nothing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ImuFault {
    /// Not half a second of samples yet, or not again after a gap.
    #[error("expected {WINDOW} samples, found {found}")]
    Short {
        /// Samples there.
        found: usize,
    },
    /// The newest sample is old.
    #[error("expected a sample not older than {:.0} ms, found {:.0} ms", *.allowed_ns as f64 * 1e-6, *.found_ns as f64 * 1e-6)]
    Late {
        /// Largest age [ns].
        allowed_ns: u64,
        /// Age of the newest sample [ns].
        found_ns: u64,
    },
    /// More samples are missing than a unit of 200 Hz loses.
    #[error("expected 200 Hz, found {missing} of {WINDOW} samples missing")]
    Rate {
        /// Samples of the window that were made up.
        missing: usize,
    },
    /// The unit is at the end of its range.
    #[error("expected readings within the unit's range, found {found} of {WINDOW} samples at its end")]
    Saturated {
        /// Samples at the end of the range.
        found: usize,
    },
    /// Gravity does not point along the upward axis: another order or sign of axes, or other units.
    #[error("expected 9.8 m/s2 along the upward axis, found a mean of {:.1}, {:.1}, {:.1} m/s2 forward, left, up", mean_mps2[0], mean_mps2[1], mean_mps2[2])]
    Gravity {
        /// Mean specific force [m/s2].
        mean_mps2: [f32; 3],
    },
    /// Every sample is the same to the last bit.
    #[error("expected readings that change, found the same in all {WINDOW} samples")]
    Frozen,
}

/// What came in, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ImuCounts {
    /// Samples taken in.
    pub taken: u64,
    /// Samples refused because a component was not finite; the history starts anew.
    pub non_finite: u64,
    /// Samples refused because they were not newer than the last.
    pub disordered: u64,
    /// Samples that were missing and made up.
    pub made_up: u64,
    /// Gaps too long to be made up; the history starts anew.
    pub gaps: u64,
}

/// The newest [`WINDOW`] samples at 200 Hz, oldest first; missing ones are filled with the last before them.
#[derive(Clone, Debug)]
pub struct ImuHistory {
    range: ImuRange,
    /// Angular rate x, y, z, then specific force x, y, z; a ring.
    samples: [[f32; AXES]; WINDOW],
    is_made_up: [bool; WINDOW],
    n: usize,
    next: usize,
    newest_ns: u64,
    counts: ImuCounts,
}

impl ImuHistory {
    /// An empty history of a unit of this range.
    pub fn new(range: ImuRange) -> Self {
        Self {
            range,
            samples: [[0.0; AXES]; WINDOW],
            is_made_up: [false; WINDOW],
            n: 0,
            next: 0,
            newest_ns: 0,
            counts: ImuCounts::default(),
        }
    }

    /// What came in so far.
    pub fn counts(&self) -> ImuCounts {
        self.counts
    }

    /// Takes in a sample. One that is not finite makes the history start anew, as does a gap of more than three samples;
    /// one that is not newer than the last is left out.
    pub fn push(&mut self, sample: &ImuSample) {
        let numbers = numbers(sample);
        if numbers.iter().any(|value| !value.is_finite()) {
            self.counts.non_finite += 1;
            self.n = 0;
            return;
        }
        if self.counts.taken > 0 && sample.valid_at_ns <= self.newest_ns {
            self.counts.disordered += 1;
            return;
        }
        if self.n > 0 {
            self.bridge(sample.valid_at_ns);
        }
        self.put(numbers, false);
        self.newest_ns = sample.valid_at_ns;
        self.counts.taken += 1;
    }

    /// Fills what is missing between the newest sample and the next.
    fn bridge(&mut self, next_ns: u64) {
        let n_periods = (next_ns - self.newest_ns + PERIOD_NS / 2) / PERIOD_NS;
        let n_missing = n_periods.saturating_sub(1);
        if n_missing > MISSING_MAX {
            self.counts.gaps += 1;
            self.n = 0;
            return;
        }
        let last = self.samples[(self.next + WINDOW - 1) % WINDOW];
        for _ in 0..n_missing {
            self.put(last, true);
            self.counts.made_up += 1;
        }
    }

    fn put(&mut self, numbers: [f32; AXES], is_made_up: bool) {
        self.samples[self.next] = numbers;
        self.is_made_up[self.next] = is_made_up;
        self.next = (self.next + 1) % WINDOW;
        self.n = (self.n + 1).min(WINDOW);
    }

    /// The samples from old to new.
    ///
    /// # Errors
    /// Why they say nothing at this time; a sample that is newer than `now_ns` is not late.
    pub fn window(
        &self,
        now_ns: u64,
        age_max_ns: u64,
    ) -> Result<impl Iterator<Item = &[f32; AXES]> + Clone, ImuFault> {
        if self.n < WINDOW {
            return Err(ImuFault::Short { found: self.n });
        }
        let found_ns = now_ns.saturating_sub(self.newest_ns);
        if found_ns > age_max_ns {
            return Err(ImuFault::Late { allowed_ns: age_max_ns, found_ns });
        }
        let missing = self.is_made_up.iter().filter(|is_made_up| **is_made_up).count();
        if missing > MADE_UP_MAX {
            return Err(ImuFault::Rate { missing });
        }
        check_readings(&self.samples, &self.range)?;
        let (newer, older) = self.samples.split_at(self.next);
        Ok(older.iter().chain(newer))
    }
}

/// Angular rate x, y, z, then specific force x, y, z.
pub(crate) fn numbers(sample: &ImuSample) -> [f32; AXES] {
    let ([rx, ry, rz], [ax, ay, az]) = (sample.angular_rate_radps, sample.acceleration_mps2);
    [rx, ry, rz, ax, ay, az]
}

fn check_readings(samples: &[[f32; AXES]; WINDOW], range: &ImuRange) -> Result<(), ImuFault> {
    if samples.iter().all(|sample| sample == &samples[0]) {
        return Err(ImuFault::Frozen);
    }
    let is_saturated = |sample: &&[f32; AXES]| {
        let (rates, forces) = sample.split_at(3);
        rates.iter().any(|rate| rate.abs() >= 0.99 * range.rate_radps)
            || forces.iter().any(|force| force.abs() >= 0.99 * range.acceleration_mps2)
    };
    let found = samples.iter().filter(is_saturated).count();
    if found > SATURATED_MAX {
        return Err(ImuFault::Saturated { found });
    }
    let mean_mps2 =
        [3, 4, 5].map(|axis| samples.iter().map(|sample| sample[axis]).sum::<f32>() / WINDOW as f32);
    let [least, most] = UPWARD_MPS2;
    if (least..=most).contains(&mean_mps2[2]) { Ok(()) } else { Err(ImuFault::Gravity { mean_mps2 }) }
}

#[cfg(test)]
mod tests;
