"""Costs and models that are written in Python: what they come to, and what is said where they go wrong."""

import ground
import numpy as np
import pytest
import surefoot

STATE, GOAL_M = np.array([0.0, 0.0, 0.3, 1.0, 0.0]), (9.0, 2.0)
MODEL = surefoot.Vehicle("pietra_full_size").model()
#: A model whose limits make something to pay.
LIMITS = MODEL.to_dict()["limits"] | {"lateral_acceleration_max_mps2": 0.1, "reverse_speed_max_mps": 1.0}
TIGHT = surefoot.Model.from_dict(MODEL.to_dict() | {"limits": LIMITS})
SMALL = {"n_rollouts": 128, "n_steps": 20, "n_threads": 1}


def settings(lateral_s, reverse_s):
    costs = surefoot.settings_for(surefoot.Vehicle("pietra_full_size"))["controller"]["costs"]
    return {"costs": costs | {"lateral_s": lateral_s, "reverse_s": reverse_s}}


def rough_map(seed=0):
    risks = ground.level_risks()
    rng = np.random.default_rng(seed)
    risks[1:-1, 1:-1, :, :2] = rng.uniform(0.5, 1.0, risks[1:-1, 1:-1, :, :2].shape)
    return surefoot.RiskMap.from_arrays(risks, ground.RESOLUTION_M, origin=(-60, -40))


def lateral_and_reverse(rollouts):
    """The controller's own two terms, copied."""
    speed_mps, yaw_rate_radps = np.moveaxis(rollouts.rates, 2, 0)
    is_sideways = np.abs(speed_mps * yaw_rate_radps) > np.float32(0.1)
    return 0.7 * is_sideways + 0.4 * (speed_mps < 0.0)


def test_a_copy_of_a_term_in_python_costs_what_the_term_in_rust_costs():
    risk_map = rough_map()
    compiled = surefoot.Mppi(TIGHT, settings(0.7, 0.4), seed=3)
    copied = surefoot.Mppi(TIGHT, settings(0.0, 0.0), seed=3, cost=lateral_and_reverse)
    for _ in range(4):
        expected = compiled.decide(STATE, risk_map, GOAL_M).command
        assert np.allclose(copied.decide(STATE, risk_map, GOAL_M).command, expected, rtol=1e-4, atol=1e-4)
    expected, found = compiled.rollouts(risk_map), copied.rollouts(risk_map)
    # The very same controls after the first cycle too, but for rounding.
    terms = compiled.diagnostics["mean_terms_s"]
    assert np.sum(terms) == pytest.approx(np.sum(copied.diagnostics["mean_terms_s"]), abs=1e-3)
    assert np.allclose(np.sort(found.costs_s), np.sort(expected.costs_s), rtol=1e-3)


def test_a_term_copied_within_one_update_is_equal_to_1e_5():
    risk_map, seen = rough_map(), []
    compiled = surefoot.Mppi(TIGHT, settings(0.7, 0.4), seed=3)

    def cost(rollouts):
        seen.append(lateral_and_reverse(rollouts))
        return seen[-1]

    copied = surefoot.Mppi(TIGHT, settings(0.0, 0.0), seed=3, cost=cost)
    compiled.decide(STATE, risk_map, GOAL_M), copied.decide(STATE, risk_map, GOAL_M)
    expected, found = compiled.rollouts(risk_map).costs_s, copied.rollouts(risk_map).costs_s
    assert all(0.05 < np.mean(seen[0] == price_s) < 0.95 for price_s in (0.7, 0.4)), "both terms count"
    assert np.allclose(found, expected, rtol=1e-5, atol=0.0)


