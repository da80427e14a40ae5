//! Routes against an independent search and closed forms.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use route::{Barrier, FrictionCurve, GroundCell, Planner, RouteConfig, RouteError, RoutePoint, SpeedLimits};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::f64::consts::{FRAC_PI_4, SQRT_2};
use terrain::{Cell, CellRegion, GridGeometry, GridMap};

const LIMITS: SpeedLimits = SpeedLimits {
    speed_max_mps: 5.0,
    traction_max_mps2: 10.0,
    braking_max_mps2: 10.0,
    friction_share: 1.0,
    roughness_speed_m2ps: 100.0,
};

fn map(n: usize, cell: impl FnMut(Cell) -> GroundCell) -> GridMap<GroundCell> {
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: n, n_cols: n };
    let mut cell = cell;
    let values = (0..n * n).map(|index| cell(geometry.cell(index))).collect();
    GridMap::from_values(geometry, values).unwrap()
}

/// Equations 37 to 42 written down once more, in double precision and without anything that is stored.
struct Reference<'a> {
    ground: &'a GridMap<GroundCell>,
    config: RouteConfig,
}

impl Reference<'_> {
    fn cell(&self, [x, y]: [i64; 2]) -> Option<&GroundCell> {
        let cell = self.ground.at_lattice([x, y])?;
        let is_open =
            cell.is_known() && !cell.is_obstacle && f64::from(cell.roughness_m) < self.config.roughness_max_m;
        is_open.then_some(cell)
    }

    fn friction(&self, p: &GroundCell, q: &GroundCell) -> (f64, f64) {
        let mean =
            |value: fn(&FrictionCurve) -> f32| f64::from(0.5 * (value(&p.friction) + value(&q.friction)));
        let (statics, sliding) = (mean(|f| f.static_friction), mean(|f| f.sliding_friction));
        let (viscous, stribeck_mps) = (mean(|f| f.viscous_friction), mean(|f| f.stribeck_speed_mps));
        let x = self.config.sliding_mps / stribeck_mps;
        let peak = (2.0 * std::f64::consts::E).sqrt() * (statics - sliding) * (-x * x).exp() * x;
        (peak + sliding * (10.0 * SQRT_2 * x).tanh() + viscous * self.config.sliding_mps, viscous)
    }

    /// Cost of a step east-wards by `dx` and north-wards by `dy`, and the friction there.
    fn step(&self, from: [i64; 2], dx: i64, dy: i64) -> Option<(f64, f64)> {
        let to = [from[0] + dx, from[1] + dy];
        let (p, q) = (self.cell(from)?, self.cell(to)?);
        if dx != 0 && dy != 0 {
            self.cell([from[0] + dx, from[1]])?;
            self.cell([from[0], from[1] + dy])?;
        }
        let length = f64::from((dx * dx + dy * dy) as i32).sqrt();
        let (friction, viscous) = self.friction(p, q);
        let height =
            |at: [i64; 2]| self.ground.at_lattice(at).filter(|c| c.is_known()).map(|c| f64::from(c.height_m));
        let across = |at: [i64; 2]| {
            let here = height(at).unwrap();
            let (left, right) = (height([at[0] - dy, at[1] + dx]), height([at[0] + dy, at[1] - dx]));
            let n = f64::from(u8::from(left.is_some()) + u8::from(right.is_some())).max(1.0);
            (left.unwrap_or(here) - right.unwrap_or(here)) / (n * length)
        };
        let along = f64::from(q.height_m - p.height_m).abs() / length;
        let across = (0.5 * (across(from) + across(to))).abs();
        if along > self.config.pitch_max_rad.tan()
            || across > self.config.roll_max_rad.tan()
            || along.hypot(across) > self.config.friction_share * friction
        {
            return None;
        }
        let slope = |slope: f64| (self.config.slope_weight * slope / friction).exp();
        let roughness = self.config.roughness_weight * f64::from(p.roughness_m + q.roughness_m) / 2.0;
        let friction_cost = 1.0 / friction + self.config.viscous_weight_mps * viscous;
        Some((length * (1.0 + friction_cost + slope(along) + slope(across) + roughness), friction))
    }

    /// Dijkstra over (place, heading, last turn).
    fn cheapest(&self, start: [i64; 2], heading: i64, goal: [i64; 2]) -> Option<f64> {
        let towards = |heading: i64| {
            let angle = heading as f64 * FRAC_PI_4;
            (angle.cos().round() as i64, angle.sin().round() as i64)
        };
        let mut least: HashMap<([i64; 2], i64, i64), f64> = HashMap::new();
        let mut queue = BinaryHeap::from([(Reverse(0_u64), start, heading, 0_i64)]);
        least.insert((start, heading, 0), 0.0);
        while let Some((Reverse(key), at, heading, turned)) = queue.pop() {
            let cost = least[&(at, heading, turned)];
            if key as f64 > (cost * 1e9).round() {
                continue;
            }
            if at == goal {
                return Some(cost);
            }
            for turn in [-1_i64, 0, 1] {
                let heading = (heading + turn).rem_euclid(8);
                let (dx, dy) = towards(heading);
                let Some((step, friction)) = self.step(at, dx, dy) else { continue };
                let sharpness = match (turned, turn) {
                    (_, 0) => 0.0,
                    (0, _) => 1.0,
                    (before, now) if before == now => 4.0,
                    _ => 0.0,
                };
                let next = ([at[0] + dx, at[1] + dy], heading, turn);
                let cost = cost + step + self.config.steering_weight * sharpness / friction;
                if least.get(&next).is_none_or(|known| cost < *known) {
                    least.insert(next, cost);
                    queue.push((Reverse((cost * 1e9).round() as u64), next.0, heading, turn));
                }
            }
        }
        None
    }
}

