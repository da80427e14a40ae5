"""Messages of Surefoot, layout version 8. Written from its types; do not edit."""

import ctypes

LAYOUT_VERSION = 8


class Stamp(ctypes.Structure):
    """First field of every header: whose message it is, and of when."""

    _fields_ = [
        # Version of the layouts, LAYOUT_VERSION.
        ("layout_version", ctypes.c_uint32),
        # Zero.
        ("reserved", ctypes.c_uint32),
        # When its publisher took the channel, which tells one life of it from the next [ns].
        ("epoch_ns", ctypes.c_uint64),
        # Counts the messages of one publisher on one channel from 1.
        ("sequence", ctypes.c_uint64),
        # When what it says was true, monotonic [ns].
        ("valid_at_ns", ctypes.c_uint64),
        # When it was sent, monotonic [ns].
        ("published_at_ns", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Stamp"


assert ctypes.sizeof(Stamp) == 40
assert Stamp.layout_version.offset == 0
assert Stamp.reserved.offset == 4
assert Stamp.epoch_ns.offset == 8
assert Stamp.sequence.offset == 16
assert Stamp.valid_at_ns.offset == 24
assert Stamp.published_at_ns.offset == 32


class Source(ctypes.Structure):
    """A message that another one was made from."""

    _fields_ = [
        # When its publisher began [ns]; 0 = none.
        ("epoch_ns", ctypes.c_uint64),
        # Its sequence number.
        ("sequence", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Source"


assert ctypes.sizeof(Source) == 16
assert Source.epoch_ns.offset == 0
assert Source.sequence.offset == 8


class Grid(ctypes.Structure):
    """Where the cells of a map lie: square, row-major from the south-west corner."""

    _fields_ = [
        # Edge of a cell [m].
        ("resolution_m", ctypes.c_double),
        # Lattice column and row of the first cell; its south-west corner is origin x resolution_m.
        ("origin", ctypes.c_int64 * 2),
        # Rows, northwards.
        ("n_rows", ctypes.c_uint64),
        # Columns, eastwards.
        ("n_cols", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Grid"


assert ctypes.sizeof(Grid) == 40
assert Grid.resolution_m.offset == 0
assert Grid.origin.offset == 8
assert Grid.n_rows.offset == 24
assert Grid.n_cols.offset == 32


class OdometryRecord(ctypes.Structure):
    """Where the vehicle is and how it moves, at stamp.valid_at_ns."""

    _fields_ = [
        # Rear axle's centre in the map frame: east, north, up [m].
        ("position_m", ctypes.c_double * 3),
        # Roll, pitch, yaw [rad].
        ("attitude_rad", ctypes.c_double * 3),
        # Forward and leftward velocity in the body frame [m/s].
        ("velocity_mps", ctypes.c_double * 2),
        # Yaw rate [rad/s].
        ("yaw_rate_radps", ctypes.c_double),
        # Mean circumferential speed of the driven wheels [m/s].
        ("wheel_speed_mps", ctypes.c_double),
        # Measured angle of the front wheels, left positive [rad].
        ("steering_rad", ctypes.c_double),
        # Forward speed that the actuators were told last before this was measured [m/s].
        ("applied_speed_mps", ctypes.c_float),
        # Angle of the front wheels that they were told, left positive [rad].
        ("applied_steering_rad", ctypes.c_float),
        # When they were first told so [ns].
        ("applied_since_ns", ctypes.c_uint64),
        # Who decided it: 0 = the last command, 1 = the vehicle itself, be it its watchdog or an operator.
        ("applied_by", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Odometry"


assert ctypes.sizeof(OdometryRecord) == 112
assert OdometryRecord.position_m.offset == 0
assert OdometryRecord.attitude_rad.offset == 24
assert OdometryRecord.velocity_mps.offset == 48
assert OdometryRecord.yaw_rate_radps.offset == 64
assert OdometryRecord.wheel_speed_mps.offset == 72
assert OdometryRecord.steering_rad.offset == 80
assert OdometryRecord.applied_speed_mps.offset == 88
assert OdometryRecord.applied_steering_rad.offset == 92
assert OdometryRecord.applied_since_ns.offset == 96
assert OdometryRecord.applied_by.offset == 104


class ImuRecord(ctypes.Structure):
    """One sample of the inertial measurement unit, in the body frame."""

    _fields_ = [
        # When it was measured, monotonic [ns].
        ("valid_at_ns", ctypes.c_uint64),
        # Specific force [m/s2]; (0, 0, +9.81) at rest on level ground.
        ("acceleration_mps2", ctypes.c_float * 3),
        # Angular rate [rad/s].
        ("angular_rate_radps", ctypes.c_float * 3),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Imu"


assert ctypes.sizeof(ImuRecord) == 32
assert ImuRecord.valid_at_ns.offset == 0
assert ImuRecord.acceleration_mps2.offset == 8
assert ImuRecord.angular_rate_radps.offset == 20


class ScanHeader(ctypes.Structure):
    """Header of a sweep of the range sensor; the payload is one PointRecord per return."""

    _fields_ = [
        # Whose and of when.
        ("stamp", Stamp),
        # Where the rays start, in the frame of the points [m].
        ("origin_m", ctypes.c_float * 3),
        # Whose frame the points are of: 0 = the vehicle's body, else the sensor of this number, from 1.
        ("sensor", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.ScanHeader"


assert ctypes.sizeof(ScanHeader) == 56
assert ScanHeader.stamp.offset == 0
assert ScanHeader.origin_m.offset == 40
assert ScanHeader.sensor.offset == 52


class PointRecord(ctypes.Structure):
    """One return of the range sensor."""

    _fields_ = [
        # Place in the frame that the header names [m].
        ("position_m", ctypes.c_float * 3),
        # What it is: 0 open, 1 loose, 2 vegetation, 3 obstacle.
        ("class_number", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Point"


assert ctypes.sizeof(PointRecord) == 16
assert PointRecord.position_m.offset == 0
assert PointRecord.class_number.offset == 12


class SurfaceHeader(ctypes.Structure):
    """Header of the map of the ground; the payload is eight numbers per cell, see docs/runtime.md."""

    _fields_ = [
        # Whose and of when: valid_at_ns is that of the scan.
        ("stamp", Stamp),
        # Where the cells lie.
        ("grid", Grid),
        # The scan that was fused last.
        ("scan", Source),
        # Where the vehicle was when the scan was taken, or the odometry that showed the jump; nothing of what was applied.
        ("odometry", OdometryRecord),
        # When that was [ns].
        ("odometry_at_ns", ctypes.c_uint64),
        # When the odometry was measured in whose frame the map lies: the newest that mapping had taken in [ns].
        ("frame_at_ns", ctypes.c_uint64),
        # The odometry that mapping took in last before this map, usable or not.
        ("last_odometry", Source),
        # How many it took in since the map before.
        ("n_odometry", ctypes.c_uint64),
        # XXH3 of these, each its stamp and its record, in the order in which they were taken in.
        ("odometry_hash", ctypes.c_uint64),
        # What happened since the last message: 1 = a scan was fused, 2 = the localisation jumped.
        ("event", ctypes.c_uint64),
        # The jump, if that is what happened: p of before lies at R(jump_yaw_rad) p + jump_m [m].
        ("jump_m", ctypes.c_double * 3),
        # Its turn, counter-clockwise [rad].
        ("jump_yaw_rad", ctypes.c_double),
        # All jumps so far together, likewise [m].
        ("shift_m", ctypes.c_double * 3),
        # Their turn [rad].
        ("shift_yaw_rad", ctypes.c_double),
        # XXH3 of the payload.
        ("content_hash", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.SurfaceHeader"


assert ctypes.sizeof(SurfaceHeader) == 336
assert SurfaceHeader.stamp.offset == 0
assert SurfaceHeader.grid.offset == 40
assert SurfaceHeader.scan.offset == 80
assert SurfaceHeader.odometry.offset == 96
assert SurfaceHeader.odometry_at_ns.offset == 208
assert SurfaceHeader.frame_at_ns.offset == 216
assert SurfaceHeader.last_odometry.offset == 224
assert SurfaceHeader.n_odometry.offset == 240
assert SurfaceHeader.odometry_hash.offset == 248
assert SurfaceHeader.event.offset == 256
assert SurfaceHeader.jump_m.offset == 264
assert SurfaceHeader.jump_yaw_rad.offset == 288
assert SurfaceHeader.shift_m.offset == 296
assert SurfaceHeader.shift_yaw_rad.offset == 320
assert SurfaceHeader.content_hash.offset == 328


class TracksHeader(ctypes.Structure):
    """Header of what moves; the payload is one TrackRecord for each thing, the nearest first, at most TRACKS_MAX."""

    _fields_ = [
        # Whose and of when: valid_at_ns is that of the scan.
        ("stamp", Stamp),
        # The scan that shows where they are.
        ("scan", Source),
        # When the odometry was measured in whose frame they lie [ns].
        ("frame_at_ns", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.TracksHeader"


assert ctypes.sizeof(TracksHeader) == 64
assert TracksHeader.stamp.offset == 0
assert TracksHeader.scan.offset == 40
assert TracksHeader.frame_at_ns.offset == 56


class TrackRecord(ctypes.Structure):
    """A thing that moves."""

    _fields_ = [
        # Counts the things that mapping has seen, from 1.
        ("number", ctypes.c_uint64),
        # Centre in the map frame, east and north [m].
        ("position_m", ctypes.c_double * 2),
        # Velocity, east and north [m/s].
        ("velocity_mps", ctypes.c_double * 2),
        # Variance of the position along each axis [m2].
        ("position_m2", ctypes.c_double),
        # Covariance of position and velocity along each axis [m2/s].
        ("cross_m2ps", ctypes.c_double),
        # Variance of the velocity along each axis [m2/s2].
        ("velocity_m2ps2", ctypes.c_double),
        # Radius of the thing [m].
        ("radius_m", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Track"


assert ctypes.sizeof(TrackRecord) == 72
assert TrackRecord.number.offset == 0
assert TrackRecord.position_m.offset == 8
assert TrackRecord.velocity_mps.offset == 24
assert TrackRecord.position_m2.offset == 40
assert TrackRecord.cross_m2ps.offset == 48
assert TrackRecord.velocity_m2ps2.offset == 56
assert TrackRecord.radius_m.offset == 64


class RiskHeader(ctypes.Structure):
    """Header of a risk map; the payload is risks, grounds and times to the goal, see docs/runtime.md."""

    _fields_ = [
        # Whose and of when: valid_at_ns is that of the scan.
        ("stamp", Stamp),
        # Where the cells lie.
        ("grid", Grid),
        # Yaw bins; bin k is centred at (k + 1/2) 2 pi / n_yaws.
        ("n_yaws", ctypes.c_uint64),
        # Who judged the ground: 1 = what was learned, 2 = physics alone.
        ("map_source", ctypes.c_uint64),
        # The map of the ground that was judged.
        ("surface", Source),
        # When the odometry was measured in whose frame that map lies [ns].
        ("odometry_at_ns", ctypes.c_uint64),
        # Stuck poses that it takes into account.
        ("stuck", Source),
        # Where the time to the goal leads [m].
        ("goal_m", ctypes.c_double * 2),
        # Distance from there within which the straight line counts [m].
        ("tolerance_m", ctypes.c_double),
        # Headings for which is told what turning adds to it: 16, or 0 for a vehicle that turns on the spot.
        ("n_headings", ctypes.c_uint64),
        # Share of the worst outcomes that was judged for, in (0, 1].
        ("alpha", ctypes.c_double),
        # First 8 bytes of the SHA-256 of the networks' weights; 0 = none.
        ("checkpoint", ctypes.c_uint64),
        # XXH3 of the payload.
        ("content_hash", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.RiskHeader"


assert ctypes.sizeof(RiskHeader) == 192
assert RiskHeader.stamp.offset == 0
assert RiskHeader.grid.offset == 40
assert RiskHeader.n_yaws.offset == 80
assert RiskHeader.map_source.offset == 88
assert RiskHeader.surface.offset == 96
assert RiskHeader.odometry_at_ns.offset == 112
assert RiskHeader.stuck.offset == 120
assert RiskHeader.goal_m.offset == 136
assert RiskHeader.tolerance_m.offset == 152
assert RiskHeader.n_headings.offset == 160
assert RiskHeader.alpha.offset == 168
assert RiskHeader.checkpoint.offset == 176
assert RiskHeader.content_hash.offset == 184


class CommandRecord(ctypes.Structure):
    """What the vehicle shall do. It grows old from when what it was decided on was measured, whenever it is sent."""

    _fields_ = [
        # Forward speed, negative in reverse [m/s].
        ("speed_mps", ctypes.c_float),
        # Angle of the front wheels, left positive [rad].
        ("steering_rad", ctypes.c_float),
        # 1 = drive, 2 = hold, 3 = stop; the command counts only when driving.
        ("decision", ctypes.c_uint32),
        # Why, when it is not driving; see docs/runtime.md.
        ("reason", ctypes.c_uint32),
        # When the odometry was measured that it was decided on [ns]; 0 = none.
        ("odometry_at_ns", ctypes.c_uint64),
        # When the scan was measured that the map ends with that it was decided on [ns]; 0 = no map.
        ("scan_at_ns", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Command"


assert ctypes.sizeof(CommandRecord) == 32
assert CommandRecord.speed_mps.offset == 0
assert CommandRecord.steering_rad.offset == 4
assert CommandRecord.decision.offset == 8
assert CommandRecord.reason.offset == 12
assert CommandRecord.odometry_at_ns.offset == 16
assert CommandRecord.scan_at_ns.offset == 24


class DecisionRecord(ctypes.Structure):
    """A decision with all that it was made from."""

    _fields_ = [
        # What was decided.
        ("command", CommandRecord),
        # Number of the decision since the process began.
        ("cycle", ctypes.c_uint64),
        # When it was made [ns].
        ("decided_at_ns", ctypes.c_uint64),
        # The odometry that was taken in last.
        ("odometry", Source),
        # How many were taken in since the decision before, without a gap up to the last.
        ("n_odometry", ctypes.c_uint64),
        # The risk map; none when there was none.
        ("risk", Source),
        # Who made that map: 0 = none, 1 = what was learned, 2 = physics alone.
        ("map_source", ctypes.c_uint64),
        # What was said last of where to go.
        ("mission", Source),
        # The newest map of what was learned that there was to choose from.
        ("learned", Source),
        # The newest map of physics alone that there was to choose from.
        ("physics", Source),
        # What was known last of what moves; none where nothing is tracked.
        ("tracks", Source),
        # Where to go [m].
        ("goal_m", ctypes.c_double * 2),
        # How near counts as there [m].
        ("tolerance_m", ctypes.c_double),
        # Futures that were sampled.
        ("n_rollouts", ctypes.c_uint64),
        # Time since the decision before [s].
        ("elapsed_s", ctypes.c_double),
        # State that it was made for: x, y [m], yaw [rad], speed [m/s], steering [rad].
        ("state", ctypes.c_double * 5),
        # The message of the IMU that was taken in last; none where nobody corrects commands.
        ("imu", Source),
        # How many were taken in since the decision before, without a gap up to the last.
        ("n_imu", ctypes.c_uint64),
        # How the command was corrected: 0 = by nobody, else what became of it; see docs/runtime.md.
        ("correction", ctypes.c_uint32),
        # Share that the correction had, 0 to 1.
        ("correction_share", ctypes.c_float),
        # Curvature that it added [1/m].
        ("curvature_change_per_m", ctypes.c_float),
        # Angle of the front wheels before it [rad].
        ("planned_steering_rad", ctypes.c_float),
        # Time that the decision took [ns].
        ("duration_ns", ctypes.c_uint64),
        # By how much the cycle began after its deadline [ns].
        ("lateness_ns", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.DecisionRecord"


assert ctypes.sizeof(DecisionRecord) == 296
assert DecisionRecord.command.offset == 0
assert DecisionRecord.cycle.offset == 32
assert DecisionRecord.decided_at_ns.offset == 40
assert DecisionRecord.odometry.offset == 48
assert DecisionRecord.n_odometry.offset == 64
assert DecisionRecord.risk.offset == 72
assert DecisionRecord.map_source.offset == 88
assert DecisionRecord.mission.offset == 96
assert DecisionRecord.learned.offset == 112
assert DecisionRecord.physics.offset == 128
assert DecisionRecord.tracks.offset == 144
assert DecisionRecord.goal_m.offset == 160
assert DecisionRecord.tolerance_m.offset == 176
assert DecisionRecord.n_rollouts.offset == 184
assert DecisionRecord.elapsed_s.offset == 192
assert DecisionRecord.state.offset == 200
assert DecisionRecord.imu.offset == 240
assert DecisionRecord.n_imu.offset == 256
assert DecisionRecord.correction.offset == 264
assert DecisionRecord.correction_share.offset == 268
assert DecisionRecord.curvature_change_per_m.offset == 272
assert DecisionRecord.planned_steering_rad.offset == 276
assert DecisionRecord.duration_ns.offset == 280
assert DecisionRecord.lateness_ns.offset == 288


class PlanRecord(ctypes.Structure):
    """A place of the way that is meant to be driven."""

    _fields_ = [
        # Rear axle's centre in the frame of the map that it was planned on, east and north [m].
        ("position_m", ctypes.c_double * 2),
        # Heading [rad].
        ("yaw_rad", ctypes.c_double),
        # Speed there [m/s].
        ("speed_mps", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Plan"


assert ctypes.sizeof(PlanRecord) == 32
assert PlanRecord.position_m.offset == 0
assert PlanRecord.yaw_rad.offset == 16
assert PlanRecord.speed_mps.offset == 24


class FutureRecord(ctypes.Structure):
    """A place of one of the futures that were tried."""

    _fields_ = [
        # Rear axle's centre in the frame of the map that it was tried on, east and north [m].
        ("position_m", ctypes.c_double * 2),
        # Cost of the whole future [s].
        ("cost_s", ctypes.c_double),
        # Which future; the places of one follow one another.
        ("number", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Future"


assert ctypes.sizeof(FutureRecord) == 32
assert FutureRecord.position_m.offset == 0
assert FutureRecord.cost_s.offset == 16
assert FutureRecord.number.offset == 24


class StuckRecord(ctypes.Structure):
    """Where the vehicle got stuck."""

    _fields_ = [
        # Rear axle's centre [m].
        ("position_m", ctypes.c_double * 2),
        # Heading [rad].
        ("yaw_rad", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Stuck"


assert ctypes.sizeof(StuckRecord) == 24
assert StuckRecord.position_m.offset == 0
assert StuckRecord.yaw_rad.offset == 16


class MissionRecord(ctypes.Structure):
    """What the vehicle is told to do: said again once a second, and at once when it changes. Unless repeated, it is lost."""

    _fields_ = [
        # The place in the map frame that is headed for: a goal, or the end of the part of a path that is shown [m].
        ("goal_m", ctypes.c_double * 2),
        # How near counts as there; 0 = to be passed through, because others follow [m].
        ("tolerance_m", ctypes.c_double),
        # Time since the mission began [s].
        ("time_s", ctypes.c_double),
        # 0 = under way, else how it ended; see docs/runtime.md.
        ("outcome", ctypes.c_uint64),
        # 0 = drive, 1 = there is no mission, 2 = paused, 3 = an operator has the wheel, 4 = emergency stop.
        ("state", ctypes.c_uint64),
        # Missions so far, this one included.
        ("number", ctypes.c_uint64),
        # The point of the route that is headed for, from 0.
        ("leg", ctypes.c_uint64),
        # Points of the route.
        ("n_legs", ctypes.c_uint64),
        # Share of the worst outcomes to plan for, in (0, 1]; 0 = as the run was started.
        ("alpha", ctypes.c_double),
        # The order that was judged last.
        ("order", Source),
        # What became of it: 0 = taken, else why it was refused; see docs/runtime.md.
        ("verdict", ctypes.c_uint64),
        # Orders refused so far.
        ("n_refused", ctypes.c_uint64),
        # Speed along the path [m/s]; 0 = there is no path, but a goal.
        ("path_speed_mps", ctypes.c_double),
        # Corners of the part of the path that is shown.
        ("n_corners", ctypes.c_uint64),
        # Where they lie, east [m].
        ("corner_x_m", ctypes.c_double * 32),
        # Where they lie, north [m].
        ("corner_y_m", ctypes.c_double * 32),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Mission"


assert ctypes.sizeof(MissionRecord) == 640
assert MissionRecord.goal_m.offset == 0
assert MissionRecord.tolerance_m.offset == 16
assert MissionRecord.time_s.offset == 24
assert MissionRecord.outcome.offset == 32
assert MissionRecord.state.offset == 40
assert MissionRecord.number.offset == 48
assert MissionRecord.leg.offset == 56
assert MissionRecord.n_legs.offset == 64
assert MissionRecord.alpha.offset == 72
assert MissionRecord.order.offset == 80
assert MissionRecord.verdict.offset == 96
assert MissionRecord.n_refused.offset == 104
assert MissionRecord.path_speed_mps.offset == 112
assert MissionRecord.n_corners.offset == 120
assert MissionRecord.corner_x_m.offset == 128
assert MissionRecord.corner_y_m.offset == 384


class OrderHeader(ctypes.Structure):
    """Header of an order; the payload is the points of the route, east and north [m], two f64 each."""

    _fields_ = [
        # Whose and of when: valid_at_ns is when it was said.
        ("stamp", Stamp),
        # 1 goals, 2 path, 3 pause, 4 resume, 5 cancel, 6 take over, 7 emergency stop, 8 reset, 9 share of outcomes.
        ("kind", ctypes.c_uint64),
        # How near to a point counts as there [m]; 0 = as the run was started.
        ("tolerance_m", ctypes.c_double),
        # Speed along a path [m/s].
        ("speed_mps", ctypes.c_double),
        # Share of the worst outcomes to plan for, in (0, 1].
        ("alpha", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.OrderHeader"


assert ctypes.sizeof(OrderHeader) == 72
assert OrderHeader.stamp.offset == 0
assert OrderHeader.kind.offset == 40
assert OrderHeader.tolerance_m.offset == 48
assert OrderHeader.speed_mps.offset == 56
assert OrderHeader.alpha.offset == 64


class CheckpointHeader(ctypes.Structure):
    """Header of networks learned while driving; the payload is weights, then sidecar, as the bytes of their files."""

    _fields_ = [
        # Whose and of when.
        ("stamp", Stamp),
        # First 8 bytes of the SHA-256 of the weights.
        ("checkpoint", ctypes.c_uint64),
        # Bytes of the weights; the sidecar follows.
        ("n_weight_bytes", ctypes.c_uint64),
        # Footprints learned from, and judged by.
        ("n_examples", ctypes.c_uint64 * 2),
        # EMD2 on held-out footprints of the drive, of the networks before and of these.
        ("recent_emd2", ctypes.c_double * 2),
        # EMD2 on the original validation data, of the original networks and of these.
        ("original_emd2", ctypes.c_double * 2),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.CheckpointHeader"


assert ctypes.sizeof(CheckpointHeader) == 104
assert CheckpointHeader.stamp.offset == 0
assert CheckpointHeader.checkpoint.offset == 40
assert CheckpointHeader.n_weight_bytes.offset == 48
assert CheckpointHeader.n_examples.offset == 56
assert CheckpointHeader.recent_emd2.offset == 72
assert CheckpointHeader.original_emd2.offset == 88


class StatusRecord(ctypes.Structure):
    """How a process is doing, twice a second."""

    _fields_ = [
        # 1 plant, 2 mapping, 3 learning, 4 control, 5 recorder, 6 mission, 7 ros.
        ("role", ctypes.c_uint64),
        # Process id.
        ("process", ctypes.c_uint64),
        # Cycles or messages a second since the last status [Hz].
        ("rate_hz", ctypes.c_double),
        # Median and largest lateness since the last status [s].
        ("lateness_s", ctypes.c_double * 2),
        # Age of up to four inputs when they were last used [s]; negative = none yet.
        ("age_s", ctypes.c_double * 4),
        # Deadlines missed since the process began.
        ("n_missed", ctypes.c_uint64),
        # Messages lost on the way, by gaps in their numbers.
        ("n_lost", ctypes.c_uint64),
        # Messages refused.
        ("n_refused", ctypes.c_uint64),
        # Looks at a channel that the transport broke off.
        ("n_failed", ctypes.c_uint64),
        # Figure of the role's own: speed [m/s], jumps made out, futures sampled, recorded bytes, messages of the robot.
        ("figure", ctypes.c_double),
    ]

    @staticmethod
    def type_name() -> str:
        return "surefoot.Status"


assert ctypes.sizeof(StatusRecord) == 112
assert StatusRecord.role.offset == 0
assert StatusRecord.process.offset == 8
assert StatusRecord.rate_hz.offset == 16
assert StatusRecord.lateness_s.offset == 24
assert StatusRecord.age_s.offset == 40
assert StatusRecord.n_missed.offset == 72
assert StatusRecord.n_lost.offset == 80
assert StatusRecord.n_refused.offset == 88
assert StatusRecord.n_failed.offset == 96
assert StatusRecord.figure.offset == 104
