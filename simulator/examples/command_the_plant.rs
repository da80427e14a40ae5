//! The simulated vehicle is a driver like that of any robot: it says where it is, follows commands for as long as what they
//! were decided on is young, and stops when they end.
//!
//! `cargo run -p simulator --example command_the_plant`

use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};

use bicycle::{Command, Decision};
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, COMMAND, ODOMETRY, RunName};
use bus::clock::{SECOND_NS, now_ns, sleep_until};
use bus::message::{CommandRecord, Stamp};
use scenarios::{ArenaConfig, EpisodeConfig, Task};
use simulator::{Ending, PlantSetup};

fn main() -> Result<(), Box<dyn Error>> {
    let run: RunName = format!("plant-{}", std::process::id()).parse()?;
    let is_over = AtomicBool::new(false);
    let [driven_mps, left_mps] = std::thread::scope(|scope| {
        let plant = scope.spawn(|| simulate(&run, &is_over));
        let speeds = command(&run);
        is_over.store(true, Ordering::Relaxed);
        plant.join().map_err(|_| "the plant panicked".to_owned())??;
        speeds
    })?;
    println!("{driven_mps:.2} m/s while it was commanded, {left_mps:.2} m/s a second after");
    assert!(driven_mps > 0.3 && left_mps.abs() < 0.05);
    Ok(())
}

fn simulate(run: &RunName, is_over: &AtomicBool) -> Result<(), String> {
    let told = |error: &dyn Error| error.to_string();
    let vehicle = formats::read_vehicle("rc_car").map_err(|error| told(&error))?;
    let setup = PlantSetup {
        task: Task::arena(&ArenaConfig::default()).map_err(|error| told(&error))?,
        vehicle: &vehicle,
        episode: EpisodeConfig::for_vehicle(&vehicle),
        ending: Ending::Never,
        seed: 1,
        periods: Periods::default(),
        ages: ages(),
    };
    let bus = Bus::join(run).map_err(|error| told(&error))?;
    simulator::run(&bus, setup, &|| is_over.load(Ordering::Relaxed)).map_err(|error| told(&error))?;
    Ok(())
}

/// A command is followed for 0.3 s after the odometry that it was decided on.
fn ages() -> AgeLimits {
    let [command_ns, scan_ns] = [3 * SECOND_NS / 10, SECOND_NS];
    AgeLimits {
        command_ns,
        scan_ns,
        learned_ns: SECOND_NS,
        learning_silence_ns: SECOND_NS,
        mission_ns: SECOND_NS,
        order_ns: SECOND_NS,
    }
}

/// Commands half a metre per second for a second, then nothing; returns the speeds at the end of either [m/s].
fn command(run: &RunName) -> Result<[f64; 2], Box<dyn Error>> {
    let bus = Bus::join(run)?;
    let (mut odometry, mut commands) = (bus.inlet(&ODOMETRY)?, bus.outlet(&COMMAND, 1)?);
    let decision = Decision::Drive(Command { speed_mps: 0.5, steering_rad: 0.0 });
    let mut speeds_mps = [0.0; 2];
    for (speed_mps, is_commanded) in speeds_mps.iter_mut().zip([true, false]) {
        // The plant may still build its world.
        let mut until_ns = now_ns() + 60 * SECOND_NS;
        let mut has_begun = false;
        while now_ns() < until_ns {
            let mut measured_at_ns = None;
            odometry.poll(|stamp, records| {
                measured_at_ns = Some(stamp.valid_at_ns);
                *speed_mps = records[0].velocity_mps[0];
            });
            if let Some(at_ns) = measured_at_ns {
                until_ns = if has_begun { until_ns } else { now_ns() + SECOND_NS };
                has_begun = true;
                if is_commanded {
                    let record = CommandRecord::from(&decision).decided_on(at_ns, at_ns);
                    commands.send_one(Stamp::default(), record, now_ns())?;
                }
            }
            sleep_until(now_ns() + SECOND_NS / 50);
        }
    }
    Ok(speeds_mps)
}
