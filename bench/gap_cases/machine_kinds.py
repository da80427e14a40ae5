"""The kinds of machine: ranges of their numbers; a vehicle is a draw from them.

Real robots differ, and so do the kinds, in
- speed control: force with PI and anti-windup, voltage with droop, torque maps, swash plates, hobby controllers with
  a coarse encoder, governors, a loop per wheel, scheduled gains, cascades behind an S-curve, sampled loops;
- brakes: friction brakes with a dead zone, regeneration, engine braking, retarders, relief valves, none at all;
- drive train: back EMF, battery resistance, gear shifts, clutches, open or locked axles, drive on two or four wheels;
- steering: dead zones, rate limits, overshoot, a ratio that varies, stiction, articulation, four wheels, twisting
  linkages, roll steer, delays of 0 to 90 ms;
- tyres and ground: Pacejka, brush, Burckhardt, sheared soil, soft carcass with camber; relaxation, falling friction
  under load, loose ground, growth;
- body: load transfer along and across, roll and pitch with spring and damper or hardly any spring, the centre of mass;
- hills: what of the slope the control unit knows, and how late; sensors: rates, held poses, wander, steps of encoders,
  coloured gyros, filters; drivers: see `machine_drivers.py`.
"""

import math
from dataclasses import dataclass

import machine_drivetrains as drives
import machine_steering as steerings
import machine_tyres as tyres

COMMON = {
    "centre": (0.44, 0.56), "gyration": (0.38, 0.5), "height_share": (0.14, 0.22), "width_share": (0.55, 0.68),
    "roll_rate_radps": (14.0, 22.0), "roll_damping": (8.0, 14.0), "front_roll_share": (0.45, 0.6),
    "pitch_rate_radps": (11.0, 20.0), "pitch_damping": (6.0, 12.0), "pitch_gyration": (0.3, 0.42),
    "transfer_s": (0.05, 0.12), "mu": (0.8, 1.0), "stiff_long": (9.0, 14.0), "stiff_lat": (7.0, 11.0),
    "rear_stiff_ratio": (1.02, 1.2), "shape": (1.3, 1.6), "curvature": (-0.3, 0.3), "load_sensitivity": (0.0, 0.12),
    "relax_long_share": (0.08, 0.15), "relax_lat_share": (0.1, 0.25), "wheel_inertia_share": (0.02, 0.04),
    "roll_resistance": (0.01, 0.025), "aero_pm": (0.0, 0.0008), "loose_mu": (0.75, 0.95),
    "loose_drag_mps2": (0.0, 0.15), "veg_drag_mps2": (0.0, 0.3), "front_share": 0.0, "diff_lock_ps": (0.0, 3.0),
    "feed_forward": (0.5, 1.0), "steer_damping": (0.8, 1.0), "steer_rate_radps": (0.8, 2.0),
    "max_steer_rad": (0.4, 0.5), "steer_delay_s": (0.01, 0.05), "speed_delay_s": (0.01, 0.06), "ackermann": (0.5, 1.0),
    "hill_lag_s": (0.1, 0.4), "grip_share": (0.38, 0.5),
}  # fmt: skip


@dataclass(frozen=True)
class Senses:
    """Sensors: rate of the pose, white noise as a share of the size, wander, encoder step, gyro colour, filter."""

    pose_hz: float = 50.0
    position_m: tuple[float, float] = (0.008, 0.015)
    yaw_rad: tuple[float, float] = (0.005, 0.01)
    speed_mps: tuple[float, float] = (0.02, 0.035)
    gyro_radps: tuple[float, float] = (0.006, 0.012)
    wander_m: tuple[float, float] = (0.0, 0.0)
    wander_s: float = 20.0
    encoder_mps: float = 0.0
    average_ms: float = 0.0
    gyro_colour: float = 0.0
    filter_s: tuple[float, float] = (0.0, 0.006)


@dataclass(frozen=True)
class Kind:
    """A kind of machine: ways of its parts, ranges of its numbers, hills and senses."""

    name: str
    tyre: int
    drive: int
    steer: int
    length_m: tuple[float, float]
    density: tuple[float, float]
    speeds_mps: tuple[float, float, float]
    ranges: dict
    hills: float
    senses: Senses
    substeps: int = 10
    articulated: int = 0


