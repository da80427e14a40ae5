"""A robot's own driver: a simple vehicle on a plain with one rock in the way, driven by Surefoot's processes.

    pip install surefoot-*.whl
    surefoot up --robot examples/robot.toml &
    python3 examples/python/drive_robot.py --run car

It tells where it is, what its inertial unit feels and what its actuators were told, what a ring of range rays sees from
where it sits and where to go, reads commands and risk maps, and stops when what the last command was decided on is too
old. Prints one line of JSON and ends with 0 when it has come to its goal, else with 1.
"""

import argparse
import json
import math
import re
import sys
import time

import numpy as np
import surefoot

PERIOD_NS = 20_000_000
IMU_PERIOD_NS = 5_000_000
GRAVITY_MPS2 = 9.81
CYCLES_PER_SCAN = 10
TIME_LIMIT_S = 60.0
WHEELBASE_M = 0.25
WHEEL_RADIUS_M = 0.05
SENSOR_M = (0.12, 0.0, 0.35)  # The first sensor of examples/robot.toml.
SENSOR = 1
GOAL_M, TOLERANCE_M = (5.0, 0.0), 0.3
ROCK_M, ROCK_RADIUS_M, ROCK_HEIGHT_M = (2.5, 0.1), 0.35, 0.5
OPEN, OBSTACLE = 0, 3
GOAL_REACHED, TIMED_OUT = 1, 6


class Robot:
    """A bicycle without slip whose actuators follow with a lag of 0.2 s."""

    def __init__(self) -> None:
        self.x_m = self.y_m = self.yaw_rad = self.speed_mps = self.steering_rad = 0.0
        self.yaw_rate_radps = self.acceleration_mps2 = 0.0

    def advance(self, speed_mps: float, steering_rad: float, step_s: float) -> None:
        share = step_s / 0.2
        self.acceleration_mps2 = (speed_mps - self.speed_mps) / 0.2
        self.speed_mps += share * (speed_mps - self.speed_mps)
        self.steering_rad += share * (steering_rad - self.steering_rad)
        self.yaw_rate_radps = self.speed_mps * math.tan(self.steering_rad) / WHEELBASE_M
        self.x_m += step_s * self.speed_mps * math.cos(self.yaw_rad)
        self.y_m += step_s * self.speed_mps * math.sin(self.yaw_rad)
        self.yaw_rad += step_s * self.yaw_rate_radps

    def tell_odometry(self, driver: surefoot.Driver, at_ns: int) -> None:
        driver.publish_odometry(
            (self.x_m, self.y_m, WHEEL_RADIUS_M),
            (0.0, 0.0, self.yaw_rad),
            (self.speed_mps, 0.0),
            self.yaw_rate_radps,
            steering_rad=self.steering_rad,
            valid_at_ns=at_ns,
        )

    def tell_imu(self, driver: surefoot.Driver, until_ns: int) -> None:
        """The samples of the last period: what it felt on a plain, all alike."""
        n = PERIOD_NS // IMU_PERIOD_NS
        times_ns = until_ns - IMU_PERIOD_NS * np.arange(n - 1, -1, -1)
        felt = [self.acceleration_mps2, self.speed_mps * self.yaw_rate_radps, GRAVITY_MPS2]
        turned = [0.0, 0.0, self.yaw_rate_radps]
        driver.publish_imu(
            times_ns.astype(np.uint64), np.tile(np.array(felt, np.float32), (n, 1)), np.tile(np.array(turned, np.float32), (n, 1))
        )

    def tell_scan(self, driver: surefoot.Driver, at_ns: int) -> None:
        """Returns of 240 x 48 rays, in the frame of the sensor."""
        angles_rad = np.arange(240) * math.tau / 240
        slopes = np.tan(np.radians(np.arange(48) - 52.0))
        height_m = SENSOR_M[2] + WHEEL_RADIUS_M
        ground_m = np.where(slopes < -0.06, height_m / -slopes, np.inf)
        rock_m = np.array([self.distance_to_rock(angle_rad) for angle_rad in angles_rad])[:, None]
        is_rock = (rock_m < ground_m) & (height_m + slopes * np.minimum(rock_m, 1e3) <= ROCK_HEIGHT_M)
        hit_m = np.where(is_rock, rock_m, ground_m)
        is_seen = hit_m <= 6.0
        reach_m = np.where(is_seen, hit_m, 0.0)
        along, across = np.cos(angles_rad)[:, None], np.sin(angles_rad)[:, None]
        points = np.stack([reach_m * along, reach_m * across, reach_m * slopes], axis=-1)
        classes = np.where(is_rock, OBSTACLE, OPEN).astype(np.uint8)
        driver.publish_scan(points[is_seen].astype(np.float32), classes[is_seen], sensor=SENSOR, valid_at_ns=at_ns)

    def distance_to_rock(self, angle_rad: float) -> float:
        """Along a ray of the sensor, whose angle counts from ahead [m]."""
        cos_yaw, sin_yaw = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        dx_m = ROCK_M[0] - self.x_m - cos_yaw * SENSOR_M[0]
        dy_m = ROCK_M[1] - self.y_m - sin_yaw * SENSOR_M[0]
        bearing_rad = angle_rad + self.yaw_rad
        along_m = dx_m * math.cos(bearing_rad) + dy_m * math.sin(bearing_rad)
        across_m = -dx_m * math.sin(bearing_rad) + dy_m * math.cos(bearing_rad)
        if along_m <= 0.0 or abs(across_m) >= ROCK_RADIUS_M:
            return math.inf
        return along_m - math.sqrt(ROCK_RADIUS_M**2 - across_m**2)


