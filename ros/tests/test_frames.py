"""The bridge between Cyclone DDS and the bus: frames by tf, commands by Ackermann, in closed forms."""

import math
import os
import time
from pathlib import Path

import pytest
import surefoot_layout as layout
from channels import Bus, Inlet, Outlet, now_ns
from conftest import SUREFOOT, Process, until
from cyclone import (
    LATCHED,
    AckermannDriveStamped,
    Covariant,
    CovariantTwist,
    Header,
    Odometry,
    Peer,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)


FRAMES = Path(__file__).parent / "frames.toml"
DRIVE, SPEED_MPS, STEERING_RAD = 1, 0.75, -0.25


def stamp() -> Time:
    now_s, rest_ns = divmod(time.time_ns(), 1_000_000_000)
    return Time(sec=now_s, nanosec=rest_ns)


def turned(yaw_rad: float) -> Quaternion:
    return Quaternion(x=0.0, y=0.0, z=math.sin(yaw_rad / 2), w=math.cos(yaw_rad / 2))


def told(parent: str, child: str, place_m, yaw_rad: float) -> TFMessage:
    transform = Transform(translation=Vector3(*place_m), rotation=turned(yaw_rad))
    header = Header(stamp=stamp(), frame_id=parent)
    return TFMessage(transforms=[TransformStamped(header=header, child_frame_id=child, transform=transform)])


def circling() -> Odometry:
    """4 m forward and 1 m left of the start, 2 m/s, to the left by 0.5 rad/s."""
    nothing = [0.0] * 36
    return Odometry(
        header=Header(stamp=stamp(), frame_id="odom"),
        child_frame_id="base_link",
        pose=Covariant(position=Vector3(4.0, 1.0, 0.2), orientation=turned(0.0), covariance=nothing),
        twist=CovariantTwist(linear=Vector3(2.0, 0.0, 0.0), angular=Vector3(0.0, 0.0, 0.5), covariance=nothing),
    )


@pytest.fixture
def bridge(start, tmp_path):
    words = [SUREFOOT, "up", "--robot", str(FRAMES), "--role", "ros", "--out", str(tmp_path)]
    bridge, peer = start(Process, words), Peer()
    # It comes first: it has room on its channels for more readers than this program asks for.
    commands = peer.reader("north/command", AckermannDriveStamped)
    until(lambda: commands.take(1), 30, "a command to stand")
    yield bridge, peer


def test_odometry_is_carried_to_the_rear_axle_and_the_map_by_tf(bridge):
    process, peer = bridge
    odometry, moving = peer.writer("north/odom", Odometry), peer.writer("tf", TFMessage)
    inlet = Inlet(Bus("ros-frames"), "odometry")
    missing = 'odometry: frame "odom": expected transforms on /tf or /tf_static that join it to "map", found none'

    def is_refused() -> bool:
        odometry.write(circling())
        return process.has_said(missing)

    until(is_refused, 20, missing)
    # Told once, before anybody who comes later listens: kept by its publisher.
    fixed = peer.writer("tf_static", TFMessage, LATCHED)
    fixed.write(told("base_link", "rear_axle", (-1.5, 0.3, -0.1), 0.0))
    records = []

    def is_told() -> bool:
        moving.write(told("map", "odom", (10.0, 20.0, 0.0), math.pi / 2))
        time.sleep(0.05)
        odometry.write(circling())
        message = inlet.newest()
        if message is not None:
            records.append(message[2][0])
        return bool(records)

    until(is_told, 20, "odometry on the bus")
    record = records[-1]
    # The rear axle is at (2.5, 1.3, 0.1) of odom, and a quarter turn to the left takes that to (-1.3, 2.5, 0.1).
    assert list(record.position_m) == pytest.approx([8.7, 22.5, 0.1], abs=1e-9)
    assert list(record.attitude_rad) == pytest.approx([0.0, 0.0, math.pi / 2], abs=1e-9)
    # v + w x r of the lever arm.
    assert list(record.velocity_mps) == pytest.approx([1.85, -0.75], abs=1e-9)
    assert record.yaw_rate_radps == pytest.approx(0.5, abs=1e-9)


def test_a_transform_that_nobody_tells_any_more_is_told_of_and_odometry_is_refused(bridge):
    process, peer = bridge
    odometry, moving = peer.writer("north/odom", Odometry), peer.writer("tf", TFMessage)
    fixed = peer.writer("tf_static", TFMessage, LATCHED)
    fixed.write(told("base_link", "rear_axle", (0.0, 0.0, 0.0), 0.0))
    inlet = Inlet(Bus("ros-frames"), "odometry")

    def is_told() -> bool:
        moving.write(told("map", "odom", (0.0, 0.0, 0.0), 0.0))
        time.sleep(0.05)
        odometry.write(circling())
        return inlet.newest() is not None

    until(is_told, 20, "odometry on the bus")
    since = len(process.lines)
    # The bridge believes a transform for 1 s.
    stale = 'odometry: frame "odom": expected a transform on /tf at most 1.00 s away from the message'

    def is_refused() -> bool:
        time.sleep(0.05)
        odometry.write(circling())
        return process.has_said(stale, since)

    until(is_refused, 10, stale)
    time.sleep(0.2)
    inlet.newest()
    odometry.write(circling())
    time.sleep(0.5)
    assert inlet.newest() is None, "what is refused is as if it had not come"