def _kind(name, tyre, drive, steer, size, speeds, hills, senses, substeps=10, articulated=0, **ranges) -> Kind:
    """A kind from its parts; `size` is (length, length, kg/m3, kg/m3), `speeds` (lowest, slow top, fast top)."""
    return Kind(name, tyre, drive, steer, size[:2], size[2:], speeds, ranges, hills, senses, substeps, articulated)


KINDS = {
    kind.name: kind
    for kind in [
        _kind(
            "estate", tyres.MAGIC, drives.FORCE_PI, steerings.DEAD_ZONE, (2.5, 2.9, 70, 90), (2.0, 11.0, 15.0), 0.05,
            Senses(position_m=(0.02, 0.03), wander_m=(0.02, 0.05)),
            kp=(1.2, 2.0), ki=(0.3, 0.8), accel_max_mps2=(3.0, 4.0), brake_max_mps2=(5.0, 7.0),
            actuator_s=(0.15, 0.3), drive_a=(0.15, 0.4), drive_b=(0.08, 0.15), hill_comp=(0.3, 0.6),
            steer_natural_radps=(16.0, 24.0), steer_dead_rad=(0.002, 0.006), front_share=1.0,
            compliance_radps2pm=(0.0004, 0.0012), roll_rate_radps=(9.0, 12.0), roll_damping=(5.0, 8.0),
        ),
        _kind(
            "courier_cart", tyres.BRUSH, drives.VOLTAGE, steerings.FIRST_ORDER, (0.9, 1.3, 70, 110), (0.4, 3.0, 4.5),
            0.05, Senses(pose_hz=20.0, encoder_mps=0.02, gyro_colour=0.5),
            kp=(3.0, 6.0), feed_forward=(1.0, 1.06), drive_a=(6.0, 8.0), drive_b=(0.05, 0.15), drive_c=(0.4, 0.8),
            accel_max_mps2=(2.5, 4.0), brake_max_mps2=(2.5, 4.0), actuator_s=(0.02, 0.05),
            steer_natural_radps=(12.0, 25.0), stiff_lat=(6.0, 10.0), roll_resistance=(0.02, 0.05),
        ),
        _kind(
            "electric_atv", tyres.CAMBERED, drives.TORQUE_MAP, steerings.FIRST_ORDER, (1.2, 1.5, 90, 130),
            (0.8, 6.0, 9.0), 0.09, Senses(position_m=(0.015, 0.02), pose_hz=10.0),
            kp=(2.0, 3.5), feed_forward=(0.6, 1.0), accel_max_mps2=(3.0, 4.5), brake_max_mps2=(2.2, 3.2),
            actuator_s=(0.05, 0.1), drive_a=(0.6, 1.4), drive_b=(0.1, 0.25), drive_c=(5.0, 12.0),
            hill_comp=(0.3, 0.6), steer_natural_radps=(14.0, 22.0), stiff_lat=(5.0, 8.0), front_share=(0.3, 0.5),
            roll_rate_radps=(8.0, 11.0), roll_damping=(4.0, 6.0), camber_thrust=(0.1, 0.2), height_share=(0.22, 0.28),
            roll_resistance=(0.025, 0.045),
        ),
        _kind(
            "articulated_loader", tyres.MAGIC, drives.HYDROSTATIC, steerings.ARTICULATED, (1.8, 2.6, 130, 190),
            (0.5, 4.0, 6.0), 0.06, Senses(pose_hz=20.0, wander_m=(0.01, 0.03)), articulated=1,
            kp=(4.0, 7.0), accel_max_mps2=(3.0, 4.5), brake_max_mps2=(3.0, 4.5), actuator_s=(0.25, 0.5),
            drive_a=(0.5, 0.9), drive_b=(0.05, 0.15), steer_natural_radps=(8.0, 14.0), steer_rate_radps=(0.5, 0.9),
            steer_dead_rad=(0.004, 0.012), front_share=0.5, front_swing_share=(0.3, 0.45), max_steer_rad=(0.5, 0.65),
            roll_resistance=(0.03, 0.05), stiff_lat=(5.0, 8.0),
        ),
        _kind(
            "spool_rc", tyres.HARD_FLOOR, drives.HOBBY_CONTROLLER, steerings.SECOND_ORDER, (0.25, 0.36, 160, 260),
            (0.5, 2.6, 4.0), 0.0,
            Senses(position_m=(0.003, 0.006), encoder_mps=0.03, average_ms=20.0, gyro_radps=(0.015, 0.03)),
            substeps=20, kp=(0.8, 1.6), ki=(0.6, 1.5), drive_a=(0.03, 0.06), drive_b=(0.05, 0.12), drive_c=(0.15, 0.3),
            accel_max_mps2=(3.5, 5.5), brake_max_mps2=(3.0, 5.0), actuator_s=(0.01, 0.03), diff_lock_ps=(100.0, 150.0),
            steer_natural_radps=(30.0, 45.0), steer_damping=(0.45, 0.65), steer_rate_radps=(4.0, 7.0),
            curvature=(0.1, 0.3), mu=(0.7, 0.9), stiff_long=(12.0, 18.0), relax_lat_share=(0.05, 0.1),
            pitch_rate_radps=(40.0, 55.0), pitch_damping=(30.0, 50.0),
        ),
        _kind(
            "heavy_truck", tyres.MAGIC, drives.GEARBOX, steerings.FIRST_ORDER, (3.4, 4.2, 110, 160), (2.5, 14.0, 20.0),
            0.035, Senses(position_m=(0.03, 0.05), speed_mps=(0.05, 0.08), pose_hz=10.0, filter_s=(0.0, 0.01)),
            kp=(0.7, 1.2), ki=(0.08, 0.2), accel_max_mps2=(2.2, 3.0), brake_max_mps2=(4.0, 5.5), actuator_s=(0.3, 0.5),
            drive_a=(0.35, 0.7), drive_b=(0.8, 1.4), drive_c=(0.15, 0.3), hill_comp=(0.2, 0.5),
            steer_natural_radps=(9.0, 14.0), steer_rate_radps=(0.4, 0.7), compliance_radps2pm=(0.001, 0.003),
            roll_rate_radps=(6.5, 9.0), roll_damping=(3.0, 5.0), roll_steer=(0.03, 0.08), height_share=(0.24, 0.3),
            stiff_lat=(5.5, 7.5), mu=(0.7, 0.85), grip_share=(0.28, 0.35),
        ),
        _kind(
            "field_tractor", tyres.SOIL, drives.GOVERNED_CVT, steerings.VARIABLE_RATIO, (2.1, 2.7, 130, 180),
            (0.8, 5.0, 8.0), 0.06, Senses(pose_hz=10.0, position_m=(0.015, 0.025), wander_m=(0.01, 0.03)),
            kp=(2.5, 4.0), accel_max_mps2=(2.5, 3.5), brake_max_mps2=(2.5, 3.5), actuator_s=(0.3, 0.6),
            drive_a=(0.06, 0.12), drive_b=(0.3, 0.5), steer_natural_radps=(5.0, 8.0), steer_rate_radps=(0.35, 0.6),
            mu=(0.65, 0.8), soil_sinkage=(0.03, 0.06), soil_shear_m=(0.01, 0.02), soil_slip_sinkage=(0.5, 1.5),
            stiff_long=(10.0, 10.0), stiff_lat=(7.0, 9.0), diff_lock_ps=(2.0, 8.0), grip_share=(0.3, 0.4),
        ),
        _kind(
            "hub_rover", tyres.BRUSH, drives.HUB_MOTORS, steerings.FOUR_WHEELS, (0.5, 0.8, 90, 140), (0.3, 1.6, 2.6),
            0.09, Senses(position_m=(0.005, 0.01), average_ms=40.0),
            kp=(4.0, 7.0), ki=(3.0, 8.0), drive_a=(0.01, 0.03), accel_max_mps2=(3.5, 5.0), actuator_s=(0.03, 0.06),
            front_share=0.5, rear_steer=(0.2, 0.45), steer_natural_radps=(14.0, 22.0), roll_resistance=(0.02, 0.04),
            diff_lock_ps=0.0,
            pitch_rate_radps=(40.0, 55.0), pitch_damping=(30.0, 50.0),
        ),
        _kind(
            "quad_bike", tyres.CAMBERED, drives.CLUTCH, steerings.STICTION, (1.15, 1.35, 100, 140), (1.0, 6.5, 9.5),
            0.1, Senses(position_m=(0.015, 0.025), wander_m=(0.02, 0.04), gyro_colour=0.7),
            kp=(1.8, 2.8), ki=(0.4, 0.9), accel_max_mps2=(3.5, 5.0), brake_max_mps2=(4.0, 5.5), actuator_s=(0.08, 0.15),
            drive_a=(4.0, 9.0), drive_b=(0.3, 0.8), drive_c=(0.08, 0.18), hill_comp=(0.4, 0.7), hill_lag_s=(0.3, 0.6),
            steer_natural_radps=(18.0, 26.0), steer_dead_rad=(0.006, 0.015), roll_rate_radps=(7.5, 10.0),
            roll_damping=(3.5, 5.0), roll_steer=(0.04, 0.1), height_share=(0.26, 0.32), camber_thrust=(0.1, 0.25),
            stiff_lat=(5.0, 8.0), roll_resistance=(0.02, 0.04), grip_share=(0.32, 0.42),
        ),
        _kind(
            "pavement_robot", tyres.BRUSH, drives.CASCADE, steerings.STICTION, (0.4, 0.65, 90, 150), (0.3, 1.6, 2.4),
            0.0, Senses(position_m=(0.006, 0.012), filter_s=(0.004, 0.012), gyro_colour=0.4),
            kp=(4.0, 7.0), ki=(1.5, 4.0), accel_max_mps2=(2.2, 3.2), brake_max_mps2=(2.2, 3.2), actuator_s=(0.03, 0.06),
            drive_a=(0.1, 0.25), drive_b=(4.0, 10.0), steer_natural_radps=(16.0, 26.0), steer_dead_rad=(0.01, 0.025),
            feed_forward=(0.6, 1.0), max_steer_rad=(0.45, 0.6),
            pitch_rate_radps=(40.0, 55.0), pitch_damping=(30.0, 50.0),
        ),
        _kind(
            "aero_racer", tyres.MAGIC, drives.SCHEDULED, steerings.SECOND_ORDER, (1.5, 1.9, 80, 110), (2.0, 13.0, 18.0),
            0.0, Senses(position_m=(0.015, 0.02), speed_mps=(0.03, 0.05)),
            kp=(2.5, 4.0), ki=(0.6, 1.5), accel_max_mps2=(5.0, 7.0), brake_max_mps2=(6.0, 8.0), actuator_s=(0.04, 0.08),
            drive_a=(0.5, 1.5), drive_b=(0.08, 0.15), drive_c=(0.8, 2.0), aero_pm=(0.002, 0.004), mu=(1.1, 1.4),
            steer_natural_radps=(24.0, 36.0), steer_damping=(0.7, 0.9), max_steer_rad=(0.35, 0.42),
            stiff_lat=(12.0, 17.0), stiff_long=(14.0, 20.0), height_share=(0.1, 0.14), load_sensitivity=(0.08, 0.15),
        ),
        _kind(
            "park_cart", tyres.CAMBERED, drives.SAMPLED, steerings.FIRST_ORDER, (1.5, 1.9, 60, 90), (0.8, 4.5, 6.5),
            0.06, Senses(pose_hz=10.0, position_m=(0.01, 0.02), wander_m=(0.02, 0.05), average_ms=40.0),
            kp=(1.5, 2.5), ki=(0.4, 1.0), accel_max_mps2=(2.2, 3.2), brake_max_mps2=(2.5, 3.5), actuator_s=(0.08, 0.16),
            drive_a=(0.04, 0.06), hill_comp=(0.2, 0.5), steer_natural_radps=(10.0, 16.0), steer_rate_radps=(0.6, 1.2),
            compliance_radps2pm=(0.003, 0.008), camber_thrust=(0.15, 0.3), roll_rate_radps=(8.0, 11.0),
            roll_damping=(4.0, 7.0), stiff_lat=(5.0, 7.0), height_share=(0.2, 0.27), roll_resistance=(0.02, 0.035),
        ),
        _kind(
            "orchard_mule", tyres.SOIL, drives.VOLTAGE, steerings.FOUR_WHEELS, (1.0, 1.4, 110, 160), (0.4, 2.5, 4.0),
            0.08, Senses(pose_hz=20.0, wander_m=(0.005, 0.02), encoder_mps=0.015),
            kp=(4.0, 8.0), feed_forward=(1.02, 1.08), drive_a=(7.0, 9.0), drive_b=(0.1, 0.2), drive_c=(0.5, 0.9),
            accel_max_mps2=(2.5, 4.0), brake_max_mps2=(2.5, 4.0), actuator_s=(0.03, 0.06), front_share=0.5,
            rear_steer=(0.3, 0.6), steer_natural_radps=(8.0, 14.0), mu=(0.65, 0.8), soil_sinkage=(0.02, 0.05),
            soil_shear_m=(0.006, 0.012), soil_slip_sinkage=(0.5, 1.5), stiff_long=(10.0, 10.0), stiff_lat=(7.0, 9.0),
        ),
    ]
}  # fmt: skip

