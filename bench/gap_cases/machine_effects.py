"""What can be added to a machine, from hardly to heavily, and the search for a strength that is as visible as asked.

Each effect has a weakest and a strongest value; a strength in 0..1 runs between them in equal ratios.
"""

import math
from dataclasses import dataclass
from collections.abc import Callable

import numpy as np

from machine_drive import failure, run, visibility
from machine_types import added

VISIBILITY = {"s": 1.3, "m": 3.0, "l": 7.5}
SEARCH_STEPS = 9
ENOUGH, TOO_MUCH = 0.75, 1.6


@dataclass(frozen=True)
class Addition:
    """An effect: its group, its range for a vehicle, the numbers it adds, and how it was made."""

    group: str
    bounds: Callable
    make: Callable
    parameter: str
    how: str
    expressible: bool = True
    nearest: tuple[str, ...] = ()


@dataclass(frozen=True)
class Turn:
    """The random choices of an injection: a sign, a direction and a route."""

    sign: float
    angle_rad: float
    first_route: bool


def _fixed(low: float, high: float) -> Callable:
    return lambda vehicle: (low, high)


def _speedy(low: float, high: float, power: int = 1) -> Callable:
    return lambda vehicle: tuple(bound * vehicle.number("max_speed_mps") ** power for bound in (low, high))


def _part(name: str, low: float, high: float) -> Callable:
    return lambda vehicle: (low * vehicle.number(name), high * vehicle.number(name))


def _plain(field: str) -> Callable:
    return lambda value, turn, vehicle: {field: value}


def _signed(field: str) -> Callable:
    return lambda value, turn, vehicle: {field: turn.sign * value}


def _ratio(field: str) -> Callable:
    return lambda value, turn, vehicle: {field: 1.0 + turn.sign * value}


def _understeer(value: float, turn: Turn, vehicle) -> dict:
    """K by softer front tyres or by a linkage that twists under the front axle's side force."""
    length, grip = vehicle.length_m, vehicle.number("stiff_lat") * 9.81
    if turn.first_route and vehicle.kind.articulated == 0:
        return {"compliance_radps2pm": value * length**2 / vehicle.number("rear_m")}
    return {"front_stiffness": 1.0 / (1.0 + value * grip * length)}


def _wind(value: float, turn: Turn, vehicle) -> dict:
    return {"wind_x_mps2": value * math.cos(turn.angle_rad), "wind_y_mps2": value * math.sin(turn.angle_rad)}


def _shimmy(value: float, turn: Turn, vehicle) -> dict:
    return {"shimmy_radps2": value, "shimmy_hz": 1.0 + 0.3 * turn.sign}


