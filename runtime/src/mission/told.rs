//! A mission in words.

use std::fmt::{Display, Formatter, Result};

use super::record::{CANCELLED, DRIVE, EMERGENCY_STOP, MANUAL, NONE, PAUSED, REACHED, UNDER_WAY};
use crate::message::MissionRecord;

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

impl MissionRecord {
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
