//! The vehicle of a diagnosis, from whichever description there is.

use std::path::Path;

use bicycle::{Column, DriveLog, Vehicle};
use formats::{ConfigText, GapNoise, GapVehicle};
use sim_to_real::{GroundMap, Machine, SensorNoise};

use crate::UsageError;

/// What is known of the machine, with the limits that its drives show where none are stated.
pub(super) fn read(name_or_path: &str, drives: &[DriveLog]) -> Result<Machine, UsageError> {
    let is_shipped = formats::shipped_vehicle_names().any(|shipped| shipped == name_or_path);
    let path = Path::new(name_or_path);
    let is_case_vehicle =
        !is_shipped && !ConfigText::read(path).map_err(UsageError::from_input)?.has_key("geometry");
    if is_case_vehicle {
        let vehicle = formats::read_gap_vehicle(path).map_err(UsageError::from_input)?;
        return Ok(of_case(vehicle, drives));
    }
    Ok(of_vehicle(&formats::read_vehicle(name_or_path).map_err(UsageError::from_input)?))
}

fn of_vehicle(vehicle: &Vehicle) -> Machine {
    Machine {
        name: vehicle.name.clone(),
        wheelbase_m: vehicle.geometry.wheelbase_m,
        steering_max_rad: vehicle.limits.steering_max_rad,
        speed_max_mps: vehicle.limits.speed_max_mps,
        noise: None,
        ground: None,
    }
}

fn of_case(vehicle: GapVehicle, drives: &[DriveLog]) -> Machine {
    let ground = vehicle.ground.map(|ground| GroundMap {
        origin_m: ground.origin_m,
        resolution_m: ground.resolution_m,
        n_nodes: ground.n_nodes,
        height_m: ground.height_m,
        class: ground.class,
    });
    let steering = || largest(drives, &[Column::CmdSteer, Column::SteerMeas]);
    let speed = || largest(drives, &[Column::CmdSpeed, Column::Vx, Column::WheelSpeed]);
    Machine {
        name: vehicle.name,
        wheelbase_m: vehicle.wheelbase_m,
        steering_max_rad: vehicle.steering_max_rad.unwrap_or_else(steering),
        speed_max_mps: vehicle.speed_max_mps.unwrap_or_else(speed),
        noise: noise(&vehicle.noise),
        ground,
    }
}

/// The noise, if all of it is stated.
fn noise(noise: &GapNoise) -> Option<SensorNoise> {
    Some(SensorNoise {
        position_m: (0.5 * (noise.x?.powi(2) + noise.y?.powi(2))).sqrt(),
        yaw_rad: noise.yaw?,
        speed_mps: noise.vx?,
        yaw_rate_radps: noise.wz?,
    })
}

/// The largest size of the first of these columns that a drive has.
fn largest(drives: &[DriveLog], columns: &[Column]) -> f64 {
    let runs = drives.iter().flat_map(DriveLog::runs);
    let values = runs.filter_map(|run| columns.iter().find_map(|column| run.column(*column)));
    values.flatten().fold(0.0, |largest: f64, value| largest.max(value.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::DriveRow;

    #[test]
    fn limits_that_are_not_stated_are_those_of_the_drives() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("v.toml");
        std::fs::write(
            &path,
            "name = \"v\"\nwheelbase = 1.5\n[noise]\nx = 0.03\ny = 0.04\nyaw = 1e-3\nvx = 0.1\nwz = 0.2\n",
        )
        .unwrap();
        let mut drive = DriveLog::default();
        drive
            .push("", &DriveRow::new(0.0).with(Column::SteerMeas, -0.4).with(Column::CmdSpeed, 3.0))
            .unwrap();
        let machine = read(path.to_str().unwrap(), &[drive]).unwrap();
        assert_eq!((machine.steering_max_rad, machine.speed_max_mps, machine.wheelbase_m), (0.4, 3.0, 1.5));
        let position_m = machine.noise.unwrap().position_m;
        assert!((position_m - (0.5_f64 * (0.0009 + 0.0016)).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_vehicle_of_drive_serves_by_name_and_by_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("v.toml");
        std::fs::write(&path, formats::shipped_vehicle_text("sedan").unwrap()).unwrap();
        let [by_name, by_file] = ["sedan", path.to_str().unwrap()].map(|vehicle| read(vehicle, &[]).unwrap());
        assert_eq!(by_name, by_file);
        assert!(read("sedna", &[]).unwrap_err().0.contains("sedna: expected a readable text file"));
    }
}