def test_a_cost_sees_every_step_of_all_rollouts_once_an_update():
    seen = []

    def cost(rollouts):
        seen.append(rollouts)
        return np.zeros(1024, np.float32)

    controller = surefoot.Mppi(MODEL, seed=1, cost=cost)
    risk_map = ground.level_map()
    decision = controller.decide(STATE, risk_map, GOAL_M)
    n_steps = controller.settings["n_steps"]
    assert len(seen) == controller.settings["n_iterations"] and decision.kind == "drive"
    rollouts = seen[0]
    assert rollouts.states.shape == (1024, n_steps + 1, 5) and rollouts.states.dtype == np.float64
    assert rollouts.commands.shape == rollouts.rates.shape == (1024, n_steps, 2)
    assert rollouts.risks.shape == (1024, n_steps, 4) and np.allclose(rollouts.risks[:, 0, :2], 0.8)
    assert rollouts.is_under_way.shape == (1024, n_steps) and rollouts.is_under_way[:, 0].all()
    assert np.allclose(rollouts.states[:, 0], STATE)
    best = controller.rollouts(risk_map, 1).states[0]
    assert np.abs(rollouts.states - best).max(axis=(1, 2)).min() < 1e-3
    # Nothing to pay is the controller without a cost, to the bit.
    assert surefoot.Mppi(MODEL, seed=1).decide(STATE, risk_map, GOAL_M).command == decision.command


def test_a_cost_bends_the_plan_and_infinity_leaves_rollouts_out():
    def north(rollouts):
        return 2.0 * rollouts.states[:, -1, 1]

    def ends_y_m(cost):
        controller = surefoot.Mppi(MODEL, seed=1, cost=cost)
        for _ in range(5):
            controller.decide((0, 0, 0, 1, 0), ground.level_map(), (9.0, 0.0))
        return controller.trajectory(ground.level_map())[-1, 1], controller

    south_m, _ = ends_y_m(north)
    straight_m, _ = ends_y_m(None)
    assert south_m < straight_m - 0.3
    _, controller = ends_y_m(lambda rollouts: np.where(np.arange(1024) < 100, np.inf, 0.0))
    assert controller.diagnostics["n_non_finite"] == 100


class Refusal(Exception):
    """One of the user's own."""


def raising(_):
    raise Refusal("mine")


@pytest.mark.parametrize(
    "returned, error, message",
    [
        (np.zeros(3), ValueError, r"cost: expected an array .* of shape \(128, 20\) or \(128,\), found shape \(3,\)"),
        (np.zeros((20, 128)), ValueError, r"found shape \(20, 128\)"),
        (np.full(128, np.nan), ValueError, r"cost\[0\]: expected a number, or infinity .*, found NaN"),
        (np.where(np.eye(128, 20), -np.inf, 0.0), ValueError, r"cost\[0, 0\]: .* found -inf"),
        (np.zeros(128, int), TypeError, "cost: expected an array of float32 or float64 .* found one of int64"),
        (None, TypeError, "cost: expected .*, found None"),
        ([0.0] * 128, TypeError, "cost: expected .*, found list"),
    ],
)
def test_what_a_cost_must_not_return_is_told(returned, error, message):
    controller = surefoot.Mppi(MODEL, SMALL, cost=lambda _: returned)
    with pytest.raises(error, match=message):
        controller.decide(STATE, ground.level_map(), GOAL_M)


def test_any_memory_layout_will_do():
    layouts = [np.ones((20, 128)).T, np.ones((128, 40))[:, ::2], np.ones((128, 20), np.float32)[::-1]]
    layouts.append(np.broadcast_to(1.0, (128, 20)))
    decisions = []
    for costs_s in layouts + [np.ones((128, 20))]:
        controller = surefoot.Mppi(MODEL, SMALL, seed=2, cost=lambda _: costs_s)
        decisions.append(controller.decide(STATE, ground.level_map(), GOAL_M).command)
    assert len(set(decisions)) == 1


def test_an_exception_of_a_cost_comes_out_and_the_controller_goes_on():
    costs = [raising, lambda rollouts: np.zeros(len(rollouts.states))]
    controller = surefoot.Mppi(MODEL, SMALL, cost=lambda rollouts: costs[0](rollouts))
    with pytest.raises(Refusal, match="mine"):
        controller.decide(STATE, ground.level_map(), GOAL_M)
    del costs[0]
    assert controller.decide(STATE, ground.level_map(), GOAL_M).kind == "drive"


def test_a_cost_that_calls_its_controller_is_told_and_waits_for_nobody():
    def cost(_):
        return controller.decide(STATE, ground.level_map(), GOAL_M)

    controller = surefoot.Mppi(MODEL, SMALL, cost=cost)
    with pytest.raises(RuntimeError, match="expected a cost and a model that call no controller"):
        controller.decide(STATE, ground.level_map(), GOAL_M)
    with pytest.raises(TypeError, match="cost: expected a function"):
        surefoot.Mppi(MODEL, cost=3)


