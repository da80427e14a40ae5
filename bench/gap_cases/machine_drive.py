"""One drive of a machine, and how visible something added to it is."""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from machine_body import advance
from machine_drivers import drive_command, habit_of, speed_table, steer_table, way_points
from machine_types import ALL_TICKS, LEAD_TICKS, STATE, TICK_S, added

HORIZON_TICKS = np.array([15, 30, 60, 100])
WINDOW_TICKS = 100
CHANNELS = ["along", "across", "yaw", "vx", "wz"]


@njit(cache=True)
def _write(machine, state, row):
    """Motion at the rear axle: x y z roll pitch yaw vx vy wz."""
    row[0] = state.x_m - machine.rear_m * math.cos(state.yaw_rad)
    row[1] = state.y_m - machine.rear_m * math.sin(state.yaw_rad)
    row[2], row[3] = state.height_m, state.roll_ground_rad + state.roll_rad
    row[4] = state.pitch_rad + state.squat_rad
    row[5], row[6] = state.yaw_rad, state.vx_mps
    row[7], row[8] = state.vy_mps - machine.rear_m * state.wz_radps, state.wz_radps


@njit(cache=True)
def _run(machines, more, states, snaps, habits, speeds, steers, points, noise, tables, place, log, commands):
    """The whole drive; a copy of the state is kept at the start of each window."""
    machine, extra, state, habit = machines[0], more[0], states[0], habits[0]
    ground, classes, half_m, resolution_m, radius_m, lateral = place
    memory = np.zeros(4)
    for tick in range(len(log)):
        _write(machine, state, log[tick])
        if not (abs(log[tick, 0]) < 1e6 and abs(log[tick, 8]) < 1e3):
            return
        if tick >= LEAD_TICKS and (tick - LEAD_TICKS) % WINDOW_TICKS == 0:
            snaps[(tick - LEAD_TICKS) // WINDOW_TICKS] = states[0]
        speed, steer = drive_command(
            machine, habit, memory, log, tick, speeds, steers, points, noise, half_m, radius_m, lateral
        )
        commands[tick, 0], commands[tick, 1] = speed, steer
        advance(machine, extra, state, commands, tables, tick, ground, classes, half_m, resolution_m)


@njit(cache=True)
def _restart(machines, more, snaps, tables, place, commands, log):
    """The same commands from the kept states of the windows, here with nothing added."""
    machine, extra = machines[0], more[0]
    ground, classes, half_m, resolution_m, _, _ = place
    for window in range(len(snaps)):
        for late in range(WINDOW_TICKS):
            tick = LEAD_TICKS + window * WINDOW_TICKS + late
            _write(machine, snaps[window], log[window, late])
            advance(machine, extra, snaps[window], commands, tables, tick, ground, classes, half_m, resolution_m)
        _write(machine, snaps[window], log[window, WINDOW_TICKS])


@dataclass
class Truth:
    """A drive without sensors: motion and commands of every row, and the states at the starts of windows."""

    log: np.ndarray
    commands: np.ndarray
    snaps: np.ndarray
    tables: np.ndarray


def _disturbance_tables(generator: np.random.Generator) -> np.ndarray:
    """Jitter of two delays, holds of a broken link, gusts and patches of growth, per row."""
    tables = np.zeros((ALL_TICKS, 5))
    tables[:, :2] = generator.uniform(-0.2, 0.2, (ALL_TICKS, 2))
    holds = []
    while len(holds) < ALL_TICKS:
        holds += [generator.uniform()] * int(generator.uniform(0.2, 0.6) / TICK_S)
    tables[:, 2] = holds[:ALL_TICKS]
    for column, time_s in ((3, 1.5), (4, 0.6)):
        level, kicks, share = 0.0, generator.standard_normal(ALL_TICKS), TICK_S / time_s
        for tick in range(ALL_TICKS):
            level += -share * level + math.sqrt(2 * share) * kicks[tick]
            tables[tick, column] = level
    return tables


def _start(vehicle, generator: np.random.Generator, speed_mps: float) -> np.ndarray:
    """A rolling machine in the middle part of the map."""
    state = np.zeros(1, STATE)
    state["x_m"], state["y_m"] = generator.uniform(-0.25, 0.25, 2) * vehicle.ground.half_extent_m
    state["yaw_rad"] = generator.uniform(-math.pi, math.pi)
    speed = max(speed_mps, 0.0)
    for name in ("vx_mps", "speed_lag1_mps", "speed_lag2_mps", "held_speed_mps"):
        state[name] = speed
    state["omega"] = speed / vehicle.machine["radius_m"][0]
    state["load"] = 0.25 * vehicle.machine["mass_kg"][0] * 9.81
    if vehicle.machine["drive_kind"][0] in (3, 11):
        state["memory"][0, 0] = speed / vehicle.machine["max_speed_mps"][0]
    elif vehicle.machine["drive_kind"][0] in (2, 8):
        state["memory"][0, 2] = speed
    return state


def run(vehicle, habit: str, more: np.ndarray, seed: list[int], harder: float = 1.0) -> Truth:
    """A drive of a vehicle with something added."""
    generator = np.random.default_rng([*seed, 1])
    machine = vehicle.machine[0]
    speeds = speed_table(habit, machine["min_speed_mps"], machine["max_speed_mps"], generator)
    steers = steer_table(habit, generator)
    points = way_points(habit, vehicle.ground.half_extent_m, vehicle.radius_m, generator)
    noise = generator.standard_normal((ALL_TICKS, 3))
    tables = _disturbance_tables(generator)
    states = _start(vehicle, generator, speeds[0])
    log, commands = np.full((ALL_TICKS, 9), np.nan), np.zeros((ALL_TICKS, 2))
    snaps = np.zeros(20, STATE)
    habits = habit_of(habit, vehicle.noise)
    place = vehicle.place(harder)
    _run(vehicle.machine, more, states, snaps, habits, speeds, steers, points, noise, tables, place, log, commands)
    return Truth(log, commands, snaps, tables)


def failure(vehicle, truth: Truth, may_slide: bool) -> str | None:
    """Why a drive is of no use, if it is not."""
    log = truth.log
    if not np.isfinite(log).all():
        return "a state is not finite"
    if np.abs(log[:, :2]).max() > 0.99 * vehicle.ground.half_extent_m:
        return "left the map"
    if np.abs(log[:, 3:5]).max() > 0.6:
        return "tilted"
    moving = log[:, 6] > 0.5 * vehicle.machine["min_speed_mps"][0]
    if moving.mean() < 0.25:
        return "stands"
    if log[:, 6].min() < -0.15 * vehicle.machine["max_speed_mps"][0]:
        return "rolled back"
    fast = log[:, 6] > 0.25 * vehicle.machine["max_speed_mps"][0]
    slide = np.abs(np.arctan2(log[fast, 7], log[fast, 6]))
    return "spun" if slide.max(initial=0.0) > (1.2 if may_slide else 0.5) else None


def _measured(log: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Noise-free measurements of a whole drive."""
    seen, effect = log.copy(), more[0]
    rows = np.arange(len(log))
    late = rows - effect["pose_latency_s"] / TICK_S - effect["clock_drift"] * np.maximum(rows - LEAD_TICKS, 0)
    for column in range(6):
        seen[:, column] = np.interp(late, rows, log[:, column])
    seen[:, 5] += effect["yaw_misalign_rad"]
    seen[:, 6:8] *= effect["odom_scale"]
    seen[:, 8] += effect["gyro_bias_radps"] * (1.0 + 0.1 * np.sin(0.3 * rows * TICK_S))
    jump = effect["gps_jump_m"]
    if jump > 0.0:
        seconds = (rows - LEAD_TICKS) * TICK_S
        aside = (seconds % 7.3 > 4.6).astype(float)
        seen[:, 0] += jump * aside * np.cos(seconds // 7.3 * 2.4)
        seen[:, 1] += jump * aside * np.sin(seconds // 7.3 * 2.4)
    return seen


def measured(truth: Truth, more: np.ndarray) -> np.ndarray:
    """Noise-free measurements with the sensor effects."""
    return _measured(truth.log, more)


def _motion(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Along, across, yaw, vx, wz from start rows to end rows."""
    east, north = end[:, 0] - start[:, 0], end[:, 1] - start[:, 1]
    cos, sin = np.cos(start[:, 5]), np.sin(start[:, 5])
    turned = end[:, 5] - start[:, 5]
    return np.column_stack([east * cos + north * sin, north * cos - east * sin, turned, end[:, 6], end[:, 8]])


def visibility(vehicle, truth: Truth, more: np.ndarray) -> tuple[float, str]:
    """Largest gap to the plant with nothing added, in floors of the measurement noise, and where it is."""
    nominal = np.zeros((20, WINDOW_TICKS + 1, 9))
    snaps = truth.snaps.copy()
    _restart(vehicle.machine, added({}), snaps, truth.tables, vehicle.place(1.0), truth.commands, nominal)
    seen = _measured(truth.log, more)
    starts = LEAD_TICKS + WINDOW_TICKS * np.arange(20)
    noise, best, where = vehicle.noise, 0.0, "-"
    for ticks in HORIZON_TICKS:
        ends = np.minimum(starts + ticks, ALL_TICKS - 1)
        ends_nominal = nominal[np.arange(20), ends - starts]
        gap = _motion(seen[starts], seen[ends]) - _motion(nominal[:, 0], ends_nominal)
        way = np.sqrt(np.mean((truth.log[ends, :2] - truth.log[starts, :2]) ** 2) * 2)
        floor = np.sqrt(2.0) * np.array([noise["x"], noise["x"], noise["yaw"], noise["vx"], noise["wz"]])
        seconds = ticks * TICK_S
        floor[0] = math.hypot(floor[0], seconds * noise["vx"])
        floor[1] = math.hypot(floor[1], noise["yaw"] * way + 0.5 * seconds * noise["vy"])
        floor[2] = math.hypot(floor[2], 0.5 * seconds * noise["wz"])
        ratios = np.sqrt(np.mean(gap**2, axis=0)) / floor
        if ratios.max() > best:
            best, where = float(ratios.max()), f"{CHANNELS[ratios.argmax()]} {seconds:g} s"
    return best, where
