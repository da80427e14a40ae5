//! A car that turns less on rough ground than on smooth learns which curvature to command on each.
//!
//! `cargo run -p kinodynamics --example command_for_the_ground`

use std::error::Error;
use std::ops::ControlFlow;

use bicycle::ImuSample;
use bicycle::lanes::Instructions;
use kinodynamics::{
    Answer, Architecture, Desired, InverseModel, PERIOD_NS, RecordedRun, Recording, Sensing, Settings, Tick,
    VehicleSummary, WINDOW, train,
};

/// Numbers between -1 and 1 that look random.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// A minute on which the ground changes every four seconds: the car does 0.95 of a curvature on smooth and 0.8 on rough ground.
fn minute(noise: &mut Noise) -> RecordedRun {
    let mut run = RecordedRun::default();
    let (mut speed_mps, mut curvature_per_m, mut is_rough) = (1.5, 0.0, false);
    for k in 0..1200u64 {
        if k % 80 == 0 {
            is_rough = noise.next() > 0.0;
        }
        if k % 10 == 0 {
            (speed_mps, curvature_per_m) = (1.6 + 0.8 * noise.next(), 0.9 * noise.next());
        }
        let yaw_rate_radps = speed_mps * curvature_per_m * if is_rough { 0.8 } else { 0.95 };
        let (time_ns, ground) = (k * 10 * PERIOD_NS, Some(u32::from(is_rough)));
        let wheel_speed_mps = speed_mps;
        run.ticks.push(Tick { time_ns, speed_mps, curvature_per_m, wheel_speed_mps, yaw_rate_radps, ground });
        for sample in 1..=10 {
            let mut felt = felt(is_rough, noise);
            felt.valid_at_ns = time_ns + sample * PERIOD_NS;
            felt.angular_rate_radps[2] = yaw_rate_radps;
            run.imu.push(felt);
        }
    }
    run
}

fn felt(is_rough: bool, noise: &mut Noise) -> ImuSample {
    let shake = if is_rough { 4.0 } else { 0.4 };
    let acceleration_mps2 = [shake * noise.next(), shake * noise.next(), 9.81 + shake * noise.next()];
    ImuSample { acceleration_mps2, ..ImuSample::default() }
}

fn main() -> Result<(), Box<dyn Error>> {
    let noise = &mut Noise(1);
    let recording = Recording {
        vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.324, steering_max_rad: 0.6 },
        tick_s: 0.05,
        grounds: vec!["smooth".into(), "rough".into()],
        runs: (0..3).map(|_| minute(noise)).collect(),
    };
    // Three minutes are little: a wider embedding and larger steps than the paper's.
    let architecture = Architecture { sensing: Sensing::Imu { embedding: 16 }, answer: Answer::Curvature };
    let settings = Settings { epochs: 25, learning_rate: 1e-3, ..Settings::paper(architecture, 1) };
    let trained = train(&recording, &settings, "example", &mut |_| ControlFlow::Continue(()))?;
    let mut model = InverseModel::new(&trained.checkpoint, Instructions::widest())?;
    let wish = Desired { speed_mps: 1.6, curvature_per_m: 0.6 };
    let mut commanded = [0.0; 2];
    for (is_rough, commanded) in [false, true].into_iter().zip(&mut commanded) {
        let samples: Vec<[f32; 6]> = (0..WINDOW)
            .map(|_| {
                let [x, y, z] = felt(is_rough, noise).acceleration_mps2;
                [0.0, 0.0, 0.8, x, y, z]
            })
            .collect();
        model.sense(samples.iter());
        *commanded = model.command(wish).curvature_per_m;
    }
    println!(
        "for 0.6 1/m: {:.3} on smooth ground (0.632 would do), {:.3} on rough (0.75)",
        commanded[0], commanded[1]
    );
    assert!(commanded[0] > 0.58 && commanded[0] < commanded[1] - 0.05, "{commanded:?}");
    Ok(())
}
