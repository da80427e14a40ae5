"""The diagnosis over drives of Python's: what is found, what is told, what is refused."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pandas as pd
import pytest
import surefoot
from surefoot import gap
from toy_drives import VEHICLE, Simulator, drive


@pytest.fixture(scope="module")
def sim():
    return [pd.DataFrame(drive(seed)) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def real():
    return [pd.DataFrame(drive(seed, steer_gain=0.8)) for seed in (11, 12)]


@pytest.fixture(scope="module")
def report(sim, real):
    heldout = [pd.DataFrame(drive(21, steer_gain=0.8))]
    return gap.diagnose(sim, real, VEHICLE, heldout=heldout, simulator=Simulator(), name="toy")


def test_the_hidden_effect_is_named_with_its_interval(report):
    assert report.verdict == "effects" and report.names[0] == "steer_gain", str(report)
    value, low, high = report.intervals["steer_gain"]["ratio"]
    assert low <= value <= high and value == pytest.approx(0.8, abs=0.03)
    assert report.answer["shrink"]["closed"] > 0.8
    assert report.answer["schema_version"] == 1 and report.answer["case"] == "toy"


def test_the_simulator_of_ones_own_decides(report):
    found = report.answer["in_simulator"]
    assert found["simulator"] == "toy simulator"
    causes = {cause["name"]: cause["found"]["value"] for cause in found["causes"]}
    assert set(causes) <= {"gain", "steer_gain"} and causes
    assert next(iter(causes.values())) == pytest.approx(0.8, abs=0.03)


def test_it_shows_itself_and_is_saved(report, tmp_path):
    page = report.html()
    assert page.startswith("<!DOCTYPE html>") and "steer_gain" in page and "data:image/png;base64," in page
    assert report._repr_html_().startswith("<iframe srcdoc=")
    assert "steer_gain" in str(report) and "steer_gain" in repr(report)
    report.save(tmp_path / "report")
    saved = json.loads((tmp_path / "report/answer.json").read_text())
    assert saved == report.answer
    assert (tmp_path / "report/report.html").read_text() == page
    assert (tmp_path / "report/predictions.csv").read_text().startswith("log,t0,horizon_s,model,")


def test_what_was_found_goes_into_a_model(report, tmp_path):
    report.save(tmp_path)
    vehicle = surefoot.Vehicle("rc_car")
    for diagnosis in (report, report.answer, tmp_path / "answer.json"):
        model = gap.apply(diagnosis, vehicle)
        measured = report.answer["controller_model"]
        forms = [effect.get("form", effect["id"]) for effect in report.answer["effects"]]
        assert [effect["id"] for effect in measured["causes"]] == forms
        effects = model.to_dict()["effects"]
        assert all(effect in effects for effect in measured["nominal"] + measured["causes"])
        assert len(effects) == len(measured["nominal"]) + len(measured["causes"])
    with pytest.raises(TypeError, match="model: expected a Model or a Vehicle"):
        gap.apply(report, "rc_car")
    with pytest.raises(TypeError, match="diagnosis: expected a GapReport"):
        gap.apply(3, vehicle)
    with pytest.raises(ValueError, match="expected the answer of gap diagnose"):
        gap.apply({"verdict": "none"}, vehicle)
    with pytest.raises(ValueError, match="found 'unknown'"):
        gap.apply({**report.answer, "verdict": "unknown"}, vehicle)
    partly = {**report.answer, "verdict": "effects_and_unknown"}
    with pytest.raises(ValueError, match="or to be forced"):
        gap.apply(partly, vehicle)
    assert gap.apply(partly, vehicle, force=True) == gap.apply(report, vehicle)


def test_the_controllers_own_model_is_begun_with(sim, real, report):
    delay = {"id": "steer_delay", "delay_s": 0.05}
    own = surefoot.Model.from_dict({**surefoot.Vehicle("rc_car").model().to_dict(), "effects": [delay]})
    begun = gap.diagnose(sim, real, VEHICLE, model=own)
    assert begun.names == report.names
    assert [effect["id"] for effect in begun.answer["controller_model"]["nominal"]] == ["steer_delay"]
    with pytest.raises(TypeError, match="model: expected a Model or a Vehicle"):
        gap.diagnose(sim, real, VEHICLE, model="rc_car")


def test_a_pose_of_another_clock_and_place_is_corrected_first(sim, real, report):
    def off(frame):
        late = frame[["x", "y", "yaw"]].shift(5).bfill()
        ahead_m, left_m = 0.5, -0.2
        sine, cosine = np.sin(late["yaw"]), np.cos(late["yaw"])
        x = late["x"] + cosine * ahead_m - sine * left_m
        return frame.assign(x=x, y=late["y"] + sine * ahead_m + cosine * left_m, yaw=late["yaw"])

    found = gap.diagnose(sim, [off(frame) for frame in real], VEHICLE, estimate=["time_offset", "lever_arm"])
    sensor = found.answer["pose_sensor"]
    # Five rows, and half of one by which a toy that holds its yaw rate over each row turns too late.
    assert sensor["time_offset_s"]["value"] == pytest.approx(0.11, abs=0.005)
    assert sensor["lever_arm_ahead_m"]["value"] == pytest.approx(0.5, abs=0.05)
    assert sensor["lever_arm_left_m"]["value"] == pytest.approx(-0.2, abs=0.05)
    assert found.names == report.names
    with pytest.raises(ValueError, match='estimate: expected "time_offset" and "lever_arm", found "clock"'):
        gap.diagnose(sim, real, VEHICLE, estimate=["clock"])


def test_the_manoeuvre_is_a_table_or_nothing(report):
    table = gap.manoeuvre(report)
    if table is not None:
        assert list(table.columns) == ["t", "cmd_speed", "cmd_steer"] and len(table) > 100
    assert any("manoeuvre.csv" in line for line in report.answer["advice"]) == (table is not None)


def refusal(sim, real, **options):
    with pytest.raises((TypeError, ValueError)) as refused:
        gap.diagnose(sim, real, options.pop("vehicle", VEHICLE), **options)
    return f"{refused.type.__name__}: {refused.value}"


def test_drives_that_cannot_be_are_told_by_place():
    good = drive(1)
    assert "TypeError: sim: expected a list of drives" in refusal(pd.DataFrame(good), [good])
    assert "TypeError: real[0]: expected a data frame" in refusal([good], [np.zeros(3)])
    without = {name: values for name, values in good.items() if name != "t"}
    assert "ValueError: real[0]: expected a column 't', found only: x" in refusal([], [without])
    short = {**good, "vx": good["vx"][:-1]}
    assert "column 'vx': expected 1000 values, found 999" in refusal([], [short])
    assert "expected at least one row" in refusal([], [{"t": []}])
    flat = {**good, "vx": np.zeros((1000, 2))}
    assert "column 'vx': expected one number for each row, found shape (1000, 2)" in refusal([], [flat])


def test_values_that_are_no_numbers_are_told_by_row():
    good = drive(1)
    for wrong, told in [
        (np.array(["1.0"] * 1000), "column 'vx': expected numbers, found <U3"),
        (np.array([1.0, "2.0"] * 500, object), "column 'vx', row 1: expected a number or nothing, found str"),
        (good["vx"] * 1j, "column 'vx': expected numbers, found complex128"),
        (np.full(1000, np.datetime64("now")), "column 'vx': expected numbers, found datetime64"),
        (np.where(np.arange(1000) == 7, np.inf, good["vx"]), "row 7: vx: expected a finite number or nothing"),
    ]:
        assert told in refusal([], [{**good, "vx": wrong}]), told
    backwards = {**good, "t": good["t"][::-1]}
    assert "real[0], row 1: t: expected a finite time >" in refusal([], [backwards])
    unknown = {**good, "t": np.where(np.arange(1000) == 3, np.nan, good["t"])}
    assert "real[0], row 3: t: expected a finite time" in refusal([], [unknown])


def test_what_numpy_lends_is_read_as_it_lies():
    good = drive(1)
    wide = np.repeat(np.column_stack(list(good.values())), 2, axis=0)[::2]
    strided = {name: wide[:, place] for place, name in enumerate(good)}
    for array in strided.values():
        array.flags.writeable = False
    narrow = {name: values.astype(np.float32) if name != "t" else values for name, values in good.items()}
    whole = {**good, "cmd_speed": pd.array(np.round(good["cmd_speed"]), dtype="Int64")}
    for own in (strided, narrow, whole):
        # It gets as far as the vehicle.
        assert "vehicle: expected" in refusal([], [own], vehicle=3)


def test_columns_with_names_of_their_own(sim, real):
    theirs = [frame.rename(columns={"vx": "wheel_speed_own"}) for frame in real]
    assert "vehicle: expected" in refusal(sim, theirs, columns={"vx": "wheel_speed_own"}, vehicle=3)
    assert "expected a column 'speed', or 'vx'" in refusal([], theirs, columns={"vx": "speed"})
    assert "columns: expected one of t, run" in refusal([], theirs, columns={"velocity": "vx"})
    assert "columns: expected a dict from our names" in refusal([], theirs, columns={"vx": 3})


def test_vehicles_and_simulators_that_cannot_be(sim, real):
    assert "wheelbase: expected" in refusal(sim, real, vehicle={"name": "x", "wheelbase": -1.0})
    assert "simulator: expected a callable" in refusal(sim, real, simulator=3)
    simulator = Simulator()
    simulator.knobs = [{"name": "gain", "unit": "-", "low": 2.0, "high": 1.0, "default": 1.5}]
    assert "knob 'gain': expected finite low < high" in refusal(sim, real, simulator=simulator)
    simulator.knobs = "gain"
    assert "simulator.knobs: expected a list of dicts" in refusal(sim, real, simulator=simulator)
    assert "expected nominal drives" in refusal([], real, simulator=Simulator())
    told_by_all = ["x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps"]
    for answer, told in [
        ({}, "expected a dict with 'x_m'"),
        (None, "expected a dict with 'x_m'"),
        (dict.fromkeys(told_by_all, [0.0]), "values, found 1"),
        (dict.fromkeys(told_by_all, ["a"]), "expected numbers"),
        ({**dict.fromkeys(told_by_all, [0.0]), "side_speed_mps": "a"}, "'side_speed_mps']: expected numbers"),
    ]:
        assert told in refusal(sim, real, simulator=lambda run, answer=answer: answer), told


def test_what_a_simulator_raises_is_raised(sim, real):
    def broken(run):
        raise ZeroDivisionError("rolled over")

    with pytest.raises(ZeroDivisionError, match="rolled over"):
        gap.diagnose(sim, real, VEHICLE, simulator=broken)


def test_drives_that_would_be_misread_are_told(sim, real):
    degrees = [frame.assign(yaw=np.degrees(frame["yaw"])) for frame in real]
    assert "real[0]: " in refusal(sim, degrees)
    with pytest.raises(FileNotFoundError):
        gap.diagnose(["/nowhere.csv"], real, VEHICLE)


def test_ctrl_c_ends_a_long_diagnosis(tmp_path):
    script = """
        import signal, sys
        # Whoever is started in the background of a shell would pay it no heed.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.path.insert(0, sys.argv[1])
        from surefoot import gap
        from toy_drives import VEHICLE, drive
        sim, real = [drive(seed) for seed in (1, 2, 3)], [drive(11, steer_gain=0.8)]
        print("ready", flush=True)
        gap.diagnose(sim, real, VEHICLE)
    """
    words = [sys.executable, "-c", textwrap.dedent(script), os.path.dirname(__file__)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=10)
    assert "KeyboardInterrupt" in told and process.returncode != 0, told
