//! What may enter the pipeline: fresh, finite, moving measurements. Everything else has a stop reason.

use bicycle::{Odometry, StopReason};

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
}

impl Default for GuardConfig {
    fn default() -> Self {
        Self { odometry_age_max_s: 0.3, scan_age_max_s: 1.0, frozen_max_s: 0.5, jump_min_m: 0.4 }
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
        ];
        fields.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
    }
}

/// A correction of the localisation: the map frame moved under the vehicle, the vehicle did not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// Step beyond dead reckoning, east, north, up [m].
    pub step_m: [f64; 3],
}

/// Watches the inputs over time.
#[derive(Clone, Debug)]
pub struct Guard {
    config: GuardConfig,
    last: Option<Odometry>,
    changed_at_ns: u64,
    /// Of the last usable scan; of the first odometry as long as none has come.
    scan_at_ns: Option<u64>,
    commanded_mps: f32,
}

impl Guard {
    /// A guard that has seen nothing.
    pub fn new(config: GuardConfig) -> Self {
        Self { config, last: None, changed_at_ns: 0, scan_at_ns: None, commanded_mps: 0.0 }
    }

    /// Takes in one odometry sample and says whether the localisation jumped.
    pub fn admit_odometry(&mut self, odometry: &Odometry) -> Result<Option<Jump>, StopReason> {
        if !odometry.is_finite() {
            return Err(StopReason::NonFiniteInput);
        }
        let last = self.last.replace(*odometry);
        let repeats = last.is_some_and(|last| is_same_place(&last, odometry));
        self.scan_at_ns.get_or_insert(odometry.valid_at_ns);
        let gap_s = age_s(odometry.valid_at_ns, self.changed_at_ns);
        if !repeats || self.commanded_mps == 0.0 && !self.is_frozen(odometry.valid_at_ns) {
            self.changed_at_ns = odometry.valid_at_ns;
        }
        // After a gap nobody knows how far it drove: a step then is motion.
        Ok(last
            .filter(|_| gap_s <= self.config.odometry_age_max_s)
            .and_then(|last| self.jump(&last, odometry)))
    }

    /// Notes a scan that held usable points.
    pub fn note_scan(&mut self, valid_at_ns: u64) {
        self.scan_at_ns = Some(valid_at_ns);
    }

    /// Notes what the vehicle was told, so that standing still on purpose is not taken for frozen odometry.
    pub fn note_command(&mut self, speed_mps: f32) {
        self.commanded_mps = speed_mps;
    }

    /// Whether the vehicle may drive at this time on what was admitted.
    pub fn check(&self, now_ns: u64) -> Result<(), StopReason> {
        let odometry_at_ns = self.last.map_or(0, |last| last.valid_at_ns);
        if self.last.is_none()
            || age_s(now_ns, odometry_at_ns) > self.config.odometry_age_max_s
            || self.is_frozen(odometry_at_ns)
        {
            return Err(StopReason::StaleOdometry);
        }
        match self.scan_at_ns {
            Some(at_ns) if age_s(now_ns, at_ns) > self.config.scan_age_max_s => Err(StopReason::StaleScan),
            _ => Ok(()),
        }
    }

    fn is_frozen(&self, now_ns: u64) -> bool {
        age_s(now_ns, self.changed_at_ns) > self.config.frozen_max_s
    }

    fn jump(&self, last: &Odometry, next: &Odometry) -> Option<Jump> {
        let dt_s = age_s(next.valid_at_ns, last.valid_at_ns);
        let [forward_m, left_m] = [0, 1].map(|i| 0.5 * (last.velocity_mps[i] + next.velocity_mps[i]) * dt_s);
        let (sin, cos) = libm::sincos(0.5 * (last.attitude_rad[2] + next.attitude_rad[2]));
        let step_m = [
            next.position_m[0] - last.position_m[0] - (forward_m * cos - left_m * sin),
            next.position_m[1] - last.position_m[1] - (forward_m * sin + left_m * cos),
            next.position_m[2] - last.position_m[2],
        ];
        (libm::hypot(step_m[0], step_m[1]) > self.config.jump_min_m).then_some(Jump { step_m })
    }
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
mod tests {
    use super::*;

    const CYCLE_NS: u64 = 100_000_000;

    fn driving(cycle: u64) -> Odometry {
        // 1 m/s along x: 0.1 m per cycle.
        Odometry {
            valid_at_ns: cycle * CYCLE_NS,
            position_m: [0.1 * cycle as f64, 0.0, 0.0],
            velocity_mps: [1.0, 0.0],
            ..Odometry::default()
        }
    }

    fn guard_after(n_cycles: u64) -> Guard {
        let mut guard = Guard::new(GuardConfig::default());
        for cycle in 0..n_cycles {
            assert_eq!(guard.admit_odometry(&driving(cycle)), Ok(None));
            guard.note_scan(cycle * CYCLE_NS);
            guard.note_command(1.0);
        }
        guard
    }

    #[test]
    fn steady_driving_passes() {
        assert_eq!(guard_after(20).check(19 * CYCLE_NS), Ok(()));
    }

