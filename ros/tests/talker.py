"""A node of rclpy that says odometry at 50 Hz and clouds of 1.28 MB at 10 Hz, and in the end how many."""

import json
import sys
import time

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2, PointField

N_POINTS, POINT_BYTES = 64_000, 20
PERIOD_S, CYCLES_PER_SCAN = 0.02, 5


def cloud() -> PointCloud2:
    """A plain of points in the frame `ring`."""
    points = np.zeros(N_POINTS, dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("label", "<u4"), ("ring", "<u4")])
    assert points.dtype.itemsize == POINT_BYTES
    angle_rad, distance_m = np.arange(N_POINTS) * 0.1, 1.0 + np.arange(N_POINTS) / N_POINTS * 5.0
    points["x"], points["y"], points["z"] = distance_m * np.cos(angle_rad), distance_m * np.sin(angle_rad), -0.4
    points["label"] = 1
    told = PointCloud2(height=1, width=N_POINTS, point_step=POINT_BYTES, is_dense=True)
    told.row_step, told.header.frame_id = N_POINTS * POINT_BYTES, "ring"
    for place, name in enumerate(points.dtype.names):
        datatype = PointField.FLOAT32 if name in "xyz" else PointField.UINT32
        told.fields.append(PointField(name=name, offset=4 * place, datatype=datatype, count=1))
    told.data = points.tobytes()
    return told


def main(duration_s: float) -> None:
    rclpy.init()
    node = rclpy.create_node("talker", namespace="/car")
    odometry = node.create_publisher(Odometry, "odom", 10)
    scans = node.create_publisher(PointCloud2, "points", qos_profile_sensor_data)
    told_odometry, told_scan = Odometry(child_frame_id="base_link"), cloud()
    told_odometry.header.frame_id = "odom"
    while odometry.get_subscription_count() == 0 or scans.get_subscription_count() == 0:
        time.sleep(0.05)
    # Whoever listens has found both topics by then.
    time.sleep(1.0)
    n_cycles = round(duration_s / PERIOD_S)
    next_s = time.monotonic()
    for cycle in range(n_cycles):
        told_odometry.header.stamp = node.get_clock().now().to_msg()
        odometry.publish(told_odometry)
        if cycle % CYCLES_PER_SCAN == 0:
            told_scan.header.stamp = node.get_clock().now().to_msg()
            scans.publish(told_scan)
        next_s += PERIOD_S
        time.sleep(max(0.0, next_s - time.monotonic()))
    print(json.dumps({"odometry": n_cycles, "cloud": -(-n_cycles // CYCLES_PER_SCAN)}), flush=True)
    # What is lost may be asked for once more.
    time.sleep(1.0)


if __name__ == "__main__":
    main(float(sys.argv[1]))
