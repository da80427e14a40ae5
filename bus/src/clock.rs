//! The one clock of all processes: monotonic, in nanoseconds, the same for everybody on the machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::thread::{ClockId as SleepClock, clock_nanosleep_absolute};
use rustix::time::{ClockId, Timespec, clock_gettime};

/// Nanoseconds of a second.
pub const SECOND_NS: u64 = 1_000_000_000;

/// The time now [ns].
pub fn now_ns() -> u64 {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(ClockId::Monotonic);
    // The monotonic clock counts up from the start of the machine.
    tv_sec.unsigned_abs() * SECOND_NS + tv_nsec.unsigned_abs()
}

/// The clock that a process goes by.
#[derive(Clone, Debug, Default)]
pub enum Clock {
    /// The machine's.
    #[default]
    Monotonic,
    /// One that stands still between two steps of whoever holds it: what happens is then a matter of order alone.
    Stepped(Arc<AtomicU64>),
}

impl Clock {
    /// The time now [ns].
    pub fn now_ns(&self) -> u64 {
        match self {
            Self::Monotonic => now_ns(),
            Self::Stepped(time_ns) => time_ns.load(Ordering::Relaxed),
        }
    }
}

/// The time of day now, nanoseconds of UTC since 1970. It may be set at will: nothing is decided by it.
pub fn utc_ns() -> u64 {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(ClockId::Realtime);
    // A clock that was never set may stand before 1970.
    u64::try_from(tv_sec).unwrap_or(0) * SECOND_NS + tv_nsec.unsigned_abs()
}

/// Sleeps to a time on that clock, which may have passed; returns the time then [ns].
pub fn sleep_until(deadline_ns: u64) -> u64 {
    let tv_sec = i64::try_from(deadline_ns / SECOND_NS).unwrap_or(i64::MAX);
    let request = Timespec { tv_sec, tv_nsec: (deadline_ns % SECOND_NS) as _ };
    // A signal wakes early; the deadline is absolute, so sleeping again loses nothing.
    while now_ns() < deadline_ns {
        if clock_nanosleep_absolute(SleepClock::Monotonic, &request).is_ok() {
            break;
        }
    }
    now_ns()
}

/// A time in the past as an age [s]; 0 for one that is yet to come.
pub fn age_s(now_ns: u64, then_ns: u64) -> f64 {
    now_ns.saturating_sub(then_ns) as f64 * 1e-9
}

/// A duration in nanoseconds.
pub fn nanoseconds(duration_s: f64) -> u64 {
    (duration_s * SECOND_NS as f64).round() as u64
}

/// Absolute deadlines, one period apart.
#[derive(Clone, Copy, Debug)]
pub struct Cycle {
    deadline_ns: u64,
    period_ns: u64,
    n_missed: u64,
}

impl Cycle {
    /// The first deadline is `start_ns`.
    pub fn new(start_ns: u64, period_ns: u64) -> Self {
        Self { deadline_ns: start_ns, period_ns: period_ns.max(1), n_missed: 0 }
    }

    /// The deadline that the present cycle works towards [ns].
    pub fn deadline_ns(&self) -> u64 {
        self.deadline_ns
    }

    /// Cycles whose time passed while an earlier one was at work.
    pub fn n_missed(&self) -> u64 {
        self.n_missed
    }

    /// Works towards this deadline next, whatever the period.
    pub fn aim_at(&mut self, deadline_ns: u64) {
        self.deadline_ns = deadline_ns;
    }

    /// Goes on to the next deadline that is still to come. What lies behind is left out and counted: a cycle that
    /// comes late is worth nothing, and a burst of them less.
    pub fn advance(&mut self, now_ns: u64) {
        let behind = now_ns.saturating_sub(self.deadline_ns) / self.period_ns;
        self.n_missed += behind;
        self.deadline_ns += (behind + 1) * self.period_ns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_do_not_drift_with_the_time_that_work_takes() {
        let mut cycle = Cycle::new(1000, 100);
        for (now_ns, expected_ns) in [(1030, 1100), (1199, 1200), (1200, 1300), (1250, 1400)] {
            cycle.advance(now_ns);
            assert_eq!(cycle.deadline_ns(), expected_ns);
        }
    }

    #[test]
    fn cycles_that_were_slept_through_are_left_out_and_counted() {
        let mut cycle = Cycle::new(0, 100);
        cycle.advance(350);
        assert_eq!((cycle.deadline_ns(), cycle.n_missed()), (400, 3));
        cycle.advance(401);
        assert_eq!((cycle.deadline_ns(), cycle.n_missed()), (500, 3));
    }

    #[test]
    fn sleeping_reaches_its_deadline_and_never_ends_before() {
        let deadline_ns = now_ns() + 3_000_000;
        assert!(sleep_until(deadline_ns) >= deadline_ns);
        assert!(sleep_until(1) >= deadline_ns, "a deadline that has passed is no reason to sleep");
    }

    #[test]
    fn ages_are_never_negative() {
        assert_eq!(age_s(5, 9), 0.0);
        assert!((age_s(2_500_000_000, 1_000_000_000) - 1.5).abs() < 1e-12);
        assert_eq!(nanoseconds(0.02), 20_000_000);
    }
}
