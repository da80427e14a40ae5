//! The vehicle of a diagnosis, from whichever description there is.

use bicycle::DriveLog;
use sim_to_real::Machine;

use crate::UsageError;

/// What is known of the machine, with the limits that its drives show where none are stated.
pub(super) fn read(name_or_path: &str, drives: &[DriveLog]) -> Result<Machine, UsageError> {
    let vehicle = formats::read_described_vehicle(name_or_path).map_err(UsageError::from_input)?;
    Ok(Machine::described(vehicle, drives))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::{Column, DriveRow};

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
