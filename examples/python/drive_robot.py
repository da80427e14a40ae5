"""A robot's own driver: a simple vehicle on a plain with one rock in the way, driven by Surefoot's processes.

    pip install iceoryx2==0.10.0
    surefoot up --robot examples/robot.toml &
    python3 examples/python/drive_robot.py --run car

It tells where it is, what its inertial unit feels and what its actuators were told, what a ring of range rays sees from
where it sits and where to go, reads commands and risk maps, and stops when what the last command was decided on is too
old. Prints one line of JSON and ends with 0 when it has come to its goal, else with 1.
"""

import argparse
import json
import math
import sys

import surefoot_layout as layout
from channels import Bus, Inlet, Outlet, now_ns, run_name
from watchdog import Watchdog

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
UNDER_WAY, GOAL_REACHED, TIMED_OUT = 0, 1, 6


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

    def odometry(self, applied: dict) -> layout.OdometryRecord:
        return layout.OdometryRecord(
            position_m=(self.x_m, self.y_m, WHEEL_RADIUS_M),
            attitude_rad=(0.0, 0.0, self.yaw_rad),
            velocity_mps=(self.speed_mps, 0.0),
            yaw_rate_radps=self.yaw_rate_radps,
            wheel_speed_mps=self.speed_mps,
            steering_rad=self.steering_rad,
            **applied,
        )

    def imu(self, until_ns: int):
        """The samples of the last period: what it felt on a plain, all alike."""
        n = PERIOD_NS // IMU_PERIOD_NS
        samples = (layout.ImuRecord * n)()
        for place, sample in enumerate(samples):
            sample.valid_at_ns = until_ns - (n - 1 - place) * IMU_PERIOD_NS
            lateral_mps2 = self.speed_mps * self.yaw_rate_radps
            sample.acceleration_mps2[:] = (self.acceleration_mps2, lateral_mps2, GRAVITY_MPS2)
            sample.angular_rate_radps[:] = (0.0, 0.0, self.yaw_rate_radps)
        return samples

    def scan(self):
        """Returns of 240 x 48 rays, in the frame of the sensor."""
        points = []
        cos_yaw, sin_yaw = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        height_m = SENSOR_M[2] + WHEEL_RADIUS_M
        east_m = self.x_m + cos_yaw * SENSOR_M[0]
        north_m = self.y_m + sin_yaw * SENSOR_M[0]
        for azimuth in range(240):
            angle_rad = azimuth * math.tau / 240
            rock_m = self.distance_to_rock(east_m, north_m, angle_rad + self.yaw_rad)
            for beam in range(48):
                slope = math.tan(math.radians(-52.0 + beam))
                ground_m = height_m / -slope if slope < -0.06 else math.inf
                hit_m, class_number = ground_m, OPEN
                if rock_m < ground_m and height_m + slope * rock_m <= ROCK_HEIGHT_M:
                    hit_m, class_number = rock_m, OBSTACLE
                if hit_m <= 6.0:
                    points.append(
                        (
                            hit_m * math.cos(angle_rad),
                            hit_m * math.sin(angle_rad),
                            slope * hit_m,
                            class_number,
                        )
                    )
        records = (layout.PointRecord * len(points))()
        for record, (x_m, y_m, z_m, class_number) in zip(records, points):
            record.position_m[:] = (x_m, y_m, z_m)
            record.class_number = class_number
        return records

    @staticmethod
    def distance_to_rock(east_m: float, north_m: float, bearing_rad: float) -> float:
        dx_m, dy_m = ROCK_M[0] - east_m, ROCK_M[1] - north_m
        along_m = dx_m * math.cos(bearing_rad) + dy_m * math.sin(bearing_rad)
        across_m = -dx_m * math.sin(bearing_rad) + dy_m * math.cos(bearing_rad)
        if along_m <= 0.0 or abs(across_m) >= ROCK_RADIUS_M:
            return math.inf
        return along_m - math.sqrt(ROCK_RADIUS_M**2 - across_m**2)


def sleep_until(deadline_ns: int) -> None:
    import time

    while (left_ns := deadline_ns - now_ns()) > 0:
        time.sleep(left_ns * 1e-9)


def drive(run: str) -> dict:
    bus, robot = Bus(run), Robot()
    odometry, scans, missions = Outlet(bus, "odometry"), Outlet(bus, "scan", 1 << 14), Outlet(bus, "mission")
    imu = Outlet(bus, "imu", PERIOD_NS // IMU_PERIOD_NS)
    commands, risks = Inlet(bus, "command"), Inlet(bus, "risk")
    mission = layout.MissionRecord(goal_m=GOAL_M, tolerance_m=TOLERANCE_M)
    watchdog = Watchdog()
    began_ns, n_commands, n_maps, nearest_m = now_ns(), 0, 0, math.inf
    for cycle in range(int(TIME_LIMIT_S * 1e9) // PERIOD_NS):
        at_ns = began_ns + cycle * PERIOD_NS
        sleep_until(at_ns)
        odometry.send(at_ns, (layout.OdometryRecord * 1)(robot.odometry(watchdog.applied())))
        imu.send(at_ns, robot.imu(at_ns))
        if cycle % CYCLES_PER_SCAN == 0:
            scans.send(at_ns, robot.scan(), sensor=SENSOR)
        if cycle % 50 == 0:
            mission.time_s = cycle * PERIOD_NS * 1e-9
            missions.send(now_ns(), (layout.MissionRecord * 1)(mission))
        if (message := commands.newest()) is not None:
            _, _, payload = message
            watchdog.admit(payload[0])
            n_commands += 1
        if risks.newest() is not None:
            n_maps += 1
        robot.advance(*watchdog.carry_out(now_ns()), PERIOD_NS * 1e-9)
        nearest_m = min(nearest_m, math.dist((robot.x_m, robot.y_m), ROCK_M))
        left_m = math.dist((robot.x_m, robot.y_m), GOAL_M)
        if left_m <= TOLERANCE_M:
            break
    mission.outcome = GOAL_REACHED if left_m <= TOLERANCE_M else TIMED_OUT
    missions.send(now_ns(), (layout.MissionRecord * 1)(mission))
    return {
        "reached": left_m <= TOLERANCE_M,
        "time_s": round((now_ns() - began_ns) * 1e-9, 2),
        "distance_to_goal_m": round(left_m, 3),
        "nearest_to_rock_m": round(nearest_m, 3),
        "commands": n_commands,
        "risk_maps": n_maps,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--run", type=run_name, default="field", help="name of the run to be the vehicle of")
    told = drive(parser.parse_args().run)
    print(json.dumps(told))
    return 0 if told["reached"] else 1


if __name__ == "__main__":
    sys.exit(main())
