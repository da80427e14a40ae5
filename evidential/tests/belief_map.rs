//! The map: features and posterior of every pose against the plain forms, holes, obstacles, partial updates, threads.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod untrained;

use std::sync::Arc;

use bicycle::lanes::Instructions;
use evidential::{
    AVOIDED_METRES, BeliefMap, BeliefMapError, Checkpoint, Learned, Method, Prediction, Predictor, Prior,
    Unfamiliar,
};
use physics_prior::{Assumption, PriorMap, PriorMapError};
use terrain::{Cell, CellRegion, GridGeometry, GridMap, PatchSample, SurfaceCell, TerrainClass};
use traversability::{CvarLevel, GroundFlags, Pmf, PmfQuad, Risk, RiskMapView};
use untrained::{CAR, checkpoint, rough};

const LEVEL: f64 = 0.4;
const SURFACE: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [-4, 7], n_rows: 36, n_cols: 42 };
const RISK: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [-2, 8], n_rows: 33, n_cols: 37 };

fn level() -> CvarLevel {
    CvarLevel::new(LEVEL).unwrap()
}

fn learned(checkpoint: &Checkpoint, unfamiliar: Unfamiliar) -> Learned {
    Learned { checkpoint: Arc::new(checkpoint.clone()), unfamiliar, obstacle_margin_m: 0.0, level: level() }
}

fn map_of(
    checkpoint: &Checkpoint,
    unfamiliar: Unfamiliar,
    surface: &GridMap<SurfaceCell>,
    risk: GridGeometry,
) -> BeliefMap {
    let learned = learned(checkpoint, unfamiliar);
    let mut map =
        BeliefMap::new(&CAR, &learned, surface.geometry().resolution_m, risk, 7, Instructions::widest())
            .unwrap();
    map.update_all(surface).unwrap();
    map
}

fn prior_of(checkpoint: &Checkpoint, surface: &GridMap<SurfaceCell>, risk: GridGeometry) -> PriorMap {
    let assumption = Assumption::Physics { prior: checkpoint.sidecar.prior, level: level() };
    let mut map =
        PriorMap::new(&CAR, &assumption, surface.geometry().resolution_m, risk, 7, Instructions::widest())
            .unwrap();
    map.update_all(surface).unwrap();
    map
}

/// The poses inside the border: cell, yaw bin, pose. A hair to the north-east, so that rounding cannot take a pose to
/// another surface cell.
fn poses(view: &RiskMapView<'_>) -> Vec<(Cell, usize, [f64; 3])> {
    let geometry = view.geometry;
    let cells =
        (1..geometry.n_rows - 1).flat_map(|row| (1..geometry.n_cols - 1).map(move |col| Cell { row, col }));
    let pose = |(cell, yaw): (Cell, usize)| {
        let [x_m, y_m] = geometry.centre_m(cell);
        (cell, yaw, [x_m + 1e-9, y_m + 1e-9, view.yaw_rad(yaw)])
    };
    cells.flat_map(|cell| (0..view.n_yaws).map(move |yaw| (cell, yaw))).map(pose).collect()
}

/// Whether there is a height under every wheel and sample.
fn is_wholly_known(checkpoint: &Checkpoint, surface: &GridMap<SurfaceCell>, pose: [f64; 3]) -> bool {
    let layout = &checkpoint.sidecar.layout;
    let of_wheels =
        terrain::wheel_heights_m(surface, &layout.wheels, pose).iter().all(|height| !height.is_nan());
    let of_samples = [layout.height_patch, layout.cover_patch].iter().all(|patch| {
        let mut samples = vec![PatchSample::UNKNOWN; patch.n_samples()];
        patch.sample(surface, &layout.wheels, pose, &mut samples);
        samples.iter().all(|sample| !sample.relative_height_m.is_nan())
    });
    of_wheels && of_samples
}

/// Equation 11 with distributions, and CVaR from these; on ground that is not wholly known the prior is physics.
fn expected_risk(checkpoint: &Checkpoint, prior: &[Pmf; 4], prediction: &Prediction, is_known: bool) -> Risk {
    let n_prior = checkpoint.sidecar.prior.evidence as f32;
    let against = match checkpoint.sidecar.method.prior() {
        Prior::Physics => *prior,
        Prior::Uniform if is_known => [Pmf::UNIFORM; 4],
        Prior::Uniform => *prior,
        Prior::None => prediction.pmfs,
    };
    let posterior: [Pmf; 4] = std::array::from_fn(|k| {
        let n = prediction.evidence.map_or(0.0, |evidence| evidence.counts[k]);
        against[k].mixed_with(&prediction.pmfs[k], n / (n_prior + n))
    });
    PmfQuad::new(&posterior[0], &posterior[1], &posterior[2], &posterior[3]).risk(level())
}

