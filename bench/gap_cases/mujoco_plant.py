"""A four-wheel car in MuJoCo: real slopes, springs, wheel contacts, servos and motors."""

import math

import mujoco
import numpy as np

from command_path import TICK_S, Lag
from forces import BodyForces, Motion
from ground import Ground
from mujoco_car import STEP_S, car_model
from parts import ActuatorInput


class MujocoPlant:
    """One car on one map."""

    def __init__(self, vehicle, injection: dict, ground: Ground):
        self.body, self.ground = vehicle.body, ground
        self.parts = vehicle.parts.with_faults(injection)
        self.wheelbase_m = self.body.wheelbase_m
        self.model = car_model(self.body, self.parts, injection, ground)
        self.data = mujoco.MjData(self.model)
        self.chassis = self.model.body("chassis").id
        self.actuators = ActuatorInput(self.parts)
        self.servo_rate = Lag(0.0, self.parts.servo_rate_radps)
        self.forces = BodyForces(injection, ground, self.wheelbase_m)

    def place(self, x_m: float, y_m: float, yaw_rad: float, speed_mps: float) -> None:
        """Sets the car on the ground, rolling."""
        highest = max(self.ground.surface(x_m + dx, y_m + dy)[0] for dx, dy in self._corners(yaw_rad))
        position = [x_m, y_m, highest + 1.1 * self.body.wheel_radius_m]
        self.data.qpos[:7] = [*position, math.cos(yaw_rad / 2), 0, 0, math.sin(yaw_rad / 2)]
        self.data.qvel[:2] = speed_mps * math.cos(yaw_rad), speed_mps * math.sin(yaw_rad)
        mujoco.mj_forward(self.model, self.data)

    def _corners(self, yaw_rad: float) -> list[tuple[float, float]]:
        """Wheel positions from the rear axle's centre in the world's axes."""
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        points = [(a, b) for a in (0.0, self.wheelbase_m) for b in (-self.body.track_m / 2, self.body.track_m / 2)]
        return [(a * cos - b * sin, a * sin + b * cos) for a, b in points]

    def _rotation(self) -> np.ndarray:
        return self.data.xmat[self.chassis].reshape(3, 3)

    def motion(self) -> Motion:
        """Motion of the rear axle, whose centre is the chassis' origin."""
        rotation = self._rotation()
        velocity = rotation.T @ self.data.qvel[:3]
        x, y, _ = self.data.qpos[:3]
        yaw = math.atan2(rotation[1, 0], rotation[0, 0])
        return Motion(x, y, yaw, velocity[0], velocity[1], self.data.qvel[5])

    def attitude(self) -> tuple[float, float, float]:
        """Height [m], roll and pitch [rad] of the body."""
        rotation = self._rotation()
        pitch = -math.asin(min(max(rotation[2, 0], -1.0), 1.0))
        return self.data.qpos[2], math.atan2(rotation[2, 1], rotation[2, 2]), pitch

    def _wheel_angles(self, steer_rad: float) -> tuple[float, float]:
        """Ackermann angles of the left and the right front wheel."""
        slope = math.tan(min(max(steer_rad, -1.2), 1.2)) / self.wheelbase_m
        half = 0.5 * self.body.track_m
        return tuple(math.atan(slope * self.wheelbase_m / (1.0 - side * half * slope)) for side in (1, -1))

    def _push(self, time_s: float, motion: Motion) -> None:
        """Outer forces at the centre of mass."""
        along, across, turn = self.forces.at(time_s, motion)
        mass = self.body.mass_kg * self.parts.payload_ratio
        rotation = self._rotation()
        self.data.xfrc_applied[self.chassis, :3] = mass * (rotation @ np.array([along, across, 0.0]))
        self.data.xfrc_applied[self.chassis, 5] = turn * 0.25 * mass * self.wheelbase_m**2

    def advance(self, time_s: float, speed_mps: float, steer_rad: float) -> None:
        """One tick under a command."""
        motion = self.motion()
        speed, steer = self.actuators.targets(speed_mps, steer_rad, motion)
        self.data.ctrl[:2] = self._wheel_angles(self.servo_rate(steer))
        self.data.ctrl[2:] = speed / self.body.wheel_radius_m
        self._push(time_s, motion)
        mujoco.mj_step(self.model, self.data, nstep=round(TICK_S / STEP_S))
