//! How often a topic speaks, beside what the robot file states.

use std::collections::VecDeque;

use bus::clock::SECOND_NS;

/// Messages by whose stamps a rate is told: a burst of fewer is what a network or a busy robot makes.
const N_LATELY: usize = 32;
/// Times the stated rate above which the rest is left out.
const MOST: u64 = 3;

/// More than the file states: what maps and plans would have to keep up with, and ages are not made for.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "rate: expected at most {most_hz:.1} Hz, {MOST} times what the robot file states, found {found_hz:.1} Hz; what is \
     more than stated is left out"
)]
pub struct TooOften {
    /// What would do [Hz].
    pub most_hz: f64,
    /// What came lately [Hz].
    pub found_hz: f64,
}

/// Keeps a topic to the rate that is stated, where it speaks much more often.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    period_ns: u64,
    lately_ns: VecDeque<u64>,
    kept_at_ns: u64,
}

impl Pace {
    /// Of a topic that is stated to speak once in `period_ns`.
    pub fn new(period_ns: u64) -> Self {
        Self { period_ns, lately_ns: VecDeque::with_capacity(N_LATELY), kept_at_ns: 0 }
    }

    /// Whether a message of this time is taken [ns].
    pub fn check(&mut self, at_ns: u64) -> Result<(), TooOften> {
        if self.lately_ns.back().is_some_and(|last_ns| at_ns < *last_ns) {
            // Of a clock that went back: what came before says nothing of how often it speaks now.
            self.lately_ns.clear();
        }
        if self.lately_ns.len() == N_LATELY {
            self.lately_ns.pop_front();
        }
        self.lately_ns.push_back(at_ns);
        let span_ns = self.lately_ns.front().map_or(0, |first_ns| at_ns - first_ns);
        let n_periods = self.lately_ns.len() as u64 - 1;
        let is_full = self.lately_ns.len() == N_LATELY;
        let is_often = is_full && MOST * span_ns < n_periods * self.period_ns;
        if is_often && at_ns < self.kept_at_ns + self.period_ns {
            let hz = |n: u64, span_ns: u64| (n * SECOND_NS) as f64 / span_ns.max(1) as f64;
            return Err(TooOften { most_hz: hz(MOST, self.period_ns), found_hz: hz(n_periods, span_ns) });
        }
        self.kept_at_ns = at_ns;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 20_000_000;

    /// Messages taken of 1000 that come once in `period_ns`, and the last refusal.
    fn taken(period_ns: u64) -> (usize, Option<TooOften>) {
        let mut pace = Pace::new(PERIOD_NS);
        let told: Vec<_> = (1..=1000).map(|k| pace.check(k * period_ns)).collect();
        let refusal = told.iter().rev().find_map(|told| told.err());
        (told.iter().filter(|told| told.is_ok()).count(), refusal)
    }

    #[test]
    fn up_to_three_times_the_stated_rate_everything_is_taken() {
        for period_ns in [PERIOD_NS, 2 * PERIOD_NS, PERIOD_NS / 2, PERIOD_NS.div_ceil(3)] {
            assert_eq!(taken(period_ns), (1000, None), "{period_ns}");
        }
    }

    /// Of ten times the stated rate the first 31 are taken before anybody knows it, and then one in ten of 969.
    #[test]
    fn of_ten_times_the_stated_rate_one_in_ten_is_taken() {
        let (n, refusal) = taken(PERIOD_NS / 10);
        assert!((31 + 96..=31 + 98).contains(&n), "{n}");
        let told = refusal.unwrap().to_string();
        assert!(
            told.starts_with(
                "rate: expected at most 150.0 Hz, 3 times what the robot file states, found 500.0 Hz"
            ),
            "{told}"
        );
    }

    #[test]
    fn a_burst_is_taken_whole_and_a_clock_that_stands_still_is_none() {
        let mut pace = Pace::new(PERIOD_NS);
        let regular = (1..=100).map(|k| k * PERIOD_NS);
        let burst = (1..N_LATELY as u64 / 2).map(|k| 100 * PERIOD_NS + 1000 * k);
        assert!(regular.chain(burst).all(|at_ns| pace.check(at_ns).is_ok()));
        let mut pace = Pace::new(PERIOD_NS);
        let n = (0..1000).filter(|_| pace.check(PERIOD_NS).is_ok()).count();
        assert_eq!(n, N_LATELY - 1);
    }

    #[test]
    fn a_clock_that_goes_back_is_heard_at_once() {
        let mut pace = Pace::new(PERIOD_NS);
        let before = (100..200).map(|k| k * PERIOD_NS);
        let after = (50..150).map(|k| k * PERIOD_NS);
        assert!(before.chain(after).all(|at_ns| pace.check(at_ns).is_ok()));
    }
}