fn is_close(found: Risk, expected: Risk) -> bool {
    let parts = |r: Risk| [r.linear_traction, r.angular_traction, r.roll_rad, r.pitch_rad];
    parts(found).iter().zip(parts(expected)).all(|(f, e)| (f - e).abs() < 1e-3)
}

/// A risk with as many half turns on top of it as another has.
fn as_blocked_as(other: Risk, free: Risk) -> Risk {
    match (other.roll_rad / Risk::BLOCKED_RAD) as u8 {
        0 => free,
        1 => free.blocked(),
        _ => free.touching(),
    }
}

/// Also for risk cells that are coarser and finer than those of the surface.
#[test]
fn every_pose_has_the_risk_of_its_posterior() {
    let surface = rough(SURFACE, 1);
    for (method, resolution_m) in Method::ALL.into_iter().zip([0.1, 0.2, 0.05, 0.15, 0.1, 0.3]) {
        let risk = GridGeometry { resolution_m, origin: [1, 9], n_rows: 12, n_cols: 14 };
        let checkpoint = checkpoint(method, 5);
        let predictor = Predictor::new(&checkpoint, Instructions::widest()).unwrap();
        let (map, prior) =
            (map_of(&checkpoint, Unfamiliar::Fuse, &surface, risk), prior_of(&checkpoint, &surface, risk));
        let view = map.risk_map().view();
        let (mut n_judged, mut n_wrong) = (0, 0);
        for (cell, yaw, [x_m, y_m, yaw_rad]) in poses(&view) {
            let features = checkpoint.sidecar.layout.features(&surface, [x_m, y_m, yaw_rad]);
            let (Some(features), Some(belief)) = (features, prior.belief(x_m, y_m, yaw_rad)) else {
                continue;
            };
            let prediction = predictor.predict(&[features]).unwrap()[0];
            let pmfs = [belief.linear, belief.angular, belief.roll, belief.pitch];
            let by_prior = prior.risk_map().view().risk(cell, yaw);
            let is_known = is_wholly_known(&checkpoint, &surface, [x_m, y_m, yaw_rad]);
            let expected = expected_risk(&checkpoint, &pmfs, &prediction, is_known);
            let expected = as_blocked_as(by_prior, expected);
            let found = view.risk(cell, yaw);
            // Mostly unknown ground is the prior's alone.
            let is_right = is_close(found, expected) || is_close(found, by_prior);
            n_judged += usize::from(is_close(found, expected));
            n_wrong += usize::from(!is_right);
        }
        // A sample on the very edge between two cells may take its cover from either.
        assert!(
            n_judged > 200 && 500 * n_wrong <= n_judged,
            "{method:?}: {n_judged} judged, {n_wrong} wrong"
        );
    }
}

#[test]
fn known_ground_is_judged_by_networks_and_unknown_ground_by_the_prior() {
    let hole = |x_m: f64| {
        if x_m < 2.0 { SurfaceCell::certain(0.1, TerrainClass::Open, 0.0) } else { SurfaceCell::UNKNOWN }
    };
    let cells = (0..SURFACE.n_cells()).map(|index| hole(SURFACE.centre_m(SURFACE.cell(index))[0]));
    let surface = GridMap::from_values(SURFACE, cells.collect()).unwrap();
    for method in Method::ALL {
        let checkpoint = checkpoint(method, 8);
        let map = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
        let prior = prior_of(&checkpoint, &surface, RISK);
        let [known, unknown] = [1.0, 3.0]
            .map(|x_m| [map.risk_map(), prior.risk_map()].map(|map| map.view().risk_at(x_m, 2.0, 0.3)));
        assert!(!is_close(known[0], known[1]), "{method:?}: {known:?}");
        assert!(is_close(unknown[0], unknown[1]), "{method:?}: {unknown:?}");
    }
}

#[test]
fn the_belief_of_a_pose_is_what_its_risk_is_made_of() {
    let surface = rough(SURFACE, 4);
    for method in Method::ALL {
        let checkpoint = checkpoint(method, 2);
        let map = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
        let view = map.risk_map().view();
        let (mut n_learned, mut n_unknown) = (0, 0);
        for (cell, yaw, [x_m, y_m, yaw_rad]) in poses(&view).into_iter().step_by(7) {
            let belief = map.belief(x_m, y_m, yaw_rad).unwrap();
            let [linear, angular, roll, pitch] = &belief.posterior;
            let expected = PmfQuad::new(linear, angular, roll, pitch).risk(level());
            let found = view.risk(cell, yaw);
            let expected = as_blocked_as(found, expected);
            assert!(is_close(found, expected), "{method:?} {cell:?} {yaw}: {found:?} {expected:?}");
            match belief.prediction {
                Some(_) => n_learned += usize::from(belief.learned_share.iter().all(|share| *share > 0.0)),
                None => n_unknown += usize::from(belief.learned_share == [0.0; 4]),
            }
        }
        assert!(n_learned > 500 && n_unknown > 5, "{method:?}: {n_learned} {n_unknown}");
        assert!(map.belief(-30.0, 2.0, 0.0).is_none());
    }
}

