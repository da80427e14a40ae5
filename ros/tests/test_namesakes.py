"""Two nodes of one name."""

import sys

import rclpy
from conftest import GOAL_M, Process, until

# A node that takes no leave when it is killed: the others know of it until its lease ends, after 20 s of Fast DDS.
NAMESAKE = """
import time, rclpy
rclpy.init()
node = rclpy.create_node("surefoot", namespace="/car")
time.sleep(600)
"""
LEASE_S = 20.0


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


def test_a_namesake_that_is_killed_counts_until_its_lease_ends(loop, start):
    robot, _, operator = loop
    operator.goal(GOAL_M)
    until(robot.drives, 30, "the robot drives")
    namesake = start(Process, [sys.executable, "-c", NAMESAKE])
    until(robot.stands, 20, "the robot stands")
    assert robot.distance_m(GOAL_M) > 0.5, "on its way"
    namesake.process.kill()
    namesake.process.wait()
    # Its last sign of life may be some seconds old, and whoever has left is looked for every other second.
    took_s = until(robot.drives, LEASE_S + 15, "the robot goes on")
    assert took_s > 0.5 * LEASE_S, "a node that may come back is believed to be there"
    until(lambda: robot.distance_m(GOAL_M) < 0.4 and robot.stands(), 60, "the robot stands at its goal")
    print(f"stood for {took_s:.1f} s after the other node was killed")
