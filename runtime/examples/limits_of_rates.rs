//! How often the parts of a robot speak decides how old what they say may be: a slow lidar is waited for longer, and an age
//! that contradicts the rates is refused.
//!
//! `cargo run -p runtime --example limits_of_rates`

use std::error::Error;

use bus::ages::Periods;
use runtime::ages::{AskedAges, guard, limits};

fn main() -> Result<(), Box<dyn Error>> {
    let usual = Periods::default();
    let slow = Periods { scan_s: 0.5, odometry_s: 0.1, ..usual };
    for periods in [usual, slow] {
        let (guard, ages) = (guard(&periods), limits(&periods, &guard(&periods), &AskedAges::default())?);
        println!(
            "scans every {} s: driven on for {} s; commands followed for {:.2} s",
            periods.scan_s,
            guard.scan_age_max_s,
            1e-9 * ages.command_ns as f64
        );
    }
    assert_eq!(guard(&usual).scan_age_max_s, 1.0);
    // Five scans of the slow lidar.
    assert_eq!(guard(&slow).scan_age_max_s, 2.5);

    // With a decision every 0.1 s, one of odometry that is 0.1 s old is 0.2 s old before the next.
    let hasty = AskedAges::of_command(Some(0.2));
    let refusal = limits(&slow, &guard(&slow), &hasty).err().map(|error| error.to_string());
    println!("refused: {}", refusal.as_deref().unwrap_or("nothing"));
    assert!(
        refusal
            .is_some_and(|told| told.contains("expected more than 0.200 s") && told.contains("found 0.2 s"))
    );
    Ok(())
}
