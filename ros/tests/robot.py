"""A robot of ROS 2 as others build them: a node of rclpy with a simple vehicle on a plain with one rock in the way.

It tells odometry, clouds and where it is on the globe, follows TwistStamped, and stops when the last command is of a time too long ago. Told lines
on standard input, it breaks what it says; see `BREAKS`. Every 0.1 s it says on standard output where it is.
"""

import json
import math
import sys
import threading

import numpy as np
import rclpy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus, PointCloud2, PointField

PERIOD_S = 0.02
CYCLES_PER_SCAN = 20
CYCLES_PER_WORD = 5
COMMAND_AGE_MAX_S = 0.3
WHEELBASE_M = 0.25
STEERING_MAX_RAD = 0.5
LAG_S = 0.2
SENSOR_M = (0.12, 0.0, 0.40)
ROCK_M, ROCK_RADIUS_M, ROCK_HEIGHT_M = (2.5, 0.1), 0.35, 0.5
GROUND, ROCK = 1, 9
# Where its map begins on the globe, and how far to the left of east its x axis points.
ORIGIN_DEG, MAP_YAW_RAD = (46.5, 7.25), math.radians(40.0)
# Metres of a degree there, 500 m above the ellipsoid, by its radii of curvature.
NORTH_M_PER_DEG, EAST_M_PER_DEG = 111_169.8, 76_768.6
FIX_DEVIATION_M = 0.02
# What a line on standard input may ask for.
BREAKS = {"whole", "silent cloud", "cloud of nan", "cloud without z", "odometry of another clock", "odometry of nan"}


class Vehicle:
    """A bicycle without slip whose actuators follow with a lag, commanded by speed and yaw rate."""

    def __init__(self) -> None:
        self.x_m = self.y_m = self.yaw_rad = self.speed_mps = self.steering_rad = 0.0

    def advance(self, speed_mps: float, yaw_rate_radps: float) -> None:
        aim_rad = math.atan2(WHEELBASE_M * yaw_rate_radps, abs(speed_mps)) * (1 if speed_mps >= 0 else -1)
        aim_rad = aim_rad if abs(speed_mps) > 0.01 else self.steering_rad
        aim_rad = max(-STEERING_MAX_RAD, min(STEERING_MAX_RAD, aim_rad))
        share = PERIOD_S / LAG_S
        self.speed_mps += share * (speed_mps - self.speed_mps)
        self.steering_rad += share * (aim_rad - self.steering_rad)
        self.x_m += PERIOD_S * self.speed_mps * math.cos(self.yaw_rad)
        self.y_m += PERIOD_S * self.speed_mps * math.sin(self.yaw_rad)
        self.yaw_rad += PERIOD_S * self.yaw_rate_radps

    @property
    def yaw_rate_radps(self) -> float:
        return self.speed_mps * math.tan(self.steering_rad) / WHEELBASE_M

    def returns(self) -> np.ndarray:
        """Where 240 x 48 rays end, in the frame of the sensor, and on what: rows of x, y, z [m] and label."""
        azimuth_rad, beam = np.meshgrid(np.arange(240) * math.tau / 240, np.arange(48), indexing="ij")
        slope = np.tan(np.radians(-52.0 + beam))
        with np.errstate(divide="ignore", invalid="ignore"):
            ground_m = np.where(slope < -0.06, SENSOR_M[2] / -slope, np.inf)
            rock_m = self.distances_to_rock(azimuth_rad)
            is_rock = (rock_m < ground_m) & (SENSOR_M[2] + slope * rock_m <= ROCK_HEIGHT_M)
        hit_m = np.where(is_rock, rock_m, ground_m)
        label = np.where(is_rock, ROCK, GROUND)
        is_hit = hit_m <= 6.0
        hit_m, azimuth_rad = hit_m[is_hit], azimuth_rad[is_hit]
        places = [hit_m * np.cos(azimuth_rad), hit_m * np.sin(azimuth_rad), slope[is_hit] * hit_m]
        return np.stack([*places, label[is_hit]], axis=1)

    def distances_to_rock(self, azimuth_rad: np.ndarray) -> np.ndarray:
        bearing_rad = azimuth_rad + self.yaw_rad
        dx_m = ROCK_M[0] - self.x_m - math.cos(self.yaw_rad) * SENSOR_M[0]
        dy_m = ROCK_M[1] - self.y_m - math.sin(self.yaw_rad) * SENSOR_M[0]
        along_m = dx_m * np.cos(bearing_rad) + dy_m * np.sin(bearing_rad)
        across_m = -dx_m * np.sin(bearing_rad) + dy_m * np.cos(bearing_rad)
        is_met = (along_m > 0) & (np.abs(across_m) < ROCK_RADIUS_M)
        depth_m = np.sqrt(np.maximum(ROCK_RADIUS_M**2 - across_m**2, 0.0))
        return np.where(is_met, along_m - depth_m, np.inf)


