"""A recorded drive as if it were happening now: its poses and commands on Surefoot's channels, at their own pace.

    pip install surefoot-*.whl
    surefoot up --role recorder --run log &
    python3 replay_log.py drive.csv --run log

The log is a CSV file with a header row: t [s], x, y, yaw, vx, wz, and where it has them z, roll, pitch, vy, wheel_speed,
steer_meas, cmd_speed, cmd_steer, and run, in which t begins anew. Rows without a finite pose or motion are passed over
and counted. Where cmd_speed and cmd_steer are there, commands are told too, as whoever drove told them: do not run
`--role control` beside it, of which only one would be heard.
Prints one line of JSON; ends with 0, or with 2 and one line on standard error when the file is no such log.
"""

import argparse
import csv
import json
import math
import re
import sys
import time
from collections.abc import Iterator

import surefoot

Row = dict[str, str]
# Place, attitude, velocity and yaw rate, and what the wheels do.
Triple = tuple[float, float, float]
Pose = tuple[tuple[Triple, Triple, tuple[float, float], float], dict[str, float]]
NEEDED = ("t", "x", "y", "yaw", "vx", "wz")
BETWEEN_RUNS_S = 0.5
# Whoever listens needs a moment to notice a new voice.
LEAD_S = 0.5


class NoLog(Exception):
    """Why a file is no log."""


def number(row: Row, name: str, otherwise: float = math.nan) -> float:
    """A field as a number; one that is empty or absent is `otherwise`."""
    text = (row.get(name) or "").strip()
    return float(text) if text else otherwise


def rows_of(path: str, seconds_max: float) -> Iterator[tuple[float, Row]]:
    """Yields (time since the log began [s], row) with the runs one after the other."""
    with open(path, newline="") as file:
        reader = csv.DictReader(file)
        missing = [name for name in NEEDED if name not in (reader.fieldnames or [])]
        if missing:
            raise NoLog(f"{path}, line 1: expected the columns {', '.join(NEEDED)}, found no {', '.join(missing)}")
        run, began_s, first_s, last_s = object(), 0.0, 0.0, -BETWEEN_RUNS_S
        for row in reader:
            try:
                at_s = number(row, "t")
            except ValueError:
                raise NoLog(f"{path}, line {reader.line_num}, t: expected a number, found {row['t']!r}") from None
            if not math.isfinite(at_s):
                raise NoLog(f"{path}, line {reader.line_num}, t: expected a finite number, found {at_s}")
            if row.get("run") != run:
                run, first_s, began_s = row.get("run"), at_s, last_s + BETWEEN_RUNS_S
            since_s = began_s + at_s - first_s
            if since_s < last_s:
                raise NoLog(f"{path}, line {reader.line_num}, t: expected a time not before the last, found {at_s}")
            if since_s > seconds_max:
                return
            last_s = since_s
            yield since_s, row


def pose(row: Row) -> Pose | None:
    """The row as what `publish_odometry` takes; None where it is not finite."""
    values = (
        (number(row, "x"), number(row, "y"), number(row, "z", 0.0)),
        (number(row, "roll", 0.0), number(row, "pitch", 0.0), number(row, "yaw")),
        (number(row, "vx"), number(row, "vy", 0.0)),
        number(row, "wz"),
    )
    wheels = {
        "wheel_speed_mps": number(row, "wheel_speed", number(row, "vx")),
        "steering_rad": number(row, "steer_meas", number(row, "cmd_steer", 0.0)),
    }
    numbers = [*values[0], *values[1], *values[2], values[3], *wheels.values()]
    return (values, wheels) if all(map(math.isfinite, numbers)) else None


def command(row: Row) -> tuple[float, float] | None:
    """Speed [m/s] and steering [rad] that were commanded; None where they are not known."""
    told = (number(row, "cmd_speed"), number(row, "cmd_steer"))
    return told if all(map(math.isfinite, told)) else None


def replay(path: str, run: str, speed: float, seconds_max: float) -> dict[str, float]:
    """Tells the log's rows when they are due."""
    rows = rows_of(path, seconds_max)
    driver = surefoot.Driver(run, surefoot.Vehicle("rc_car"))
    time.sleep(LEAD_S)
    began_ns, since_s = time.monotonic_ns(), 0.0
    told: dict[str, float] = {"poses": 0, "commands": 0, "passed_over": 0}
    for since_s, row in rows:
        due_ns = began_ns + int(since_s / speed * 1e9)
        try:
            place, commanded = pose(row), command(row)
        except ValueError as error:
            raise NoLog(f"{path}, {since_s:.3f} s: expected numbers, found: {error}") from None
        while (left_ns := due_ns - time.monotonic_ns()) > 0:
            time.sleep(left_ns * 1e-9)
        if place is None:
            told["passed_over"] += 1
            continue
        if commanded is not None:
            driver.publish_command(commanded[0], commanded[1], due_ns)
            told["commands"] += 1
        values, wheels = place
        # Of a drive without commands, the actuators were told what they did.
        applied = commanded or (wheels["wheel_speed_mps"], wheels["steering_rad"])
        driver.publish_odometry(
            *values,
            wheel_speed_mps=wheels["wheel_speed_mps"],
            steering_rad=wheels["steering_rad"],
            valid_at_ns=due_ns,
            applied=applied,
        )
        told["poses"] += 1
    return {**told, "log_s": round(since_s, 3), "took_s": round((time.monotonic_ns() - began_ns) * 1e-9, 3)}


def run_name(word: str) -> str:
    """A word that may name a run, as for `surefoot up --run`; argparse tells of any other."""
    if re.fullmatch("[A-Za-z0-9_-]{1,32}", word) is None:
        raise argparse.ArgumentTypeError(f"expected 1 to 32 letters, digits, - or _, found {word!r}")
    return word


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("log", help="drive log, CSV")
    parser.add_argument("--run", type=run_name, default="field", help="name of the run whose channels to use")
    parser.add_argument("--speed", type=float, default=1.0, help="how many times as fast as it happened")
    parser.add_argument("--seconds", type=float, default=math.inf, help="end after so much of the log [s]")
    asked = parser.parse_args()
    if not (math.isfinite(asked.speed) and asked.speed > 0.0):
        parser.error(f"--speed: expected a finite number > 0, found {asked.speed}")
    try:
        print(json.dumps(replay(asked.log, asked.run, asked.speed, asked.seconds)))
    except (NoLog, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
