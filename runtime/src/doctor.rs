//! What an engineer looks at before a robot drives: the machine that the processes run on, and what the sensors of a run
//! say of one another.
//!
//! Nothing here decides anything, and nothing is published: a run is looked on at as by any third party, and what a bag
//! holds is handed in.

mod inertial;
mod machine;
mod motion;
mod observed;
mod regularity;
mod scans;
mod yaw;

use bus::ages::Periods;
use bus::channel::{Bus, Channel, ChannelError, Element, Header, IMU, Inlet, ODOMETRY, SCAN};
use bus::clock::{self, SECOND_NS};
use bus::message::{ImuRecord, OdometryRecord, PointRecord, ScanHeader, Stamp, StatusRecord};
use bus::status::Role;
use serde::Serialize;
use terrain::Mount;

pub use machine::machine;
pub use observed::{Observed, Source};
use regularity::refused;

/// Time between two looks at the channels [ns].
const POLL_NS: u64 = SECOND_NS / 200;

/// What came of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it should be.
    Fine,
    /// It may be meant so; somebody should look.
    Doubtful,
    /// Nobody should drive with this.
    Wrong,
    /// It could not be told, and the text says what would tell it.
    Unknown,
}

/// A check and what was found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub what: String,
    /// What came of it.
    pub verdict: Verdict,
    /// What was found and, unless that is fine, what is expected and what usually causes it.
    pub found: String,
}

impl Finding {
    /// What came of a check.
    pub fn new(what: impl Into<String>, verdict: Verdict, found: String) -> Self {
        Self { what: what.into(), verdict, found }
    }
}

/// What is known of a robot beforehand.
#[derive(Clone, Debug, Default)]
pub struct Expected {
    /// How often its parts are to speak; `None` = nobody has said.
    pub periods: Option<Periods>,
    /// Where its range sensors sit, those that send in their own frames, numbered from 1.
    pub mounts: Vec<Mount>,
    /// Radius of its wheels and length [m]; `None` = nobody has said.
    pub wheel_and_length_m: Option<[f64; 2]>,
}

/// Looks on at a run for some time, and says what its sensors and processes are like.
///
/// # Errors
/// A channel that cannot be read, e.g. because all places of readers are taken. A channel that is not there is a finding.
pub fn watch(
    bus: &Bus,
    expected: &Expected,
    watched_s: f64,
    is_over: &mut dyn FnMut(f64) -> bool,
) -> Result<Vec<Finding>, ChannelError> {
    let mut watch = Watch::new(bus)?;
    let (start_ns, utc_ns) = (clock::now_ns(), clock::utc_ns());
    let passed_s = || clock::age_s(clock::now_ns(), start_ns);
    while passed_s() < watched_s && !is_over(passed_s()) {
        watch.look();
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    let (passed_s, utc_passed_s) = (passed_s(), clock::age_s(clock::utc_ns(), utc_ns));
    let mut findings = watch.findings(expected, passed_s);
    findings.push(machine::time_of_day(passed_s, utc_passed_s));
    Ok(findings)
}

struct Watch {
    odometry: Option<Inlet<Stamp, OdometryRecord>>,
    scan: Option<Inlet<ScanHeader, PointRecord>>,
    imu: Option<Inlet<Stamp, ImuRecord>>,
    statuses: Vec<(Role, Inlet<Stamp, StatusRecord>, Vec<StatusRecord>)>,
    observed: Observed,
}

impl Watch {
    fn new(bus: &Bus) -> Result<Self, ChannelError> {
        let mut statuses = Vec::new();
        for role in Role::ALL {
            statuses.extend(open(bus, &role.status())?.map(|inlet| (role, inlet, Vec::new())));
        }
        Ok(Self {
            odometry: open(bus, &ODOMETRY)?,
            scan: open(bus, &SCAN)?,
            imu: open(bus, &IMU)?,
            statuses,
            observed: Observed::default(),
        })
    }

    fn look(&mut self) {
        let observed = &mut self.observed;
        if let Some(inlet) = &mut self.odometry {
            inlet.poll(|stamp, records| observed.odometry(stamp, records));
        }
        if let Some(inlet) = &mut self.scan {
            inlet.poll(|header, points| observed.scan(header, points));
        }
        if let Some(inlet) = &mut self.imu {
            inlet.poll(|stamp, samples| observed.imu(stamp, samples));
        }
        for (_, inlet, seen) in &mut self.statuses {
            inlet.poll(|_, records| seen.extend_from_slice(records));
        }
    }

    fn findings(&self, expected: &Expected, watched_s: f64) -> Vec<Finding> {
        let mut findings = self.observed.findings(expected, watched_s, |source| match source {
            Source::Odometry => self.odometry.as_ref().and_then(|inlet| refused("odometry", inlet.counts())),
            Source::Scans => self.scan.as_ref().and_then(|inlet| refused("scans", inlet.counts())),
            Source::Imu => self.imu.as_ref().and_then(|inlet| refused("imu", inlet.counts())),
        });
        findings.extend(self.statuses.iter().filter_map(|(role, _, seen)| process(*role, seen)));
        findings
    }
}

/// The way out of a channel that is there.
fn open<H: Header, T: Element>(
    bus: &Bus,
    channel: &Channel<H, T>,
) -> Result<Option<Inlet<H, T>>, ChannelError> {
    match bus.inlet(channel) {
        Ok(inlet) => Ok(Some(inlet)),
        Err(ChannelError::Absent { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// How a process is doing, by what it told while it was looked on at.
fn process(role: Role, seen: &[StatusRecord]) -> Option<Finding> {
    let (first, last) = (seen.first()?, seen.last()?);
    let late_s = seen.iter().map(|status| status.lateness_s[1]).fold(0.0, f64::max);
    let n_missed = last.n_missed.saturating_sub(first.n_missed);
    let n_lost = last.n_lost.saturating_sub(first.n_lost);
    let n_refused = last.n_refused.saturating_sub(first.n_refused);
    let restarts = seen.windows(2).filter(|pair| pair[0].process != pair[1].process).count();
    // Who waits for somebody to say something has no rate.
    let mut found = match last.rate_hz {
        0.0 => "alive".to_owned(),
        rate_hz => format!("{rate_hz:.1} Hz, at most {:.1} ms late", 1e3 * late_s),
    };
    let troubles = [
        (n_missed, "deadlines missed"),
        (n_lost, "messages lost on the way to it"),
        (n_refused, "messages refused"),
        (restarts as u64, "restarts"),
    ];
    for (n, trouble) in troubles.into_iter().filter(|(n, _)| *n > 0) {
        found += &format!(", {n} {trouble}");
    }
    let verdict = match (restarts + n_refused as usize, n_missed + n_lost) {
        (1.., _) => Verdict::Wrong,
        (0, 1..) => Verdict::Doubtful,
        (0, 0) => Verdict::Fine,
    };
    Some(Finding::new(format!("process {}", role.name()), verdict, found))
}

/// Middle one of some numbers.
fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_misses_deadlines_is_doubtful_and_one_that_restarts_is_wrong() {
        let status = |process, n_missed| StatusRecord { process, n_missed, ..StatusRecord::default() };
        let verdict = |seen: &[StatusRecord]| process(Role::Control, seen).unwrap().verdict;
        assert_eq!(process(Role::Control, &[]), None);
        assert_eq!(verdict(&[status(7, 3), status(7, 3)]), Verdict::Fine, "what was before does not count");
        assert_eq!(verdict(&[status(7, 3), status(7, 4)]), Verdict::Doubtful);
        assert_eq!(verdict(&[status(7, 3), status(8, 0)]), Verdict::Wrong);
    }
}
