use super::*;
use crate::message::{Header, PointField, Time};
use formats::RosLabels;
use nalgebra::{Translation3, UnitQuaternion};
use proptest::prelude::*;

const OPEN: u32 = TerrainClass::Open as u32;
const OBSTACLE: u32 = TerrainClass::Obstacle as u32;

/// A number as a cloud holds it.
fn encoded(value: f64, datatype: u8, is_bigendian: bool) -> Vec<u8> {
    let mut bytes = match datatype {
        1 => (value as i8).to_le_bytes().to_vec(),
        2 => (value as u8).to_le_bytes().to_vec(),
        3 => (value as i16).to_le_bytes().to_vec(),
        4 => (value as u16).to_le_bytes().to_vec(),
        5 => (value as i32).to_le_bytes().to_vec(),
        6 => (value as u32).to_le_bytes().to_vec(),
        7 => (value as f32).to_le_bytes().to_vec(),
        _ => value.to_le_bytes().to_vec(),
    };
    if is_bigendian {
        bytes.reverse();
    }
    bytes
}

/// How a cloud lies in its bytes: kinds of x, y, z and the label, bytes left unused before each, behind the points and
/// behind the rows, and the order of bytes.
#[derive(Clone, Debug)]
struct Arrangement {
    kinds: [u8; 4],
    gaps: [usize; 5],
    behind_row: usize,
    is_bigendian: bool,
}

const PLAIN: Arrangement =
    Arrangement { kinds: [7, 7, 7, 2], gaps: [0; 5], behind_row: 0, is_bigendian: false };

fn cloud(rows: &[Vec<[f64; 4]>], arrangement: &Arrangement) -> PointCloud2 {
    let Arrangement { kinds, gaps, behind_row, is_bigendian } = arrangement;
    let (mut fields, mut step) = (Vec::new(), 0);
    for (k, name) in ["x", "y", "z", "label"].into_iter().enumerate() {
        step += gaps[k];
        let field = PointField { name: name.into(), offset: step as u32, datatype: kinds[k], count: 1 };
        step += encoded(0.0, kinds[k], false).len();
        fields.push(field);
    }
    step += gaps[4];
    let width = rows.first().map_or(0, Vec::len);
    let mut data = Vec::new();
    for row in rows {
        for point in row {
            let mut bytes = vec![0xAA; step];
            for (k, field) in fields.iter().enumerate() {
                let number = encoded(point[k], kinds[k], *is_bigendian);
                bytes[field.offset as usize..][..number.len()].copy_from_slice(&number);
            }
            data.extend(bytes);
        }
        data.extend(std::iter::repeat_n(0xBB, *behind_row));
    }
    PointCloud2 {
        header: Header { frame_id: "lidar".into(), ..Header::default() },
        height: rows.len() as u32,
        width: width as u32,
        fields,
        is_bigendian: *is_bigendian,
        point_step: step as u32,
        row_step: (width * step + behind_row) as u32,
        data,
        is_dense: true,
    }
}

fn labels() -> Meaning {
    let labels = RosLabels {
        field: "label".into(),
        open: vec![1, 40],
        loose: vec![2],
        vegetation: vec![3],
        obstacle: vec![4],
    };
    Meaning { classes: Classes::Labels(ClassLabels::new(&labels).unwrap()), times: None }
}

/// Everything stays where it is, whenever it was measured.
fn resting(_: f64) -> Isometry3<f64> {
    Isometry3::identity()
}

fn here(cloud: &PointCloud2) -> Result<Sweep, LayoutError> {
    sweep(cloud, &labels(), 1 << 16, &Isometry3::identity(), resting)
}

