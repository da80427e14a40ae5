//! Maps that follow a vehicle scan by scan equal maps that are made whole of the same surface, to the last bit.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod untrained;

use std::sync::Arc;

use bicycle::lanes::Instructions;
use evidential::{BeliefMap, Learned, Method, Unfamiliar};
use physics_prior::{Assumption, PriorMap};
use proptest::prelude::*;
use terrain::{
    ElevationConfig, ElevationMap, GridGeometry, GridMap, Pose, RangePoint, Scan, SurfaceCell, TerrainClass,
};
use traversability::{CvarLevel, RiskMap};
use untrained::{CAR, checkpoint};

const RESOLUTION_M: f64 = 0.1;
const N_YAWS: usize = 5;
const RISK: GridGeometry =
    GridGeometry { resolution_m: RESOLUTION_M, origin: [-9, -8], n_rows: 17, n_cols: 18 };
/// The risk map's window follows after so many cells.
const RECENTRE_CELLS: i64 = 2;

/// Time since the last scan, way since then, and a part of the window that is seen.
#[derive(Clone, Debug)]
struct Step {
    elapsed_ns: u64,
    way_m: [f64; 2],
    seen_m: [std::ops::Range<f64>; 2],
    bump_m: f64,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let part = |start_m: f64, width_m: f64| start_m..start_m + width_m;
    let step = (
        prop_oneof![Just(0_u64), 0..5_000_000_000_u64],
        (-0.12..0.12_f64, -0.12..0.12_f64),
        (-1.5..1.2_f64, 0.0..0.8_f64, -1.5..1.2_f64, 0.0..0.8_f64),
        0.0..0.08_f64,
    );
    let step = step.prop_map(move |(elapsed_ns, (x_m, y_m), (west, width, south, height), bump_m)| Step {
        elapsed_ns,
        way_m: [x_m, y_m],
        seen_m: [part(west, width), part(south, height)],
        bump_m,
    });
    prop::collection::vec(step, 2..6)
}

/// Uneven ground with plants, a rock and a bump that comes and goes; one point for every cell within the part seen.
fn scan(valid_at_ns: u64, pose: &Pose, seen_m: &[std::ops::Range<f64>; 2], bump_m: f64) -> Scan {
    let mut points = Vec::new();
    for (row, col) in (-16..16).flat_map(|row| (-16..16).map(move |col| (row, col))) {
        let [x_m, y_m] = [col, row].map(|index| (f64::from(index) + 0.43) * RESOLUTION_M);
        if !(seen_m[0].contains(&x_m) && seen_m[1].contains(&y_m)) {
            continue;
        }
        let [east_m, north_m] = [pose.x_m + x_m, pose.y_m + y_m];
        let place = [east_m, north_m].map(|v| (v / RESOLUTION_M).floor() as i64);
        let class = match (3 * place[0] + 5 * place[1]).rem_euclid(23) {
            0 => TerrainClass::Vegetation,
            1 => TerrainClass::Loose,
            2 if place[1] % 4 == 0 => TerrainClass::Obstacle,
            _ => TerrainClass::Open,
        };
        let height_m = 0.05 * ((2.1 * east_m).sin() + (1.7 * north_m).cos()) + bump_m;
        points.push(RangePoint { position_m: [x_m as f32, y_m as f32, height_m as f32 - 1.0], class });
    }
    Scan { valid_at_ns, origin_m: [0.0, 0.0, 1.0], points }
}

/// Both authors of a risk map.
struct Maps {
    prior: PriorMap,
    belief: BeliefMap,
}

impl Maps {
    fn new(window: GridGeometry) -> Self {
        let checkpoint = Arc::new(checkpoint(Method::Pietra, 4));
        let level = CvarLevel::new(0.3).unwrap();
        let assumption = Assumption::Physics { prior: checkpoint.sidecar.prior, level };
        let learned = Learned { checkpoint, unfamiliar: Unfamiliar::Avoid, obstacle_margin_m: 0.02, level };
        Self {
            prior: PriorMap::new(&CAR, &assumption, RESOLUTION_M, window, N_YAWS, Instructions::widest())
                .unwrap(),
            belief: BeliefMap::new(&CAR, &learned, RESOLUTION_M, window, N_YAWS, Instructions::widest())
                .unwrap(),
        }
    }

    fn whole(window: GridGeometry, surface: &GridMap<SurfaceCell>) -> Self {
        let mut maps = Self::new(window);
        maps.prior.update_all(surface).unwrap();
        maps.belief.update_all(surface).unwrap();
        maps
    }

