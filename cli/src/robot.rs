//! `surefoot robot`: a robot file out of a URDF and a bag.

mod draft;
mod survey;
mod vehicle;

use std::path::Path;

use formats::{ConfigText, UrdfVehicle, parse_robot, parse_vehicle, write_bytes_atomic};

use crate::UsageError;
use crate::arguments::RobotArguments;
use survey::{Kind, Survey};

pub(crate) fn run(arguments: &RobotArguments) -> anyhow::Result<()> {
    let out = &arguments.out;
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let vehicle_name = format!("{stem}_vehicle.toml");
    let vehicle_out = out.with_file_name(&vehicle_name);
    [out.as_path(), &vehicle_out].into_iter().try_for_each(must_be_free)?;
    let urdf = UrdfVehicle::read(&arguments.urdf).map_err(UsageError::from_input)?;
    let survey = Survey::of(&arguments.bag)?;
    if survey.topics.is_empty() {
        let bag = arguments.bag.display();
        let found = survey.ended_early.unwrap_or_else(|| "none of them".to_owned());
        return Err(UsageError(format!("{bag}: expected odometry and clouds of ROS 2, found {found}")).into());
    }
    let vehicle = vehicle::drafted(&urdf);
    let robot = draft::drafted(&urdf, &survey, &vehicle_name);
    parse_vehicle(&ConfigText::new(vehicle_name, vehicle.text.as_str())).map_err(UsageError::from_input)?;
    parse_robot(&ConfigText::new(out.display().to_string(), robot.text.as_str()))
        .map_err(UsageError::from_input)?;
    write_bytes_atomic(&vehicle_out, vehicle.text.as_bytes())?;
    write_bytes_atomic(out, robot.text.as_bytes())?;
    show(arguments, &vehicle_out, &survey, [&vehicle.asked, &robot.asked]);
    Ok(())
}

/// Files that somebody may have gone through are not written over.
fn must_be_free(path: &Path) -> Result<(), UsageError> {
    match path.symlink_metadata() {
        Ok(_) => {
            Err(UsageError(format!("--out: {}: expected a name that is free, found a file", path.display())))
        }
        Err(_) => Ok(()),
    }
}

fn show(arguments: &RobotArguments, vehicle: &Path, survey: &Survey, asked: [&Vec<String>; 2]) {
    let bag = arguments.bag.display();
    survey.ended_early.iter().for_each(|problem| eprintln!("surefoot: {bag}: the bag ends early, {problem}"));
    let n = |kind| survey.of_kind(kind).len();
    println!(
        "{bag}: {} topics of odometry, {} of clouds, {} of inertial samples",
        n(Kind::Odometry),
        n(Kind::Points),
        n(Kind::Imu)
    );
    println!("  {}\n  {}", vehicle.display(), arguments.out.display());
    println!("to be gone through:");
    asked.into_iter().flatten().for_each(|line| println!("  {line}"));
}