#[test]
fn obstacles_block_what_they_block_for_the_prior() {
    let surface = rough(SURFACE, 2);
    let checkpoint = checkpoint(Method::Pietra, 6);
    let map = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
    let prior = prior_of(&checkpoint, &surface, RISK);
    let blocked =
        |map: RiskMapView<'_>| -> Vec<bool> { map.risks.iter().map(|risk| risk.is_blocked()).collect() };
    let found = blocked(map.risk_map().view());
    assert_eq!(found, blocked(prior.risk_map().view()));
    assert!(found.iter().any(|is| *is) && !found.iter().all(|is| *is));
    for (found, expected) in map.risk_map().view().ground.iter().zip(prior.risk_map().view().ground) {
        assert_eq!((found.gradient, found.class), (expected.gradient, expected.class));
        assert!(found.flags.contains(expected.flags));
    }
}

#[test]
fn ground_unlike_the_training_data_is_flagged_and_avoided_on_request() {
    let surface = rough(SURFACE, 3);
    let checkpoint = checkpoint(Method::Evora, 7);
    let predictor = Predictor::new(&checkpoint, Instructions::widest()).unwrap();
    let fused = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
    let avoiding = map_of(&checkpoint, Unfamiliar::Avoid, &surface, RISK);
    let (fused, avoiding) = (fused.risk_map().view(), avoiding.risk_map().view());
    let min = checkpoint.sidecar.density.unwrap().min as f32;
    let mut n_out = vec![0; RISK.n_cells()];
    let mut n_avoided = 0;
    for (cell, yaw, pose) in poses(&fused) {
        let Some(features) = checkpoint.sidecar.layout.features(&surface, pose) else { continue };
        let log_density = predictor.predict(&[features]).unwrap()[0].evidence.unwrap().log_density;
        if (log_density - min).abs() < 0.02 {
            continue;
        }
        let is_out = log_density < min && is_wholly_known(&checkpoint, &surface, pose);
        n_out[RISK.index(cell)] += usize::from(is_out);
        let mut expected = fused.risk(cell, yaw);
        if is_out {
            n_avoided += usize::from(expected.linear_traction > 0.1 && !expected.is_blocked());
            let traction = expected.linear_traction;
            expected.linear_traction = (traction / AVOIDED_METRES).max(traction.min(0.1));
        }
        assert_eq!(avoiding.risk(cell, yaw), expected);
    }
    assert!(n_avoided > 100, "{n_avoided}");
    let flagged = |index: usize| fused.ground[index].flags.contains(GroundFlags::OUT_OF_DISTRIBUTION);
    assert!((0..n_out.len()).all(|index| n_out[index] < 4 || flagged(index)));
    assert!(
        (0..n_out.len()).filter(|&index| flagged(index)).count() < RISK.n_cells() / 2 + RISK.n_cells() / 3
    );
}

#[test]
fn a_partial_update_equals_the_whole_map_bit_by_bit() {
    let before = rough(SURFACE, 11);
    let changed = rough(SURFACE, 12);
    for (method, resolution_m) in [(Method::Pietra, 0.1), (Method::Evora, 0.2), (Method::Vanilla, 0.05)] {
        let risk = GridGeometry { resolution_m, origin: [2, 10], n_rows: 17, n_cols: 15 };
        let checkpoint = checkpoint(method, 9);
        let mut partly = map_of(&checkpoint, Unfamiliar::Fuse, &before, risk);
        let mut surface = before.clone();
        let regions = [(5..9, 7..13), (0..2, 0..40), (30..36, 3..4), (12..13, 20..21), (4..4, 3..9)];
        for (rows, cols) in regions {
            let region = CellRegion { rows, cols };
            for cell in region.cells() {
                surface[cell] = changed[cell];
            }
            partly.update(&surface).unwrap();
            assert_eq!(partly.risk_map(), map_of(&checkpoint, Unfamiliar::Fuse, &surface, risk).risk_map());
        }
    }
}

