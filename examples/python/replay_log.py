"""A recorded drive as if it were happening now: its poses and commands on Surefoot's channels, at their own pace.

    pip install iceoryx2==0.10.0
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
import sys
import time

import surefoot_layout as layout
from channels import Bus, Outlet, now_ns, run_name
from watchdog import BY_COMMAND, BY_VEHICLE

NEEDED = ("t", "x", "y", "yaw", "vx", "wz")
DRIVE = 1
BETWEEN_RUNS_S = 0.5
# Whoever listens needs a moment to notice a new voice.
LEAD_S = 0.5


class NoLog(Exception):
    """Why a file is no log."""


def number(row: dict, name: str, otherwise: float = math.nan) -> float:
    """A field as a number; one that is empty or absent is `otherwise`."""
    text = (row.get(name) or "").strip()
    return float(text) if text else otherwise


def rows_of(path: str, seconds_max: float):
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


def odometry(row: dict):
    """The row as odometry; None where it is not finite."""
    wheel_mps = number(row, "wheel_speed", number(row, "vx"))
    record = layout.OdometryRecord(
        position_m=(number(row, "x"), number(row, "y"), number(row, "z", 0.0)),
        attitude_rad=(number(row, "roll", 0.0), number(row, "pitch", 0.0), number(row, "yaw")),
        velocity_mps=(number(row, "vx"), number(row, "vy", 0.0)),
        yaw_rate_radps=number(row, "wz"),
        wheel_speed_mps=wheel_mps,
        steering_rad=number(row, "steer_meas", number(row, "cmd_steer", 0.0)),
    )
    values = [*record.position_m, *record.attitude_rad, *record.velocity_mps, record.yaw_rate_radps]
    values += [record.wheel_speed_mps, record.steering_rad]
    return record if all(map(math.isfinite, values)) else None


def command(row: dict, at_ns: int):
    """What was commanded, by whoever knew all of its time; None where that is not known."""
    speed_mps, steering_rad = number(row, "cmd_speed"), number(row, "cmd_steer")
    if not (math.isfinite(speed_mps) and math.isfinite(steering_rad)):
        return None
    times = {"odometry_at_ns": at_ns, "scan_at_ns": at_ns}
    return layout.CommandRecord(speed_mps=speed_mps, steering_rad=steering_rad, decision=DRIVE, reason=0, **times)


def applied(record, told, at_ns: int) -> None:
    """Says what the actuators were told: the log's command, or, of a drive without, what they did."""
    record.applied_since_ns = at_ns
    if told is None:
        record.applied_speed_mps, record.applied_steering_rad = record.wheel_speed_mps, record.steering_rad
        record.applied_by = BY_VEHICLE
    else:
        record.applied_speed_mps, record.applied_steering_rad = told.speed_mps, told.steering_rad
        record.applied_by = BY_COMMAND


def replay(path: str, run: str, speed: float, seconds_max: float) -> dict:
    """Tells the log's rows when they are due."""
    rows = rows_of(path, seconds_max)
    bus = Bus(run)
    poses, commands = Outlet(bus, "odometry"), Outlet(bus, "command")
    time.sleep(LEAD_S)
    began_ns, passed_over, since_s = now_ns(), 0, 0.0
    for since_s, row in rows:
        due_ns = began_ns + int(since_s / speed * 1e9)
        try:
            record, told = odometry(row), command(row, due_ns)
        except ValueError as error:
            raise NoLog(f"{path}, {since_s:.3f} s: expected numbers, found: {error}") from None
        while (left_ns := due_ns - now_ns()) > 0:
            time.sleep(left_ns * 1e-9)
        if record is None:
            passed_over += 1
            continue
        if told is not None:
            commands.send(due_ns, (layout.CommandRecord * 1)(told))
        applied(record, told, due_ns)
        poses.send(due_ns, (layout.OdometryRecord * 1)(record))
    return {
        "poses": poses.n_sent,
        "commands": commands.n_sent,
        "passed_over": passed_over,
        "log_s": round(since_s, 3),
        "took_s": round((now_ns() - began_ns) * 1e-9, 3),
    }


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
