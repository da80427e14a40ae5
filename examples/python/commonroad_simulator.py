"""A simulator on CommonRoad that `surefoot gap diagnose --simulator` can ask: its single-track drift model of a BMW.

    pip install commonroad-vehicle-models numba numpy
    surefoot gap diagnose CASE --simulator "python3 examples/python/commonroad_simulator.py"

The right-hand side and its Pacejka tyres are the package's own, compiled by numba the first time, which takes a while;
the compiled code is kept. Around it are a servo, a motor that lags behind a proportional speed controller, a slip
control and gravity on slopes. The car is as long as the vehicle that is asked for.
"""

import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import vehiclemodels.utils.vehicle_dynamics_ks_cog as kinematic
import vehiclemodels.vehicle_dynamics_std as single_track
from vehiclemodels.utils import tire_model
from vehiclemodels.init_std import init_std
from vehiclemodels.vehicle_parameters import setup_vehicle_parameters

from simulator_protocol import Message, Row, serve

BMW_320I = 2
GRAVITY_MPS2 = 9.81
LONGEST_STEP_S = 0.002
# A wheel with the drive train that it turns. With the package's bare wheel steps had to be much shorter.
WHEEL_INERTIA_KGM2 = 8.0
SERVO_TIME_CONSTANT_S, SERVO_RATE_RADPS = 0.1, 1.0
SPEED_GAIN_PER_S, DRIVE_MPS2 = 2.0, 4.0

KNOBS: list[Message] = [
    {"name": "tyre_friction", "unit": "-", "low": 0.25, "high": 1.6, "default": 1.0},
    {"name": "cornering_stiffness_ratio", "unit": "-", "low": 0.3, "high": 2.5, "default": 1.0},
    {"name": "mass_ratio", "unit": "-", "low": 0.5, "high": 2.5, "default": 1.0},
    {"name": "yaw_inertia_ratio", "unit": "-", "low": 0.4, "high": 4.0, "default": 1.0},
    {"name": "motor_time_constant_s", "unit": "s", "low": 0.02, "high": 1.5, "default": 0.15},
]


def compiled(function: Callable[..., Any]) -> Any:
    """A function that numba compiles where it is called first; later it is read from the cache."""
    return numba.njit(function, cache=True)


def compiled_model() -> Any:
    """The package's right-hand side with everything that it calls, compiled."""
    formulas = ["longitudinal", "lateral", "longitudinal_comb", "lateral_comb"]
    for name in ["sign", *(f"formula_{formula}" for formula in formulas)]:
        setattr(tire_model, name, compiled(getattr(tire_model, name)))
    limits = {name: compiled(vars(single_track)[name]) for name in ["steering_constraints", "acceleration_constraints"]}
    for module in (kinematic, single_track):
        vars(module).update(limits)
    vars(single_track)["vehicle_dynamics_ks_cog"] = compiled(kinematic.vehicle_dynamics_ks_cog)
    return compiled(single_track.vehicle_dynamics_std)


MODEL = compiled_model()


def grip(state, car):  # type: ignore[no-untyped-def]
    """Share of the torque that the slip control lets through: less where a wheel is about to spin or lock."""
    forward, left = state[3] * math.cos(state[6]), state[3] * math.sin(state[6]) + car.a * state[5]
    front = forward * math.cos(state[2]) + left * math.sin(state[2])
    slip = max(abs(1.0 - car.R_w * state[7] / max(front, 0.5)), abs(1.0 - car.R_w * state[8] / max(forward, 0.5)))
    return min(max((0.12 - slip) / 0.05, 0.0), 1.0)


GRIP = compiled(grip)


def rate(state, inputs, nominal_kg, motor_s, car):  # type: ignore[no-untyped-def]
    """Derivative of the state, whose last entry is the motor's acceleration of the nominal car [m/s2].

    inputs: commanded speed and steering, slopes ahead and to the left.
    """
    steer_rate = min(max((inputs[1] - state[2]) / SERVO_TIME_CONSTANT_S, -SERVO_RATE_RADPS), SERVO_RATE_RADPS)
    wanted = min(max(SPEED_GAIN_PER_S * (inputs[0] - state[3] * math.cos(state[6])), -DRIVE_MPS2), DRIVE_MPS2)
    asked = np.array([steer_rate, GRIP(state, car) * state[9] * nominal_kg / car.m])
    change = np.empty_like(state)
    change[:9] = np.array(MODEL(state[:9].copy(), asked, car))
    ahead, left = -GRAVITY_MPS2 * inputs[2], -GRAVITY_MPS2 * inputs[3]
    change[3] += ahead * math.cos(state[6]) + left * math.sin(state[6])
    change[6] += (left * math.cos(state[6]) - ahead * math.sin(state[6])) / max(state[3], 0.5)
    change[9] = (wanted - state[9]) / motor_s
    return change


