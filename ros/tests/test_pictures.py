"""What operators look at: the ground and its risks as layers, the plan and what else was tried as markers."""

import math

from conftest import GOAL_M, ROCK_M, ROCK_RADIUS_M, until
from cyclone import LATCHED, GridMap, Peer
from visualization_msgs.msg import MarkerArray


def test_heights_and_risks_are_told_as_layers(loop):
    robot, _, operator = loop
    # To Cyclone DDS: no wheel brings this message.
    reader = Peer().reader("car/grid_map", GridMap, LATCHED)
    operator.goal(GOAL_M)
    operator.pause(True)
    maps = []

    def layer(name: str, x_m: float, y_m: float) -> float:
        grid = maps[-1]
        middle, info = grid.info.pose.position, grid.info
        row = int((middle.x + info.length_x / 2 - x_m) / info.resolution)
        column = int((middle.y + info.length_y / 2 - y_m) / info.resolution)
        array = grid.data[grid.layers.index(name)]
        return array.data[column * array.layout.dim[1].stride + row]

    def is_whole() -> bool:
        maps.extend(reader.take(10))
        return bool(maps) and layer("elevation", 1.0, 0.0) == layer("elevation", 1.0, 0.0)

    until(is_whole, 20, "a grid map with heights")
    assert list(maps[-1].layers) == ["elevation", "linear_traction", "angular_traction", "roll", "pitch"]
    assert maps[-1].header.frame_id == "odom"
    beside_m = ROCK_M[0] - ROCK_RADIUS_M, ROCK_M[1]
    # The robot says that it drives at a height of 0, and its file that the sensor sits 0.05 m lower than it does.
    assert abs(layer("elevation", 1.0, 0.0) + 0.05) < 0.02, "the plain"
    assert layer("roll", *beside_m) > math.pi / 2, "the rock is not to be touched"
    assert layer("roll", 1.0, -1.0) < 0.2 and layer("linear_traction", 1.0, -1.0) > 0.5
    assert math.isnan(layer("elevation", ROCK_M[0] + 2.0, ROCK_M[1])), "behind the rock nothing is seen"


def test_the_plan_is_told_as_a_line_that_begins_at_the_robot(loop, node):
    robot, _, operator = loop
    told = []
    node.create_subscription(MarkerArray, "markers", told.append, 10)
    operator.goal(GOAL_M)
    plans = lambda: [message.markers[0] for message in told if message.markers[0].ns == "plan"]
    until(lambda: robot.drives() and plans(), 30, "the robot drives and tells how")
    line = plans()[-1]
    assert (line.type, line.header.frame_id) == (line.LINE_STRIP, "odom")
    assert len(line.points) == len(line.colors) > 5
    assert robot.distance_m((line.points[0].x, line.points[0].y)) < 0.5
    length_m = math.dist((line.points[0].x, line.points[0].y), (line.points[-1].x, line.points[-1].y))
    assert length_m > 0.5, "it leads somewhere"


def test_futures_that_were_tried_are_told_as_lines_that_part_from_the_robot(loop, node):
    robot, _, operator = loop
    told = []
    node.create_subscription(MarkerArray, "markers", told.append, 50)
    operator.goal(GOAL_M)
    futures = lambda: [message.markers for message in told if message.markers[0].ns == "futures"]
    until(lambda: robot.drives() and futures(), 30, "the robot drives and tells what else it tried")
    lines = futures()[-1]
    assert [line.id for line in lines] == list(range(32))
    begin, ends = lines[0].points[0], [line.points[-1] for line in lines]
    assert robot.distance_m((begin.x, begin.y)) < 0.7
    assert all(line.points[0] == begin for line in lines), "all begin where the vehicle is"
    assert len({(end.x, end.y) for end in ends}) == len(ends), "no two are one"
    green = {line.color.g for line in lines}
    assert len(green) > 8, "and their colours tell what they cost"
    seconds = [stamped.header.stamp.sec + 1e-9 * stamped.header.stamp.nanosec for stamped, *_ in futures()]
    assert all(later - earlier > 0.4 for earlier, later in zip(seconds, seconds[1:])), "twice a second"
