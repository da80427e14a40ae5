//! What the vehicle is told in the end: the bus's watchdog, and above it an emergency stop that waits for nobody.

use std::collections::BTreeSet;

use bicycle::{Applied, AppliedBy, Command, Decision, Limits, StopReason};

use bus::ages::AgeLimits;
use bus::message::{CommandRecord, OdometryRecord};
use bus::watchdog::Watchdog;

/// The last word before the robot's topics.
#[derive(Clone, Debug)]
pub struct Actuation {
    watchdog: Watchdog,
    steering_rate_max_radps: f64,
    speed_limit_mps: f32,
    halts: BTreeSet<Halt>,
    applied: Applied,
    /// Where the front wheels are by what they were told, and when [rad], [ns].
    steering: (f64, u64),
    /// When the odometry was measured that the last command was decided on [ns].
    decided_on_ns: u64,
}

/// Why the vehicle stands, whatever is commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Halt {
    /// Somebody has said so.
    Emergency,
    /// Another node of the same name commands it, too, and nobody knows which of the two it follows.
    Namesake,
}

/// What to tell the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// What was decided, by whoever had the last word.
    pub decision: Decision,
    /// Speed and steering angle.
    pub command: Command,
    /// When that was true which it was decided on; of a command to stand, now [ns].
    pub of_ns: u64,
}

impl Actuation {
    /// Nothing has been commanded yet.
    pub fn new(limits: Limits, ages: AgeLimits) -> Self {
        let watchdog = Watchdog::new(limits, ages);
        Self {
            applied: *watchdog.applied(),
            watchdog,
            steering_rate_max_radps: limits.steering_rate_max_radps,
            speed_limit_mps: f32::INFINITY,
            halts: BTreeSet::new(),
            steering: (0.0, 0),
            decided_on_ns: 0,
        }
    }

    /// Takes over a command that was sent at this time [ns].
    pub fn admit(&mut self, command: &CommandRecord, sent_at_ns: u64) {
        let n_refused = self.watchdog.n_refused();
        self.watchdog.admit(command, sent_at_ns);
        if self.watchdog.n_refused() == n_refused {
            self.decided_on_ns = command.odometry_at_ns;
        }
    }

    /// From now on the vehicle stands, whatever is commanded.
    pub fn stop(&mut self, why: Halt) {
        self.halts.insert(why);
    }

    /// From now on commands count again, unless it stands for another reason.
    pub fn release(&mut self, why: Halt) {
        self.halts.remove(&why);
    }

    /// From now on the vehicle is told no greater speed, either way [m/s]; as one that holds itself back, it says so with
    /// its odometry, and the next plan starts from there.
    pub fn limit_speed(&mut self, speed_limit_mps: f64) {
        self.speed_limit_mps = speed_limit_mps as f32;
    }

    /// What the vehicle is to be told now.
    pub fn carry_out(&mut self, now_ns: u64) -> Told {
        let mut decision = self.watchdog.carry_out(now_ns);
        let mut next = *self.watchdog.applied();
        let limit_mps = self.speed_limit_mps;
        if next.command.speed_mps.abs() > limit_mps {
            let speed_mps = next.command.speed_mps.clamp(-limit_mps, limit_mps);
            let command = Command { speed_mps, ..next.command };
            (decision, next) =
                (Decision::Drive(command), Applied { command, since_ns: now_ns, by: AppliedBy::Vehicle });
        }
        if !self.halts.is_empty() {
            decision = Decision::Stop(StopReason::EmergencyStop);
            let command = decision.command(self.applied.command);
            next = Applied { command, since_ns: now_ns, by: AppliedBy::Vehicle };
        }
        self.turn_wheels(now_ns);
        if (next.command, next.by) != (self.applied.command, self.applied.by) {
            self.applied = Applied { since_ns: now_ns, ..next };
        }
        let of_ns = if matches!(decision, Decision::Drive(_)) { self.decided_on_ns } else { now_ns };
        Told { decision, command: self.applied.command, of_ns }
    }

    /// Odometry with what the vehicle was told before it. Where the front wheels are is not measured: it is where what
    /// they were told has brought them at the vehicle's steering rate.
    pub fn complete(&mut self, record: OdometryRecord, now_ns: u64) -> OdometryRecord {
        self.turn_wheels(now_ns);
        OdometryRecord { steering_rad: self.steering.0, ..record.with_applied(&self.applied) }
    }

    /// Commands that the vehicle could not have carried out.
    pub fn n_refused(&self) -> u64 {
        self.watchdog.n_refused()
    }

    /// Age of what the last command was decided on [ns]; `None` before the first.
    pub fn age_ns(&self, now_ns: u64) -> Option<u64> {
        self.watchdog.age_ns(now_ns)
    }

