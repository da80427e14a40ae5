"""Records drives of the example's car: the simulator's own, and those of a robot that differs by what is stated.

    python3 record.py FOLDER '{"knobs": {"tyre_friction": 0.6}, "effects": {"steer_delay": 0.2}}' real_1 real_2 heldout

What is added on commands and sensors is written here once more, by its plain meaning, so that nothing is shared with
whoever has to find it. A name is a seed: the same name drives the same commands with the same noise.
"""

import csv
import json
import math
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "examples" / "python"))
from double_track_simulator import KNOBS, driven  # noqa: E402

VEHICLE = {"name": "car", "wheelbase_m": 2.6, "steering_max_rad": 0.5, "speed_max_mps": 10.0}
STEP_S = 0.02
DURATION_S = 34.0
# What is cut off, so that actuators have a past.
BEFORE_S = 2.0
NOISE = {"x": 0.02, "y": 0.02, "yaw": 0.002, "vx": 0.03, "vy": 0.03, "wz": 0.004}


def commands(draw):
    """Steps of the speed, steps and sines of the steering that ask for up to 5.5 m/s2."""
    n = round(DURATION_S / STEP_S)
    speeds, angles, speed, hold, turn, kind = [], [], 4.0, 0, 0, 0
    size, rate = 0.0, 1.0
    for row in range(n):
        if hold == 0:
            speed, hold = draw.uniform(2.0, 9.0), draw.randrange(120, 300)
        if turn == 0:
            turn, kind = draw.randrange(60, 160), draw.randrange(3)
            size, rate = draw.uniform(-5.5, 5.5), draw.uniform(1.5, 4.5)
        wave = 1.0 if kind == 0 else math.sin(rate * row * STEP_S) if kind == 1 else 0.15
        most = math.atan(2.6 * abs(size) / max(speed, 3.0) ** 2)
        speeds.append(speed)
        angles.append(max(-0.45, min(0.45, math.copysign(most, size) * wave)))
        hold, turn = hold - 1, turn - 1
    return speeds, angles


def late(values, delay_s):
    rows = round(delay_s / STEP_S)
    return [values[max(0, row - rows)] for row in range(len(values))]


def lagged(values, time_constant_s):
    reached, out = values[0], []
    for value in values:
        reached += (value - reached) * (1.0 - math.exp(-STEP_S / time_constant_s))
        out.append(reached)
    return out


def ramped(values, per_s):
    reached, out = values[0], []
    for value in values:
        reached += max(-per_s * STEP_S, min(per_s * STEP_S, value - reached))
        out.append(reached)
    return out


def with_play(values, half):
    reached, out = values[0], []
    for value in values:
        reached = max(value - half, min(value + half, reached))
        out.append(reached)
    return out


def wrapped(speeds, angles, effects):
    """Commands as they arrive."""
    on_speed = {
        "speed_delay": late,
        "speed_lag": lagged,
        "accel_limit": ramped,
        "speed_scale": lambda values, ratio: [value * ratio for value in values],
        "motor_deadband": lambda values, least: [value if abs(value) >= least else 0.0 for value in values],
    }
    on_angle = {
        "steer_delay": late,
        "steer_lag": lagged,
        "steer_rate": ramped,
        "backlash": with_play,
        "steer_gain": lambda values, ratio: [value * ratio for value in values],
        "steer_bias": lambda values, bias: [value + bias for value in values],
    }
    for name, value in effects.items():
        speeds = on_speed[name](speeds, value) if name in on_speed else speeds
        angles = on_angle[name](angles, value) if name in on_angle else angles
    return speeds, angles


def sensed(rows, effects, draw):
    """What is measured of the motion."""
    aged = late(rows, effects.get("pose_latency", 0.0))
    for (x, y, yaw, *_), (_, _, _, vx, wz, vy) in zip(aged, rows):
        true = {
            "x": x,
            "y": y,
            "yaw": yaw + effects.get("yaw_misalign", 0.0),
            "vx": vx * effects.get("odom_scale", 1.0),
            "vy": vy,
            "wz": wz + effects.get("gyro_bias", 0.0),
        }
        yield {name: value + draw.gauss(0.0, NOISE[name]) for name, value in true.items()}


def record(path, knobs, effects, seed):
    draw = random.Random(seed)
    speeds, angles = commands(draw)
    given = wrapped(speeds, angles, effects)
    level = [0.0] * len(speeds)
    run = {
        "start": {"x_m": 0.0, "y_m": 0.0, "yaw_rad": 0.3, "speed_mps": speeds[0], "yaw_rate_radps": 0.0},
        "step_s": STEP_S,
        "command_speed_mps": given[0],
        "command_steering_rad": given[1],
        "slope_ahead": level,
        "slope_left": level,
        "knobs": {knob["name"]: knob["default"] for knob in KNOBS} | knobs,
    }
    measured = list(sensed(driven(VEHICLE, run), effects, draw))
    first = round(BEFORE_S / STEP_S)
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, ["t", "x", "y", "yaw", "vx", "vy", "wz", "cmd_speed", "cmd_steer"])
        writer.writeheader()
        for row in range(first, len(speeds)):
            at = {"t": f"{(row - first) * STEP_S:.3f}", "cmd_speed": speeds[row], "cmd_steer": angles[row]}
            writer.writerow(at | {name: f"{value:.6f}" for name, value in measured[row].items()})


def main():
    folder, added, names = Path(sys.argv[1]), json.loads(sys.argv[2]), sys.argv[3:]
    for name in names:
        record(folder / f"{name}.csv", added.get("knobs", {}), added.get("effects", {}), name)


if __name__ == "__main__":
    main()
