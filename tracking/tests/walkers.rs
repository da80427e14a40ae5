//! People who walk through scans: rays against upright cylinders, cast by the equations of a circle and a line.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::f64::consts::TAU;

use terrain::{BodyBox, GridGeometry, GridMap, Pose, RangePoint, Scan, SurfaceCell, TerrainClass};
use tracking::{TRACKS_MAX, Track, Tracker, TrackingConfig};

const SENSOR_M: f64 = 1.5;
const PERIOD_NS: u64 = 200_000_000;

/// An upright cylinder of 1.7 m.
#[derive(Clone, Copy)]
struct Cylinder {
    centre_m: [f64; 2],
    radius_m: f64,
}

fn person(centre_m: [f64; 2]) -> Cylinder {
    Cylinder { centre_m, radius_m: 0.3 }
}

/// Level ground, known all around.
fn ground() -> GridMap<SurfaceCell> {
    let geometry = GridGeometry::centred(0.2, 300, 300, 0.0, 0.0);
    GridMap::filled(geometry, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0))
}

/// Distance to the nearest cylinder in a direction of the map, if there is one within 25 m.
fn cast([x_m, y_m]: [f64; 2], [dx, dy]: [f64; 2], things: &[Cylinder]) -> Option<f64> {
    let hit = |thing: &Cylinder| {
        let [a, b] = [thing.centre_m[0] - x_m, thing.centre_m[1] - y_m];
        let (along, beside) = (a * dx + b * dy, a * dy - b * dx);
        let half = thing.radius_m * thing.radius_m - beside * beside;
        (half >= 0.0 && along > 0.0).then(|| along - half.sqrt())
    };
    things.iter().filter_map(hit).filter(|range_m| *range_m < 25.0).min_by(f64::total_cmp)
}

/// A sweep from a pose on level ground. The range is off by up to 3 cm, another way for every ray.
fn sweep(pose: &Pose, number: u64, things: &[Cylinder]) -> Scan {
    let mut points = Vec::new();
    for k in 0..240_u64 {
        let turn = (k as f64 + (number as f64 * 0.618).fract()) / 240.0 * TAU;
        let (sin, cos) = (turn + pose.yaw_rad).sin_cos();
        let Some(range_m) = cast([pose.x_m, pose.y_m], [cos, sin], things) else { continue };
        for beam in 0..6_u64 {
            let scramble = (k.wrapping_mul(2_654_435_761) ^ number.wrapping_mul(40_503) ^ (beam * 97)) % 61;
            let range_m = range_m + 0.001 * (scramble as f64 - 30.0);
            let position_m = [range_m * turn.cos(), range_m * turn.sin(), 0.1 + 0.3 * beam as f64];
            points
                .push(RangePoint { position_m: position_m.map(|v| v as f32), class: TerrainClass::Obstacle });
        }
    }
    Scan { valid_at_ns: number * PERIOD_NS, origin_m: [0.0, 0.0, SENSOR_M as f32], points }
}

fn tracker() -> Tracker {
    Tracker::new(TrackingConfig::default(), BodyBox::EMPTY).unwrap()
}

/// What is told after every one of `n` scans, of a vehicle and things that are where they are at a time [s].
fn told(n: u64, pose_at: impl Fn(f64) -> Pose, things_at: impl Fn(f64) -> Vec<Cylinder>) -> Vec<Vec<Track>> {
    let (mut tracker, ground) = (tracker(), ground());
    let after = |number: u64| {
        let time_s = number as f64 * PERIOD_NS as f64 * 1e-9;
        let pose = pose_at(time_s);
        tracker.observe(&sweep(&pose, number, &things_at(time_s)), &pose, &ground);
        tracker.moving().to_vec()
    };
    (0..n).map(after).collect()
}

fn driving(time_s: f64) -> Pose {
    Pose { x_m: -8.0 + 1.5 * time_s, y_m: 0.3 * time_s, yaw_rad: 0.2, ..Pose::default() }
}

