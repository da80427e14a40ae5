//! Commands on their way to the actuators: transport delay, and a link that may be lost.

use bicycle::{Command, Servo};

use crate::Deviation;

/// Commands of one actuator on their way.
#[derive(Clone, Debug)]
struct DelayQueue {
    waiting: Vec<f32>,
    next: usize,
}

impl DelayQueue {
    fn new(delay_s: f64, step_s: f64) -> Self {
        let n_steps = (delay_s / step_s).round() as usize;
        Self { waiting: vec![0.0; n_steps + 1], next: 0 }
    }

    /// Puts in this step's command and takes out the one that arrives.
    fn pass(&mut self, command: f32) -> f32 {
        self.waiting[self.next] = command;
        self.next = (self.next + 1) % self.waiting.len();
        self.waiting[self.next]
    }
}

/// A link that is lost at the end of every period.
#[derive(Clone, Copy, Debug)]
struct Outage {
    period_steps: u64,
    connected_steps: u64,
}

/// What stands between those who command and the actuators.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    steering: DelayQueue,
    speed: DelayQueue,
    outages: Vec<Outage>,
    n_steps: u64,
    held: Command,
}

impl Receiver {
    pub(crate) fn new(servo: &Servo, deviations: &[Deviation], step_s: f64) -> Self {
        let [mut steering_s, mut speed_s] = [servo.delay_s; 2];
        let mut outages = Vec::new();
        for deviation in deviations {
            match *deviation {
                Deviation::SteeringDelay { added_s } => steering_s += added_s,
                Deviation::MotorDelay { added_s } => speed_s += added_s,
                Deviation::CommandDropOut { period_s, length_s } => {
                    let period_steps = (period_s / step_s).round().max(1.0) as u64;
                    let lost_steps = (length_s / step_s).round() as u64;
                    outages.push(Outage { period_steps, connected_steps: period_steps - lost_steps });
                }
                _ => {}
            }
        }
        let [steering, speed] = [steering_s, speed_s].map(|delay_s| DelayQueue::new(delay_s, step_s));
        Self { steering, speed, outages, n_steps: 0, held: Command::default() }
    }

    /// Puts in this step's command and takes out what the actuators get.
    pub(crate) fn pass(&mut self, command: Command) -> Command {
        let is_lost = |outage: &Outage| self.n_steps % outage.period_steps >= outage.connected_steps;
        if !self.outages.iter().any(is_lost) {
            self.held = command;
        }
        self.n_steps += 1;
        Command {
            speed_mps: self.speed.pass(self.held.speed_mps),
            steering_rad: self.steering.pass(self.held.steering_rad),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrivals(deviations: &[Deviation], n_steps: usize) -> Vec<Command> {
        let servo = Servo { response_s: 0.0, delay_s: 0.002 };
        let mut receiver = Receiver::new(&servo, deviations, 1e-3);
        let sent = |i: usize| Command { speed_mps: i as f32, steering_rad: -(i as f32) };
        (1..=n_steps).map(|i| receiver.pass(sent(i))).collect()
    }

    #[test]
    fn commands_arrive_by_as_many_steps_later_as_the_delays_say() {
        let steering = Deviation::SteeringDelay { added_s: 0.003 };
        let speed = Deviation::MotorDelay { added_s: 0.004 };
        let found = arrivals(&[steering, speed], 20)[19];
        // The description's 2 steps and 3, or 4, of their own.
        assert_eq!((found.steering_rad, found.speed_mps), (-15.0, 14.0));
    }

    #[test]
    fn a_lost_link_holds_the_last_command() {
        let lost = Deviation::CommandDropOut { period_s: 0.010, length_s: 0.004 };
        let found: Vec<f32> = arrivals(&[lost], 22).iter().map(|command| command.speed_mps).collect();
        // Lost in steps 7 to 10 of every 10; all arrives two steps later.
        let expected = [
            0., 0., 1., 2., 3., 4., 5., 6., 6., 6., 6., 6., 11., 12., 13., 14., 15., 16., 16., 16., 16., 16.,
        ];
        assert_eq!(found, expected);
    }
}
