"""One drive: a driver, the command path, a plant and the sensors in a loop at 50 Hz."""

import math

import numpy as np

from command_path import TICK_S, CommandPath
from driver import DRIVERS, Envelope
from ground import Ground
from sensors import measure

DRIVE_S, LEAD_S = 40.0, 3.0
DRIVE_TICKS, LEAD_TICKS = round(DRIVE_S / TICK_S), round(LEAD_S / TICK_S)
MAX_STEER_RAD = 0.6
ATTITUDE_LIMIT_RAD = 0.7
TRUTH = ["x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "wz", "cmd_speed", "cmd_steer"]


class DriveFailed(Exception):
    """The plant left the map, rolled over or lost its numbers."""


def envelope_of(vehicle, wheelbase_m: float, ground: Ground, harder: float) -> Envelope:
    """What drivers may ask of a vehicle; `harder` raises the lateral acceleration."""
    lateral = harder * vehicle.lateral_acceleration_mps2
    return Envelope(wheelbase_m, MAX_STEER_RAD, *vehicle.speeds_mps, lateral, ground.half_extent_m)


def _start(generator: np.random.Generator, ground: Ground) -> tuple[float, float, float]:
    x, y = generator.uniform(-0.3, 0.3, 2) * ground.half_extent_m
    return x, y, generator.uniform(-math.pi, math.pi)


def _checked(row: list[float], ground: Ground) -> list[float]:
    """The row, if the vehicle is upright, on the map and finite."""
    if not np.isfinite(row).all():
        raise DriveFailed("a state is not finite")
    if max(abs(row[0]), abs(row[1])) > 1.05 * ground.half_extent_m:
        raise DriveFailed(f"left the map at x = {row[0]:.1f} m, y = {row[1]:.1f} m")
    if max(abs(row[3]), abs(row[4])) > ATTITUDE_LIMIT_RAD:
        raise DriveFailed(f"rolled over: roll {row[3]:.2f} rad, pitch {row[4]:.2f} rad")
    return row


def simulate(vehicle, ground: Ground, injection: dict, style: str, seed: list[int], harder: float = 1.0) -> dict:
    """Measured columns of one drive (2000 rows). Raises `DriveFailed` where the vehicle does not survive it."""
    generator = np.random.default_rng([*seed, 1])
    plant = vehicle.build(injection, ground)
    envelope = envelope_of(vehicle, plant.wheelbase_m, ground, harder)
    driver = DRIVERS[style](envelope, generator, LEAD_S + DRIVE_S)
    path = CommandPath(injection)
    plant.place(*_start(generator, ground), driver.speeds[0])
    rows = []
    for tick in range(LEAD_TICKS + DRIVE_TICKS):
        motion, time_s = plant.motion(), (tick - LEAD_TICKS) * TICK_S
        speed, steer = driver.command(tick, (motion.x_m, motion.y_m, motion.yaw_rad), motion.vx_mps)
        velocity = [motion.vx_mps, motion.vy_mps, motion.yaw_rate_radps]
        pose = [motion.x_m, motion.y_m, *plant.attitude(), motion.yaw_rad]
        rows.append(_checked([*pose, *velocity, round(speed, 3), round(steer, 4)], ground))
        plant.advance(time_s, *path(time_s, speed, steer, motion.vx_mps))
    truth = dict(zip(TRUTH, np.array(rows).T, strict=True))
    return measure(truth, LEAD_TICKS, injection, [*seed, 2])
