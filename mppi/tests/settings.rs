//! Settings that change on a running controller: taken over whole, or refused and nothing is changed.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod fixture;

use bicycle::effect::SteerLag;
use bicycle::{Decision, Effect, GroundSample, Limits, Model, State, Stepper};
use fixture::{STEP_S, goal, level, model, rough};
use mppi::{Actuation, Config, Controller, Costs, Input, Isa, Recovery, SampleSpace, Sampling, Temperature};
use traversability::RiskMap;

fn input(map: &RiskMap, cycle: u64) -> Input<'_> {
    let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
    Input { state: State::default(), elapsed_s, map: map.view(), objective: goal([15.0, 3.0]), cycle }
}

fn decisions(controller: &mut Controller, map: &RiskMap, cycles: std::ops::Range<u64>) -> Vec<Decision> {
    cycles.map(|cycle| controller.decide(&input(map, cycle))).collect()
}

/// Everything that may change, changed.
fn changed() -> Config {
    Config {
        n_iterations: 2,
        sampling: Sampling {
            space: SampleSpace::Controls,
            speed_std: 0.7,
            steering_std: 0.2,
            correlation_s: 0.3,
        },
        actuation: Actuation::Instant,
        temperature: Temperature::Fixed { temperature_s: 0.4 },
        control_cost: 0.3,
        costs: Costs {
            distance_s_per_m: 0.2,
            rest_speed_mps: 1.5,
            reverse_s: 0.0,
            ..Config::default().costs
        },
        tracking_s: 0.2,
        recovery: Recovery { patience_s: 5.0, ..Config::default().recovery },
        ..Config::default()
    }
}

/// Each change alone and all together.
fn changes() -> Vec<Config> {
    let (all, default) = (changed(), Config::default);
    vec![
        Config { n_iterations: all.n_iterations, ..default() },
        Config { sampling: all.sampling, ..default() },
        Config { actuation: all.actuation, ..default() },
        Config { temperature: all.temperature, ..default() },
        Config { control_cost: all.control_cost, ..default() },
        Config { costs: all.costs, ..default() },
        Config { tracking_s: all.tracking_s, ..default() },
        Config { recovery: all.recovery, ..default() },
        all,
    ]
}

/// Before its first decision, a changed controller is one that was made so.
#[test]
fn a_changed_controller_is_one_that_was_made_so() {
    let map = rough(8);
    let slower = Model { limits: Limits { speed_max_mps: 1.1, ..model().limits }, ..model() };
    for config in changes() {
        let mut made = Controller::new(config.clone(), slower.clone(), 2).unwrap();
        let mut changed = Controller::new(Config::default(), model(), 2).unwrap();
        changed.set_config(config.clone()).unwrap();
        changed.set_model(slower.clone()).unwrap();
        assert_eq!((changed.config(), changed.model()), (&config, &slower));
        assert_eq!(decisions(&mut changed, &map, 0..5), decisions(&mut made, &map, 0..5), "{config:?}");
    }
}

/// There and back between two decisions is nothing; there alone is seen in the next decision.
#[test]
fn a_change_acts_from_the_next_decision_on() {
    let map = rough(8);
    for config in changes() {
        let run = |change: &dyn Fn(&mut Controller)| {
            let mut controller = Controller::new(Config::default(), model(), 2).unwrap();
            decisions(&mut controller, &map, 0..4);
            change(&mut controller);
            decisions(&mut controller, &map, 4..40)
        };
        let unchanged = run(&|_| ());
        let there_and_back = run(&|controller| {
            controller.set_config(config.clone()).unwrap();
            controller.set_config(Config::default()).unwrap();
        });
        assert_eq!(there_and_back, unchanged);
        assert_ne!(
            run(&|controller| controller.set_config(config.clone()).unwrap()),
            unchanged,
            "{config:?}"
        );
    }
}

#[test]
fn a_refused_change_leaves_everything_as_it_was() {
    let map = rough(9);
    let mut expected = Controller::new(Config::default(), model(), 2).unwrap();
    let mut asked = Controller::new(Config::default(), model(), 2).unwrap();
    assert_eq!(decisions(&mut asked, &map, 0..4), decisions(&mut expected, &map, 0..4));
    let told =
        |controller: &mut Controller, config: Config| controller.set_config(config).unwrap_err().to_string();
    let default = Config::default;
    for (config, message) in [
        (Config { n_rollouts: 512, ..default() }, "n_rollouts: expected 1024 as before, found 512"),
        (Config { n_steps: 40, ..default() }, "n_steps: expected 50"),
        (Config { step_s: 0.2, ..default() }, "step_s: expected 0.1"),
        (Config { n_threads: 2, ..default() }, "n_threads: expected 1"),
        (Config { isa: Isa::Portable, ..default() }, "isa: expected Auto"),
        (Config { delay_s: 0.1, ..default() }, "delay_s: expected 0"),
        (Config { period_min_s: 0.1, ..default() }, "period_min_s: expected 0.01"),
        (
            Config { control_cost: -1.0, ..changed() },
            "control_cost: expected a number from 0 to 1e6, found -1",
        ),
        (Config { tracking_s: f64::NAN, ..changed() }, "tracking_s"),
    ] {
        let found = told(&mut asked, config);
        assert!(found.starts_with(message), "{found}");
    }
    let broken = Model { limits: Limits { speed_max_mps: -1.0, ..model().limits }, ..model() };
    assert!(asked.set_model(broken).is_err());
    let lagging = Effect::SteerLag(SteerLag { time_constant_s: 0.2 });
    let refused = asked.set_model(Model { effects: vec![lagging], ..model() }).unwrap_err().to_string();
    assert!(refused.starts_with("memory of the model's effects: expected 0 numbers"), "{refused}");
    assert_eq!((asked.config(), asked.model()), (&Config::default(), &model()));
    assert_eq!(decisions(&mut asked, &map, 4..10), decisions(&mut expected, &map, 4..10));
}

/// Driving at 2 m/s, told to keep to 0.8 m/s, and later to 2 m/s again.
#[test]
fn a_speed_limit_is_kept_from_when_it_is_set() {
    let (map, stepper) = (level(), Stepper::new(&model(), STEP_S, 1.0));
    let mut controller = Controller::new(Config::default(), model(), 2).unwrap();
    let mut state = State { x_m: -15.0, ..State::default() };
    let limited =
        |speed_max_mps: f64| Model { limits: Limits { speed_max_mps, ..model().limits }, ..model() };
    let mut fastest_mps = [0.0_f64; 3];
    for cycle in 0..100 {
        if cycle == 30 || cycle == 60 {
            controller.set_model(limited(if cycle == 30 { 0.8 } else { 2.0 })).unwrap();
        }
        let Decision::Drive(command) = controller.decide(&Input { state, ..input(&map, cycle) }) else {
            break;
        };
        assert!(!(30..60).contains(&cycle) || command.speed_mps <= 0.8, "{cycle}: {command:?}");
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut [], 0);
        // From 2 to 0.8 m/s at 2 m/s2 takes six steps.
        if cycle % 30 >= 10 && cycle < 90 {
            let part = cycle as usize / 30;
            fastest_mps[part] = fastest_mps[part].max(state.speed_mps);
        }
    }
    let [before, limited, after] = fastest_mps;
    assert!(before > 1.8 && (0.6..0.801).contains(&limited) && after > 1.8, "{fastest_mps:?}");
}
