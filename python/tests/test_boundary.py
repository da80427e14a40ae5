"""What crosses between Python and the native module: any object, any process, never a panic."""

import multiprocessing
import subprocess
import sys

import ground
import numpy as np
import pytest
import surefoot
from surefoot import _native

STATE = np.zeros(5)


def test_a_panic_becomes_an_exception_that_calls_it_a_defect():
    with pytest.raises(surefoot.Defect, match="this is a defect of surefoot, please report it: provoked"):
        _native.provoke_defect()
    assert issubclass(surefoot.Defect, RuntimeError)


def hostile(rng):
    """Something that fits nowhere, or just so."""
    shape = tuple(rng.integers(0, 5, rng.integers(0, 6)))
    dtypes = ["f4", "f8", ">f4", "f2", "i1", "u1", "i8", "c16", "O", "S3", "U2", "M8[s]", "?", "V7", "f4,u1"]
    array = np.zeros(shape, dtypes[rng.integers(len(dtypes))])
    if array.dtype.kind == "f":
        array[...] = rng.choice([0.0, -0.0, 1.0, -1.0, 1e-45, 6e4, np.nan, np.inf, -np.inf], shape)
    others = [
        None, True, -1, 0, 1, 2**63, -(2**200), 1e308, float("nan"), "", "rc_car", "\x00", "[[[", b"\xff", (), [], {},
        [[]] * 5, {"n_rollouts": 2**62}, {1: 2}, {"": None}, range(5), range(10**9), iter([1]), object(), int, len,
        np.float32(1), np.zeros((3, 3))[::-1].T, np.broadcast_to(np.float32(0.5), (9, 9, 8, 4)),
        np.ma.masked_array(np.zeros(5), True), memoryview(b"12345"), surefoot.Vehicle("rc_car"),
        surefoot.Vehicle("rc_car").model(), surefoot.SkidSteerVehicle("warthog"), ground.level_map(n_rows=5, n_cols=5),
        surefoot.Surface.from_arrays(np.zeros((3, 3), np.float32), 0.1), surefoot.ElevationMap({"n_rows": 9, "n_cols": 9}),
    ]  # fmt: skip
    return array if rng.random() < 0.4 else others[rng.integers(len(others))]


