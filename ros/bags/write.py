"""Writes a bag of ROS 2 with PyPI's `rosbags`: a small car with a lidar drives over a plain with waves, past a rock.

    python3 ros/bags/write.py FOLDER [--storage mcap|sqlite3] [--seconds 20] [--lag 0.0] [--turn 1]

The car is a kinematic bicycle whose steering lags by `--lag` seconds; `--turn -1` mirrors what it is told.
"""

import argparse
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

WHEELBASE_M = 0.18
LIDAR_M = np.array([0.05, 0.0, 0.35])
ROCK_M = np.array([4.0, 1.2])
BEGAN_NS = 1_700_000_000 * 10**9
STEP_S = 0.01

ACKERMANN = {
    "ackermann_msgs/msg/AckermannDrive": "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\n"
    "float32 acceleration\nfloat32 jerk",
    "ackermann_msgs/msg/AckermannDriveStamped": "std_msgs/Header header\nAckermannDrive drive",
}

types = get_typestore(Stores.ROS2_JAZZY)
for name, definition in ACKERMANN.items():
    types.register(get_types_from_msg(definition, name))
make = types.types


def height_m(x, y):
    """The ground, with a rock of 0.3 m."""
    waves = 0.03 * np.sin(1.1 * x) + 0.02 * np.cos(0.9 * y)
    return waves + 0.3 * (np.hypot(x - ROCK_M[0], y - ROCK_M[1]) < 0.25)


def header(at_s: float, frame: str):
    nanoseconds = BEGAN_NS + round(at_s * 1e9)
    stamp = make["builtin_interfaces/msg/Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return make["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def vector(x, y, z):
    return make["geometry_msgs/msg/Vector3"](x=float(x), y=float(y), z=float(z))


def turned(yaw: float):
    return make["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=float(np.sin(yaw / 2)), w=float(np.cos(yaw / 2)))


def odometry(at_s, place, yaw, speed, rate):
    pose = make["geometry_msgs/msg/Pose"](
        position=make["geometry_msgs/msg/Point"](*(float(axis) for axis in place)), orientation=turned(yaw)
    )
    twist = make["geometry_msgs/msg/Twist"](linear=vector(speed, 0, 0), angular=vector(0, 0, rate))
    none = np.zeros(36)
    return make["nav_msgs/msg/Odometry"](
        header=header(at_s, "map"),
        child_frame_id="base_link",
        pose=make["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=none),
        twist=make["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=none),
    )


def command(at_s, speed, steering):
    drive = make["ackermann_msgs/msg/AckermannDrive"](
        steering_angle=float(steering), steering_angle_velocity=0.0, speed=float(speed), acceleration=0.0, jerk=0.0
    )
    return make["ackermann_msgs/msg/AckermannDriveStamped"](header=header(at_s, "base_link"), drive=drive)


def imu(at_s, speed, rate):
    none = np.zeros(9)
    return make["sensor_msgs/msg/Imu"](
        header=header(at_s, "base_link"),
        orientation=turned(0.0),
        orientation_covariance=none,
        angular_velocity=vector(0, 0, rate),
        angular_velocity_covariance=none,
        linear_acceleration=vector(0, speed * rate, 9.81),
        linear_acceleration_covariance=none,
    )


def fixed(at_s):
    transform = make["geometry_msgs/msg/Transform"](translation=vector(*LIDAR_M), rotation=turned(0.0))
    stamped = make["geometry_msgs/msg/TransformStamped"](
        header=header(at_s, "base_link"), child_frame_id="lidar", transform=transform
    )
    return make["tf2_msgs/msg/TFMessage"](transforms=[stamped])


def cloud(at_s, place, yaw):
    """What a lidar of 24 rings sees: rays followed in steps until they are below the ground."""
    azimuth, elevation = np.meshgrid(np.linspace(-np.pi, np.pi, 240, endpoint=False), np.linspace(-0.6, -0.02, 24))
    azimuth, elevation = azimuth.ravel(), elevation.ravel()
    ray = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], 1)
    sine, cosine = np.sin(yaw), np.cos(yaw)
    world = np.stack([cosine * ray[:, 0] - sine * ray[:, 1], sine * ray[:, 0] + cosine * ray[:, 1], ray[:, 2]], 1)
    sensor = np.asarray(place) + [cosine * LIDAR_M[0], sine * LIDAR_M[0], LIDAR_M[2]]
    reach = np.full(len(ray), np.nan)
    for range_m in np.arange(0.2, 8.0, 0.02):
        at = sensor + range_m * world
        hit = np.isnan(reach) & (at[:, 2] <= height_m(at[:, 0], at[:, 1]))
        reach[hit] = range_m
    points = (reach[:, None] * ray).astype(np.float32)
    field = make["sensor_msgs/msg/PointField"]
    fields = [field(name=name, offset=4 * place, datatype=7, count=1) for place, name in enumerate("xyz")]
    return make["sensor_msgs/msg/PointCloud2"](
        header=header(at_s, "lidar"), height=1, width=len(points), fields=fields, is_bigendian=False, point_step=12,
        row_step=12 * len(points), data=points.view(np.uint8).ravel(), is_dense=False,
    )


def told(at_s: float, turn: float):
    """Speed and steering angle that the car is told."""
    speed = min(0.3 + 0.25 * at_s, 1.0) * (1.0 if at_s % 9 < 7.5 else 0.6)
    return speed, turn * (0.16 * np.sin(0.9 * at_s) + 0.08 * np.sign(np.sin(0.37 * at_s)))


def drive(seconds: float, lag_s: float, turn: float, clouds: bool):
    """Topics, times, delays and messages of the drive, in the order of their times."""
    x, y, yaw, speed, steering = 0.0, 0.0, 0.0, 0.0, 0.0
    yield "/tf_static", 0.0, fixed(0.0)
    for step in range(int(seconds / STEP_S)):
        at_s = step * STEP_S
        asked_speed, asked_steering = told(at_s, turn)
        speed += np.clip(asked_speed - speed, -2.0 * STEP_S, 2.0 * STEP_S)
        steering += (asked_steering - steering) * (1.0 if lag_s == 0 else STEP_S / (lag_s + STEP_S))
        rate = speed * np.tan(steering) / WHEELBASE_M
        if step % 5 == 0:
            yield "/command", at_s, command(at_s, asked_speed, asked_steering)
        place = [x, y, 0.0]
        yield "/imu", at_s, imu(at_s, speed, rate)
        if step % 2 == 0:
            yield "/odom", at_s, odometry(at_s, place, yaw, speed, rate)
        if clouds and step % 20 == 0:
            yield "/points", at_s, cloud(at_s, place, yaw)
        x, y, yaw = x + STEP_S * speed * np.cos(yaw), y + STEP_S * speed * np.sin(yaw), yaw + STEP_S * rate


def write(
    folder: Path, storage: str, seconds: float = 20.0, lag_s: float = 0.0, turn: float = 1.0, clouds: bool = True
) -> None:
    plugin = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}[storage]
    connections = {}
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        for topic, at_s, message in drive(seconds, lag_s, turn, clouds):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=types)
            # Everything is recorded a little after it was true.
            recorded_ns = BEGAN_NS + round(at_s * 1e9) + 2_000_000
            writer.write(connections[topic], recorded_ns, types.serialize_cdr(message, kind))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--storage", choices=["mcap", "sqlite3"], default="mcap")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--lag", type=float, default=0.0)
    parser.add_argument("--turn", type=float, default=1.0)
    words = parser.parse_args()
    write(words.folder, words.storage, words.seconds, words.lag, words.turn)
