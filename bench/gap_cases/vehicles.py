"""The vehicles of the sets; none has the wheelbase, mass or actuators of another one."""

from dataclasses import dataclass, field

from commonroad_plant import CommonRoadPlant, vehicle_parameters
from ground import GroundShape
from mujoco_car import Body
from mujoco_plant import MujocoPlant
from parts import Parts

FIELD = GroundShape(nodes=160, resolution_m=1.0, height_std_m=1.2, hill_width_m=13.0)
YARD = GroundShape(nodes=220, resolution_m=0.15, height_std_m=0.28, hill_width_m=2.5)


@dataclass(frozen=True)
class CommonRoadVehicle:
    """A vehicle of CommonRoad's parameter files, changed in places."""

    name: str
    model: str
    parameter_set: int
    parts: Parts
    speeds_mps: tuple[float, float]
    lateral_acceleration_mps2: float
    changes: dict[str, float] = field(default_factory=dict)
    shape: GroundShape = FIELD
    scale: str = "car"

    @property
    def plant(self) -> str:
        """What the labels call the plant."""
        return f"commonroad_{self.model}"

    @property
    def wheelbase_m(self) -> float:
        """Distance of the axles."""
        parameters = vehicle_parameters(self.parameter_set, self.changes)
        return parameters.a + parameters.b

    def build(self, injection: dict, ground) -> CommonRoadPlant:
        """The plant with an injection, not yet placed."""
        return CommonRoadPlant(self, injection, ground)


@dataclass(frozen=True)
class MujocoVehicle:
    """A car of `mujoco_car`."""

    name: str
    body: Body
    parts: Parts
    speeds_mps: tuple[float, float]
    lateral_acceleration_mps2: float
    shape: GroundShape = YARD
    scale: str = "small"
    plant: str = "mujoco"

    @property
    def wheelbase_m(self) -> float:
        """Distance of the axles."""
        return self.body.wheelbase_m

    def build(self, injection: dict, ground) -> MujocoPlant:
        """The plant with an injection, not yet placed."""
        return MujocoPlant(self, injection, ground)


def _parts(servo: tuple[float, float, float], motor: tuple[float, float, float, float], friction: float) -> Parts:
    """Parts from (time constant, rate, delay) and (gain, traction, braking, time constant)."""
    return Parts(*servo, *motor, friction)


VEHICLES = {
    vehicle.name: vehicle
    for vehicle in [
        CommonRoadVehicle(
            "saloon", "std", 2, _parts((0.06, 1.2, 0.02), (1.9, 4.5, 5.0, 0.05), 1.05), (2.5, 6.5), 3.1
        ),
        CommonRoadVehicle(
            "estate", "mb", 1, _parts((0.08, 1.0, 0.0), (1.4, 4.0, 4.0, 0.08), 1.0), (2.5, 7.5), 2.8,
            {"a": 1.22, "b": 1.48, "m_s": 1320.0, "I_z": 2050.0, "I_y_s": 1800.0},
        ),
        MujocoVehicle(
            "rover", Body(7.5, 0.42, 0.30, 0.07, 0.03, 0.47, 3.5, 0.6, False),
            _parts((0.07, 6.0, 0.02), (4.5, 4.5, 5.0, 0.03), 0.95), (0.3, 2.4), 2.8,
        ),
        CommonRoadVehicle(
            "lorry", "std", 3, _parts((0.11, 0.8, 0.04), (1.1, 3.0, 4.0, 0.15), 0.95), (2.5, 6.0), 2.4,
            {"a": 1.75, "b": 1.55, "m_s": 3300.0, "I_z": 7200.0, "I_y_w": 4.0, "h_s": 0.9},
        ),
        CommonRoadVehicle(
            "coupe", "mb", 2, _parts((0.05, 1.6, 0.02), (2.2, 5.0, 5.0, 0.05), 1.05), (3.0, 8.0), 3.3
        ),
        MujocoVehicle(
            "truck", Body(62.0, 0.95, 0.66, 0.15, 0.10, 0.42, 2.2, 0.45, True),
            _parts((0.12, 3.0, 0.04), (2.8, 3.5, 4.0, 0.08), 0.85), (0.5, 3.6), 2.6,
            GroundShape(nodes=220, resolution_m=0.25, height_std_m=0.45, hill_width_m=4.0),
        ),
        CommonRoadVehicle(
            "roadster", "std", 1, _parts((0.07, 1.3, 0.03), (1.6, 5.0, 4.0, 0.06), 1.0), (2.5, 7.0), 3.2,
            {"a": 1.05, "b": 1.15, "m_s": 830.0, "I_z": 980.0},
        ),
        CommonRoadVehicle(
            "van", "mb", 3, _parts((0.07, 1.1, 0.03), (1.3, 4.5, 3.5, 0.10), 0.95), (2.5, 6.5), 2.7,
            {"a": 1.30, "b": 1.55, "m_s": 1650.0, "I_z": 3100.0},
        ),
        MujocoVehicle(
            "buggy", Body(14.0, 0.66, 0.46, 0.10, 0.05, 0.50, 2.8, 0.7, False),
            _parts((0.09, 8.0, 0.03), (6.5, 5.0, 5.0, 0.02), 1.0), (0.3, 3.0), 3.2,
        ),
        CommonRoadVehicle(
            "hatchback", "std", 2, _parts((0.05, 1.5, 0.02), (1.7, 4.0, 4.5, 0.07), 0.98), (2.5, 6.8), 2.9,
            {"a": 1.00, "b": 1.45, "m_s": 1010.0, "I_z": 1450.0},
        ),
        CommonRoadVehicle(
            "pickup", "mb", 1, _parts((0.09, 0.9, 0.04), (1.2, 3.6, 4.2, 0.12), 1.02), (2.5, 7.0), 2.6,
            {"a": 1.42, "b": 1.68, "m_s": 1850.0, "I_z": 3900.0},
        ),
        MujocoVehicle(
            "crawler", Body(28.0, 0.78, 0.55, 0.12, 0.07, 0.46, 2.5, 0.55, True),
            _parts((0.10, 5.0, 0.02), (3.6, 4.0, 4.5, 0.05), 0.9), (0.4, 3.2), 2.7,
            GroundShape(nodes=220, resolution_m=0.2, height_std_m=0.35, hill_width_m=3.2),
        ),
    ]
}  # fmt: skip
