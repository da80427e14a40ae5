//! What went to the vehicle and when, whoever decided it, as far back as delays reach.

use std::collections::VecDeque;

/// Past commands with the times of their sending, in memory that is taken once.
#[derive(Clone, Debug)]
pub(crate) struct Ledger<C> {
    /// Oldest first.
    sent: VecDeque<Sent<C>>,
    n_most: usize,
    /// What is sent sooner than this after another takes its place [s].
    apart_s: f64,
    now_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct Sent<C> {
    at_s: f64,
    command: C,
}

impl<C: Copy + PartialEq> Ledger<C> {
    /// Commands of the last `reach_s`, one every `period_s` or more seldom. Commands that follow each other in less than
    /// half of that count as one, the later.
    pub(crate) fn new(reach_s: f64, period_s: f64) -> Self {
        let apart_s = 0.5 * period_s;
        // The one in force before the reach begins, and the rounding of times.
        let n_most = (reach_s / apart_s).ceil() as usize + 3;
        Self { sent: VecDeque::with_capacity(n_most), n_most, apart_s, now_s: 0.0 }
    }

    pub(crate) fn clear(&mut self) {
        self.sent.clear();
        self.now_s = 0.0;
    }

    /// Lets time pass; what is no time passes as none.
    pub(crate) fn pass(&mut self, elapsed_s: f64) {
        self.now_s += if elapsed_s.is_finite() { elapsed_s.max(0.0) } else { 0.0 };
    }

    /// A command is sent now.
    pub(crate) fn send(&mut self, command: C) {
        self.put(self.now_s, command);
    }

    /// From `after_s` after now on something else went out than what was noted as sent since. Before the first command
    /// nothing is known.
    pub(crate) fn replace(&mut self, after_s: f64, command: C) {
        let at_s = self.now_s + after_s;
        while self.sent.back().is_some_and(|last| last.at_s >= at_s) {
            self.sent.pop_back();
        }
        self.change(at_s, command);
    }

    /// From `after_s` after now on this went out, unless another was sent later.
    pub(crate) fn resume(&mut self, after_s: f64, command: C) {
        let at_s = self.now_s + after_s;
        if self.sent.back().is_none_or(|last| last.at_s <= at_s) {
            self.change(at_s, command);
        }
    }

    fn change(&mut self, at_s: f64, command: C) {
        if self.last() != Some(command) {
            self.put(at_s, command);
        }
    }

    fn put(&mut self, at_s: f64, command: C) {
        if let Some(last) = self.sent.back_mut().filter(|last| at_s - last.at_s < self.apart_s) {
            last.command = command;
            return;
        }
        if self.sent.len() == self.n_most {
            self.sent.pop_front();
        }
        self.sent.push_back(Sent { at_s, command });
    }

    /// The last command.
    pub(crate) fn last(&self) -> Option<C> {
        self.sent.back().map(|sent| sent.command)
    }

