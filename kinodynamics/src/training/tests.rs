use bicycle::ImuSample;
use bicycle::lanes::Instructions;

use super::data::Half;
use super::network::Network;
use super::*;
use crate::architecture::Answer;
use crate::architecture::Sensing;
use crate::history::PERIOD_NS;
use crate::model::Desired;
use crate::model::InverseModel;
use crate::recording::{RecordedRun, Tick, VehicleSummary};
use candle_core::{Device, Var};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A vehicle that does 0.95 of what it is told on ground that does not shake it, and 0.8 on ground that does; the driver
/// changes the command every half second, the ground every four.
pub(crate) fn two_grounds(n_runs: usize) -> Recording {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let run = |rng: &mut Xoshiro256PlusPlus| {
        let (mut run, mut command, mut is_rough) = (RecordedRun::default(), [1.5f32, 0.0], false);
        for k in 0..1200u64 {
            if k % 80 == 0 {
                is_rough = rng.random_bool(0.5);
            }
            if k % 10 == 0 {
                command = [rng.random_range(0.8..2.5), rng.random_range(-0.9..0.9)];
            }
            run.ticks.push(Tick {
                time_ns: k * 10 * PERIOD_NS,
                speed_mps: command[0],
                curvature_per_m: command[1],
                wheel_speed_mps: command[0],
                yaw_rate_radps: command[0] * command[1] * if is_rough { 0.8 } else { 0.95 },
                ground: Some(u32::from(is_rough)),
            });
        }
        for k in 0..12_000u64 {
            let tick = run.ticks[(k.saturating_sub(16) / 10) as usize];
            let shake = if tick.ground == Some(1) { 3.0 } else { 0.3 };
            let mut noise = || shake * (rng.random_range(-1.0..1.0f32) + rng.random_range(-1.0..1.0));
            run.imu.push(ImuSample {
                valid_at_ns: k * PERIOD_NS,
                acceleration_mps2: [noise(), noise(), 9.81 + noise()],
                angular_rate_radps: [0.0, 0.0, tick.yaw_rate_radps],
            });
        }
        run
    };
    Recording {
        vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.3, steering_max_rad: 0.5 },
        tick_s: 0.05,
        grounds: vec!["smooth".into(), "rough".into()],
        runs: (0..n_runs).map(|_| run(&mut rng)).collect(),
    }
}

use rand::RngExt;

fn settings(sensing: Sensing, epochs: usize) -> Settings {
    let architecture = Architecture { sensing, answer: Answer::Curvature };
    Settings { epochs, ..Settings::paper(architecture, 1) }
}

fn error(recording: &Recording, settings: &Settings) -> f64 {
    let outcome = train(recording, settings, "test", &mut |_| ControlFlow::Continue(())).unwrap();
    let errors = outcome.curves.iter().map(|epoch| epoch.validation_rmse_per_m);
    errors.fold(f64::INFINITY, f64::min)
}

#[test]
fn blind_model_is_off_by_what_it_cannot_know() {
    let blind = error(&two_grounds(4), &settings(Sensing::Blind, 12));
    // Who does not know whether 0.95 or 0.8 is driven of a command c is off by about (1 / 0.8 - 1 / 0.95) / 2 = 0.1 of what
    // is driven, 0.45 in the mean square: 0.044.
    assert!((0.035..0.055).contains(&blind), "{blind}");
}

/// What is off on the chosen blocks, to the square, beyond what stays off for who knows the ground and divides by its share.
fn error_by_ground(recording: &Recording, settings: &Settings) -> f64 {
    let latency = estimate_latency(recording).unwrap();
    let (examples, _) = label(recording, &settings.labels.after(&latency));
    let places = block_split(&examples, settings.seed).validation;
    let known = |place: &usize| {
        let Example { commanded, driven, ground, .. } = &examples[*place];
        f64::from(commanded[0] - driven[1] / if *ground == Some(1) { 0.8 } else { 0.95 }).powi(2)
    };
    error(recording, settings).powi(2) - places.iter().map(known).sum::<f64>() / places.len() as f64
}

