//! A car that drives 0.85 of every curvature teaches which one to command.
//!
//! `cargo run -p kinodynamics --example learn_understeer`

use std::error::Error;
use std::ops::ControlFlow;

use bicycle::ImuSample;
use bicycle::lanes::Instructions;
use kinodynamics::{
    Architecture, Desired, InverseModel, PERIOD_NS, RecordedRun, Recording, Settings, Tick, VehicleSummary,
    train,
};

/// Share of a commanded curvature that the car drives.
const DRIVEN: f32 = 0.85;

/// Numbers between -1 and 1 that look random.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// A minute of commands that change every half second, and what the car's unit measures meanwhile.
fn minute(noise: &mut Noise) -> RecordedRun {
    let mut run = RecordedRun::default();
    let (mut speed_mps, mut curvature_per_m) = (1.5, 0.0);
    for k in 0..1200u64 {
        if k % 10 == 0 {
            (speed_mps, curvature_per_m) = (1.6 + 0.8 * noise.next(), 0.9 * noise.next());
        }
        let (time_ns, wheel_speed_mps) = (k * 10 * PERIOD_NS, speed_mps);
        let yaw_rate_radps = DRIVEN * speed_mps * curvature_per_m;
        run.ticks.push(Tick {
            time_ns,
            speed_mps,
            curvature_per_m,
            wheel_speed_mps,
            yaw_rate_radps,
            ground: None,
        });
        for sample in 1..=10 {
            run.imu.push(ImuSample {
                valid_at_ns: time_ns + sample * PERIOD_NS,
                acceleration_mps2: [noise.next(), noise.next(), 9.81 + noise.next()],
                angular_rate_radps: [0.0, 0.0, yaw_rate_radps],
            });
        }
    }
    run
}

fn main() -> Result<(), Box<dyn Error>> {
    let noise = &mut Noise(1);
    let recording = Recording {
        vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.324, steering_max_rad: 0.6 },
        tick_s: 0.05,
        grounds: Vec::new(),
        runs: (0..3).map(|_| minute(noise)).collect(),
    };
    let paper = Settings::paper(Architecture::ABLATION, 1);
    let settings = Settings { epochs: 25, learning_rate: 1e-3, ..paper };
    let trained = train(&recording, &settings, "example", &mut |_| ControlFlow::Continue(()))?;
    let mut model = InverseModel::new(&trained.checkpoint, Instructions::widest())?;
    let commanded = model.command(Desired { speed_mps: 1.6, curvature_per_m: 0.6 }).curvature_per_m;
    println!("to drive 0.6 1/m, command {commanded:.3} 1/m ({:.3} would do)", 0.6 / DRIVEN);
    assert!((commanded - 0.6 / DRIVEN).abs() < 0.04, "{commanded}");
    Ok(())
}
