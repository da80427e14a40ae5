"""Plants from CommonRoad's vehicle models: single-track drift ("std") and multi-body ("mb").

The right-hand sides are the package's own functions, compiled by numba; here are the actuators, the outer
accelerations, the fixed-step Runge-Kutta integration and the pose on the map. The models drive on a plane: slope
acts only where an injection says so, while height and attitude of the log follow the map (mb adds its body roll).
"""

import functools
import math
from collections import namedtuple
from dataclasses import dataclass, fields, is_dataclass

import numba
import numpy as np
import vehiclemodels.utils.tire_model as tire_model
import vehiclemodels.utils.vehicle_dynamics_ks_cog as kinematic
import vehiclemodels.vehicle_dynamics_mb as multi_body
import vehiclemodels.vehicle_dynamics_std as single_track
from vehiclemodels.init_mb import init_mb
from vehiclemodels.init_std import init_std
from vehiclemodels.vehicle_parameters import setup_vehicle_parameters

from command_path import TICK_S
from forces import BodyForces, Motion
from ground import Ground
from parts import ActuatorInput

STEER, YAW, YAW_RATE, ROLL = 2, 4, 5, 6


def _compiled_models() -> tuple:
    """Both right-hand sides, with everything they call, compiled."""
    for name in ["sign", "formula_longitudinal", "formula_lateral"]:
        setattr(tire_model, name, numba.njit(getattr(tire_model, name)))
    for name in ["formula_longitudinal_comb", "formula_lateral_comb"]:
        setattr(tire_model, name, numba.njit(getattr(tire_model, name)))
    limits = {
        "steering_constraints": numba.njit(single_track.steering_constraints),
        "acceleration_constraints": numba.njit(single_track.acceleration_constraints),
    }
    for module in (kinematic, single_track, multi_body):
        vars(module).update(limits)
    compiled = numba.njit(kinematic.vehicle_dynamics_ks_cog)
    single_track.vehicle_dynamics_ks_cog = multi_body.vehicle_dynamics_ks_cog = compiled
    return numba.njit(single_track.vehicle_dynamics_std), numba.njit(multi_body.vehicle_dynamics_mb)


STD_DERIVATIVE, MB_DERIVATIVE = _compiled_models()


@numba.njit
def _slip_control(rim_mps, ground_mps):
    """Share of the torque that the slip control lets through: less where a wheel is about to spin or lock.

    rim_mps: speeds of the wheels' rims; ground_mps: of the ground under them, along each wheel.
    """
    slip = 0.0
    for wheel in range(len(rim_mps)):
        slip = max(slip, abs(1.0 - rim_mps[wheel] / max(ground_mps[wheel], 0.5)))
    return min(max((0.12 - slip) / 0.05, 0.0), 1.0)


@numba.njit
def _std_grip(state, parameters):
    """Slip control of the two axles."""
    forward, left = state[3] * math.cos(state[6]), state[3] * math.sin(state[6]) + parameters.a * state[5]
    front = forward * math.cos(state[2]) + left * math.sin(state[2])
    return _slip_control(parameters.R_w * state[7:9], np.array([front, forward]))


@numba.njit
def _mb_grip(state, parameters):
    """Slip control of the four wheels."""
    cos, sin = math.cos(state[2]), math.sin(state[2])
    left = (state[10] + parameters.a * state[5]) * sin
    front, rear = 0.5 * parameters.T_f * state[5], 0.5 * parameters.T_r * state[5]
    ground = [(state[3] + front) * cos + left, (state[3] - front) * cos + left, state[3] + rear, state[3] - rear]
    return _slip_control(parameters.R_w * state[23:27], np.array(ground))


@numba.njit
def _std_rate(state, targets, outer, parameters):
    """Derivative of the single-track state with actuators and outer accelerations.

    targets: wheel angle, speed, servo time constant, servo rate, speed gain, traction, braking, motor time constant.
    outer: accelerations along, across, in yaw, and the wheels' deceleration by brake drag.
    The last state is the motor's acceleration, which lags behind the speed controller.
    """
    steer_rate = min(max((targets[0] - state[2]) / targets[2], -targets[3]), targets[3])
    wanted = min(max(targets[4] * (targets[1] - state[3]), -targets[6]), targets[5])
    inputs = np.array([steer_rate, _std_grip(state, parameters) * state[-1]])
    rate = np.empty_like(state)
    rate[:9] = np.array(STD_DERIVATIVE(state[:9].copy(), inputs, parameters))
    cos, sin = math.cos(state[6]), math.sin(state[6])
    rate[3] += outer[0] * cos + outer[1] * sin
    rate[6] += (outer[1] * cos - outer[0] * sin) / max(state[3], 0.5)
    rate[5] += outer[2]
    rate[7] -= 0.5 * outer[3] * parameters.m * parameters.R_w / parameters.I_y_w
    rate[8] -= 0.5 * outer[3] * parameters.m * parameters.R_w / parameters.I_y_w
    rate[9] = (wanted - state[-1]) / targets[7]
    return rate


@numba.njit
def _mb_rate(state, targets, outer, parameters):
    """The same for the multi-body state."""
    steer_rate = min(max((targets[0] - state[2]) / targets[2], -targets[3]), targets[3])
    wanted = min(max(targets[4] * (targets[1] - state[3]), -targets[6]), targets[5])
    inputs = np.array([steer_rate, _mb_grip(state, parameters) * state[-1]])
    rate = np.empty_like(state)
    rate[:29] = np.array(MB_DERIVATIVE(state[:29].copy(), inputs, parameters))
    rate[3] += outer[0]
    for lateral in (10, 15, 20):
        rate[lateral] += outer[1]
    rate[5] += outer[2]
    for wheel in range(23, 27):
        rate[wheel] -= 0.25 * outer[3] * parameters.m * parameters.R_w / parameters.I_y_w
    rate[29] = (wanted - state[-1]) / targets[7]
    return rate