def entries():
    """Every way in, with arguments that it takes."""
    vehicle = surefoot.Vehicle("rc_car")
    model, risk_map = vehicle.model(), ground.level_map(n_rows=9, n_cols=9)
    controller = surefoot.Mppi(model, {"n_rollouts": 64, "n_steps": 5})
    surface = surefoot.Surface.from_arrays(np.zeros((9, 9), np.float32), 0.1)
    elevation = surefoot.ElevationMap({"n_rows": 9, "n_cols": 9})
    prior = surefoot.PhysicsPrior(vehicle, {"risk_map": {"n_yaws": 4}})
    field = surefoot.CostToGo(model, 9, 9)
    cells, bytes_ = np.zeros((9, 9), np.float32), np.zeros((9, 9), np.uint8)
    return [
        (surefoot.Vehicle, {"name_or_path": "rc_car"}),
        (surefoot.Vehicle.from_toml, {"text": "a = 1", "name": "n"}),
        (surefoot.Vehicle.from_dict, {"description": vehicle.to_dict()}),
        (surefoot.SkidSteerVehicle, {"name_or_path": "warthog"}),
        (surefoot.SkidSteerVehicle.from_dict, {"description": {}}),
        (surefoot.Model, {"path": "nowhere"}),
        (surefoot.Model.from_dict, {"description": model.to_dict()}),
        (surefoot.SkidSteerModel.from_toml, {"text": ""}),
        (surefoot.settings_for, {"vehicle": vehicle, "changes": {}}),
        (surefoot.RiskMap.from_arrays, {
            "risks": ground.level_risks(9, 9), "resolution_m": 0.2, "origin": (0, 0),
            "gradient": np.zeros((9, 9, 2), np.float32), "terrain_class": bytes_, "flags": bytes_,
        }),
        (risk_map.risk_at, {"pose": (0.0, 0.0, 0.0)}),
        (surefoot.Surface.from_arrays, {
            "height_m": cells, "resolution_m": 0.2, "origin": (0, 0), "terrain_class": bytes_,
            "vegetation_height_m": cells, "height_variance_m2": cells,
        }),
        (surefoot.Surface.from_arrays, {
            "height_m": cells, "resolution_m": 0.2, "knowledge": bytes_ + 2,
            "class_probability": np.full((9, 9, 4), 0.25, np.float32),
        }),
        (surefoot.ElevationMap, {"settings": {}}),
        (elevation.fuse, {
            "points": np.zeros((5, 3), np.float32), "pose": np.zeros(6), "terrain_class": np.zeros(5, np.uint8),
            "origin_m": (0.0, 0.0, 0.0), "valid_at_ns": 0,
        }),
        (surefoot.PhysicsPrior, {"vehicle": vehicle, "settings": {}, "cvar_level": 0.5}),
        (prior.judge, {"ground": surface, "centre_m": (0.0, 0.0)}),
        (surefoot.Evidential.load, {"vehicle": vehicle, "method": "pietra", "settings": {}, "unfamiliar": "fuse"}),
        (surefoot.Evidential.from_bytes, {"vehicle": vehicle, "weights": b"", "sidecar": b""}),
        (surefoot.CostToGo, {"model": model, "n_rows": 9, "n_cols": 9, "settings": {}}),
        (field.update, {"risk_map": risk_map, "goal_m": (0.0, 0.0)}),
        (surefoot.Mppi, {"model": model, "settings": {"n_rollouts": 64}, "seed": 1}),
        (controller.decide, {
            "state": STATE, "risk_map": risk_map, "goal_m": (1.0, 0.0), "tolerance_m": 0.1, "cost_to_go": field,
            "elapsed_s": 0.1,
        }),
        (controller.follow, {
            "state": STATE, "risk_map": risk_map, "points_m": np.zeros((3, 2)), "speed_mps": 1.0, "tolerance_m": 0.1,
        }),
        (controller.rollouts, {"risk_map": risk_map, "n": 3}),
        (controller.trajectory, {"risk_map": risk_map}),
        (controller.note_sent, {"command": (0.0, 0.0), "after_s": 0.0}),
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_no_object_gets_past_the_checks_and_none_breaks_anything(seed):
    rng, refused, taken = np.random.default_rng(seed), 0, 0
    for entry, arguments in entries():
        for _ in range(120):
            names = rng.choice(list(arguments), min(len(arguments), rng.choice([1, 1, 2, 5])), replace=False)
            changed = arguments | {name: hostile(rng) for name in names}
            try:
                result = entry(**changed)
                taken += 1
                repr(result)
            except (ValueError, TypeError, OSError, OverflowError):
                refused += 1
            except RuntimeError as error:
                # Nothing else has a reason to be one.
                assert not isinstance(error, surefoot.Defect) and "found none" in str(error), (entry, changed)
                refused += 1
    assert refused > 2000 and taken > 20
    # All that was used meanwhile still works.
    decision = surefoot.Mppi(surefoot.Vehicle("rc_car").model()).decide(STATE, ground.level_map(), (4.0, 0.0))
    assert decision.kind == "drive"


def judged():
    prior = surefoot.PhysicsPrior(surefoot.Vehicle("rc_car"))
    return prior.judge(surefoot.Surface.from_arrays(np.zeros((40, 40), np.float32), 0.05)).risks.copy()


def decide_in_child(controller):
    try:
        return controller.decide(STATE, ground.level_map(), (4.0, 0.0)).command
    except RuntimeError as error:
        return str(error)


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_forked_processes_make_maps_and_refuse_controllers_that_lost_their_threads():
    expected = judged()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        np.testing.assert_array_equal(pool.apply(judged), expected)
    model = surefoot.Vehicle("rc_car").model()
    alone, shared = surefoot.Mppi(model), surefoot.Mppi(model, {"n_threads": 2})
    expected = shared.decide(STATE, ground.level_map(), (4.0, 0.0)).command
    queue = multiprocessing.get_context("fork").SimpleQueue()

    def child():
        queue.put([decide_in_child(alone), decide_in_child(shared)])

    process = multiprocessing.get_context("fork").Process(target=child)
    process.start()
    from_alone, from_shared = queue.get()
    process.join()
    assert process.exitcode == 0
    assert from_alone == expected and 'start processes by multiprocessing\'s method "spawn"' in from_shared


def test_spawned_processes_make_the_same_maps():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        np.testing.assert_array_equal(pool.apply(judged), judged())


def n_threads_after_importing(module):
    script = f"import os, {module}; print(len(os.listdir('/proc/self/task')))"
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
def test_importing_starts_no_thread():
    assert n_threads_after_importing("surefoot") == "1\n"


def test_everything_says_what_it_is():
    for name in surefoot.__all__:
        thing = getattr(surefoot, name)
        members = vars(thing).items() if isinstance(thing, type) else ()
        own = {member: value for member, value in members if not member.startswith("_")}
        documented = {name: thing} | {member: value for member, value in own.items() if not member.isupper()}
        assert [member for member, value in documented.items() if len(value.__doc__ or "") < 10] == [], name
