//! Whether the inertial measurement unit feels gravity from where the odometry says that is, and the turns that it says.

use bus::message::{ImuRecord, Stamp};

use super::motion::{Motion, judged};
use super::regularity::Regularity;
use super::{Finding, Verdict};

/// Standard gravity [m/s2].
const GRAVITY_MPS2: f64 = 9.806_65;
/// Share of gravity by which the mean force may be off: what a vehicle accelerates by meanwhile.
const GRAVITY_SHARE: f64 = 0.05;
/// Angle of gravity from where the odometry has it that may be a drive's, and what is another axis [rad].
const FINE_RAD: f64 = 0.1;
const BEARABLE_RAD: f64 = 0.5;
const AXES: [&str; 3] = ["forward", "left", "up"];

/// What was felt, added up.
#[derive(Debug, Default)]
pub(super) struct Inertial {
    times: Regularity,
    force_mps2: [f64; 3],
    yaw_rate_radps: f64,
    n_samples: f64,
}

impl Inertial {
    pub fn note(&mut self, stamp: &Stamp, samples: &[ImuRecord]) {
        for sample in samples {
            self.times.note(&Stamp { valid_at_ns: sample.valid_at_ns, ..*stamp });
            for (sum, force) in self.force_mps2.iter_mut().zip(sample.acceleration_mps2) {
                *sum += f64::from(force);
            }
            self.yaw_rate_radps += f64::from(sample.angular_rate_radps[2]);
            self.n_samples += 1.0;
        }
    }

    /// Nothing where there is no such unit: few need one.
    pub fn findings(&self, motion: &Motion, watched_s: f64) -> Vec<Finding> {
        if self.n_samples == 0.0 {
            return Vec::new();
        }
        let gravity = motion.up().map(|up| self.gravity(up));
        let turns = motion.yaw_rate_radps().map(|yaw_rate_radps| self.turns(yaw_rate_radps));
        [Some(self.times.finding("imu", None, watched_s)), gravity, turns].into_iter().flatten().collect()
    }

    /// At rest a unit feels gravity upwards, and on the mean of a drive little else.
    fn gravity(&self, up: [f64; 3]) -> Finding {
        let what = "imu: gravity";
        let mean_mps2 = self.force_mps2.map(|sum| sum / self.n_samples);
        let [x, y, z] = mean_mps2;
        let force_mps2 = (x * x + y * y + z * z).sqrt();
        let found = format!("{force_mps2:.2} m/s2, along ({x:.2}, {y:.2}, {z:.2}) forward, left, up");
        if (force_mps2 / GRAVITY_MPS2 - 1.0).abs() > 4.0 * GRAVITY_SHARE {
            let found =
                format!("{found}; expected {GRAVITY_MPS2:.2}: in units of gravity, or without gravity?");
            return Finding::new(what, Verdict::Wrong, found);
        }
        let cosine: f64 = mean_mps2.iter().zip(up).map(|(force, up)| force / force_mps2 * up).sum();
        let angle_rad = libm::acos(cosine.clamp(-1.0, 1.0));
        let found = format!("{found}, {:.1} degrees from where the odometry has it", angle_rad.to_degrees());
        if angle_rad > BEARABLE_RAD {
            let found = format!("{found}; its axes are others: {} feels it", strongest(mean_mps2));
            return Finding::new(what, Verdict::Wrong, found);
        }
        if angle_rad > FINE_RAD || (force_mps2 / GRAVITY_MPS2 - 1.0).abs() > GRAVITY_SHARE {
            let found =
                format!("{found}; it sits askew, the odometry leaves roll and pitch out, or it drove off");
            return Finding::new(what, Verdict::Doubtful, found);
        }
        Finding::new(what, Verdict::Fine, found)
    }

    fn turns(&self, yaw_rate_radps: f64) -> Finding {
        let felt_radps = self.yaw_rate_radps / self.n_samples;
        let share = (felt_radps - yaw_rate_radps).abs() / felt_radps.abs().max(yaw_rate_radps.abs());
        let found =
            format!("{felt_radps:.3} rad/s on the mean, {yaw_rate_radps:.3} rad/s by the odometry's yaw");
        judged("imu: yaw rate", share, found, "degrees, or an axis that points down, look like this")
    }
}

