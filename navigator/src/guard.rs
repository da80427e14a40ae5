//! What may enter the pipeline: fresh, finite, moving measurements in order. Everything else has a stop reason.

use std::collections::BTreeMap;

use bicycle::{Odometry, StopReason};

use crate::jump::{Jump, turned_rad};

/// How far ahead of a decision, or of the odometry, a measurement may claim to be: clocks of two machines differ [s].
const FUTURE_S: f64 = 0.02;
/// Beyond these no vehicle is, moves, or turns: [m], [rad], [m/s], [rad/s].
const POSITION_MAX_M: f64 = 1e8;
const ANGLE_MAX_RAD: f64 = 1e6;
const SPEED_MAX_MPS: f64 = 1e3;
const RATE_MAX_RADPS: f64 = 1e3;

/// Age limits and plausibility limits of the inputs.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GuardConfig {
    /// Oldest odometry to act on, and longest gap to reckon over [s].
    pub odometry_age_max_s: f64,
    /// Oldest scan to drive on [s].
    pub scan_age_max_s: f64,
    /// Longest time that pose and velocity may repeat themselves to the last bit while the vehicle is told to
    /// move [s].
    pub frozen_max_s: f64,
    /// Shortest horizontal step beyond dead reckoning that counts as a correction of the localisation [m].
    pub jump_min_m: f64,
    /// Smallest turn beyond dead reckoning that counts as one [rad].
    pub jump_min_rad: f64,
    /// Farthest that a scan may be ahead of the last odometry to be placed by reckoning on from it [s].
    pub extrapolation_max_s: f64,
    /// How long a scan waits for the odometry after it before it is placed without [s].
    pub odometry_wait_max_s: f64,
}

impl Default for GuardConfig {
    fn default() -> Self {
        Self {
            odometry_age_max_s: 0.3,
            scan_age_max_s: 1.0,
            frozen_max_s: 0.5,
            jump_min_m: 0.4,
            jump_min_rad: 0.1,
            extrapolation_max_s: 0.1,
            odometry_wait_max_s: 0.1,
        }
    }
}

impl GuardConfig {
    /// The first field that is not a positive finite number, with its value.
    pub fn first_invalid(&self) -> Option<(&'static str, f64)> {
        let fields = [
            ("guard.odometry_age_max_s", self.odometry_age_max_s),
            ("guard.scan_age_max_s", self.scan_age_max_s),
            ("guard.frozen_max_s", self.frozen_max_s),
            ("guard.jump_min_m", self.jump_min_m),
            ("guard.jump_min_rad", self.jump_min_rad),
            ("guard.extrapolation_max_s", self.extrapolation_max_s),
            ("guard.odometry_wait_max_s", self.odometry_wait_max_s),
        ];
        fields.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
    }
}

/// What an odometry sample that was admitted says of the time and the map before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Admitted {
    /// The vehicle drove on.
    Onward,
    /// The last sample once more: no news, and no fault.
    Again,
    /// The localisation corrected itself.
    Jumped(Jump),
    /// The clock was set back: nothing of before can be told in its time.
    ClockSetBack,
}

/// Watches the inputs over time.
#[derive(Clone, Debug)]
pub struct Guard {
    config: GuardConfig,
    last: Option<Odometry>,
    changed_at_ns: u64,
    /// Of the last usable scan.
    scan_at_ns: Option<u64>,
    /// Since when the first scan is waited for; none in a time that began anew.
    awaits_since_ns: Option<u64>,
    /// First and last stamp of samples refused in a row for their order, if each is later than the one before.
    behind_ns: Option<[u64; 2]>,
    commanded_mps: f32,
    refused: BTreeMap<StopReason, u64>,
}

impl Guard {
    /// A guard that has seen nothing.
    pub fn new(config: GuardConfig) -> Self {
        Self {
            config,
            last: None,
            changed_at_ns: 0,
            scan_at_ns: None,
            awaits_since_ns: None,
            behind_ns: None,
            commanded_mps: 0.0,
            // An entry for every reason that there is here, so that counting takes no memory.
            refused: REFUSALS.into_iter().map(|reason| (reason, 0)).collect(),
        }
    }

    /// Takes in one odometry sample and says whether the localisation jumped. One that is not finite, cannot be, or
    /// is older than the last is refused and counted.
    ///
    /// Samples that are behind the last one and go on for longer than the age limit are a clock that was set back, or
    /// a last one that was ahead of its time: the guard begins anew with them.
    pub fn admit_odometry(&mut self, odometry: &Odometry) -> Result<Admitted, StopReason> {
        let admitted = self.judge(odometry);
        if let Err(reason) = admitted {
            self.count(reason);
        }
        admitted
    }