CATALOGUE = {
    "steer_lag": Addition("steer", _fixed(0.01, 1.2), _plain("steer_lag_s"), "time_constant_s", "servo slower"),
    "steer_rate": Addition(
        "steer", _part("steer_rate_radps", 0.9, 0.04), _plain("steer_rate_radps"), "rate_radps", "servo slew limit"
    ),
    "steer_delay": Addition(
        "steer", _fixed(0.01, 0.7), _plain("steer_delay_s"), "delay_s", "messages late, 20 % jitter, in order"
    ),
    "steer_bias": Addition("steer", _fixed(0.002, 0.2), _signed("steer_bias_rad"), "bias_rad", "front axle turned"),
    "steer_gain": Addition(
        "steer", _fixed(0.01, 0.5), _ratio("steer_gain"), "ratio", "linkage ratio, a quarter less at full lock"
    ),
    "understeer": Addition(
        "steer", _speedy(0.02, 3.0, -2), _understeer, "k_s2pm2", "softer front tyres or twisting linkage"
    ),
    "friction": Addition(
        "tyre",
        _fixed(0.05, 0.75),
        lambda value, turn, vehicle: {"friction": 1.0 - value},
        "factor",
        "friction of tyres",
    ),
    "backlash": Addition("steer", _fixed(0.002, 0.15), _plain("backlash_rad"), "half_width_rad", "play, self-centring"),
    "speed_lag": Addition("speed", _fixed(0.02, 2.5), _plain("speed_lag_s"), "time_constant_s", "two lags, half each"),
    "speed_delay": Addition(
        "speed", _fixed(0.01, 1.2), _plain("speed_delay_s"), "delay_s", "messages late, 20 % jitter, in order"
    ),
    "accel_limit": Addition(
        "speed", _part("accel_max_mps2", 1.0, 0.12), _plain("accel_limit_mps2"), "limit_mps2",
        "drive and brakes limited, falls by a fifth with speed",
    ),
    "speed_scale": Addition("speed", _fixed(0.004, 0.3), _ratio("radius"), "ratio", "radius of the wheels"),
    "motor_deadband": Addition(
        "speed", _part("max_speed_mps", 0.1, 0.85), _plain("deadband_mps"), "threshold_mps", "zero below, hysteresis"
    ),
    "rolling_drag": Addition("force", _fixed(0.02, 2.5), _plain("rolling_drag_mps2"), "drag_mps2", "Coulomb drag"),
    "quad_drag": Addition("force", _speedy(0.02, 3.0, -2), _plain("quad_drag_pm"), "drag_pm", "aerodynamic area"),
    "veg_drag": Addition("force", _fixed(0.03, 3.5), _plain("veg_drag_mps2"), "drag_mps2", "patchy growth"),
    "slope_gravity": Addition(
        "force", _fixed(0.04, 1.6), _plain("slope_extra"), "extra", "hill compensation lost or reversed, else gravity"
    ),
    "cross_slope": Addition("force", _fixed(0.05, 2.5), _plain("cross_extra"), "extra", "down-slope force on the body"),
    "wind": Addition("force", _fixed(0.03, 2.2), _wind, "strength_mps2", "gusts, stronger from the side"),
    "mass": Addition(
        "force", _fixed(0.02, 1.5), lambda value, turn, vehicle: {"mass": 1.0 + value}, "added_ratio", "mass, inertia"
    ),
    "pose_latency": Addition("sensor", _fixed(0.004, 0.6), _plain("pose_latency_s"), "latency_s", "pose late, jitter"),
    "odom_scale": Addition("sensor", _fixed(0.003, 0.3), _ratio("odom_scale"), "ratio", "measured velocity scaled"),
    "gyro_bias": Addition("sensor", _fixed(0.001, 0.5), _signed("gyro_bias_radps"), "bias_radps", "10 % wander"),
    "yaw_misalign": Addition("sensor", _fixed(0.002, 0.4), _signed("yaw_misalign_rad"), "angle_rad", "pose yaw turned"),
}  # fmt: skip


def _unknown(bounds, make, how: str, nearest: tuple[str, ...] = (), expressible: bool = False) -> Addition:
    return Addition("unknown", bounds, make, "size", how, expressible, nearest)