#[test]
fn a_walker_is_followed_with_his_velocity_and_where_he_will_be() {
    for speed_mps in [0.5, 1.2, 2.0] {
        let at_m = |time_s: f64| [4.0, -5.0 + speed_mps * time_s];
        let told = told(20, driving, |time_s| vec![person(at_m(time_s))]);
        let known = told.iter().position(|tracks| !tracks.is_empty()).unwrap();
        assert!(known as f64 * 0.2 <= 0.45 + 0.7 / speed_mps, "{speed_mps} m/s: after {known} scans");
        let last = told[19][0];
        let time_s = 19.0 * 0.2;
        let off =
            |found: [f64; 2], expected: [f64; 2]| (found[0] - expected[0]).hypot(found[1] - expected[1]);
        assert!(off(last.position_m, at_m(time_s)) < 0.2, "{last:?}");
        assert!(off(last.velocity_mps, [0.0, speed_mps]) < 0.2, "{speed_mps} m/s: {last:?}");
        assert!((0.15..0.45).contains(&last.radius_m), "{last:?}");
        let then = last.predicted(2.0, TrackingConfig::default().acceleration_density_m2ps3);
        assert!(off(then.position_m, at_m(time_s + 2.0)) < 2.0 * then.std_m, "{then:?}");
        let same = |tracks: &Vec<Track>| tracks.len() == 1 && tracks[0].number == last.number;
        assert!(told[known..].iter().all(same), "{speed_mps} m/s: {told:?}");
    }
}

#[test]
fn what_stands_does_not_move_because_the_vehicle_does() {
    let trunks = [
        Cylinder { centre_m: [-2.0, 2.5], radius_m: 0.4 },
        Cylinder { centre_m: [1.0, -3.0], radius_m: 0.15 },
        Cylinder { centre_m: [3.0, 4.0], radius_m: 1.2 },
        // Comes into view from behind the one before.
        Cylinder { centre_m: [5.5, 5.2], radius_m: 0.5 },
    ];
    assert_stands(&told(60, driving, |_| trunks.to_vec()));
}

/// Nothing is told of that moves, and of what stands only what is no larger than people.
fn assert_stands(told: &[Vec<Track>]) {
    for track in told.iter().flatten() {
        assert!(track.velocity_mps == [0.0; 2] && track.radius_m <= 0.5, "{track:?}");
    }
    assert!(told[5..].iter().all(|tracks| !tracks.is_empty()), "who stands may set off: {told:?}");
}

#[test]
fn who_stops_is_told_of_while_he_stands_and_at_once_when_he_sets_off_again() {
    // He stands from 3 to 9 s, then goes on.
    let way_m = |time_s: f64| 1.2 * (time_s.min(3.0) + (time_s - 9.0).max(0.0));
    let told = told(60, |_| Pose::default(), |time_s| vec![person([4.0, -3.0 + way_m(time_s)])]);
    assert!(told[15..].iter().all(|tracks| tracks.len() == 1), "{told:?}");
    let speed_mps = |number: usize| told[number][0].velocity_mps[1];
    assert!((24..46).all(|number| speed_mps(number).abs() < 0.3), "1.8 to 6 s after he stopped");
    // Scan 46 is the first that shows him 0.24 m farther on: the second says so beyond doubt.
    assert!(speed_mps(47) > 0.6, "{}", speed_mps(47));
}

#[test]
fn what_is_larger_than_people_and_stands_for_as_long_as_is_set_is_told_of_when_it_sets_off() {
    let config = TrackingConfig { standing_max_s: 2.0, ..TrackingConfig::default() };
    let (mut tracker, ground) = (Tracker::new(config, BodyBox::EMPTY).unwrap(), ground());
    let way_m = |time_s: f64| 1.2 * (time_s.min(3.0) + (time_s - 9.0).max(0.0));
    let told: Vec<usize> = (0..50)
        .map(|number| {
            let centre_m = [4.0, -3.0 + way_m(0.2 * number as f64)];
            let things = [Cylinder { centre_m, radius_m: 0.8 }];
            tracker.observe(&sweep(&Pose::default(), number, &things), &Pose::default(), &ground);
            tracker.moving().len()
        })
        .collect();
    assert_eq!((told[20], told[40], told[48]), (1, 0, 1), "{told:?}");
}

/// Nobody has seen him move: he stands for 5 s and sets off. Scans 26 and 27 show him on his way.
#[test]
fn who_was_never_seen_to_move_is_told_of_by_the_second_scan_that_shows_him_set_off() {
    for speed_mps in [1.0, 2.0] {
        let way_m = |time_s: f64| speed_mps * (time_s - 5.0).max(0.0);
        let told = told(40, |_| Pose::default(), |time_s| vec![person([4.0, -3.0 + way_m(time_s)])]);
        assert_stands(&told[..26]);
        let [track] = told[27][..] else { panic!("{speed_mps} m/s: {told:?}") };
        let [east_mps, north_mps] = track.velocity_mps;
        assert!(east_mps.abs() < 0.3 && (north_mps - speed_mps).abs() < 0.3, "{track:?}");
        assert!(told[27..].iter().all(|tracks| tracks.len() == 1), "{told:?}");
    }
}

