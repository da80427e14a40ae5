"""Goals by the action NavigateToPose, as Nav2's clients say them: driven, taken over, cancelled, refused and stopped."""

import os
import signal

import pytest
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from conftest import until
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient

NEAR_M, FAR_M, ASIDE_M = (1.5, -1.0), (40.0, -3.0), (40.0, 3.0)


class Errand:
    """A goal, and what is told of it."""

    def __init__(self, client, place_m, frame="odom") -> None:
        self.run, self.since = client.run, len(client.run.lines)
        goal = NavigateToPose.Goal()
        goal.pose.header.frame_id = frame
        goal.pose.pose.position.x, goal.pose.pose.position.y = place_m
        self.feedback: list[NavigateToPose.Feedback] = []
        said = client.send_goal_async(goal, feedback_callback=lambda told: self.feedback.append(told.feedback))
        until(said.done, 10, "an answer to the goal")
        self.handle = said.result()
        self.result = self.handle.get_result_async() if self.handle.accepted else None

    @property
    def status(self) -> int:
        return self.handle.status

    def ends(self, why="", patience_s=5.0) -> int:
        """How it ends. Why it was not reached is a line of the run."""
        until(self.result.done, patience_s, "the result")
        told = self.result.result()
        assert (told.result.error_code == 0) == (told.status != GoalStatus.STATUS_ABORTED)
        until(lambda: self.run.has_said(f"surefoot ros: navigate: {why}", self.since) or not why, 2, why)
        return told.status


@pytest.fixture
def client(loop, node):
    client = ActionClient(node, NavigateToPose, "navigate_to_pose")
    client.run = loop[1]
    assert client.wait_for_server(20)
    return client


def test_a_goal_is_driven_to_and_told_of_and_one_in_an_unknown_frame_is_rejected(loop, client):
    robot, run, _ = loop
    assert not Errand(client, NEAR_M, frame="mars").handle.accepted
    told = 'navigate: frame "mars": expected transforms on /tf or /tf_static that join it to "odom", found none'
    until(lambda: run.has_said(told), 5, told)
    assert sum("mars" in line for line in run.lines) == 1
    errand = Errand(client, NEAR_M)
    until(lambda: errand.status == GoalStatus.STATUS_EXECUTING, 5, "the goal is under way")
    until(robot.drives, 20, "the robot drives")
    assert errand.ends(patience_s=30) == GoalStatus.STATUS_SUCCEEDED
    assert robot.distance_m(NEAR_M) < 0.4
    until(lambda: errand.status == GoalStatus.STATUS_SUCCEEDED, 5, "the status says so, too")
    first, last = errand.feedback[0], errand.feedback[-1]
    took_s = last.navigation_time.sec + 1e-9 * last.navigation_time.nanosec
    assert abs(len(errand.feedback) - 2 * took_s) < 3, "twice a second"
    assert first.distance_remaining > 1.5 and last.distance_remaining < 0.8
    assert last.current_pose.header.frame_id == "odom" and first.number_of_recoveries == 0
    place = last.current_pose.pose.position
    left_m = ((place.x - NEAR_M[0]) ** 2 + (place.y - NEAR_M[1]) ** 2) ** 0.5
    assert abs(left_m - last.distance_remaining) < 0.01
    print(f"reached after {took_s:.1f} s, {len(errand.feedback)} words of how far it is")


def test_another_goal_takes_the_place_of_one_and_who_cancels_stops_the_vehicle(loop, client):
    robot, _, operator = loop
    taken = "another goal or path has taken its place"
    first = Errand(client, FAR_M)
    until(robot.drives, 20, "the robot drives")
    second = Errand(client, ASIDE_M)
    assert first.ends(taken) == GoalStatus.STATUS_ABORTED
    operator.goal(FAR_M)
    assert second.ends(taken) == GoalStatus.STATUS_ABORTED, "by a topic"
    third = Errand(client, ASIDE_M)
    until(lambda: third.status == GoalStatus.STATUS_EXECUTING, 5, "the goal is under way")
    operator.pause(True)
    until(robot.stands, 5, "the robot waits")
    assert third.status == GoalStatus.STATUS_EXECUTING and not third.result.done()
    operator.pause(False)
    until(robot.drives, 20, "the robot drives on")
    cancelled = third.handle.cancel_goal_async()
    assert third.ends("the mission was cancelled") == GoalStatus.STATUS_CANCELED
    assert cancelled.result().return_code == CancelGoal.Response.ERROR_NONE
    until(robot.stands, 5, "the robot stands")
    again = third.handle.cancel_goal_async()
    until(again.done, 5, "an answer")
    assert again.result().return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED


def test_an_emergency_stop_and_a_mission_that_dies_end_goals(loop, client):
    robot, run, operator = loop
    errand = Errand(client, FAR_M)
    until(robot.drives, 20, "the robot drives")
    operator.stop(True)
    assert errand.ends("emergency stop") == GoalStatus.STATUS_ABORTED
    until(robot.stands, 3, "the robot stands")
    latched = "refused: the emergency stop is latched; `reset` ends it"
    assert Errand(client, FAR_M).ends(latched) == GoalStatus.STATUS_ABORTED
    operator.stop(False)
    until(lambda: run.has_said("reset: "), 5, "the emergency is over")
    errand = Errand(client, FAR_M)
    until(robot.drives, 20, "the robot drives")
    os.kill(run.child("mission"), signal.SIGKILL)
    lost = "mission lost: whoever led it has begun anew"
    assert errand.ends(lost, patience_s=20) == GoalStatus.STATUS_ABORTED
