"""Accelerations that act on a plant's body from outside: drag, slope, wind, trailer, and unknown ones."""

import math
from dataclasses import dataclass

from command_path import TICK_S
from ground import LOOSE, VEGETATION, Ground

GRAVITY_MPS2 = 9.81


@dataclass
class Motion:
    """Where the rear axle is and how it moves (body velocities at the rear axle)."""

    x_m: float
    y_m: float
    yaw_rad: float
    vx_mps: float
    vy_mps: float
    yaw_rate_radps: float


class TowedTrailer:
    """A one-axle trailer as the car feels it: inertia and rolling resistance along its drawbar."""

    MASS_RATIO, LENGTH_WHEELBASES, RESISTANCE_MPS2 = 0.45, 1.1, 0.35

    def __init__(self, wheelbase_m: float):
        self.length_m = self.LENGTH_WHEELBASES * wheelbase_m
        self.yaw_rad: float | None = None
        self.speed_mps = 0.0

    def pull(self, motion: Motion) -> tuple[float, float]:
        """Acceleration of the car along and across [m/s2]; the trailer is moved on by one tick."""
        if self.yaw_rad is None:
            self.yaw_rad, self.speed_mps = motion.yaw_rad, motion.vx_mps
        angle = motion.yaw_rad - self.yaw_rad
        speed = motion.vx_mps * math.cos(angle)
        acceleration = min(max((speed - self.speed_mps) / TICK_S, -4.0), 4.0)
        self.speed_mps += 0.3 * (speed - self.speed_mps)
        self.yaw_rad += TICK_S * motion.vx_mps * math.sin(angle) / self.length_m
        force = -self.MASS_RATIO * (0.3 * acceleration + math.copysign(self.RESISTANCE_MPS2, speed))
        return force * math.cos(angle), -force * math.sin(angle)


class BodyForces:
    """Sum of all outer accelerations of one drive."""

    def __init__(self, injection: dict, ground: Ground, wheelbase_m: float):
        self.injection, self.ground = injection, ground
        self.trailer = TowedTrailer(wheelbase_m) if injection.get("towed_trailer") else None

    def at(self, time_s: float, motion: Motion) -> tuple[float, float, float]:
        """Acceleration along and across the body [m/s2] and yaw acceleration [rad/s2]."""
        get = self.injection.get
        _, rise, rise_left = self.ground.body_slopes(motion.x_m, motion.y_m, motion.yaw_rad)
        along = -self._drag(motion) - get("slope", 0.0) * GRAVITY_MPS2 * math.sin(math.atan(rise))
        across = -get("cross", 0.0) * GRAVITY_MPS2 * math.sin(math.atan(rise_left))
        wind_x, wind_y = self._wind(time_s)
        cos, sin = math.cos(motion.yaw_rad), math.sin(motion.yaw_rad)
        along += wind_x * cos + wind_y * sin
        across += wind_y * cos - wind_x * sin
        if self.trailer:
            pull_along, pull_across = self.trailer.pull(motion)
            along, across = along + pull_along, across + pull_across
        return along, across, self._yaw(time_s)

    def _drag(self, motion: Motion) -> float:
        """Resistance against the direction of travel [m/s2], fading out at standstill."""
        get, speed = self.injection.get, motion.vx_mps
        terrain = self.ground.class_at(motion.x_m, motion.y_m)
        constant = get("drag_c", 0.0) + get("patch_drag", 0.0) * (terrain == VEGETATION)
        constant += get("loose_drag", 0.0) * (terrain == LOOSE)
        return constant * math.tanh(speed / 0.05) + get("drag_q", 0.0) * speed * abs(speed)

    def _wind(self, time_s: float) -> tuple[float, float]:
        """World-frame push [m/s2]; a gust comes and goes."""
        wind_x, wind_y = self.injection.get("wind", (0.0, 0.0))
        period_s = self.injection.get("gust_period")
        strength = max(0.0, math.sin(2 * math.pi * time_s / period_s)) if period_s else 1.0
        return strength * wind_x, strength * wind_y

    def _yaw(self, time_s: float) -> float:
        get = self.injection.get
        periodic = get("yaw_shake", 0.0) * math.sin(2 * math.pi * get("shake_hz", 0.0) * time_s)
        return get("yaw_moment", 0.0) + periodic