def on_globe(x_m: float, y_m: float) -> tuple[float, float]:
    """Latitude and longitude of a place of its map [deg]."""
    east_m = x_m * math.cos(MAP_YAW_RAD) - y_m * math.sin(MAP_YAW_RAD)
    north_m = x_m * math.sin(MAP_YAW_RAD) + y_m * math.cos(MAP_YAW_RAD)
    return ORIGIN_DEG[0] + north_m / NORTH_M_PER_DEG, ORIGIN_DEG[1] + east_m / EAST_M_PER_DEG


class Robot(Node):
    def __init__(self) -> None:
        super().__init__("robot", namespace="/car")
        self.vehicle = Vehicle()
        self.broken = "whole"
        self.cycle = 0
        self.command = (0.0, 0.0)
        self.commanded_at_s = -math.inf
        self.n_commands = 0
        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.cloud = self.create_publisher(PointCloud2, "points", qos_profile_sensor_data)
        self.fix = self.create_publisher(NavSatFix, "fix", qos_profile_sensor_data)
        self.imu = self.create_publisher(Imu, "imu", qos_profile_sensor_data)
        self.create_subscription(TwistStamped, "command", self.hear, 10)
        self.create_timer(PERIOD_S, self.work)

    def hear(self, told: TwistStamped) -> None:
        self.n_commands += 1
        self.command = (told.twist.linear.x, told.twist.angular.z)
        self.commanded_at_s = told.header.stamp.sec + 1e-9 * told.header.stamp.nanosec

    def work(self) -> None:
        now = self.get_clock().now()
        stamp = now.to_msg()
        age_s = 1e-9 * now.nanoseconds - self.commanded_at_s
        self.vehicle.advance(*(self.command if age_s <= COMMAND_AGE_MAX_S else (0.0, 0.0)))
        self.tell_odometry(stamp)
        self.tell_imu(stamp)
        if self.cycle % CYCLES_PER_SCAN == 0 and self.broken != "silent cloud":
            self.tell_cloud(stamp)
        if self.cycle % CYCLES_PER_WORD == 0:
            self.tell_fix(stamp)
            vehicle = self.vehicle
            place = {"x_m": vehicle.x_m, "y_m": vehicle.y_m, "speed_mps": vehicle.speed_mps}
            print(json.dumps({**place, "commands": self.n_commands, "command_age_s": min(age_s, 1e9)}), flush=True)
        self.cycle += 1

    def tell_odometry(self, stamp) -> None:
        told = Odometry()
        told.header.stamp = stamp
        told.header.frame_id, told.child_frame_id = "odom", "base_link"
        if self.broken == "odometry of another clock":
            told.header.stamp.sec += 1000
        vehicle = self.vehicle
        pose, twist = told.pose.pose, told.twist.twist
        pose.position.x, pose.position.y = vehicle.x_m, vehicle.y_m
        pose.orientation.z, pose.orientation.w = math.sin(vehicle.yaw_rad / 2), math.cos(vehicle.yaw_rad / 2)
        twist.linear.x, twist.angular.z = vehicle.speed_mps, vehicle.yaw_rate_radps
        if self.broken == "odometry of nan":
            pose.position.x = math.nan
        self.odometry.publish(told)

    def tell_imu(self, stamp) -> None:
        told = Imu()
        told.header.stamp, told.header.frame_id = stamp, "base_link"
        told.angular_velocity.z = self.vehicle.yaw_rate_radps
        told.linear_acceleration.z = 9.81
        self.imu.publish(told)

    def tell_fix(self, stamp) -> None:
        told = NavSatFix(altitude=500.0, position_covariance_type=NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN)
        told.header.stamp, told.header.frame_id = stamp, "base_link"
        told.status.status = NavSatStatus.STATUS_FIX
        told.latitude, told.longitude = on_globe(self.vehicle.x_m, self.vehicle.y_m)
        told.position_covariance[0] = told.position_covariance[4] = FIX_DEVIATION_M**2
        self.fix.publish(told)

    def tell_cloud(self, stamp) -> None:
        returns = self.vehicle.returns()
        kinds = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("label", "<u2"), ("ring", "<u2")]
        points = np.zeros(len(returns), dtype=kinds)
        for column, name in enumerate(("x", "y", "z", "label")):
            points[name] = returns[:, column]
        if self.broken == "cloud of nan":
            points["x"] = np.nan
        told = PointCloud2(height=1, width=len(points), point_step=points.dtype.itemsize, is_dense=True)
        told.header.stamp, told.header.frame_id = stamp, "ring"
        datatype = {"<f4": PointField.FLOAT32, "<u2": PointField.UINT16}
        for name, kind in kinds:
            if not (name == "z" and self.broken == "cloud without z"):
                offset = points.dtype.fields[name][1]
                told.fields.append(PointField(name=name, offset=offset, datatype=datatype[kind], count=1))
        told.row_step = len(points) * points.dtype.itemsize
        told.data = points.tobytes()
        self.cloud.publish(told)


def main() -> None:
    rclpy.init()
    robot = Robot()

    def listen() -> None:
        for line in sys.stdin:
            assert line.strip() in BREAKS, line
            robot.broken = line.strip()

    threading.Thread(target=listen, daemon=True).start()
    try:
        rclpy.spin(robot)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