#[test]
fn the_route_is_the_cheapest_that_an_independent_search_finds() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let curves = [FrictionCurve::ASPHALT, FrictionCurve::GRASS, FrictionCurve::MUD, FrictionCurve::ICE];
    let config = RouteConfig { clear_width_m: 0.0, ..RouteConfig::default() };
    let (mut n_found, mut n_none, mut n_sliding) = (0, 0, 0);
    for _ in 0..80 {
        let share = random.random_range(0.0..0.3);
        let ground = map(24, |_| GroundCell {
            height_m: if random.random_bool(0.02) { f32::NAN } else { random.random_range(0.0..0.15) },
            friction: curves[random.random_range(0..4)],
            roughness_m: random.random_range(0.0..0.305),
            is_obstacle: random.random_bool(share),
        });
        let reference = Reference { ground: &ground, config };
        let heading = random.random_range(0..8_i64);
        let expected = reference.cheapest([2, 3], heading, [21, 20]);
        let planner = Planner::new(ground.clone(), config).unwrap();
        let yaw_rad = heading as f64 * FRAC_PI_4;
        match (planner.route(([2.5, 3.5], yaw_rad), [21.5, 20.5], &LIMITS), expected) {
            (Ok(route), Some(expected)) => {
                assert!((route.cost_m / expected - 1.0).abs() < 1e-5, "{} {expected}", route.cost_m);
                n_found += 1;
            }
            // The line between the cells may cross ground that is too slippery for its slope.
            (Err(RouteError::Speed(_)), Some(_)) => n_sliding += 1,
            (Err(RouteError::Blocked { .. } | RouteError::Unreachable { .. }), None) => n_none += 1,
            (found, expected) => panic!("{found:?}, expected {expected:?}"),
        }
    }
    assert!(n_found >= 20 && n_none >= 5 && n_sliding <= 20, "{n_found} {n_none} {n_sliding}");
}

#[test]
fn on_level_ground_a_straight_way_costs_its_length() {
    let grass = FrictionCurve::GRASS;
    let planner = Planner::new(map(40, |_| GroundCell::level(grass)), RouteConfig::default()).unwrap();
    let route = planner.route(([5.5, 20.5], 0.0), [35.5, 20.5], &LIMITS).unwrap();
    // 30 cells, each 1 + 1 / friction + 10 * 0.005 + exp(0) + exp(0).
    let expected = 30.0 * (1.0 + 1.0 / f64::from(grass.at(1.0)) + 0.05 + 2.0);
    assert!((route.cost_m - expected).abs() < 1e-3, "{} {expected}", route.cost_m);
    assert!((route.line.length_m() - 30.0).abs() < 1e-6);
    // A diagonal metre costs what a straight one does.
    let diagonal = planner.route(([5.5, 5.5], FRAC_PI_4), [25.5, 25.5], &LIMITS).unwrap();
    assert!((diagonal.cost_m / (20.0 * SQRT_2) - expected / 30.0).abs() < 1e-4);
}

#[test]
fn slippery_ground_is_gone_around_where_that_is_cheaper() {
    let with_ice = |half_width: i64| {
        map(60, |cell| {
            let is_ice = (25..35).contains(&cell.col) && (cell.row as i64 - 30).abs() <= half_width;
            GroundCell::level(if is_ice { FrictionCurve::ICE } else { FrictionCurve::ASPHALT })
        })
    };
    let crosses = |half_width: i64| {
        let planner = Planner::new(with_ice(half_width), RouteConfig::default()).unwrap();
        let route = planner.route(([10.5, 30.5], 0.0), [50.5, 30.5], &LIMITS).unwrap();
        route.line.points.iter().filter(|point| point.bend.friction < 0.3).count() > 3
    };
    assert!(!crosses(4) && crosses(40));
}

