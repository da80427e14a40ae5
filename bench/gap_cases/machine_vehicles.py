"""A vehicle of a kind: its machine, its map and its sensors, drawn from the names of set and kind."""

from dataclasses import dataclass

import numpy as np

from ground import Ground, GroundShape
from machine_kinds import KINDS, NAMES, Kind, derived, draw_numbers, top_radius
from machine_types import MACHINE, record
from set_files import seed_of

HILL_WIDTH_SHARE, NODES_A_HILL = 0.1, 6
CORNERS_TO_EDGE = 5.0


@dataclass(frozen=True)
class Vehicle:
    """One vehicle of a set."""

    name: str
    kind: Kind
    machine: np.ndarray
    ground: Ground
    radius_m: float
    noise: dict
    wander_m: float
    filter_s: float

    def number(self, name: str) -> float:
        """A number of the machine."""
        return float(self.machine[name][0])

    @property
    def length_m(self) -> float:
        """Wheelbase."""
        return self.number("front_m") + self.number("rear_m")

    def place(self, harder: float) -> tuple:
        """What the compiled loop needs of the map; `harder` raises the lateral acceleration asked for."""
        ground = self.ground
        lateral = harder * self.number("lateral_mps2")
        resolution = ground.shape.resolution_m
        return ground.height_m, ground.terrain_class, ground.half_extent_m, resolution, self.radius_m, lateral


def _ground(kind: Kind, length_m: float, radius_m: float, seed: int) -> Ground:
    """A map wide enough to turn home on, with hills as steep as the kind climbs."""
    half_m = max(CORNERS_TO_EDGE * radius_m, 8.0 * length_m)
    width_m = max(HILL_WIDTH_SHARE * half_m, 1.2 * length_m)
    resolution_m = round(width_m / NODES_A_HILL, 3)
    nodes = 2 * int(half_m / resolution_m) + 1
    ground = Ground(GroundShape(nodes, resolution_m, 1.2 * kind.hills * width_m, width_m), seed)
    # A zero without a sign, where hills of no height were multiplied out.
    ground.height_m = ground.height_m + 0.0
    return ground


def _noise(kind: Kind, generator: np.random.Generator) -> dict:
    """Standard deviations of the white noise; steps of an encoder count as noise."""
    senses = kind.senses
    position, yaw = generator.uniform(*senses.position_m), generator.uniform(*senses.yaw_rad)
    speed, gyro = generator.uniform(*senses.speed_mps), generator.uniform(*senses.gyro_radps)
    speed = np.hypot(speed, senses.encoder_mps / 12**0.5)
    noise = {"x": position, "y": position, "z": 1.3 * position, "roll": 0.7 * yaw, "pitch": 0.7 * yaw, "yaw": yaw}
    return {name: round(float(value), 5) for name, value in (noise | {"vx": speed, "vy": speed, "wz": gyro}).items()}


def vehicle_of(set_name: str, kind_name: str) -> Vehicle:
    """The vehicle of a kind in a set."""
    kind, seed = KINDS[kind_name], seed_of(set_name, kind_name, "vehicle")
    generator = np.random.default_rng(seed)
    numbers = derived(kind, draw_numbers(kind, generator), generator)
    names = np.random.default_rng(seed_of(set_name, "names")).permutation(NAMES)
    radius_m, length_m = top_radius(numbers), numbers["front_m"] + numbers["rear_m"]
    return Vehicle(
        str(names[list(KINDS).index(kind_name)]),
        kind,
        record(MACHINE, numbers),
        _ground(kind, length_m, radius_m, seed),
        radius_m,
        _noise(kind, generator),
        float(generator.uniform(*kind.senses.wander_m)),
        float(generator.uniform(*kind.senses.filter_s)),
    )
