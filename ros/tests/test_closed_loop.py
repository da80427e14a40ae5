"""A robot of rclpy on Fast DDS is driven over ROS 2, stopped, left alone and lied to."""

import os
import signal
import time

from conftest import GOAL_M, ROCK_M, ROCK_RADIUS_M, Robot, until
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_a_goal_is_reached_around_the_rock(loop):
    robot, run, operator = loop
    operator.goal(GOAL_M)
    nearest_m = [float("inf")]

    def has_arrived() -> bool:
        nearest_m[0] = min(nearest_m[0], robot.distance_m(ROCK_M))
        return robot.distance_m(GOAL_M) < 0.4 and robot.stands()

    took_s = until(has_arrived, 60, "the robot stands at its goal")
    assert nearest_m[0] > ROCK_RADIUS_M, "it drove through the rock"
    assert run.has_said("goal: driving to (5.0, 0.0) m")
    print(f"goal reached after {took_s:.1f} s, {nearest_m[0]:.2f} m past the middle of the rock")


def test_an_emergency_stop_stops_and_the_mission_goes_on_when_it_is_told_to(loop):
    robot, _, operator = loop
    operator.goal(GOAL_M)
    until(robot.drives, 30, "the robot drives")
    operator.stop(True)
    took_s = until(robot.stands, 3, "the robot stands")
    operator.stop(False)
    time.sleep(2.0)
    assert robot.stands(), "after the emergency the mission is paused"
    assert robot.distance_m(GOAL_M) > 1.0
    operator.pause(False)
    until(robot.drives, 5, "the robot goes on")
    until(lambda: robot.distance_m(GOAL_M) < 0.4 and robot.stands(), 60, "the robot stands at its goal")
    print(f"stood {took_s:.2f} s after the emergency stop")


def test_a_bridge_that_dies_stops_the_robot_and_the_next_drives_on(loop):
    robot, run, operator = loop
    operator.goal(GOAL_M)
    until(robot.drives, 30, "the robot drives")
    bridge = run.child("ros")
    os.kill(bridge, signal.SIGSTOP)
    took_s = until(robot.stands, 3, "the robot stands")
    os.kill(bridge, signal.SIGKILL)
    until(lambda: run.child("ros") not in (None, bridge), 5, "the bridge is started anew")
    until(robot.drives, 30, "the robot goes on")
    until(lambda: robot.distance_m(GOAL_M) < 0.4 and robot.stands(), 60, "the robot stands at its goal")
    print(f"stood {took_s:.2f} s after the bridge was stopped")


def test_a_robot_that_restarts_is_driven_on(loop, start):
    robot, _, operator = loop
    operator.goal(GOAL_M)
    until(robot.drives, 30, "the robot drives")
    robot.process.kill()
    robot.process.wait()
    time.sleep(1.0)
    # It begins where it began, which to the planner is a localisation that jumps.
    again = start(Robot)
    until(again.drives, 30, "the new robot drives")


def test_who_comes_late_is_given_the_map_that_was_said_last(loop, node):
    robot, run, operator = loop
    first, late = [], []
    node.create_subscription(OccupancyGrid, "risk", first.append, LATCHED)
    # Risk is judged from the first goal on.
    operator.goal(GOAL_M)
    until(lambda: run.has_said("goal: driving to"), 5, "a mission")
    operator.pause(True)
    until(lambda: len(first) > 3, 20, "the risk is told")
    robot.say("silent cloud")
    time.sleep(2.0)
    n_before = len(first)
    time.sleep(1.0)
    assert len(first) == n_before, "without scans there are no new maps"
    node.create_subscription(OccupancyGrid, "risk", late.append, LATCHED)
    # Those of the seconds before it may come first.
    until(lambda: late and late[-1].header == first[-1].header, 10, "the late one has the last map")
    grid = late[-1]
    assert grid.data == first[-1].data
    cell = lambda x_m, y_m: grid.data[
        int((y_m - grid.info.origin.position.y) / grid.info.resolution) * grid.info.width
        + int((x_m - grid.info.origin.position.x) / grid.info.resolution)
    ]
    assert cell(ROCK_M[0] - ROCK_RADIUS_M, ROCK_M[1]) == 100, "the side of the rock that it sees"
    assert 0 <= cell(1.0, 0.0) < 20, "the plain"


FAULTS = {
    "cloud of nan": "points: data: expected returns of the sensor, found",
    "cloud without z": 'points: fields: expected one named "z", found x, y, intensity, label, ring',
    # As far ahead as it is when it comes: a little less than when it was said.
    "odometry of another clock": "odometry: stamp: expected a time of this machine's time of day, found one ",
    "odometry of nan": "odometry: position: expected finite numbers, found [NaN, 0.0, 0.0]",
}


def test_what_cannot_be_used_is_told_in_one_line_and_stops_the_robot(loop, node):
    robot, run, operator = loop
    diagnoses = []
    node.create_subscription(DiagnosticArray, "/diagnostics", diagnoses.append, 10)
    operator.goal(GOAL_M, frame="mars")
    told = 'goal: frame "mars": expected transforms on /tf or /tf_static that join it to "odom", found none'
    until(lambda: run.has_said(told), 5, told)
    assert robot.stands()
    # So far that the robot is on its way all along.
    operator.goal((200.0, 30.0))
    for fault, told in FAULTS.items():
        until(robot.drives, 20, f"the robot drives before {fault}")
        since = len(run.lines)
        robot.say(fault)
        until(lambda: run.has_said(told.split("[")[0], since), 5, told)
        took_s = until(robot.stands, 5, f"the robot stands with {fault}")
        time.sleep(1.0)
        assert robot.stands()
        n_lines = sum("surefoot ros: " in line and told.split(", found")[0] in line for line in run.lines[since:])
        assert n_lines == 1, "however often it comes, it is told once"
        until(lambda: any(status.level != b"\x00" for status in diagnoses[-1].status), 3, "a diagnosis")
        robot.say("whole")
        print(f"{fault}: stood after {took_s:.2f} s")
