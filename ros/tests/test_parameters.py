"""Parameters, as `ros2 param` and rqt ask for them."""

import pytest
from channels import Bus, Inlet
from conftest import GOAL_M, until
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient

NAMES = ["alpha", "method", "path_speed_mps", "speed_limit_mps", "use_sim_time"]


@pytest.fixture
def ask(node):
    """Calls a method of the client of the node's parameters, and returns the answer."""
    client = AsyncParameterClient(node, "/car/surefoot")
    assert client.wait_for_services(20)

    def call(method: str, *arguments):
        future = getattr(client, method)(*arguments)
        until(future.done, 10, f"an answer to {method}")
        return future.result()

    return call


def test_parameters_are_listed_described_and_told(loop, ask):
    assert ask("list_parameters").result.names == NAMES
    alpha, method, path_mps, limit_mps, simulated = ask("get_parameters", NAMES).values
    assert (alpha.double_value, method.string_value) == (0.6, "physics")
    assert (path_mps.double_value, limit_mps.double_value) == (1.0, 1.5)
    assert (simulated.type, simulated.bool_value) == (1, False)
    assert list(ask("get_parameter_types", NAMES).types) == [3, 4, 3, 3, 1]
    described = ask("describe_parameters", NAMES).descriptors
    assert [told.read_only for told in described] == [False, True, False, False, True]
    assert described[3].floating_point_range[0].to_value == 1.5


def test_what_cannot_be_set_is_refused_and_leaves_everything_as_it_was(loop, ask):
    wrong = [Parameter("method", value="pietra"), Parameter("alpha", value=1.5), Parameter("beta", value=1.0)]
    results = ask("set_parameters", wrong).results
    assert not any(result.successful for result in results)
    assert "left as the run was started, with physics" in results[0].reason
    assert results[1].reason == "alpha: expected a double above 0 and at most 1, found 1.5"
    whole = ask("set_parameters_atomically", [Parameter("alpha", value=0.3), *wrong]).result
    assert not whole.successful and whole.reason == results[0].reason
    assert ask("get_parameters", ["alpha"]).values[0].double_value == 0.6


def test_alpha_and_the_speed_limit_count_at_once(loop, ask):
    robot, run, operator = loop
    missions = Inlet(Bus("ros-car"), "mission")
    told = [Parameter("alpha", value=0.3), Parameter("speed_limit_mps", value=0.4)]
    assert all(result.successful for result in ask("set_parameters", told).results)
    heard = []

    def is_planned_for() -> bool:
        message = missions.newest()
        if message is not None:
            heard.append(message[2][0].alpha)
        return heard[-1:] == [0.3]

    until(is_planned_for, 10, "the mission plans for another share of outcomes")
    assert ask("get_parameters", ["alpha"]).values[0].double_value == 0.3
    operator.goal(GOAL_M)
    fastest_mps = [0.0]

    def is_on_its_way() -> bool:
        fastest_mps[0] = max(fastest_mps[0], robot.speed_mps)
        return robot.distance_m((0.0, 0.0)) > 2.0

    until(is_on_its_way, 60, "the robot is 2 m away")
    assert 0.3 < fastest_mps[0] < 0.41, f"{fastest_mps[0]:.2f} m/s"