    #[test]
    fn non_finite_odometry_is_refused_and_not_remembered() {
        let mut guard = guard_after(5);
        let broken = Odometry { yaw_rate_radps: f64::NAN, ..driving(5) };
        assert_eq!(guard.admit_odometry(&broken), Err(StopReason::NonFiniteInput));
        assert_eq!(guard.admit_odometry(&driving(6)), Ok(None));
    }

    #[test]
    fn old_odometry_and_old_scans_stop_the_vehicle() {
        let mut guard = guard_after(5);
        assert_eq!(guard.check(4 * CYCLE_NS + 310_000_000), Err(StopReason::StaleOdometry));
        for cycle in 5..15 {
            guard.admit_odometry(&driving(cycle)).unwrap();
        }
        // The last scan came at 0.4 s, it is now 1.4 s: exactly at the limit; a cycle later it is too old.
        assert_eq!(guard.check(14 * CYCLE_NS), Ok(()));
        guard.admit_odometry(&driving(15)).unwrap();
        assert_eq!(guard.check(15 * CYCLE_NS), Err(StopReason::StaleScan));
    }

    #[test]
    fn first_scan_must_come_within_its_age_limit() {
        let mut guard = Guard::new(GuardConfig::default());
        for cycle in 3..14 {
            guard.admit_odometry(&driving(cycle)).unwrap();
            // The first odometry came at 0.3 s, at 1.3 s it is exactly the limit of 1 s ago.
            assert_eq!(guard.check(cycle * CYCLE_NS), Ok(()));
        }
        guard.admit_odometry(&driving(14)).unwrap();
        assert_eq!(guard.check(14 * CYCLE_NS), Err(StopReason::StaleScan));
        guard.note_scan(14 * CYCLE_NS);
        assert_eq!(guard.check(14 * CYCLE_NS), Ok(()));
    }

    #[test]
    fn odometry_that_repeats_while_moving_is_frozen_until_it_changes() {
        let mut guard = guard_after(5);
        for cycle in 5..11 {
            // The wheels' own sensor still counts.
            let wheel_speed_mps = 1.0 + 0.01 * cycle as f64;
            let frozen = Odometry { valid_at_ns: cycle * CYCLE_NS, wheel_speed_mps, ..driving(4) };
            guard.admit_odometry(&frozen).unwrap();
            guard.note_scan(cycle * CYCLE_NS);
        }
        // Last change at 0.4 s, now 1.0 s: 0.6 s > 0.5 s.
        assert_eq!(guard.check(10 * CYCLE_NS), Err(StopReason::StaleOdometry));
        guard.note_command(0.0);
        guard.admit_odometry(&Odometry { valid_at_ns: 11 * CYCLE_NS, ..driving(4) }).unwrap();
        assert_eq!(
            guard.check(11 * CYCLE_NS),
            Err(StopReason::StaleOdometry),
            "standing still does not thaw it"
        );
        guard.admit_odometry(&Odometry { valid_at_ns: 12 * CYCLE_NS, ..driving(5) }).unwrap();
        guard.note_scan(12 * CYCLE_NS);
        assert_eq!(guard.check(12 * CYCLE_NS), Ok(()));
    }

    #[test]
    fn repeating_odometry_at_rest_is_no_fault() {
        let mut guard = Guard::new(GuardConfig::default());
        for cycle in 0..30 {
            guard.admit_odometry(&Odometry { valid_at_ns: cycle * CYCLE_NS, ..Odometry::default() }).unwrap();
            guard.note_scan(cycle * CYCLE_NS);
        }
        assert_eq!(guard.check(29 * CYCLE_NS), Ok(()));
    }

    #[test]
    fn a_correction_of_the_localisation_is_told_from_motion() {
        let mut guard = guard_after(5);
        let mut jumped = driving(5);
        jumped.position_m[0] += 0.6;
        jumped.position_m[1] -= 0.8;
        let Ok(Some(jump)) = guard.admit_odometry(&jumped) else { panic!("a step of 1 m must be a jump") };
        assert!((jump.step_m[0] - 0.6).abs() < 1e-9 && (jump.step_m[1] + 0.8).abs() < 1e-9);
    }

    #[test]
    fn step_after_a_gap_is_motion() {
        // Told at 0.4 s that it drives with 1 m/s, then nothing; braked meanwhile, it stands 0.4 m further on.
        let mut guard = guard_after(5);
        let standing = |cycle| Odometry {
            valid_at_ns: cycle * CYCLE_NS,
            position_m: [0.8, 0.0, 0.0],
            ..Odometry::default()
        };
        assert_eq!(guard.admit_odometry(&standing(30)), Ok(None));
        // The same after a freeze.
        let mut guard = guard_after(5);
        for cycle in 5..30 {
            guard.admit_odometry(&Odometry { valid_at_ns: cycle * CYCLE_NS, ..driving(4) }).unwrap();
        }
        assert_eq!(guard.admit_odometry(&standing(30)), Ok(None));
    }
}
