//! The last half second of the inertial measurement unit, and what may be wrong with it.

use bicycle::ImuSample;
use serde::{Deserialize, Serialize};

use crate::agreement::Disagreement;
use crate::architecture::{AXES, WINDOW};

/// Time between samples [ns]: 200 Hz.
pub const PERIOD_NS: u64 = 5_000_000;
/// Samples in a row that may be missing; the last one stands in for them.
const MISSING_MAX: u64 = 3;
/// Share of the window that may be made up, and that may be saturated [-].
const MADE_UP_MAX: usize = WINDOW / 10;
const SATURATED_MAX: usize = WINDOW / 20;
/// How far the time of the window may be off as a factor.
const SPAN: [f32; 2] = [0.9, 1.1];
/// A sample that is older than the newest by more than this is of a clock that was set back [ns].
const SET_BACK_NS: u64 = WINDOW as u64 * PERIOD_NS;
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
    /// The newest sample is of a time that has not come yet.
    #[error("expected no sample from the future, found one {:.0} ms ahead", *.ahead_ns as f64 * 1e-6)]
    FromFuture {
        /// By how much [ns].
        ahead_ns: u64,
    },
    /// Another rate, or more samples missing than a unit of 200 Hz loses.
    #[error("expected 200 Hz, found {found_hz:.0} Hz")]
    Rate {
        /// Samples that came in the time of the window, over that time [Hz].
        found_hz: f32,
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
    /// The upward rate is not the localisation's yaw rate.
    #[error(
        "expected the rate about the upward axis to follow the localisation's yaw rate, found a correlation of {correlation:.2} and a factor of {factor:.2}"
    )]
    YawRate {
        /// Of both [-].
        correlation: f32,
        /// Upward rate over yaw rate [-].
        factor: f32,
    },
    /// The force to the left is not what it takes to turn: forward and left are swapped, or left is right.
    #[error("expected the force to the left to follow speed times yaw rate, found correlations of {0:.2} ahead and {1:.2} to the left", correlation[0], correlation[1])]
    Force {
        /// Of the forces ahead and to the left with speed times yaw rate [-].
        correlation: [f32; 2],
    },
}

impl From<Disagreement> for ImuFault {
    fn from(disagreement: Disagreement) -> Self {
        match disagreement {
            Disagreement::Rate { correlation, factor } => {
                Self::YawRate { correlation: correlation[2] as f32, factor: factor as f32 }
            }
            Disagreement::Force { correlation } => {
                Self::Force { correlation: correlation.map(|value| value as f32) }
            }
        }
    }
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
    times_ns: [u64; WINDOW],
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
            times_ns: [0; WINDOW],
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

    /// Starts anew.
    pub fn forget(&mut self) {
        (self.n, self.newest_ns) = (0, 0);
    }

    /// Takes in a sample. One that is not finite makes the history start anew, as do a gap of more than three samples and a
    /// clock that was set back; one that is not newer than the last is left out.
    pub fn push(&mut self, sample: &ImuSample) {
        let numbers = numbers(sample);
        if numbers.iter().any(|value| !value.is_finite()) {
            self.counts.non_finite += 1;
            self.n = 0;
            return;
        }
        let at_ns = sample.valid_at_ns;
        if self.newest_ns.saturating_sub(at_ns) > SET_BACK_NS {
            self.counts.gaps += 1;
            self.forget();
        }
        if self.n > 0 && at_ns <= self.newest_ns {
            self.counts.disordered += 1;
            return;
        }
        if self.n > 0 {
            self.bridge(at_ns);
        }
        self.put(numbers, at_ns, false);
        self.newest_ns = at_ns;
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
        for k in 1..=n_missing {
            self.put(last, self.newest_ns + k * PERIOD_NS, true);
            self.counts.made_up += 1;
        }
    }

    fn put(&mut self, numbers: [f32; AXES], at_ns: u64, is_made_up: bool) {
        self.samples[self.next] = numbers;
        self.times_ns[self.next] = at_ns;
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
        let ahead_ns = self.newest_ns.saturating_sub(now_ns);
        if ahead_ns > age_max_ns {
            return Err(ImuFault::FromFuture { ahead_ns });
        }
        self.check_rate()?;
        check_readings(&self.samples, &self.range)?;
        let (newer, older) = self.samples.split_at(self.next);
        Ok(older.iter().chain(newer))
    }

    /// A unit that is faster fills the window in less time; one that is slower leaves much to be made up.
    fn check_rate(&self) -> Result<(), ImuFault> {
        let n_missing = self.is_made_up.iter().filter(|is_made_up| **is_made_up).count();
        // In a full ring the next place is the oldest.
        let span_ns = self.newest_ns.saturating_sub(self.times_ns[self.next]);
        let share = span_ns as f32 / ((WINDOW - 1) as u64 * PERIOD_NS) as f32;
        if n_missing <= MADE_UP_MAX && (SPAN[0]..=SPAN[1]).contains(&share) {
            return Ok(());
        }
        let found_hz = (WINDOW - 1 - n_missing) as f32 / (span_ns as f32 * 1e-9);
        Err(ImuFault::Rate { found_hz })
    }

    /// Means of the newest few samples: rates [rad/s] and forces [m/s2]; none of too short a history.
    pub(crate) fn newest(&self, n: usize) -> Option<([f64; 3], [f64; 3])> {
        let place = |k: usize| (self.next + WINDOW - 1 - k) % WINDOW;
        (self.n >= n).then(|| means((0..n).map(|k| self.samples[place(k)])))
    }
}

/// Angular rate x, y, z, then specific force x, y, z.
pub(crate) fn numbers(sample: &ImuSample) -> [f32; AXES] {
    let ([rx, ry, rz], [ax, ay, az]) = (sample.angular_rate_radps, sample.acceleration_mps2);
    [rx, ry, rz, ax, ay, az]
}

/// Means of rates [rad/s] and of forces [m/s2].
pub(crate) fn means(samples: impl ExactSizeIterator<Item = [f32; AXES]>) -> ([f64; 3], [f64; 3]) {
    let n = samples.len() as f64;
    let mut sums = [0.0; AXES];
    for sample in samples {
        for (sum, value) in sums.iter_mut().zip(sample) {
            *sum += f64::from(value);
        }
    }
    let [rx, ry, rz, ax, ay, az] = sums.map(|sum| sum / n);
    ([rx, ry, rz], [ax, ay, az])
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