#[test]
fn no_route_says_what_blocks_it_and_where() {
    let wall = |barrier: fn(&mut GroundCell)| {
        map(40, |cell| {
            let mut ground = GroundCell::level(FrictionCurve::DIRT);
            if cell.col == 20 {
                barrier(&mut ground);
            }
            ground
        })
    };
    let found = |ground: GridMap<GroundCell>| {
        let planner = Planner::new(ground, RouteConfig::default()).unwrap();
        planner.route(([5.5, 20.5], 0.0), [35.5, 20.5], &LIMITS).unwrap_err()
    };
    let barrier_of = |error: RouteError| match error {
        RouteError::Unreachable { barrier, at_m, .. } => {
            assert!((at_m[1] - 20.5).abs() < 1e-9 && (18.0..21.0).contains(&at_m[0]), "{error}");
            barrier
        }
        other => panic!("{other}"),
    };
    assert_eq!(barrier_of(found(wall(|cell| cell.height_m = f32::NAN))), Barrier::Unknown);
    assert_eq!(barrier_of(found(wall(|cell| cell.is_obstacle = true))), Barrier::Obstacle);
    assert_eq!(barrier_of(found(wall(|cell| cell.roughness_m = 0.5))), Barrier::Rough);
    assert_eq!(barrier_of(found(wall(|cell| cell.height_m = 3.0))), Barrier::Steep);
    let slippery = map(40, |cell| {
        let friction = if (18..23).contains(&cell.col) { FrictionCurve::ICE } else { FrictionCurve::DIRT };
        // 0.25 m a metre: ice holds 0.22.
        let height_m = 0.25 * (cell.col as f32 - 18.0).clamp(0.0, 5.0);
        GroundCell { height_m, ..GroundCell::level(friction) }
    });
    assert_eq!(barrier_of(found(slippery)), Barrier::Slippery);
}

#[test]
fn start_and_goal_that_nobody_can_stand_on_are_refused() {
    let ground = map(20, |cell| GroundCell {
        is_obstacle: cell.row == 15 && cell.col == 15,
        height_m: if cell.row == 0 { f32::NAN } else { 0.0 },
        ..GroundCell::level(FrictionCurve::DIRT)
    });
    let planner = Planner::new(ground, RouteConfig::default()).unwrap();
    let refused =
        |start: [f64; 2], goal: [f64; 2]| planner.route((start, 0.0), goal, &LIMITS).unwrap_err().to_string();
    let open = [5.5, 5.5];
    assert_eq!(refused([5.5, 0.5], open), "start at (5.5, 0.5) m: nothing is known of the ground");
    assert_eq!(refused(open, [14.9, 15.2]), "goal at (14.9, 15.2) m: an obstacle stands in the way");
    assert_eq!(refused(open, [25.0, 5.0]), "goal: expected a point of the map, found (25.0, 5.0)");
    assert_eq!(refused([f64::NAN, 5.0], open), "start: expected a point of the map, found (NaN, 5.0)");
    let mut bad = map(20, |_| GroundCell::level(FrictionCurve::DIRT));
    bad[Cell { row: 3, col: 4 }].friction.static_friction = f32::NAN;
    let error = Planner::new(bad, RouteConfig::default()).unwrap_err().to_string();
    assert!(error.starts_with("ground at (4.5, 3.5) m: expected friction coefficients"), "{error}");
}

/// From a bowl of ice, 0.25 m a metre up on all sides where it holds 0.22, nothing leads out; to a place that nothing known
/// leads to, nothing in.
#[test]
fn a_start_that_nothing_leaves_and_a_goal_in_unknown_ground_are_told() {
    let away = |cell: Cell, col: f32| (cell.col as f32 - col).hypot(cell.row as f32 - 20.0);
    let ground = map(60, |cell| {
        let (from_start, from_goal) = (away(cell, 12.0), away(cell, 45.0));
        let height_m = match (4.0..8.0).contains(&from_goal) {
            true => f32::NAN,
            false => 0.25 * (from_start - 3.0).clamp(0.0, 4.0),
        };
        let friction = if from_start < 9.0 { FrictionCurve::ICE } else { FrictionCurve::DIRT };
        GroundCell { height_m, ..GroundCell::level(friction) }
    });
    let planner = Planner::new(ground, RouteConfig::default()).unwrap();
    let told = |start_m: [f64; 2], goal_m: [f64; 2]| {
        planner.route((start_m, 0.0), goal_m, &LIMITS).unwrap_err().to_string()
    };
    let out = told([12.5, 20.5], [30.5, 50.5]);
    assert!(
        out.starts_with("no route: ") && out.ends_with("the ground is too slippery for its slope"),
        "{out}"
    );
    let into = told([30.5, 50.5], [45.5, 20.5]);
    assert!(into.starts_with("no route: ") && into.ends_with("nothing is known of the ground"), "{into}");
}

