//! Bags of ROS 2 of both storages, whole, cut off and damaged.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use formats::{Bag, BagTopic, BagWriter, RecordedChannel, RecordedMessage};
use rusqlite::{Connection, params};

/// The tables of rosbag2, as far as its readers need them.
const TABLES: &str = "
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
        serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
        data BLOB NOT NULL);
    CREATE INDEX timestamp_idx ON messages (timestamp ASC);
    INSERT INTO topics VALUES (1, '/odom', 'nav_msgs/msg/Odometry', 'cdr', '');";

/// Writes a bag.
type Write<'a> = &'a dyn Fn(&Path);

/// What the message of a number holds: as much as odometry.
fn payload(number: u64) -> Vec<u8> {
    number.to_le_bytes().repeat(90)
}

fn write_database(path: &Path, numbers: std::ops::Range<u64>) {
    let mut connection = Connection::open(path).unwrap();
    connection.execute_batch(TABLES).unwrap();
    let transaction = connection.transaction().unwrap();
    for number in numbers {
        let row = params![number as i64 * 10, payload(number)];
        transaction
            .execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?1, ?2)", row)
            .unwrap();
    }
    transaction.commit().unwrap();
}

fn write_mcap(path: &Path, numbers: std::ops::Range<u64>, compression: Option<mcap::Compression>) {
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(4096)).profile("ros2");
    let mut writer = options.create(BufWriter::new(File::create(path).unwrap())).unwrap();
    let schema = writer.add_schema("nav_msgs/msg/Odometry", "ros2msg", b"").unwrap();
    let channel = writer.add_channel(schema, "/odom", "cdr", &BTreeMap::new()).unwrap();
    for number in numbers {
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: number as u32,
            log_time: number * 10,
            publish_time: number * 10,
        };
        writer.write_to_known_channel(&header, &payload(number)).unwrap();
    }
    writer.finish().unwrap();
}

fn write_metadata(folder: &Path, n_messages: u64, files: &[&str]) {
    let listed: String = files.iter().map(|file| format!("    - {file}\n")).collect();
    let text = format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  message_count: {n_messages}\n  \
         duration:\n    nanoseconds: 5\n  compression_mode: ''\n  relative_file_paths:\n{listed}"
    );
    std::fs::write(folder.join("metadata.yaml"), text).unwrap();
}

/// The numbers of all messages, each checked to be what was written, and where the bag ends.
fn read(path: &Path) -> (Vec<u64>, Option<String>) {
    let mut numbers = Vec::new();
    let ended_early = Bag::open(path).unwrap().take_all(|message: RecordedMessage| {
        let number = message.log_time_ns / 10;
        assert_eq!(message.data, payload(number));
        let channel = &message.channel;
        assert_eq!((channel.topic.as_str(), channel.encoding.as_str()), ("/odom", "cdr"));
        assert_eq!(channel.schema, "nav_msgs/msg/Odometry");
        numbers.push(number);
        Ok(())
    });
    (numbers, ended_early)
}

fn up_to(n: u64) -> Vec<u64> {
    (0..n).collect()
}

#[test]
fn every_storage_gives_the_same_messages() {
    let folder = tempfile::tempdir().unwrap();
    for compression in [None, Some(mcap::Compression::Lz4), Some(mcap::Compression::Zstd)] {
        let path = folder.path().join("drive.mcap");
        write_mcap(&path, 0..100, compression);
        assert_eq!(read(&path), (up_to(100), None), "{compression:?}");
        assert!(Bag::is_at(&path));
    }
    let path = folder.path().join("drive.db3");
    write_database(&path, 0..100);
    assert_eq!(read(&path), (up_to(100), None));
    assert!(Bag::is_at(&path));
}

#[test]
fn files_of_a_folder_follow_one_another_by_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for file in 0..11 {
        write_mcap(&folder.path().join(format!("drive_{file}.mcap")), 5 * file..5 * file + 5, None);
    }
    assert_eq!(read(folder.path()), (up_to(55), None), "drive_10 is the last");
}

#[test]
fn the_metadata_says_the_order_and_how_much_there_was() {
    let folder = tempfile::tempdir().unwrap();
    write_mcap(&folder.path().join("b.mcap"), 0..3, None);
    write_mcap(&folder.path().join("a.mcap"), 3..5, None);
    write_metadata(folder.path(), 5, &["old_name/b.mcap", "a.mcap"]);
    assert_eq!(read(folder.path()), (up_to(5), None));
    write_metadata(folder.path(), 7, &["b.mcap", "a.mcap"]);
    let (numbers, ended_early) = read(folder.path());
    assert_eq!(numbers, up_to(5));
    assert_eq!(ended_early.unwrap(), "after 5 messages: metadata.yaml promises 7");
    write_metadata(folder.path(), 5, &["b.mcap", "gone.mcap"]);
    let (numbers, ended_early) = read(folder.path());
    assert_eq!(numbers, up_to(3));
    assert!(ended_early.unwrap().starts_with("after 3 messages, in gone.mcap: "));
}

