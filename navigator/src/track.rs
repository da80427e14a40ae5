//! Where the vehicle was of late, so that a scan can be placed by the time when it was taken.

use std::collections::VecDeque;

use bicycle::Odometry;

use crate::guard::{GuardConfig, reckoned};
use crate::jump::{Jump, turned_rad};

/// Samples that are kept at the most, however fast they come.
const SAMPLES_MAX: usize = 4096;

/// What is known of the vehicle at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Whereabouts {
    /// Between two samples, or at one.
    Between(Odometry),
    /// After the last sample: where that one leads, unless it is too far. A later sample would tell better.
    Ahead(Option<Odometry>),
    /// Before the first sample that is kept, or in a gap that is too long.
    Unknown,
}

/// The odometry of late, in the frame of the newest.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    samples: VecDeque<Odometry>,
    kept_ns: u64,
    gap_max_ns: u64,
    ahead_max_ns: u64,
}

impl Track {
    /// Keeps as much as scans may be old, in memory that is taken once.
    pub fn new(config: &GuardConfig) -> Self {
        let nanoseconds = |time_s: f64| (time_s * 1e9) as u64;
        Self {
            samples: VecDeque::with_capacity(SAMPLES_MAX),
            kept_ns: nanoseconds(config.scan_age_max_s),
            gap_max_ns: nanoseconds(config.odometry_age_max_s),
            ahead_max_ns: nanoseconds(config.extrapolation_max_s),
        }
    }

    /// Takes in a sample later than all before.
    pub fn note(&mut self, odometry: &Odometry) {
        let oldest_ns = odometry.valid_at_ns.saturating_sub(self.kept_ns);
        // One that is older stays, so that the time kept is covered.
        while self.samples.get(1).is_some_and(|next| next.valid_at_ns <= oldest_ns)
            || self.samples.len() >= SAMPLES_MAX
        {
            self.samples.pop_front();
        }
        self.samples.push_back(*odometry);
    }

    /// The frame moved: what is known of before is told in the new one.
    pub fn follow(&mut self, jump: &Jump) {
        self.samples.iter_mut().for_each(|sample| *sample = jump.odometry(sample));
    }

    /// Forgets all.
    pub fn forget(&mut self) {
        self.samples.clear();
    }

    /// Where the vehicle was at a time.
    pub fn at(&self, at_ns: u64) -> Whereabouts {
        let after = self.samples.partition_point(|sample| sample.valid_at_ns < at_ns);
        let Some(next) = self.samples.get(after) else {
            let near = self.samples.back().filter(|last| at_ns - last.valid_at_ns <= self.ahead_max_ns);
            return Whereabouts::Ahead(near.map(|last| ahead(last, at_ns)));
        };
        if next.valid_at_ns == at_ns {
            return Whereabouts::Between(*next);
        }
        let before = after.checked_sub(1).and_then(|before| self.samples.get(before));
        match before.filter(|before| next.valid_at_ns - before.valid_at_ns <= self.gap_max_ns) {
            Some(before) => Whereabouts::Between(between(before, next, at_ns)),
            None => Whereabouts::Unknown,
        }
    }
}

fn ahead(last: &Odometry, at_ns: u64) -> Odometry {
    let elapsed_s = (at_ns - last.valid_at_ns) as f64 * 1e-9;
    Odometry { valid_at_ns: at_ns, ..reckoned(last, elapsed_s) }
}

