"""Who drives the machines: eight habits, all closed over a noisy pose.

path        pure pursuit of random way points at changing speeds
setpoint    steps of speed and steering, turns home at the edge
human       pursuit with a reaction time and over-correction, slows down now and then
sweep       sine sweeps of steering, waves and steps of speed
stop_and_go pursuit with halts
slalom      swings of growing width, speed ramps
cruise      one speed, far way points (poor)
gentle      nearly one speed, slow turns (poor)
"""

import math

import numpy as np
from numba import njit

from machine_types import ALL_TICKS, TICK_S

RICH, POOR = ["path", "setpoint", "human", "sweep", "stop_and_go", "slalom"], ["cruise", "gentle"]
PURSUERS = {"path", "human", "stop_and_go", "cruise"}
WAY_POINT, HOMING, FILTERED = range(3)

HABITS = "pursues reaction_ticks gain look_s smooth_s reach_share pose_noise_m yaw_noise_rad"
HABIT = np.dtype([(name, "f8") for name in HABITS.split()])


def habit_of(name: str, noise: dict) -> np.ndarray:
    """Numbers of a habit."""
    row = np.zeros(1, HABIT)
    human = name == "human"
    row["pursues"], row["reaction_ticks"] = name in PURSUERS, 12 if human else 1
    row["gain"], row["look_s"], row["smooth_s"] = (1.5, 0.9, 0.15) if human else (1.0, 1.2, 0.04)
    row["reach_share"] = 0.6
    row["pose_noise_m"], row["yaw_noise_rad"] = noise["x"], noise["yaw"]
    return row


def _held(generator: np.random.Generator, low_s: float, high_s: float, draw) -> np.ndarray:
    """A table of levels, each held for a while."""
    levels = np.zeros(0)
    while len(levels) < ALL_TICKS:
        levels = np.concatenate([levels, np.full(int(generator.uniform(low_s, high_s) / TICK_S), draw())])
    return levels[:ALL_TICKS]


def _ramped(levels: np.ndarray, rate_per_s: float) -> np.ndarray:
    """Levels that are approached at a rate."""
    ramped = levels.copy()
    for tick in range(1, len(levels)):
        step = np.clip(levels[tick] - ramped[tick - 1], -rate_per_s * TICK_S, rate_per_s * TICK_S)
        ramped[tick] = ramped[tick - 1] + step
    return ramped


def speed_table(name: str, low: float, high: float, generator: np.random.Generator) -> np.ndarray:
    """Wanted speed of every row [m/s]."""
    draw = lambda: generator.uniform(low, high)  # noqa: E731
    time = np.arange(ALL_TICKS) * TICK_S
    middle = low + generator.uniform(0.4, 0.75) * (high - low)
    if name == "setpoint":
        return _held(generator, 2.0, 5.0, draw)
    if name == "path":
        return _ramped(_held(generator, 3.0, 7.0, draw), 0.5 * high)
    if name == "human":
        slower = _held(generator, 2.0, 5.0, lambda: 0.4 if generator.uniform() < 0.25 else 1.0)
        return _ramped(np.maximum(slower * _held(generator, 6.0, 12.0, draw), low), 0.35 * high)
    if name == "sweep":
        wave = np.sin(2 * np.pi * generator.uniform(0.08, 0.2) * time)
        return np.clip(_held(generator, 5.0, 9.0, draw) + 0.2 * (high - low) * wave, low, high)
    if name == "stop_and_go":
        going = _held(generator, 1.6, 5.0, lambda: 0.0 if generator.uniform() < 0.3 else draw())
        return _ramped(going, 0.6 * high)
    if name == "slalom":
        return _ramped(_held(generator, 4.0, 8.0, draw), 0.15 * high)
    if name == "cruise":
        return np.full(ALL_TICKS, middle)
    return middle * (1.0 + 0.05 * np.sin(0.25 * time + generator.uniform(0, 6.0)))


