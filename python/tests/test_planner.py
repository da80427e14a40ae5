"""The controller: what it decides, what it tells of its futures, and that a call disturbs nobody."""

import sys
import threading

import ground
import numpy as np
import pytest
import surefoot

STATE = np.array([-8.0, 0.0, 0.0, 0.5, 0.0])
GOAL_M = (8.0, 0.0)


@pytest.fixture
def model():
    return surefoot.Vehicle("buggy_fifth").model()


def limits(model):
    return model.to_dict()["limits"]


def drive(model, risk_map, traction=0.8, goal_m=GOAL_M, settings=None, cost_to_go=None):
    """Drives a car that is not the controller's own to the goal: its states, ten a second."""
    controller = surefoot.Mppi(model, settings)
    car = ground.Car(model, STATE, traction)
    states = [car.state]
    for _ in range(300):
        decision = controller.decide(car.state, risk_map, goal_m, cost_to_go=cost_to_go)
        if decision.reason == "at_goal":
            return np.array(states)
        assert decision.kind == "drive", decision
        car.drive(decision.command, 0.1)
        states.append(car.state)
    raise AssertionError(f"not there after 30 s: {states[-1]}")


def test_the_car_comes_to_its_goal_and_around_what_is_blocked(model):
    straight = drive(model, ground.level_map())
    assert np.abs(straight[:, 1]).max() < 0.5
    risks = ground.level_risks()
    x_m, y_m = ground.centres_m(81, 121, 0.2, (-60, -40))
    rock = np.hypot(x_m, y_m) < 1.5
    risks[rock, :, 2:] += surefoot.RiskMap.BLOCKED_RAD
    blocked = surefoot.RiskMap.from_arrays(risks, 0.2, origin=(-60, -40))
    field = surefoot.CostToGo(model, 81, 121)
    field.update(blocked, GOAL_M)
    around = drive(model, blocked, cost_to_go=field)
    # Half a cell's diagonal is what a blocked cell's middle may lie off the rock's edge.
    assert np.hypot(around[:, 0], around[:, 1]).min() > 1.5 - 0.15
    # 16 m at 0.8 of the largest speed at the best.
    for states in (straight, around):
        assert 0.1 * len(states) > 15.5 / (0.8 * limits(model)["speed_max_mps"])


def test_costs_make_weights_as_a_soft_minimum_does(model):
    controller = surefoot.Mppi(model, {"n_rollouts": 512})
    risk_map = ground.level_map()
    controller.decide(STATE, risk_map, GOAL_M)
    rollouts, told = controller.rollouts(risk_map), controller.diagnostics
    assert rollouts.states.shape == (512, 51, 5) and rollouts.states.dtype == np.float64
    assert rollouts.costs_s.shape == rollouts.weights.shape == (512,)
    assert (np.diff(rollouts.costs_s) >= 0.0).all() and rollouts.costs_s[0] == np.float32(told["baseline_s"])
    expected = np.exp((rollouts.costs_s[0] - rollouts.costs_s.astype(float)) / told["temperature_s"])
    np.testing.assert_allclose(rollouts.weights, expected / expected.sum(), rtol=2e-3, atol=1e-7)
    # Five in a hundred futures count, as the default temperature is chosen.
    assert abs(1.0 / (rollouts.weights.astype(float) ** 2).sum() / 512 - 0.05) < 0.01


def test_a_rollout_is_a_drive_of_the_car(model):
    controller = surefoot.Mppi(model)
    risk_map = ground.level_map()
    controller.decide(STATE, risk_map, GOAL_M)
    states = controller.rollouts(risk_map, 64).states
    assert states.shape == (64, 51, 5)
    np.testing.assert_array_equal(states[:, 0], np.broadcast_to(states[0, 0], (64, 5)))
    away_m = np.diff(states[:, :, :2], axis=1)
    # Each step goes 0.8 of the speed, somewhere between those at its ends.
    reached_mps = np.hypot(away_m[..., 0], away_m[..., 1]) / 0.1 / 0.8
    low, high = np.sort(np.abs(np.stack([states[:, :-1, 3], states[:, 1:, 3]])), axis=0)
    assert ((reached_mps > low - 0.02) & (reached_mps < high + 0.02)).all()
    assert np.abs(states[:, :, 4]).max() <= limits(model)["steering_max_rad"] + 1e-6


def test_the_plan_starts_with_the_command_and_leads_where_the_trajectory_says(model):
    controller = surefoot.Mppi(model)
    risk_map = ground.level_map()
    decision = controller.decide(STATE, risk_map, GOAL_M)
    assert controller.plan.shape == (50, 2)
    assert tuple(controller.plan[0]) == decision.command
    trajectory = controller.trajectory(risk_map)
    assert trajectory.shape == (51, 5)
    car = ground.Car(model, trajectory[0], 0.8)
    for command in controller.plan:
        car.drive(command, 0.1)
    assert np.hypot(*(car.state[:2] - trajectory[-1, :2])) < 0.05 * np.hypot(*(trajectory[-1, :2] - STATE[:2]))


