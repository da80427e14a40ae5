"""Messages as rclpy lays them out in bytes, which the Rust tests read: `python3 ros/tests/recorded.py` writes them anew."""

from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseArray, PoseStamped, Quaternion, TwistStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.msg import Path as Way
from nav2_msgs.action import NavigateToPose
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix, PointCloud2, PointField
from std_msgs.msg import Bool, ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

FOLDER = Path(__file__).parents[1] / "src/message/recorded"


def header(frame: str) -> Header:
    told = Header(frame_id=frame)
    told.stamp.sec, told.stamp.nanosec = 1_700_000_000, 123_456_789
    return told


def pose(x: float) -> Pose:
    return Pose(position=Point(x=x, y=2.0, z=3.0), orientation=Quaternion(x=0.5, y=-0.5, z=0.5, w=0.5))


def odometry() -> Odometry:
    told = Odometry(header=header("odom"), child_frame_id="base_link")
    told.pose.pose = pose(1.0)
    told.pose.covariance[7] = 0.25
    told.twist.twist.linear, told.twist.twist.angular = Vector3(x=4.0, y=5.0, z=6.0), Vector3(x=7.0, y=8.0, z=9.0)
    told.twist.covariance[35] = 0.125
    return told


def cloud() -> PointCloud2:
    told = PointCloud2(header=header("lidar"), height=1, width=2, is_bigendian=True, point_step=3, row_step=6)
    told.fields = [PointField(name="x", offset=1, datatype=7, count=1), PointField(name="ring", offset=2, datatype=4)]
    told.data, told.is_dense = bytes(range(6)), True
    return told


def imu() -> Imu:
    told = Imu(header=header("imu"))
    told.orientation_covariance[0] = -1.0
    told.angular_velocity, told.linear_acceleration = Vector3(x=0.1, y=0.2, z=0.3), Vector3(x=1.0, y=2.0, z=9.81)
    return told


def fix() -> NavSatFix:
    told = NavSatFix(header=header("antenna"), latitude=46.5, longitude=-7.25, altitude=512.0)
    told.status.status, told.status.service = 2, 5
    told.position_covariance[0], told.position_covariance[8], told.position_covariance_type = 0.25, 4.0, 2
    return told


def grid() -> OccupancyGrid:
    told = OccupancyGrid(header=header("map"), data=[0, 100, -1])
    told.info.resolution, told.info.width, told.info.height, told.info.origin = 0.25, 3, 1, pose(-1.0)
    return told


def twist() -> TwistStamped:
    told = TwistStamped(header=header("base_link"))
    told.twist.linear.x, told.twist.angular.z = 1.5, -0.5
    return told


def diagnosis() -> DiagnosticArray:
    values = [KeyValue(key="age", value="0.1")]
    status = DiagnosticStatus(level=b"\x02", name="input", message="no scan", hardware_id="car", values=values)
    return DiagnosticArray(header=header(""), status=[status])


def markers() -> MarkerArray:
    line = Marker(header=header("map"), ns="plan", id=3, type=Marker.LINE_STRIP, pose=pose(1.0))
    line.scale.x, line.lifetime.sec = 0.5, 1
    line.color = ColorRGBA(r=0.25, g=0.5, b=0.75, a=1.0)
    line.points, line.colors = [Point(x=1.0, y=2.0, z=3.0)], [ColorRGBA(r=1.0, a=0.5)]
    line.text = "way"
    return MarkerArray(markers=[line, Marker(header=header("odom"), ns="moving", type=Marker.CYLINDER)])


def feedback() -> NavigateToPose.Feedback:
    told = NavigateToPose.Feedback(number_of_recoveries=-2, distance_remaining=2.5)
    told.current_pose = PoseStamped(header=header("map"), pose=pose(1.0))
    told.navigation_time.sec, told.navigation_time.nanosec = 3, 500_000_000
    return told


def messages() -> dict:
    stamped = PoseStamped(header=header("map"), pose=pose(1.0))
    return {
        "bool": Bool(data=True),
        "clock": Clock(clock=header("").stamp),
        "odometry": odometry(),
        "point_cloud": cloud(),
        "imu": imu(),
        "nav_sat_fix": fix(),
        "pose_stamped": stamped,
        "pose_array": PoseArray(header=header("map"), poses=[pose(1.0), pose(-1.0)]),
        "path": Way(header=header("odom"), poses=[stamped]),
        "occupancy_grid": grid(),
        "twist_stamped": twist(),
        "diagnostic_array": diagnosis(),
        "marker_array": markers(),
        "navigate_goal": NavigateToPose.Goal(pose=stamped, behavior_tree="tree"),
        "navigate_result": NavigateToPose.Result(error_code=9000),
        "navigate_feedback": feedback(),
    }


if __name__ == "__main__":
    for name, message in messages().items():
        (FOLDER / f"{name}.cdr").write_bytes(serialize_message(message))