    /// Whether a scan of this time is news: neither older than the last that was noted, nor ahead of the odometry.
    /// One that is not is counted.
    pub fn admit_scan(&mut self, valid_at_ns: u64) -> Result<(), StopReason> {
        let judged = self.judge_scan(valid_at_ns);
        if let Err(reason) = judged {
            self.count(reason);
        }
        judged
    }

    /// Notes a scan that held usable points. One that [`Guard::admit_scan`] would refuse changes nothing.
    pub fn note_scan(&mut self, valid_at_ns: u64) {
        if self.judge_scan(valid_at_ns).is_ok() {
            self.scan_at_ns = Some(valid_at_ns);
        }
    }

    /// Notes what the vehicle was told, so that standing still on purpose is not taken for frozen odometry.
    pub fn note_command(&mut self, speed_mps: f32) {
        self.commanded_mps = speed_mps;
    }

    /// How many measurements were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<StopReason, u64> {
        &self.refused
    }

    /// Whether the vehicle may drive at this time on what was admitted.
    pub fn check(&self, now_ns: u64) -> Result<(), StopReason> {
        let Some(odometry_at_ns) = self.last.map(|last| last.valid_at_ns) else {
            return Err(StopReason::StaleOdometry);
        };
        let newest_ns = self.scan_at_ns.map_or(odometry_at_ns, |scan_at_ns| scan_at_ns.max(odometry_at_ns));
        if age_s(newest_ns, now_ns) > FUTURE_S {
            return Err(StopReason::InputFromFuture);
        }
        if age_s(now_ns, odometry_at_ns) > self.config.odometry_age_max_s || self.is_frozen(odometry_at_ns) {
            return Err(StopReason::StaleOdometry);
        }
        match self.scan_at_ns.or(self.awaits_since_ns) {
            Some(at_ns) if age_s(now_ns, at_ns) <= self.config.scan_age_max_s => Ok(()),
            _ => Err(StopReason::StaleScan),
        }
    }

    fn judge(&mut self, odometry: &Odometry) -> Result<Admitted, StopReason> {
        check_numbers(odometry)?;
        let at_ns = odometry.valid_at_ns;
        if self.last.is_some_and(|last| last == *odometry) {
            return Ok(Admitted::Again);
        }
        let is_behind = self.last.is_some_and(|last| at_ns <= last.valid_at_ns);
        if is_behind && !self.is_set_back(at_ns) {
            return Err(StopReason::InputOutOfOrder);
        }
        self.behind_ns = None;
        if is_behind {
            self.begin_anew(odometry);
            return Ok(Admitted::ClockSetBack);
        }
        let last = self.last.replace(*odometry);
        if last.is_none() {
            self.awaits_since_ns = Some(at_ns);
        }
        let gap_s = age_s(at_ns, self.changed_at_ns);
        let repeats = last.is_some_and(|last| is_same_place(&last, odometry));
        if !repeats || self.commanded_mps == 0.0 && !self.is_frozen(at_ns) {
            self.changed_at_ns = at_ns;
        }
        // After a gap nobody knows how far it drove: a step then is motion.
        let jump = last
            .filter(|_| !repeats && gap_s <= self.config.odometry_age_max_s)
            .and_then(|last| self.jump(&last, odometry, gap_s));
        Ok(jump.map_or(Admitted::Onward, Admitted::Jumped))
    }

    /// Whether a sample behind the last one ends a row of such that has gone on for longer than the age limit.
    fn is_set_back(&mut self, at_ns: u64) -> bool {
        let first_ns =
            self.behind_ns.filter(|[_, last_ns]| at_ns > *last_ns).map_or(at_ns, |[first_ns, _]| first_ns);
        self.behind_ns = Some([first_ns, at_ns]);
        age_s(at_ns, first_ns) > self.config.odometry_age_max_s
    }

    /// Of the scans nothing is known in the new time but that none has come: they count as too old.
    fn begin_anew(&mut self, odometry: &Odometry) {
        let at_ns = odometry.valid_at_ns;
        (self.last, self.changed_at_ns) = (Some(*odometry), at_ns);
        (self.scan_at_ns, self.awaits_since_ns) = (None, None);
    }

    fn judge_scan(&self, valid_at_ns: u64) -> Result<(), StopReason> {
        // Without odometry nobody knows what time it is.
        let last = self.last.ok_or(StopReason::StaleOdometry)?;
        if age_s(valid_at_ns, last.valid_at_ns) > self.config.odometry_age_max_s {
            return Err(StopReason::InputFromFuture);
        }
        let is_older = self.scan_at_ns.is_some_and(|scan_at_ns| valid_at_ns < scan_at_ns);
        if is_older { Err(StopReason::InputOutOfOrder) } else { Ok(()) }
    }

    fn count(&mut self, reason: StopReason) {
        *self.refused.entry(reason).or_default() += 1;
    }

    fn is_frozen(&self, now_ns: u64) -> bool {
        age_s(now_ns, self.changed_at_ns) > self.config.frozen_max_s
    }

    /// The correction, if the pose is too far from where the last one leads in this time.
    fn jump(&self, last: &Odometry, next: &Odometry, elapsed_s: f64) -> Option<Jump> {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let velocity_mps = [0, 1].map(|i| mean(last.velocity_mps[i], next.velocity_mps[i]));
        let yaw_rate_radps = mean(last.yaw_rate_radps, next.yaw_rate_radps);
        let reckoned = reckoned(&Odometry { velocity_mps, yaw_rate_radps, ..*last }, elapsed_s);
        let ([x_m, y_m, _], yaw_rad) = (reckoned.position_m, reckoned.attitude_rad[2]);
        let away_m = libm::hypot(next.position_m[0] - x_m, next.position_m[1] - y_m);
        let turned_rad = turned_rad(yaw_rad, next.attitude_rad[2]).abs();
        (away_m > self.config.jump_min_m || turned_rad > self.config.jump_min_rad)
            .then(|| Jump::between((reckoned.position_m, yaw_rad), (next.position_m, next.attitude_rad[2])))
    }
}

