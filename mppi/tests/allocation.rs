//! A decision allocates nothing, whatever is switched on.

mod fixture;

use bicycle::effect::{CATALOGUE, SpeedLag, SteerDelay};
use bicycle::{Decision, Effect, Limits, State};
use mppi::{
    Config, Controller, CostToGo, CostToGoConfig, Costs, Disc, DiscPrices, Input, MovingDiscs, Objective,
    Outline, Terminal,
};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use traversability::RiskMap;

struct Counting;

static N_ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator as it came; counting touches no memory of it.
#[allow(unsafe_code, reason = "an allocator can be counted only by being one")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        N_ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A field that keeps to a turning circle; the second time it takes no memory.
#[allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]
fn solved_twice(limits: &Limits, map: &RiskMap) -> CostToGo {
    let config =
        CostToGoConfig { turning_radius_m: 3.0, reverse_speed_share: 0.25, ..CostToGoConfig::default() };
    let mut field = CostToGo::new(config, limits, 160, 160).unwrap();
    field.update(map.view(), [15.0, 10.0], 0.0).unwrap();
    let before = N_ALLOCATIONS.load(Ordering::Relaxed);
    field.update(map.view(), [15.0, 10.0], 0.5).unwrap();
    assert_eq!(N_ALLOCATIONS.load(Ordering::Relaxed) - before, 0);
    field
}

/// One test, because other tests of this process would be counted too.
#[test]
fn a_decision_allocates_nothing() {
    let mut with_effects = fixture::model();
    with_effects.effects = vec![
        Effect::SteerDelay(SteerDelay { delay_s: 0.25 }),
        Effect::SpeedLag(SpeedLag { time_constant_s: 0.3 }),
    ];
    let mut with_all = fixture::model();
    let every = CATALOGUE.iter().map(|effect| {
        let values =
            [0, 1, 2, 3].map(|k| effect.parameters.get(k).map_or(0.0, |parameter| parameter.tried[0]));
        Effect::from_values(effect.id, values).unwrap()
    });
    with_all.effects = every.collect();
    let delayed = Config { delay_s: 0.15, n_iterations: 2, n_threads: 3, ..Config::default() };
    let cases = [
        (Config::minimal(), fixture::model()),
        (Config::default(), fixture::model()),
        (Config { n_threads: 2, ..Config::default() }, with_effects.clone()),
        (delayed, with_effects),
        (Config::default(), with_all),
    ];
    let map = fixture::rough(3);
    for (config, model) in cases {
        let field = solved_twice(&model.limits, &map);
        let prices = DiscPrices { touch_s: 1.0, near_s: 0.1, foresight_s: 0.5 };
        let discs = MovingDiscs::new(Outline::default(), prices, 4, config.n_steps);
        let mut controller = Controller::with_costs(config, model, (discs, ()), 1).unwrap();
        let mut n_drives = 0;
        let mut decide = |cycle: u64| {
            let terminal = Terminal::CostToGo(field.view());
            let objective = Objective::Goal { goal_m: [15.0, 10.0], tolerance_m: 0.5, terminal };
            let input = Input { state: State::default(), elapsed_s: 0.1, map: map.view(), objective, cycle };
            // Something crosses every other cycle.
            let discs = controller.step_cost_mut();
            discs.clear();
            if cycle.is_multiple_of(2) {
                let at = |t: usize| [3.0, 0.1 * t as f64 - 2.0];
                discs.add(|t| Disc { centre_m: at(t), radius_m: 0.3, margin_m: 0.5 });
            }
            n_drives += usize::from(matches!(controller.decide(&input), Decision::Drive(_)));
        };
        decide(0);
        let before = N_ALLOCATIONS.load(Ordering::Relaxed);
        (1..50).for_each(&mut decide);
        assert_eq!(N_ALLOCATIONS.load(Ordering::Relaxed) - before, 0);
        // Nor does one after the settings have changed.
        let costs = Costs { reverse_s: 0.7, ..controller.config().costs };
        controller.set_config(Config { costs, ..controller.config().clone() }).unwrap();
        let before = N_ALLOCATIONS.load(Ordering::Relaxed);
        for cycle in 50..60 {
            let terminal = Terminal::CostToGo(field.view());
            let objective = Objective::Goal { goal_m: [15.0, 10.0], tolerance_m: 0.5, terminal };
            let input = Input { state: State::default(), elapsed_s: 0.1, map: map.view(), objective, cycle };
            controller.decide(&input);
        }
        assert_eq!(N_ALLOCATIONS.load(Ordering::Relaxed) - before, 0);
        assert!(n_drives > 10, "decisions that stop early prove nothing: {n_drives} of 50 drove");
    }
}