/// Which ground it is shows in the unit's shaking and in nothing else: who hears it finds most of what nobody can know who
/// does not.
#[test]
fn ground_that_only_the_unit_can_tell_is_learned() {
    let recording = two_grounds(3);
    let sensing = Sensing::Imu { embedding: 2 };
    let blind = error_by_ground(&recording, &settings(Sensing::Blind, 8));
    let learned = error_by_ground(&recording, &settings(sensing, 8));
    let shuffled = Settings { history: History::Shuffled, ..settings(sensing, 8) };
    let shuffled = error_by_ground(&recording, &shuffled);
    println!("blind {blind:.2e}, learned {learned:.2e}, of shuffled histories {shuffled:.2e} 1/m2");
    assert!(learned < 0.4 * blind, "{learned} of {blind}");
    assert!(shuffled > 0.8 * blind, "{shuffled} of {blind}");
}

/// Who is told which ground it is leaves off little of what the blind one cannot know, and answers from flat weights.
#[test]
fn ground_that_is_told_is_learned() {
    let recording = two_grounds(3);
    let latency_s = estimate_latency(&recording).unwrap().seconds;
    let (mut examples, _) = label(&recording, &LabelConfig::paper(latency_s));
    for example in &mut examples {
        example.window = vec![if example.ground == Some(1) { 1.0 } else { 0.0 }];
    }
    let outcome = |sensing| {
        train_without_history(&examples, &settings(sensing, 8), &mut |_| ControlFlow::Continue(())).unwrap()
    };
    let error = |outcome: &Outcome| {
        outcome.curves.iter().map(|epoch| epoch.validation_rmse_per_m).fold(f64::INFINITY, f64::min)
    };
    let (blind, told) = (outcome(Sensing::Blind), outcome(Sensing::Told { numbers: 1 }));
    println!("blind {:.4}, told {:.4} 1/m", error(&blind), error(&told));
    assert!(error(&told) < 0.7 * error(&blind));
    let mut model = InverseModel::new(&told.checkpoint, Instructions::widest()).unwrap();
    let mut command = |ground: f32| {
        model.tell(&[ground]);
        model.command(Desired { speed_mps: 1.5, curvature_per_m: 0.6 }).curvature_per_m
    };
    // 0.6 / 0.95 = 0.632 and 0.6 / 0.8 = 0.75.
    let (smooth, rough) = (command(0.0), command(1.0));
    assert!((smooth - 0.632).abs() < 0.04 && (rough - 0.75).abs() < 0.04, "{smooth} {rough}");
    let refused =
        train(&recording, &settings(Sensing::Told { numbers: 1 }, 1), "", &mut |_| ControlFlow::Continue(()));
    assert!(refused.unwrap_err().to_string().starts_with("numbers told: expected none"));
    let refused = train_without_history(&examples, &settings(Sensing::Told { numbers: 2 }, 1), &mut |_| {
        ControlFlow::Continue(())
    });
    assert!(refused.unwrap_err().to_string().ends_with("found 1"));
}

/// Of 0.8 of what was commanded, with noise of 0.3 1/m, examples teach less than the wish asks for and a forward model all of
/// it. Commands c are uniform up to 0.9: of all that lead to 0.4 the mean is that of a normal distribution of mean
/// 0.4 / 0.8 = 0.5 and deviation 0.3 / 0.8 = 0.375, cut off at 0.9, (0.9 - 0.5) / 0.375 = 1.07 deviations above it:
/// 0.5 - 0.375 x 0.226 / 0.857 = 0.40.
#[test]
fn noise_of_what_is_driven_shrinks_what_examples_teach_and_not_what_a_forward_model_does() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let example = |k: usize| {
        let commanded_per_m = rng.random_range(-0.9..0.9f32);
        let noise: f32 = rng.sample(rand_distr::StandardNormal);
        Example {
            time_s: 0.05 * (k % 1200) as f64,
            driven: [1.5, 0.8 * commanded_per_m + 0.3 * noise],
            commanded: [commanded_per_m, 1.5],
            window: Vec::new(),
            run: k / 1200,
            ground: None,
        }
    };
    let examples: Vec<Example> = (0..12_000).map(example).collect();
    let answer = |teacher| {
        let settings = Settings { teacher, ..settings(Sensing::Blind, 10) };
        let outcome =
            train_without_history(&examples, &settings, &mut |_| ControlFlow::Continue(())).unwrap();
        let mut model = InverseModel::new(&outcome.checkpoint, Instructions::widest()).unwrap();
        model.command(Desired { speed_mps: 1.5, curvature_per_m: 0.4 }).curvature_per_m
    };
    let (shrunk, whole) = (answer(Teacher::Examples), answer(Teacher::ForwardModel));
    println!("examples {shrunk:.3}, forward model {whole:.3} 1/m");
    assert!((shrunk - 0.40).abs() < 0.03 && (whole - 0.50).abs() < 0.05, "{shrunk} {whole}");
}