/// Reasons for which measurements are refused.
const REFUSALS: [StopReason; 5] = [
    StopReason::StaleOdometry,
    StopReason::NonFiniteInput,
    StopReason::InputOutOfRange,
    StopReason::InputOutOfOrder,
    StopReason::InputFromFuture,
];

/// Where a vehicle is after a while at its velocity and yaw rate, on level ground.
pub(crate) fn reckoned(from: &Odometry, elapsed_s: f64) -> Odometry {
    let [forward_m, left_m] = from.velocity_mps.map(|value| value * elapsed_s);
    let turned_rad = from.yaw_rate_radps * elapsed_s;
    let ([x_m, y_m, z_m], [roll_rad, pitch_rad, yaw_rad]) = (from.position_m, from.attitude_rad);
    let (sin, cos) = libm::sincos(yaw_rad + 0.5 * turned_rad);
    Odometry {
        position_m: [x_m + forward_m * cos - left_m * sin, y_m + forward_m * sin + left_m * cos, z_m],
        attitude_rad: [roll_rad, pitch_rad, yaw_rad + turned_rad],
        ..*from
    }
}

fn check_numbers(odometry: &Odometry) -> Result<(), StopReason> {
    if !odometry.is_finite() {
        return Err(StopReason::NonFiniteInput);
    }
    let Odometry { position_m, attitude_rad, velocity_mps, yaw_rate_radps, .. } = odometry;
    let within = |values: &[f64], limit: f64| values.iter().all(|value| value.abs() <= limit);
    let can_be = within(position_m, POSITION_MAX_M)
        && within(attitude_rad, ANGLE_MAX_RAD)
        && within(velocity_mps, SPEED_MAX_MPS)
        && within(&[*yaw_rate_radps], RATE_MAX_RADPS)
        && within(&[odometry.wheel_speed_mps], SPEED_MAX_MPS)
        && within(&[odometry.steering_rad], ANGLE_MAX_RAD);
    if can_be { Ok(()) } else { Err(StopReason::InputOutOfRange) }
}

/// Whether pose and velocity are the same to the last bit. Wheels and steering are measured by others: they go on
/// when the localisation freezes.
fn is_same_place(last: &Odometry, next: &Odometry) -> bool {
    let told = |odometry: &Odometry| {
        let Odometry { position_m, attitude_rad, velocity_mps, yaw_rate_radps, .. } = *odometry;
        (position_m, attitude_rad, velocity_mps, yaw_rate_radps)
    };
    told(last) == told(next)
}

fn age_s(now_ns: u64, then_ns: u64) -> f64 {
    now_ns.saturating_sub(then_ns) as f64 * 1e-9
}

#[cfg(test)]
mod tests;