def bicycle(limits, wheelbase_m):
    """The kinematic bicycle of the crate, in NumPy: actuators at once, ground that takes its share."""

    def step(states, commands, traction, step_s):
        x_m, y_m, yaw_rad, speed_mps, steering_rad = states.T
        change = np.array([limits["acceleration_max_mps2"], limits["steering_rate_max_radps"]]) * step_s
        reached = states[:, 3:] + np.clip(commands - states[:, 3:], -change, change)
        way_m = reached[:, 0] * step_s
        return np.column_stack([
            x_m + traction[:, 0] * way_m * np.cos(yaw_rad),
            y_m + traction[:, 0] * way_m * np.sin(yaw_rad),
            yaw_rad + traction[:, 1] * way_m * np.tan(reached[:, 1]) / wheelbase_m,
            reached,
        ])  # fmt: skip

    return step


def test_a_bicycle_in_python_drives_as_the_one_in_rust():
    description = MODEL.to_dict()
    own = surefoot.PythonModel(MODEL, bicycle(description["limits"], description["wheelbase_m"]))
    risk_map = rough_map()
    compiled, python = surefoot.Mppi(MODEL, SMALL, seed=4), surefoot.Mppi(own, SMALL, seed=4)
    for _ in range(2):
        expected = compiled.decide(STATE, risk_map, GOAL_M).command
        found = python.decide(STATE, risk_map, GOAL_M).command
        assert np.allclose(found, expected, atol=1e-3)
    expected, found = compiled.rollouts(risk_map, 20), python.rollouts(risk_map, 20)
    assert np.allclose(found.costs_s, expected.costs_s, rtol=1e-3)
    assert np.median(np.abs(found.states - expected.states)) < 1e-5
    assert python.state_names == compiled.state_names


def test_a_model_is_asked_for_all_rollouts_of_a_step_at_once_where_they_are_in_the_map():
    right = bicycle(MODEL.to_dict()["limits"], MODEL.to_dict()["wheelbase_m"])
    asked = []

    def step(states, *of):
        asked.append(states)
        return right(states, *of)

    controller = surefoot.Mppi(surefoot.PythonModel(MODEL, step), SMALL)
    asked.clear()
    controller.decide(STATE, rough_map(), GOAL_M)
    together = [states for states in asked if len(states) == SMALL["n_rollouts"]]
    assert len(together) == SMALL["n_steps"] and {len(states) for states in asked} <= {1, SMALL["n_rollouts"]}
    # All begin where the vehicle is, in the frame of the map whose corner lies at (-12, -8) m.
    assert np.allclose(together[0], STATE, atol=1e-5)
    assert np.std(together[-1][:, 0]) > 0.0


@pytest.mark.parametrize(
    "step, error, message",
    [
        (raising, TypeError, "takes 1 positional argument"),
        (lambda *_: raising(None), Refusal, "mine"),
        (lambda states, *_: states[:, :4], ValueError, r"step: expected .* of shape \(1, 5\), found shape \(1, 4\)"),
        (lambda states, *_: states * np.nan, ValueError, r"step\[0, 0\]: expected a finite number, found NaN"),
        (lambda states, *_: states.astype(np.int32), TypeError, "found one of int32"),
    ],
)
def test_what_a_model_must_not_do_is_told_when_it_is_first_asked(step, error, message):
    with pytest.raises(error, match=message):
        surefoot.Mppi(surefoot.PythonModel(MODEL, step), SMALL)


def test_a_model_that_goes_wrong_later_is_told_by_the_decision():
    right = bicycle(MODEL.to_dict()["limits"], MODEL.to_dict()["wheelbase_m"])
    steps = [right]
    controller = surefoot.Mppi(surefoot.PythonModel(MODEL, lambda *of: steps[0](*of)), SMALL)
    steps[0] = lambda *_: raising(None)
    with pytest.raises(Refusal, match="mine"):
        controller.decide(STATE, ground.level_map(), GOAL_M)
    steps[0] = right
    assert controller.decide(STATE, ground.level_map(), GOAL_M).kind == "drive"
    with pytest.raises(TypeError, match="step: expected a function"):
        surefoot.PythonModel(MODEL, 1.0)
