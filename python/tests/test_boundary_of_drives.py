"""What crosses between Python and runs, recordings and the diagnosis: any object, never a panic, nothing sent that was refused."""

import os
import time

import ground
import numpy as np
import pytest
import surefoot
from surefoot import gap
from test_boundary import hostile
from toy_drives import VEHICLE as TOY, drive

CAR = surefoot.Vehicle("rc_car")


@pytest.fixture(scope="module")
def driver():
    return surefoot.Driver(f"wheel-fuzz-{os.getpid()}", CAR)


def of_drivers(driver):
    """Every way in to a run, with arguments that it takes."""
    place = {
        "position_m": (0.0, 0.0, 0.1), "attitude_rad": np.zeros(3), "velocity_mps": (0.0, 0.0), "yaw_rate_radps": 0.0,
        "wheel_speed_mps": 0.0, "steering_rad": 0.0, "valid_at_ns": None, "applied": (0.0, 0.0),
    }  # fmt: skip
    scan = {
        "points": np.zeros((9, 3), np.float32), "terrain_class": np.zeros(9, np.uint8), "sensor": 0, "origin_m": (0.0, 0.0, 0.0),
        "valid_at_ns": None,
    }  # fmt: skip
    felt = {
        "times_ns": np.arange(1, 4, dtype=np.uint64), "acceleration_mps2": np.zeros((3, 3), np.float32),
        "angular_rate_radps": np.zeros((3, 3), np.float32),
    }  # fmt: skip
    return [
        (driver.publish_odometry, place),
        (driver.publish_scan, scan),
        (driver.publish_imu, felt),
        (driver.publish_mission, {"goal_m": (1.0, 0.0), "tolerance_m": 0.3, "time_s": 0.0, "outcome": 0}),
        (driver.publish_command, {"speed_mps": 0.0, "steering_rad": 0.0, "valid_at_ns": 1}),
    ]


def of_files(folder):
    """Every way in to what reads drives; none of these arguments gets as far as to be worked on."""
    short = {name: values[:5] for name, values in drive(1).items()}
    nowhere = str(folder / "nowhere.mcap")
    return [
        (surefoot.open, {"path": nowhere}),
        (surefoot.attach, {"run": "nowhere-at-all"}),
        (surefoot.Driver, {"run": "no name", "vehicle": CAR, "command_age_s": 1.0}),
        (gap.diagnose, {"sim": [], "real": [short], "vehicle": TOY, "heldout": [short], "columns": {}, "simulator": None, "name": "n"}),
        (gap.apply, {"diagnosis": {}, "model": CAR, "force": True}),
        (gap.manoeuvre, {"report": None}),
        (gap.ground, {"drives": [nowhere], "vehicle": CAR, "reference": [], "evidential": None}),
    ]


def tried(entry, arguments, rng, n_tries):
    """How many of these were refused, with some arguments changed."""
    refused = 0
    for _ in range(n_tries):
        names = rng.choice(list(arguments), min(len(arguments), rng.choice([1, 1, 2])), replace=False)
        try:
            repr(entry(**arguments | {name: hostile(rng) for name in names}))
        except surefoot.Defect:
            raise
        except (ValueError, TypeError, OSError, OverflowError, RuntimeError):
            refused += 1
    return refused


@pytest.mark.parametrize("seed", range(2))
def test_no_object_gets_past_a_driver_and_none_breaks_it(seed, driver):
    rng = np.random.default_rng(seed)
    refused = [tried(entry, arguments, rng, 120) for entry, arguments in of_drivers(driver)]
    assert min(refused) > 40, refused
    assert driver.carry_out()[:2] == (0.0, 0.0)


@pytest.mark.filterwarnings("ignore")
def test_complex_numbers_lose_no_part(driver):
    place = np.array([1.0 + 2.0j, 0.0])
    for entry in (
        lambda: driver.publish_mission(place, 0.3, 0.0),
        lambda: driver.run.goal([place]),
        lambda: driver.publish_scan(np.zeros((4, 3), np.float32), origin_m=np.zeros(3, np.complex64)),
        lambda: surefoot.ElevationMap().fuse(np.zeros((4, 3), np.float32), np.zeros(6, complex)),
        lambda: surefoot.Mppi(CAR.model()).decide(np.zeros(5), ground.level_map(), place),
    ):
        with pytest.raises(TypeError, match="numbers"):
            entry()


def test_what_a_driver_was_refused_is_heard_by_nobody(driver):
    listener = driver.run
    listener.odometry(), listener.scan()
    wrong = {"position_m": (np.nan, 0.0, 0.0), "attitude_rad": (0.0, 0.0, 0.0), "velocity_mps": (0.0, 0.0)}
    with pytest.raises(ValueError):
        driver.publish_odometry(**wrong, yaw_rate_radps=0.0)
    with pytest.raises(ValueError):
        driver.publish_scan(np.zeros((9, 2), np.float32))
    assert listener.odometry() is None and listener.scan() is None
    driver.publish_odometry(**wrong | {"position_m": (1.0, 2.0, 3.0)}, yaw_rate_radps=0.0, valid_at_ns=time.monotonic_ns())
    assert listener.odometry()[1]["position_m"] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("seed", range(2))
def test_no_object_gets_past_what_reads_drives_and_none_breaks_it(seed, tmp_path):
    rng = np.random.default_rng(seed)
    for entry, arguments in of_files(tmp_path):
        assert tried(entry, arguments, rng, 80) > 20, entry
    assert surefoot.Mppi(CAR.model()).decide(np.zeros(5), ground.level_map(), (4.0, 0.0)).kind == "drive"