/// The axis along which the most is felt, with its direction.
fn strongest(force_mps2: [f64; 3]) -> String {
    let axis = (0..3).max_by(|&a, &b| force_mps2[a].abs().total_cmp(&force_mps2[b].abs())).unwrap_or(2);
    let direction = if force_mps2[axis] < 0.0 { "the opposite of " } else { "" };
    format!("{direction}{}", AXES[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::message::OdometryRecord;

    /// Two seconds at rest, nose up by 0.2 rad, or in a turn of 0.3 rad/s, felt as `force` and `rate`.
    fn felt(turn_radps: f64, force_mps2: [f32; 3], rate_radps: f32) -> Vec<Finding> {
        let (mut motion, mut inertial) = (Motion::default(), Inertial::default());
        for k in 1..=100_u64 {
            let valid_at_ns = k * 20_000_000;
            let yaw_rad = turn_radps * 0.02 * k as f64;
            let record = OdometryRecord { attitude_rad: [0.0, -0.2, yaw_rad], ..OdometryRecord::default() };
            motion.note(valid_at_ns, &record);
            let stamp = Stamp { valid_at_ns, published_at_ns: valid_at_ns, ..Stamp::default() };
            let angular_rate_radps = [0.0, 0.0, rate_radps];
            inertial.note(
                &stamp,
                &[ImuRecord { valid_at_ns, acceleration_mps2: force_mps2, angular_rate_radps }],
            );
        }
        inertial.findings(&motion, 2.0)
    }

    /// Nose up by 0.2 rad, forward feels 9.81 sin(0.2) = 1.95 and up 9.81 cos(0.2) = 9.61.
    const NOSE_UP_MPS2: [f32; 3] = [1.948, 0.0, 9.611];

    #[test]
    fn gravity_is_where_the_odometry_leans() {
        let findings = felt(0.0, NOSE_UP_MPS2, 0.0);
        assert_eq!(
            findings.iter().map(|finding| finding.verdict).collect::<Vec<_>>(),
            [Verdict::Fine; 2],
            "{findings:?}"
        );
        assert!(findings[1].found.contains("0.0 degrees from"), "{findings:?}");
        // A unit that is told to lean the other way is 0.4 rad off.
        assert_eq!(felt(0.0, [-1.948, 0.0, 9.611], 0.0)[1].verdict, Verdict::Doubtful);
    }

    #[test]
    fn other_axes_and_units_are_found_out() {
        let along_left = &felt(0.0, [1.948, 9.611, 0.0], 0.0)[1];
        assert_eq!(along_left.verdict, Verdict::Wrong);
        assert!(along_left.found.ends_with("its axes are others: left feels it"), "{along_left:?}");
        assert!(felt(0.0, [1.948, 0.0, -9.611], 0.0)[1].found.ends_with("the opposite of up feels it"));
        let in_g = &felt(0.0, [0.199, 0.0, 0.980], 0.0)[1];
        assert!(in_g.verdict == Verdict::Wrong && in_g.found.contains("units of gravity"), "{in_g:?}");
    }

    #[test]
    fn turns_are_those_of_the_odometry() {
        assert_eq!(felt(0.3, NOSE_UP_MPS2, 0.3)[2].verdict, Verdict::Fine);
        assert_eq!(felt(0.3, NOSE_UP_MPS2, -0.3)[2].verdict, Verdict::Wrong);
        assert_eq!(felt(0.3, NOSE_UP_MPS2, 17.2)[2].verdict, Verdict::Wrong, "degrees a second");
        assert_eq!(felt(0.0, NOSE_UP_MPS2, 0.0).len(), 2, "who does not turn tells nothing");
    }

    #[test]
    fn who_has_none_is_not_asked() {
        assert!(Inertial::default().findings(&Motion::default(), 2.0).is_empty());
    }
}
