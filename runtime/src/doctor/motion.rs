//! Whether the odometry's positions, velocities and turns are of one frame.

use bus::clock;
use bus::message::OdometryRecord;

use super::{Finding, Verdict};

/// Way below which velocity and displacement cannot be compared [m].
const LEAST_WAY_M: f64 = 0.5;
/// Turn below which yaw rate and yaw cannot be [rad].
const LEAST_TURN_RAD: f64 = 0.2;
/// Share by which two measures of one motion may differ, and beyond which they are not of one.
const FINE_SHARE: f64 = 0.1;
const BEARABLE_SHARE: f64 = 0.3;
/// Time between two messages that is still stepped over [s].
const STEP_MAX_S: f64 = 0.5;

/// What the odometry said, added up.
#[derive(Debug, Default)]
pub(super) struct Motion {
    last: Option<(u64, OdometryRecord)>,
    /// By the positions, east and north [m].
    displacement_m: [f64; 2],
    /// By the velocities, turned into the map frame [m].
    integral_m: [f64; 2],
    /// Length of the way by the velocities [m].
    way_m: f64,
    /// By the yaw [rad].
    turn_rad: f64,
    /// By the yaw rate [rad].
    turn_integral_rad: f64,
    watched_s: f64,
    /// Sum of what points up, in the body frame.
    up: [f64; 3],
}

impl Motion {
    pub fn note(&mut self, valid_at_ns: u64, record: &OdometryRecord) {
        let [roll_rad, pitch_rad, _] = record.attitude_rad;
        // The third row of the rotation from body to map, with pitch that lowers the nose.
        let up = [
            -libm::sin(pitch_rad),
            libm::cos(pitch_rad) * libm::sin(roll_rad),
            libm::cos(pitch_rad) * libm::cos(roll_rad),
        ];
        self.up.iter_mut().zip(up).for_each(|(sum, up)| *sum += up);
        if let Some((then_ns, before)) = self.last.replace((valid_at_ns, *record)) {
            let step_s = clock::age_s(valid_at_ns, then_ns);
            if step_s > 0.0 && step_s < STEP_MAX_S {
                self.step(&before, record, step_s);
            }
        }
    }

    fn step(&mut self, before: &OdometryRecord, after: &OdometryRecord, step_s: f64) {
        let turn_rad = turned_rad(after.attitude_rad[2] - before.attitude_rad[2]);
        let (sin, cos) = libm::sincos(before.attitude_rad[2] + 0.5 * turn_rad);
        let [forward_mps, left_mps] = [0, 1].map(|k| 0.5 * (before.velocity_mps[k] + after.velocity_mps[k]));
        let velocity_mps = [cos * forward_mps - sin * left_mps, sin * forward_mps + cos * left_mps];
        for (axis, velocity_mps) in velocity_mps.into_iter().enumerate() {
            self.displacement_m[axis] += after.position_m[axis] - before.position_m[axis];
            self.integral_m[axis] += velocity_mps * step_s;
        }
        self.way_m += libm::hypot(forward_mps, left_mps) * step_s;
        self.turn_rad += turn_rad;
        self.turn_integral_rad += 0.5 * (before.yaw_rate_radps + after.yaw_rate_radps) * step_s;
        self.watched_s += step_s;
    }

    /// Mean of what points up, in the body frame: what an inertial unit at rest would feel, in units of gravity.
    pub fn up(&self) -> Option<[f64; 3]> {
        let [x, y, z] = self.up;
        let length = (x * x + y * y + z * z).sqrt();
        (length > 0.0).then(|| self.up.map(|sum| sum / length))
    }

    /// Mean yaw rate by the yaw, where it turned far enough to tell [rad/s].
    pub fn yaw_rate_radps(&self) -> Option<f64> {
        (self.turn_rad.abs() >= LEAST_TURN_RAD).then(|| self.turn_rad / self.watched_s)
    }

    pub fn findings(&self) -> Vec<Finding> {
        if self.last.is_none() {
            return Vec::new();
        }
        vec![self.velocity(), self.yaw_rate()]
    }

