//! A decision is a function of state, map, goal, configuration, seed and cycle: the same bits for any number of
//! threads, nearly the same numbers for any instruction set.

mod fixture;

use bicycle::effect::{SpeedDelay, SteerLag};
use bicycle::{Command, Decision, Effect, Model, State};
use fixture::{drive, goal, level, model, rough};
use mppi::{Config, Controller, Input, Isa};
use traversability::RiskMap;

fn with_effects() -> Model {
    let effects = vec![
        Effect::SteerLag(SteerLag { time_constant_s: 0.2 }),
        Effect::SpeedDelay(SpeedDelay { delay_s: 0.13 }),
    ];
    Model { effects, ..model() }
}

fn commands(config: &Config, model: &Model, map: &RiskMap) -> Vec<[u32; 2]> {
    let drive = drive(config, model, map, goal([15.0, 8.0]), (State::default(), 15));
    let bits = |decision: &Decision| match decision {
        Decision::Drive(Command { speed_mps, steering_rad }) => [speed_mps.to_bits(), steering_rad.to_bits()],
        _ => [0; 2],
    };
    drive.decisions.iter().map(bits).collect()
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let map = rough(5);
    for base in [Config::default(), Config::minimal()] {
        for model in [model(), with_effects()] {
            let of = |n_threads: usize| commands(&Config { n_threads, ..base.clone() }, &model, &map);
            let alone = of(1);
            assert!(alone.iter().filter(|bits| **bits != [0; 2]).count() >= 10, "the vehicle drives");
            for n_threads in [2, 7, 16] {
                assert_eq!(of(n_threads), alone, "{n_threads} threads");
            }
        }
    }
}

#[test]
fn a_repeated_run_gives_the_same_bits_and_another_seed_others() {
    let map = rough(6);
    let first = |seed: u64| {
        let mut controller = Controller::new(Config::default(), model(), seed).unwrap();
        let input = Input {
            state: State::default(),
            elapsed_s: 0.0,
            map: map.view(),
            objective: goal([10.0, 3.0]),
            cycle: 4,
        };
        controller.decide(&input)
    };
    assert_eq!(first(1), first(1));
    assert_ne!(first(1), first(2));
}

#[test]
fn a_reset_controller_is_as_good_as_new() {
    let map = rough(7);
    let input = |cycle: u64| Input {
        state: State::default(),
        elapsed_s: if cycle == 0 { 0.0 } else { 0.1 },
        map: map.view(),
        objective: goal([10.0, 3.0]),
        cycle,
    };
    let mut controller = Controller::new(Config::default(), model(), 3).unwrap();
    let first: Vec<Decision> = (0..5).map(|cycle| controller.decide(&input(cycle))).collect();
    controller.reset();
    let again: Vec<Decision> = (0..5).map(|cycle| controller.decide(&input(cycle))).collect();
    assert_eq!(first, again);
}

/// On level ground no rounding can push a rollout into another kind of cell, so the instruction sets differ by
/// rounding alone: some 1e-6 per step of 50, times the sensitivity of the weights.
#[test]
fn instruction_sets_agree() {
    let map = level();
    let decide = |isa: Isa, model: &Model| {
        let config = Config { isa, ..Config::default() };
        let mut controller = Controller::new(config, model.clone(), 9).ok()?;
        let state = State { speed_mps: 0.5, ..State::default() };
        let objective = goal([9.0, 4.0]);
        let input = Input { state, elapsed_s: 0.0, map: map.view(), objective, cycle: 0 };
        let Decision::Drive(command) = controller.decide(&input) else { panic!("level ground is drivable") };
        Some((command, *controller.diagnostics()))
    };
    for model in [model(), with_effects()] {
        let (reference, expected) = decide(Isa::Portable, &model).unwrap();
        for isa in Isa::SETS {
            let Some((command, found)) = decide(isa, &model) else { continue };
            assert!((command.speed_mps - reference.speed_mps).abs() < 1e-3, "{isa:?}");
            assert!((command.steering_rad - reference.steering_rad).abs() < 1e-3, "{isa:?}");
            assert!((found.baseline_s - expected.baseline_s).abs() < 1e-3, "{isa:?}");
            assert!((found.free_energy_s - expected.free_energy_s).abs() < 1e-3, "{isa:?}");
            assert_eq!(found.isa, isa);
        }
    }
}

#[test]
fn using_fewer_rollouts_is_being_configured_for_fewer() {
    let map = rough(7);
    let decisions = |configured: usize, used: usize| {
        let config = Config { n_rollouts: configured, n_threads: 2, ..Config::default() };
        let mut controller = Controller::new(config, model(), 1).unwrap();
        controller.use_rollouts(used);
        assert_eq!(controller.n_rollouts(), used.clamp(64, configured) / 64 * 64);
        let mut decide = |cycle| {
            controller.decide(&Input {
                state: State::default(),
                elapsed_s: 0.1,
                map: map.view(),
                objective: goal([10.0, 3.0]),
                cycle,
            })
        };
        [0, 1, 2].map(&mut decide)
    };
    let few = decisions(256, 256);
    assert_eq!(decisions(1024, 300), few, "whole blocks only");
    assert_ne!(decisions(1024, 1024), few);
    assert_eq!(decisions(1024, 1), decisions(64, 64));
    assert_eq!(decisions(256, 5000), few);
}
