use std::f64::consts::PI;

use super::*;

/// Trunks of 0.15 m radius on both sides of the way, east and north [m].
const TRUNKS_M: [[f64; 2]; 9] = [
    [3.0, 2.5],
    [4.5, -3.0],
    [6.0, 4.0],
    [8.0, -2.2],
    [9.5, 3.1],
    [11.0, -4.5],
    [2.0, -4.0],
    [13.0, 1.8],
    [0.5, 5.0],
];
const TRUNK_RADIUS_M: f64 = 0.15;

fn mount(yaw_rad: f64) -> Mount {
    Mount { position_m: [1.2, 0.3, 1.0], attitude_rad: [0.0, 0.0, yaw_rad], ..Mount::default() }
}

/// What a sensor with rays every half degree sees of the trunks, in its own frame.
fn sweep(pose: &Pose, truth: &Mount) -> Vec<PointRecord> {
    let sensor = pose.isometry() * truth.isometry();
    let trunks = TRUNKS_M.map(|[x_m, y_m]| sensor.inverse() * Point3::new(x_m, y_m, sensor.translation.z));
    let hit = |azimuth: i32| {
        let (sine, cosine) = libm::sincos(f64::from(azimuth) * PI / 360.0);
        // Nearest way along the ray to the edge of a circle.
        let ranges = trunks.iter().filter_map(|trunk| {
            let along_m = cosine * trunk.x + sine * trunk.y;
            let aside_m = cosine * trunk.y - sine * trunk.x;
            let half_m2 = TRUNK_RADIUS_M.powi(2) - aside_m.powi(2);
            (half_m2 > 0.0 && along_m > 0.0).then(|| along_m - half_m2.sqrt())
        });
        let range_m = ranges.fold(f64::INFINITY, f64::min);
        let position_m = [range_m * cosine, range_m * sine, 0.0].map(|axis_m| axis_m as f32);
        range_m.is_finite().then_some(PointRecord { position_m, class_number: 3 })
    };
    (0..720).filter_map(hit).collect()
}

/// Ten seconds on an arc of a curvature, at 1 m/s: what a sensor that sits as `truth` says is said to be by `stated`.
fn found(stated: &Mount, truth: &Mount, speed_mps: f64, curvature_per_m: f64) -> Finding {
    let mut yaws = Yaws::default();
    for k in 0..=500_u64 {
        let (valid_at_ns, way_m) = (k * 20_000_000, 0.02 * k as f64 * speed_mps);
        let yaw_rad = curvature_per_m * way_m;
        let [x_m, y_m] = if curvature_per_m == 0.0 {
            [way_m, 0.0]
        } else {
            [libm::sin(yaw_rad), 1.0 - libm::cos(yaw_rad)].map(|share| share / curvature_per_m)
        };
        let pose = Pose { x_m, y_m, yaw_rad, ..Pose::default() };
        let record = OdometryRecord {
            position_m: [x_m, y_m, 0.0],
            attitude_rad: [0.0, 0.0, turned_rad(yaw_rad)],
            ..OdometryRecord::default()
        };
        yaws.note_odometry(valid_at_ns, &record);
        // Between two odometries.
        if k % 10 == 5 {
            let mut header = ScanHeader { sensor: 1, ..ScanHeader::default() };
            header.stamp.valid_at_ns = valid_at_ns;
            yaws.note_scan(&header, &sweep(&pose, truth));
        }
    }
    let mut findings = yaws.findings(std::slice::from_ref(stated));
    assert_eq!(findings.len(), 1, "{findings:?}");
    findings.remove(0)
}

/// The angle that is told, to the left [degrees].
fn degrees(finding: &Finding) -> f64 {
    let words: Vec<&str> = finding.found.split_whitespace().collect();
    let angle: f64 = words[1].parse().unwrap();
    if words[5] == "left" { angle } else { -angle }
}

#[test]
fn a_sensor_that_looks_where_it_is_said_to_is_fine_straight_and_in_turns() {
    for curvature_per_m in [0.0, 0.15, -0.2] {
        let finding = found(&mount(0.3), &mount(0.3), 1.0, curvature_per_m);
        assert_eq!(finding.verdict, Verdict::Fine, "{finding:?}");
        assert!(degrees(&finding).abs() < 0.6, "{finding:?}");
    }
}

#[test]
fn a_sensor_that_is_turned_by_five_degrees_is_found_out_with_its_angle() {
    let turned_rad = 5.0_f64.to_radians();
    for (curvature_per_m, side) in [(0.0, 1.0), (0.15, 1.0), (0.0, -1.0), (-0.2, -1.0)] {
        let finding = found(&mount(0.3), &mount(0.3 + side * turned_rad), 1.0, curvature_per_m);
        assert_eq!(finding.verdict, Verdict::Wrong, "{finding:?}");
        assert!((degrees(&finding) - side * 5.0).abs() < 0.7, "{finding:?}");
        assert!(
            finding.found.ends_with("what is 10 m ahead is taken to be 0.9 m beside its place"),
            "{finding:?}"
        );
    }
}

#[test]
fn one_that_looks_to_the_side_or_back_is_found_out() {
    for (turned_rad, angle) in [(0.5 * PI, 90.0), (0.9 * PI, 162.0), (-0.06, -3.4)] {
        let finding = found(&mount(0.0), &mount(turned_rad), 1.0, 0.05);
        assert!(finding.verdict != Verdict::Fine && (degrees(&finding) - angle).abs() < 1.0, "{finding:?}");
    }
}

#[test]
fn who_stands_or_sees_nothing_that_stands_out_cannot_tell() {
    let stood = found(&mount(0.0), &mount(0.1), 0.0, 0.0);
    assert_eq!(stood.verdict, Verdict::Unknown, "{stood:?}");
    assert!(stood.found.starts_with("it stood, or nothing"), "{stood:?}");
    let mut yaws = Yaws::default();
    yaws.note_odometry(1, &OdometryRecord::default());
    yaws.note_scan(&ScanHeader::default(), &[PointRecord { position_m: [1.0; 3], class_number: 1 }; 100]);
    let level = &yaws.findings(&[])[0];
    assert!(level.verdict == Verdict::Unknown && level.found.starts_with("nothing stood out"), "{level:?}");
}

/// A wall that is driven at looks the same wherever its sensor looks by a little.
#[test]
fn a_wall_ahead_tells_no_angle() {
    let mut yaws = Yaws::default();
    for k in 0..=10_u64 {
        let x_m = 0.5 * k as f64;
        let record = OdometryRecord { position_m: [x_m, 0.0, 0.0], ..OdometryRecord::default() };
        yaws.note_odometry(1 + k * 500_000_000, &record);
        // Rays every half degree.
        let wall = (-120..=120).map(|azimuth| {
            let aside_m = (12.0 - x_m) * libm::tan(f64::from(azimuth) * PI / 360.0);
            PointRecord {
                position_m: [12.0 - x_m, aside_m, 0.0].map(|axis_m| axis_m as f32),
                class_number: 3,
            }
        });
        let mut header = ScanHeader::default();
        header.stamp.valid_at_ns = 1 + k * 500_000_000;
        yaws.note_scan(&header, &wall.collect::<Vec<_>>());
    }
    let finding = &yaws.findings(&[])[0];
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:?}");
    assert!(finding.found.starts_with("what stood out looks the same"), "{finding:?}");
}
