//! Where stuck poses lie when the localisation jumps around them, and what is told of friction.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::StuckPose;
use bicycle::Odometry;
use terrain::{GridGeometry, TerrainClass};

use crate::FrictionConfig;

const JUMP: Jump = Jump { step_m: [10.0, 0.0, 0.0], yaw_rad: 0.0 };
const JUMPED_AT_NS: u64 = 500;

fn assessor() -> Assessor {
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let (config, level) = (Config::for_vehicle(&vehicle), CvarLevel::new(0.5).unwrap());
    Assessor::new(&vehicle, &vehicle.limits, &config, &Belief::Nominal, level).unwrap()
}

fn surface(epoch_ns: u64, frame_at_ns: u64, shift: Jump) -> SurfaceHeader {
    SurfaceHeader {
        id: MessageId { epoch_ns, sequence: frame_at_ns },
        valid_at_ns: frame_at_ns,
        scan: MessageId::default(),
        odometry: Odometry::default(),
        frame_at_ns,
        last_odometry: MessageId::default(),
        n_odometry: 0,
        jump: None,
        shift,
    }
}

fn stuck(valid_at_ns: u64) -> StuckMessage {
    let pose = StuckPose { position_m: [1.0, 2.0], yaw_rad: 0.3 };
    StuckMessage { id: MessageId { epoch_ns: 1, sequence: valid_at_ns }, valid_at_ns, pose }
}

fn places_m(assessor: &Assessor) -> Vec<f64> {
    assessor.layer.stuck().iter().map(|(_, pose)| pose.position_m[0]).collect()
}

#[test]
fn a_stuck_pose_moves_with_the_jumps_after_it_and_with_no_others() {
    // Told of before the map of the jump, and after it.
    for is_late in [false, true] {
        let mut assessor = assessor();
        assessor.hear_surface(&surface(1, 100, Jump::NONE));
        let before = stuck(JUMPED_AT_NS - 1);
        let after = stuck(JUMPED_AT_NS);
        if !is_late {
            [before, after].iter().for_each(|stuck| assessor.hear_stuck(stuck));
        }
        assessor.hear_surface(&surface(1, JUMPED_AT_NS, JUMP));
        if is_late {
            [before, after].iter().for_each(|stuck| assessor.hear_stuck(stuck));
        }
        assert_eq!(places_m(&assessor), [11.0, 1.0], "late: {is_late}");
        // The same jump is told of again with every later map.
        assessor.hear_surface(&surface(1, JUMPED_AT_NS + 100, JUMP));
        assert_eq!(places_m(&assessor), [11.0, 1.0], "late: {is_late}");
        assessor.hear_surface(&surface(1, JUMPED_AT_NS + 200, JUMP.then(&JUMP)));
        assert_eq!(places_m(&assessor), [21.0, 11.0], "late: {is_late}");
    }
}

#[test]
fn a_surveyor_that_began_anew_counts_its_jumps_from_nothing() {
    let mut assessor = assessor();
    assessor.hear_surface(&surface(1, 100, JUMP));
    assessor.hear_stuck(&stuck(200));
    assessor.hear_surface(&surface(9, 300, Jump::NONE));
    assert_eq!(places_m(&assessor), [1.0]);
}

/// Hundredths of friction that the cells of a map of open ground are said to hold.
fn told(assessor: &mut Assessor) -> Vec<u8> {
    let geometry = GridGeometry::centred(assessor.layer.resolution_m(), 60, 60, 0.0, 0.0);
    let ground = GridMap::filled(geometry, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
    assessor.judge(&surface(1, 100, Jump::NONE), &ground).unwrap();
    let known = assessor.known().unwrap();
    // Just west of the origin, and just east of it.
    let middle = known.geometry.cell_at(0.0, 0.0).map(|cell| known.geometry.index(cell)).unwrap();
    [middle - 1, middle].map(|index| known.ground[index].friction.hundredths()).to_vec()
}

#[test]
fn what_is_known_of_friction_is_told_cell_by_cell_and_outlives_another_judge() {
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let level = CvarLevel::new(0.5).unwrap();
    let assessor = |belief: &Belief, open: Option<f64>| {
        let mut config = Config::for_vehicle(&vehicle);
        if open.is_some() {
            config.keep_to_friction(FrictionConfig { open, ..FrictionConfig::default() });
        }
        Assessor::new(&vehicle, &vehicle.limits, &config, belief, level).unwrap()
    };
    for belief in [Belief::Nominal, Belief::Physics] {
        assert_eq!(told(&mut assessor(&belief, None)), [0, 0], "nobody knows");
        let mut knowing = assessor(&belief, Some(0.7));
        assert_eq!(told(&mut knowing), [70, 70]);
        // Known by place from the origin eastwards.
        let east = GridGeometry { resolution_m: 10.0, origin: [0, -1], n_rows: 2, n_cols: 1 };
        knowing.know_friction(Arc::new(GridMap::filled(east, 0.12)));
        assert_eq!(told(&mut knowing), [70, 12]);
        knowing.judge_like(assessor(&belief, Some(0.5))).unwrap();
        assert_eq!(told(&mut knowing), [50, 12]);
    }
}

/// A crest across the way, of which physics knows, whoever believes in level ground does not, and who is told what the
/// ground does to the vehicle knows it from there.
#[test]
fn the_ground_is_told_how_fast_it_may_be_driven_over_by_who_judges_it() {
    let vehicle = formats::read_vehicle("buggy_fifth").unwrap();
    let level = CvarLevel::new(0.5).unwrap();
    let crested: crate::RiskOracle =
        Arc::new(|geometry: &GridGeometry, n_yaws: usize, risks: &mut [Risk]| {
            for (index, risk) in risks.iter_mut().enumerate() {
                let [x_m, _] = geometry.centre_m(geometry.cell(index / n_yaws));
                *risk = Risk { pitch_rad: (0.4 - 0.8 * (x_m - 0.5).abs()).max(0.0) as f32, ..Risk::NONE };
            }
        });
    for (belief, n_heights, is_limited) in [
        (Belief::Physics, 0.15, true),
        (Belief::Physics, 0.0, false),
        (Belief::Nominal, 0.15, false),
        (Belief::Given(crested), 0.0, true),
    ] {
        let config = Config::for_vehicle(&vehicle);
        let mut assessor = Assessor::new(&vehicle, &vehicle.limits, &config, &belief, level).unwrap();
        let geometry = GridGeometry::centred(assessor.layer.resolution_m(), 120, 120, 0.0, 0.0);
        let heights = (0..geometry.n_cells()).map(|index| {
            let [x_m, _] = geometry.centre_m(geometry.cell(index));
            SurfaceCell::certain(
                (n_heights * (1.0 - 2.0 * (x_m - 0.5).abs()).max(0.0)) as f32,
                TerrainClass::Open,
                0.0,
            )
        });
        let ground = GridMap::from_values(geometry, heights.collect()).unwrap();
        assessor.judge(&surface(1, 100, Jump::NONE), &ground).unwrap();
        let known = assessor.known().unwrap();
        let limit_mps = |x_m: f64| {
            known.ground[known.geometry.index(known.geometry.cell_at(x_m, 0.0).unwrap())].speed.mps()
        };
        let slowest_mps = (0..10).map(|k| limit_mps(0.1 * f64::from(k))).fold(f32::INFINITY, f32::min);
        assert_eq!(slowest_mps < 8.0, is_limited, "{slowest_mps} m/s");
        assert!(limit_mps(-2.5) > 8.0, "level ground behind it");
    }
}