/// Two trunks side by side, of which one is hidden now and then: what is seen of them jumps, and has not set off.
#[test]
fn what_jumps_to_and_fro_has_not_set_off() {
    let trunks = |time_s: f64| {
        let one = Cylinder { centre_m: [4.0, 0.0], radius_m: 0.15 };
        let other = Cylinder { centre_m: [4.0, 0.45], radius_m: 0.15 };
        if ((time_s / 0.2).round() as u64).is_multiple_of(3) { vec![one] } else { vec![one, other] }
    };
    assert_stands(&told(60, |_| Pose::default(), trunks));
}

#[test]
fn two_who_meet_keep_their_numbers_and_their_ways() {
    let at = |time_s: f64| vec![person([6.0, -4.0 + 1.5 * time_s]), person([7.2, 4.0 - 1.5 * time_s])];
    let told = told(24, |_| Pose::default(), at);
    let [before, after] = [&told[8], &told[23]];
    assert_eq!((before.len(), after.len()), (2, 2));
    for track in before {
        let later = after.iter().find(|later| later.number == track.number).unwrap();
        assert!(later.velocity_mps[1] * track.velocity_mps[1] > 0.0, "{track:?} became {later:?}");
    }
}

/// They pass each other so closely that a scan sees one thing. Who comes out of it anew is told of at once, not only when
/// three scans have shown him.
#[test]
fn two_who_were_one_are_told_of_from_when_they_part() {
    let at = |time_s: f64| vec![person([6.0, -4.0 + 1.5 * time_s]), person([6.5, 4.0 - 1.5 * time_s])];
    let told = told(24, |_| Pose::default(), at);
    // They meet after 2.67 s, and are 1.3 m apart 0.4 s before and after that.
    for (number, told) in
        told.iter().enumerate().filter(|(number, _)| *number > 5 && !(12..16).contains(number))
    {
        for walker in at(0.2 * number as f64) {
            let away_m = told.iter().map(|track| {
                let [east_m, north_m] = [0, 1].map(|axis| track.position_m[axis] - walker.centre_m[axis]);
                east_m.hypot(north_m) - track.radius_m
            });
            let nearest_m = away_m.fold(f64::INFINITY, f64::min);
            assert!(nearest_m < 0.2, "scan {number}: {nearest_m} m from him to what is told");
        }
    }
}

#[test]
fn who_is_hidden_is_expected_where_he_goes_and_given_up_in_the_end() {
    let at = |time_s: f64| {
        let walker = person([6.0, -4.0 + 1.5 * time_s]);
        if (2.0..2.9).contains(&time_s) || time_s > 4.0 { Vec::new() } else { vec![walker] }
    };
    let told = told(40, |_| Pose::default(), at);
    let (before, hidden, after) = (told[9][0], told[13][0], told[16][0]);
    assert_eq!([before.number, hidden.number], [after.number; 2]);
    assert!((hidden.position_m[1] - (-4.0 + 1.5 * 2.6)).abs() < 0.3, "{hidden:?}");
    assert!(hidden.variance.position_m2 > 4.0 * before.variance.position_m2);
    assert!(told[30].is_empty(), "2 s after he was seen last");
}

/// He comes up to the side of the vehicle, where its own body hides him, and turns back after a second. Taken to walk on
/// he would long be on the other side.
#[test]
fn who_vanishes_beside_the_vehicle_is_expected_to_stand_there() {
    let body = BodyBox { min_m: [-1.0, -0.9, -1.0], max_m: [2.5, 0.9, 2.0] };
    let mut tracker = Tracker::new(TrackingConfig::default(), body).unwrap();
    let ground = ground();
    let at = |time_s: f64| person([0.5, 4.2 - 1.5 * time_s]);
    for number in 0..18 {
        let time_s = 0.2 * number as f64;
        let things = if time_s < 2.0 { vec![at(time_s)] } else { Vec::new() };
        tracker.observe(&sweep(&Pose::default(), number, &things), &Pose::default(), &ground);
        if (2.0..3.2).contains(&time_s) {
            let [_, north_m] = tracker.moving()[0].position_m;
            assert!((0.8..2.0).contains(&north_m), "{time_s} s: {north_m} m");
        }
    }
}