    fn follow(&mut self, pose: &Pose) {
        let now = *self.prior.risk_map().geometry();
        let wanted = GridGeometry::centred(RESOLUTION_M, now.n_rows, now.n_cols, pose.x_m, pose.y_m);
        if (0..2).any(|axis| (wanted.origin[axis] - now.origin[axis]).abs() >= RECENTRE_CELLS) {
            self.prior.place_at(wanted.origin);
            self.belief.place_at(wanted.origin);
        }
    }

    /// Returns how many poses the networks judged.
    fn update(&mut self, surface: &GridMap<SurfaceCell>) -> usize {
        self.prior.update(surface).unwrap();
        self.belief.update(surface).unwrap()
    }
}

fn bits(map: &RiskMap) -> Vec<[u32; 4]> {
    let view = map.view();
    let risks = view.risks.iter().map(|risk| {
        [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad].map(f32::to_bits)
    });
    let ground = view.ground.iter().map(|ground| {
        let [east, north] = ground.gradient.map(f32::to_bits);
        [east, north, u32::from(ground.class), u32::from(ground.flags.0)]
    });
    risks.chain(ground).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_map_that_follows_scan_by_scan_is_the_map_made_whole(steps in steps()) {
        // What was seen fades within seconds, so that it counts within the test.
        let config = ElevationConfig {
            resolution_m: RESOLUTION_M,
            n_rows: 32,
            n_cols: 32,
            recentre_m: 0.3,
            fading_m2ps: 1e-4,
            gap_radius_m: 0.2,
            publish_period_scans: 2,
            publish_near_m: 0.5,
            ..ElevationConfig::scaled_to(CAR.length_m)
        };
        let mut elevation = ElevationMap::new(config).unwrap();
        let (mut pose, mut now_ns) = (Pose { z_m: 1.0, ..Pose::default() }, 0);
        let everything = [-2.0..2.0, -2.0..2.0];
        elevation.fuse(&scan(now_ns, &pose, &everything, 0.0), &pose).unwrap();
        let mut followed = Maps::whole(RISK, elevation.surface());
        for step in steps {
            now_ns += step.elapsed_ns;
            (pose.x_m, pose.y_m) = (pose.x_m + step.way_m[0], pose.y_m + step.way_m[1]);
            elevation.fuse(&scan(now_ns, &pose, &step.seen_m, step.bump_m), &pose).unwrap();
            followed.follow(&pose);
            followed.update(elevation.surface());
            let whole = Maps::whole(*followed.prior.risk_map().geometry(), elevation.surface());
            prop_assert!(bits(followed.prior.risk_map()) == bits(whole.prior.risk_map()), "the prior's map");
            prop_assert!(bits(followed.belief.risk_map()) == bits(whole.belief.risk_map()), "the learned map");
        }
    }
}

/// What is judged anew is what reads a cell that changed, and what entered the window.
#[test]
fn little_is_judged_where_little_changed() {
    let window = GridGeometry { n_rows: 40, n_cols: 44, ..RISK };
    let around = GridGeometry { origin: [-29, -28], n_rows: 80, n_cols: 84, ..RISK };
    let level = SurfaceCell::certain(0.1, TerrainClass::Open, 0.0);
    let mut surface = GridMap::filled(around, level);
    let mut maps = Maps::whole(window, &surface);
    let n_poses = window.n_cells() * N_YAWS;
    assert_eq!(maps.update(&surface), 0, "nothing changed");
    // The car covers less than five by five cells, and wheels feel one more around.
    surface[terrain::Cell { row: 40, col: 42 }] = SurfaceCell { height_m: 0.12, ..level };
    let n_judged = maps.update(&surface);
    assert!((N_YAWS * 9..N_YAWS * 120).contains(&n_judged), "{n_judged}");
    let is_whole = |maps: &Maps, surface: &GridMap<SurfaceCell>| {
        let whole = Maps::whole(*maps.prior.risk_map().geometry(), surface);
        bits(maps.belief.risk_map()) == bits(whole.belief.risk_map())
            && bits(maps.prior.risk_map()) == bits(whole.prior.risk_map())
    };
    assert!(is_whole(&maps, &surface));
    // Twice before the next update; four columns of 44 are new, and the border of before.
    for origin in [[-7, -8], [-5, -8]] {
        maps.prior.place_at(origin);
        maps.belief.place_at(origin);
    }
    let n_judged = maps.update(&surface);
    assert!((n_poses / 11..n_poses / 4).contains(&n_judged), "{n_judged} of {n_poses}");
    assert!(is_whole(&maps, &surface));
}