#[test]
fn forward_model_teaches_no_speeds() {
    let architecture = Architecture { answer: Answer::SpeedAndCurvature, ..Architecture::ABLATION };
    let settings = Settings { teacher: Teacher::ForwardModel, ..Settings::paper(architecture, 1) };
    let refused = train(&two_grounds(1), &settings, "", &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(refused.to_string().starts_with("answers: expected curvature alone"), "{refused}");
}

#[test]
fn every_unit_answers_to_some_of_the_data() {
    let network = Network::inverse(&Architecture::PAPER, 3).unwrap();
    let rows = 64;
    let wave = |n: usize| Tensor::from_vec((0..n).map(|k| (k as f32 * 0.7).sin()).collect(), n, &Device::Cpu);
    // All windows lie to one side, which leaves half of the first units silent.
    let windows =
        wave(rows * WINDOW * AXES).unwrap().reshape((rows, WINDOW * AXES)).unwrap().affine(0.1, 2.0).unwrap();
    let desired = wave(rows * 2).unwrap().reshape((rows, 2)).unwrap();
    let silent = |network: &Network| {
        let shares = network.shares_awake(&windows, &desired).unwrap();
        shares.iter().filter(|share| **share < 0.05).count()
    };
    let before = silent(&network);
    network.wake(&windows, &desired).unwrap();
    assert_eq!((before > 100, silent(&network)), (true, 0), "{before} were silent");
}

#[test]
fn flat_weights_answer_as_candle_does() {
    let recording = two_grounds(2);
    for (embedding, answer) in
        [(2, Answer::Curvature), (16, Answer::SpeedAndCurvature), (0, Answer::Curvature)]
    {
        let sensing = if embedding == 0 { Sensing::Blind } else { Sensing::Imu { embedding } };
        let settings = Settings { architecture: Architecture { sensing, answer }, ..settings(sensing, 2) };
        let outcome = train(&recording, &settings, "test", &mut |_| ControlFlow::Continue(())).unwrap();
        let network = Network::inverse(&settings.architecture, 5).unwrap();
        for (variable, (name, _)) in named(&network) {
            let tensor = &outcome.checkpoint.tensors()[&name];
            variable
                .set(&Tensor::from_slice(&tensor.values, tensor.shape.clone(), &Device::Cpu).unwrap())
                .unwrap();
        }
        let labels = outcome.checkpoint.sidecar().labels;
        let (examples, _) = label(&recording, &labels);
        let mut model = InverseModel::new(&outcome.checkpoint, Instructions::widest()).unwrap();
        let half = Half::new(
            &examples,
            &(0..200).collect::<Vec<_>>(),
            &outcome.checkpoint.sidecar().standardisation,
            &settings,
            1,
        )
        .unwrap();
        let expected = network.forward(&half.windows, &half.desired).unwrap().to_vec2::<f32>().unwrap();
        for (example, expected) in examples.iter().zip(expected) {
            model.sense_columns(&example.window);
            let [speed_mps, curvature_per_m] = example.driven;
            let found = model.command(Desired { speed_mps, curvature_per_m });
            assert!((found.curvature_per_m - 2.0 * expected[0]).abs() < 1e-5, "{found:?} {expected:?}");
            if answer == Answer::SpeedAndCurvature {
                assert!((found.speed_mps - 3.0 * expected[1]).abs() < 1e-5, "{found:?} {expected:?}");
            }
        }
    }
}

/// The variables with the names under which they are kept.
fn named(network: &Network) -> Vec<(Var, (String, Vec<usize>))> {
    let tensors = network.tensors().unwrap();
    let mut left: Vec<_> = tensors.into_iter().collect();
    let numbers = |tensor: &Tensor| tensor.flatten_all().unwrap().to_vec1::<f32>().unwrap();
    network
        .variables()
        .into_iter()
        .map(|variable| {
            let values = numbers(&variable);
            let place = left.iter().position(|(_, tensor)| tensor.values == values).unwrap();
            let (name, tensor) = left.remove(place);
            (variable, (name, tensor.shape))
        })
        .collect()
}

#[test]
fn familiarity_is_whole_on_what_was_learned_and_none_far_from_it() {
    let recording = two_grounds(3);
    let outcome = train(&recording, &settings(Sensing::Imu { embedding: 2 }, 2), "test", &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    let mut model = InverseModel::new(&outcome.checkpoint, Instructions::widest()).unwrap();
    let (examples, _) = label(&recording, &outcome.checkpoint.sidecar().labels);
    let share = |model: &mut InverseModel, gain: f32| {
        let shares =
            examples.iter().step_by(10).map(|example| {
                let shaken: Vec<f32> = example.window.iter().map(|value| gain * value).collect();
                model.sense_columns(&shaken);
                f64::from(model.familiarity(Desired {
                    speed_mps: example.driven[0],
                    curvature_per_m: example.driven[1],
                }))
            });
        let shares: Vec<f64> = shares.collect();
        shares.iter().sum::<f64>() / shares.len() as f64
    };
    // Nineteen of twenty have a whole share, and the rest a part of one.
    assert!(share(&mut model, 1.0) > 0.95);
    assert!(share(&mut model, 30.0) < 0.01, "shaken thirty times as much as ever");
}

#[test]
fn what_cannot_be_learned_from_is_told() {
    let sensing = Sensing::Imu { embedding: 2 };
    let refuse = |recording: &Recording, settings: &Settings| {
        train(recording, settings, "test", &mut |_| ControlFlow::Continue(())).unwrap_err().to_string()
    };
    let mut one = two_grounds(2);
    for tick in one.runs.iter_mut().flat_map(|run| &mut run.ticks) {
        tick.ground = Some(1);
    }
    let told = refuse(&one, &settings(sensing, 1));
    assert!(told.contains("at least two grounds") && told.ends_with("found rough alone"), "{told}");
    let mut short = two_grounds(1);
    short.runs[0].ticks.truncate(400);
    short.runs[0].imu.truncate(4000);
    let told = refuse(&short, &settings(sensing, 1));
    assert!(told.contains("at least 320 examples"), "{told}");
    let mut swapped = two_grounds(1);
    for sample in &mut swapped.runs[0].imu {
        sample.acceleration_mps2.rotate_left(1);
    }
    assert!(refuse(&swapped, &settings(sensing, 1)).contains("the axis called left points up"));
    assert!(refuse(&two_grounds(1), &settings(sensing, 0)).starts_with("epochs: expected at least 1"));
}

#[test]
fn same_seed_gives_the_same_weights() {
    let recording = two_grounds(2);
    let settings = settings(Sensing::Imu { embedding: 2 }, 1);
    let weights = || {
        let outcome = train(&recording, &settings, "test", &mut |_| ControlFlow::Continue(())).unwrap();
        outcome.checkpoint.weights_bytes().unwrap()
    };
    assert_eq!(weights(), weights());
}

#[test]
fn checkpoint_is_read_again_and_refused_for_another_vehicle() {
    let recording = two_grounds(2);
    let outcome =
        train(&recording, &settings(Sensing::Blind, 1), "test", &mut |_| ControlFlow::Continue(())).unwrap();
    let checkpoint = outcome.checkpoint;
    let (weights, sidecar) = (checkpoint.weights_bytes().unwrap(), checkpoint.sidecar_bytes().unwrap());
    assert_eq!(Checkpoint::from_bytes(&weights, &sidecar).unwrap(), checkpoint);
    let other = VehicleSummary { wheelbase_m: 0.4, ..recording.vehicle.clone() };
    let told = checkpoint.require_vehicle(&other).unwrap_err().to_string();
    assert!(told.contains("wheelbase_m: 0.4") && told.contains("found"), "{told}");
    assert!(checkpoint.require_vehicle(&recording.vehicle).is_ok());
    let mut broken = weights.clone();
    *broken.last_mut().unwrap() ^= 1;
    assert!(Checkpoint::from_bytes(&broken, &sidecar).unwrap_err().to_string().contains("SHA-256"));
}