/// On the straight line between two samples; angles the short way round. Between samples so close, that is what
/// turning at a constant rate comes to.
fn between(before: &Odometry, after: &Odometry, at_ns: u64) -> Odometry {
    let [elapsed_ns, whole_ns] = [at_ns, after.valid_at_ns].map(|ns| ns - before.valid_at_ns);
    let share = elapsed_ns as f64 / whole_ns as f64;
    let mean = |a: f64, b: f64| a + share * (b - a);
    let angle = |a: f64, b: f64| a + share * turned_rad(a, b);
    let means = |a: &[f64], b: &[f64], i: usize| mean(a[i], b[i]);
    Odometry {
        valid_at_ns: at_ns,
        position_m: [0, 1, 2].map(|i| means(&before.position_m, &after.position_m, i)),
        attitude_rad: [0, 1, 2].map(|i| angle(before.attitude_rad[i], after.attitude_rad[i])),
        velocity_mps: [0, 1].map(|i| means(&before.velocity_mps, &after.velocity_mps, i)),
        yaw_rate_radps: mean(before.yaw_rate_radps, after.yaw_rate_radps),
        wheel_speed_mps: mean(before.wheel_speed_mps, after.wheel_speed_mps),
        steering_rad: mean(before.steering_rad, after.steering_rad),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use proptest::prelude::*;

    use super::*;

    const MILLISECOND_NS: u64 = 1_000_000;

    /// On a circle of 5 m, the yaw wrapped as drivers tell it.
    fn circling(at_ns: u64) -> Odometry {
        let yaw_rad = 0.4 * at_ns as f64 * 1e-9;
        Odometry {
            valid_at_ns: at_ns,
            position_m: [5.0 * yaw_rad.sin(), -5.0 * yaw_rad.cos(), 0.0],
            attitude_rad: [0.02, -0.01, PI - (PI - yaw_rad).rem_euclid(TAU)],
            velocity_mps: [2.0, 0.0],
            yaw_rate_radps: 0.4,
            ..Odometry::default()
        }
    }

    fn track(until_ms: u64, period_ms: u64) -> Track {
        let mut track = Track::new(&GuardConfig::default());
        (0..=until_ms / period_ms).for_each(|k| track.note(&circling(k * period_ms * MILLISECOND_NS)));
        track
    }

    fn assert_near(found: &Odometry, at_ns: u64, limit_m: f64) {
        let truth = circling(at_ns);
        let [dx_m, dy_m] = [0, 1].map(|i| found.position_m[i] - truth.position_m[i]);
        assert!(dx_m.hypot(dy_m) < limit_m, "{found:?}, expected {truth:?}");
        assert!(turned_rad(found.attitude_rad[2], truth.attitude_rad[2]).abs() < 1e-3, "{found:?} {truth:?}");
        assert_eq!(found.valid_at_ns, at_ns);
    }

    proptest! {
        #[test]
        fn scans_are_placed_between_samples_wherever_they_fall(
            period_ms in 10..200_u64, ago_ns in 0..900 * MILLISECOND_NS, until_ms in 7000..9000_u64,
        ) {
            // Around 7.85 s the yaw passes pi.
            let track = track(until_ms, period_ms);
            let newest_ns = until_ms / period_ms * period_ms * MILLISECOND_NS;
            let at_ns = newest_ns - ago_ns;
            let Whereabouts::Between(found) = track.at(at_ns) else { panic!("{:?}", track.at(at_ns)) };
            // Half of the arrow of an arc of 0.4 m on 5 m.
            assert_near(&found, at_ns, 5e-3);
        }
    }

    #[test]
    fn at_a_sample_its_own_bits_are_told() {
        // Numbers that what lies between them does not come back to.
        let sample = |k: u32| {
            let speed_mps = [1e3, 1e-3][k as usize % 2] / f64::from(k);
            let at_ns = u64::from(20 * k) * MILLISECOND_NS;
            Odometry { wheel_speed_mps: speed_mps, velocity_mps: [speed_mps, 0.0], ..circling(at_ns) }
        };
        let mut track = Track::new(&GuardConfig::default());
        (1..=50).for_each(|k| track.note(&sample(k)));
        for k in 5..=50 {
            assert_eq!(track.at(sample(k).valid_at_ns), Whereabouts::Between(sample(k)), "sample {k}");
        }
    }

    #[test]
    fn after_the_last_sample_it_is_reckoned_on_as_far_as_is_allowed() {
        let track = track(1000, 50);
        let at = |after_ms: u64| track.at((1000 + after_ms) * MILLISECOND_NS);
        let Whereabouts::Ahead(Some(found)) = at(100) else { panic!("{:?}", at(100)) };
        assert_near(&found, 1100 * MILLISECOND_NS, 1e-3);
        assert_eq!(at(101), Whereabouts::Ahead(None));
        assert_eq!(Track::new(&GuardConfig::default()).at(0), Whereabouts::Ahead(None));
    }

    #[test]
    fn before_the_first_sample_and_in_long_gaps_nobody_knows() {
        let mut track = track(2000, 50);
        assert_eq!(track.at(500 * MILLISECOND_NS), Whereabouts::Unknown, "longer ago than is kept");
        track.note(&circling(2301 * MILLISECOND_NS));
        assert_eq!(track.at(2100 * MILLISECOND_NS), Whereabouts::Unknown);
        assert_eq!(
            track.at(1999 * MILLISECOND_NS),
            Whereabouts::Between(between(
                &circling(1950 * MILLISECOND_NS),
                &circling(2000 * MILLISECOND_NS),
                1999 * MILLISECOND_NS
            ))
        );
        track.forget();
        assert_eq!(track.at(1999 * MILLISECOND_NS), Whereabouts::Ahead(None));
    }

    #[test]
    fn a_scan_of_before_a_jump_is_placed_in_the_frame_of_after() {
        let mut track = track(1000, 20);
        let jump = Jump { step_m: [10.0, -3.0, 0.5], yaw_rad: 2.9 };
        track.follow(&jump);
        track.note(&jump.odometry(&circling(1020 * MILLISECOND_NS)));
        for at_ns in [990, 1010].map(|at_ms| at_ms * MILLISECOND_NS) {
            let Whereabouts::Between(found) = track.at(at_ns) else { panic!("{at_ns}") };
            assert_near(&jump.inverse().odometry(&found), at_ns, 1e-3);
        }
    }

    #[test]
    fn nothing_grows_however_fast_samples_come() {
        let mut track = Track::new(&GuardConfig::default());
        (0..20_000).for_each(|k| track.note(&circling(k)));
        assert_eq!(track.samples.len(), SAMPLES_MAX);
    }
}
