//! The pieces that a manoeuvre is made of: steps and sines of steering, circles, turns, steps of speed, each within
//! what the vehicle was seen to do in nominal drives.

use crate::drive::STEP_S;
use bicycle::Command;
use std::f64::consts::{PI, TAU};

/// Speeds of the pieces, in shares of the fastest.
const SPEEDS: [f64; 3] = [0.35, 0.65, 1.0];
/// A small angle, in shares of the largest at that speed.
const SMALL: f64 = 0.25;
/// Frequencies of the sines [Hz].
const FREQUENCIES_HZ: [f64; 3] = [0.4, 0.8, 1.6];
/// Length of a sine [s]; a whole number of periods of each frequency.
const SINE_S: f64 = 5.0;
/// The longest turn [s].
const TURN_S_MAX: f64 = 5.0;

/// Commands with a meaning.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    /// In plain words, with its sizes.
    pub(super) meaning: String,
    /// One command per [`STEP_S`].
    pub(super) commands: Vec<Command>,
}

/// What may be commanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Envelope {
    pub(super) wheelbase_m: f64,
    pub(super) speed_max_mps: f64,
    pub(super) steering_max_rad: f64,
    pub(super) lateral_acceleration_max_mps2: f64,
}

impl Envelope {
    /// The largest angle that may be commanded at a speed: the one that was commanded before, and v^2 tan(angle) / L within the lateral
    /// acceleration.
    pub(super) fn steering_at(&self, speed_mps: f64) -> f64 {
        let tangent = self.lateral_acceleration_max_mps2 * self.wheelbase_m / (speed_mps * speed_mps);
        tangent.atan().min(self.steering_max_rad)
    }

    /// All pieces.
    pub(super) fn family(&self) -> Vec<Piece> {
        let mut family: Vec<Piece> =
            SPEEDS.iter().flat_map(|share| self.at_one_speed(share * self.speed_max_mps)).collect();
        family.extend(self.speed_steps());
        family
    }

    fn at_one_speed(&self, speed: f64) -> Vec<Piece> {
        let wide = self.steering_at(speed);
        // The same angle at every speed tells what grows with speed from what does not.
        let shared = self.steering_at(self.speed_max_mps);
        let mut angles = vec![SMALL * wide, shared, wide];
        angles.dedup_by(|a, b| (*a - *b).abs() < 0.15 * wide);
        let mut pieces = vec![straight(speed), self.turn_back(speed, wide)];
        for &angle in &angles {
            pieces.extend([steps(speed, angle), circles(speed, angle)]);
        }
        let sines = FREQUENCIES_HZ
            .iter()
            .flat_map(|&frequency| [SMALL * wide, wide].map(|angle| sine(speed, angle, frequency)));
        pieces.extend(sines);
        pieces
    }

    fn turn_back(&self, speed: f64, angle: f64) -> Piece {
        let turn_s = (PI * self.wheelbase_m / (speed * angle.tan())).min(TURN_S_MAX);
        Piece {
            meaning: format!("straight on, a turn of {angle:.2} rad and straight on at {speed:.1} m/s"),
            commands: held(&[(1.5, speed, 0.0), (turn_s, speed, angle), (1.5, speed, 0.0)]),
        }
    }

    fn speed_steps(&self) -> Vec<Piece> {
        let [slow, middle, fast] = SPEEDS.map(|share| share * self.speed_max_mps);
        let step = |from: f64, to: f64| Piece {
            meaning: format!("speed from {from:.1} to {to:.1} m/s and back"),
            commands: held(&[(0.5, from, 0.0), (2.5, to, 0.0), (2.0, from, 0.0)]),
        };
        let creep = [0.04, 0.08, 0.16].map(|share| (1.2, share * self.speed_max_mps, 0.0));
        vec![
            step(slow, fast),
            step(slow, middle),
            step(middle, fast),
            step(middle, 1.15 * middle),
            step(middle, 0.0),
            Piece { meaning: format!("creeping at up to {:.2} m/s", creep[2].1), commands: held(&creep) },
        ]
    }
}

fn straight(speed: f64) -> Piece {
    Piece { meaning: format!("straight on at {speed:.1} m/s"), commands: held(&[(3.0, speed, 0.0)]) }
}

fn steps(speed: f64, angle: f64) -> Piece {
    Piece {
        meaning: format!("steps of steering of {angle:.2} rad at {speed:.1} m/s"),
        commands: held(&[(1.2, speed, angle), (1.2, speed, -angle), (0.8, speed, angle), (0.8, speed, 0.0)]),
    }
}

fn circles(speed: f64, angle: f64) -> Piece {
    Piece {
        meaning: format!("curves of {angle:.2} rad to both sides at {speed:.1} m/s"),
        commands: held(&[(2.5, speed, angle), (2.5, speed, -angle)]),
    }
}

fn sine(speed: f64, angle: f64, frequency_hz: f64) -> Piece {
    let n = (SINE_S / STEP_S).round() as usize;
    let at = |row: usize| command(speed, angle * (TAU * frequency_hz * row as f64 * STEP_S).sin());
    Piece {
        meaning: format!("sine of steering of {angle:.2} rad and {frequency_hz:.1} Hz at {speed:.1} m/s"),
        commands: (0..n).map(at).collect(),
    }
}

/// Durations [s], speeds [m/s] and angles [rad], one after the other.
pub(crate) fn held(parts: &[(f64, f64, f64)]) -> Vec<Command> {
    let rows = parts.iter().flat_map(|&(duration_s, speed, angle)| {
        std::iter::repeat_n(command(speed, angle), (duration_s / STEP_S).round() as usize)
    });
    rows.collect()
}

fn command(speed: f64, angle: f64) -> Command {
    Command { speed_mps: speed as f32, steering_rad: angle as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENVELOPE: Envelope = Envelope {
        wheelbase_m: 2.0,
        speed_max_mps: 4.0,
        steering_max_rad: 0.5,
        lateral_acceleration_max_mps2: 2.0,
    };

    #[test]
    fn every_command_keeps_to_what_the_vehicle_may_do() {
        for piece in ENVELOPE.family() {
            for command in &piece.commands {
                let (speed, angle) = (f64::from(command.speed_mps), f64::from(command.steering_rad));
                let lateral = speed * speed * angle.tan().abs() / ENVELOPE.wheelbase_m;
                assert!(
                    (0.0..=4.0 + 1e-6).contains(&speed) && angle.abs() <= 0.5 + 1e-6,
                    "{}",
                    piece.meaning
                );
                assert!(lateral <= 2.0 + 1e-5, "{}: {lateral}", piece.meaning);
            }
        }
    }

    /// tan(angle) = a L / v^2 = 2 x 2 / 16.
    #[test]
    fn the_angle_at_speed_is_that_of_the_lateral_acceleration() {
        assert!((ENVELOPE.steering_at(4.0) - 0.25_f64.atan()).abs() < 1e-12);
        assert_eq!(ENVELOPE.steering_at(1.0), 0.5);
    }
}