#[test]
fn metadata_that_is_none_is_not_needed() {
    let folder = tempfile::tempdir().unwrap();
    write_database(&folder.path().join("drive_0.db3"), 0..5);
    std::fs::write(folder.path().join("metadata.yaml"), "rosbag2_bagfile_information: [").unwrap();
    assert_eq!(read(folder.path()), (up_to(5), None));
    let bag = Bag::open(folder.path()).unwrap();
    let problem = bag.metadata().unwrap_err();
    assert!(problem.starts_with("metadata.yaml: expected what rosbag2 writes, found: "), "{problem}");
    assert!(!problem.contains('\n'), "one line");
}

/// What is whole of a file that is cut off after a share of its bytes, and where it ends.
fn cut(path: &Path, share: f64) -> (Vec<u64>, String) {
    let n_bytes = (std::fs::metadata(path).unwrap().len() as f64 * share) as u64;
    File::options().write(true).open(path).unwrap().set_len(n_bytes).unwrap();
    let (numbers, ended_early) = read(path);
    (numbers, ended_early.unwrap())
}

#[test]
fn a_bag_that_is_cut_off_gives_what_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let writers: [(&str, Write<'_>); 2] = [
        ("drive.mcap", &|path| write_mcap(path, 0..1000, None)),
        ("drive.db3", &|path| write_database(path, 0..1000)),
    ];
    for (name, write) in writers {
        let path = folder.path().join(name);
        write(&path);
        let (numbers, ended) = cut(&path, 0.5);
        assert!((300..700).contains(&numbers.len()), "{name}: {}", numbers.len());
        assert_eq!(numbers, up_to(numbers.len() as u64), "{name}");
        assert!(ended.starts_with(&format!("after {} messages, in {name}: ", numbers.len())), "{ended}");
        let (numbers, ended) = cut(&path, 0.001);
        assert!(numbers.is_empty() && ended.starts_with("after 0 messages"), "{name}: {ended}");
    }
}

#[test]
fn a_bag_that_is_damaged_gives_what_comes_before() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["drive.mcap", "drive.db3"] {
        let path = folder.path().join(name);
        match name {
            "drive.mcap" => write_mcap(&path, 0..1000, None),
            _ => write_database(&path, 0..1000),
        }
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle..middle + 20_000].fill(0xa5);
        std::fs::write(&path, bytes).unwrap();
        let (numbers, ended) = read(&path);
        assert!((300..700).contains(&numbers.len()), "{name}: {}", numbers.len());
        assert!(ended.unwrap().contains(name));
    }
}

#[test]
fn what_is_no_bag_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let told = |name: &str| Bag::open(&folder.path().join(name)).unwrap_err().to_string();
    assert!(told("").ends_with("found a folder without any"), "{}", told(""));
    assert!(told("absent.mcap").contains("expected a readable bag, found: "), "{}", told("absent.mcap"));
    std::fs::write(folder.path().join("drive.bag"), "#ROSBAG V2.0\n").unwrap();
    assert!(told("drive.bag").ends_with("found another ending"), "{}", told("drive.bag"));
    let other = folder.path().join("other.db3");
    Connection::open(&other).unwrap().execute_batch("CREATE TABLE songs(name TEXT)").unwrap();
    assert!(read(&other).1.unwrap().contains("no such table: topics"));
    std::fs::write(&other, "a text").unwrap();
    assert!(read(&other).1.unwrap().contains("not a database"));
}

/// A view may never end, and a message may claim more memory than there is: neither is tried.
#[test]
fn a_database_that_is_meant_to_harm_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("endless.db3");
    let endless = "CREATE TABLE topics(id, name, type, serialization_format); CREATE VIEW messages AS WITH RECURSIVE \
                   n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) SELECT id, 1 AS topic_id, 0 AS timestamp, \
                   x'00' AS data FROM n";
    Connection::open(&path).unwrap().execute_batch(endless).unwrap();
    let told = |path: &Path| Bag::open(path).unwrap().take_all(|_| Ok(())).unwrap();
    assert!(told(&path).ends_with("expected a table messages, found a view"), "{}", told(&path));
    let path = folder.path().join("huge.db3");
    write_database(&path, 0..1);
    let huge = "INSERT INTO messages(topic_id, timestamp, data) VALUES (1, 30, zeroblob(300000000))";
    Connection::open(&path).unwrap().execute_batch(huge).unwrap();
    assert!(told(&path).starts_with("after 1 messages, in huge.db3: "), "{}", told(&path));
}