UNKNOWN = {
    "unk_dropout": _unknown(_fixed(0.02, 0.7), _plain("dropout_share"), "both commands held 0.2 to 0.6 s at random"),
    "unk_asym": _unknown(_fixed(0.02, 0.6), _plain("asymmetry"), "steers less to the left", ("steer_gain",)),
    "unk_wobble": _unknown(_fixed(0.003, 0.15), _plain("wobble_rad"), "steering moves once per wheel turn"),
    "unk_shimmy": _unknown(_fixed(0.03, 12.0), _shimmy, "periodic yaw moment"),
    "unk_sag": _unknown(_fixed(0.0003, 0.015), _plain("sag_per_s"), "speed sags with time", ("speed_scale",)),
    "unk_mufade": _unknown(_fixed(0.1, 0.75), _plain("fade"), "friction falls in mid-drive", ("friction",)),
    "unk_payload": _unknown(_fixed(0.04, 1.2), _plain("payload"), "load and its drag run out", ("mass",)),
    "unk_gps": _unknown(_fixed(0.01, 1.5), _plain("gps_jump_m"), "the position jumps aside for a while"),
    "unk_clock": _unknown(_fixed(0.0004, 0.05), _plain("clock_drift"), "the pose's clock drifts", ("pose_latency",)),
    "unk_corner": _unknown(
        _fixed(0.05, 0.85), _plain("weak_corner"), "soft, dragging front-left tyre", ("steer_bias",)
    ),
    "unk_trailer": _unknown(
        _fixed(0.04, 0.9), _plain("trailer"), "trailer that pulls at the hitch", ("mass", "rolling_drag"), True
    ),
    "unk_heat": _unknown(_fixed(0.05, 8.0), _plain("heat"), "brakes drag with use", ("rolling_drag",)),
    "unk_quant": _unknown(_fixed(0.01, 0.3), _plain("quantum_rad"), "coarse steps of steering", ("backlash",)),
    "unk_vratio": _unknown(
        _speedy(0.02, 2.0, -2), _plain("ratio_fall_s2pm2"), "steering ratio falls with speed", ("understeer",), True
    ),
    "unk_loose": _unknown(_fixed(0.03, 3.0), _plain("loose_drag_mps2"), "drag on the loose class", ("veg_drag",)),
    "unk_crab": _unknown(
        _fixed(0.003, 0.15), _signed("crab_rad"), "rear axle askew", ("steer_bias", "yaw_misalign"), True
    ),
    "unk_locked": _unknown(_fixed(1.0, 100.0), _plain("locked_ps"), "rear differential drags", ("understeer",)),
    "unk_sticky": _unknown(_speedy(0.02, 0.5), _plain("sticky_mps"), "small changes of speed are ignored"),
    "unk_limp": _unknown(_fixed(0.02, 0.7), _plain("limp"), "speed is cut for a while, again and again"),
}


def value_at(addition: Addition, strength: float, vehicle) -> float:
    """The value between weakest and strongest."""
    low, high = addition.bounds(vehicle)
    return float(f"{low * (high / low) ** strength:.4g}")


def applicable(name: str, vehicle) -> bool:
    """Whether an effect can show at all: slopes need hills, axles that are locked cannot be locked."""
    if name in ("slope_gravity", "cross_slope"):
        return vehicle.kind.hills > 0.0
    return name != "unk_locked" or (vehicle.number("diff_lock_ps") < 20.0 and vehicle.kind.name != "hub_rover")


def find_strength(addition: Addition, target: float, vehicle, turn: Turn, habit: str, seed: list[int]):
    """The value that is nearest to a visibility on one drive, and that visibility; None where it is not reached."""
    low, high, best = 0.0, 1.0, None
    slides = addition.parameter == "factor" or addition is UNKNOWN["unk_mufade"]
    strength = 0.5
    for _ in range(SEARCH_STEPS):
        value = value_at(addition, strength, vehicle)
        more = added(addition.make(value, turn, vehicle))
        truth = run(vehicle, habit, more, seed)
        broken = failure(vehicle, truth, slides) is not None
        seen = math.inf if broken else visibility(vehicle, truth, more)[0]
        off = abs(math.log(max(seen, 1e-6) / target)) if not broken else math.inf
        if not broken and (best is None or off < best[0]):
            best = (off, value, seen)
        if off < 0.04:
            break
        low, high = (low, strength) if seen > target else (strength, high)
        strength = 0.5 * (low + high)
    too_much = math.inf if addition.parameter == "threshold_mps" else TOO_MUCH
    if best is None or not ENOUGH < best[2] / target < too_much:
        return None
    return best[1], best[2]


def size_of(seen: float) -> str:
    """The nearest of the three sizes to a visibility."""
    return min(VISIBILITY, key=lambda size: abs(math.log(seen / VISIBILITY[size])))


def draw_turn(generator: np.random.Generator) -> Turn:
    """Random choices of one injection."""
    sign, angle = generator.choice([-1.0, 1.0]), generator.uniform(-math.pi, math.pi)
    return Turn(float(sign), float(angle), bool(generator.uniform() < 0.5))
