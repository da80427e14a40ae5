//! The robot's stamps on the clock of the bus.
//!
//! Ages count from when something was true, and the bus counts on the machine's monotonic clock. A stamp is of another
//! clock: the time of day, a simulator's, or one that a sensor began when it was switched on.

use std::collections::VecDeque;

/// How far a stamp may lie ahead of its arrival before it is of another clock [ns]; the bus allows a fifth of it.
const AHEAD_MAX_NS: i64 = 100_000_000;
/// How far behind it may lie before it is of another clock, and not just late [ns].
const BEHIND_MAX_NS: i64 = 3_600_000_000_000;
/// Change of the distance between two clocks that is told of as a jump [ns].
const JUMP_NS: i64 = 50_000_000;
/// Arrivals by which a clock of its own is judged: the least delayed of them counts.
const ARRIVALS: usize = 64;
/// The same for a clock that may run faster or slower.
const TICKS: usize = 8;

/// When a message came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// On the clock of the bus [ns].
    pub monotonic_ns: u64,
    /// By the time of day [ns].
    pub utc_ns: u64,
}

/// Why a stamp says nothing. Every message is one line.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StampError {
    /// It is of another clock than the robot file says.
    #[error(
        "stamp: expected a time of this machine's time of day, found one {ahead_s:.3} s ahead of it; set that clock, or \
         say of which clock stamps are with `clock` in the robot file"
    )]
    OtherClock {
        /// How far ahead it lies, negative behind [s].
        ahead_s: f64,
    },
    /// Nobody has told the simulator's time yet.
    #[error("stamp: expected the simulator's time on /clock, found none yet")]
    NoClock,
    /// The clock that it is of has jumped: what comes next counts again.
    #[error("stamp: expected a clock that runs on, found one that jumped by {by_s:.3} s")]
    Jumped {
        /// How far, negative back [s].
        by_s: f64,
    },
    /// It cannot be told on the clock of the bus.
    #[error("stamp: expected a time since this machine began, found one before")]
    BeforeBeginning,
}

/// Which clock stamps are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampSource {
    /// The time of day of this machine, or of one that is kept equal to it.
    TimeOfDay,
    /// The simulator's, which it tells on `/clock`; it has to run at about the pace of the clock.
    Simulated,
    /// A clock of its own: the least delayed arrivals say how far it is away. Their delay is then not part of any age.
    OfItsOwn,
}

/// Tells stamps on the clock of the bus.
#[derive(Clone, Debug)]
pub struct StampClock {
    source: StampSource,
    /// How far the clock of the bus is ahead of the stamps', the newest last [ns].
    leads_ns: VecDeque<i64>,
}

impl StampClock {
    /// A clock of which nothing is known yet.
    pub fn new(source: StampSource) -> Self {
        Self { source, leads_ns: VecDeque::new() }
    }

    /// Takes over what `/clock` says; of other clocks than the simulator's it is of no interest.
    ///
    /// # Errors
    /// The simulator's time has jumped.
    pub fn tick(&mut self, clock_ns: i64, arrival: Arrival) -> Result<(), StampError> {
        if self.source != StampSource::Simulated {
            return Ok(());
        }
        self.note(arrival.monotonic_ns as i64 - clock_ns, TICKS)
    }

    /// When a stamp was, on the clock of the bus [ns].
    ///
    /// # Errors
    /// The stamp is of another clock, or of none that is known yet.
    pub fn at_ns(&mut self, stamp_ns: i64, arrival: Arrival) -> Result<u64, StampError> {
        match self.source {
            StampSource::TimeOfDay => self.note_time_of_day(stamp_ns, arrival)?,
            StampSource::OfItsOwn => self.note(arrival.monotonic_ns as i64 - stamp_ns, ARRIVALS)?,
            StampSource::Simulated => {}
        }
        let lead_ns = self.lead_ns().ok_or(StampError::NoClock)?;
        // Nothing has been measured after it came: what a clock is less exact than that is not told.
        let at_ns = stamp_ns.saturating_add(lead_ns).min(arrival.monotonic_ns as i64);
        u64::try_from(at_ns).map_err(|_| StampError::BeforeBeginning)
    }

    /// The stamp of a time on the clock of the bus [ns]; `None` while nothing is known of the stamps' clock.
    pub fn stamp_ns(&self, at_ns: u64, now: Arrival) -> Option<i64> {
        let lead_ns = match self.source {
            StampSource::TimeOfDay => Some(lead_of_day_ns(now)),
            StampSource::OfItsOwn | StampSource::Simulated => self.lead_ns(),
        };
        Some(at_ns as i64 - lead_ns?)
    }

    fn lead_ns(&self) -> Option<i64> {
        self.leads_ns.iter().min().copied()
    }

    /// Both clocks are this machine's: their distance is known, and changes only where somebody sets the time of day.
    fn note_time_of_day(&mut self, stamp_ns: i64, arrival: Arrival) -> Result<(), StampError> {
        let ahead_ns = stamp_ns.saturating_sub(arrival.utc_ns as i64);
        if !(-BEHIND_MAX_NS..=AHEAD_MAX_NS).contains(&ahead_ns) {
            return Err(StampError::OtherClock { ahead_s: ahead_ns as f64 * 1e-9 });
        }
        self.note(lead_of_day_ns(arrival), 1)
    }

