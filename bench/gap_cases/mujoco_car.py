"""The MuJoCo description of a four-wheel car on a height field."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from ground import Ground
from parts import Parts

WHEELS = {"front_left": (1, 1), "front_right": (1, -1), "rear_left": (0, 1), "rear_right": (0, -1)}
WHEEL_MASS_SHARE = 0.03
BASE_M = 1.0
STEP_S = 0.002


@dataclass(frozen=True)
class Body:
    """Size, weight and springs of a car."""

    mass_kg: float
    wheelbase_m: float
    track_m: float
    wheel_radius_m: float
    centre_height_m: float
    """Height of the centre of mass over the axles."""
    front_load_share: float
    spring_hz: float
    damping_ratio: float
    rear_drive: bool

    def centre_x_m(self) -> float:
        """Centre of mass ahead of the rear axle."""
        return self.front_load_share * self.wheelbase_m

    def driven(self) -> list[str]:
        """Names of the wheels with a motor."""
        return [name for name in WHEELS if not (self.rear_drive and name.startswith("front"))]


def _corner_spring(body: Body) -> tuple[float, float, float]:
    """Stiffness [N/m], damping [N s/m] and free length offset [m] of one wheel's suspension."""
    quarter = body.mass_kg / 4.0
    stiffness = quarter * (2 * math.pi * body.spring_hz) ** 2
    damping = 2 * body.damping_ratio * quarter * 2 * math.pi * body.spring_hz
    return stiffness, damping, -quarter * 9.81 / stiffness


def _wheel(name: str, body: Body, parts: Parts) -> str:
    forward, side = WHEELS[name]
    stiffness, damping, free = _corner_spring(body)
    radius = body.wheel_radius_m * parts.wheel_radius_ratio
    inertia = body.mass_kg * body.wheel_radius_m**2
    steer = f'<joint name="{name}_steer" type="hinge" axis="0 0 1" armature="{0.01 * inertia}"/>' if forward else ""
    friction_loss = parts.brake_drag_mps2 * body.mass_kg * body.wheel_radius_m / 4.0
    return f"""
    <body name="{name}" pos="{forward * body.wheelbase_m} {side * body.track_m / 2} 0">
      <joint name="{name}_spring" type="slide" axis="0 0 1" stiffness="{stiffness}" damping="{damping}"
             springref="{free}" limited="true" range="{-0.6 * body.wheel_radius_m} {0.6 * body.wheel_radius_m}"/>
      {steer}
      <joint name="{name}_roll" type="hinge" axis="0 1 0" armature="{0.005 * inertia}"
             frictionloss="{friction_loss}"/>
      <geom name="{name}" type="ellipsoid" size="{radius} {0.5 * radius} {radius}"
            mass="{WHEEL_MASS_SHARE * body.mass_kg}" friction="{parts.friction} 0.002 0.0001" priority="1"
            condim="3" solref="0.012 1" contype="1" conaffinity="2"/>
    </body>"""


def _trailer(body: Body) -> str:
    """A one-axle trailer on a ball hitch behind the rear axle."""
    mass, length = 0.35 * body.mass_kg, 1.0 * body.wheelbase_m
    radius, hitch = body.wheel_radius_m, 0.3 * body.wheelbase_m
    wheels = "".join(
        f"""
      <body pos="{-length} {side * body.track_m / 2} 0">
        <joint type="hinge" axis="0 1 0" damping="{0.002 * mass * radius}"/>
        <geom type="ellipsoid" size="{radius} {0.5 * radius} {radius}" mass="{0.1 * mass}"
              friction="0.9 0.002 0.0001" priority="1" condim="3" contype="1" conaffinity="2"/>
      </body>"""
        for side in (1, -1)
    )
    return f"""
    <body name="trailer" pos="{-hitch} 0 0">
      <joint type="ball" damping="{0.001 * mass}"/>
      <inertial pos="{-0.9 * length} 0 0.02" mass="{0.8 * mass}"
                diaginertia="{0.02 * mass * length**2} {0.06 * mass * length**2} {0.06 * mass * length**2}"/>
      {wheels}
    </body>"""


def _actuators(body: Body, parts: Parts) -> str:
    """Steering: filtered stiff position servos. Motors: filtered velocity servos with a torque limit."""
    inertia = 0.02 * body.mass_kg * body.wheel_radius_m**2
    stiff, damp = inertia * 80.0**2, 2 * inertia * 80.0
    lines = [
        f'<general joint="{name}_steer" dyntype="filterexact" dynprm="{parts.servo_time_constant_s}" '
        f'gainprm="{stiff}" biastype="affine" biasprm="0 {-stiff} {-damp}"/>'
        for name in WHEELS
        if name.startswith("front")
    ]
    driven = body.driven()
    gain = parts.speed_gain_per_s * body.mass_kg * body.wheel_radius_m**2 / len(driven)
    torque = body.mass_kg * body.wheel_radius_m / len(driven)
    lines += [
        f'<general joint="{name}_roll" dyntype="filterexact" dynprm="{parts.motor_time_constant_s}" '
        f'gainprm="{gain}" biastype="affine" biasprm="0 0 {-gain}" forcelimited="true" '
        f'forcerange="{-torque * parts.braking_mps2} {torque * parts.traction_mps2}"/>'
        for name in driven
    ]
    return "\n".join(lines)


def car_model(body: Body, parts: Parts, injection: dict, ground: Ground) -> mujoco.MjModel:
    """The compiled model of a car with its faults on a map."""
    half, nodes = ground.half_extent_m, ground.shape.nodes
    low, high = ground.height_m.min(), ground.height_m.max()
    sprung = body.mass_kg * (parts.payload_ratio - 4 * WHEEL_MASS_SHARE)
    sizes = np.array([body.wheelbase_m, body.track_m]) ** 2 * sprung
    diagonal = [0.12 * sizes[1], 0.12 * sizes[0], 0.12 * (sizes[0] + sizes[1])]
    text = f"""
    <mujoco>
      <compiler balanceinertia="true"/>
      <option timestep="{STEP_S}" integrator="implicitfast" cone="elliptic" impratio="5"/>
      <asset><hfield name="ground" nrow="{nodes}" ncol="{nodes}" size="{half} {half} {high - low} {BASE_M}"/></asset>
      <worldbody>
        <geom type="hfield" hfield="ground" pos="0 0 {low}" contype="2" conaffinity="1"/>
        <body name="chassis" pos="0 0 {body.wheel_radius_m}">
          <freejoint/>
          <inertial pos="{body.centre_x_m()} 0 {body.centre_height_m}" mass="{sprung}"
                    diaginertia="{diagonal[0]} {diagonal[1]} {diagonal[2]}"/>
          {"".join(_wheel(name, body, parts) for name in WHEELS)}
          {_trailer(body) if injection.get("trailer") else ""}
        </body>
      </worldbody>
      <actuator>{_actuators(body, parts)}</actuator>
    </mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    model.hfield_data[:] = ((ground.height_m - low) / (high - low)).T.ravel()
    if "flat_fl" in injection:
        model.geom("front_left").size *= injection["flat_fl"]
        inertia = body.mass_kg * body.wheel_radius_m**2
        model.dof_damping[model.joint("front_left_roll").dofadr[0]] += injection["flat_damp"] * inertia
    return model
