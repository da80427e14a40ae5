//! `surefoot train friction`: drives read, friction found, the table written.

mod pictures;

use std::path::Path;

use bicycle::DriveLog;
use formats::{ColumnNames, read_drive_log_csv_named, read_vehicle};
use friction::{Chassis, Drive, FrictionCurve, FrictionTable, Grip, find_friction};

use crate::UsageError;
use crate::arguments::TrainFrictionArguments;

/// Name of the column that holds the class of the ground.
const GROUND: &str = "ground";
/// What is written.
const TABLE: &str = "friction.toml";

/// A drive that was read: the log and the name of the ground in each row.
struct Named {
    log: DriveLog,
    grounds: Vec<String>,
}

pub(crate) fn run_friction(arguments: &TrainFrictionArguments) -> anyhow::Result<()> {
    let vehicle = read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    if arguments.train.iter().any(|word| pictures::is_recording(word)) {
        return pictures::run(arguments, &Chassis::of(&vehicle));
    }
    let names =
        ColumnNames::parse(arguments.columns.iter().map(String::as_str)).map_err(UsageError::from_input)?;
    let drives =
        arguments.train.iter().map(|word| read(word, &names)).collect::<Result<Vec<_>, UsageError>>()?;
    arguments.results.prepare()?;
    let classes = classes(&drives);
    let indices: Vec<Vec<usize>> = drives.iter().map(|drive| indices(drive, &classes)).collect();
    let logs: Vec<Drive<'_>> =
        drives.iter().zip(&indices).map(|(drive, classes)| Drive { log: &drive.log, classes }).collect();
    let found = find_friction(&Chassis::of(&vehicle), &classes, &logs).map_err(UsageError::from_input)?;
    let table = FrictionTable { vehicle: vehicle.name, ground: found.grounds };
    print!("{}", text(&table));
    let toml = formats::toml_text(&table)?;
    arguments.results.write(TABLE, toml.as_bytes())?;
    arguments.results.copy.write(&table)?;
    println!("\n  {TABLE} in {}", arguments.results.out.display());
    Ok(())
}

/// FILE with a column of grounds, or FILE=GROUND.
fn read(word: &str, names: &ColumnNames) -> Result<Named, UsageError> {
    let (path, ground) = match word.rsplit_once('=') {
        Some((path, ground)) => (path, Some(ground)),
        None => (word, None),
    };
    let file = read_drive_log_csv_named(Path::new(path), names).map_err(UsageError::from_input)?;
    let column = file.other_columns.into_iter().find(|column| column.name == GROUND);
    let grounds = match (ground, column) {
        (Some(ground), _) => vec![ground.to_owned(); file.log.n_rows()],
        (None, Some(column)) => column.cells,
        (None, None) => {
            return Err(UsageError(format!(
                "{path}: expected a column '{GROUND}' or {path}=GROUND, found neither"
            )));
        }
    };
    if let Some((row, found)) =
        grounds.iter().enumerate().find(|(_, name)| FrictionCurve::published(name).is_none())
    {
        let known = FrictionCurve::names();
        return Err(UsageError(format!(
            "{path}: row {}: {GROUND}: expected {known}, found '{found}'",
            row + 1
        )));
    }
    Ok(Named { log: file.log, grounds })
}

/// The grounds that were driven on, in the order of the published table.
fn classes(drives: &[Named]) -> Vec<(&'static str, FrictionCurve)> {
    let is_driven = |name: &str| drives.iter().any(|drive| drive.grounds.iter().any(|ground| ground == name));
    FrictionCurve::PUBLISHED.into_iter().filter(|(name, _)| is_driven(name)).collect()
}

fn indices(drive: &Named, classes: &[(&str, FrictionCurve)]) -> Vec<usize> {
    let index = |name: &String| classes.iter().position(|(class, _)| class == name).unwrap_or(0);
    drive.grounds.iter().map(index).collect()
}

fn text(table: &FrictionTable) -> String {
    let mut text = format!(
        "  friction that the drives of {} showed, at the sliding speed of the drive\n\n",
        table.vehicle
    );
    for row in &table.ground {
        let told = match row.grip {
            Grip::Measured { sliding_mps, friction, low, high } => {
                format!("{friction:.2} at {sliding_mps:.1} m/s, 90 % {low:.2} to {high:.2}")
            }
            Grip::AtLeast { friction } => format!("at least {friction:.2}; never near its limit"),
        };
        let (driven_s, at_limit_s) = (row.driven_s, row.at_limit_s);
        text += &format!(
            "    {:<9}{told:<36}{driven_s:6.1} s driven, {at_limit_s:.1} s of it at the limit\n",
            row.ground
        );
    }
    text
}
