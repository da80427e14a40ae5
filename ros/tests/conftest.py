"""Robots and runs as processes, whose words are kept."""

import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool

FOLDER = Path(__file__).parent
SUREFOOT = os.environ["SUREFOOT"]
CAR = FOLDER / "car.toml"
ROCK_M, ROCK_RADIUS_M = (2.5, 0.1), 0.35
GOAL_M = (5.0, 0.0)


def until(is_so, patience_s: float, what: str) -> float:
    """Waits for something, and returns how long that took [s]."""
    began_s = time.monotonic()
    while not is_so():
        waited_s = time.monotonic() - began_s
        assert waited_s < patience_s, f"expected within {patience_s} s: {what}"
        time.sleep(0.02)
    return time.monotonic() - began_s


class Process:
    """A process whose lines are kept with the times when they came."""

    def __init__(self, words, **options) -> None:
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def say(self, line: str) -> None:
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def has_said(self, text: str, since: int = 0) -> bool:
        return any(text in line for line in self.lines[since:])

    def end(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()


class Robot(Process):
    """The robot of robot.py."""

    def __init__(self) -> None:
        super().__init__([sys.executable, str(FOLDER / "robot.py")])
        until(lambda: self.state() is not None, 30, "the robot tells where it is")

    def states(self, n: int) -> list[dict]:
        """The last `n` it told, newest first."""
        told = (line for line in reversed(self.lines) if line.startswith("{"))
        return [json.loads(line) for line in itertools.islice(told, n)]

    def state(self):
        return next(iter(self.states(1)), None)

    @property
    def speed_mps(self) -> float:
        return abs(self.state()["speed_mps"])

    def stands(self) -> bool:
        """For half a second: a robot that changes from reverse to forward has no speed for a moment."""
        return all(abs(state["speed_mps"]) < 0.02 for state in self.states(5))

    def drives(self) -> bool:
        return self.speed_mps > 0.3

    def distance_m(self, place_m) -> float:
        state = self.state()
        return ((state["x_m"] - place_m[0]) ** 2 + (state["y_m"] - place_m[1]) ** 2) ** 0.5


class Run(Process):
    """The processes of a run."""

    def __init__(self, robot_file: Path, out: Path) -> None:
        words = [SUREFOOT, "up", "--robot", str(robot_file), "--out", str(out)]
        super().__init__(words, cwd=out)

    def child(self, role: str):
        """The number of the process of a role; None while there is none."""
        for folder in Path("/proc").iterdir():
            if not folder.name.isdigit():
                continue
            try:
                words = (folder / "cmdline").read_bytes().split(b"\0")
                parent = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except OSError:
                continue
            is_role = b"--role" in words and words[words.index(b"--role") + 1] == role.encode()
            if parent == self.process.pid and is_role:
                return int(folder.name)
        return None


class Operator:
    """Says goals and stops, as RViz and a panel would."""

    def __init__(self, node) -> None:
        self.node = node
        self.goals = node.create_publisher(PoseStamped, "goal_pose", 1)
        self.stops = node.create_publisher(Bool, "emergency_stop", 1)
        self.pauses = node.create_publisher(Bool, "pause", 1)

    def goal(self, place_m, frame="odom") -> None:
        until(lambda: self.goals.get_subscription_count() > 0, 20, "somebody hears goals")
        told = PoseStamped()
        told.header.frame_id = frame
        told.header.stamp = self.node.get_clock().now().to_msg()
        told.pose.position.x, told.pose.position.y = place_m
        self.goals.publish(told)

    def stop(self, is_emergency: bool) -> None:
        self.stops.publish(Bool(data=is_emergency))

    def pause(self, is_paused: bool) -> None:
        self.pauses.publish(Bool(data=is_paused))


@pytest.fixture
def start():
    """Starts processes, and ends them after the test; of one that failed, their last words are shown."""
    started: list[Process] = []

    def begin(kind, *arguments):
        started.append(kind(*arguments))
        return started[-1]

    yield begin
    for process in reversed(started):
        process.end()
        print(f"{type(process).__name__}:", *process.lines[-40:], sep="\n  ")


@pytest.fixture
def node():
    """A node of the test's own, spun by a thread."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    rclpy.init()
    node = rclpy.create_node("test", namespace="/car")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    yield node
    # Whoever still waits for a callback is not waited for.
    executor.shutdown(timeout_sec=5)
    thread.join(5)
    node.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def loop(start, node, tmp_path):
    """A robot and a run that are ready for a goal."""
    robot, run, operator = start(Robot), start(Run, CAR, tmp_path), Operator(node)
    until(lambda: robot.state()["commands"] > 20, 60, "the robot is commanded")
    return robot, run, operator