NAMES = """
alder aspen beech birch cedar cherry chestnut cypress ebony elder fir hawthorn hazel hemlock holly hornbeam juniper
larch laurel lime linden maple medlar mulberry oak olive pear pine plane plum poplar quince rowan sallow spruce sumac
sycamore tamarind teak walnut willow yew
""".split()


def draw_numbers(kind: Kind, generator) -> dict:
    """Every number of a vehicle of a kind: a value, or one from its range."""
    ranges = COMMON | kind.ranges
    return {name: generator.uniform(*r) if isinstance(r, tuple) else r for name, r in ranges.items()}


def derived(kind: Kind, numbers: dict, generator) -> dict:
    """The record of a machine from drawn numbers: sizes, inertias and speeds follow from its length."""
    n = dict(numbers)
    length = generator.uniform(*kind.length_m)
    mass = generator.uniform(*kind.density) * length**3 if length < 2.0 else generator.uniform(*kind.density) * 8.0 * (
        length / 2.0
    ) ** 2
    radius = length * generator.uniform(0.11, 0.16)
    n |= {"mass_kg": mass, "radius_m": radius, "front_m": length * n.pop("centre")}
    n["rear_m"] = length - n["front_m"]
    n["inertia_kgm2"] = mass * (length * n.pop("gyration")) ** 2 * 1.15
    n["track_m"], n["height_m"] = length * n.pop("width_share"), length * n.pop("height_share")
    n["roll_gain"] = 1.0 / (1.25 * n["height_m"])
    n["pitch_gain"] = n["height_m"] / (length * n.pop("pitch_gyration")) ** 2
    n["relax_long_m"], n["relax_lat_m"] = length * n.pop("relax_long_share"), length * n.pop("relax_lat_share")
    n["wheel_inertia_kgm2"] = n.pop("wheel_inertia_share") * mass * radius**2
    n["soil_shear_m"] = n.get("soil_shear_m", 0.01) * length / 1.5
    n["min_speed_mps"] = kind.speeds_mps[0]
    n["max_speed_mps"] = generator.uniform(*kind.speeds_mps[1:])
    n["lateral_mps2"] = n.pop("grip_share") * n["mu"] * 9.81
    parts = {"tyre_kind": kind.tyre, "drive_kind": kind.drive, "steer_kind": kind.steer}
    return n | parts | {"articulated": kind.articulated, "substeps": kind.substeps}


def top_radius(machine: dict) -> float:
    """Radius of the tightest turn at full speed [m]."""
    length = machine["front_m"] + machine["rear_m"]
    grip = machine["max_speed_mps"] ** 2 / machine["lateral_mps2"]
    return max(grip, length / math.tan(0.9 * machine["max_steer_rad"]))
