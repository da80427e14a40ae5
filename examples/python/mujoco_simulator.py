"""A simulator on MuJoCo that `surefoot gap diagnose --simulator` can ask: a car on four wheels, `pip install mujoco`.

    surefoot gap diagnose CASE --simulator "python3 examples/python/mujoco_simulator.py"

Four wheels roll and slide in MuJoCo's own contacts; motors of the rear wheels follow the speed command through a lag,
and kingpins of the front wheels the steering command through a servo. The ground is a plane. A run tells slopes along
the way of the robot, so that it is gravity that leans: the tyres carry and hold what they would on that slope.
"""

import math

import mujoco
import numpy as np

from simulator_protocol import Message, Row, serve

STEP_S = 0.005
GRAVITY_MPS2 = 9.81
# The car, in wheelbases and shares of its mass.
TRACK, WHEEL_RADIUS, CENTRE_HEIGHT, FRONT_SHARE, WHEEL_SHARE = 0.58, 0.12, 0.1, 0.5, 0.03
SERVO_TIME_CONSTANT_S, SERVO_RATE_RADPS = 0.08, 1.2
SPEED_GAIN_PER_S, DRIVE_MPS2 = 2.5, 4.0

KNOBS: list[Message] = [
    {"name": "tyre_friction", "unit": "-", "low": 0.2, "high": 1.6, "default": 0.9},
    {"name": "mass_ratio", "unit": "-", "low": 0.5, "high": 2.5, "default": 1.0},
    {"name": "rolling_resistance", "unit": "-", "low": 0.0, "high": 0.2, "default": 0.015},
    {"name": "motor_time_constant_s", "unit": "s", "low": 0.02, "high": 1.5, "default": 0.1},
    {"name": "steering_compliance_s2radpm", "unit": "s2 rad/m", "low": 0.0, "high": 0.04, "default": 0.002},
]
WHEELS = {"front_left": (1, 1), "front_right": (1, -1), "rear_left": (0, 1), "rear_right": (0, -1)}


def nominal_kg(wheelbase_m: float) -> float:
    """Mass of the car as it is built."""
    return 75.0 * wheelbase_m**3


def wheel(name: str, wheelbase_m: float, knobs: dict[str, float]) -> str:
    """A wheel: a kingpin in front, an axle, and an ellipsoid that touches the ground in one point."""
    ahead, side = WHEELS[name]
    radius_m, mass_kg = WHEEL_RADIUS * wheelbase_m, nominal_kg(wheelbase_m)
    small_kgm2 = 0.005 * mass_kg * radius_m**2
    resistance_nm = knobs["rolling_resistance"] * knobs["mass_ratio"] * mass_kg * GRAVITY_MPS2 * radius_m / 4.0
    kingpin = f'<joint name="{name}_steer" type="hinge" axis="0 0 1" armature="{2.0 * small_kgm2}"/>' if ahead else ""
    return f"""
    <body name="{name}" pos="{ahead * wheelbase_m} {side * 0.5 * TRACK * wheelbase_m} 0">
      {kingpin}
      <joint name="{name}_roll" type="hinge" axis="0 1 0" armature="{small_kgm2}" frictionloss="{resistance_nm}"/>
      <geom type="ellipsoid" size="{radius_m} {0.4 * radius_m} {radius_m}" mass="{WHEEL_SHARE * mass_kg}"
            friction="{knobs["tyre_friction"]} 0 0" priority="1" condim="3"/>
    </body>"""


def actuators(wheelbase_m: float, knobs: dict[str, float]) -> str:
    """Stiff servos at the kingpins; at the rear wheels speed controllers behind a lag, with a limited torque."""
    radius_m, mass_kg = WHEEL_RADIUS * wheelbase_m, nominal_kg(wheelbase_m)
    inertia_kgm2 = 0.02 * mass_kg * radius_m**2
    stiff, damp = 60.0**2 * inertia_kgm2, 2.0 * 60.0 * inertia_kgm2
    gain, torque_nm = 0.5 * SPEED_GAIN_PER_S * mass_kg * radius_m**2, 0.5 * DRIVE_MPS2 * mass_kg * radius_m
    lines = [f'<general joint="{name}_steer" gainprm="{stiff}" biastype="affine" biasprm="0 {-stiff} {-damp}"/>'
             for name in WHEELS if name.startswith("front")]
    lines += [f'<general joint="{name}_roll" dyntype="filterexact" dynprm="{knobs["motor_time_constant_s"]}" '
              f'gainprm="{gain}" biastype="affine" biasprm="0 0 {-gain}" forcelimited="true" '
              f'forcerange="{-torque_nm} {torque_nm}"/>'
              for name in WHEELS if name.startswith("rear")]
    return "\n".join(lines)