    fn turn_wheels(&mut self, now_ns: u64) {
        let (angle_rad, since_ns) = self.steering;
        let reach_rad = self.steering_rate_max_radps * now_ns.saturating_sub(since_ns) as f64 * 1e-9;
        let aim_rad = f64::from(self.applied.command.steering_rad);
        self.steering = (angle_rad + (aim_rad - angle_rad).clamp(-reach_rad, reach_rad), now_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::HoldReason;

    const STEP_NS: u64 = 100_000_000;

    fn actuation() -> Actuation {
        let limits = Limits {
            speed_max_mps: 2.0,
            reverse_speed_max_mps: 0.5,
            steering_max_rad: 0.4,
            steering_rate_max_radps: 1.0,
            acceleration_max_mps2: 2.0,
            lateral_acceleration_max_mps2: 3.0,
            roll_max_rad: 0.5,
            pitch_max_rad: 0.5,
        };
        let ages = AgeLimits {
            command_ns: 3 * STEP_NS,
            scan_ns: 10 * STEP_NS,
            learned_ns: 0,
            learning_silence_ns: 0,
            mission_ns: 0,
            order_ns: 0,
        };
        Actuation::new(limits, ages)
    }

    fn drive(speed_mps: f32, steering_rad: f32, at_ns: u64) -> CommandRecord {
        let decision = Decision::Drive(Command { speed_mps, steering_rad });
        CommandRecord::from(&decision).decided_on(at_ns, at_ns)
    }

    #[test]
    fn a_command_is_told_with_the_time_that_it_was_decided_on_until_it_is_too_old() {
        let mut actuation = actuation();
        actuation.admit(&drive(1.0, 0.2, 10 * STEP_NS), 10 * STEP_NS);
        let told = actuation.carry_out(11 * STEP_NS);
        assert_eq!((told.command.speed_mps, told.of_ns), (1.0, 10 * STEP_NS));
        let told = actuation.carry_out(14 * STEP_NS);
        assert_eq!(told.decision, Decision::Stop(StopReason::StaleCommand));
        assert_eq!((told.command.speed_mps, told.command.steering_rad, told.of_ns), (0.0, 0.2, 14 * STEP_NS));
    }

    #[test]
    fn an_emergency_stop_has_the_last_word_until_it_is_released() {
        let mut actuation = actuation();
        assert_eq!(actuation.carry_out(0).decision, Decision::Hold(HoldReason::NoMap));
        actuation.stop(Halt::Emergency);
        actuation.admit(&drive(1.0, 0.2, 10 * STEP_NS), 10 * STEP_NS);
        let told = actuation.carry_out(10 * STEP_NS);
        assert_eq!(told.decision, Decision::Stop(StopReason::EmergencyStop));
        assert_eq!(told.command.speed_mps, 0.0);
        let record = actuation.complete(OdometryRecord::default(), 10 * STEP_NS);
        assert_eq!((record.applied_speed_mps, record.applied_by), (0.0, 1));
        actuation.release(Halt::Emergency);
        assert_eq!(actuation.carry_out(11 * STEP_NS).command.speed_mps, 1.0);
        assert_eq!(actuation.complete(OdometryRecord::default(), 11 * STEP_NS).applied_by, 0);
    }

    #[test]
    fn no_command_is_faster_than_the_limit_and_odometry_tells_of_it() {
        let mut actuation = actuation();
        actuation.limit_speed(0.25);
        let mut told_mps = |speed_mps: f32, step: u64| {
            actuation.admit(&drive(speed_mps, 0.2, step * STEP_NS), step * STEP_NS);
            let told = actuation.carry_out(step * STEP_NS).command;
            let record = actuation.complete(OdometryRecord::default(), step * STEP_NS);
            assert_eq!((record.applied_speed_mps, told.steering_rad), (told.speed_mps, 0.2));
            (told.speed_mps, record.applied_by)
        };
        assert_eq!(told_mps(1.0, 10), (0.25, 1));
        assert_eq!(told_mps(-0.5, 11), (-0.25, 1));
        assert_eq!(told_mps(0.125, 12), (0.125, 0));
    }

    #[test]
    fn wheels_turn_as_fast_as_they_can_to_where_they_were_told() {
        let mut actuation = actuation();
        actuation.carry_out(10 * STEP_NS);
        actuation.admit(&drive(1.0, 0.25, 10 * STEP_NS), 10 * STEP_NS);
        actuation.carry_out(10 * STEP_NS);
        let mut angle_rad = |at_ns| actuation.complete(OdometryRecord::default(), at_ns).steering_rad;
        let found = [11, 12, 13, 14].map(|step| angle_rad(step * STEP_NS));
        for (found, expected) in found.into_iter().zip([0.1, 0.2, 0.25, 0.25]) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }
}