    /// The command in force `age_s` ago; before the first, the first; before any, none.
    pub(crate) fn at(&self, age_s: f64) -> Option<C> {
        let n_sent = self.sent.partition_point(|sent| self.now_s - sent.at_s >= age_s);
        self.sent.get(n_sent.saturating_sub(1)).map(|sent| sent.command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::Command;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn command(speed_mps: f32) -> Command {
        Command { speed_mps, steering_rad: 0.0 }
    }

    #[test]
    fn a_command_is_in_force_from_its_sending_to_the_next() {
        let mut ledger = Ledger::new(3.0, 0.1);
        assert_eq!(ledger.at(0.0), None);
        for speed_mps in [1.0, 2.0, 3.0] {
            ledger.send(command(speed_mps));
            ledger.pass(0.1);
        }
        // Sent 0.3, 0.2 and 0.1 s ago: what was in force 0.15 s ago was sent 0.2 s ago.
        assert_eq!(ledger.at(0.05), Some(command(3.0)));
        assert_eq!(ledger.at(0.15), Some(command(2.0)));
        assert_eq!(ledger.at(0.25), Some(command(1.0)));
        assert_eq!(ledger.at(9.0), Some(command(1.0)));
        assert_eq!(ledger.last(), Some(command(3.0)));
    }

    #[test]
    fn what_went_out_instead_is_in_force_from_its_time_until_another_is_sent() {
        let mut ledger = Ledger::new(3.0, 0.02);
        let sent = |ledger: &Ledger<Command>, age_s: f64| ledger.at(age_s).map(|command| command.speed_mps);
        for speed_mps in [1.0, 2.0, 3.0] {
            ledger.pass(0.1);
            ledger.send(command(speed_mps));
        }
        // 3 was sent now, 2 before 0.1 s. It was stopped 0.05 s ago: 3 has never gone out.
        ledger.replace(-0.05, command(0.0));
        assert_eq!([0.04, 0.06, 0.16].map(|age_s| sent(&ledger, age_s)), [Some(0.0), Some(2.0), Some(1.0)]);
        // And for 0.04 s from now on something else; then what was commanded again.
        ledger.replace(0.0, command(0.5));
        ledger.resume(0.04, command(3.0));
        ledger.pass(0.1);
        let ages_s = [0.05, 0.07, 0.11, 0.16];
        assert_eq!(ages_s.map(|age_s| sent(&ledger, age_s)), [Some(3.0), Some(0.5), Some(0.0), Some(2.0)]);
        ledger.send(command(4.0));
        ledger.resume(-0.06, command(3.0));
        assert_eq!(ledger.last(), Some(command(4.0)), "another was sent later");
        // From before the first on: nothing else has ever gone out.
        ledger.replace(-9.0, command(0.0));
        assert_eq!(ages_s.map(|age_s| sent(&ledger, age_s)), [Some(0.0); 4]);
    }

    /// Against a list that forgets nothing, at rates from the fastest to one a second, without growing.
    #[test]
    fn the_reach_is_exact_at_every_rate() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        for (reach_s, period_s) in [(5.3, 0.01), (5.3, 0.001), (1.0, 0.1)] {
            for slower in [1.0, 1.7, 10.0, 100.0] {
                let mut ledger = Ledger::new(reach_s, period_s);
                let capacity = ledger.sent.capacity();
                let mut all = Vec::new();
                let mut now_s = 0.0;
                for number in 0..4 * (reach_s / period_s) as u32 {
                    ledger.send(command(number as f32));
                    all.push((now_s, command(number as f32)));
                    let elapsed_s = slower * period_s * random.random_range(1.0..1.5);
                    ledger.pass(elapsed_s);
                    now_s += elapsed_s;
                }
                for _ in 0..1000 {
                    let age_s = random.random_range(0.0..reach_s);
                    let sent = all.iter().rfind(|(at_s, _)| now_s - at_s >= age_s).unwrap_or(&all[0]);
                    assert_eq!(ledger.at(age_s), Some(sent.1), "{period_s} x {slower}, {age_s} s ago");
                }
                assert_eq!(ledger.sent.capacity(), capacity);
            }
        }
    }

    /// Commands in no time at all replace each other; in nearly none, they stay within the memory.
    #[test]
    fn commands_faster_than_the_fastest_rate_count_as_one() {
        let mut ledger = Ledger::new(1.0, 0.1);
        ledger.send(command(1.0));
        ledger.pass(0.5);
        for number in 0..65_000u16 {
            ledger.send(command(f32::from(number)));
            ledger.pass(1e-5);
        }
        assert!(ledger.sent.len() <= ledger.n_most && ledger.sent.len() <= 23);
        // 0.65 s of it: what was in force 0.3 s ago was sent after 0.35 s, give or take half a period.
        let Some(Command { speed_mps, .. }) = ledger.at(0.3) else { panic!("commands were sent") };
        assert!((speed_mps - 35_000.0).abs() <= 5_000.0, "{speed_mps}");
    }
}
