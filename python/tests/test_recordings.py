"""Recordings as tables, maps and clouds, whole and broken off."""

import subprocess
import sys

import numpy as np
import pytest
import surefoot


@pytest.fixture(scope="module")
def recording(recording_path):
    return surefoot.open(recording_path)


def test_a_recording_says_what_is_in_it(recording):
    assert recording.ended_early is None
    assert recording.duration_s == pytest.approx(4.0, abs=0.2)
    assert {"/drive_log", "/decision", "/elevation", "/risk", "/scan"} <= recording.topics.keys()
    assert "Recording" in repr(recording)


def test_the_drive_log_is_a_frame(recording):
    log = recording.drive_log()
    assert len(log) == recording.topics["/drive_log"]
    assert {"time_ns", "t", "x", "y", "yaw", "vx", "wz", "cmd_speed", "cmd_steer"} <= set(log.columns)
    assert (np.diff(log["t"]) > 0.0).all() and np.isfinite(log[["x", "y", "yaw"]].to_numpy()).all()
    # The clock of the recording is that of the rows, to a microsecond.
    assert np.allclose(np.diff(log["time_ns"]) * 1e-9, np.diff(log["t"]), atol=1e-6)


def test_odometry_and_commands_are_its_halves(recording):
    odometry, commands = recording.odometry(), recording.commands()
    assert not any(name.startswith("cmd_") for name in odometry.columns)
    assert set(commands.columns) - {"time_ns", "t", "run"} >= {"cmd_speed", "cmd_steer"}
    assert len(odometry) == len(commands)


def test_decisions_and_figures_of_the_controller(recording):
    decisions = recording.decisions()
    assert set(decisions["decision"]) <= {"drive", "hold", "stop"}
    controller = recording.controller()
    assert len(controller) == len(decisions) and len(controller.columns) > 3
    assert recording.table("/decision").equals(decisions)


def test_maps_come_one_after_the_other(recording):
    maps = list(recording.elevation_maps())
    assert len(maps) == recording.topics["/elevation"]
    times_ns, surfaces = zip(*maps)
    assert list(times_ns) == sorted(times_ns)
    known = [np.isfinite(surface.height_m).sum() for surface in surfaces]
    assert known[-1] > 100
    time_ns, risk = next(recording.risk_maps())
    n_rows, n_cols, n_numbers = risk["risks"].shape
    assert n_numbers == 4 and risk["risks"].dtype == np.float32 and risk["risks"].max() > 0.0
    assert risk["flags"].shape == (n_rows, n_cols) and risk["flags"].dtype == np.uint8
    assert risk["resolution_m"] == surfaces[0].resolution_m and time_ns == times_ns[0]
    # What is known can be judged again.
    judged = surefoot.PhysicsPrior(surefoot.Vehicle("rc_car")).judge(surfaces[-1])
    assert judged.shape[:2] == surfaces[-1].shape


def test_scans_are_clouds(recording):
    _, scan = next(recording.scans())
    n = len(scan["points"])
    assert scan["points"].shape == (n, 3) and scan["terrain_class"].shape == (n,) and n > 100


def test_one_that_breaks_off_gives_what_is_whole(recording_path, recording, tmp_path):
    whole = recording_path.read_bytes()
    torn_path = tmp_path / "torn.mcap"
    torn_path.write_bytes(whole[: len(whole) * 2 // 3])
    torn = surefoot.open(torn_path)
    assert torn.ended_early
    log, torn_log = recording.drive_log(), torn.drive_log()
    assert 0 < len(torn_log) < len(log)
    assert torn_log.equals(log.iloc[: len(torn_log)])
    assert 0 < len(list(torn.elevation_maps())) <= len(list(recording.elevation_maps()))


def test_every_length_of_a_file_is_met(recording_path, tmp_path):
    whole = recording_path.read_bytes()
    path = tmp_path / "cut.mcap"
    for share in np.linspace(0.0, 1.0, 25):
        path.write_bytes(whole[: int(share * len(whole))])
        try:
            cut = surefoot.open(path)
        except ValueError as refusal:
            assert "expected a recording in MCAP" in str(refusal)
            continue
        for topic in cut.topics:
            if topic in ("/drive_log", "/decision", "/controller"):
                assert len(cut.table(topic)) > 0


def test_damaged_bytes_never_break_the_process(recording_path, tmp_path):
    whole = bytearray(recording_path.read_bytes())
    path, random = tmp_path / "damaged.mcap", np.random.default_rng(7)
    for _ in range(20):
        damaged = whole.copy()
        for place in random.integers(0, len(damaged), 40):
            damaged[place] = random.integers(0, 256)
        path.write_bytes(damaged)
        try:
            recording = surefoot.open(path)
            list(recording.elevation_maps())
            recording.drive_log()
        except ValueError:
            pass


def test_what_is_not_there_is_told():
    with pytest.raises(FileNotFoundError, match="expected a readable file"):
        surefoot.open("/nowhere.mcap")
    with pytest.raises(TypeError):
        surefoot.open(3.5)


def test_topics_that_are_not_there_or_hold_no_numbers_are_told(recording, tmp_path):
    with pytest.raises(ValueError, match="expected messages on topic /nothing, found only /"):
        recording.table("/nothing")
    with pytest.raises(ValueError, match="expected a topic of numbers"):
        recording.table("/elevation")
    other = tmp_path / "notes.mcap"
    other.write_text("nothing of the kind")
    with pytest.raises(ValueError, match="expected a recording in MCAP"):
        surefoot.open(other)


def test_without_pandas_tables_are_dicts_of_arrays(recording_path):
    script = f"""
import sys
sys.modules["pandas"] = None
import numpy as np, surefoot
log = surefoot.open({str(recording_path)!r}).drive_log()
assert isinstance(log, dict) and isinstance(log["x"], np.ndarray) and log["x"].dtype == np.float64
"""
    subprocess.run([sys.executable, "-c", script], check=True)