proptest! {
    #[test]
    fn numbers_are_found_wherever_and_however_they_lie(
        places in prop::collection::vec([-100_i32..100, -100..100, -100..100, 1..5], 1..20),
        n_rows in 1_usize..4,
        axes in prop::array::uniform3(prop::sample::select(vec![1_u8, 3, 5, 7, 8])),
        label in 1_u8..9,
        gaps in prop::array::uniform5(0_usize..5),
        behind_row in 0_usize..9,
        is_bigendian: bool,
    ) {
        let kinds = [axes[0], axes[1], axes[2], label];
        let row: Vec<[f64; 4]> = places.iter().map(|place| place.map(f64::from)).collect();
        let rows = vec![row.clone(); n_rows];
        let read = here(&cloud(&rows, &Arrangement { kinds, gaps, behind_row, is_bigendian })).unwrap();
        let at_sensor = row.iter().filter(|place| place[..3] == [0.0; 3]).count();
        prop_assert_eq!(read.n_without_place, n_rows * at_sensor);
        let expected = rows.iter().flatten().filter(|place| place[..3] != [0.0; 3]).map(|place| PointRecord {
            position_m: [place[0] as f32, place[1] as f32, place[2] as f32],
            class_number: place[3] as u32 - 1,
        });
        prop_assert!(read.points.iter().copied().eq(expected), "{:?}", read.points);
    }

    /// Whatever a cloud says of itself: it is read or refused, and nothing beyond its bytes is looked at.
    #[test]
    fn hostile_clouds_are_read_or_refused(
        [height, width, point_step, row_step] in prop::array::uniform4(prop_oneof![0_u32..40, any::<u32>()]),
        fields in prop::collection::vec(
            ("[xyz]|label|t", prop_oneof![0_u32..40, any::<u32>()], any::<u8>(), 0_u32..3), 0..6,
        ),
        data in prop::collection::vec(any::<u8>(), 0..400),
        is_bigendian: bool,
    ) {
        let field = |(name, offset, datatype, count)| PointField { name, offset, datatype: datatype % 10, count };
        let fields = fields.into_iter().map(field).collect();
        let hostile = PointCloud2 {
            height, width, fields, is_bigendian, point_step, row_step, data, ..PointCloud2::default()
        };
        for meaning in [labels(), geometry(), timed(1.0, RosPointEpoch::Stamp)] {
            if let Ok(read) = sweep(&hostile, &meaning, 64, &Isometry3::identity(), resting) {
                prop_assert!(read.points.len() <= 64);
                prop_assert!(read.points.iter().all(|point| point.position_m.iter().all(|axis_m| axis_m.is_finite())));
            }
        }
    }

    #[test]
    fn a_cloud_that_was_cut_off_is_refused(n_left in 0_usize..143) {
        let rows = vec![vec![[1.0, 2.0, 3.0, 1.0]; 3]; 4];
        let mut cut = cloud(&rows, &PLAIN);
        // Four rows of three points of 13 bytes.
        prop_assert_eq!(cut.data.len(), 156);
        cut.data.truncate(n_left);
        let refused = LayoutError::Short { expected: 156, height: 4, row: 39, found: n_left };
        prop_assert_eq!(here(&cut), Err(refused));
    }
}

#[test]
fn what_is_wrong_with_a_cloud_is_said() {
    let whole = cloud(&[vec![[1.0, 2.0, 3.0, 1.0]; 3]], &PLAIN);
    let told = |change: &dyn Fn(&mut PointCloud2)| {
        let mut broken = whole.clone();
        change(&mut broken);
        here(&broken).unwrap_err().to_string()
    };
    assert_eq!(
        told(&|cloud| cloud.fields[2].name = "height".into()),
        "fields: expected one named \"z\", found x, y, height, label"
    );
    assert!(told(&|cloud| cloud.fields.clear()).ends_with("found none"));
    assert_eq!(
        told(&|cloud| cloud.fields[1].datatype = 9),
        "field \"y\": expected one number of datatype 1 to 8, found 1 of datatype 9"
    );
    assert!(told(&|cloud| cloud.fields[1].count = 3).contains("found 3 of datatype 7"));
    assert_eq!(
        told(&|cloud| cloud.fields[1].offset = u32::MAX),
        "field \"y\": expected to end within the 13 bytes of a point, found it to end at 4294967299"
    );
    assert_eq!(
        told(&|cloud| cloud.row_step = 38),
        "row_step: expected at least 39 for 3 points of 13 bytes, found 38"
    );
    assert_eq!(told(&|cloud| cloud.height = 2), "data: expected 78 bytes for 2 rows of 39 bytes, found 39");
    assert!(told(&|cloud| cloud.width = u32::MAX).starts_with("width x height: expected at most"));
}

/// The rows are as many as a number may say, and none has a point: as if there were no rows.
#[test]
fn rows_without_points_are_not_gone_through() {
    let cloud =
        PointCloud2 { width: 0, height: u32::MAX, row_step: 0, data: Vec::new(), ..cloud(&[], &PLAIN) };
    let sweep = here(&cloud).unwrap();
    assert_eq!((sweep.points.len(), sweep.n_without_place, sweep.n_left_out), (0, 0, 0));
}

#[test]
fn points_are_moved_into_the_frame_that_is_asked_for() {
    let quarter = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    let motion = Isometry3::from_parts(Translation3::new(1.0, 0.0, 0.5), quarter);
    let ahead = cloud(&[vec![[2.0, 0.0, -0.5, 3.0]]], &PLAIN);
    let read = sweep(&ahead, &labels(), 10, &Isometry3::identity(), |_| motion).unwrap();
    let [x_m, y_m, z_m] = read.points[0].position_m;
    assert!((x_m - 1.0).abs() + (y_m - 2.0).abs() + z_m.abs() < 1e-6, "{x_m} {y_m} {z_m}");
    assert_eq!(read.points[0].class_number, TerrainClass::Vegetation as u32);
}

