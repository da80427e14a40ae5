use bicycle::Column;
use formats::RecordedMessage;

use super::reader::Reader;
use super::*;
use crate::bag::tests::recorded;
use crate::message::{
    AckermannDrive, AckermannDriveStamped, Header, Imu, Odometry, Point, Pose, PoseWithCovariance,
    Quaternion, TfMessage, Time, Transform, TransformStamped, Twist, TwistStamped, TwistWithCovariance,
    Vector3,
};

const SECOND_NS: u64 = 1_000_000_000;
/// Bags are recorded by the time of day.
const DAY_NS: u64 = 1_700_000_000 * SECOND_NS;

fn at_ns(time_s: f64) -> u64 {
    DAY_NS + (time_s * 1e9).round() as u64
}

fn header(time_s: f64, frame: &str) -> Header {
    Header { stamp: Time::from_nanoseconds(at_ns(time_s) as i64), frame_id: frame.to_owned() }
}

/// Straight east at 2 m/s, heard 5 ms late.
fn odometry(time_s: f64) -> RecordedMessage {
    let position = Point { x: 2.0 * time_s, ..Point::default() };
    let linear = Vector3 { x: 2.0, ..Vector3::default() };
    let message = Odometry {
        header: header(time_s, "odom"),
        child_frame_id: "base_link".to_owned(),
        pose: PoseWithCovariance { pose: Pose { position, ..Pose::default() }, ..Default::default() },
        twist: TwistWithCovariance { twist: Twist { linear, ..Twist::default() }, ..Default::default() },
    };
    recorded("/odom", at_ns(time_s + 0.005), &message)
}

fn ackermann(time_s: f64, speed: f32) -> RecordedMessage {
    let drive = AckermannDrive { speed, steering_angle: 0.25, ..AckermannDrive::default() };
    recorded("/cmd", at_ns(time_s), &AckermannDriveStamped { header: header(time_s, ""), drive })
}

fn twist(time_s: f64, speed_mps: f64, rate_radps: f64) -> RecordedMessage {
    let linear = Vector3 { x: speed_mps, ..Vector3::default() };
    let angular = Vector3 { z: rate_radps, ..Vector3::default() };
    recorded("/cmd_vel", at_ns(time_s), &Twist { linear, angular })
}

fn taken(
    messages: &[RecordedMessage],
    topics: &LogTopics,
    robot: Option<Robot<'_>>,
) -> Result<BagDrive, BagDriveError> {
    let mut reader = Reader::new(topics, robot)?;
    messages.iter().try_for_each(|message| reader.take(message))?;
    reader.finish(None)
}

fn drive(messages: &[RecordedMessage]) -> BagDrive {
    taken(messages, &LogTopics::default(), None).unwrap()
}

fn told(messages: &[RecordedMessage], topics: &LogTopics) -> String {
    taken(messages, topics, None).unwrap_err().to_string()
}

fn column(drive: &BagDrive, column: Column) -> Vec<f64> {
    drive.log.runs().next().unwrap().column(column).map(<[f64]>::to_vec).unwrap_or_default()
}

#[test]
fn rows_lie_at_the_stamps_and_have_the_last_command_before_them() {
    let messages = [odometry(0.0), ackermann(0.05, 1.0), odometry(0.1), ackermann(0.2, 3.0), odometry(0.3)];
    let drive = drive(&messages);
    assert_eq!(drive.notes, [""; 0]);
    let run = drive.log.runs().next().unwrap();
    assert!(
        run.time_s().iter().zip([0.0, 0.1, 0.3]).all(|(a, b)| (a - b).abs() < 1e-9),
        "{:?}",
        run.time_s()
    );
    let speeds = column(&drive, Column::CmdSpeed);
    assert!(speeds[0].is_nan(), "nothing was commanded yet");
    assert_eq!(speeds[1..], [1.0, 3.0]);
    assert_eq!(column(&drive, Column::CmdSteer)[1..], [0.25, 0.25]);
    assert_eq!(column(&drive, Column::Vx), [2.0; 3]);
    assert!(column(&drive, Column::WheelSpeed).is_empty(), "odometry tells nothing of wheels");
}

#[test]
fn a_command_that_came_between_stamp_and_arrival_is_of_the_next_row() {
    // Recorded before the odometry of 0.1 s, which was measured before it and came late.
    let late = RecordedMessage { log_time_ns: at_ns(0.13), ..odometry(0.1) };
    let messages = [odometry(0.0), ackermann(0.05, 1.0), ackermann(0.12, 3.0), late, odometry(0.2)];
    assert_eq!(column(&drive(&messages), Column::CmdSpeed)[1..], [1.0, 3.0]);
}

