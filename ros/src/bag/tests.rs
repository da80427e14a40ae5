use std::sync::Arc;

use cdr_encoding::to_vec;
use formats::RecordedChannel;
use proptest::prelude::*;
use serde::Serialize;

use super::*;
use crate::message::{Bool, Header, Imu, Odometry, PointCloud2, TfMessage, Time, Twist, Vector3};

/// A message as a bag holds it, its numbers with their least byte first.
pub(super) fn recorded<M: Named + Serialize>(topic: &str, at_ns: u64, message: &M) -> RecordedMessage {
    let content = to_vec::<M, LittleEndian>(message).unwrap();
    let data = [&[0, 1, 0, 0][..], &content].concat();
    let channel = RecordedChannel {
        topic: topic.to_owned(),
        schema: type_name::<M>(),
        schema_data: Vec::new(),
        encoding: "cdr".to_owned(),
    };
    RecordedMessage { channel: Arc::new(channel), log_time_ns: at_ns, data }
}

fn imu() -> Imu {
    let header = Header { stamp: Time { sec: 5, nanosec: 7 }, frame_id: "imu".to_owned() };
    let linear_acceleration = Vector3 { x: 0.5, y: -0.25, z: 9.81 };
    Imu { header, linear_acceleration, ..Imu::default() }
}

fn with(message: RecordedMessage, data: Vec<u8>) -> RecordedMessage {
    RecordedMessage { data, ..message }
}

#[test]
fn messages_are_read_in_either_order_of_bytes() {
    let little = recorded("/imu", 0, &imu());
    assert_eq!(read::<Imu>(&little), Ok(imu()));
    let content = to_vec::<Imu, BigEndian>(&imu()).unwrap();
    let big = with(little, [&[0, 0, 0, 0][..], &content].concat());
    assert_eq!(read::<Imu>(&big), Ok(imu()));
}

#[test]
fn a_message_of_another_type_is_refused_by_both_names() {
    let told = read::<Odometry>(&recorded("/imu", 0, &imu())).unwrap_err().to_string();
    assert_eq!(told, "/imu: expected messages of nav_msgs/msg/Odometry, found sensor_msgs/msg/Imu");
}

#[test]
fn what_is_no_cdr_is_refused_by_how_it_begins() {
    let told =
        |data: &[u8]| read::<Imu>(&with(recorded("/imu", 0, &imu()), data.to_vec())).unwrap_err().to_string();
    assert_eq!(told(&[]), "/imu: expected messages in CDR, found one that begins with []");
    assert_eq!(
        told(&[0, 9, 0, 0, 1]),
        "/imu: expected messages in CDR, found one that begins with [0, 9, 0, 0]"
    );
    let packed = told(&[0x28, 0xb5, 0x2f, 0xfd, 1]);
    assert!(packed.contains("packed one by one with Zstandard"), "{packed}");
    let mut json = recorded("/imu", 0, &imu());
    Arc::make_mut(&mut json.channel).encoding = "json".to_owned();
    assert_eq!(read::<Imu>(&json).unwrap_err().to_string(), "/imu: expected messages in CDR, found json");
}

#[test]
fn a_message_that_is_cut_off_is_refused_with_its_length() {
    let whole = recorded("/imu", 0, &imu());
    for n_bytes in 4..whole.data.len() {
        let told = read::<Imu>(&with(whole.clone(), whole.data[..n_bytes].to_vec())).unwrap_err().to_string();
        let expected =
            format!("/imu: expected a message of sensor_msgs/msg/Imu, found {n_bytes} bytes that are none: ");
        assert!(told.starts_with(&expected) && !told.contains('\n'), "{told}");
    }
}

#[test]
fn topics_and_columns_are_told_apart_in_a_mapping() {
    let mut topics = LogTopics { odometry: Some("/old".to_owned()), ..LogTopics::default() };
    let words = ["odometry=/ekf/odom", "vx=speed", "command = cmd", "imu"];
    assert_eq!(topics.take_out(words), Ok(vec!["vx=speed", "imu"]));
    assert_eq!(topics.odometry.as_deref(), Some("/ekf/odom"));
    assert_eq!((topics.command.as_deref(), topics.imu), (Some("/cmd"), None));
    let twice = LogTopics::default().take_out(["imu=/a", "imu=/b"]).unwrap_err().to_string();
    assert!(twice.ends_with("found 'imu' twice"), "{twice}");
}

proptest! {
    #[test]
    fn no_bytes_make_a_reader_fail(content in proptest::collection::vec(any::<u8>(), 0..600)) {
        let data = [&[0, 1, 0, 0][..], &content].concat();
        fn look<M: Named + DeserializeOwned>(data: &[u8]) {
            let channel = RecordedChannel {
                topic: "/t".to_owned(), schema: type_name::<M>(), schema_data: Vec::new(), encoding: "cdr".to_owned(),
            };
            let message = RecordedMessage { channel: Arc::new(channel), log_time_ns: 0, data: data.to_vec() };
            // Whatever comes of it, it is an answer.
            let _read = read::<M>(&message);
        }
        look::<Odometry>(&data);
        look::<PointCloud2>(&data);
        look::<TfMessage>(&data);
        look::<Bool>(&data);
        look::<Twist>(&data);
    }
}
