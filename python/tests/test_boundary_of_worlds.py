"""What crosses between Python and the worlds, costs and models: any object, never a panic, nothing changed by what was refused."""

import threading

import ground
import numpy as np
import pytest
import surefoot
from test_boundary import hostile

VEHICLE, HALL = surefoot.Vehicle("rc_car"), surefoot.Task.arena()
SMALL = {"n_rollouts": 64, "n_steps": 5}


def simulation(**changes):
    return surefoot.Simulation(VEHICLE, HALL, seed=1, ground="true", **changes)


def entries(folder):
    """Every way in, with arguments that it takes, and how often it is worth to be tried."""
    one, model, risk_map = simulation(), VEHICLE.model(), ground.level_map(n_rows=9, n_cols=9)
    slope = surefoot.Surface.from_arrays(np.zeros((90, 90), np.float32), 0.1)
    priced = surefoot.Mppi(model, SMALL, cost=lambda rollouts: np.zeros(64))
    decide = {"state": np.zeros(5), "risk_map": risk_map, "goal_m": (1.0, 0.0)}
    return [
        (surefoot.Task.rock_field, {"seed": 1, "settings": {"side_m": 50.0}}, 8),
        (surefoot.Task.navigation, {"map": 0, "pair": 0, "seed": 1, "settings": {"side_m": 50.0}}, 8),
        (surefoot.Task.arena, {"settings": {"bush_height_m": 0.1}}, 20),
        (surefoot.Task.terrain, {
            "ground": slope, "vehicle": VEHICLE, "start": (3.0, 3.0, 0.0), "goal_m": (5.0, 5.0), "distance_m": 2.0, "seed": 1,
        }, 20),
        (surefoot.Simulation, {"vehicle": VEHICLE, "task": HALL, "seed": 1, "ground": "true", "settings": {}}, 60),
        (surefoot.Simulation.settings_for, {"vehicle": VEHICLE, "settings": {}}, 60),
        (surefoot.step_together, {"simulations": [one], "commands": np.zeros((1, 2), np.float32)}, 120),
        (one.frame, {"side_px": 64}, 20),
        (surefoot.Mppi, {"model": model, "settings": SMALL, "cost": None}, 40),
        (priced.decide, decide, 40),
        (surefoot.PythonModel, {"model": model, "step": lambda *of: of[0]}, 60),
        (surefoot.Dataset.from_bytes, {"bytes": b""}, 40),
        (surefoot.Dataset.from_recording, {"vehicle": VEHICLE, "log": folder / "nowhere.mcap", "ground": HALL}, 40),
        (surefoot.Dataset.collect, {"vehicle": VEHICLE, "world": "nowhere", "split": "train"}, 40),
        (surefoot.train, {"dataset": None, "validation": None, "method": "pietra", "settings": {}}, 40),
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(2))
def test_no_object_gets_past_the_checks_and_none_breaks_anything(seed, tmp_path):
    rng, refused, taken = np.random.default_rng(seed), 0, 0
    for entry, arguments, n_tries in entries(tmp_path):
        for _ in range(n_tries):
            names = rng.choice(list(arguments), min(len(arguments), rng.choice([1, 1, 2])), replace=False)
            changed = arguments | {name: hostile(rng) for name in names}
            try:
                repr(entry(**changed))
                taken += 1
            except (ValueError, TypeError, OSError, OverflowError):
                refused += 1
    assert refused > 300 and taken > 5
    assert surefoot.step_together([simulation()]).outcomes == [None]


@pytest.mark.parametrize("seed", range(2))
def test_whatever_a_cost_or_a_model_returns_is_taken_or_told(seed):
    rng, risk_map = np.random.default_rng(seed), ground.level_map(n_rows=41, n_cols=41)
    returned = [None]
    controller = surefoot.Mppi(VEHICLE.model(), SMALL, cost=lambda _: returned[0])
    refused = 0
    for _ in range(150):
        returned[0] = hostile(rng)
        try:
            controller.decide(np.zeros(5), risk_map, (1.0, 0.0))
        except (ValueError, TypeError):
            refused += 1
        try:
            surefoot.Mppi(surefoot.PythonModel(VEHICLE.model(), lambda *_: returned[0]), SMALL)
        except (ValueError, TypeError):
            refused += 1
    assert refused > 250
    returned[0] = np.zeros(64)
    assert controller.decide(np.zeros(5), risk_map, (1.0, 0.0)).kind == "drive"


def test_commands_may_lie_anywhere_and_are_only_read():
    expected = None
    commands = np.array([[0.7, 0.1], [0.4, -0.2]], np.float32)
    strided = np.zeros((2, 6), np.float32)[:, ::3]
    strided[...] = commands
    locked = commands.copy()
    locked.flags.writeable = False
    for given in (commands, strided, locked, np.asfortranarray(commands)):
        pair = [simulation(), simulation()]
        for _ in range(3):
            observations = surefoot.step_together(pair, given)
        expected = expected or observations.state.tobytes()
        assert observations.state.tobytes() == expected
    with pytest.raises(TypeError, match="commands: expected an array of float32"):
        surefoot.step_together(pair, commands.astype(float))
    with pytest.raises(ValueError, match=r"commands: expected shape \(2, 2\), found shape \(1, 2\)"):
        surefoot.step_together(pair, commands[:1])


def test_what_was_refused_has_moved_nothing():
    one, other = simulation(), simulation()
    wrong = np.array([[1.0, 0.0], [np.nan, 0.0]], np.float32)
    with pytest.raises(ValueError, match=r"commands\[1, 0\]: expected a finite number, found NaN"):
        surefoot.step_together([one, other], wrong)
    assert one.time_s == other.time_s == 0.0
    huge = np.array([[3e38, -3e38]], np.float32)
    for _ in range(5):
        observations = surefoot.step_together([one], huge)
    assert np.isfinite(observations.state).all() and one.time_s == pytest.approx(0.5)


def test_simulations_of_other_patches_do_not_go_together():
    with pytest.raises(ValueError, match=r"simulations\[1\]: expected the patch of the first"):
        surefoot.step_together([simulation(), simulation(settings={"patch": {"n_rows": 5}})])
    with pytest.raises(ValueError, match="simulations: expected at least one"):
        surefoot.step_together([])
    with pytest.raises(TypeError, match=r"simulations\[0\]: expected a Simulation, found Task"):
        surefoot.step_together([HALL])


def test_threads_of_python_that_share_a_simulation_take_turns():
    one, command = simulation(), np.array([[0.5, 0.0]], np.float32)
    drive = lambda: [surefoot.step_together([one], command) for _ in range(5)]
    threads = [threading.Thread(target=drive) for _ in range(4)]
    [thread.start() for thread in threads], [thread.join() for thread in threads]
    assert one.time_s == pytest.approx(2.0) and len(one.poses) == 21