fn timed(unit_s: f64, counts_from: RosPointEpoch) -> Meaning {
    Meaning { times: Some(RosPointTime { field: "t".into(), unit_s, counts_from }), ..geometry() }
}

/// Three points at 1 m ahead, with these times in the place of labels, at the stamp of 1 700 000 000.25 s.
fn timed_cloud(times: [f64; 3], kind: u8) -> PointCloud2 {
    let rows = [times.map(|time| [1.0, 0.0, 0.0, time]).to_vec()];
    let mut timed = cloud(&rows, &Arrangement { kinds: [7, 7, 7, kind], ..PLAIN });
    timed.fields[3].name = "t".into();
    timed.header.stamp = Time { sec: 1_700_000_000, nanosec: 250_000_000 };
    timed
}

/// How far each point is moved by a frame that moves by 1 m/s.
fn moved_m(cloud: &PointCloud2, meaning: &Meaning) -> Result<Vec<f32>, LayoutError> {
    let motion = |after_s: f64| Isometry3::translation(after_s, 0.0, 0.0);
    Ok(sweep(cloud, meaning, 10, &Isometry3::identity(), motion)?
        .points
        .iter()
        .map(|point| point.position_m[0] - 1.0)
        .collect())
}

#[test]
fn points_are_moved_for_the_time_they_were_measured_at() {
    let near = |found: Vec<f32>| {
        let expected_m = [0.0, 0.05, -0.02];
        let off_m = found.iter().zip(expected_m).map(|(found, expected)| (found - expected).abs());
        assert!(found.len() == 3 && off_m.fold(0.0, f32::max) < 1e-6, "{found:?}");
    };
    // Seconds as f32, nanoseconds as i32, both from the stamp; seconds as f64 since 1970.
    near(moved_m(&timed_cloud([0.0, 0.05, -0.02], 7), &timed(1.0, RosPointEpoch::Stamp)).unwrap());
    near(moved_m(&timed_cloud([0.0, 5e7, -2e7], 5), &timed(1e-9, RosPointEpoch::Stamp)).unwrap());
    let since_1970_s = [0.25, 0.3, 0.23].map(|time_s| 1.7e9 + time_s);
    near(moved_m(&timed_cloud(since_1970_s, 8), &timed(1.0, RosPointEpoch::Epoch)).unwrap());
}

#[test]
fn times_of_another_sweep_are_refused_with_what_may_be_wrong() {
    let told = |cloud: &PointCloud2, meaning: &Meaning| moved_m(cloud, meaning).unwrap_err().to_string();
    let nanoseconds = timed_cloud([0.0, 5e7, 1e8], 6);
    assert_eq!(
        told(&nanoseconds, &timed(1.0, RosPointEpoch::Stamp)),
        "field \"t\": expected times within 1 s of the stamp, found one 5e7 s away: are unit_s and counts_from right?"
    );
    assert!(
        told(&timed_cloud([f64::NAN; 3], 8), &timed(1.0, RosPointEpoch::Stamp))
            .contains("found one NaN s away")
    );
    let missing = told(&cloud(&[vec![[1.0; 4]]], &PLAIN), &timed(1.0, RosPointEpoch::Stamp));
    assert_eq!(missing, "fields: expected one named \"t\", found x, y, z, label");
}

#[test]
fn rays_without_a_return_are_counted_and_what_nobody_knows_is_an_obstacle() {
    let nan = f64::NAN;
    let row = vec![
        [nan, 1.0, 1.0, 1.0],
        [1.0, f64::INFINITY, 1.0, 1.0],
        [0.0, 0.0, 0.0, 1.0],
        [1e9, 0.0, 0.0, 1.0],
        [1.0, 1.0, 1.0, 1.0],
        [1.0, 1.0, 1.0, 40.0],
        [1.0, 1.0, 1.0, 99.0],
    ];
    let read = here(&cloud(&[row], &PLAIN)).unwrap();
    assert_eq!((read.n_without_place, read.n_unknown_labels, read.points.len()), (4, 1, 3));
    assert_eq!(
        read.points.iter().map(|point| point.class_number).collect::<Vec<_>>(),
        [OPEN, OPEN, OBSTACLE]
    );
}

