//! What steps cost beside the way: what is asked of the ground, what is too fast for it, and where time ends.

use super::*;

/// On a slope of 0.06 east and -0.03 north that holds 0.2, of which plans may use 0.75 * 9.81 * 0.2 = 1.4715 m/s2, a step
/// that asks for (1 + e) times as much costs e times the price; where nobody has said what the ground holds, nothing.
#[test]
fn what_is_asked_of_the_ground_beyond_what_it_holds_is_priced() {
    let mut map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    map.fill(|_, grounds| grounds.iter_mut().for_each(|ground| ground.gradient = [0.06, -0.03]));
    let mut told = map.clone();
    told.ground_mut().iter_mut().for_each(|ground| ground.friction = FrictionLimit::new(0.2));
    let stepper = stepper(0.5);
    let far = GoalTask { x_cells: Constant::new(1e6), ..goal(&map, 0.0, Rest::Straight) };
    let asked = |v: f64, yaw_rate: f64, yaw: f64| {
        let (ahead, left) = (0.06 * yaw.cos() - 0.03 * yaw.sin(), -0.03 * yaw.cos() - 0.06 * yaw.sin());
        (9.81 * ahead).hypot(v * yaw_rate + 9.81 * left)
    };
    for (map, is_told) in [(&map, false), (&told, true)] {
        let mut scene = scene(map, &stepper, Task::Goal(far));
        scene.prices.grip_s = Constant::new(0.7);
        scene.prices.lateral_s = Constant::new(0.0);
        for machine in machines() {
            let (mut chunk, mut n_priced) = (chunk(), 0);
            kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
            for lane in 0..CHUNK {
                let (mut yaw, mut expected_s) = (START[2], 0.0);
                for t in 0..N_STEPS {
                    let [v, delta] = control(lane, t);
                    let yaw_rate = v * delta.tan() / WHEELBASE_M;
                    yaw += STEP_S * yaw_rate;
                    expected_s += 0.7 * (asked(v, yaw_rate, yaw) / 1.4715 - 1.0).max(0.0);
                }
                let found_s = f64::from(chunk.terms[CostTerm::Lateral as usize].0[lane]);
                let expected_s = if is_told { expected_s } else { 0.0 };
                assert!((found_s - expected_s).abs() < 1e-3, "{machine:?} {lane}: {found_s} {expected_s}");
                n_priced += usize::from(expected_s > 1.0);
            }
            assert_eq!(n_priced > CHUNK / 4, is_told, "{n_priced} of {CHUNK} ask for much too much");
        }
    }
}

/// A step that is (1 + e) times as fast as its cell allows costs e times the price; traction slows down. Lanes that come
/// within 1e-3 of an edge are left out.
#[test]
fn what_is_faster_than_the_ground_allows_is_priced() {
    let geometry = GridGeometry::centred(0.5, 60, 50, 1.0, -2.0);
    let mut map = RiskMap::constant(geometry, 13, Risk { linear_traction: 0.8, ..Risk::NONE });
    for (index, ground) in map.ground_mut().iter_mut().enumerate() {
        ground.speed =
            if index % 3 == 0 { SpeedLimit::NONE } else { SpeedLimit::new(0.5 + 0.1 * (index % 7) as f32) };
    }
    let stepper = stepper(0.5);
    let far = GoalTask { x_cells: Constant::new(1e6), ..goal(&map, 0.0, Rest::Straight) };
    let mut scene = scene(&map, &stepper, Task::Goal(far));
    (scene.prices.overspeed_s, scene.prices.lateral_s) = (Constant::new(0.7), Constant::new(0.0));
    for machine in machines() {
        let (mut chunk, mut n_priced, mut n_compared) = (chunk(), 0, 0);
        kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
        for lane in 0..CHUNK {
            let ([mut x, mut y, mut yaw], mut expected_s, mut margin) = (START, 0.0, f64::INFINITY);
            for t in 0..N_STEPS {
                let [v, delta] = control(lane, t);
                let ground = map.view().ground[geometry.index(geometry.cell_at(x, y).unwrap())];
                expected_s += 0.7 * (0.8 * v.abs() / f64::from(ground.speed.mps()) - 1.0).max(0.0);
                margin = [x, y]
                    .map(|place| (2.0 * place - (2.0 * place).round()).abs())
                    .into_iter()
                    .fold(margin, f64::min);
                x += STEP_S * 0.8 * v * yaw.cos();
                y += STEP_S * 0.8 * v * yaw.sin();
                yaw += STEP_S * v * delta.tan() / WHEELBASE_M;
            }
            if margin > 1e-3 {
                let found_s = f64::from(chunk.terms[CostTerm::Lateral as usize].0[lane]);
                assert!((found_s - expected_s).abs() < 1e-3, "{machine:?} {lane}: {found_s} {expected_s}");
                (n_compared, n_priced) = (n_compared + 1, n_priced + usize::from(expected_s > 1.0));
            }
        }
        assert!(n_compared > 30 && n_priced > 20, "{n_priced} of {n_compared} are much too fast");
    }
}

/// Due east at 1 m/s, the ring of the border begins after 1.95 m: 19 steps of 0.1 s end before it. What is left of the way
/// to a goal 30 m from there, at 2 m/s, counts from the border on, whoever comes there when.
#[test]
fn time_ends_where_a_rollout_leaves_the_map() {
    let map = RiskMap::constant(GridGeometry::centred(0.5, 60, 50, 1.0, -2.0), 13, Risk::NONE);
    let stepper = stepper(0.5);
    // 50 columns, of which the last one is the ring.
    let start_cells = [49.0 - 1.95 / 0.5, 30.2];
    let window = Window::of(map.geometry(), start_cells, 40.0);
    assert!(window.is_some() && Window::of(map.geometry(), start_cells, 3.8).is_none());
    let leaves_out = [[48.9, 58.9], [49.1, 30.0], [1.1, 1.1], [25.0, 59.0]]
        .map(|at_cells| window.is_some_and(|window| window.leaves_out(at_cells)));
    assert_eq!(leaves_out, [false, true, false, true], "60 rows, 50 columns, a ring of one");
    let task = GoalTask {
        x_cells: Constant::new(49.0 + 30.0 / 0.5),
        y_cells: Constant::new(30.2),
        window: window.as_ref(),
        ..goal(&map, 0.0, Rest::Straight)
    };
    let mut scene = scene(&map, &stepper, Task::Goal(task));
    (scene.start.x_cells, scene.start.y_cells, scene.start.turns) = (start_cells[0], start_cells[1], 0.0);
    for machine in machines() {
        for (speed_mps, n_steps_within) in [(1.0, 19), (2.0, 9)] {
            let mut chunk = Chunk::new(N_STEPS);
            chunk.controls.iter_mut().for_each(|rows| rows[0].0 = [speed_mps; CHUNK]);
            kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
            let term = |term: CostTerm| f64::from(chunk.terms[term as usize].0[0]);
            assert!((term(CostTerm::Running) - 0.1 * f64::from(n_steps_within)).abs() < 1e-4, "{machine:?}");
            // A tenth of the speed is left in the ring, for up to three seconds.
            assert!((14.5..15.0).contains(&term(CostTerm::Terminal)), "{}", term(CostTerm::Terminal));
        }
    }
}
