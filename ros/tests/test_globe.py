"""Goals in latitude and longitude, for a robot whose map points anywhere."""

import pytest
from conftest import until
from cyclone import GeoPose, GeoPoseStamped, Header, Peer, Quaternion, Time
from robot import on_globe


@pytest.fixture
def globe():
    """Says goals in degrees, to Cyclone DDS: no wheel brings this message."""
    peer = Peer()
    writer = peer.writer("car/goal_on_globe", GeoPoseStamped)

    def goal(latitude: float, longitude: float) -> None:
        until(lambda: writer.get_matched_subscriptions(), 20, "somebody hears goals in degrees")
        pose = GeoPose(latitude, longitude, 0.0, Quaternion(0.0, 0.0, 0.0, 1.0))
        writer.write(GeoPoseStamped(Header(Time(0, 0), ""), pose))

    yield goal


def test_a_goal_in_degrees_is_reached_wherever_the_map_points(loop, globe):
    robot, run, operator = loop
    globe(91.0, 7.25)
    until(lambda: run.has_said("goal on globe: latitude and longitude: expected -90 to 90"), 10, "it is refused")
    globe(47.5, 7.25)
    until(lambda: run.has_said("expected a place within 50000 m, found one 111"), 10, "it is refused")
    # By two metres of a way, a receiver that knows its place to 0.02 m tells where the map points.
    first_m, goal_m = (2.0, -2.0), (-1.0, 1.5)
    operator.goal(first_m)
    until(lambda: robot.distance_m(first_m) < 0.4 and robot.stands(), 60, "the robot stands at its first goal")
    globe(*on_globe(*goal_m))
    until(lambda: robot.distance_m(goal_m) < 0.4 and robot.stands(), 60, "the robot stands at the goal in degrees")
