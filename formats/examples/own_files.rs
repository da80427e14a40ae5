//! Files of one's own: a vehicle that starts from a shipped one, a refusal that says what to change, and a drive log
//! that comes back bit by bit.
//!
//! `cargo run -p formats --example own_files`

use std::error::Error;

use bicycle::{Column, DriveLog, DriveRow};
use formats::{
    ConfigText, DriveLogFile, parse_vehicle, read_drive_log_csv, read_vehicle, shipped_vehicle_text,
    write_drive_log_csv,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;

    let shipped = shipped_vehicle_text("rc_car").ok_or("expected the vehicle to ship")?;
    let own = shipped
        .replace("name = \"rc_car\"", "name = \"mine\"")
        .replace("wheelbase_m = 0.18", "wheelbase_m = 0.21");
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, &own)?;
    let vehicle = read_vehicle(path.to_str().ok_or("expected a path in UTF-8")?)?;
    println!(
        "{}: wheelbase {} m, at most {} m/s",
        vehicle.name, vehicle.geometry.wheelbase_m, vehicle.limits.speed_max_mps
    );
    assert_eq!((vehicle.name.as_str(), vehicle.geometry.wheelbase_m), ("mine", 0.21));

    let wrong = own.replace("wheelbase_m = 0.21", "wheelbase_m = -0.21");
    let refusal =
        parse_vehicle(&ConfigText::new("wrong.toml", wrong)).err().ok_or("expected a refusal")?.to_string();
    println!("refused: {refusal}");
    assert!(refusal.contains("geometry.wheelbase_m") && refusal.contains("-0.21"));

    let mut log = DriveLog::default();
    for k in 0..50 {
        let time_s = f64::from(k) * 0.02;
        let row = DriveRow::new(time_s)
            .with(Column::X, 1.5 * time_s)
            .with(Column::Y, 0.0)
            .with(Column::Yaw, 0.0)
            .with(Column::Vx, 1.5)
            .with(Column::CmdSpeed, 1.5);
        log.push("first", &row)?;
    }
    let path = folder.path().join("drive.csv");
    let written = DriveLogFile { log, other_columns: Vec::new() };
    write_drive_log_csv(&path, &written)?;
    let read = read_drive_log_csv(&path)?;
    let columns: Vec<&str> = read.log.columns().map(Column::name).collect();
    println!("drive.csv: {} rows of {}", read.log.n_rows(), columns.join(", "));
    assert_eq!(read.log, written.log);
    Ok(())
}
