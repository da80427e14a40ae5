//! Recorded drives from whatever holds them: CSV files, recordings of our own, bags of ROS 2.

use std::path::Path;

use bicycle::{DriveLog, Vehicle};
use formats::{Bag, ColumnNames, DriveFileError, RobotRos, read_robot, read_vehicle};
use ros::bag::{LogTopics, Robot, drive_log};

use crate::UsageError;

/// What the columns of CSV files and the topics of bags are called.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mapping {
    columns: ColumnNames,
    topics: LogTopics,
    robot: Option<(RobotRos, Vehicle)>,
}

impl Mapping {
    /// From words of the form `ours=theirs`, and for bags from a robot file with a part `[ros]`. Words of topics go before
    /// those of the file.
    pub fn of(option: &str, words: &[String], robot: Option<&Path>) -> Result<Self, UsageError> {
        let robot = robot.map(read_ros).transpose()?;
        let mut topics = robot.as_ref().map(|(ros, _)| LogTopics::of_robot(ros)).unwrap_or_default();
        let told = |problem: String| UsageError(format!("{option}: {problem}"));
        let words = words.iter().map(String::as_str);
        let of_columns = topics.take_out(words).map_err(|error| told(error.to_string()))?;
        let columns = ColumnNames::parse(of_columns).map_err(|error| told(error.to_string()))?;
        Ok(Self { columns, topics, robot })
    }
}

/// The topics and the vehicle of a robot file.
fn read_ros(path: &Path) -> Result<(RobotRos, Vehicle), UsageError> {
    let robot = read_robot(path).map_err(UsageError::from_input)?;
    let vehicle = read_vehicle(&robot.vehicle).map_err(UsageError::from_input)?;
    let missing =
        || UsageError(format!("{}: expected a robot file with a part [ros], found none", path.display()));
    Ok((robot.ros.ok_or_else(missing)?, vehicle))
}

/// Reads a drive, out of several files where [`formats::drive_parts`] says so; what they leave out is told in `doubts`.
pub(crate) fn read(path: &Path, mapping: &Mapping, doubts: &mut Vec<String>) -> Result<DriveLog, UsageError> {
    let parts = formats::drive_parts(path);
    let mut logs =
        parts.iter().map(|part| read_part(part, mapping, doubts)).collect::<Result<Vec<_>, _>>()?;
    if logs.len() == 1 {
        return Ok(logs.remove(0));
    }
    DriveLog::joined(&logs).map_err(|error| UsageError(format!("{}: {error}", path.display())))
}

fn read_part(path: &Path, mapping: &Mapping, doubts: &mut Vec<String>) -> Result<DriveLog, UsageError> {
    let mut doubt = |what: String| doubts.push(format!("{}: {what}", path.display()));
    let early = |problem: String| format!("the recording ends early, {problem}");
    if !Bag::is_at(path) {
        let drive = formats::read_drive_named(path, &mapping.columns).map_err(|error| match error {
            DriveFileError::Ending { file } => UsageError(format!(
                "{file}: expected a drive, a file ending in .csv or .mcap or a bag of ROS 2, found another"
            )),
            error => UsageError::from_input(error),
        })?;
        drive.ended_early.map(early).into_iter().for_each(&mut doubt);
        return Ok(drive.log);
    }
    let bag = Bag::open(path).map_err(UsageError::from_input)?;
    let robot = mapping.robot.as_ref().map(|(ros, vehicle)| Robot { ros, vehicle });
    let drive = drive_log(&bag, &mapping.topics, robot)
        .map_err(|error| UsageError(format!("{}: {error}", path.display())))?;
    drive.ended_early.map(early).into_iter().chain(drive.notes).for_each(&mut doubt);
    Ok(drive.log)
}