#[test]
fn of_too_many_points_every_so_many_th_is_kept() {
    let row: Vec<[f64; 4]> = (1..=100).map(|k| [f64::from(k), 0.0, 0.0, 1.0]).collect();
    let read = sweep(&cloud(&[row], &PLAIN), &labels(), 30, &Isometry3::identity(), resting).unwrap();
    assert_eq!((read.points.len(), read.n_left_out), (25, 75));
    assert_eq!(read.points[1].position_m[0], 5.0);
}

#[test]
fn a_label_in_two_classes_is_refused() {
    let twice =
        RosLabels { field: "label".into(), open: vec![1, 2], obstacle: vec![2], ..RosLabels::default() };
    let told = ClassLabels::new(&twice).unwrap_err().to_string();
    assert_eq!(told, "ros.labels: expected every number in one class, found 2 in two");
}

const LENGTHS: GeometryClasses = GeometryClasses { column_m: 0.3, step_m: 0.15, plants_max_m: 1.0 };

fn geometry() -> Meaning {
    Meaning { classes: Classes::Geometry(LENGTHS), times: None }
}

/// Points of a square of 6 m, every 5 cm, where `height_m` says.
fn ground(height_m: impl Fn(f64, f64) -> f64) -> Vec<PointRecord> {
    let places =
        (0..120).flat_map(|row| (0..120).map(move |col| [row, col].map(|k| 0.05 * f64::from(k) - 3.0)));
    let point = |[x_m, y_m]: [f64; 2]| PointRecord {
        position_m: [x_m as f32, y_m as f32, height_m(x_m, y_m) as f32],
        class_number: u32::MAX,
    };
    places.map(point).collect()
}

fn classified(mut points: Vec<PointRecord>) -> Vec<PointRecord> {
    LENGTHS.classify(&mut points, &Isometry3::identity());
    points
}

fn share(points: &[PointRecord], class_number: u32) -> f64 {
    points.iter().filter(|point| point.class_number == class_number).count() as f64 / points.len() as f64
}

#[test]
fn slopes_and_low_stones_are_ground() {
    assert_eq!(share(&classified(ground(|_, _| -0.4)), OPEN), 1.0);
    assert_eq!(share(&classified(ground(|x_m, y_m| 0.35 * x_m - 0.3 * y_m)), OPEN), 1.0);
    assert_eq!(share(&classified(ground(|x_m, _| if x_m > 1.0 { 0.12 } else { 0.0 })), OPEN), 1.0);
}

#[test]
fn a_wall_is_an_obstacle_and_the_ground_before_it_is_not() {
    let mut points = ground(|_, _| 0.0);
    let n_ground = points.len();
    let wall =
        (0..60).flat_map(|along| (1..20).map(move |up| [2.0, 0.05 * along as f32 - 1.5, 0.05 * up as f32]));
    points.extend(wall.map(|position_m| PointRecord { position_m, class_number: 0 }));
    let points = classified(points);
    assert_eq!(share(&points[..n_ground], OPEN), 1.0);
    let high: Vec<PointRecord> =
        points[n_ground..].iter().copied().filter(|point| point.position_m[2] > 0.3).collect();
    assert_eq!(share(&high, OBSTACLE), 1.0);
}

#[test]
fn a_bush_is_plants_and_a_tree_is_not() {
    // Points without a pattern in a box, by a generator of the golden ratio in three directions.
    let fraction = |k: usize, step: f64| (k as f64 * step).fract();
    let within = |k: usize, [bottom_m, top_m]: [f64; 2]| {
        let unit = [fraction(k, 0.819_172_513), fraction(k, 0.671_043_607), fraction(k, 0.549_700_478)];
        [1.2 + 0.3 * unit[0], 0.6 * unit[1], bottom_m + (top_m - bottom_m) * unit[2]]
            .map(|axis_m| axis_m as f32)
    };
    let standing = |heights_m: [f64; 2]| {
        let mut points = ground(|_, _| 0.0);
        let n_ground = points.len();
        let place_m = |k| within(k, heights_m);
        points.extend((0..400).map(|k| PointRecord { position_m: place_m(k), class_number: 0 }));
        let is_high = |point: &PointRecord| point.position_m[2] > 0.5;
        classified(points)[n_ground..].iter().copied().filter(is_high).collect::<Vec<_>>()
    };
    assert_eq!(share(&standing([0.2, 0.7]), TerrainClass::Vegetation as u32), 1.0);
    assert_eq!(share(&standing([0.2, 2.5]), OBSTACLE), 1.0, "it stands up more than it spreads");
    assert_eq!(share(&standing([1.2, 1.6]), OBSTACLE), 1.0, "a crown is too high to be pressed down");
}