def car_model(wheelbase_m: float, knobs: dict[str, float]) -> mujoco.MjModel:
    """The compiled model; the chassis' origin is the middle of the rear axle."""
    body_kg = nominal_kg(wheelbase_m) * (knobs["mass_ratio"] - 4.0 * WHEEL_SHARE)
    roll, pitch, yaw = (share * body_kg * wheelbase_m**2 for share in (0.05, 0.2, 0.22))
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="{STEP_S}" integrator="implicitfast" cone="elliptic" impratio="4"/>
      <worldbody>
        <geom type="plane" size="0 0 1"/>
        <body name="chassis" pos="0 0 {WHEEL_RADIUS * wheelbase_m}">
          <freejoint/>
          <inertial pos="{FRONT_SHARE * wheelbase_m} 0 {CENTRE_HEIGHT * wheelbase_m}" mass="{body_kg}"
                    diaginertia="{roll} {pitch} {yaw}"/>
          {"".join(wheel(name, wheelbase_m, knobs) for name in WHEELS)}
        </body>
      </worldbody>
      <actuator>{actuators(wheelbase_m, knobs)}</actuator>
    </mujoco>""")


class Car:
    """The car under way."""

    def __init__(self, vehicle: Message, run: Message) -> None:
        self.wheelbase_m, self.steering_max_rad = vehicle["wheelbase_m"], vehicle["steering_max_rad"]
        self.compliance_s2radpm = run["knobs"]["steering_compliance_s2radpm"]
        self.model = car_model(self.wheelbase_m, run["knobs"])
        self.data = mujoco.MjData(self.model)
        self.chassis = self.model.body("chassis").id
        self.steering_rad = 0.0
        self.begin(run["start"])

    def begin(self, start: dict[str, float]) -> None:
        """Stands where the run begins, rolling; the motors hold that speed."""
        yaw_rad, speed_mps = start["yaw_rad"], start["speed_mps"]
        self.data.qpos[:2] = start["x_m"], start["y_m"]
        self.data.qpos[3:7] = math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)
        self.data.qvel[:2] = speed_mps * math.cos(yaw_rad), speed_mps * math.sin(yaw_rad)
        self.data.qvel[5] = start["yaw_rate_radps"]
        spin_radps = speed_mps / (WHEEL_RADIUS * self.wheelbase_m)
        for name in WHEELS:
            self.data.joint(f"{name}_roll").qvel = spin_radps
        self.data.act[:] = spin_radps
        mujoco.mj_forward(self.model, self.data)

    def measured(self) -> Row:
        """x, y [m], yaw [rad], speed [m/s], yaw rate [rad/s], speed to the left [m/s] at mid rear axle."""
        rotation = self.data.xmat[self.chassis].reshape(3, 3)
        speed_mps, left_mps, _ = (float(axis @ self.data.qvel[:3]) for axis in rotation.T)
        yaw_rad = math.atan2(rotation[1, 0], rotation[0, 0])
        x_m, y_m, yaw_rate_radps = (float(value) for value in (*self.data.qpos[:2], self.data.qvel[5]))
        return x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps, left_mps

    def lean(self, yaw_rad: float, slope_ahead: float, slope_left: float) -> None:
        """Gravity as it is on a slope, in the axes of the plane."""
        sine, cosine = math.sin(yaw_rad), math.cos(yaw_rad)
        down = np.array([-slope_ahead * cosine + slope_left * sine, -slope_ahead * sine - slope_left * cosine, -1.0])
        self.model.opt.gravity[:] = GRAVITY_MPS2 * down / np.linalg.norm(down)

    def steer(self, command_rad: float, lateral_mps2: float, step_s: float) -> None:
        """The servo follows the command; what the linkage gives way under the tyres is lost behind it."""
        wanted_rad = min(max(command_rad, -self.steering_max_rad), self.steering_max_rad)
        way_rad = (wanted_rad - self.steering_rad) * (1.0 - math.exp(-step_s / SERVO_TIME_CONSTANT_S))
        most_rad = SERVO_RATE_RADPS * step_s
        self.steering_rad += min(max(way_rad, -most_rad), most_rad)
        slope = math.tan(self.steering_rad - self.compliance_s2radpm * lateral_mps2)
        # Ackermann: the inner wheel is turned more.
        self.data.ctrl[:2] = [math.atan(slope / (1.0 - side * 0.5 * TRACK * slope)) for side in (1, -1)]

    def step(self, command: tuple[float, float], slopes: tuple[float, float], step_s: float) -> None:
        """Goes one row on."""
        speed_mps, steering_rad = command
        _, _, yaw_rad, forward_mps, yaw_rate_radps, _ = self.measured()
        self.lean(yaw_rad, *slopes)
        self.steer(steering_rad, forward_mps * yaw_rate_radps, step_s)
        self.data.ctrl[2:] = speed_mps / (WHEEL_RADIUS * self.wheelbase_m)
        mujoco.mj_step(self.model, self.data, nstep=max(1, round(step_s / STEP_S)))


def driven(vehicle: Message, run: Message) -> list[Row]:
    """Every row of a run; the first is the start."""
    car = Car(vehicle, run)
    # A whole number of MuJoCo's steps to a row.
    car.model.opt.timestep = run["step_s"] / max(1, round(run["step_s"] / STEP_S))
    rows = [car.measured()]
    commands = zip(run["command_speed_mps"][:-1], run["command_steering_rad"])
    for command, slopes in zip(commands, zip(run["slope_ahead"], run["slope_left"])):
        car.step(command, slopes, run["step_s"])
        rows.append(car.measured())
    return rows


if __name__ == "__main__":
    serve("mujoco", KNOBS, driven)
