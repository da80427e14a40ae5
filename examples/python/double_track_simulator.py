"""A simulator that `surefoot gap diagnose --simulator` can ask: a car on four tyres, in plain Python.

    surefoot gap diagnose CASE --simulator "python3 examples/python/double_track_simulator.py"

It speaks JSON lines on standard input and output (docs/simulator_protocol.md), by `serve` of the file beside it. To put
a simulator of your own in its place, replace `Car`. What is to be said to a person goes to standard error.

The car: a rigid body on a plane that may slope, four tyres whose side force saturates (F = mu Fz sin(C atan(B alpha)))
and shares the grip with the drive, loads that move with acceleration, rear-wheel drive through a slow motor under a
proportional speed controller, a servo of first order with a rate limit. Body frame forward-left-up.
"""

import math

from simulator_protocol import Message, Row, serve

GRAVITY_MPS2 = 9.81
LONGEST_STEP_S = 0.01
AIR_DENSITY_KGPM3 = 1.2
# Slip angles are taken at no less than this speed: below it tyres that have no length would shake.
SLOWEST_MPS = 0.7
TYRE_SHAPE = 1.35

KNOBS = [
    {"name": "tyre_friction", "unit": "-", "low": 0.2, "high": 1.6, "default": 0.9},
    {"name": "tyre_stiffness", "unit": "1/rad", "low": 4.0, "high": 30.0, "default": 12.0},
    {"name": "mass_ratio", "unit": "-", "low": 0.5, "high": 2.5, "default": 1.0},
    {"name": "rolling_resistance", "unit": "-", "low": 0.0, "high": 0.2, "default": 0.015},
    {"name": "motor_time_constant_s", "unit": "s", "low": 0.02, "high": 1.5, "default": 0.1},
    {"name": "servo_time_constant_s", "unit": "s", "low": 0.01, "high": 0.8, "default": 0.08},
]


def clamp(value: float, low: float, high: float) -> float:
    """`value`, or the bound that it lies beyond."""
    return low if value < low else high if value > high else value


