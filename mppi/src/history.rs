//! The commands that were sent, as far back as delays reach.

use bicycle::Command;

/// Commands remembered: at 10 Hz more than the longest delay.
const LENGTH: usize = 64;

/// Past commands with their ages, newest first.
#[derive(Clone, Debug)]
pub(crate) struct History {
    sent: [(f64, Command); LENGTH],
    n: usize,
}

impl History {
    pub(crate) fn new() -> Self {
        Self { sent: [(0.0, Command::default()); LENGTH], n: 0 }
    }

    /// Lets time pass.
    pub(crate) fn age(&mut self, elapsed_s: f64) {
        self.sent[..self.n].iter_mut().for_each(|(age_s, _)| *age_s += elapsed_s);
    }

    /// A command is sent now.
    pub(crate) fn send(&mut self, command: Command) {
        self.sent.rotate_right(1);
        self.sent[0] = (0.0, command);
        self.n = (self.n + 1).min(LENGTH);
    }

    /// The last command.
    pub(crate) fn last(&self) -> Option<Command> {
        (self.n > 0).then(|| self.sent[0].1)
    }

    /// The command in force `age_s` ago; before the first, the first; before any, none.
    pub(crate) fn at(&self, age_s: f64) -> Option<Command> {
        let sent = &self.sent[..self.n];
        sent.iter().find(|(sent_s, _)| *sent_s >= age_s).or(sent.last()).map(|(_, command)| *command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(speed_mps: f32) -> Command {
        Command { speed_mps, steering_rad: 0.0 }
    }

    #[test]
    fn a_command_is_in_force_from_its_sending_to_the_next() {
        let mut history = History::new();
        assert_eq!(history.at(0.0), None);
        for speed_mps in [1.0, 2.0, 3.0] {
            history.send(command(speed_mps));
            history.age(0.1);
        }
        // Sent 0.3, 0.2 and 0.1 s ago: what was in force 0.15 s ago was sent 0.2 s ago.
        assert_eq!(history.at(0.05), Some(command(3.0)));
        assert_eq!(history.at(0.15), Some(command(2.0)));
        assert_eq!(history.at(0.25), Some(command(1.0)));
        assert_eq!(history.at(9.0), Some(command(1.0)));
        assert_eq!(history.last(), Some(command(3.0)));
    }
}
