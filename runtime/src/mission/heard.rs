//! What control knows of the mission: the last that was said.

use bicycle::{Decision, HoldReason, StopReason};
use mppi::ReferencePath;
use navigator::{CORNERS_MAX, Destination, Instruction, Target};

use bus::message::mission::{DRIVE, EMERGENCY_STOP, MANUAL, PAUSED, UNDER_WAY};
use bus::message::{MissionRecord, Source, Stamp};

/// The mission that was heard last.
#[derive(Clone, Debug)]
pub struct Heard {
    last: Option<(Stamp, MissionRecord)>,
    /// Its path; the memory is kept.
    corners_m: Vec<[f64; 2]>,
}

impl Default for Heard {
    fn default() -> Self {
        Self { last: None, corners_m: Vec::with_capacity(CORNERS_MAX) }
    }
}

impl Heard {
    /// Takes in what was said.
    pub fn note(&mut self, stamp: &Stamp, record: &MissionRecord) {
        self.last = Some((*stamp, *record));
        self.corners_m.clear();
        let corners = record.corner_x_m.into_iter().zip(record.corner_y_m);
        self.corners_m.extend(corners.take(record.n_corners as usize).map(|(x_m, y_m)| [x_m, y_m]));
    }

    /// The message that it was heard by.
    pub fn source(&self) -> Source {
        self.last.map_or(Source::default(), |(stamp, _)| stamp.source())
    }

    /// When it was said last [ns]; `None` before the first time.
    pub fn said_at_ns(&self) -> Option<u64> {
        self.last.map(|(stamp, _)| stamp.valid_at_ns)
    }

    /// What is to be done now. A mission that was not repeated for longer than `age_max_ns` is lost, but for what is over
    /// and for an emergency stop.
    pub fn instruction(&self, now_ns: u64, age_max_ns: u64) -> Instruction<'_> {
        let Some((stamp, record)) = &self.last else { return hold(HoldReason::NoMission) };
        let is_lost = now_ns.saturating_sub(stamp.valid_at_ns) > age_max_ns;
        match record.state {
            EMERGENCY_STOP => stop(StopReason::EmergencyStop),
            DRIVE | PAUSED | MANUAL if record.outcome == UNDER_WAY && is_lost => {
                stop(StopReason::StaleMission)
            }
            MANUAL => hold(HoldReason::Manual),
            PAUSED => hold(HoldReason::Paused),
            DRIVE if record.outcome == UNDER_WAY => Instruction::Drive(self.target(record)),
            _ => hold(HoldReason::NoMission),
        }
    }

    fn target(&self, record: &MissionRecord) -> Target<'_> {
        let MissionRecord { goal_m, tolerance_m, path_speed_mps, .. } = *record;
        if path_speed_mps > 0.0 {
            let points_m = &self.corners_m;
            return Target::Path(ReferencePath { points_m, speed_mps: path_speed_mps, tolerance_m });
        }
        Target::Goal(Destination { goal_m, tolerance_m })
    }
}

fn hold(reason: HoldReason) -> Instruction<'static> {
    Instruction::Stand(Decision::Hold(reason))
}

fn stop(reason: StopReason) -> Instruction<'static> {
    Instruction::Stand(Decision::Stop(reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::message::mission::NONE;

    const AGE_MAX_NS: u64 = 2500;

    fn said(heard: &mut Heard, at_ns: u64, record: MissionRecord) {
        heard.note(&Stamp { valid_at_ns: at_ns, ..Stamp::default() }, &record);
    }

    fn under_way() -> MissionRecord {
        MissionRecord { goal_m: [3.0, 4.0], tolerance_m: 1.0, ..MissionRecord::default() }
    }

    #[test]
    fn a_mission_counts_while_it_is_repeated_and_until_it_is_over() {
        let mut heard = Heard::default();
        let no_mission = hold(HoldReason::NoMission);
        let there = Instruction::Drive(Target::Goal(Destination { goal_m: [3.0, 4.0], tolerance_m: 1.0 }));
        assert_eq!(heard.instruction(5, AGE_MAX_NS), no_mission, "nobody has said anything");
        said(&mut heard, 1000, under_way());
        assert_eq!(heard.instruction(1000 + AGE_MAX_NS, AGE_MAX_NS), there);
        assert_eq!(heard.instruction(1001 + AGE_MAX_NS, AGE_MAX_NS), stop(StopReason::StaleMission));
        said(&mut heard, 4000, under_way());
        assert_eq!(heard.instruction(4001, AGE_MAX_NS), there, "it is said again");
        said(&mut heard, 5000, MissionRecord { outcome: 3, ..under_way() });
        assert_eq!(heard.instruction(5001, AGE_MAX_NS), no_mission, "it is over");
        assert_eq!(heard.instruction(1_000_000, AGE_MAX_NS), no_mission, "what is over does not get lost");
        said(&mut heard, 6000, under_way());
        assert_eq!(heard.instruction(6001, AGE_MAX_NS), there, "the next one");
    }

    #[test]
    fn only_one_state_drives_and_an_emergency_stop_does_not_grow_old() {
        let mut heard = Heard::default();
        for (state, fresh, lost) in [
            (PAUSED, hold(HoldReason::Paused), stop(StopReason::StaleMission)),
            (MANUAL, hold(HoldReason::Manual), stop(StopReason::StaleMission)),
            (EMERGENCY_STOP, stop(StopReason::EmergencyStop), stop(StopReason::EmergencyStop)),
            (NONE, hold(HoldReason::NoMission), hold(HoldReason::NoMission)),
        ] {
            said(&mut heard, 1000, MissionRecord { state, ..under_way() });
            assert_eq!(heard.instruction(1000, AGE_MAX_NS), fresh, "state {state}");
            assert_eq!(heard.instruction(1001 + AGE_MAX_NS, AGE_MAX_NS), lost, "state {state}, lost");
        }
    }

    #[test]
    fn a_path_is_as_long_as_it_says_and_forgotten_with_the_next_mission() {
        let mut heard = Heard::default();
        let mut record = MissionRecord { path_speed_mps: 0.5, n_corners: 3, ..under_way() };
        (record.corner_x_m[1], record.corner_y_m[2], record.corner_x_m[3]) = (7.0, 8.0, 9.0);
        said(&mut heard, 1000, record);
        let points_m = [[0.0, 0.0], [7.0, 0.0], [0.0, 8.0]];
        let path = ReferencePath { points_m: &points_m, speed_mps: 0.5, tolerance_m: 1.0 };
        assert_eq!(heard.instruction(1000, AGE_MAX_NS), Instruction::Drive(Target::Path(path)));
        said(&mut heard, 1001, under_way());
        assert!(matches!(heard.instruction(1001, AGE_MAX_NS), Instruction::Drive(Target::Goal(_))));
    }
}
