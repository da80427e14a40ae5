"""The catalogue of effects: how large small, medium and large are, and by which keys of an injection they are made.

Every effect can be made on two routes. On "command" it sits between driver and plant (keys st_*, v_*) or pushes the
body; on "parts" the plant's own servo, motor, wheels, brakes and queues make it (keys part_*). Effects of tyres,
load, ground and sensors are the same on both.
"""

import math
from dataclasses import dataclass

import numpy as np

MAGNITUDES = ["s", "m", "l"]
JITTER = 0.1
SPEED_OF_REFERENCE_MPS = 2.6


@dataclass(frozen=True)
class Effect:
    """Three magnitudes, the key of each route, and how the numbers follow from the vehicle."""

    group: str
    sizes: tuple[float, float, float]
    command_key: str
    parts_key: str
    kind: str = "absolute"
    """How the injected number follows from a size: a name in `_value`."""


EFFECTS = {
    "steer_lag": Effect("steer", (0.1, 0.2, 0.35), "st_lag", "part_servo_time_constant"),
    "steer_rate": Effect("steer", (0.7, 0.45, 0.3), "st_rate", "part_servo_rate", "below_servo"),
    "steer_delay": Effect("steer", (0.08, 0.15, 0.25), "st_delay", "part_servo_queue"),
    "steer_bias": Effect("steer", (0.02, 0.04, 0.07), "st_bias", "part_servo_trim", "signed"),
    "steer_gain": Effect("steer", (0.08, 0.12, 0.2), "st_gain", "part_steering_ratio", "ratio"),
    "understeer": Effect("steer", (0.2, 0.4, 0.6), "st_uspeed", "part_steering_compliance", "understeer"),
    "backlash": Effect("steer", (0.02, 0.035, 0.05), "st_backlash", "part_linkage_play"),
    "friction": Effect("tyre", (1.12, 1.02, 0.94), "mu", "mu", "friction"),
    "speed_lag": Effect("speed", (0.3, 0.6, 1.0), "v_lag", "part_motor_time_constant", "lag"),
    "speed_delay": Effect("speed", (0.15, 0.3, 0.5), "v_delay", "part_motor_queue"),
    "accel_limit": Effect("speed", (1.6, 1.0, 0.5), "v_acc", "part_torque_limit", "torque"),
    "speed_scale": Effect("speed", (0.04, 0.08, 0.14), "v_scale", "part_wheel_radius", "shrinking"),
    "motor_deadband": Effect("speed", (0.5, 0.75, 1.0), "v_deadband", "v_deadband", "deadband"),
    "rolling_drag": Effect("force", (0.5, 1.0, 1.6), "drag_c", "part_brake_drag"),
    "quad_drag": Effect("force", (0.9, 1.9, 3.0), "drag_q", "drag_q", "per_speed_squared"),
    "veg_drag": Effect("force", (0.6, 1.2, 2.0), "patch_drag", "patch_drag"),
    "slope_gravity": Effect("force", (0.4, 0.7, 1.0), "slope", "slope"),
    "cross_slope": Effect("force", (0.5, 1.0, 1.5), "cross", "cross"),
    "wind": Effect("force", (0.4, 0.7, 1.1), "wind", "wind", "wind"),
    "mass": Effect("force", (0.25, 0.5, 0.8), "mass", "mass", "growing"),
    "pose_latency": Effect("sensor", (0.06, 0.12, 0.2), "pose_latency", "pose_latency"),
    "odom_scale": Effect("sensor", (0.03, 0.05, 0.1), "odom_scale", "odom_scale", "ratio"),
    "gyro_bias": Effect("sensor", (0.01, 0.02, 0.04), "gyro_bias", "gyro_bias", "signed"),
    "yaw_misalign": Effect("sensor", (0.02, 0.04, 0.07), "yaw_misalign", "yaw_misalign", "signed"),
}

HARDER_FOR_FRICTION = {"car": 1.125, "small": 1.5}
"""Friction shows at the limit of grip: its drivers ask for this much more lateral acceleration.

The small ones climb real slopes, for which enough grip has to remain.
"""


def applicable(vehicle) -> list[str]:
    """Effects that can show on a vehicle: a motor's dead band lies below the speeds of the cars."""
    return [name for name in EFFECTS if name != "motor_deadband" or vehicle.scale == "small"]


def _lag(size: float, vehicle, route: str) -> float:
    """A slow motor inside a tight speed loop swings: keep its time constant below the loop's."""
    return size if route == "command" else 0.55 * size / vehicle.parts.speed_gain_per_s


