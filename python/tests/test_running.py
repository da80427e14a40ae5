"""A run that is under way: a robot of somebody's own, what it says, orders to it, and the examples of drivers."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import surefoot
from command import SUREFOOT

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"


def name_of(what):
    return f"wheel-{what}-{os.getpid()}"


class Processes:
    """`surefoot up`, which is told to end with this."""

    def __init__(self, *words):
        self.process = subprocess.Popen(
            [SUREFOOT, "up", *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )

    def __enter__(self):
        return self.process

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()


def until(look, timeout_s=60.0):
    """What `look` gives once it gives anything."""
    deadline_s = time.monotonic() + timeout_s
    while (found := look()) is None:
        assert time.monotonic() < deadline_s, "out of time"
        time.sleep(0.02)
    return found


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    name, out = name_of("run"), tmp_path_factory.mktemp("up")
    words = ["--run", name, "--vehicle", "rc_car", "--method", "physics", "--threads", 1]
    with Processes(*words, "--out", out, "--standby", "--third-parties", 3):

        def directed():
            try:
                run = surefoot.attach(name)
                # Without a goal nothing is judged.
                run.goal([(20.0, 20.0)])
                return run
            except RuntimeError:
                return None

        yield until(directed)


def test_a_run_says_where_it_is_and_what_it_sees(run):
    at_ns, odometry = until(run.odometry)
    assert 0 <= time.monotonic_ns() - at_ns < 5_000_000_000
    assert len(odometry["position_m"]) == 3 and np.isfinite(odometry["position_m"]).all()
    _, scan = until(run.scan)
    assert scan["points"].dtype == np.float32 and scan["points"].shape[1] == 3 and len(scan["points"]) > 100
    _, surface = until(run.elevation_map)
    assert np.isfinite(surface.height_m).any()
    _, risk_map = until(run.risk_map)
    assert isinstance(risk_map, surefoot.RiskMap) and risk_map.risks.max() > 0.0


def test_a_map_of_a_run_drives_a_controller(run):
    _, risk_map = until(run.risk_map)
    _, odometry = until(run.odometry)
    x_m, y_m, _ = odometry["position_m"]
    controller = surefoot.Mppi(surefoot.Vehicle("rc_car").model(), {"n_threads": 1}, seed=1)
    state = (x_m, y_m, odometry["attitude_rad"][2], 0.0, 0.0)
    assert controller.decide(state, risk_map, (x_m + 3.0, y_m)).kind in {"drive", "hold", "stop"}


def test_orders_are_taken_and_refused(run):
    goal = run.goal([(20.0, 20.0)], tolerance_m=0.5)
    assert goal["state"] == 0 and goal["goal_m"] == (20.0, 20.0), goal
    _, command = until(run.command)
    assert command["decision"] in {"drive", "hold", "stop"}
    assert run.pause()["state"] == 2
    assert run.resume()["state"] == 0
    assert run.alpha(0.5)["alpha"] == 0.5
    assert run.estop()["state"] == 4
    with pytest.raises(RuntimeError, match="refused: "):
        run.goal([(1.0, 1.0)])
    assert run.reset()["state"] in (1, 2)
    run.cancel()
    with pytest.raises(RuntimeError, match="refused: "):
        run.resume()


def test_orders_that_cannot_be_are_not_sent(run):
    for order in (
        lambda: run.goal([]),
        lambda: run.goal([(np.nan, 0.0)]),
        lambda: run.goal([(0.0, 0.0)], tolerance_m=-1.0),
        lambda: run.path([(0.0, 0.0), (1.0, 0.0)], np.inf),
        lambda: run.alpha(0.0),
        lambda: run.alpha(np.nan),
    ):
        with pytest.raises(ValueError):
            order()


def test_runs_that_are_not_there_are_told():
    with pytest.raises(RuntimeError, match="run: expected run nowhere-at-all to be there, found"):
        surefoot.attach("nowhere-at-all")
    with pytest.raises(ValueError, match="run: expected 1 to 32 letters, digits, - or _"):
        surefoot.attach("../up")


def test_a_driver_checks_what_it_is_given():
    driver = surefoot.Driver(name_of("checks"), surefoot.Vehicle("rc_car"))
    # Nobody has commanded anything: the vehicle stands.
    assert driver.carry_out() == (0.0, 0.0, "hold") and driver.n_commands == 0
    with pytest.raises(RuntimeError, match="expected to be its only publisher"):
        surefoot.Driver(driver.run.name, surefoot.Vehicle("rc_car"))
    still = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0), 0.0)
    driver.publish_odometry(*still)
    later_ns = time.monotonic_ns() + 10**12
    for refused in (
        lambda: driver.publish_odometry((0.0, np.nan, 0.0), *still[1:]),
        lambda: driver.publish_odometry((0.0, 0.0), *still[1:]),
        lambda: driver.publish_odometry(*still, valid_at_ns=later_ns),
        lambda: driver.publish_scan(np.zeros((4, 2), np.float32)),
        lambda: driver.publish_scan(np.zeros((4, 3), np.float32), origin_m=(0.0, np.inf, 0.0)),
        lambda: driver.publish_scan(np.zeros((4, 3), np.float32), np.full(4, 9, np.uint8)),
        lambda: driver.publish_scan(np.zeros((4, 3), np.float32), np.zeros(3, np.uint8)),
        lambda: driver.publish_scan(np.zeros((40_000, 3), np.float32)),
        lambda: driver.publish_imu(np.zeros(0, np.uint64), *[np.zeros((0, 3), np.float32)] * 2),
        lambda: driver.publish_imu(np.zeros(65, np.uint64), *[np.zeros((65, 3), np.float32)] * 2),
        lambda: driver.publish_mission((np.nan, 0.0), 0.3, 0.0),
        lambda: surefoot.Driver("a b", surefoot.Vehicle("rc_car")),
        lambda: surefoot.Driver("ab", surefoot.Vehicle("rc_car"), command_age_s=-1.0),
    ):
        with pytest.raises(ValueError):
            refused()
    with pytest.raises(TypeError, match="points: expected an array of float32"):
        driver.publish_scan(np.zeros((4, 3)))
    driver.publish_scan(np.zeros((8, 3), np.float32)[::2])


def example(name, *words):
    command = [sys.executable, EXAMPLES / "python" / name, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_a_robot_of_somebodys_own_is_driven_to_its_goal_around_the_rock(tmp_path):
    name = name_of("robot")
    text = (EXAMPLES / "robot.toml").read_text().replace('run = "car"', f'run = "{name}"')
    (tmp_path / "robot.toml").write_text(text)
    with Processes("--threads", 1, "--robot", tmp_path / "robot.toml", "--out", tmp_path) as up:
        driven = example("drive_robot.py", "--run", name)
        shown, _ = up.communicate(timeout=60)
    told = json.loads(driven.stdout.splitlines()[-1])
    assert up.returncode == 0 and "goal reached" in shown and "plant" not in shown, shown
    assert driven.returncode == 0 and told["reached"] and told["distance_to_goal_m"] <= 0.3, driven
    # The rock's radius; half of the car's width of 0.25 m is what stands between.
    assert told["nearest_to_rock_m"] > 0.35 and told["commands"] >= 25 and told["risk_maps"] > 2, told
    odometry = surefoot.open(tmp_path / "drive-000.mcap").odometry()
    assert len(odometry) > 100 and odometry["t"].iloc[0] == 0.0
    assert {"x", "y", "yaw", "vx", "wz", "wheel_speed"} <= set(odometry.columns)


def test_a_log_that_is_told_is_recorded_row_by_row(tmp_path):
    rows = [f"{0.02 * k},{0.02 * k},0.5,{'' if k == 40 else 0.1},1.0,0.0,1.1,0.05" for k in range(100)]
    log = tmp_path / "drive.csv"
    log.write_text("\n".join(["t,x,y,yaw,vx,wz,cmd_speed,cmd_steer", *rows, ""]))
    name = name_of("log")
    words = ["--role", "recorder", "--run", name, "--vehicle", "rc_car", "--method", "physics"]
    with Processes(*words, "--threads", 1, "--out", tmp_path):
        until(lambda: (tmp_path / "drive-000.mcap").exists() or None)
        told = example("replay_log.py", log, "--run", name)
    assert told.returncode == 0, told
    assert json.loads(told.stdout)["poses"] == 99 and json.loads(told.stdout)["passed_over"] == 1
    topics = surefoot.open(tmp_path / "drive-000.mcap").topics
    assert topics["/channel/odometry"] == 99 and topics["/channel/command"] == 99


@pytest.mark.parametrize(
    ("content", "part"),
    [
        ("t,x,y\n0,1,2\n", "line 1: expected the columns t, x, y, yaw, vx, wz, found no yaw, vx, wz"),
        ("t,x,y,yaw,vx,wz\nsoon,1,2,0,0,0\n", "line 2, t: expected a number, found 'soon'"),
        ("t,x,y,yaw,vx,wz\n1,1,2,0,0,0\n0,1,2,0,0,0\n", "line 3, t: expected a time not before the last"),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(tmp_path, content, part):
    log = tmp_path / "log.csv"
    log.write_text(content)
    told = example("replay_log.py", log, "--run", name_of("none"))
    assert told.returncode == 2 and len(told.stderr.splitlines()) == 1 and part in told.stderr, told


@pytest.mark.parametrize(("script", "first"), [("drive_robot.py", []), ("replay_log.py", ["nowhere.csv"])])
@pytest.mark.parametrize("name", ["../x", "a b", "", "x" * 33])
def test_words_that_name_no_run_are_refused(script, first, name):
    told = example(script, *first, "--run", name)
    assert told.returncode == 2 and "--run: expected 1 to 32 letters, digits, - or _, found" in told.stderr, told