#[test]
fn twists_are_yaw_rates_and_of_a_known_robot_steering_angles() {
    let messages = [odometry(0.0), twist(0.05, 2.0, 0.5), odometry(0.1)];
    assert_eq!(column(&drive(&messages), Column::CmdWz)[1], 0.5);
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let ros = RobotRos { map_frame: "odom".to_owned(), ..RobotRos::default() };
    let topics = LogTopics { command: Some("/cmd_vel".to_owned()), ..LogTopics::of_robot(&ros) };
    let known = taken(&messages, &topics, Some(Robot { ros: &ros, vehicle: &vehicle })).unwrap();
    // tan(delta) = L w / v.
    let expected = (vehicle.geometry.wheelbase_m * 0.5 / 2.0).atan();
    assert!((column(&known, Column::CmdSteer)[1] - expected).abs() < 1e-12, "{:?}", known.notes);
    let stamped = TwistStamped::default();
    let messages = [odometry(0.0), recorded("/cmd_vel", at_ns(0.05), &stamped), odometry(0.1)];
    assert_eq!(column(&drive(&messages), Column::CmdSpeed)[1], 0.0);
}

#[test]
fn what_is_felt_is_carried_to_the_vehicle() {
    // The unit looks to the left: what it feels ahead is to the left.
    let rotation = crate::rigid::quaternion_of(&nalgebra::UnitQuaternion::from_euler_angles(
        0.0,
        0.0,
        std::f64::consts::FRAC_PI_2,
    ));
    let transform = TransformStamped {
        header: header(0.0, "base_link"),
        child_frame_id: "imu".to_owned(),
        transform: Transform { rotation, ..Transform::default() },
    };
    let fixed = recorded("/tf_static", at_ns(0.0), &TfMessage { transforms: vec![transform] });
    let linear_acceleration = Vector3 { x: 0.5, ..Vector3::default() };
    let imu = Imu { header: header(0.05, "imu"), linear_acceleration, ..Imu::default() };
    let felt = recorded("/imu", at_ns(0.05), &imu);
    let whole = drive(&[fixed, odometry(0.0), felt.clone(), odometry(0.1)]);
    assert!((column(&whole, Column::Ay)[1] - 0.5).abs() < 1e-6, "{:?}", whole.notes);
    let unjoined = drive(&[odometry(0.0), felt, odometry(0.1)]);
    assert!(column(&unjoined, Column::Ay).is_empty());
    assert!(
        unjoined.notes[0]
            .starts_with("1 messages on /imu left out, the first for frame \"imu\": expected transforms"),
        "{:?}",
        unjoined.notes
    );
}