RATE = compiled(rate)


def states(state, inputs, step_s, nominal_kg, motor_s, car):  # type: ignore[no-untyped-def]
    """The state in every row, by classical Runge-Kutta steps that are short enough for the wheels' spin."""
    rows = np.empty((len(inputs), len(state)))
    rows[0] = state
    for row in range(len(inputs) - 1):
        spin_per_s = car.R_w**2 * car.tire.p_kx1 * car.m * GRAVITY_MPS2 / (car.I_y_w * max(state[3], 0.3))
        n_parts = math.ceil(max(step_s / LONGEST_STEP_S, 0.5 * spin_per_s * step_s))
        part_s = step_s / n_parts
        for _ in range(n_parts):
            first = RATE(state, inputs[row], nominal_kg, motor_s, car)
            second = RATE(state + 0.5 * part_s * first, inputs[row], nominal_kg, motor_s, car)
            third = RATE(state + 0.5 * part_s * second, inputs[row], nominal_kg, motor_s, car)
            fourth = RATE(state + part_s * third, inputs[row], nominal_kg, motor_s, car)
            state = state + part_s / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        rows[row + 1] = state
    return rows


STATES = compiled(states)


def record(parameters: Any) -> tuple[list[Any], tuple[Any, ...]]:
    """Type and values of a parameter set as a NumPy record, which numba understands; absent entries are left out."""
    kinds: list[Any] = []
    values: list[Any] = []
    for field in fields(parameters):
        value = getattr(parameters, field.name)
        if value is not None and field.name != "trailer":
            kind, value = record(value) if is_dataclass(value) else (float, float(value))
            kinds.append((field.name, kind))
            values.append(value)
    return kinds, tuple(values)


def car_of(vehicle: Message, knobs: dict[str, float]) -> tuple[Any, float]:
    """Parameters with the knobs in them, as a record, and the mass before they were."""
    car: Any = setup_vehicle_parameters(BMW_320I)
    longer, nominal_kg = vehicle["wheelbase_m"] / (car.a + car.b), float(car.m)
    car.a, car.b = longer * car.a, longer * car.b
    car.m *= knobs["mass_ratio"]
    car.I_z *= longer**2 * knobs["yaw_inertia_ratio"]
    car.I_y_w = WHEEL_INERTIA_KGM2
    # Peak friction and slope of the tyres; both directions keep their ratio.
    car.tire.p_dx1 *= knobs["tyre_friction"] / car.tire.p_dy1
    car.tire.p_dy1 = knobs["tyre_friction"]
    car.tire.p_ky1 *= knobs["cornering_stiffness_ratio"]
    car.steering.v_max, car.steering.v_min = SERVO_RATE_RADPS, -SERVO_RATE_RADPS
    kinds, values = record(car)
    return np.array([values], dtype=kinds)[0], nominal_kg


def start_of(start: dict[str, float], car: Any) -> np.ndarray:
    """The state in which a run begins: rolling without slip, the actuators at rest."""
    yaw_rad, speed_mps, turn = start["yaw_rad"], start["speed_mps"], start["yaw_rate_radps"]
    x_m, y_m = start["x_m"] + car["b"] * math.cos(yaw_rad), start["y_m"] + car["b"] * math.sin(yaw_rad)
    slip_rad = math.atan2(car["b"] * turn, max(speed_mps, 0.5))
    core = [x_m, y_m, 0.0, speed_mps / math.cos(slip_rad), yaw_rad, turn, slip_rad]
    return np.array([*init_std(core, SimpleNamespace(R_w=car["R_w"])), 0.0])


def driven(vehicle: Message, run: Message) -> list[Row]:
    """Every row of a run, at the middle of the rear axle; the first is the start."""
    car, nominal_kg = car_of(vehicle, run["knobs"])
    most = vehicle["steering_max_rad"]
    steering_rad = np.clip(run["command_steering_rad"], -most, most)
    inputs = np.column_stack([run["command_speed_mps"], steering_rad, run["slope_ahead"], run["slope_left"]])
    motor_s = run["knobs"]["motor_time_constant_s"]
    rows = STATES(start_of(run["start"], car), inputs, run["step_s"], nominal_kg, motor_s, car)
    x_m, y_m, _, v_mps, yaw_rad, turn, slip_rad, *_ = rows.T
    x_m, y_m = x_m - car["b"] * np.cos(yaw_rad), y_m - car["b"] * np.sin(yaw_rad)
    left_mps = v_mps * np.sin(slip_rad) - car["b"] * turn
    table = np.column_stack([x_m, y_m, yaw_rad, v_mps * np.cos(slip_rad), turn, left_mps])
    return [tuple(row) for row in table.tolist()]


if __name__ == "__main__":
    serve("commonroad", KNOBS, driven)