#[test]
fn a_changed_part_gives_the_routes_of_a_map_that_was_always_so() {
    let mut planner =
        Planner::new(map(50, |_| GroundCell::level(FrictionCurve::GRASS)), RouteConfig::default()).unwrap();
    let region = CellRegion { rows: 10..40, cols: 20..26 };
    let walled = |_: Cell, cell: GroundCell| GroundCell { is_obstacle: true, ..cell };
    planner.change(&region, walled).unwrap();
    let fresh = Planner::new(planner.ground().clone(), RouteConfig::default()).unwrap();
    let of = |planner: &Planner| planner.route(([5.5, 25.5], 0.0), [45.5, 25.5], &LIMITS).unwrap();
    assert_eq!(of(&planner), of(&fresh));
    let clear = CellRegion { rows: 24..30, cols: 20..26 };
    planner.change(&clear, |_, cell| GroundCell { is_obstacle: false, ..cell }).unwrap();
    let fresh = Planner::new(planner.ground().clone(), RouteConfig::default()).unwrap();
    assert_eq!(of(&planner), of(&fresh));
    assert!(of(&planner).cost_m < 230.0);
}

/// A hump across the straight way that the search thinks nothing of: a weak vehicle, for which no speed will do on it, is
/// led around, and where it fills the map, the refusal says where it was.
#[test]
fn a_line_that_no_speed_will_do_on_is_led_around() {
    let hump = |rows: std::ops::Range<usize>| {
        map(40, move |Cell { row, col }| {
            let rise = if rows.contains(&row) { 4.0 - (col as f32 - 20.0).abs() } else { 0.0 };
            GroundCell { height_m: 0.3 * rise.max(0.0), ..GroundCell::level(FrictionCurve::ASPHALT) }
        })
    };
    let careless =
        RouteConfig { slope_weight: 0.0, roll_max_rad: 1.2, pitch_max_rad: 1.2, ..RouteConfig::default() };
    let careless = RouteConfig { friction_share: 1.0, ..careless };
    let route = |rows: std::ops::Range<usize>, traction_max_mps2: f64| {
        let limits = SpeedLimits { traction_max_mps2, ..LIMITS };
        Planner::new(hump(rows), careless).unwrap().route(([5.5, 20.5], 0.0), [35.5, 20.5], &limits)
    };
    let highest_m =
        |route: route::Route| route.line.points.iter().map(|point| point.height_m).fold(0.0, f64::max);
    // A climb of 0.3 takes 9.81 x 0.3 / sqrt(1.09) = 2.82 m/s2.
    assert!(highest_m(route(18..23, 3.5).unwrap()) > 1.0);
    let around = route(18..23, 2.5).unwrap();
    assert!(around.line.points.iter().all(|point| point.bend.grade < 0.27), "{around:?}");
    assert!(highest_m(around) < 0.5);
    let error = route(0..40, 2.5).unwrap_err().to_string();
    assert!(
        error.starts_with("climb at") && error.contains("expected at most 2.50 m/s2, found 2.8"),
        "{error}"
    );
}

/// Forty such humps one after the other, from the south and from the north in turn: more than are led around one at a time.
#[test]
fn a_line_is_led_around_many_places_at_once() {
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 30, n_cols: 820 };
    let cell = |index: usize| {
        let Cell { row, col } = geometry.cell(index);
        let from_top = (col as f32 % 20.0 - 10.0).abs();
        let is_hump = if col / 20 % 2 == 0 { row < 18 } else { row >= 12 };
        let height_m = if is_hump && col < 800 { 0.3 * (4.0 - from_top).max(0.0) } else { 0.0 };
        GroundCell { height_m, ..GroundCell::level(FrictionCurve::ASPHALT) }
    };
    let ground = GridMap::from_values(geometry, (0..geometry.n_cells()).map(cell).collect()).unwrap();
    let careless = RouteConfig { pitch_max_rad: 1.2, roll_max_rad: 1.2, ..RouteConfig::default() };
    let careless = RouteConfig { slope_weight: 0.0, friction_share: 1.0, ..careless };
    let limits = SpeedLimits { traction_max_mps2: 2.5, ..LIMITS };
    let planner = Planner::new(ground, careless).unwrap();
    let route = planner.route(([2.5, 15.5], 0.0), [815.5, 15.5], &limits).unwrap();
    let climbs_mps2 = route.line.points.iter().map(|RoutePoint { bend, .. }| {
        9.81 * bend.grade / (1.0 + bend.grade.powi(2) + bend.cross_slope.powi(2)).sqrt()
    });
    assert!(climbs_mps2.fold(0.0, f64::max) < 2.5);
    // Six metres to and fro every twenty: 813 x hypot(20, 6) / 20.
    assert!((830.0..900.0).contains(&route.line.length_m()), "{}", route.line.length_m());
}
