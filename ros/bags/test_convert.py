"""Recordings as bags of ROS 2: read by PyPI's `rosbags`, beside the recordings as PyPI's `mcap` reads them."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

SUREFOOT = os.environ["SUREFOOT"]


def surefoot(*words) -> None:
    told = subprocess.run([SUREFOOT, *map(str, words)], capture_output=True, text=True, timeout=300)
    assert told.returncode == 0, told.stderr


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("drive")
    drive = ["--world", "arena", "--method", "physics", "--time-limit", "3", "--threads", "1", "--out", folder]
    # Three seconds are too few to arrive.
    told = subprocess.run([SUREFOOT, "drive", *map(str, drive)], capture_output=True, text=True, timeout=300)
    assert told.returncode == 1, told.stderr
    return folder / "drive.mcap"


@pytest.fixture(scope="module")
def bag(recording) -> Path:
    folder = recording.parent / "bag"
    surefoot("convert", recording, "--ros2", folder, "--vehicle", "rc_car")
    return folder


def recorded(recording: Path, topic: str) -> list:
    """Times [ns] and messages of a topic of the recording."""
    with recording.open("rb") as file:
        if topic == "/command":
            found = make_reader(file).iter_messages(topics=[topic])
            return [(message.log_time, json.loads(message.data)) for _, _, message in found]
        found = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(topics=[topic])
        return [(message.log_time, decoded) for _, _, message, decoded in found]


def converted(bag: Path, topic: str) -> list:
    """Times [ns] and messages of a topic of the bag, by the definitions that it brings along."""
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topic]
        found = reader.messages(connections=connections)
        return [(at_ns, reader.deserialize(data, connection.msgtype)) for connection, at_ns, data in found]


def test_the_bag_is_one_of_jazzy(bag):
    """Every type's hash is that of the definition that comes along, by rosbags' own reckoning, and of Jazzy's own."""
    jazzy = get_typestore(Stores.ROS2_JAZZY)
    with Reader(bag) as reader:
        assert reader.ros_distro == "jazzy"
        assert {connection.topic for connection in reader.connections} == {
            "/odom", "/tf", "/points", "/command", "/plan", "/risk",
        }
        for connection in reader.connections:
            types = get_typestore(Stores.EMPTY)
            types.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            assert types.hash_rihs01(connection.msgtype) == connection.digest, connection.topic
            if connection.msgtype in jazzy.types:
                assert jazzy.hash_rihs01(connection.msgtype) == connection.digest, connection.topic


def test_every_number_is_the_recordings(recording, bag):
    rows, odometry = recorded(recording, "/drive_log"), converted(bag, "/odom")
    assert len(rows) > 20
    assert [at_ns for at_ns, _ in rows] == [at_ns for at_ns, _ in odometry]
    for (at_ns, row), (_, said) in zip(rows, odometry, strict=True):
        assert said.header.stamp.sec * 10**9 + said.header.stamp.nanosec == at_ns
        place, twist = said.pose.pose.position, said.twist.twist
        assert (place.x, place.y, place.z) == (row.x, row.y, row.z)
        assert (twist.linear.x, twist.linear.y, twist.angular.z) == (row.vx, row.vy, row.wz)
    commands, told = recorded(recording, "/command"), converted(bag, "/command")
    expected = [(at_ns, np.float32(of["speed_mps"]), np.float32(of["steering_rad"])) for at_ns, of in commands]
    assert expected == [(at_ns, said.drive.speed, said.drive.steering_angle) for at_ns, said in told]
    moved = converted(bag, "/tf")
    assert [said.pose.pose.orientation.z for _, said in odometry] == [
        said.transforms[0].transform.rotation.z for _, said in moved
    ]


def test_clouds_plans_and_risks_are_the_recordings(recording, bag):
    scans, clouds = recorded(recording, "/scan"), converted(bag, "/points")
    assert len(scans) == len(clouds) > 2
    for (_, scan), (_, cloud) in zip(scans, clouds, strict=True):
        theirs = np.frombuffer(scan.data, np.dtype([("place", "<f4", 3), ("class", "u1")]))
        ours = np.frombuffer(cloud.data, np.dtype([("place", "<f4", 3), ("class", "u1"), ("rest", "u1", 3)]))
        assert np.array_equal(theirs["place"], ours["place"]) and np.array_equal(theirs["class"], ours["class"])
    plans = [scene.entities[0].lines for _, scene in recorded(recording, "/rollouts") if scene.entities]
    plans = [[(point.x, point.y) for point in lines[0].points] for lines in plans if lines]
    told = [[(pose.pose.position.x, pose.pose.position.y) for pose in path.poses] for _, path in converted(bag, "/plan")]
    assert plans == [way for way in told if way] and len(plans) > 5
    grids, risks = recorded(recording, "/risk"), converted(bag, "/risk")
    assert len(grids) == len(risks) > 0
    for (_, grid), (_, risk) in zip(grids, risks, strict=True):
        cells = np.frombuffer(grid.data, np.dtype([("risk", "<f4", 4), ("class", "u1"), ("flags", "u1")]))
        assert (risk.info.width, len(risk.data)) == (grid.column_count, len(cells))
        # Flags: 1 an obstacle, 2 never seen.
        assert np.array_equal(np.asarray(risk.data) == 100, cells["flags"] & 1 == 1)
        assert np.all(np.asarray(risk.data)[cells["flags"] & 3 == 2] == -1)


def test_what_was_recorded_is_played_again(bag, tmp_path):
    robot = "format = 1\nvehicle = 'rc_car'\nground = { method = 'physics' }\nrates = { odometry_hz = 10.0, scan_hz = 1.0 }\n[ros]\n"
    (tmp_path / "robot.toml").write_text(robot)
    surefoot("play", bag, "--robot", tmp_path / "robot.toml", "--goal", "8,0", "--out", tmp_path / "out")
    played = json.loads((tmp_path / "out/play.json").read_text())
    assert played["left_out"] == {} and played["scans"] > 2, played
