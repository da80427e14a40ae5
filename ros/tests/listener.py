"""Hears what talker.py says, by rclpy on Fast DDS or by Cyclone DDS, for a time, and says how late it came and at what cost."""

import json
import statistics
import sys
import time

LATE_S: dict[str, list[float]] = {"odometry": [], "cloud": []}


def note(name: str, stamp) -> None:
    LATE_S[name].append(time.time() - stamp.sec - 1e-9 * stamp.nanosec)


def hear_by_rclpy(until_s: float) -> None:
    import rclpy
    from nav_msgs.msg import Odometry
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import PointCloud2

    rclpy.init()
    node = rclpy.create_node("listener", namespace="/car")
    node.create_subscription(Odometry, "odom", lambda told: note("odometry", told.header.stamp), 10)
    hear_cloud = lambda told: note("cloud", told.header.stamp)
    node.create_subscription(PointCloud2, "points", hear_cloud, qos_profile_sensor_data)
    while time.monotonic() < until_s:
        rclpy.spin_once(node, timeout_sec=0.1)


def hear_by_cyclone(until_s: float) -> None:
    from cyclone import LOOSE, Odometry, Peer, PointCloud2
    from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
    from cyclonedds.util import duration

    peer = Peer()
    readers = {
        "odometry": peer.reader("car/odom", Odometry),
        "cloud": peer.reader("car/points", PointCloud2, LOOSE),
    }
    waiting = WaitSet(peer.participant)
    for reader in readers.values():
        new = SampleState.NotRead | ViewState.Any | InstanceState.Alive
        waiting.attach(ReadCondition(reader, new))
    while time.monotonic() < until_s:
        waiting.wait(duration(milliseconds=100))
        for name, reader in readers.items():
            for told in reader.take(100):
                # Of a talker that has left, its last word is none.
                if hasattr(told, "header"):
                    note(name, told.header.stamp)


def main(kind: str, duration_s: float) -> None:
    hear = {"rclpy": hear_by_rclpy, "cyclone": hear_by_cyclone}[kind]
    began_s, used_s = time.monotonic(), time.process_time()
    hear(began_s + duration_s)
    share = (time.process_time() - used_s) / (time.monotonic() - began_s)
    told = {name: {"n": len(late_s), "p50_s": statistics.median(late_s or [float("nan")])} for name, late_s in LATE_S.items()}
    print(json.dumps({**told, "core_share": share}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