def decisions(model, seed, n_threads=1):
    controller = surefoot.Mppi(model, {"n_threads": n_threads}, seed=seed)
    risk_map = ground.level_map()
    return [controller.decide(STATE, risk_map, GOAL_M).command for _ in range(5)]


def test_a_seed_gives_the_same_commands_again_for_any_number_of_threads(model):
    assert decisions(model, 7) == decisions(model, 7) == decisions(model, 7, n_threads=2)
    assert decisions(model, 7) != decisions(model, 8)


def test_reset_starts_again(model):
    controller, risk_map = surefoot.Mppi(model), ground.level_map()
    first = [controller.decide(STATE, risk_map, GOAL_M).command for _ in range(3)]
    controller.reset()
    with pytest.raises(RuntimeError, match="expected a decision that sampled before, found none"):
        controller.rollouts(risk_map)
    assert [controller.decide(STATE, risk_map, GOAL_M).command for _ in range(3)] == first


@pytest.mark.parametrize(
    ("state", "goal_m", "kind", "reason"),
    [
        ((0, 0, 0, 0, 0), (0.1, 0.1), "hold", "at_goal"),
        ((np.nan, 0, 0, 0, 0), (5, 0), "stop", "non_finite_input"),
        ((0, 0, 0, np.inf, 0), (5, 0), "stop", "non_finite_input"),
        ((0, 0, 0, 0, 0), (np.nan, 0), "stop", "non_finite_input"),
        ((1e6, 0, 0, 0, 0), (5, 0), "stop", "outside_map"),
    ],
)
def test_a_cycle_that_cannot_plan_says_why_and_stands(model, state, goal_m, kind, reason):
    controller = surefoot.Mppi(model)
    decision = controller.decide(state, ground.level_map(), goal_m)
    assert (decision.kind, decision.reason, decision.command[0]) == (kind, reason, 0.0)
    with pytest.raises(RuntimeError, match="found none"):
        controller.trajectory(ground.level_map())


def test_a_car_that_holds_keeps_its_wheels_as_they_were_told(model):
    controller, risk_map = surefoot.Mppi(model), ground.level_map()
    turned = controller.decide(STATE, risk_map, (-6.0, 3.0)).command
    assert turned[1] > 0.0
    assert controller.decide(STATE, risk_map, STATE[:2]).command == (0.0, turned[1])


def test_a_line_is_followed(model):
    controller, risk_map = surefoot.Mppi(model), ground.level_map()
    # A quarter circle of 6 m around (-8, 6) to the left.
    angles_rad = np.linspace(-np.pi / 2, 0.0, 20)
    points_m = np.stack([-8.0 + 6.0 * np.cos(angles_rad), 6.0 + 6.0 * np.sin(angles_rad)], axis=1)
    car, off_m = ground.Car(model, STATE, 0.8), []
    for _ in range(200):
        decision = controller.follow(car.state, risk_map, points_m, 1.0)
        if decision.reason == "at_goal":
            break
        car.drive(decision.command, 0.1)
        off_m.append(abs(np.hypot(car.x_m + 8.0, car.y_m - 6.0) - 6.0))
    assert decision.reason == "at_goal" and max(off_m) < 0.5
    # 9.4 m of line less the tolerance.
    assert 7.0 < 0.1 * len(off_m) * 0.8 * 1.3 and 0.1 * len(off_m) < 15.0


def test_a_skid_steered_vehicle_turns_on_the_spot_towards_its_goal():
    controller = surefoot.Mppi(surefoot.SkidSteerVehicle("warthog").model())
    assert controller.state_names[4] == "yaw_rate_radps"
    risk_map = ground.level_map()
    for goal_m, sign in [((0.0, 6.0), 1.0), ((0.0, -6.0), -1.0)]:
        controller.reset()
        assert sign * controller.decide((0, 0, 0, 0, 0), risk_map, goal_m).command[1] > 0.01


def test_times_to_the_goal_are_those_of_the_straight_line_on_level_ground(model):
    field = surefoot.CostToGo(model, 81, 121)
    field.update(ground.level_map(), GOAL_M)
    x_m, y_m = ground.centres_m(81, 121, 0.2, (-60, -40))
    straight_s = np.hypot(x_m - GOAL_M[0], y_m - GOAL_M[1]) / (0.8 * limits(model)["speed_max_mps"])
    inside = np.zeros((81, 121), bool)
    inside[1:-1, 1:-1] = True
    far = inside & (straight_s > straight_s.max() / 4)
    ratio = field.seconds[far] / straight_s[far]
    # Sixteen directions make ways at most 2.8 % longer; the goal's cell is half a diagonal wide.
    assert 0.96 < ratio.min() and ratio.max() < 1.06
    with pytest.raises(ValueError, match="expected 81 x 121 cells"):
        field.update(ground.level_map(n_rows=41), GOAL_M)
    with pytest.raises(ValueError, match=r"goal: expected finite coordinates"):
        field.update(ground.level_map(), (np.inf, 0.0))