def steer_table(name: str, generator: np.random.Generator) -> np.ndarray:
    """Steering of every row as a share of what the speed allows."""
    time = np.arange(ALL_TICKS) * TICK_S
    signed = lambda: generator.uniform(-1.0, 1.0)  # noqa: E731
    if name == "setpoint":
        return _held(generator, 0.8, 3.5, signed)
    if name == "sweep":
        hertz = 0.15 + 0.7 * (time % 14.0) / 14.0
        return _held(generator, 3.0, 7.0, lambda: generator.uniform(0.1, 0.9)) * np.sin(
            2 * np.pi * np.cumsum(hertz) * TICK_S
        )
    if name == "slalom":
        period = generator.uniform(2.5, 4.5)
        square = np.tanh(4.0 * np.sin(2 * np.pi * time / period))
        return (0.2 + 0.7 * (time % 15.0) / 15.0) * square
    slow = sum(generator.uniform(0.05, 0.15) * np.sin(w * time + generator.uniform(0, 6.3)) for w in (0.3, 0.55, 0.9))
    return np.asarray(slow) + 0.05 * signed()


def way_points(name: str, half_m: float, radius_m: float, generator: np.random.Generator) -> np.ndarray:
    """A chain of way points that a machine can reach one after another."""
    points, here = [], np.zeros(2)
    apart = (4.0 if name == "cruise" else 2.2) * radius_m
    for _ in range(80):
        for _ in range(40):
            point = generator.uniform(-0.6, 0.6, 2) * half_m
            if 0.8 * apart < np.hypot(*(point - here)) < 2.0 * apart:
                break
        points.append(point)
        here = point
    return np.array(points)


@njit(cache=True)
def steer_limit(machine, speed, lateral_mps2):
    """Largest steering that a driver dares at a speed [rad]."""
    length = machine.front_m + machine.rear_m
    return min(0.9 * machine.max_steer_rad, math.atan(lateral_mps2 * length / max(speed, 0.1) ** 2))


@njit(cache=True)
def _wrap(angle):
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@njit(cache=True)
def _homing(memory, x, y, yaw, speed, half_m, radius_m):
    """Direction of the turn home, 0 where there is none."""
    nose = max(abs(x + 0.8 * speed * math.cos(yaw)), abs(y + 0.8 * speed * math.sin(yaw)))
    error = _wrap(math.atan2(-y, -x) - yaw)
    if memory[HOMING] != 0.0 and abs(error) < 0.5:
        memory[HOMING] = 0.0
    elif memory[HOMING] == 0.0 and nose > 0.9 * half_m - 1.8 * radius_m and abs(error) > 1.2:
        memory[HOMING] = math.copysign(1.0, error)
    return memory[HOMING]


@njit(cache=True)
def _pursuit(machine, habit, memory, points, x, y, yaw, speed, radius_m):
    """Steering towards the way point [rad]."""
    at = int(memory[WAY_POINT]) % len(points)
    away = math.hypot(points[at, 0] - x, points[at, 1] - y)
    if away < habit.reach_share * radius_m + 0.3 * speed:
        memory[WAY_POINT] += 1.0
    error = _wrap(math.atan2(points[at, 1] - y, points[at, 0] - x) - yaw)
    ahead = max(habit.look_s * speed, 1.5 * (machine.front_m + machine.rear_m))
    bend = 2.0 * math.sin(min(max(error, -1.57), 1.57)) / ahead
    return habit.gain * math.atan(bend * (machine.front_m + machine.rear_m))


@njit(cache=True)
def drive_command(machine, habit, memory, log, tick, speeds, steers, points, noise, half_m, radius_m, lateral):
    """Speed and steering command of a row from what the driver sees."""
    seen = max(tick - int(habit.reaction_ticks), 0)
    x = log[seen, 0] + habit.pose_noise_m * noise[tick, 0]
    y = log[seen, 1] + habit.pose_noise_m * noise[tick, 1]
    yaw = log[seen, 5] + habit.yaw_noise_rad * noise[tick, 2]
    moving = abs(log[seen, 6])
    speed = speeds[tick]
    limit = steer_limit(machine, max(speed, moving), lateral)
    turn = _homing(memory, x, y, yaw, moving, half_m, radius_m)
    if turn != 0.0:
        steer = turn * limit
    elif habit.pursues > 0.5:
        steer = _pursuit(machine, habit, memory, points, x, y, yaw, moving, radius_m)
    else:
        steer = steers[tick] * limit
    memory[FILTERED] += min(TICK_S / max(habit.smooth_s, TICK_S), 1.0) * (steer - memory[FILTERED])
    return round(speed, 3), round(min(max(memory[FILTERED], -limit), limit), 4)
