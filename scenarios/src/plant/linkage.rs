//! From the servo's angle to the front wheels: play, ratio, trim and an axle that gives way.

use crate::Deviation;

/// Time in which an axle's bushings give way [s].
const BUSHING_S: f64 = 0.01;

/// What lies between servo and wheels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Linkage {
    play_rad: f64,
    /// Wheels over servo to the left and to the right [-].
    ratio: [f64; 2],
    trim_rad: f64,
    compliance_rad_per_n: f64,
    /// Behind the play [rad].
    carried_rad: f64,
    /// How far the axle has given way, out of the bend [rad].
    given_way_rad: f64,
}

impl Linkage {
    pub(crate) fn new(deviations: &[Deviation]) -> Self {
        let mut linkage = Self {
            play_rad: 0.0,
            ratio: [1.0; 2],
            trim_rad: 0.0,
            compliance_rad_per_n: 0.0,
            carried_rad: 0.0,
            given_way_rad: 0.0,
        };
        for deviation in deviations {
            match *deviation {
                Deviation::SteeringPlay { half_width_rad } => linkage.play_rad += half_width_rad,
                Deviation::SteeringRatio { left, right } => {
                    linkage.ratio = [linkage.ratio[0] * left, linkage.ratio[1] * right];
                }
                Deviation::SteeringTrim { angle_rad } => linkage.trim_rad += angle_rad,
                Deviation::SteeringCompliance { rad_per_n } => linkage.compliance_rad_per_n += rad_per_n,
                _ => {}
            }
        }
        linkage
    }

    /// Angle of the wheels [rad] for the servo's angle and the ground's lateral force on the front axle, left
    /// positive [N].
    pub(crate) fn turn(&mut self, servo_rad: f64, lateral_n: f64, step_s: f64) -> f64 {
        self.carried_rad = self.carried_rad.clamp(servo_rad - self.play_rad, servo_rad + self.play_rad);
        let [left, right] = self.ratio;
        let ratio = if self.carried_rad > 0.0 { left } else { right };
        let target_rad = self.compliance_rad_per_n * lateral_n;
        self.given_way_rad += (target_rad - self.given_way_rad) * step_s / (BUSHING_S + step_s);
        ratio * self.carried_rad + self.trim_rad - self.given_way_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(linkage: &mut Linkage, servo_rad: f64) -> f64 {
        linkage.turn(servo_rad, 0.0, 1e-3)
    }

    #[test]
    fn a_sound_linkage_turns_the_wheels_as_the_servo_turns() {
        let mut linkage = Linkage::new(&[]);
        for servo_rad in [0.3, -0.2, 0.0] {
            assert_eq!(linkage.turn(servo_rad, 500.0, 1e-3), servo_rad);
        }
    }

    #[test]
    fn wheels_wait_through_the_play_after_each_reversal() {
        let mut linkage = Linkage::new(&[Deviation::SteeringPlay { half_width_rad: 0.03 }]);
        let found = [0.02, 0.1, 0.06, 0.03, 0.0].map(|servo_rad| turned(&mut linkage, servo_rad));
        let expected: [f64; 5] = [0.0, 0.07, 0.07, 0.06, 0.03];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn a_bent_linkage_turns_by_another_ratio_to_each_side_and_trim_adds() {
        let ratio = Deviation::SteeringRatio { left: 1.2, right: 0.5 };
        let mut linkage = Linkage::new(&[ratio, Deviation::SteeringTrim { angle_rad: 0.01 }]);
        assert!((turned(&mut linkage, 0.2) - 0.25).abs() < 1e-12);
        assert!((turned(&mut linkage, -0.2) + 0.09).abs() < 1e-12);
    }

    #[test]
    fn an_axle_gives_way_out_of_the_bend() {
        let mut linkage = Linkage::new(&[Deviation::SteeringCompliance { rad_per_n: 1e-4 }]);
        for _ in 0..1000 {
            linkage.turn(0.2, 300.0, 1e-3);
        }
        // 300 N to the left, in a left bend: 0.03 rad less.
        assert!((linkage.turn(0.2, 300.0, 1e-3) - 0.17).abs() < 1e-9);
    }
}
