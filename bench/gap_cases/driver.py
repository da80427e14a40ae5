"""Who drives: an exciting driver (rich), a dull one (poor) and a follower of waypoints (track)."""

import math
from dataclasses import dataclass

import numpy as np

STEER_SHARE = 0.7
TICK_S = 0.02


@dataclass(frozen=True)
class Envelope:
    """What a driver may ask for: speeds, lateral acceleration, steering, and the half width of the field."""

    wheelbase_m: float
    max_steer_rad: float
    min_speed_mps: float
    max_speed_mps: float
    lateral_acceleration_mps2: float
    half_extent_m: float

    def steer_limit(self, speed_mps: float) -> float:
        """Largest steering at a speed [rad]."""
        grip = math.atan(self.lateral_acceleration_mps2 * self.wheelbase_m / max(speed_mps, 0.1) ** 2)
        return min(STEER_SHARE * self.max_steer_rad, grip)

    def turning_radius(self) -> float:
        """Radius of the tightest turn at full speed [m]."""
        return self.wheelbase_m / math.tan(self.steer_limit(self.max_speed_mps))


def wrap(angle_rad: float) -> float:
    """Angle in [-pi, pi)."""
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi


def _speed_steps(envelope: Envelope, generator: np.random.Generator, length_s: float) -> np.ndarray:
    """Speed command of every tick: held for 2 to 5 s, then another one [m/s]."""
    speeds = []
    while len(speeds) * TICK_S < length_s:
        ticks = int(generator.uniform(2.0, 5.0) / TICK_S)
        speeds += [generator.uniform(envelope.min_speed_mps, envelope.max_speed_mps)] * ticks
    return np.array(speeds)


def _segment(generator: np.random.Generator, limit: float) -> np.ndarray:
    """One piece of rich steering: hold, ramp, sine or stairs."""
    kind = generator.choice(["hold", "ramp", "sine", "stairs"], p=[0.3, 0.2, 0.3, 0.2])
    time = np.arange(0.0, generator.uniform(1.0, 4.0), TICK_S)
    if kind == "hold":
        return np.full(len(time), generator.uniform(-limit, limit))
    if kind == "ramp":
        return np.linspace(generator.uniform(-limit, limit), generator.uniform(-limit, limit), len(time))
    if kind == "stairs":
        levels = np.sort(generator.uniform(-limit, limit, 3))[:: generator.choice([-1, 1])]
        return np.repeat(levels, -(-len(time) // 3))
    amplitude, hertz = generator.uniform(0.05, 1.0) * limit, generator.uniform(0.25, 1.0)
    return amplitude * np.sin(2 * math.pi * hertz * time)


class _Homing:
    """Turns back to the middle of the field before the edge is reached."""

    def __init__(self, envelope: Envelope):
        self.envelope = envelope
        self.turning = 0.0

    def override(self, pose: tuple[float, float, float], speed_mps: float) -> float | None:
        """Steering direction (+1 or -1) while turning back."""
        x, y, yaw = pose
        ahead = 0.8 * speed_mps
        nose = max(abs(x + ahead * math.cos(yaw)), abs(y + ahead * math.sin(yaw)))
        error = wrap(math.atan2(-y, -x) - yaw)
        reach = 0.95 * self.envelope.half_extent_m - 1.6 * self.envelope.turning_radius()
        if self.turning and abs(error) < 0.4:
            self.turning = 0.0
        elif not self.turning and nose > reach and abs(error) > 1.2:
            self.turning = math.copysign(1.0, error)
        return self.turning or None


class OpenLoopDriver:
    """Plays prepared commands and comes home at the edge."""

    def __init__(self, envelope: Envelope, speeds: np.ndarray, steers: np.ndarray):
        self.envelope, self.speeds, self.steers = envelope, speeds, steers
        self.homing = _Homing(envelope)

    def command(self, tick: int, pose: tuple[float, float, float], moving_mps: float) -> tuple[float, float]:
        """Speed [m/s] and steering [rad] for a tick at a pose (x, y, yaw), moving at some speed."""
        speed = self.speeds[min(tick, len(self.speeds) - 1)]
        limit = self.envelope.steer_limit(max(speed, moving_mps))
        direction = self.homing.override(pose, speed)
        if direction is not None:
            return speed, direction * limit
        return speed, min(max(self.steers[min(tick, len(self.steers) - 1)], -limit), limit)


class TrackDriver:
    """Steers in proportion to the bearing error of the next waypoint."""

    BEARING_GAIN = 0.4

    def __init__(self, envelope: Envelope, speeds: np.ndarray, generator: np.random.Generator):
        self.envelope, self.speeds, self.generator = envelope, speeds, generator
        self.waypoint = (0.0, 0.0)

    def _next_waypoint(self, x: float, y: float) -> None:
        half = 0.65 * self.envelope.half_extent_m
        far = 4.0 * self.envelope.turning_radius()
        for _ in range(100):
            self.waypoint = tuple(self.generator.uniform(-half, half, 2))
            if math.dist(self.waypoint, (x, y)) > min(far, half):
                return

    def command(self, tick: int, pose: tuple[float, float, float], moving_mps: float) -> tuple[float, float]:
        """Speed [m/s] and steering [rad] for a tick at a pose (x, y, yaw), moving at some speed."""
        x, y, yaw = pose
        if math.dist(self.waypoint, (x, y)) < 1.2 * self.envelope.turning_radius():
            self._next_waypoint(x, y)
        speed = self.speeds[min(tick, len(self.speeds) - 1)]
        limit = self.envelope.steer_limit(max(speed, moving_mps))
        bearing = math.atan2(self.waypoint[1] - y, self.waypoint[0] - x)
        return speed, min(max(self.BEARING_GAIN * wrap(bearing - yaw), -limit), limit)


def rich_driver(envelope: Envelope, generator: np.random.Generator, length_s: float) -> OpenLoopDriver:
    """Speed steps and pieces of steering of every kind."""
    speeds = _speed_steps(envelope, generator, length_s)
    steers = np.zeros(0)
    while len(steers) < len(speeds):
        limit = envelope.steer_limit(speeds[len(steers)])
        steers = np.concatenate([steers, _segment(generator, limit)])
    return OpenLoopDriver(envelope, speeds, steers)


def poor_driver(envelope: Envelope, generator: np.random.Generator, length_s: float) -> OpenLoopDriver:
    """One speed, slow and small steering."""
    speed = envelope.min_speed_mps + 0.6 * (envelope.max_speed_mps - envelope.min_speed_mps)
    knots_s = np.cumsum(generator.uniform(3.0, 6.0, int(length_s)))
    levels = generator.uniform(-0.25, 0.25, len(knots_s)) * envelope.steer_limit(speed)
    steers = np.interp(np.arange(0.0, length_s, TICK_S), knots_s, levels)
    return OpenLoopDriver(envelope, np.full(len(steers), speed), steers)


def track_driver(envelope: Envelope, generator: np.random.Generator, length_s: float) -> TrackDriver:
    """Speed steps along random waypoints."""
    return TrackDriver(envelope, _speed_steps(envelope, generator, length_s), generator)


DRIVERS = {"rich": rich_driver, "poor": poor_driver, "track": track_driver}
