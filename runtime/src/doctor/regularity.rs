//! Whether messages come as often and as promptly as they should.

use bus::channel::{Counts, Refusal};
use bus::clock::{self, SECOND_NS};
use bus::message::Stamp;

use super::{Finding, Verdict, median};

/// Shares of the expected rate between which it is fine, and beyond which it is wrong.
const FINE: [f64; 2] = [0.9, 1.15];
const BEARABLE: [f64; 2] = [0.5, 3.0];
/// Periods between two messages above which some are missing.
const GAP_PERIODS: f64 = 3.5;
/// Time from a measurement to its message above which it is late [s].
const DELAY_S: f64 = 0.1;

/// When messages came, and of when they were.
#[derive(Debug, Default)]
pub(super) struct Regularity {
    valid_at_ns: Vec<u64>,
    delay_s: Vec<f64>,
}

impl Regularity {
    pub fn note(&mut self, stamp: &Stamp) {
        self.valid_at_ns.push(stamp.valid_at_ns);
        self.delay_s.push(clock::age_s(stamp.published_at_ns, stamp.valid_at_ns));
    }

    pub fn n(&self) -> usize {
        self.valid_at_ns.len()
    }

    /// Rate, longest gap and delay, beside the rate that was expected.
    pub fn finding(&self, what: &str, expected_hz: Option<f64>, watched_s: f64) -> Finding {
        let wanted = expected_hz.map_or(String::new(), |hz| format!(", expected {hz:.1} Hz"));
        let Some(rate_hz) = self.rate_hz() else {
            let n = self.n();
            return Finding::new(
                what,
                Verdict::Wrong,
                format!("{n} in {watched_s:.1} s{wanted}; does its driver run?"),
            );
        };
        let [gap_s, delay_s] = [self.longest_gap_s(), median(self.delay_s.iter().copied()).unwrap_or(0.0)];
        let mut found = format!(
            "{rate_hz:.1} Hz{wanted}, longest gap {:.0} ms, {:.1} ms from measurement to message",
            1e3 * gap_s,
            1e3 * delay_s
        );
        let share = expected_hz.map_or(1.0, |hz| rate_hz / hz);
        let within = |[low, high]: [f64; 2]| (low..=high).contains(&share);
        let has_gaps = gap_s * rate_hz > GAP_PERIODS;
        if has_gaps {
            found += "; some are missing: a sensor, a network or a processor that cannot keep up";
        }
        if delay_s > DELAY_S {
            found += "; it comes late, or its stamps are of another clock";
        }
        let verdict = match (within(BEARABLE), within(FINE) && !has_gaps && delay_s <= DELAY_S) {
            (false, _) => Verdict::Wrong,
            (true, false) => Verdict::Doubtful,
            (true, true) => Verdict::Fine,
        };
        Finding::new(what, verdict, found)
    }

    /// Of measurements, not of arrivals; none of fewer than three.
    fn rate_hz(&self) -> Option<f64> {
        let (first_ns, last_ns) = (self.valid_at_ns.iter().min()?, self.valid_at_ns.iter().max()?);
        let span_ns = (last_ns - first_ns) as f64;
        (self.n() > 2 && span_ns > 0.0).then(|| (self.n() - 1) as f64 * SECOND_NS as f64 / span_ns)
    }

    fn longest_gap_s(&self) -> f64 {
        let gaps_s = self.valid_at_ns.windows(2).map(|pair| clock::age_s(pair[1], pair[0]));
        gaps_s.fold(0.0, f64::max)
    }
}

/// Messages that no process of the run would take, with what usually makes them so.
pub(super) fn refused(what: &str, counts: &Counts) -> Option<Finding> {
    let causes = Refusal::ALL.iter().filter(|refusal| counts.of(**refusal) > 0);
    let told: Vec<String> =
        causes.map(|refusal| format!("{} {}", counts.of(*refusal), cause(*refusal))).collect();
    let n = counts.received + counts.n_refused();
    let finding = |found| Finding::new(format!("{what} refused"), Verdict::Wrong, found);
    (!told.is_empty()).then(|| finding(format!("of {n}: {}", told.join("; "))))
}

const fn cause(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::LayoutVersion => "of another version of this program",
        Refusal::Malformed => "with sizes or numbers that cannot be",
        Refusal::NonFinite => "with a number that is not finite",
        Refusal::FromFuture => "from the future: their stamps are of another clock",
        Refusal::OutOfOrder => "older than the one before, or the same again",
        Refusal::OtherPublisher => "of a publisher whose channel somebody else has taken",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(n: u64, period_ns: u64, delay_ns: u64) -> Regularity {
        let mut times = Regularity::default();
        for k in 1..=n {
            let valid_at_ns = k * period_ns;
            times.note(&Stamp { valid_at_ns, published_at_ns: valid_at_ns + delay_ns, ..Stamp::default() });
        }
        times
    }

    /// 100 messages, one each 20 ms, are 99 periods in 1.98 s: 50 Hz.
    #[test]
    fn the_rate_is_that_of_the_measurements() {
        let of = |hz: f64| seen(100, 20_000_000, 1_000_000).finding("odometry", Some(hz), 2.0);
        assert_eq!(of(50.0).verdict, Verdict::Fine);
        assert!(
            of(50.0).found.starts_with("50.0 Hz, expected 50.0 Hz, longest gap 20 ms, 1.0 ms"),
            "{}",
            of(50.0).found
        );
        assert_eq!(of(60.0).verdict, Verdict::Doubtful);
        assert_eq!(of(5.0).verdict, Verdict::Wrong, "ten times as often as stated");
        assert_eq!(of(400.0).verdict, Verdict::Wrong);
    }

    #[test]
    fn gaps_delays_and_silence_are_told() {
        let mut gap = seen(50, 20_000_000, 0);
        gap.note(&Stamp { valid_at_ns: 1_200_000_000, published_at_ns: 1_200_000_000, ..Stamp::default() });
        let finding = gap.finding("odometry", None, 1.2);
        assert_eq!(finding.verdict, Verdict::Doubtful);
        assert!(
            finding.found.contains("longest gap 200 ms") && finding.found.contains("missing"),
            "{}",
            finding.found
        );
        assert_eq!(
            seen(50, 20_000_000, 150_000_000).finding("odometry", None, 1.0).verdict,
            Verdict::Doubtful
        );
        let silent = seen(0, 1, 0).finding("odometry", Some(50.0), 5.0);
        assert_eq!(
            (silent.verdict, silent.found.as_str()),
            (Verdict::Wrong, "0 in 5.0 s, expected 50.0 Hz; does its driver run?")
        );
    }

    #[test]
    fn what_was_refused_is_told_with_its_usual_cause() {
        let mut counts = Counts { received: 90, ..Counts::default() };
        assert_eq!(refused("odometry", &counts), None);
        counts.refused[Refusal::FromFuture as usize] = 10;
        let found = refused("odometry", &counts).unwrap();
        assert_eq!(found.found, "of 100: 10 from the future: their stamps are of another clock");
    }
}