def test_odometry_that_comes_far_more_often_than_stated_is_thinned_and_told(bridge):
    process, peer = bridge
    odometry, moving = peer.writer("north/odom", Odometry), peer.writer("tf", TFMessage)
    fixed = peer.writer("tf_static", TFMessage, LATCHED)
    fixed.write(told("base_link", "rear_axle", (0.0, 0.0, 0.0), 0.0))
    # The file states nothing, which is 50 Hz; this is about a thousand.
    often = "odometry: rate: expected at most 150.0 Hz, 3 times what the robot file states, found "

    def is_told() -> bool:
        moving.write(told("map", "odom", (0.0, 0.0, 0.0), 0.0))
        for _ in range(50):
            still = circling()
            still.twist.linear, still.twist.angular = Vector3(0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.0)
            odometry.write(still)
            time.sleep(0.0005)
        return process.has_said(often)

    until(is_told, 20, often)
    inlet = Inlet(Bus("ros-frames"), "odometry")

    def sequence() -> int:
        """How much odometry the bus has had, by its last."""
        is_told()
        return max((message[1].sequence for message in iter(inlet.newest, None)), default=0)

    before, began_s = sequence(), time.monotonic()
    for _ in range(10):
        is_told()
    n, since_s = sequence() - before, time.monotonic() - began_s
    # 550 were said, of which 50 a second are taken, and what was on its way.
    assert before > 0 and 0 < n < 75 * since_s + 10, f"{n} of 550 in {since_s:.2f} s"


def test_who_cannot_be_heard_or_hear_is_told(bridge):
    process, _ = bridge
    peer = Peer()
    # Frames that stay are said once: who says them without keeping them is not heard.
    ends = [peer.writer("tf_static", TFMessage), peer.reader("north/command", AckermannDriveStamped, LATCHED)]
    kept = "expected a publisher that is reliable and transient local, found one that is reliable and volatile"
    asked = "expected a subscriber that asks for reliable and volatile at the most, found one that asks for reliable and"
    for line in (f"/tf_static: quality of service: {kept}", f"command: quality of service: {asked}"):
        until(lambda: process.has_said(line), 20, line)
    assert len(ends) == 2, "as long as they are there"


def test_robots_of_one_network_keep_to_their_own_topics_and_frames(bridge, start, tmp_path):
    _, peer = bridge
    words = FRAMES.read_text().replace("ros-frames", "ros-south").replace("/north", "/south")
    file, out = tmp_path / "south.toml", tmp_path / "south"
    out.mkdir()
    file.write_text(words + 'frame_prefix = "south/"\n')
    start(Process, [SUREFOOT, "up", "--robot", str(file), "--role", "ros", "--out", str(out)])
    heard = {}

    def both_speak() -> bool:
        for robot, reader in readers.items():
            heard.update({robot: told.header.frame_id for told in reader.take(100)})
        return len(heard) == 2

    readers = {robot: peer.reader(f"{robot}/command", AckermannDriveStamped) for robot in ("north", "south")}
    until(both_speak, 20, "commands of both robots")
    assert heard == {"north": "rear_axle", "south": "south/rear_axle"}
    odometry, moving = peer.writer("south/odom", Odometry), peer.writer("tf", TFMessage)
    fixed = peer.writer("tf_static", TFMessage, LATCHED)
    inlets = {robot: Inlet(Bus(f"ros-{robot}"), "odometry") for robot in ("frames", "south")}
    # Transforms of the same names without the prefix are the other robot's.
    fixed.write(told("south/base_link", "south/rear_axle", (-1.5, 0.3, -0.1), 0.0))
    records = []

    def is_told() -> bool:
        moving.write(told("map", "odom", (10.0, 20.0, 0.0), math.pi / 2))
        moving.write(told("south/map", "south/odom", (1.0, 0.0, 0.0), 0.0))
        time.sleep(0.05)
        message = circling()
        message.header.frame_id, message.child_frame_id = "south/odom", "south/base_link"
        odometry.write(message)
        newest = inlets["south"].newest()
        if newest is not None:
            records.append(list(newest[2][0].position_m))
        return bool(records)

    until(is_told, 20, "odometry of the southern robot")
    assert records[-1] == pytest.approx([3.5, 1.3, 0.1], abs=1e-9)
    assert inlets["frames"].newest() is None, "the northern robot hears nothing of it"


def test_commands_are_said_as_ackermann_for_as_long_as_they_count(bridge):
    _, peer = bridge
    reader = peer.reader("north/command", AckermannDriveStamped)
    heard = []

    def is_there() -> bool:
        heard.extend(reader.take(100))
        return bool(heard)

    until(is_there, 20, "a command to stand")
    assert all(told.speed == 0.0 for told in heard)
    commands = Outlet(Bus("ros-frames"), "command")

    def is_driving() -> bool:
        at_ns = now_ns()
        record = layout.CommandRecord(
            speed_mps=SPEED_MPS, steering_rad=STEERING_RAD, decision=DRIVE, odometry_at_ns=at_ns, scan_at_ns=at_ns
        )
        commands.send(at_ns, (layout.CommandRecord * 1)(record))
        time.sleep(0.05)
        heard.extend(reader.take(100))
        return any(told.speed > 0 for told in heard)

    until(is_driving, 20, "a command to drive")
    driving = next(told for told in heard if told.speed > 0)
    assert (driving.speed, driving.steering_angle) == (SPEED_MPS, STEERING_RAD)
    assert driving.header.frame_id == "rear_axle"
    age_s = time.time() - driving.header.stamp.sec - 1e-9 * driving.header.stamp.nanosec
    assert 0.0 < age_s < 1.0, "stamped with the time of the odometry, by the time of day"
    # Nobody decides any more: within the age of a command the vehicle is told to stand, with its wheels as they are.
    time.sleep(0.5)
    reader.take(100)
    time.sleep(0.2)
    last = reader.take(100)[-1]
    assert (last.speed, last.steering_angle) == (0.0, STEERING_RAD)
