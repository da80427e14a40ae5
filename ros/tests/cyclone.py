"""Messages that no wheel of ROS brings, as Cyclone DDS tells them: types by their fields, topics by their names in DDS."""

import os
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint16, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

# On loopback alone, where there is no multicast.
os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain>
    <General>
        <Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
        <AllowMulticast>false</AllowMulticast>
    </General>
    <Discovery>
        <ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
        <Peers><Peer address="127.0.0.1"/></Peers>
    </Discovery>
</Domain></CycloneDDS>"""


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Covariant(IdlStruct, typename="surefoot_test::Covariant"):
    """Pose or twist: seven or six numbers one after the other would lie alike; kept apart for what they mean."""

    position: Vector3
    orientation: Quaternion
    covariance: array[float64, 36]


@dataclass
class CovariantTwist(IdlStruct, typename="surefoot_test::CovariantTwist"):
    linear: Vector3
    angular: Vector3
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: Covariant
    twist: CovariantTwist


@dataclass
class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class AckermannDriveStamped(IdlStruct, typename="ackermann_msgs::msg::dds_::AckermannDriveStamped_"):
    header: Header
    steering_angle: float32
    steering_angle_velocity: float32
    speed: float32
    acceleration: float32
    jerk: float32


@dataclass
class Pose(IdlStruct, typename="surefoot_test::Pose"):
    position: Vector3
    orientation: Quaternion


@dataclass
class GeoPose(IdlStruct, typename="geographic_msgs::msg::dds_::GeoPose_"):
    latitude: float64
    longitude: float64
    altitude: float64
    orientation: Quaternion


@dataclass
class GeoPoseStamped(IdlStruct, typename="geographic_msgs::msg::dds_::GeoPoseStamped_"):
    header: Header
    pose: GeoPose


@dataclass
class Dimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
    label: str
    size: uint32
    stride: uint32


@dataclass
class Layout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
    dim: sequence[Dimension]
    data_offset: uint32


@dataclass
class Layer(IdlStruct, typename="std_msgs::msg::dds_::Float32MultiArray_"):
    layout: Layout
    data: sequence[float32]


@dataclass
class GridMapInfo(IdlStruct, typename="grid_map_msgs::msg::dds_::GridMapInfo_"):
    resolution: float64
    length_x: float64
    length_y: float64
    pose: Pose


@dataclass
class GridMap(IdlStruct, typename="grid_map_msgs::msg::dds_::GridMap_"):
    header: Header
    info: GridMapInfo
    layers: sequence[str]
    basic_layers: sequence[str]
    data: sequence[Layer]
    outer_start_index: uint16
    inner_start_index: uint16


RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(8))
LOOSE = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(8))
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(8), Policy.Durability.TransientLocal
)


class Peer:
    """A participant of the domain of the environment."""

    def __init__(self) -> None:
        self.participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))

    def writer(self, topic: str, kind, qos=RELIABLE) -> DataWriter:
        return DataWriter(self.participant, Topic(self.participant, f"rt/{topic}", kind, qos=qos), qos=qos)

    def reader(self, topic: str, kind, qos=RELIABLE) -> DataReader:
        return DataReader(self.participant, Topic(self.participant, f"rt/{topic}", kind, qos=qos), qos=qos)