/// Networks whose patch reaches beyond all that physics feels of a pose.
#[test]
fn what_networks_alone_read_is_judged_anew() {
    let mut checkpoint = checkpoint(Method::Vanilla, 9);
    checkpoint.sidecar.layout.height_patch.spacing_m *= 4.0;
    let open = SurfaceCell::certain(0.3, TerrainClass::Open, 0.0);
    let mut surface = GridMap::filled(SURFACE, open);
    let mut map = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
    let before = map.risk_map().clone();
    let bump = Cell { row: 20, col: 22 };
    surface[bump] = SurfaceCell { height_m: 0.4, ..open };
    map.update(&surface).unwrap();
    let whole = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
    assert!(map.risk_map() == whole.risk_map(), "the map that followed is not the map made whole");
    let [bump_x_m, bump_y_m] = SURFACE.centre_m(bump);
    let is_far = |[x_m, y_m, _]: [f64; 3]| (x_m - bump_x_m).hypot(y_m - bump_y_m) > 0.6;
    let changed = poses(&before.view())
        .into_iter()
        .filter(|&(cell, yaw, pose)| {
            is_far(pose) && map.risk_map().view().risk(cell, yaw) != before.view().risk(cell, yaw)
        })
        .count();
    assert!(changed > 20, "{changed}");
}

#[test]
fn the_map_does_not_depend_on_the_number_of_threads() {
    let surface = rough(SURFACE, 13);
    let checkpoint = checkpoint(Method::Pietra, 10);
    let with = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK).risk_map().clone())
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn a_moved_window_or_another_level_is_a_whole_new_map() {
    let surface = rough(SURFACE, 14);
    let checkpoint = checkpoint(Method::Pietra, 10);
    let moved = GridGeometry { origin: [3, 5], ..RISK };
    let mut map = map_of(&checkpoint, Unfamiliar::Fuse, &surface, RISK);
    map.place_at(moved.origin);
    map.update(&surface).unwrap();
    assert_eq!(map.risk_map(), map_of(&checkpoint, Unfamiliar::Fuse, &surface, moved).risk_map());
    let careful = CvarLevel::new(0.1).unwrap();
    map.set_level(careful);
    map.update(&surface).unwrap();
    let mut fresh = BeliefMap::new(
        &CAR,
        &Learned { level: careful, ..learned(&checkpoint, Unfamiliar::Fuse) },
        0.1,
        moved,
        7,
        Instructions::widest(),
    )
    .unwrap();
    fresh.update_all(&surface).unwrap();
    assert_eq!(map.risk_map(), fresh.risk_map());
}

#[test]
fn numbers_that_are_none_never_reach_the_map() {
    let mut surface = rough(SURFACE, 15);
    let poison = SurfaceCell {
        height_m: f32::NAN,
        height_variance_m2: f32::NAN,
        vegetation_height_m: f32::INFINITY,
        class_probability: [f32::NAN; 4],
        ..SurfaceCell::certain(0.0, TerrainClass::Open, 0.0)
    };
    let far = SurfaceCell { height_m: -3e38, ..SurfaceCell::certain(0.0, TerrainClass::Open, 3e38) };
    for index in (0..SURFACE.n_cells()).step_by(17) {
        surface.values_mut()[index] = if index % 2 == 0 { poison } else { far };
    }
    for method in Method::ALL {
        let map = map_of(&checkpoint(method, 3), Unfamiliar::Fuse, &surface, RISK);
        for risk in map.risk_map().view().risks {
            let parts = [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad];
            assert!(parts.iter().all(|part| part.is_finite()), "{method:?}: {risk:?}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused_with_what_was_expected_and_found() {
    let checkpoint = checkpoint(Method::Vanilla, 1);
    let new = |geometry, unfamiliar, resolution_m, n_yaws| {
        BeliefMap::new(
            &geometry,
            &learned(&checkpoint, unfamiliar),
            resolution_m,
            RISK,
            n_yaws,
            Instructions::widest(),
        )
        .map(drop)
    };
    let other = bicycle::Geometry { track_m: 1.5, ..CAR };
    let message = new(other, Unfamiliar::Fuse, 0.1, 7).unwrap_err().to_string();
    assert_eq!(
        message,
        "networks of method vanilla: trained on vehicle rc_car, track_m: expected 0.2 as there, found 1.5"
    );
    let message = new(CAR, Unfamiliar::Avoid, 0.1, 7).unwrap_err().to_string();
    assert!(message.contains("vanilla") && message.contains("expected"), "{message}");
    assert!(matches!(new(CAR, Unfamiliar::Fuse, 0.1, 0), Err(BeliefMapError::Prior(PriorMapError::NoYaws))));
    let mut map = map_of(&checkpoint, Unfamiliar::Fuse, &rough(SURFACE, 1), RISK);
    let coarse = rough(GridGeometry { resolution_m: 0.3, ..SURFACE }, 1);
    assert!(matches!(
        map.update_all(&coarse),
        Err(BeliefMapError::Prior(PriorMapError::SurfaceResolution { .. }))
    ));
}