def test_who_faces_away_from_the_goal_turns_by_half_a_circle_first(model):
    settings = {"turning_radius_m": 1.5, "reverse_speed_share": 0.0}
    field = surefoot.CostToGo(model, 81, 121, settings)
    assert field.turning_s.shape == (0, 81, 121)
    field.update(ground.level_map(), GOAL_M, tolerance_m=0.5)
    assert field.turning_s.shape == (16, 81, 121) and field.turning_s.dtype == np.float32
    speed_mps = 0.8 * limits(model)["speed_max_mps"]
    east, west, row, col = 0, 8, 40, 40
    # Of 17.1 m, 5.1 along the circle to its tangent through the goal, 12 are what who faces it drives: Dubins.
    lost_m = (field.turning_s[west, row, col] - field.turning_s[east, row, col]) * speed_mps
    assert abs(lost_m - 5.1) < 1.0
    assert surefoot.CostToGo(model, 81, 121).turning_s.shape[0] == 0


def test_what_was_sent_instead_is_where_the_next_plan_starts(model):
    risk_map = ground.level_map()
    settings = {"delay_s": 0.3}
    followed, stopped = surefoot.Mppi(model, settings), surefoot.Mppi(model, settings)
    for _ in range(5):
        followed.decide(STATE, risk_map, GOAL_M)
        stopped.decide(STATE, risk_map, GOAL_M)
        stopped.note_sent((0.0, 0.0))
    starts = [controller.trajectory(risk_map)[0, 3] for controller in (followed, stopped)]
    assert starts[1] < starts[0]


@pytest.mark.parametrize("work", ["decide", "rollouts", "judge", "fuse"])
def test_other_threads_run_while_a_call_works(model, work):
    controller, risk_map = surefoot.Mppi(model, {"n_rollouts": 8192}), ground.level_map()
    controller.decide(STATE, risk_map, GOAL_M)
    prior = surefoot.PhysicsPrior(surefoot.Vehicle("buggy_fifth"))
    surface = surefoot.Surface.from_arrays(np.zeros((200, 200), np.float32), 0.1)
    elevation, points = surefoot.ElevationMap(), np.random.default_rng(1).normal(size=(200_000, 3)).astype(np.float32)
    call = {
        "decide": lambda: controller.decide(STATE, risk_map, GOAL_M),
        "rollouts": lambda: controller.rollouts(risk_map),
        "judge": lambda: prior.judge(surface),
        "fuse": lambda: elevation.fuse(points, np.zeros(6)),
    }[work]
    go, ran = threading.Lock(), []
    go.acquire()
    thread = threading.Thread(target=lambda: (go.acquire(), ran.append(True)))
    interval_s = sys.getswitchinterval()
    thread.start()
    try:
        # No thread is asked to make room for others: who runs meanwhile runs because the call let go.
        sys.setswitchinterval(1e3)
        go.release()
        call()
        ran_meanwhile = bool(ran)
    finally:
        sys.setswitchinterval(interval_s)
        thread.join()
    assert ran_meanwhile


def test_threads_take_turns_with_one_controller(model):
    controller, risk_map = surefoot.Mppi(model), ground.level_map()
    alone = surefoot.Mppi(model)
    expected = [alone.decide(STATE, risk_map, GOAL_M).command for _ in range(20)]
    found = []
    decide = lambda: [found.append(controller.decide(STATE, risk_map, GOAL_M).command) for _ in range(10)]
    threads = [threading.Thread(target=decide) for _ in range(2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert sorted(found) == sorted(expected)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"n_rollouts": 100}, "n_rollouts: expected a multiple of 64, found 100"),
        ({"n_rollouts": -64}, "n_rollouts"),
        ({"n_rollouts": 1 << 40}, "n_rollouts: expected a whole number >= 1 and not beyond all reason"),
        ({"step_s": float("nan")}, "step_s: expected a time from 0.01 to 1 s, found NaN"),
        ({"isa": "abacus"}, "isa"),
        ({"rollouts": 64}, "settings: rollouts: expected "),
        ("n_steps = 1", "n_steps: expected at least 2, found 1"),
        ("n_steps =", "settings:1: expected TOML, found: "),
    ],
)
def test_settings_of_no_controller_are_refused(model, settings, told):
    with pytest.raises(ValueError) as refusal:
        surefoot.Mppi(model, settings)
    assert told in str(refusal.value)


def test_settings_come_back_and_make_the_same_controller(model):
    controller = surefoot.Mppi(model, {"n_rollouts": 256, "temperature": {"fixed": {"temperature_s": 0.5}}})
    assert controller.settings["temperature"] == {"fixed": {"temperature_s": 0.5}}
    assert surefoot.Mppi(model, controller.settings).settings == controller.settings
    never = {"recovery": controller.settings["recovery"] | {"patience_s": float("inf")}}
    assert surefoot.Mppi(model, never).settings["recovery"]["patience_s"] == float("inf")
