//! The two ends of a run: one process tells where the vehicle is over shared memory, another reads it in place; and the
//! last word before the actuators, which stops the vehicle when commands stay away.
//!
//! `cargo run -p runtime --example watch_commands`

use std::error::Error;

use bicycle::{Command, Decision, StopReason};
use runtime::channel::{Bus, ODOMETRY, RunName};
use runtime::clock;
use runtime::message::{OdometryRecord, Stamp};
use runtime::watchdog::Watchdog;

fn main() -> Result<(), Box<dyn Error>> {
    // Processes of one run find one another by its name; here both ends are one process.
    let run: RunName = format!("example-{}", std::process::id()).parse()?;
    let bus = Bus::join(&run)?;
    let mut inlet = bus.inlet(&ODOMETRY)?;
    let mut outlet = bus.outlet(&ODOMETRY, 1)?;
    for k in 0..3 {
        let record =
            OdometryRecord { position_m: [0.5 * f64::from(k), 0.0, 0.0], ..OdometryRecord::default() };
        outlet.send_one(Stamp::default(), record, clock::now_ns())?;
    }
    let mut read_m = Vec::new();
    inlet.poll(|stamp, records| {
        println!("message {}: at x = {:.1} m", stamp.sequence, records[0].position_m[0]);
        read_m.push(records[0].position_m[0]);
    });
    assert_eq!(read_m, [0.0, 0.5, 1.0]);

    let limits = formats::read_vehicle("rc_car")?.limits;
    let mut watchdog = Watchdog::new(limits, 300_000_000);
    let command = Decision::Drive(Command { speed_mps: 1.0, steering_rad: 0.1 });
    watchdog.admit(command, 0);
    for age_ms in [100, 300, 301] {
        println!("{age_ms} ms after the last command: {:?}", watchdog.decision(age_ms * 1_000_000));
    }
    assert_eq!(watchdog.decision(300_000_000), command);
    assert_eq!(watchdog.decision(301_000_000), Decision::Stop(StopReason::StaleCommand));
    Ok(())
}
