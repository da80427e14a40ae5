"""What test_latency.py measures, with other listeners in the bridge's place, which are measured and not judged:
`ros/test -s ros/tests/latency_of_peers.py -k latency` prints all of it.
"""

import json
import sys

from conftest import FOLDER, Process, until
from test_latency import DURATION_S, show


def talk(start) -> dict:
    """Has everything said, and returns how much."""
    talker = start(Process, [sys.executable, str(FOLDER / "talker.py"), str(DURATION_S)])
    until(lambda: talker.has_said('{"odometry"'), DURATION_S + 30, "everything is said")
    return json.loads(talker.lines[-1])


def listen(start, kind: str) -> tuple[dict, dict]:
    listener = start(Process, [sys.executable, str(FOLDER / "listener.py"), kind, str(DURATION_S + 10)])
    said = talk(start)
    until(lambda: listener.has_said('{"odometry"'), DURATION_S + 30, "the listener is done")
    return said, json.loads(listener.lines[-1])


def test_latency_of_rclpy(start):
    show("rclpy", *listen(start, "rclpy"))


def test_latency_of_cyclone(start):
    show("cyclone", *listen(start, "cyclone"))