def sleep_until(deadline_ns: int) -> None:
    while (left_ns := deadline_ns - time.monotonic_ns()) > 0:
        time.sleep(left_ns * 1e-9)


def drive(run: str) -> dict[str, bool | float]:
    driver, robot = surefoot.Driver(run, surefoot.Vehicle("rc_car")), Robot()
    began_ns, n_maps, nearest_m, left_m = time.monotonic_ns(), 0, math.inf, math.inf
    for cycle in range(int(TIME_LIMIT_S * 1e9) // PERIOD_NS):
        at_ns = began_ns + cycle * PERIOD_NS
        sleep_until(at_ns)
        robot.tell_odometry(driver, at_ns)
        robot.tell_imu(driver, at_ns)
        if cycle % CYCLES_PER_SCAN == 0:
            robot.tell_scan(driver, at_ns)
        if cycle % 50 == 0:
            driver.publish_mission(GOAL_M, TOLERANCE_M, cycle * PERIOD_NS * 1e-9)
        if driver.run.risk_map() is not None:
            n_maps += 1
        speed_mps, steering_rad, _ = driver.carry_out()
        robot.advance(speed_mps, steering_rad, PERIOD_NS * 1e-9)
        nearest_m = min(nearest_m, math.dist((robot.x_m, robot.y_m), ROCK_M))
        left_m = math.dist((robot.x_m, robot.y_m), GOAL_M)
        if left_m <= TOLERANCE_M:
            break
    time_s = (time.monotonic_ns() - began_ns) * 1e-9
    outcome = GOAL_REACHED if left_m <= TOLERANCE_M else TIMED_OUT
    driver.publish_mission(GOAL_M, TOLERANCE_M, time_s, outcome=outcome)
    return {
        "reached": left_m <= TOLERANCE_M,
        "time_s": round(time_s, 2),
        "distance_to_goal_m": round(left_m, 3),
        "nearest_to_rock_m": round(nearest_m, 3),
        "commands": driver.n_commands,
        "risk_maps": n_maps,
    }


def run_name(word: str) -> str:
    """A word that may name a run, as for `surefoot up --run`; argparse tells of any other."""
    if re.fullmatch("[A-Za-z0-9_-]{1,32}", word) is None:
        raise argparse.ArgumentTypeError(f"expected 1 to 32 letters, digits, - or _, found {word!r}")
    return word


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--run", type=run_name, default="field", help="name of the run to be the vehicle of")
    told = drive(parser.parse_args().run)
    print(json.dumps(told))
    return 0 if told["reached"] else 1


if __name__ == "__main__":
    sys.exit(main())
