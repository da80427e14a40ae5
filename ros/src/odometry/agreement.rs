//! Whether a velocity is that of the positions it comes with, in the frame that it should be of.

use bus::message::OdometryRecord;

/// Way over which the two are compared [m].
const WAY_M: f64 = 1.0;
/// Share of it that both must make: wheels that spin on the spot say nothing of frames.
const SHARE_MIN: f64 = 0.5;
/// Share that only one step may make: beyond, the localisation has jumped.
const JUMP_M: f64 = 1.0;
/// Angle between the two from which on the velocity is of another frame [rad]; side slip stays below.
const ANGLE_MAX_RAD: f64 = 0.6;
/// Longest time from one message to the next over which a velocity is believed to go on [s].
const GAP_MAX_S: f64 = 0.5;

/// Velocity and displacement lead different ways.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "twist: expected the velocity in the child frame, found one that leads {angle_deg:.0} degrees beside the way that the \
     poses make; is it of the frame of the poses?"
)]
pub struct Disagreement {
    /// Angle between the two ways [degrees].
    pub angle_deg: f64,
}

/// Compares where velocities lead with where positions do, metre by metre.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    last: Option<(u64, OdometryRecord)>,
    /// By velocities [m].
    led_m: [f64; 2],
    /// By positions [m].
    gone_m: [f64; 2],
    way_m: f64,
    found: Option<Disagreement>,
}

impl Agreement {
    /// Takes over the next odometry, measured at `at_ns` [ns].
    ///
    /// # Errors
    /// The last metre led another way by velocities than by positions; said until one agrees again.
    pub fn check(&mut self, record: &OdometryRecord, at_ns: u64) -> Result<(), Disagreement> {
        if let Some((before_ns, before)) = self.last.replace((at_ns, *record)) {
            self.go_on(&before, record, at_ns.saturating_sub(before_ns) as f64 * 1e-9);
        }
        self.found.map_or(Ok(()), Err)
    }

    fn go_on(&mut self, before: &OdometryRecord, record: &OdometryRecord, step_s: f64) {
        let gone_m = [0, 1].map(|axis| record.position_m[axis] - before.position_m[axis]);
        if step_s > GAP_MAX_S || length(gone_m) > JUMP_M {
            return self.begin_again();
        }
        let velocity_mps = [0, 1].map(|axis| 0.5 * (before.velocity_mps[axis] + record.velocity_mps[axis]));
        // Half of the turn is behind it.
        let (sine, cosine) = (before.attitude_rad[2] + 0.5 * step_s * before.yaw_rate_radps).sin_cos();
        let [forward_m, left_m] = velocity_mps.map(|speed_mps| step_s * speed_mps);
        let led_m = [cosine * forward_m - sine * left_m, sine * forward_m + cosine * left_m];
        for axis in [0, 1] {
            self.led_m[axis] += led_m[axis];
            self.gone_m[axis] += gone_m[axis];
        }
        self.way_m += length(led_m);
        if self.way_m >= WAY_M {
            self.judge();
        }
    }

    fn judge(&mut self) {
        let (led_m, gone_m) = (self.led_m, self.gone_m);
        self.begin_again();
        if length(led_m).min(length(gone_m)) < SHARE_MIN * WAY_M {
            return;
        }
        let along = led_m[0] * gone_m[0] + led_m[1] * gone_m[1];
        let across = led_m[0] * gone_m[1] - led_m[1] * gone_m[0];
        let angle_rad = across.atan2(along).abs();
        let is_beside = angle_rad > ANGLE_MAX_RAD;
        self.found = is_beside.then_some(Disagreement { angle_deg: angle_rad.to_degrees() });
    }

    fn begin_again(&mut self) {
        *self = Self { last: self.last, found: self.found, ..Self::default() };
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: u64 = 20_000_000;

    /// Drives around a circle of 4 m to the left at 2 m/s, and says what `spoil` makes of it.
    fn driven(spoil: impl Fn(usize, &mut OdometryRecord)) -> Vec<Result<(), Disagreement>> {
        let mut agreement = Agreement::default();
        let record = |step: usize| {
            let yaw_rad = 0.5 * step as f64 * STEP_NS as f64 * 1e-9;
            let mut record = OdometryRecord {
                position_m: [4.0 * yaw_rad.sin(), -4.0 * yaw_rad.cos(), 0.0],
                attitude_rad: [0.0, 0.0, yaw_rad],
                velocity_mps: [2.0, 0.0],
                yaw_rate_radps: 0.5,
                ..OdometryRecord::default()
            };
            spoil(step, &mut record);
            record
        };
        (0..600).map(|step| agreement.check(&record(step), step as u64 * STEP_NS)).collect()
    }

    #[test]
    fn a_velocity_of_the_body_agrees_all_around_a_circle() {
        assert!(driven(|_, _| ()).iter().all(Result::is_ok));
        let slips = |_: usize, record: &mut OdometryRecord| {
            record.velocity_mps = [2.0 * 0.3_f64.cos(), 2.0 * 0.3_f64.sin()];
        };
        assert!(driven(slips).iter().all(Result::is_ok));
    }

    #[test]
    fn a_velocity_of_the_map_disagrees_once_the_vehicle_has_turned_and_agrees_after_a_whole_turn() {
        let told = driven(|_, record| {
            let yaw_rad = record.attitude_rad[2];
            record.velocity_mps = [2.0 * yaw_rad.cos(), 2.0 * yaw_rad.sin()];
        });
        let first = told.iter().position(Result::is_err).unwrap();
        // It leads beside the way by the yaw, which passes 0.6 rad after 1.2 s: within the metre of then.
        assert!((60..=110).contains(&first), "{first}");
        assert!(
            told[first].unwrap_err().to_string().starts_with("twist: expected the velocity in the child")
        );
        // At a yaw of 2 pi, after 12.6 s, the two frames are one; the last metre before 12 s is 0.3 rad from it.
        assert!(told[300].is_err() && told[599].is_ok());
    }

    #[test]
    fn wheels_that_spin_on_the_spot_are_of_no_other_frame() {
        assert!(driven(|_, record| record.position_m = [0.0; 3]).iter().all(Result::is_ok));
    }

    #[test]
    fn a_localisation_that_jumps_is_somebody_elses_concern() {
        let jumps = |step: usize, record: &mut OdometryRecord| {
            record.position_m[0] += if step >= 300 { 40.0 } else { 0.0 };
        };
        assert!(driven(jumps).iter().all(Result::is_ok));
    }
}