/// Beside the vehicle, where its own body hides him: no ray comes back from there for seconds. Then some do, from the ground
/// where he stood. For three seconds he may still be on his way to the vehicle.
#[test]
fn who_is_hidden_beside_the_vehicle_stands_there_until_his_place_is_seen_empty() {
    let body = BodyBox { min_m: [-1.0, -0.9, -1.0], max_m: [2.5, 0.9, 2.0] };
    let mut tracker = Tracker::new(TrackingConfig::default(), body).unwrap();
    let ground = ground();
    let mut told = Vec::new();
    for number in 0..60 {
        let time_s = 0.2 * number as f64;
        let things = if time_s < 2.0 { vec![person([0.5, 4.2 - 1.5 * time_s])] } else { Vec::new() };
        let mut scan = sweep(&Pose::default(), number, &things);
        if time_s > 9.0 {
            scan.points.push(RangePoint { position_m: [0.5, 1.3, 0.0], class: TerrainClass::Open });
        }
        tracker.observe(&scan, &Pose::default(), &ground);
        told.push(tracker.moving().first().map(|track| track.radius_m));
    }
    assert!(told[10..46].iter().all(Option::is_some), "7 s after he was seen last");
    assert_eq!(told[46 + 8..], [None; 6], "1.5 s after his place was seen");
    let radius_m = |number: usize| told[number].unwrap();
    assert!(radius_m(9) < 0.35 && radius_m(30) < 0.35, "{told:?}");
    // 0.8 s and 2.6 s at 1.5 m/s, and no farther than the vehicle can be.
    assert!(radius_m(13) > 0.35 + 0.7 && radius_m(22) > 0.35 + 0.7 && radius_m(22) < 0.35 + 0.9, "{told:?}");
}

#[test]
fn a_jump_of_the_frame_moves_tracks_along_and_a_clock_set_back_ends_them() {
    let (mut tracker, ground) = (tracker(), ground());
    let walker = |time_s: f64| vec![person([4.0, -3.0 + 1.2 * time_s])];
    for number in 0..10 {
        let scan = sweep(&Pose::default(), number, &walker(0.2 * number as f64));
        tracker.observe(&scan, &Pose::default(), &ground);
    }
    let before = tracker.moving()[0];
    // A quarter turn to the left and a step: east becomes north.
    tracker.carry(|[x_m, y_m, yaw_rad]| [10.0 - y_m, 20.0 + x_m, yaw_rad + TAU / 4.0]);
    let after = tracker.moving()[0];
    assert_eq!(after.position_m, [10.0 - before.position_m[1], 20.0 + before.position_m[0]]);
    assert!((after.velocity_mps[0] + before.velocity_mps[1]).abs() < 1e-9);
    let number = before.number;
    tracker.carry(|[x_m, y_m, yaw_rad]| [y_m - 20.0, 10.0 - x_m, yaw_rad - TAU / 4.0]);
    tracker.observe(&sweep(&Pose::default(), 10, &walker(2.0)), &Pose::default(), &ground);
    assert_eq!(tracker.moving()[0].number, number, "and goes on from there");
    tracker.observe(&sweep(&Pose::default(), 3, &walker(0.6)), &Pose::default(), &ground);
    assert_eq!(tracker.moving()[0].number, number, "an old scan tells nothing");
    tracker.forget();
    assert!(tracker.moving().is_empty());
    tracker.observe(&sweep(&Pose::default(), 3, &walker(0.6)), &Pose::default(), &ground);
    assert!(tracker.moving().is_empty(), "who is seen once does not move yet");
}

/// Scans of nothing but noise, of points without end and of no numbers.
#[test]
fn hostile_scans_leave_a_bounded_list_of_sound_tracks() {
    let (mut tracker, ground) = (tracker(), ground());
    let mut word = 12_345_u64;
    let mut random = || {
        word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (word >> 40) as f32 / (1_u64 << 24) as f32
    };
    for number in 0..12 {
        let place = |value: f32| if value > 0.98 { f32::NAN } else { 60.0 * value - 30.0 };
        let points = (0..20_000).map(|_| RangePoint {
            position_m: [place(random()), place(random()), 2.0 * random()],
            class: TerrainClass::ALL[(4.0 * random()) as usize % 4],
        });
        let sparse = if number % 2 == 0 { 20_000 } else { 600 };
        let points = points.take(sparse).collect();
        let scan = Scan { valid_at_ns: number * PERIOD_NS, origin_m: [0.0, 0.0, 1.0], points };
        tracker.observe(&scan, &Pose::default(), &ground);
        assert!(tracker.moving().len() <= TRACKS_MAX);
        assert!(tracker.moving().iter().all(Track::is_sound));
    }
    let nothing = Scan { valid_at_ns: u64::MAX, ..Scan::default() };
    tracker.observe(&nothing, &Pose::default(), &ground);
    assert!(tracker.moving().is_empty(), "a time that cannot be ends them all");
}
