//! The last word before the actuators: a command counts for so long, and then the vehicle stops.

use bicycle::{Decision, HoldReason, Limits, StopReason};

/// Keeps the last command and knows when it is too old.
#[derive(Clone, Debug)]
pub struct Watchdog {
    limits: Limits,
    age_max_ns: u64,
    last: Option<(Decision, u64)>,
    n_refused: u64,
}

impl Watchdog {
    /// A watchdog of a vehicle, for commands of up to that age.
    pub fn new(limits: Limits, age_max_ns: u64) -> Self {
        Self { limits, age_max_ns, last: None, n_refused: 0 }
    }

    /// Takes over a decision that was sent at this time; one that the vehicle cannot carry out counts as none.
    pub fn admit(&mut self, decision: Decision, sent_at_ns: u64) {
        if self.is_possible(&decision) {
            self.last = Some((decision, sent_at_ns));
        } else {
            self.n_refused += 1;
        }
    }

    /// What the vehicle is to do now.
    pub fn decision(&self, now_ns: u64) -> Decision {
        match self.last {
            None => Decision::Hold(HoldReason::NoMap),
            Some((_, at_ns)) if now_ns.saturating_sub(at_ns) > self.age_max_ns => {
                Decision::Stop(StopReason::StaleCommand)
            }
            Some((decision, _)) => decision,
        }
    }

    /// Age of the last command [ns]; `None` before the first.
    pub fn age_ns(&self, now_ns: u64) -> Option<u64> {
        self.last.map(|(_, at_ns)| now_ns.saturating_sub(at_ns))
    }

    /// Commands that the vehicle could not have carried out.
    pub fn n_refused(&self) -> u64 {
        self.n_refused
    }

    fn is_possible(&self, decision: &Decision) -> bool {
        let Decision::Drive(command) = decision else { return true };
        let (speed_mps, steering_rad) = (f64::from(command.speed_mps), f64::from(command.steering_rad));
        // Single precision may round a command at the limit just beyond it; what is no number is never within.
        let slack = 1.0 + 1e-6;
        speed_mps <= slack * self.limits.speed_max_mps
            && speed_mps >= -slack * self.limits.reverse_speed_max_mps
            && steering_rad.abs() <= slack * self.limits.steering_max_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::Command;

    const AGE_MAX_NS: u64 = 300;

    fn watchdog() -> Watchdog {
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
        Watchdog::new(limits, AGE_MAX_NS)
    }

    fn drive(speed_mps: f32, steering_rad: f32) -> Decision {
        Decision::Drive(Command { speed_mps, steering_rad })
    }

    #[test]
    fn a_command_counts_for_its_time_and_then_the_vehicle_stops() {
        let mut watchdog = watchdog();
        assert_eq!(watchdog.decision(9), Decision::Hold(HoldReason::NoMap));
        watchdog.admit(drive(1.0, 0.1), 1000);
        assert_eq!(watchdog.decision(1000 + AGE_MAX_NS), drive(1.0, 0.1));
        assert_eq!(watchdog.decision(1001 + AGE_MAX_NS), Decision::Stop(StopReason::StaleCommand));
        watchdog.admit(drive(0.5, 0.0), 2000);
        assert_eq!(watchdog.decision(2001), drive(0.5, 0.0), "a new command drives on");
    }

    #[test]
    fn what_the_vehicle_cannot_do_keeps_nothing_alive() {
        let mut watchdog = watchdog();
        watchdog.admit(drive(2.0, -0.4), 1000);
        for wild in [drive(2.1, 0.0), drive(-0.6, 0.0), drive(1.0, 0.5), drive(f32::NAN, 0.0)] {
            watchdog.admit(wild, 1200);
        }
        assert_eq!((watchdog.n_refused(), watchdog.decision(1200)), (4, drive(2.0, -0.4)));
        assert_eq!(watchdog.decision(1301), Decision::Stop(StopReason::StaleCommand));
    }
}