    fn velocity(&self) -> Finding {
        let what = "velocity";
        let by_position_m = libm::hypot(self.displacement_m[0], self.displacement_m[1]);
        if self.way_m.max(by_position_m) < LEAST_WAY_M {
            let found = format!("it stood: drive {LEAST_WAY_M} m, and velocities are held against positions");
            return Finding::new(what, Verdict::Unknown, found);
        }
        let [east_m, north_m] = [0, 1].map(|axis| self.displacement_m[axis] - self.integral_m[axis]);
        let share = libm::hypot(east_m, north_m) / self.way_m.max(by_position_m);
        let by_velocity_m = libm::hypot(self.integral_m[0], self.integral_m[1]);
        let found = format!(
            "{by_position_m:.2} m far by the positions and {by_velocity_m:.2} m by the velocities, {:.0} % of the way apart",
            100.0 * share
        );
        judged(
            what,
            share,
            found,
            "a velocity in the map's frame, of another point or in other units looks like this",
        )
    }

    fn yaw_rate(&self) -> Finding {
        let what = "yaw rate";
        let turn_rad = self.turn_rad.abs().max(self.turn_integral_rad.abs());
        if turn_rad < LEAST_TURN_RAD {
            let found = format!(
                "it kept its heading: turn by {LEAST_TURN_RAD} rad, and rates are held against the yaw"
            );
            return Finding::new(what, Verdict::Unknown, found);
        }
        let share = (self.turn_rad - self.turn_integral_rad).abs() / turn_rad;
        let found = format!(
            "turned by {:.2} rad by the yaw and by {:.2} rad by the rates",
            self.turn_rad, self.turn_integral_rad
        );
        judged(what, share, found, "degrees, or an axis that points down, look like this")
    }
}

/// By the share that two measures of the same differ by.
pub(super) fn judged(what: &str, share: f64, found: String, cause: &str) -> Finding {
    let verdict = match share {
        share if share <= FINE_SHARE => return Finding::new(what, Verdict::Fine, found),
        share if share <= BEARABLE_SHARE => Verdict::Doubtful,
        _ => Verdict::Wrong,
    };
    Finding::new(what, verdict, format!("{found}; {cause}"))
}

/// The smaller turn to the same heading [rad].
pub(super) fn turned_rad(turn_rad: f64) -> f64 {
    let full_rad = std::f64::consts::TAU;
    turn_rad - full_rad * libm::round(turn_rad / full_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle of radius 5 m at 1 m/s, 50 Hz, for 4 s, through the heading where yaw jumps from pi to -pi.
    fn circle(change: impl Fn(&mut OdometryRecord)) -> Vec<Finding> {
        let mut motion = Motion::default();
        for k in 0..=200_u64 {
            let time_s = 0.02 * k as f64;
            let yaw_rad = 3.0 + 0.2 * time_s;
            let mut record = OdometryRecord {
                position_m: [5.0 * libm::sin(yaw_rad), -5.0 * libm::cos(yaw_rad), 0.0],
                attitude_rad: [0.0, 0.0, turned_rad(yaw_rad)],
                velocity_mps: [1.0, 0.0],
                yaw_rate_radps: 0.2,
                ..OdometryRecord::default()
            };
            change(&mut record);
            motion.note(k * 20_000_000, &record);
        }
        motion.findings()
    }

    fn verdicts(findings: &[Finding]) -> [Verdict; 2] {
        [findings[0].verdict, findings[1].verdict]
    }

    #[test]
    fn velocities_and_rates_of_the_same_motion_agree() {
        let findings = circle(|_| ());
        assert_eq!(verdicts(&findings), [Verdict::Fine; 2], "{findings:?}");
        // The chord of 0.8 rad on 5 m: 2 x 5 sin(0.4) = 3.89 m.
        assert!(findings[0].found.starts_with("3.89 m far by the positions and 3.89 m"), "{findings:?}");
    }

    #[test]
    fn a_velocity_of_the_map_frame_is_found_out() {
        let findings = circle(|record| {
            let (sin, cos) = libm::sincos(record.attitude_rad[2]);
            record.velocity_mps = [cos, sin];
        });
        assert_eq!(findings[0].verdict, Verdict::Wrong, "{findings:?}");
        assert!(findings[0].found.contains("map's frame"));
    }

    #[test]
    fn other_units_and_signs_are_found_out() {
        let kmh = circle(|record| record.velocity_mps = [3.6, 0.0]);
        assert_eq!(verdicts(&kmh), [Verdict::Wrong, Verdict::Fine]);
        let down = circle(|record| record.yaw_rate_radps = -0.2);
        assert_eq!(verdicts(&down), [Verdict::Fine, Verdict::Wrong]);
    }

    #[test]
    fn who_stands_tells_nothing() {
        let stood = circle(|record| *record = OdometryRecord::default());
        assert_eq!(verdicts(&stood), [Verdict::Unknown; 2]);
        assert!(Motion::default().findings().is_empty(), "nothing was said at all");
    }
}
