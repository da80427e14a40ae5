//! The numbers by which missions and orders are told, and a mission in words.

use std::fmt::{Display, Formatter, Result};

use traversability::CvarLevel;

use super::MissionRecord;

/// Number of [`MissionRecord::state`]: drive.
pub const DRIVE: u64 = 0;
/// Number of [`MissionRecord::state`]: there is no mission.
pub const NONE: u64 = 1;
/// Number of [`MissionRecord::state`]: it waits.
pub const PAUSED: u64 = 2;
/// Number of [`MissionRecord::state`]: an operator has the wheel.
pub const MANUAL: u64 = 3;
/// Number of [`MissionRecord::state`]: an emergency stop is latched. The largest of them.
pub const EMERGENCY_STOP: u64 = 4;

/// Number of [`MissionRecord::outcome`]: it is under way.
pub const UNDER_WAY: u64 = 0;
/// Number of [`MissionRecord::outcome`]: its last goal is reached.
pub const REACHED: u64 = 1;
/// Number of [`MissionRecord::outcome`]: somebody ended it.
pub const CANCELLED: u64 = 10;

impl MissionRecord {
    /// Where it leads, if it leads anywhere.
    pub fn destination_m(&self) -> Option<[f64; 2]> {
        (self.n_legs > 0 || self.state == DRIVE).then_some(self.goal_m)
    }

    /// The share of worst outcomes to plan for, if anybody has said so.
    pub fn level(&self) -> Option<CvarLevel> {
        CvarLevel::new(self.alpha).ok()
    }

    /// Whether the vehicle is to drive.
    pub fn is_driving(&self) -> bool {
        self.state == DRIVE && self.outcome == UNDER_WAY
    }

    fn way(&self) -> String {
        let [x_m, y_m] = self.goal_m;
        let (place, n) = (self.leg + 1, self.n_legs);
        match (self.path_speed_mps > 0.0, n) {
            (true, _) => format!("along a path, corner {place} of {n}"),
            (false, 0 | 1) => format!("to ({x_m:.1}, {y_m:.1}) m"),
            (false, _) => format!("to ({x_m:.1}, {y_m:.1}) m, goal {place} of {n}"),
        }
    }
}

impl Display for MissionRecord {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> Result {
        match (self.state, self.outcome) {
            (EMERGENCY_STOP, _) => formatter.write_str("emergency stop, until `surefoot reset`"),
            (MANUAL, _) => formatter.write_str("an operator has the wheel, until `surefoot resume`"),
            (DRIVE, UNDER_WAY) => write!(formatter, "driving {}", self.way()),
            (PAUSED, _) => write!(formatter, "paused on the way {}", self.way()),
            (_, REACHED) => formatter.write_str("goal reached"),
            (_, CANCELLED) => formatter.write_str("mission cancelled"),
            (NONE, UNDER_WAY) => formatter.write_str("no mission"),
            _ => formatter.write_str("mission over"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mission_is_told_by_what_the_vehicle_does() {
        let goal = MissionRecord { goal_m: [3.0, -4.25], ..MissionRecord::default() };
        assert_eq!(goal.to_string(), "driving to (3.0, -4.2) m");
        let second = MissionRecord { leg: 1, n_legs: 3, state: PAUSED, ..goal };
        assert_eq!(second.to_string(), "paused on the way to (3.0, -4.2) m, goal 2 of 3");
        let path = MissionRecord { leg: 4, n_legs: 9, path_speed_mps: 1.0, ..goal };
        assert_eq!(path.to_string(), "driving along a path, corner 5 of 9");
        let over = |outcome| MissionRecord { state: NONE, outcome, ..goal }.to_string();
        assert_eq!(
            [over(UNDER_WAY), over(REACHED), over(CANCELLED)],
            ["no mission", "goal reached", "mission cancelled"]
        );
        let stopped = MissionRecord { state: EMERGENCY_STOP, outcome: CANCELLED, ..goal };
        assert!(stopped.to_string().starts_with("emergency stop"));
    }
}
