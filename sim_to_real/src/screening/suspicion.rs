//! What a drive may be suspected of.

use std::fmt;

/// How grave a suspicion is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gravity {
    /// A diagnosis would be wrong: the drive is refused.
    Refused,
    /// A diagnosis is possible; the user should know.
    Doubtful,
}

/// Where in a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Run, empty when the drive has but one and does not name it.
    pub run: String,
    /// Row of the drive, from 1, all runs counted.
    pub row: usize,
    /// Time in the run [s].
    pub time_s: f64,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { run, row, time_s } = self;
        write!(f, "row {row} (t = {time_s:.2} s")?;
        if !run.is_empty() {
            write!(f, ", run '{run}'")?;
        }
        write!(f, ")")
    }
}

/// Rows in which columns that are read have no number.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    /// Columns, separated by commas.
    pub columns: String,
    /// First such row.
    pub place: Place,
    /// Rows without a number.
    pub n_missing: usize,
    /// All rows.
    pub n: usize,
}

/// What a drive, or a set of drives, is suspected of.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Suspicion {
    /// Neither commands nor anything measured.
    #[error("expected {expected}, found none of these columns")]
    Lacking {
        /// What is needed.
        expected: &'static str,
    },
    /// Most of a column that is read.
    #[error(
        "{}: expected a number in half of the rows at least, found none in {} of {}, first in {}",
        .0.columns, .0.n_missing, .0.n, .0.place
    )]
    MostlyMissing(Hole),
    /// Some of it.
    #[error(
        "{}: no number in {} of {} rows, first in {}; nothing is compared there",
        .0.columns, .0.n_missing, .0.n, .0.place
    )]
    Missing(Hole),
    /// Too little of it.
    #[error("expected at least {needed_s:.0} s of driving, found {found_s:.2} s")]
    TooShort {
        /// Needed [s].
        needed_s: f64,
        /// Found [s].
        found_s: f64,
    },
    /// Rows too far apart for seconds.
    #[error("t: expected rows at most 0.5 s apart, found {step_s} s: is t in {unit}?")]
    ClockUnit {
        /// Median step [s].
        step_s: f64,
        /// Likely unit.
        unit: &'static str,
    },
    /// Time passes without a row.
    #[error("gap of {length_s:.2} s after {place}, where rows are {step_s:.3} s apart")]
    Gap {
        /// Last row before it.
        place: Place,
        /// Length [s].
        length_s: f64,
        /// Median step [s].
        step_s: f64,
    },
    /// The position leaps.
    #[error("position leaps {length_m:.2} m after {place}, where the speed explains {explained_m:.2} m")]
    Leap {
        /// Last row before it.
        place: Place,
        /// Length [m].
        length_m: f64,
        /// What the speed explains [m].
        explained_m: f64,
    },
    /// The position leaps back to where the run began, or to the origin.
    #[error("pose reset after {place}: the position leaps {length_m:.2} m to ({x_m:.2}, {y_m:.2})")]
    Reset {
        /// Last row before it.
        place: Place,
        /// Length [m].
        length_m: f64,
        /// East, afterwards [m].
        x_m: f64,
        /// North, afterwards [m].
        y_m: f64,
    },
    /// The yaw leaps.
    #[error("yaw leaps {angle_rad:.2} rad after {place}, where the yaw rate explains {explained_rad:.2} rad")]
    YawLeap {
        /// Last row before it.
        place: Place,
        /// Angle [rad].
        angle_rad: f64,
        /// What the yaw rate explains [rad].
        explained_rad: f64,
    },
    /// Gaps and leaps so often that no drive is left.
    #[error("{n} gaps and leaps in {duration_s:.0} s, the first: {first}")]
    ManyBreaks {
        /// Number of gaps and leaps.
        n: usize,
        /// Length of the drive [s].
        duration_s: f64,
        /// The first of them.
        first: Box<Suspicion>,
    },
    /// An angle or its rate in degrees.
    #[error("{column}: expected radians, found degrees? {evidence}")]
    Degrees {
        /// Column.
        column: &'static str,
        /// What gives it away.
        evidence: String,
    },
    /// A speed or a length in another unit.
    #[error("{column}: expected SI units, found {unit}? {evidence}")]
    Unit {
        /// Column.
        column: &'static str,
        /// Likely unit.
        unit: &'static str,
        /// What gives it away.
        evidence: String,
    },
    /// Path and speed disagree by a factor that is no unit.
    #[error("the path is {ratio:.2} times as long as vx says: expected about 1")]
    PathAgainstSpeed {
        /// Path over integrated speed [-].
        ratio: f64,
    },
    /// The steering's sign.
    #[error(
        "{column}: expected left positive, found mirrored? the yaw rate follows speed x tan({column}) with correlation \
         {correlation:.2} at a lag of {lag_s:.1} s"
    )]
    MirroredSteering {
        /// Column.
        column: &'static str,
        /// Strongest correlation, negative [-].
        correlation: f64,
        /// Its lag [s].
        lag_s: f64,
    },
    /// Two measurements of the same turn have opposite signs.
    #[error(
        "{one} and {other}: expected both counter-clockwise, found turns against each other, correlation {correlation:.2}"
    )]
    AgainstEachOther {
        /// One column.
        one: &'static str,
        /// The other.
        other: &'static str,
        /// Correlation of their turns [-].
        correlation: f64,
    },
    /// The velocity to the left is not that of the path.
    #[error(
        "vy: expected the velocity to the left of where x and y are, found it against the path, correlation \
         {correlation:.2}: mirrored, or of another place on the vehicle?"
    )]
    SideSpeedAgainstPath {
        /// Correlation with the path's motion across the yaw [-].
        correlation: f64,
    },
    /// The vehicle does not move where its nose points.
    #[error(
        "yaw: expected the direction of motion, found it {offset_rad:.2} rad off: counted from another axis?"
    )]
    YawOffset {
        /// Median of direction of motion less yaw [rad].
        offset_rad: f64,
    },
    /// It hardly moves.
    #[error("expected a drive, found standstill: {path_m:.2} m in {duration_s:.0} s")]
    Standstill {
        /// Way [m].
        path_m: f64,
        /// Time [s].
        duration_s: f64,
    },
    /// A measurement repeats itself while the vehicle moves.
    #[error("{column} stays exactly {value} for {hold_s:.1} s from {place} on, at {speed_mps:.1} m/s")]
    Frozen {
        /// Column.
        column: &'static str,
        /// Its value.
        value: f64,
        /// First row.
        place: Place,
        /// How long [s].
        hold_s: f64,
        /// Mean speed meanwhile [m/s].
        speed_mps: f64,
    },
    /// The vehicle is stuck.
    #[error(
        "the vehicle stands for {length_s:.1} s from {place} on although {asked_mps:.2} m/s are commanded: stuck? A diagnosis \
         takes it for a weak drive"
    )]
    Stalled {
        /// First row.
        place: Place,
        /// How long [s].
        length_s: f64,
        /// Commanded speed [m/s].
        asked_mps: f64,
    },
    /// More than the vehicle's description allows.
    #[error(
        "{column}: expected at most {limit:.3} as the vehicle's description says, found {found:.3} in {place}"
    )]
    BeyondLimit {
        /// Column.
        column: &'static str,
        /// Largest allowed.
        limit: f64,
        /// Largest found.
        found: f64,
        /// Where.
        place: Place,
    },
    /// The drive leaves the map.
    #[error(
        "{share_percent:.0} % of the positions lie outside the vehicle's map: is it the map of this drive?"
    )]
    OffMap {
        /// Share of rows [%].
        share_percent: f64,
    },
    /// Neither steering nor speed ever change.
    #[error(
        "no excitation: the steering varies by {steering_rad:.4} rad and the speed by {speed_mps:.3} m/s (standard \
         deviations); expected drives with turns and changes of speed"
    )]
    NoExcitation {
        /// Standard deviation of the steering [rad].
        steering_rad: f64,
        /// Standard deviation of the commanded speed [m/s].
        speed_mps: f64,
    },
    /// The steering hardly changes.
    #[error(
        "the steering varies by only {deviation_rad:.4} rad (standard deviation): hardly any steering effect can be told from another"
    )]
    LittleSteering {
        /// Standard deviation [rad].
        deviation_rad: f64,
    },
    /// The speed hardly changes.
    #[error(
        "the commanded speed varies by only {share_percent:.1} % (standard deviation over mean): hardly any effect of the drive can be told from another"
    )]
    LittleSpeedChange {
        /// Standard deviation over mean [%].
        share_percent: f64,
    },
    /// Two drives are one.
    #[error("{one} and {other} are the same drive: a cause cannot be verified on the drive it was found in")]
    SameDrive {
        /// Which.
        one: String,
        /// And which.
        other: String,
    },
}

impl Suspicion {
    /// How grave it is.
    pub fn gravity(&self) -> Gravity {
        match self {
            Self::Missing(_)
            | Self::Gap { .. }
            | Self::Leap { .. }
            | Self::Reset { .. }
            | Self::YawLeap { .. }
            | Self::SideSpeedAgainstPath { .. }
            | Self::Frozen { .. }
            | Self::Stalled { .. }
            | Self::BeyondLimit { .. }
            | Self::OffMap { .. }
            | Self::LittleSteering { .. }
            | Self::LittleSpeedChange { .. } => Gravity::Doubtful,
            _ => Gravity::Refused,
        }
    }
}
