//! Why simulator and robot disagree: two drives of the simulator's plant, one of a robot whose steering commands wait
//! 0.2 s longer, and the diagnosis names the effect without having seen the plant. Less than a minute of driving in all
//! keeps this short; more drives make narrower intervals.
//!
//! `cargo run -p sim_to_real --example diagnose_a_delay`

use std::error::Error;

use bicycle::DriveLog;
use scenarios::{Deviation, Style, TestMachine, test_drive};
use sim_to_real::{Baseline, Machine, SensorNoise, diagnose, verify};

const ADDED_S: f64 = 0.2;
const DRIVE_S: f64 = 12.0;

/// The first seconds of a drive.
fn beginning(log: &DriveLog) -> Result<DriveLog, Box<dyn Error>> {
    let mut short = DriveLog::default();
    for row in log.runs().flat_map(|run| run.drive_rows()).filter(|row| row.time_s < DRIVE_S) {
        short.push("", &row)?;
    }
    Ok(short)
}

fn main() -> Result<(), Box<dyn Error>> {
    let plant = TestMachine::draw(&formats::read_vehicle("rc_car")?, "car", 3)?;
    let late = [Deviation::SteeringDelay { added_s: ADDED_S }];
    let drive =
        |deviations: &[Deviation], seed: u64| beginning(&test_drive(&plant, deviations, Style::Rich, seed)?);
    let sim = [drive(&[], 1)?, drive(&[], 2)?];
    let real = [drive(&late, 11)?];
    let heldout = [drive(&late, 21)?];

    // What the owner of the simulator would tell of the machine; your own drives come from
    // `formats::read_drive_log_csv`.
    let sensors = &plant.sensors;
    let machine = Machine {
        name: plant.vehicle.name.clone(),
        wheelbase_m: plant.vehicle.geometry.wheelbase_m,
        steering_max_rad: plant.steering_max_rad,
        speed_max_mps: plant.speeds_mps[1],
        noise: Some(SensorNoise {
            position_m: sensors.position_noise_m,
            yaw_rad: sensors.attitude_noise_rad,
            speed_mps: sensors.velocity_noise_mps,
            yaw_rate_radps: sensors.yaw_rate_noise_radps,
        }),
        ground: None,
    };
    let baseline = Baseline::calibrate(&machine, &sim, &|_| ())?;
    let diagnosis = diagnose(&baseline, &machine, &real)?;
    for effect in &diagnosis.named {
        println!("{} with {:?}", effect.id, effect.parameters);
    }
    let verified = verify(&baseline, &machine, &diagnosis, &heldout)?;
    let [before, after] = verified.errors;
    println!(
        "error on the held-out drive: {before:.2} standard deviations before, {after:.2} after the repair"
    );

    let named = diagnosis.named.first().ok_or("expected an effect to be named")?;
    assert_eq!(named.id, "steer_delay");
    let found = named.parameters["delay_s"];
    assert!((found.value - ADDED_S).abs() < 0.05, "{found:?}");
    assert!(after < 0.6 * before);
    Ok(())
}
