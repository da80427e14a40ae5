//! Both ends of a channel: whoever runs the vehicle tells over shared memory where it is, and another process reads that
//! in place. What cannot be is refused and counted. Here both ends are one process.
//!
//! `cargo run -p bus --example publish_and_read`

use std::error::Error;

use bus::channel::{Bus, ODOMETRY, RunName};
use bus::clock;
use bus::message::{OdometryRecord, Stamp};

fn main() -> Result<(), Box<dyn Error>> {
    // Processes of one run find one another by its name.
    let run: RunName = format!("example-{}", std::process::id()).parse()?;
    let bus = Bus::join(&run)?;
    let mut inlet = bus.inlet(&ODOMETRY)?;
    let mut outlet = bus.outlet(&ODOMETRY, 1)?;

    let at = |x_m: f64| OdometryRecord { position_m: [x_m, 0.0, 0.0], ..OdometryRecord::default() };
    for x_m in [0.0, 0.5, 1.0] {
        outlet.send_one(Stamp::default(), at(x_m), clock::now_ns())?;
    }
    // Nobody knows today where the vehicle will be in a second.
    outlet.send_one(Stamp::default(), at(9.0), clock::now_ns() + clock::SECOND_NS)?;

    let mut read_m = Vec::new();
    inlet.poll(|stamp, records| {
        let age_ms = clock::now_ns().saturating_sub(stamp.valid_at_ns) as f64 * 1e-6;
        println!("message {}: at x = {:.1} m, {age_ms:.1} ms ago", stamp.sequence, records[0].position_m[0]);
        read_m.push(records[0].position_m[0]);
    });
    println!("{} refused", inlet.counts().n_refused());
    assert_eq!(read_m, [0.0, 0.5, 1.0]);
    assert_eq!(inlet.counts().n_refused(), 1);
    Ok(())
}