def _torque(size: float, vehicle, route: str) -> float:
    """A torque limit has to leave enough to climb where slopes act on the plant."""
    return size + 1.5 if route == "parts" and vehicle.plant == "mujoco" else size


def _value(effect: Effect, size: float, vehicle, route: str, generator: np.random.Generator):
    """The injected number for a size: as it is, with a random sign, as a ratio, or made to fit the vehicle."""
    sign, top_mps = generator.choice([-1.0, 1.0]), vehicle.speeds_mps[1]
    angle = generator.uniform(-math.pi, math.pi)
    compliance_m = vehicle.wheelbase_m if route == "parts" else 1.0
    values = {
        "absolute": lambda: size,
        "below_servo": lambda: size * min(1.0, 6.0 / 7.0 * vehicle.parts.servo_rate_radps),
        "signed": lambda: sign * size,
        "ratio": lambda: 1.0 + sign * size,
        "shrinking": lambda: 1.0 - size,
        "growing": lambda: 1.0 + size,
        "per_speed_squared": lambda: size / top_mps**2,
        "understeer": lambda: compliance_m * size / top_mps**2,
        "friction": lambda: size * HARDER_FOR_FRICTION[vehicle.scale] * vehicle.lateral_acceleration_mps2 / 9.81,
        "lag": lambda: _lag(size, vehicle, route),
        "torque": lambda: _torque(size, vehicle, route),
        "deadband": lambda: size * top_mps / SPEED_OF_REFERENCE_MPS,
        "wind": lambda: [round(size * math.cos(angle), 3), round(size * math.sin(angle), 3)],
    }
    value = values[effect.kind]()
    return value if isinstance(value, list) else float(f"{value:.3g}")


def injection_of(name: str, magnitude: str, vehicle, route: str, generator: np.random.Generator) -> dict:
    """Keys and numbers that make an effect of a magnitude; sizes are spread by a tenth either way."""
    effect = EFFECTS[name]
    spread = 0.02 if effect.kind == "friction" else JITTER
    size = effect.sizes[MAGNITUDES.index(magnitude)] * generator.uniform(1.0 - spread, 1.0 + spread)
    key = effect.command_key if route == "command" else effect.parts_key
    return {key: _value(effect, size, vehicle, route, generator)}


def _push(share: float, vehicle) -> float:
    """A yaw acceleration that matters to a vehicle of this size [rad/s2]."""
    return share * vehicle.lateral_acceleration_mps2 / vehicle.wheelbase_m


UNKNOWN = {
    "unk_command_dropout": lambda vehicle, generator: {
        "drop_period": round(generator.uniform(2.6, 3.6), 1),
        "drop_len": round(generator.uniform(0.7, 1.0), 2),
    },
    "unk_trailer": lambda vehicle, generator: {"trailer" if vehicle.plant == "mujoco" else "towed_trailer": True},
    "unk_battery_sag": lambda vehicle, generator: {"v_sag": round(generator.uniform(0.004, 0.007), 4)},
    "unk_yaw_moment": lambda vehicle, generator: {
        "yaw_moment": round(generator.choice([-1, 1]) * _push(1.2, vehicle), 3)
    },
    "unk_periodic": lambda vehicle, generator: {
        "yaw_shake": round(_push(2.5, vehicle), 3),
        "shake_hz": round(generator.uniform(0.5, 1.2), 2),
    },
    "unk_asymmetric_gain": lambda vehicle, generator: {"st_gain_left": round(generator.uniform(0.65, 0.8), 2)},
    "unk_steer_wobble": lambda vehicle, generator: {
        "st_wobble": round(generator.uniform(0.03, 0.05), 3),
        "wobble_hz": round(generator.uniform(0.3, 0.8), 2),
    },
    "unk_steer_drift": lambda vehicle, generator: {
        "st_drift": round(generator.choice([-1, 1]) * generator.uniform(0.0015, 0.0025), 5)
    },
    "unk_steer_quantised": lambda vehicle, generator: {"st_quantum": round(generator.uniform(0.1, 0.14), 3)},
    "unk_gusts": lambda vehicle, generator: {
        "wind": [round(value, 2) for value in generator.choice([-1, 1], 2) * generator.uniform(0.8, 1.3, 2)],
        "gust_period": round(generator.uniform(5.0, 9.0), 1),
    },
    "unk_loose_drag": lambda vehicle, generator: {"loose_drag": round(generator.uniform(1.2, 1.8), 2)},
    "unk_flat_tyre": lambda vehicle, generator: {"flat_fl": 0.8, "flat_damp": round(generator.uniform(0.3, 0.6), 2)},
}
