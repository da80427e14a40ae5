"""Bags written by PyPI's `rosbags`, of both storages, through the command line."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from write import write

SUREFOOT = os.environ["SUREFOOT"]
ROBOT = """
format = 1
vehicle = "rc_car"
ground = { method = "physics" }
rates = { odometry_hz = 50.0, scan_hz = 5.0 }
[ros]
"""


def surefoot(*words) -> subprocess.CompletedProcess:
    return subprocess.run([SUREFOOT, *map(str, words)], capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="session", params=["mcap", "sqlite3"])
def bag(request, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bags") / request.param
    write(folder, request.param, seconds=6.0)
    return folder


def test_inspect_tells_topics_types_counts_and_rates(bag, tmp_path):
    told = surefoot("inspect", bag, "--json", tmp_path / "found.json")
    assert told.returncode == 0, told.stderr
    found = json.loads((tmp_path / "found.json").read_text())
    assert (found["kind"], found["complete"], found["metadata"]) == ("bag", True, "read")
    topics = {name: (topic["type"], topic["messages"]) for name, topic in found["topics"].items()}
    assert topics == {
        "/tf_static": ("tf2_msgs/msg/TFMessage", 1),
        "/command": ("ackermann_msgs/msg/AckermannDriveStamped", 120),
        "/imu": ("sensor_msgs/msg/Imu", 600),
        "/odom": ("nav_msgs/msg/Odometry", 300),
        "/points": ("sensor_msgs/msg/PointCloud2", 30),
    }
    assert abs(found["topics"]["/odom"]["rate_hz"] - 50.0) < 0.01


def test_play_drives_over_what_the_lidar_saw(bag, tmp_path):
    (tmp_path / "robot.toml").write_text(ROBOT)
    told = surefoot("play", bag, "--robot", tmp_path / "robot.toml", "--goal", "8,0", "--out", tmp_path / "out")
    assert told.returncode == 0, told.stderr
    played = json.loads((tmp_path / "out/play.json").read_text())
    assert (played["odometry"], played["scans"], played["left_out"]) == (300, 30, {})
    assert played["decided"]["drive"] > 0.8 * played["decisions"], played["decided"]


def test_a_drive_is_diagnosed(bag, tmp_path):
    """A car whose steering lags, against one whose steering does not, both out of bags."""
    for name, lag_s, turn in [("plain_1", 0.0, 1.0), ("plain_2", 0.0, -1.0), ("field", 0.25, 1.0)]:
        write(tmp_path / name, "mcap" if bag.name == "mcap" else "sqlite3", 20.0, lag_s, turn, clouds=False)
    drives = ["--sim", tmp_path / "plain_1", tmp_path / "plain_2", "--real", tmp_path / "field"]
    told = surefoot("gap", "diagnose", "--vehicle", "rc_car", *drives, "--json", tmp_path / "answer.json")
    assert told.returncode == 0, told.stderr
    answer = json.loads((tmp_path / "answer.json").read_text())
    found = [effect["id"] for effect in answer["effects"]]
    assert (answer["verdict"], found) == ("effects", ["steer_lag"]), told.stdout


def test_a_bag_that_is_cut_off_says_where(bag, tmp_path):
    file = next(path for path in bag.iterdir() if path.suffix in (".mcap", ".db3"))
    cut = tmp_path / file.name
    cut.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    told = surefoot("inspect", cut, "--json", tmp_path / "found.json")
    assert told.returncode == 0, told.stderr
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["complete"] is False
    assert found["ended_early"].startswith(f"after {found['messages']} messages, in {file.name}: ")
