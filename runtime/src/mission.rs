//! What control knows of where to go, and what it does when it knows nothing.

use bicycle::{Decision, HoldReason, StopReason};
use navigator::Destination;

use crate::message::{MissionRecord, Source, Stamp};

/// A destination for whoever must name one and has none.
pub const NOWHERE: Destination = Destination { goal_m: [0.0; 2], tolerance_m: 0.0 };

/// The outcome of a mission that is under way.
const UNDER_WAY: u64 = 0;

/// The mission that was heard last.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mission {
    last: Option<(Stamp, MissionRecord)>,
}

impl Mission {
    /// Takes in what was said of where to go.
    pub fn note(&mut self, stamp: &Stamp, record: &MissionRecord) {
        self.last = Some((*stamp, *record));
    }

    /// The message that it was heard by.
    pub fn source(&self) -> Source {
        self.last.map_or(Source::default(), |(stamp, _)| stamp.source())
    }

    /// When it was said last [ns]; `None` before the first time.
    pub fn said_at_ns(&self) -> Option<u64> {
        self.last.map(|(stamp, _)| stamp.valid_at_ns)
    }

    /// Where to go now, or why nowhere: there is no mission, it is over, or it was not repeated for longer than
    /// `age_max_ns`.
    pub fn destination(&self, now_ns: u64, age_max_ns: u64) -> Result<Destination, Decision> {
        let Some((stamp, record)) = self.last.filter(|(_, record)| record.outcome == UNDER_WAY) else {
            return Err(Decision::Hold(HoldReason::NoMission));
        };
        if now_ns.saturating_sub(stamp.valid_at_ns) > age_max_ns {
            return Err(Decision::Stop(StopReason::StaleMission));
        }
        Ok(Destination { goal_m: record.goal_m, tolerance_m: record.tolerance_m })
    }
}

/// Who is shown no map because there is nowhere to go waits for one: the reason is the mission then. Every other reason
/// to stand is the more urgent one.
pub fn with_reason(decision: Decision, destination: Result<Destination, Decision>) -> Decision {
    match (decision, destination) {
        (Decision::Hold(HoldReason::NoMap), Err(standing)) => standing,
        _ => decision,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::Command;

    const AGE_MAX_NS: u64 = 2500;
    const NO_MISSION: Decision = Decision::Hold(HoldReason::NoMission);

    fn said(mission: &mut Mission, at_ns: u64, outcome: u64) {
        let record =
            MissionRecord { goal_m: [3.0, 4.0], tolerance_m: 1.0, outcome, ..MissionRecord::default() };
        mission.note(&Stamp { valid_at_ns: at_ns, ..Stamp::default() }, &record);
    }

    #[test]
    fn a_mission_counts_while_it_is_repeated_and_until_it_is_over() {
        let mut mission = Mission::default();
        let now = |mission: &Mission, now_ns: u64| mission.destination(now_ns, AGE_MAX_NS);
        let there = Ok(Destination { goal_m: [3.0, 4.0], tolerance_m: 1.0 });
        assert_eq!(now(&mission, 5), Err(NO_MISSION), "nobody has said anything");
        said(&mut mission, 1000, 0);
        assert_eq!(now(&mission, 1000 + AGE_MAX_NS), there);
        assert_eq!(now(&mission, 1001 + AGE_MAX_NS), Err(Decision::Stop(StopReason::StaleMission)));
        said(&mut mission, 4000, 0);
        assert_eq!(now(&mission, 4001), there, "it is said again");
        said(&mut mission, 5000, 3);
        assert_eq!(now(&mission, 5001), Err(NO_MISSION), "it is over");
        assert_eq!(now(&mission, 1_000_000), Err(NO_MISSION), "what is over does not get lost");
        said(&mut mission, 6000, 0);
        assert_eq!(now(&mission, 6001), there, "the next one");
    }

    #[test]
    fn what_is_more_urgent_than_the_mission_stays_the_reason() {
        let lost = Err(Decision::Stop(StopReason::StaleMission));
        let there = Ok(Destination { goal_m: [0.0; 2], tolerance_m: 1.0 });
        let no_map = Decision::Hold(HoldReason::NoMap);
        assert_eq!(with_reason(no_map, lost), Decision::Stop(StopReason::StaleMission));
        assert_eq!(with_reason(no_map, there), no_map);
        let blind = Decision::Stop(StopReason::StaleOdometry);
        assert_eq!(with_reason(blind, lost), blind);
        let drive = Decision::Drive(Command { speed_mps: 1.0, steering_rad: 0.0 });
        assert_eq!(with_reason(drive, there), drive);
    }
}