/// A frame that turns is told of before the first odometry, and not again.
#[test]
fn moving_frames_that_are_told_before_the_first_odometry_count() {
    let turned = |rotation: Quaternion| TransformStamped {
        header: header(-0.1, "base_link"),
        child_frame_id: "imu".to_owned(),
        transform: Transform { rotation, ..Transform::default() },
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let left = turned(Quaternion { x: 0.0, y: 0.0, z: half, w: half });
    let none = TransformStamped {
        child_frame_id: "camera".to_owned(),
        ..turned(Quaternion { w: 0.0, ..Quaternion::default() })
    };
    let told = |transform| recorded("/tf", at_ns(-0.1), &TfMessage { transforms: vec![transform] });
    let linear_acceleration = Vector3 { x: 0.5, ..Vector3::default() };
    let felt = recorded(
        "/imu",
        at_ns(0.05),
        &Imu { header: header(0.05, "imu"), linear_acceleration, ..Imu::default() },
    );
    let whole = drive(&[told(left), told(none), odometry(0.0), felt, odometry(0.1)]);
    assert!((column(&whole, Column::Ay)[1] - 0.5).abs() < 1e-6, "{:?}", whole.notes);
    let [note] = &whole.notes[..] else { panic!("{:?}", whole.notes) };
    assert!(
        note.starts_with("1 messages on /tf left out, the first for frame \"camera\": orientation: expected"),
        "{note}"
    );
}

/// More frames that stay than are kept, before anybody has said whose frames count.
#[test]
fn frames_beyond_those_that_are_kept_are_told_of() {
    let fixed = |k: u64| recorded("/tf_static", DAY_NS + k, &TfMessage { transforms: Vec::new() });
    let moving = |k: u64| recorded("/tf", DAY_NS + k, &TfMessage { transforms: Vec::new() });
    let many: Vec<RecordedMessage> = (0..4100).map(fixed).chain([odometry(0.0)]).collect();
    let [note] = &drive(&many).notes[..] else { panic!("one note") };
    assert!(
        note.starts_with(
            "4 messages on /tf_static left out, the first for frames: expected odometry before 4096"
        ),
        "{note}"
    );
    // Those that move make room once they are a second old.
    let long: Vec<RecordedMessage> =
        (0..9000).map(|k| moving(k * 1_000_000)).chain([odometry(9.0)]).collect();
    assert_eq!(drive(&long).notes, [""; 0]);
}

#[test]
fn messages_that_are_wrong_are_left_out_and_counted() {
    let mut torn = odometry(0.2);
    torn.data.truncate(100);
    let nowhere = |time_s: f64| {
        let message = Odometry {
            header: header(time_s, "odom"),
            child_frame_id: "base_link".to_owned(),
            pose: PoseWithCovariance {
                pose: Pose { position: Point { x: f64::NAN, ..Point::default() }, ..Pose::default() },
                ..Default::default()
            },
            ..Odometry::default()
        };
        recorded("/odom", at_ns(time_s + 0.005), &message)
    };
    let wild = twist(0.05, f64::INFINITY, 0.0);
    let drive =
        drive(&[odometry(0.0), wild, odometry(0.1), nowhere(0.15), torn, odometry(0.3), odometry(0.3)]);
    assert_eq!(drive.log.n_rows(), 3);
    assert!(column(&drive, Column::CmdSpeed).is_empty());
    let [of_command, of_odometry] = &drive.notes[..] else { panic!("{:?}", drive.notes) };
    assert!(
        of_command
            .contains("1 messages on /cmd_vel left out, the first for cmd_speed: expected a finite number")
    );
    assert!(
        of_odometry
            .starts_with("3 messages on /odom left out, the first for position: expected finite numbers"),
        "not a number, torn, and one twice: {of_odometry}"
    );
}

#[test]
fn topics_that_are_not_there_are_told_with_those_that_are() {
    let commands = [ackermann(0.0, 1.0)];
    let none = told(&commands, &LogTopics::default());
    assert_eq!(
        none,
        "expected messages of nav_msgs/msg/Odometry on some topic, found only /cmd \
         (ackermann_msgs/msg/AckermannDriveStamped)"
    );
    let asked = LogTopics { odometry: Some("/ekf".to_owned()), ..LogTopics::default() };
    let told_of = told(&[odometry(0.0), ackermann(0.0, 1.0)], &asked);
    assert!(
        told_of.contains("on /ekf, found only /cmd (") && told_of.contains("/odom (nav_msgs"),
        "{told_of}"
    );
    let asked = LogTopics { command: Some("/steer".to_owned()), ..LogTopics::default() };
    let told_of = told(&[odometry(0.0)], &asked);
    assert_eq!(told_of, "expected messages on /steer, found only /odom (nav_msgs/msg/Odometry)");
    assert!(told(&[], &LogTopics::default()).ends_with("on some topic, found no message"));
}

#[test]
fn one_of_several_topics_has_to_be_named() {
    let messages = [odometry(0.0), ackermann(0.0, 1.0), twist(0.05, 2.0, 0.0), odometry(0.1)];
    let several = told(&messages, &LogTopics::default());
    assert_eq!(
        several,
        "expected one topic for the command, found /cmd and /cmd_vel; say which with command=TOPIC"
    );
    let asked = LogTopics { command: Some("/cmd_vel".to_owned()), ..LogTopics::default() };
    assert_eq!(column(&taken(&messages, &asked, None).unwrap(), Column::CmdSpeed)[1], 2.0);
}

#[test]
fn a_topic_of_another_type_is_refused() {
    let asked = LogTopics { command: Some("/odom".to_owned()), ..LogTopics::default() };
    let told = told(&[odometry(0.0)], &asked);
    assert!(
        told.starts_with("/odom: expected messages of ackermann_msgs/msg/AckermannDriveStamped, "),
        "{told}"
    );
    assert!(told.ends_with("found nav_msgs/msg/Odometry"), "{told}");
}