    fn note(&mut self, lead_ns: i64, n_kept: usize) -> Result<(), StampError> {
        let by_ns = self.lead_ns().map_or(0, |before_ns| before_ns - lead_ns);
        let tolerance_ns = match self.source {
            StampSource::TimeOfDay => JUMP_NS,
            // A message may wait on its way, and a simulator for its turn: only what is far away is another time.
            StampSource::Simulated | StampSource::OfItsOwn => 10 * JUMP_NS,
        };
        if by_ns.abs() > tolerance_ns {
            self.leads_ns = VecDeque::from([lead_ns]);
            return Err(StampError::Jumped { by_s: by_ns as f64 * 1e-9 });
        }
        self.leads_ns.push_back(lead_ns);
        if self.leads_ns.len() > n_kept {
            self.leads_ns.pop_front();
        }
        Ok(())
    }
}

fn lead_of_day_ns(arrival: Arrival) -> i64 {
    arrival.monotonic_ns as i64 - arrival.utc_ns as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    /// What the time of day is when the machine has run for no time.
    const DAY_NS: i64 = 1_700_000_000_000 * MS;

    /// Something comes so long after the machine began.
    fn after(ms: i64) -> Arrival {
        Arrival { monotonic_ns: (ms * MS) as u64, utc_ns: (DAY_NS + ms * MS) as u64 }
    }

    #[test]
    fn a_stamp_of_the_time_of_day_keeps_the_age_that_it_has() {
        let mut clock = StampClock::new(StampSource::TimeOfDay);
        assert_eq!(clock.at_ns(DAY_NS + 1000 * MS, after(1200)), Ok(1_000_000_000), "0.2 s on its way");
        assert_eq!(clock.at_ns(DAY_NS + 1350 * MS, after(1300)), Ok(1_300_000_000), "no later than it came");
        assert_eq!(clock.stamp_ns(1_250_000_000, after(1300)), Some(DAY_NS + 1250 * MS));
    }

    #[test]
    fn stamps_of_another_clock_are_refused() {
        let mut clock = StampClock::new(StampSource::TimeOfDay);
        let told = clock.at_ns(DAY_NS + 3000 * MS, after(1000)).unwrap_err().to_string();
        assert!(told.contains("found one 2.000 s ahead of it"), "{told}");
        assert!(
            matches!(clock.at_ns(5 * MS, after(1000)), Err(StampError::OtherClock { ahead_s }) if ahead_s < -1e9)
        );
        assert!(clock.at_ns(i64::MIN, after(1000)).is_err());
    }

    #[test]
    fn a_time_of_day_that_is_set_is_told_of_once() {
        let mut clock = StampClock::new(StampSource::TimeOfDay);
        assert!(clock.at_ns(DAY_NS + 1000 * MS, after(1000)).is_ok());
        let set = |ms: i64| Arrival { utc_ns: after(ms).utc_ns + 70_000_000, ..after(ms) };
        let at_ns = |clock: &mut StampClock, ms: i64| clock.at_ns(DAY_NS + (ms + 70) * MS, set(ms));
        assert_eq!(at_ns(&mut clock, 1100), Err(StampError::Jumped { by_s: 0.07 }));
        assert_eq!(at_ns(&mut clock, 1200), Ok(1_200_000_000));
    }

    #[test]
    fn a_clock_of_its_own_is_as_far_away_as_what_came_soonest() {
        let mut clock = StampClock::new(StampSource::OfItsOwn);
        // Began 5 s after the machine; messages take 3, 20 and 8 ms.
        assert_eq!(clock.at_ns(0, after(5003)), Ok(5_003_000_000));
        assert_eq!(clock.at_ns(100 * MS, after(5120)), Ok(5_103_000_000));
        assert_eq!(clock.at_ns(200 * MS, after(5201)), Ok(5_201_000_000), "sooner than any before");
        assert_eq!(clock.at_ns(300 * MS, after(5308)), Ok(5_301_000_000));
        assert_eq!(clock.stamp_ns(5_301_000_000, after(5308)), Some(300 * MS));
        let began_anew = clock.at_ns(0, after(6000)).unwrap_err();
        assert!(
            matches!(began_anew, StampError::Jumped { by_s } if (by_s + 0.999).abs() < 1e-9),
            "{began_anew}"
        );
        assert_eq!(clock.at_ns(100 * MS, after(6100)), Ok(6_100_000_000));
    }

    #[test]
    fn a_simulators_time_is_what_its_clock_says() {
        let mut clock = StampClock::new(StampSource::Simulated);
        assert_eq!(clock.at_ns(7, after(1000)), Err(StampError::NoClock));
        assert_eq!(clock.stamp_ns(7, after(1000)), None);
        clock.tick(2000 * MS, after(1000)).unwrap();
        assert_eq!(clock.at_ns(2010 * MS, after(1015)), Ok(1_010_000_000));
        // At half the pace of time the newest ticks count.
        for tick in 1..=100 {
            clock.tick((2000 + 10 * tick) * MS, after(1000 + 20 * tick)).unwrap();
        }
        let at_ns = clock.at_ns(3000 * MS, after(3000)).unwrap();
        assert!((2_900_000_000..=3_000_000_000).contains(&at_ns), "{at_ns}");
        assert!(matches!(clock.tick(0, after(3100)), Err(StampError::Jumped { .. })), "it began anew");
        assert_eq!(clock.at_ns(10 * MS, after(3115)), Ok(3_110_000_000));
    }
}
