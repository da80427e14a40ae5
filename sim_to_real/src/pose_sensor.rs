//! How late the robot's pose is and of which point, told by its speed and yaw rate; and poses without either.

mod equations;
mod search;

use crate::answer::Estimate;
use crate::drives::Drives;
use crate::signals::repeats_pose;
use bicycle::{Column, DriveLog, DriveRow, Readings, Run};
use equations::Way;
use serde::{Deserialize, Serialize};

/// What is not known of a pose sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseUnknown {
    /// Its clock, or how old its poses are, against speed and yaw rate.
    TimeOffset,
    /// Where it sits.
    LeverArm,
}

/// What was found of a pose sensor, with 90 % intervals; absent what was not asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseSensor {
    /// A pose tells where the machine was so long before its row [s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_offset_s: Option<Estimate>,
    /// It tells where a point is that is so far ahead of the middle of the rear axle [m],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lever_arm_ahead_m: Option<Estimate>,
    /// and so far to its left [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lever_arm_left_m: Option<Estimate>,
}

/// Drives that do not tell what was asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseSensorError {
    /// A column that the pose, or what it is held against, needs.
    #[error("{drive}: expected the column {column} to tell how the pose sensor sits, found none")]
    Missing {
        /// Drive.
        drive: String,
        /// Column.
        column: &'static str,
    },
    /// Intervals need several stretches.
    #[error("pose sensor: expected at least {needed_s:.0} s of drives, found {found_s:.0} s")]
    Short {
        /// Needed [s].
        needed_s: f64,
        /// Found [s].
        found_s: f64,
    },
    /// More than what is looked for.
    #[error("pose sensor: expected a time offset within {within_s} s, found none that fits best there")]
    Far {
        /// Largest offset that is tried [s].
        within_s: f64,
    },
    /// Noise of the yaw rate would count as turning.
    #[error(
        "pose sensor: expected drives that turn by {needed_rad} rad or more within 2 s (root mean square) to tell its lever arm, found {found_rad:.3} rad"
    )]
    Straight {
        /// Needed [rad].
        needed_rad: f64,
        /// Found [rad].
        found_rad: f64,
    },
    /// Drives that hardly turn or change their speed.
    #[error(
        "pose sensor: expected drives that tell its {what} to {needed}, found one told to {found}; drive turns both ways at changing speed"
    )]
    Undetermined {
        /// Time offset or lever arm.
        what: &'static str,
        /// Largest half of its 90 % interval, with unit.
        needed: String,
        /// Half of the interval found, with unit.
        found: String,
    },
}

/// Largest half of an interval that tells anything: of the time offset [s],
const NEEDED_S: f64 = 0.05;
/// of the lever arm, as a share of the wheelbase.
const NEEDED_WHEELBASES: f64 = 0.25;

impl PoseSensor {
    /// From drives of the robot, by how far pose and heading move within two seconds against what speed and yaw rate say of
    /// those that began a time offset earlier. Scale of the speed, bias of the yaw rate, misalignment of the yaw and
    /// slip of the rear axle in proportion to lateral acceleration are left free. Intervals are those of a jackknife over
    /// stretches of ten seconds.
    ///
    /// # Errors
    /// A drive without pose, speed or yaw rate; less than 30 s; an offset of more than half a second; drives that do not
    /// tell it.
    pub fn estimated(
        drives: &Drives,
        wheelbase_m: f64,
        unknowns: &[PoseUnknown],
    ) -> Result<Self, PoseSensorError> {
        let named = drives.names.iter().zip(&drives.logs);
        let ways = named.flat_map(|(name, log)| log.runs().map(move |run| Way::of(name, run)));
        let found = search::found(&ways.collect::<Result<Vec<_>, _>>()?, unknowns)?;
        told_to("time offset", "s", found.time_offset_s.as_slice(), NEEDED_S)?;
        let arm = [found.lever_arm_ahead_m, found.lever_arm_left_m].into_iter().flatten().collect::<Vec<_>>();
        told_to("lever arm", "m", &arm, NEEDED_WHEELBASES * wheelbase_m)?;
        Ok(found)
    }

    /// Drives as they would be with poses of the middle of the rear axle, on time: where the machine was in each row.
    pub fn taken_out_of(&self, drives: Drives) -> Drives {
        Drives { logs: drives.logs.iter().map(|log| self.taken_out(log)).collect(), ..drives }
    }

    fn taken_out(&self, log: &DriveLog) -> DriveLog {
        let poses: Vec<Option<Poses>> = log.runs().map(Poses::of).collect();
        log.with_rows(|run, _, row| poses[run].as_ref().map_or(row, |poses| self.corrected(row, poses)))
    }

    fn corrected(&self, row: DriveRow, poses: &Poses) -> DriveRow {
        let value = |estimate: Option<Estimate>| estimate.map_or(0.0, |estimate| estimate.value);
        let [x, y, yaw] = poses.at(row.time_s + value(self.time_offset_s));
        let (sine, cosine) = yaw.sin_cos();
        let [ahead, left] = [self.lever_arm_ahead_m, self.lever_arm_left_m].map(value);
        row.with(Column::X, x - cosine * ahead + sine * left)
            .with(Column::Y, y - sine * ahead - cosine * left)
            .with(Column::Yaw, yaw)
    }
}

fn told_to(what: &'static str, unit: &str, found: &[Estimate], needed: f64) -> Result<(), PoseSensorError> {
    let half = found.iter().map(|estimate| 0.5 * (estimate.high - estimate.low)).fold(0.0, f64::max);
    if half <= needed {
        return Ok(());
    }
    let [needed, found] = [needed, half].map(|half| format!("± {half:.3} {unit}"));
    Err(PoseSensorError::Undetermined { what, needed, found })
}

/// East, north and yaw of a run, as they were measured.
struct Poses {
    /// Without repetitions, as of a sensor slower than the log.
    spoken: [Readings; 3],
    /// With them, for where a machine that stands repeats its pose.
    all: [Readings; 3],
}

impl Poses {
    fn of(run: Run<'_>) -> Option<Self> {
        let repeats = repeats_pose(run);
        let of = |is_wanted: &dyn Fn(usize) -> bool| {
            let of = |column| Readings::of_rows(run, column, is_wanted);
            Some([of(Column::X)?, of(Column::Y)?, of(Column::Yaw)?])
        };
        Some(Self { spoken: of(&|row| !repeats[row])?, all: of(&|_| true)? })
    }

    fn at(&self, now_s: f64) -> [f64; 3] {
        let at = |readings: &[Readings; 3]| readings.each_ref().map(|readings| readings.at(now_s));
        let spoken = at(&self.spoken);
        if spoken.iter().any(|value| value.is_nan()) { at(&self.all) } else { spoken }
    }
}

#[cfg(test)]
mod tests;
