"""Two nodes of one name."""

import rclpy
from conftest import GOAL_M, until


def test_while_another_node_has_its_name_the_robot_stands(loop, node):
    robot, run, operator = loop
    operator.goal(GOAL_M)
    until(robot.drives, 30, "the robot drives")
    namesake = rclpy.create_node("surefoot", namespace="/car")
    took_s = until(robot.stands, 10, "the robot stands")
    assert robot.distance_m(GOAL_M) > 0.5, "on its way"
    line = "node /car/surefoot: expected no other node of this name, found 1; the vehicle stands until there is none"
    assert run.has_said(line)
    namesake.destroy_node()
    until(robot.drives, 10, "the robot goes on")
    until(lambda: robot.distance_m(GOAL_M) < 0.4 and robot.stands(), 60, "the robot stands at its goal")
    print(f"stood {took_s:.1f} s after the other node came")