def _tick_of(rate):
    """A function that integrates one tick with classical Runge-Kutta steps."""

    @numba.njit
    def tick(state, targets, outer, parameters, steps):
        step = TICK_S / steps
        for _ in range(steps):
            first = rate(state, targets, outer, parameters)
            second = rate(state + 0.5 * step * first, targets, outer, parameters)
            third = rate(state + 0.5 * step * second, targets, outer, parameters)
            fourth = rate(state + step * third, targets, outer, parameters)
            state = state + step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        return state

    return tick


@dataclass(frozen=True)
class Chassis:
    """One of the two models: its initial state, its integration and where it keeps the lateral velocity."""

    initial_state: object
    tick: object
    steps: int


CHASSIS = {
    "std": Chassis(init_std, _tick_of(_std_rate), 60),
    "mb": Chassis(init_mb, _tick_of(_mb_rate), 30),
}


def _frozen(parameters) -> object:
    """Nested named tuples of floats, which numba understands; absent entries and the trailer are left out."""
    if not is_dataclass(parameters):
        return float(parameters)
    values = {field.name: getattr(parameters, field.name) for field in fields(parameters)}
    values = {name: _frozen(value) for name, value in values.items() if value is not None and name != "trailer"}
    return _tuple_type(type(parameters).__name__, tuple(values))(**values)


@functools.cache
def _tuple_type(name: str, entries: tuple[str, ...]) -> type:
    """One type for one list of entries: a new one would make numba compile again."""
    return namedtuple(name, entries)


def vehicle_parameters(parameter_set: int, changes: dict[str, float]) -> object:
    """A parameter set of the package with entries replaced; the mass of the whole follows its sprung part."""
    parameters = setup_vehicle_parameters(parameter_set)
    for name, value in changes.items():
        setattr(parameters, name, value)
    parameters.m = parameters.m_s + parameters.m_uf + parameters.m_ur
    parameters.steering.v_max, parameters.steering.v_min = 10.0, -10.0
    return parameters


class CommonRoadPlant:
    """A CommonRoad vehicle with servo, speed controller and a map under it."""

    def __init__(self, vehicle, injection: dict, ground: Ground):
        self.ground, self.chassis = ground, CHASSIS[vehicle.model]
        self.parts = vehicle.parts.with_faults(injection)
        parameters = vehicle_parameters(vehicle.parameter_set, vehicle.changes)
        self.wheelbase_m, self.rear_m = parameters.a + parameters.b, parameters.b
        self.is_multi_body = vehicle.model == "mb"
        self._load(parameters)
        self.actuators = ActuatorInput(self.parts)
        self.forces = BodyForces(injection, ground, self.wheelbase_m)

    def _load(self, parameters) -> None:
        """Puts payload and tyre friction in; the motor's torque is sized for the empty vehicle."""
        ratio = self.parts.payload_ratio
        added = (ratio - 1.0) * parameters.m
        parameters.I_z *= 1.0 + 0.8 * (ratio - 1.0)
        parameters.m, parameters.m_s = ratio * parameters.m, parameters.m_s + added
        parameters.tire.p_dx1 *= self.parts.friction / parameters.tire.p_dy1
        parameters.tire.p_dy1 = self.parts.friction
        parameters.R_w *= self.parts.wheel_radius_ratio
        self.parameters = _frozen(parameters)

    def place(self, x_m: float, y_m: float, yaw_rad: float, speed_mps: float) -> None:
        """Starts at a rear-axle pose, rolling."""
        centre_x = x_m + self.rear_m * math.cos(yaw_rad)
        centre_y = y_m + self.rear_m * math.sin(yaw_rad)
        core = [centre_x, centre_y, 0.0, speed_mps, yaw_rad, 0.0, 0.0]
        self.state = np.array([*self.chassis.initial_state(core, self.parameters), 0.0])

    def motion(self) -> Motion:
        """Motion of the rear axle."""
        state = self.state
        slip = 0.0 if self.is_multi_body else state[6]
        vx = state[3] * math.cos(slip)
        vy = state[10] if self.is_multi_body else state[3] * math.sin(slip)
        yaw = state[YAW]
        x, y = state[0] - self.rear_m * math.cos(yaw), state[1] - self.rear_m * math.sin(yaw)
        return Motion(x, y, yaw, vx, vy - self.rear_m * state[YAW_RATE], state[YAW_RATE])

    def attitude(self) -> tuple[float, float, float]:
        """Height [m], roll and pitch [rad] of the rear axle on the map."""
        motion = self.motion()
        height, rise, rise_left = self.ground.body_slopes(motion.x_m, motion.y_m, motion.yaw_rad)
        body_roll = self.state[ROLL] if self.is_multi_body else 0.0
        return height, math.atan(rise_left) + body_roll, -math.atan(rise)

    def advance(self, time_s: float, speed_mps: float, steer_rad: float) -> None:
        """One tick under a command."""
        motion, parts = self.motion(), self.parts
        speed, steer = self.actuators.targets(speed_mps, steer_rad, motion)
        empty = 1.0 / parts.payload_ratio
        targets = [steer, speed * parts.wheel_radius_ratio, parts.servo_time_constant_s, parts.servo_rate_radps]
        targets += [parts.speed_gain_per_s * empty, parts.traction_mps2 * empty, parts.braking_mps2 * empty]
        outer = [*self.forces.at(time_s, motion), parts.brake_drag_mps2]
        targets = np.array([*targets, parts.motor_time_constant_s])
        self.state = self.chassis.tick(self.state, targets, np.array(outer), self.parameters, self.chassis.steps)