class Car:
    """A car of the size that the vehicle has; its state is that of the centre of mass."""

    def __init__(self, vehicle: Message, knobs: dict[str, float]) -> None:
        self.wheelbase_m = vehicle["wheelbase_m"]
        self.steering_max_rad = vehicle["steering_max_rad"]
        nominal_kg = 75.0 * self.wheelbase_m**3
        self.nominal_kg = nominal_kg
        self.mass_kg = nominal_kg * knobs["mass_ratio"]
        self.inertia_kgm2 = 0.25 * self.mass_kg * self.wheelbase_m**2
        self.front_m = 0.5 * self.wheelbase_m
        self.rear_m = self.wheelbase_m - self.front_m
        self.half_track_m = 0.29 * self.wheelbase_m
        self.height_m = 0.2 * self.wheelbase_m
        self.air_kgpm = 0.5 * AIR_DENSITY_KGPM3 * 0.08 * self.wheelbase_m**2
        self.force_max_n = 4.0 * nominal_kg
        self.controller_per_s = 2.5
        self.steering_rate_max_radps = 1.2
        self.friction = knobs["tyre_friction"]
        self.stiffness_per_rad = knobs["tyre_stiffness"]
        self.rolling_resistance = knobs["rolling_resistance"]
        self.motor_s = knobs["motor_time_constant_s"]
        self.servo_s = knobs["servo_time_constant_s"]

    def begin(self, start: dict[str, float]) -> None:
        """Stands where the run begins, with that speed, the actuators at rest."""
        self.yaw_rad = start["yaw_rad"]
        self.x_m = start["x_m"] + self.rear_m * math.cos(self.yaw_rad)
        self.y_m = start["y_m"] + self.rear_m * math.sin(self.yaw_rad)
        self.forward_mps = start["speed_mps"]
        self.yaw_rate_radps = start["yaw_rate_radps"]
        self.left_mps = self.yaw_rate_radps * self.rear_m
        self.steering_rad = 0.0
        self.force_n = 0.0
        self.acceleration_mps2 = [0.0, 0.0]

    def measured(self) -> Row:
        """x, y [m], yaw [rad], speed [m/s], yaw rate [rad/s], speed to the left [m/s] at mid rear axle."""
        sine, cosine = math.sin(self.yaw_rad), math.cos(self.yaw_rad)
        x_m, y_m = self.x_m - self.rear_m * cosine, self.y_m - self.rear_m * sine
        left_mps = self.left_mps - self.rear_m * self.yaw_rate_radps
        return x_m, y_m, self.yaw_rad, self.forward_mps, self.yaw_rate_radps, left_mps

    def actuate(self, command_mps: float, command_rad: float, step_s: float) -> None:
        """Servo and motor follow their commands."""
        wanted_rad = clamp(command_rad, -self.steering_max_rad, self.steering_max_rad)
        rate = clamp((wanted_rad - self.steering_rad) / self.servo_s,
                     -self.steering_rate_max_radps, self.steering_rate_max_radps)
        way_rad = rate * step_s
        left_rad = wanted_rad - self.steering_rad
        self.steering_rad += left_rad if abs(way_rad) > abs(left_rad) else way_rad
        wanted_n = self.nominal_kg * self.controller_per_s * (command_mps - self.forward_mps)
        wanted_n = clamp(wanted_n, -self.force_max_n, self.force_max_n)
        self.force_n += (wanted_n - self.force_n) * (1.0 - math.exp(-step_s / self.motor_s))

    def loads_n(self) -> list[float]:
        """Loads of the tyres: front left, front right, rear left, rear right."""
        weight_n = self.mass_kg * GRAVITY_MPS2
        ahead_n = self.mass_kg * self.acceleration_mps2[0] * self.height_m / self.wheelbase_m
        left_n = 0.5 * self.mass_kg * self.acceleration_mps2[1] * self.height_m / (2.0 * self.half_track_m)
        front_n = 0.5 * (weight_n * self.rear_m / self.wheelbase_m - ahead_n)
        rear_n = 0.5 * (weight_n * self.front_m / self.wheelbase_m + ahead_n)
        least_n = 0.02 * weight_n
        return [max(load, least_n) for load in (front_n - left_n, front_n + left_n, rear_n - left_n, rear_n + left_n)]

    def step(
        self, command_mps: float, command_rad: float, slope_ahead: float, slope_left: float, step_s: float
    ) -> None:
        """Goes one step."""
        self.actuate(command_mps, command_rad, step_s)
        v, u, r = self.forward_mps, self.left_mps, self.yaw_rate_radps
        pull, side, turn = 0.0, 0.0, 0.0
        for wheel, load_n in enumerate(self.loads_n()):
            is_front = wheel < 2
            ahead_m = self.front_m if is_front else -self.rear_m
            left_m = self.half_track_m if wheel % 2 == 0 else -self.half_track_m
            angle_rad = self.steering_rad if is_front else 0.0
            along = max(abs(v - r * left_m), SLOWEST_MPS)
            slip_rad = angle_rad * (1.0 if v >= 0.0 else -1.0) - math.atan((u + r * ahead_m) / along)
            grip_n = self.friction * load_n
            drive_n = 0.0 if is_front else clamp(0.5 * self.force_n, -0.99 * grip_n, 0.99 * grip_n)
            left_grip_n = math.sqrt(max(grip_n * grip_n - drive_n * drive_n, 0.0))
            corner_n = left_grip_n * math.sin(TYRE_SHAPE * math.atan(self.stiffness_per_rad * slip_rad / TYRE_SHAPE))
            sine, cosine = math.sin(angle_rad), math.cos(angle_rad)
            ahead_n, left_n = drive_n * cosine - corner_n * sine, drive_n * sine + corner_n * cosine
            pull += ahead_n
            side += left_n
            turn += ahead_m * left_n - left_m * ahead_n
        pull -= self.rolling_resistance * self.mass_kg * GRAVITY_MPS2 * clamp(10.0 * v, -1.0, 1.0)
        pull -= self.air_kgpm * v * abs(v)
        pull -= self.mass_kg * GRAVITY_MPS2 * slope_ahead
        side -= self.mass_kg * GRAVITY_MPS2 * slope_left
        self.acceleration_mps2 = [pull / self.mass_kg, side / self.mass_kg]
        self.forward_mps += (self.acceleration_mps2[0] + u * r) * step_s
        self.left_mps += (self.acceleration_mps2[1] - v * r) * step_s
        self.yaw_rate_radps += turn / self.inertia_kgm2 * step_s
        sine, cosine = math.sin(self.yaw_rad), math.cos(self.yaw_rad)
        self.x_m += (self.forward_mps * cosine - self.left_mps * sine) * step_s
        self.y_m += (self.forward_mps * sine + self.left_mps * cosine) * step_s
        self.yaw_rad += self.yaw_rate_radps * step_s


def driven(vehicle: Message, run: Message) -> list[Row]:
    """Every row of a run, at the middle of the rear axle; the first is the start."""
    car = Car(vehicle, run["knobs"])
    car.begin(run["start"])
    n_parts = max(1, math.ceil(run["step_s"] / LONGEST_STEP_S - 1e-9))
    step_s = run["step_s"] / n_parts
    inputs = zip(run["command_speed_mps"], run["command_steering_rad"], run["slope_ahead"], run["slope_left"])
    rows = [car.measured()]
    for speed_mps, steering_rad, ahead, left in list(inputs)[:-1]:
        for _ in range(n_parts):
            car.step(speed_mps, steering_rad, ahead, left, step_s)
        rows.append(car.measured())
    return rows


if __name__ == "__main__":
    serve("double track", KNOBS, driven)
