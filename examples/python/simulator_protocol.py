"""The part of a simulator that talks to `surefoot gap diagnose --simulator`: one line of JSON in, one out.

A simulator of your own calls `serve` with its name, its knobs and a function that drives a run; the lines, and what
stands in them, are described in docs/simulator_protocol.md.
"""

import json
import sys
from collections.abc import Callable
from typing import Any

Message = dict[str, Any]
# x, y [m], yaw [rad], speed [m/s], yaw rate [rad/s], speed to the left [m/s].
Row = tuple[float, float, float, float, float, float]
# From the vehicle that hello describes and a run to every row of the run, the first being the start.
Driven = Callable[[Message, Message], list[Row]]

PROTOCOL = 1
COLUMNS = ["x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps", "side_speed_mps"]


def motion(rows: list[Row]) -> dict[str, list[float]]:
    """The columns of rows by name."""
    return {name: list(column) for name, column in zip(COLUMNS, zip(*rows))}


def serve(name: str, knobs: list[Message], driven: Driven) -> None:
    """Answers line by line until nobody asks any more. What `driven` raises ends the simulator, and is shown."""
    vehicle: Message = {}
    for line in sys.stdin:
        message = json.loads(line)
        if message["type"] == "hello":
            vehicle = message["vehicle"]
            answer = {"type": "hello", "protocol": PROTOCOL, "name": name, "stochastic": False, "knobs": knobs}
        elif message["type"] == "run":
            answer = {"type": "motion", "id": message["id"], **motion(driven(vehicle, message))}
        else:
            answer = {"type": "error", "message": f"expected a hello or a run, found {message['type']}"}
        print(json.dumps(answer), flush=True)