#[test]
fn a_time_that_no_recorder_tells_ends_the_bag() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("late.db3");
    write_database(&path, 0..2);
    let late = "INSERT INTO messages(topic_id, timestamp, data) VALUES (1, 4611686018427387905, x'00')";
    Connection::open(&path).unwrap().execute_batch(late).unwrap();
    let told = Bag::open(&path).unwrap().take_all(|_| Ok(())).unwrap();
    assert!(told.ends_with("expected a time before 2116, found 4611686018427387905 ns"), "{told}");
}

/// Folders of our own recordings end in .mcap, too.
#[test]
fn a_folder_of_other_recordings_is_no_bag() {
    let folder = tempfile::tempdir().unwrap();
    let own = mcap::WriteOptions::new().profile("");
    let file = BufWriter::new(File::create(folder.path().join("drive.mcap")).unwrap());
    let mut writer = own.create(file).unwrap();
    let channel = writer.add_channel(0, "/pose", "json", &BTreeMap::new()).unwrap();
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    assert!(!Bag::is_at(folder.path()) && !Bag::is_at(&folder.path().join("drive.mcap")));
    std::fs::remove_file(folder.path().join("drive.mcap")).unwrap();
    write_mcap(&folder.path().join("drive.mcap"), 0..3, None);
    assert!(Bag::is_at(folder.path()) && Bag::is_at(&folder.path().join("drive.mcap")));
}

#[test]
fn a_message_of_no_topic_ends_the_bag() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.db3");
    write_database(&path, 0..3);
    let connection = Connection::open(&path).unwrap();
    connection.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (7, 30, x'00')", []).unwrap();
    let (numbers, ended) = read(&path);
    assert_eq!(numbers, up_to(3));
    assert!(ended.unwrap().ends_with("expected a message on a known topic, found one on topic number 7"));
}

const ODOMETRY: BagTopic<'_> = BagTopic {
    name: "/odom",
    kind: "nav_msgs/msg/Odometry",
    definition: "std_msgs/Header header",
    type_hash: "RIHS01_3cc9",
};
const IMU: BagTopic<'_> = BagTopic { name: "/imu", kind: "sensor_msgs/msg/Imu", ..ODOMETRY };

#[test]
fn a_bag_that_is_written_is_read_with_what_it_says_of_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields/drive");
    let mut writer = BagWriter::create(&path).unwrap();
    assert!(!path.exists(), "it has its name once it is whole");
    writer.write(&ODOMETRY, 7_000_000_000, &[0, 1, 0, 0, 1]).unwrap();
    writer.write(&IMU, 5_000_000_000, &[0, 1, 0, 0, 2]).unwrap();
    writer.write(&ODOMETRY, 9_000_000_000, &[0, 1, 0, 0, 3]).unwrap();
    let counts = writer.finish().unwrap();
    assert_eq!(counts, BTreeMap::from([("/imu".to_owned(), 1), ("/odom".to_owned(), 2)]));

    let bag = Bag::open(&path).unwrap();
    let metadata = bag.metadata().unwrap().unwrap();
    assert_eq!((metadata.storage.as_str(), metadata.n_messages), ("mcap", 3));
    assert_eq!(metadata.files, [PathBuf::from("drive_0.mcap")]);
    let mut read = Vec::new();
    let ended_early = bag.take_all(|message| {
        let RecordedChannel { topic, schema, schema_data, encoding } = &*message.channel;
        assert_eq!((schema_data.as_slice(), encoding.as_str()), (ODOMETRY.definition.as_bytes(), "cdr"));
        read.push((topic.clone(), schema.clone(), message.log_time_ns, message.data[4]));
        Ok(())
    });
    assert_eq!(ended_early, None);
    let expected = [(ODOMETRY, 7, 1), (IMU, 5, 2), (ODOMETRY, 9, 3)];
    let expected = expected
        .map(|(topic, s, byte)| (topic.name.to_owned(), topic.kind.to_owned(), s * 1_000_000_000, byte));
    assert_eq!(read, expected);
    // What rosbag2 reads beside it.
    let text = std::fs::read_to_string(path.join("metadata.yaml")).unwrap();
    for line in [
        "  version: 9",
        "    nanoseconds: 4000000000",
        "    nanoseconds_since_epoch: 5000000000",
        "type_description_hash: RIHS01_3cc9",
        "offered_qos_profiles: []",
        "  ros_distro: jazzy",
    ] {
        assert!(text.contains(line), "{line}:\n{text}");
    }
}

#[test]
fn a_bag_is_written_over_nothing_and_leaves_nothing_before_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive");
    let mut writer = BagWriter::create(&path).unwrap();
    writer.write(&ODOMETRY, 0, &[0, 1, 0, 0]).unwrap();
    drop(writer);
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    BagWriter::create(&path).unwrap().finish().unwrap();
    let told = BagWriter::create(&path).err().unwrap().to_string();
    assert!(told.ends_with("drive: expected a name that is free, found a file or folder"), "{told}");
}
